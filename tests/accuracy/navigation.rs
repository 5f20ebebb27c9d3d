//! `bb eval navigation` on recorded and simulated drives and flights, with one set of parameters for all.

use bb_eval::{DataSet, NAVIGATION_FILTERS, evaluate_navigation};
use bb_tests::recordings::{SETS, navigation};
use std::error::Error;
use std::path::Path;

/// A data set and what was measured on it with the default filter.
struct Known {
    name: &'static str,
    /// m.
    position: f64,
    /// Degrees; none on drives, whose truth has no orientation.
    orientation: Option<f64>,
    /// The greatest distance of the normalised error from its dimension that is accepted, both ways.
    nees: (f64, f64),
}

const KNOWN: [Known; SETS - 1] = [
    Known { name: "euroc_mh01", position: 0.556, orientation: Some(0.618), nees: (5.0, 8.2) },
    Known { name: "kitti_s10", position: 7.802, orientation: None, nees: (2.0, 4.0) },
    Known { name: "kitti_s2", position: 0.253, orientation: None, nees: (2.0, 4.0) },
    Known { name: "kitti_s5", position: 1.506, orientation: None, nees: (2.0, 4.0) },
    Known { name: "simflight", position: 0.790, orientation: Some(0.285), nees: (4.8, 7.0) },
    Known { name: "simflight_stress", position: 1.092, orientation: Some(0.309), nees: (4.8, 7.0) },
];

#[test]
fn errors_are_no_greater_than_known() -> Result<(), Box<dyn Error>> {
    let folder = navigation()?;
    let filter = &NAVIGATION_FILTERS[0];
    for Known { name, position, orientation, nees: (least, most) } in KNOWN {
        let score = evaluate_navigation(&DataSet::read(&folder.join(name))?, filter, &[], 20, || {})?;
        println!(
            "{name}: {:.3} m, {:.3?}°, {:.3?} m/s, NEES {:.2}, {} keyframes",
            score.position_rmse_m, score.orientation_rmse_deg, score.velocity_rmse_mps, score.nees, score.keyframes
        );
        assert!(score.position_rmse_m <= 1.02 * position, "{name}: {} m was {position}", score.position_rmse_m);
        let turned = score.orientation_rmse_deg.zip(orientation);
        assert!(turned.is_none_or(|(measured, known)| measured <= 1.02 * known), "{name}: {turned:?}°");
        assert_eq!(score.orientation_rmse_deg.is_some(), orientation.is_some(), "{name}");
        assert!((least..most).contains(&score.nees), "{name}: NEES {}", score.nees);
    }
    Ok(())
}

/// A data set and what the smoother reaches on it.
struct Smoothed {
    name: &'static str,
    /// Of the newest keyframe, m, and its largest NEES that is accepted, with the least.
    position: f64,
    nees: (f64, f64),
    /// Of the newest, degrees.
    orientation: Option<f64>,
    /// Of the oldest in a window of 20, m.
    oldest: f64,
}

const SMOOTHED: [Smoothed; SETS - 1] = [
    Smoothed { name: "euroc_mh01", position: 0.556, nees: (5.0, 8.2), orientation: Some(0.618), oldest: 0.558 },
    Smoothed { name: "kitti_s10", position: 7.822, nees: (2.0, 4.0), orientation: None, oldest: 0.639 },
    Smoothed { name: "kitti_s2", position: 0.253, nees: (2.0, 4.0), orientation: None, oldest: 0.107 },
    Smoothed { name: "kitti_s5", position: 1.504, nees: (2.0, 4.0), orientation: None, oldest: 0.181 },
    Smoothed { name: "simflight", position: 0.567, nees: (5.0, 6.5), orientation: Some(0.191), oldest: 0.517 },
    Smoothed {
        name: "simflight_stress",
        position: 0.695,
        nees: (5.0, 8.0),
        orientation: Some(0.225),
        oldest: 0.588,
    },
];

