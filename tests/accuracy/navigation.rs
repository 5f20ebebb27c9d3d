//! `bb eval navigation` on recorded and simulated drives and flights: what `robot!` runs, with one set of options for all.

use bb_eval::{
    BagOptions, DataSet, Drive, NavigationBag, NavigationFilter, NavigationRun, NavigationScore, RobotSettings,
    play_navigation,
};
use bb_tests::recordings::{navigation, vehicles};
use std::error::Error;
use std::path::Path;

pub(super) fn score(drive: &Drive, name: &str, settings: &[&str]) -> Result<NavigationScore, Box<dyn Error>> {
    let filter: NavigationFilter = name.parse()?;
    let settings: Vec<_> = settings.iter().map(|text| text.parse()).collect::<Result<_, _>>()?;
    let settings = RobotSettings::new(&filter, None, &settings, None)?;
    let run = NavigationRun { settings, ..NavigationRun::default() };
    Ok(play_navigation(drive, &filter, &run, || {})?.score)
}

/// An estimate with each sample of the IMU of a drive, so that there is one at each instant of its truth.
const EACH: &[&str] = &["output_rate=100 Hz"];

/// The noise of the drives, tuned by hand.
const TUNED: &[&str] = &["gyroscope_noise=5e-3", "accelerometer_noise=5e-2"];
const TUNED_EACH: &[&str] = &["output_rate=100 Hz", "gyroscope_noise=5e-3", "accelerometer_noise=5e-2"];

/// A row of what is known.
type Known = (&'static str, &'static str, &'static [&'static str], f64, std::ops::Range<f64>);

/// Data set, filter, options, the position that was measured, m, and the NEES that is accepted.
const KNOWN: [Known; 19] = [
    ("euroc_mh01", "eskf", &[], 0.553, 5.0..9.0),
    ("euroc_mh01", "state-smoother", &[], 0.573, 5.0..9.0),
    ("simflight", "eskf", &[], 0.830, 3.0..7.0),
    ("simflight", "state-smoother", &[], 0.826, 3.0..7.0),
    ("simflight_stress", "eskf", &[], 1.113, 4.0..7.0),
    ("simflight_stress", "state-smoother", &[], 1.068, 4.0..7.0),
    ("kitti_s2", "eskf", &[], 0.412, 0.8..4.0),
    ("kitti_s5", "eskf", &[], 1.789, 1.0..4.0),
    ("kitti_s10", "eskf", &[], 8.853, 1.0..4.0),
    ("kitti_s2", "eskf", TUNED, 0.368, 0.8..5.0),
    ("kitti_s5", "eskf", TUNED, 1.567, 0.8..5.0),
    ("kitti_s10", "eskf", TUNED, 7.781, 0.8..5.0),
    ("kitti_s2", "state-eskf", EACH, 0.422, 1.0..4.0),
    ("kitti_s5", "state-eskf", EACH, 1.868, 1.0..4.0),
    ("kitti_s10", "state-eskf", EACH, 8.765, 1.0..4.0),
    ("kitti_s2", "state-smoother", EACH, 0.422, 1.0..4.0),
    ("kitti_s5", "state-smoother", EACH, 1.879, 1.0..4.0),
    ("kitti_s10", "state-smoother", EACH, 8.787, 1.0..4.0),
    ("kitti_s10", "state-smoother", TUNED_EACH, 7.921, 1.0..4.0),
];

#[test]
fn errors_are_no_greater_than_known() -> Result<(), Box<dyn Error>> {
    let folder = navigation()?;
    for (name, filter, settings, known, range) in KNOWN {
        let score = score(&DataSet::read(&folder.join(name))?.drive(), filter, settings)?;
        let (position, nees) = (score.position_m.ok_or("no truth")?.rms, score.nees.ok_or("no covariance")?);
        println!("{name}, {filter}: {position:.3} m, NEES {nees:.2}, {} instants", score.scored);
        assert!(position <= 1.02 * known, "{name}, {filter}: {position} m was {known}");
        assert!(range.contains(&nees), "{name}, {filter}: NEES {nees}");
    }
    Ok(())
}

/// The data sheet of the car's IMU, times five, and over five.
pub(super) const SHEET: [&[&str]; 3] = [
    &["gyroscope_noise=6.6e-5", "accelerometer_noise=6.9e-4"],
    &["gyroscope_noise=3.3e-4", "accelerometer_noise=3.45e-3"],
    &["gyroscope_noise=1.32e-5", "accelerometer_noise=1.38e-4"],
];

/// Options of `Eskf` for a bag: the mount of a frame, and the topics that are not those of the bag alone.
pub(super) fn vehicle(
    folder: &Path,
    name: &str,
    mounts: &[&str],
    topics: [Option<&str>; 3],
) -> Result<Drive, Box<dyn Error>> {
    let [gnss, truth, odometry] = topics.map(|topic| topic.map(str::to_owned));
    let mount = mounts.iter().map(|mount| mount.parse()).collect::<Result<_, _>>()?;
    let origin = name.starts_with("comma").then(|| "37.721000009,-122.472299089,31.6392".parse()).transpose()?;
    let options =
        BagOptions { gnss_topic: gnss, truth, odometry_topic: odometry, mount, origin, ..BagOptions::default() };
    Ok(NavigationBag::read(&folder.join(name).with_extension("mcap"), &options)?.drive()?)
}

