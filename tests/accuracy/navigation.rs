//! `bb eval navigation` on recorded and simulated drives and flights, with one set of parameters for all.

use crate::recordings::{SETS, navigation};
use bb_cli::{DataSet, NAVIGATION_FILTERS, evaluate_navigation};
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
    let Some(folder) = navigation()? else { return Ok(()) };
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

/// Without the bank, and tuned by hand as GTSAM was, the filter gives GTSAM's figures: they are the same problem.
#[test]
fn one_tuned_filter_agrees_with_a_smoother() -> Result<(), Box<dyn Error>> {
    let Some(folder) = navigation()? else { return Ok(()) };
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