#[test]
fn the_smoother_errs_no_more_than_known() -> Result<(), Box<dyn Error>> {
    let folder = navigation()?;
    let smoother = NAVIGATION_FILTERS.iter().find(|filter| filter.name == "smoother").ok_or("no such filter")?;
    for Smoothed { name, position, nees: (least, most), orientation, oldest } in SMOOTHED {
        let score = evaluate_navigation(&DataSet::read(&folder.join(name))?, smoother, &[], 20, || {})?;
        let smoothed = score.position_smoothed_rmse_m.ok_or("a window was never full")?;
        println!(
            "{name}: {:.3} m, {:.3?}°, NEES {:.2}, oldest {smoothed:.3} m",
            score.position_rmse_m, score.orientation_rmse_deg, score.nees
        );
        assert!(score.position_rmse_m <= 1.02 * position, "{name}: {} m was {position}", score.position_rmse_m);
        let turned = score.orientation_rmse_deg.zip(orientation);
        assert!(turned.is_none_or(|(measured, known)| measured <= 1.02 * known), "{name}: {turned:?}°");
        assert_eq!(score.orientation_rmse_deg.is_some(), orientation.is_some(), "{name}");
        assert!(smoothed <= 1.02 * oldest, "{name}: {smoothed} m was {oldest}");
        assert!((least..most).contains(&score.nees), "{name}: NEES {}", score.nees);
        assert_eq!(score.allocations, Some(0), "{name}");
    }
    Ok(())
}

/// With the noise that GTSAM was given, the smoother gives GTSAM's figures: they are the same problem.
#[test]
fn a_tuned_smoother_agrees_with_gtsam() -> Result<(), Box<dyn Error>> {
    let folder = navigation()?;
    let single =
        NAVIGATION_FILTERS.iter().find(|filter| filter.name == "smoother-single").ok_or("no such filter")?;
    let tuned = ["gyroscope_noise=5e-3", "accelerometer_noise=5e-2"];
    let known = ["relative_scale=0", "landmarks=false"];
    // Position in m, NEES and position of the oldest in m, as in the README of the data.
    for (name, settings, position, nees, oldest) in [
        ("kitti_s2", &tuned[..], 0.380, 0.97, 0.18),
        ("kitti_s5", &tuned, 1.503, 1.64, 0.25),
        ("kitti_s10", &tuned, 7.84, 2.78, 0.74),
        ("kitti_s2", &[], 1.83, 47.0, 0.79),
        ("kitti_s5", &[], 3.89, 61.0, 1.04),
        ("kitti_s10", &[], 12.8, 110.0, 1.38),
        ("simflight", &known, 0.831, 5.74, 0.772),
        ("euroc_mh01", &known, 0.556, 7.97, 0.557),
    ] {
        let settings: Vec<_> = settings.iter().map(|text| text.parse()).collect::<Result<_, _>>()?;
        let score = evaluate_navigation(&DataSet::read(&folder.join(name))?, single, &settings, 20, || {})?;
        let smoothed = score.position_smoothed_rmse_m.ok_or("a window was never full")?;
        let ratios = [score.position_rmse_m / position, score.nees / nees];
        println!("{name}: position, NEES and oldest beside GTSAM's: {ratios:.3?}, {:.3}", smoothed / oldest);
        for (ratio, bound) in ratios.into_iter().zip([0.03, 0.05]) {
            assert!((ratio - 1.0).abs() < bound, "{name}: {ratios:?}");
        }
        // GTSAM's varies by a tenth with the noise that it adds to every integration.
        assert!(smoothed < 1.03 * oldest, "{name}: {smoothed} m, not {oldest}");
    }
    Ok(())
}

