//! The axes of outputs: velocity and orientation are in the tangent frame at the position.

use super::flight::{SECOND, STEP};
use super::*;
use crate::navigation::ImuMean;
use crate::navigation::geodesy::{Geodetic, LocalFrame};
use nalgebra::{UnitQuaternion, Vector3};

#[test]
fn the_velocity_is_east_north_up() {
    let flight = Flight::new(30, 3);
    for strategy in StrategyKind::ALL {
        let mut estimator = started(&flight, *strategy);
        let mut checked = 0;
        for sent in &flight.sent(true, true, false) {
            sent.to(&mut estimator).unwrap();
            let Some(output) = estimator.tick(sent.time_ns()).filter(|output| output.time_ns > 5 * SECOND) else {
                continue;
            };
            let turn = flight.frame.other_from_self(&LocalFrame::new(output.position)).rotation;
            let truth = turn * Flight::truth(output.time_ns).velocity;
            let [error, newest] = [Some(output), estimator.current_estimate()].map(|estimate| {
                let estimate = estimate.unwrap();
                (estimate.velocity - turn * Flight::truth(estimate.time_ns).velocity).norm()
            });
            // It flies at 15 to 30 m/s in all directions.
            assert!(error < 0.5 && newest < 0.5, "{}: {error} and {newest} m/s of {truth}", strategy.name());
            checked += 1;
        }
        assert_eq!(checked, 125);
    }
}

/// Far from the start, up and north are those of the place: the velocity of a level flight along a meridian has no component upwards,
/// at any distance from the origin of the world in use.
#[test]
fn the_velocity_is_in_the_axes_of_the_place() {
    let start = Geodetic::from_degrees(48.0, 11.0, 500.0);
    let flight = Flight::new(2, 1);
    for strategy in StrategyKind::ALL {
        let mut estimator = estimator(*strategy);
        let velocity = Vector3::new(0.0, 400.0, 0.0);
        let attitude =
            AttitudeReading { world_from_body: UnitQuaternion::identity(), ..flight.warm_start(0).attitude };
        let state = FlightControllerState { position: start, velocity, attitude, ..flight.warm_start(0) };
        estimator.warm_start(state).unwrap();
        // That of the meridian there, at the height.
        let radius_m = 6_370_740.0 + 500.0;
        for i in 1..=60 * 50 {
            let time_ns = i * 4 * STEP;
            let seconds = time_ns as f64 * 1e-9;
            let sample = ImuMean {
                time_ns,
                angular_velocity: Vector3::new(-400.0 / radius_m, 0.0, 0.0),
                specific_force: Vector3::new(0.0, 0.0, 9.80665 - 400.0 * 400.0 / radius_m),
            };
            estimator.add_imu(&sample).unwrap();
            if i % 5 == 0 {
                let latitude = start.latitude + 400.0 * seconds / radius_m;
                let mut anchor = flight.anchors[0];
                (anchor.time_ns, anchor.world_from_body) = (time_ns, UnitQuaternion::identity());
                anchor.position = Geodetic { latitude, ..start };
                ignore(estimator.add_pose_anchor(anchor));
            }
            if let Some(output) = estimator.tick(time_ns).filter(|_| seconds > 10.0) {
                let error = output.velocity - velocity;
                // Where the world is 5 km away, its up is 0.8 mrad off: 0.3 m/s.
                assert!(error.z.abs() < 0.1, "{} at {seconds}: {}", strategy.name(), output.velocity);
                assert!(error.xy().norm() < 1.0, "{} at {seconds}: {}", strategy.name(), output.velocity);
            }
        }
        let origin = estimator.frame().unwrap().origin();
        assert!((origin.latitude - start.latitude).abs() * radius_m > 15_000.0, "the world has moved on");
        // Each keyframe is recorded once, in the world that it was estimated in.
        estimator.finish();
        let recorded = kinds(estimator.sink(), "keyframe").map(|event| match event.kind {
            EventKind::Keyframe { estimate } => estimate,
            _ => unreachable!(),
        });
        let recorded: Vec<_> = recorded.collect();
        let is_next =
            |[before, after]: &[EstimatorOutput; 2]| (1..=SECOND).contains(&(after.time_ns - before.time_ns));
        assert!(recorded.array_windows().all(is_next), "{}: {recorded:?}", strategy.name());
        assert_eq!((recorded[0].time_ns, recorded[recorded.len() - 1].time_ns), (0, 60 * SECOND));
        for keyframe in recorded {
            let latitude = start.latitude + 400.0 * keyframe.time_ns as f64 * 1e-9 / radius_m;
            let off = (keyframe.position.latitude - latitude) * radius_m;
            assert!(off.abs() < 20.0, "{}: {off} m at {}", strategy.name(), keyframe.time_ns);
        }
    }
}
