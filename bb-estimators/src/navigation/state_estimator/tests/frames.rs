//! The axes of outputs: velocity and orientation are in the tangent frame at the position.

use super::*;

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
        let position = start;
        let state = FlightControllerState { position, velocity, attitude, ..flight.warm_start(0) };
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
                assert!(error.z.abs() < 0.1, "{strategy:?} at {seconds}: {}", output.velocity);
                assert!(error.xy().norm() < 1.0, "{strategy:?} at {seconds}: {}", output.velocity);
            }
        }
        let last = estimator.predicted(60 * SECOND).unwrap();
        assert!((last.position.height - start.height).abs() < 3.0, "{strategy:?}: {} m high", last.position.height);
        assert!(last.world_from_body.angle() < 0.02, "{strategy:?}: level where it is, {}", last.world_from_body);
        let world = *estimator.frame().unwrap();
        assert!(world.position(&last.position).xy().norm() <= 5100.0, "{strategy:?}: {world:?}");
        let moved_m = (world.origin().latitude - start.latitude).abs() * radius_m;
        assert!(moved_m > 15_000.0, "{strategy:?}: the world has moved on, {moved_m} m");
        // Each keyframe is recorded once, in the world that it was estimated in.
        estimator.finish();
        let recorded = keyframes(estimator.sink());
        let is_next =
            |[before, after]: &[EstimatorOutput; 2]| (1..=SECOND).contains(&(after.time_ns - before.time_ns));
        assert!(recorded.array_windows().all(is_next), "{strategy:?}: {recorded:?}");
        assert_eq!((recorded[0].time_ns, recorded[recorded.len() - 1].time_ns), (0, 60 * SECOND));
        for keyframe in recorded {
            let latitude = start.latitude + 400.0 * keyframe.time_ns as f64 * 1e-9 / radius_m;
            let off = (keyframe.position.latitude - latitude) * radius_m;
            assert!(off.abs() < 20.0, "{strategy:?}: {off} m at {}", keyframe.time_ns);
        }
    }
}