/// The state estimator adds a queue, stamps, places on the Earth, gates and labels to a strategy; none of it may cost accuracy.
#[test]
fn the_state_estimator_errs_as_its_strategy_does() -> Result<(), Box<dyn Error>> {
    let folder = navigation()?;
    let named = |name: &str| {
        NAVIGATION_FILTERS.iter().find(|filter| filter.name == name).ok_or_else(|| format!("no filter {name}"))
    };
    let tuned = ["gyroscope_noise=5e-3", "accelerometer_noise=5e-2"];
    // Position in m and NEES of the state estimator.
    for (name, settings, strategy, position, nees) in [
        ("simflight", &[][..], "smoother", 1.052, 6.29),
        ("simflight", &[], "eskf", 1.041, 5.29),
        ("simflight_stress", &[], "smoother", 1.027, 6.51),
        ("simflight_stress", &[], "eskf", 1.005, 5.30),
        ("euroc_mh01", &[], "smoother", 0.560, 8.07),
        ("euroc_mh01", &[], "eskf", 0.566, 8.13),
        ("kitti_s2", &tuned, "smoother", 0.376, 0.91),
        ("kitti_s2", &tuned, "eskf", 0.377, 0.92),
    ] {
        let settings: Vec<_> = settings.iter().map(|text| text.parse()).collect::<Result<_, _>>()?;
        let data = DataSet::read(&folder.join(name))?;
        let [state, bare] = [format!("state-{strategy}"), format!("{strategy}-single")];
        let state = evaluate_navigation(&data, named(&state)?, &settings, 20, || {})?;
        // The state estimator sees no landmarks.
        let blind = if strategy == "smoother" { vec!["landmarks=false".parse()?] } else { Vec::new() };
        let bare = evaluate_navigation(&data, named(&bare)?, &[settings, blind].concat(), 20, || {})?;
        println!(
            "{name}, {strategy}: {:.3} m, {:.3?}°, NEES {:.2}; bare {:.3} m, {:.3?}°, NEES {:.2}",
            state.position_rmse_m,
            state.orientation_rmse_deg,
            state.nees,
            bare.position_rmse_m,
            bare.orientation_rmse_deg,
            bare.nees
        );
        assert!((state.position_rmse_m / position - 1.0).abs() < 0.02, "{name}, {strategy}");
        assert!((state.nees / nees - 1.0).abs() < 0.03, "{name}, {strategy}");
        assert!((state.position_rmse_m / bare.position_rmse_m - 1.0).abs() < 0.02, "{name}, {strategy}");
        let turned = state.orientation_rmse_deg.zip(bare.orientation_rmse_deg);
        assert!(turned.is_none_or(|(state, bare)| (state / bare - 1.0).abs() < 0.01), "{name}, {strategy}");
        // On the flights every keyframe is scored: there was an estimate at each.
        assert_eq!(state.keyframes, bare.keyframes, "{name}, {strategy}");
    }
    Ok(())
}

/// Without the bank, and tuned by hand as GTSAM was, the filter gives GTSAM's figures: they are the same problem.
#[test]
fn one_tuned_filter_agrees_with_a_smoother() -> Result<(), Box<dyn Error>> {
    let folder = navigation()?;
    let single = NAVIGATION_FILTERS.iter().find(|filter| filter.name == "eskf-single").ok_or("no such filter")?;
    let tuned = ["gyroscope_noise=5e-3", "accelerometer_noise=5e-2"];
    let known = ["relative_scale=0"];
    // Position in m and NEES, as in the README of the data.
    for (name, settings, position, nees) in [
        ("kitti_s2", &tuned[..], 0.380, 0.97),
        ("kitti_s5", &tuned, 1.503, 1.64),
        ("kitti_s10", &tuned, 7.84, 2.78),
        ("kitti_s2", &[], 1.83, 47.0),
        ("kitti_s5", &[], 3.89, 61.0),
        ("kitti_s10", &[], 12.8, 110.0),
        ("euroc_mh01", &known, 0.556, 7.97),
    ] {
        let settings: Vec<_> = settings.iter().map(|text| text.parse()).collect::<Result<_, _>>()?;
        let score =
            evaluate_navigation(&DataSet::read(&folder.join(Path::new(name)))?, single, &settings, 20, || {})?;
        let (distance, consistency) = (score.position_rmse_m / position, score.nees / nees);
        assert!((distance - 1.0).abs() < 0.02, "{name}: {} m, not {position}", score.position_rmse_m);
        assert!((consistency - 1.0).abs() < 0.03, "{name}: NEES {}, not {nees}", score.nees);
    }
    Ok(())
}
