//! `bb eval navigation` on recorded and simulated drives and flights: what `robot!` runs, with one set of options for all.

use bb_eval::{DataSet, NavigationFilter, NavigationRun, NavigationScore, RobotSettings, play_navigation};
use bb_tests::recordings::navigation;
use std::error::Error;
use std::path::Path;

fn score(prefix: &Path, name: &str, settings: &[&str]) -> Result<NavigationScore, Box<dyn Error>> {
    let filter: NavigationFilter = name.parse()?;
    let settings: Vec<_> = settings.iter().map(|text| text.parse()).collect::<Result<_, _>>()?;
    let settings = RobotSettings::new(&filter, None, &settings, None)?;
    let run = NavigationRun { settings, ..NavigationRun::default() };
    Ok(play_navigation(&DataSet::read(prefix)?.drive(), &filter, &run, || {})?.score)
}

/// An estimate with each sample of the IMU of a drive, so that there is one at each instant of its truth.
const EACH: &[&str] = &["output_rate=100 Hz"];

/// The noise of the drives, tuned by hand.
const TUNED: &[&str] = &["output_rate=100 Hz", "gyroscope_noise=5e-3", "accelerometer_noise=5e-2"];

/// A row of what is known.
type Known = (&'static str, &'static str, &'static [&'static str], f64, std::ops::Range<f64>);

/// Data set, filter, options, the position that was measured, m, and the NEES that is accepted.
const KNOWN: [Known; 16] = [
    ("euroc_mh01", "eskf", &[], 0.553, 5.0..9.0),
    ("euroc_mh01", "state-smoother", &[], 0.573, 5.0..9.0),
    ("simflight", "eskf", &[], 0.830, 3.0..7.0),
    ("simflight", "state-smoother", &[], 0.826, 3.0..7.0),
    ("simflight_stress", "eskf", &[], 1.113, 4.0..7.0),
    ("simflight_stress", "state-smoother", &[], 1.068, 4.0..7.0),
    ("kitti_s2", "eskf", &[], 0.412, 0.8..4.0),
    ("kitti_s5", "eskf", &[], 1.782, 1.0..4.0),
    ("kitti_s10", "eskf", &[], 8.642, 1.0..4.0),
    ("kitti_s2", "state-eskf", EACH, 0.422, 1.0..4.0),
    ("kitti_s5", "state-eskf", EACH, 1.868, 1.0..4.0),
    ("kitti_s10", "state-eskf", EACH, 8.765, 1.0..4.0),
    ("kitti_s2", "state-smoother", EACH, 0.422, 1.0..4.0),
    ("kitti_s5", "state-smoother", EACH, 1.879, 1.0..4.0),
    ("kitti_s10", "state-smoother", EACH, 8.787, 1.0..4.0),
    ("kitti_s10", "state-smoother", TUNED, 7.921, 1.0..4.0),
];

#[test]
fn errors_are_no_greater_than_known() -> Result<(), Box<dyn Error>> {
    let folder = navigation()?;
    for (name, filter, settings, known, range) in KNOWN {
        let score = score(&folder.join(name), filter, settings)?;
        let (position, nees) = (score.position_m.ok_or("no truth")?.rms, score.nees.ok_or("no covariance")?);
        println!("{name}, {filter}: {position:.3} m, NEES {nees:.2}, {} instants", score.scored);
        assert!(position <= 1.02 * known, "{name}, {filter}: {position} m was {known}");
        assert!(range.contains(&nees), "{name}, {filter}: NEES {nees}");
    }
    Ok(())
}
