//! A filter whose heading is wrong, and that is moved to where fixes are.

use super::*;
use crate::navigation::estimator::refuted::Refuted;
use crate::navigation::noise::Noise;
use crate::navigation::state::Navigation;
use crate::navigation::track::TrackPoint;
use bb_core::Options as _;

const SPEED: f64 = 8.0;

/// The heading's error, rad, and its deviation on a drive along x that the filter takes to go elsewhere, without fixes for the first
/// five seconds: when fixes have moved the filter, and at the end.
fn drive(off: f64, seed: u64) -> [(f64, f64); 2] {
    let options = NavigationOptions::defaults();
    let turned = UnitQuaternion::from_euler_angles(0.0, 0.0, off);
    let start = Start::at(0, (Vector3::zeros(), 0.5), (turned * Vector3::x() * SPEED, 0.3), (turned, 0.05));
    let mut filter = Filter::<Navigation, 15>::new(&options, &start).unwrap();
    let (mut noise, mut fixes) = (Noise::new(seed), Refuted::default());
    let mut after = None;
    let heading = |filter: &Filter<Navigation, 15>| {
        let estimate = filter.estimate().unwrap();
        let error = estimate.world_from_body.euler_angles().2;
        (error, filter.eskf().covariance()[(ROTATION + 2, ROTATION + 2)].sqrt())
    };
    for i in 1..=3000_i64 {
        let time_ns = i * 10_000_000;
        let specific_force = Vector3::new(0.0, 0.0, 9.80665) + noise.vector(0.02);
        filter.propagate(&ImuMean { time_ns, angular_velocity: noise.vector(1.7e-3), specific_force }).unwrap();
        if i % 5 == 0 {
            let velocity = Vector3::x() * SPEED + noise.vector(0.1);
            let measured = BodyVelocity {
                velocity,
                deviation: 0.1,
                body_from_sensor: UnitQuaternion::identity(),
                lever_arm: Vector3::zeros(),
            };
            let _ = filter.update(&Measured::Odometry(measured));
        }
        if i > 500 && i % 20 == 0 {
            let position = Vector3::x() * (SPEED * i as f64 * 0.01) + noise.vector(0.5);
            let fix = GnssPosition::new(position, 0.5, 0.5);
            fixes.see(TrackPoint { time_ns, position, covariance: fix.covariance, yaw: 0.0 });
            let _ = filter.update(&Measured::Gnss(fix));
            if let Some(found) = fixes.verdict(filter.positions()[0], options.patience) {
                filter.relocate(&found, &Vector3::zeros(), None).unwrap();
                fixes.begin(filter.positions()[0]);
                after = after.or(Some(heading(&filter)));
            }
        }
    }
    [after.expect("fixes refute it"), heading(&filter)]
}

/// Wheels go on in the wrong direction, so fixes refute position and velocity. The heading is as uncertain then as it is wrong, and
/// wheels and fixes find it.
#[test]
fn a_heading_that_led_astray_is_not_believed() {
    for off in [0.4_f64, -0.7, 1.2, -1.6, 2.2] {
        for seed in 0..5 {
            let [(error, deviation), (last, last_deviation)] = drive(off, seed);
            println!("{off} {seed}: {error:.3} of {deviation:.3}, {last:.4} of {last_deviation:.4}");
            assert!((error / deviation).powi(2) < 4.0, "{off}: {error} rad of {deviation}");
            assert!(
                last.abs() < 0.05 && (last / last_deviation).abs() < 4.0,
                "{off}: {last} of {last_deviation} rad"
            );
        }
    }
}