/// A row of vehicles: the bag, its mounts and topics, the options, the position that was measured, m, and the NEES that is accepted.
type Vehicle = (
    &'static str,
    &'static [&'static str],
    [Option<&'static str>; 3],
    &'static [&'static str],
    f64,
    std::ops::Range<f64>,
);

pub(super) const CAR: &[&str] = &["gps=0,0.05,0"];
pub(super) const FIXES: [Option<&str>; 3] = [Some("/gps/fix"), Some("/truth/fix"), None];
const HUSKY: &[&str] = &["gps=0,0.3,0", "base=0,0.3,-0.52"];
const WHEELS: [Option<&str>; 3] = [Some("/gps/fix"), Some("/truth/fix"), Some("/odom")];
const NO_WHEELS: [Option<&str>; 3] = [None, None, Some("none")];
const OWN: [Option<&str>; 3] = [None; 3];

const VEHICLES: [Vehicle; 12] = [
    ("drive_s4", CAR, FIXES, SHEET[0], 0.036, 2.0..5.0),
    ("drive_s4", CAR, FIXES, SHEET[1], 0.034, 1.5..5.0),
    ("drive_s4", CAR, FIXES, SHEET[2], 0.036, 2.0..5.0),
    ("drive_s4_rot", CAR, FIXES, SHEET[0], 0.036, 2.0..5.0),
    ("drive_o30", CAR, FIXES, SHEET[0], 6.18, 0.5..5.0),
    ("drive_o30", CAR, FIXES, SHEET[1], 7.92, 0.5..5.0),
    ("drive_o30", CAR, FIXES, SHEET[2], 6.68, 0.5..5.0),
    ("comma", &["car=0,0,0"], OWN, &[], 0.533, 0.5..4.0),
    ("comma", &["car=0,0,0"], NO_WHEELS, &[], 0.677, 0.5..4.0),
    ("comma_late", &["car=0,0,0"], OWN, &[], 1.139, 0.5..4.0),
    ("husky_flat", HUSKY, WHEELS, &[], 1.310, 1.0..9.0),
    ("husky_o30_flat", HUSKY, WHEELS, &[], 4.103, 1.0..20.0),
];

#[test]
fn vehicles_are_followed_as_well_as_known() -> Result<(), Box<dyn Error>> {
    let folder = vehicles()?;
    for (name, mounts, topics, settings, known, range) in VEHICLES {
        let score = score(&vehicle(&folder, name, mounts, topics)?, "eskf", settings)?;
        let (position, nees) = (score.position_m.ok_or("no truth")?.rms, score.nees.ok_or("no covariance")?);
        println!("{name}, {settings:?}: {position:.3} m, NEES {nees:.2}, {} instants", score.scored);
        assert!(position <= 1.02 * known, "{name}, {settings:?}: {position} m was {known}");
        assert!(range.contains(&nees), "{name}, {settings:?}: NEES {nees}");
    }
    Ok(())
}

/// Time of the car's first movement since its first sample, s: before, its fixes stay within 15 mm.
const MOVES_S: f64 = 34.6;

#[test]
fn a_heading_is_known_soon_after_the_car_moves() -> Result<(), Box<dyn Error>> {
    let car = vehicle(&vehicles()?, "drive_s4_rot", CAR, FIXES)?;
    let score = score(&car, "eskf", SHEET[0])?;
    let is_of_heading = |wrong: &&bb_eval::Wrong| wrong.reason == "the heading is not known yet";
    let unknown_s = score.wrong.iter().find(is_of_heading).ok_or("it was always known")?.seconds;
    let after_s = score.started_s + unknown_s - MOVES_S;
    println!("heading known {after_s:.1} s after the car moves");
    assert!(after_s < 5.0, "{after_s} s");
    Ok(())
}

/// The flight filter starts from rest and from a heading that it is told. The car's engine idles, so that it first rests at its second stop.
#[test]
fn flights_refuse_no_good_fix() -> Result<(), Box<dyn Error>> {
    let car = vehicle(&vehicles()?, "drive_s4", CAR, FIXES)?;
    let start = [
        "output_rate=100 Hz",
        "origin_latitude=40.09721 deg",
        "origin_longitude=-105.14764 deg",
        "origin_height=1597.4 m",
        "heading=88 deg",
    ];
    let score = score(&car, "state-eskf", &[&start, SHEET[0]].concat())?;
    println!("{} fixes refused since {:.0} s", score.refused, score.started_s);
    assert!(score.started_s < 250.0 && score.refused == 0, "{} since {} s", score.refused, score.started_s);
    Ok(())
}
