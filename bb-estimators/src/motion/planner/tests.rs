use super::super::JointPath;
use super::*;
use bb_tests::laws;
use proptest::prelude::*;

fn names(count: usize) -> Arc<[String]> {
    (0..count).map(|index| format!("joint_{index}")).collect()
}

fn limits() -> impl Strategy<Value = JointMotionLimits> {
    let jerk = prop_oneof![Just(f64::INFINITY), 1.0..100.0];
    (0.1..5.0, 0.5..20.0, jerk).prop_map(|(velocity, acceleration, jerk)| JointMotionLimits {
        lower: -3.0,
        upper: 3.0,
        velocity,
        acceleration,
        jerk,
    })
}

/// The shortest time for a way at rest at both ends, without a limit of the jerk.
fn shortest_s(way: f64, limits: &JointMotionLimits) -> f64 {
    let (v, a) = (limits.velocity, limits.acceleration);
    if way * a < v * v { 2.0 * (way / a).sqrt() } else { way / v + v / a }
}

laws! {
    #[test]
    fn it_keeps_the_limits_and_takes_the_shortest_time(
        joints in proptest::collection::vec((-3.0..3.0, -3.0..3.0, limits()), 1..7),
    ) {
        let from: Vec<JointPoint> =
            joints.iter().map(|(from, ..)| JointPoint { position: *from, ..JointPoint::default() }).collect();
        let target: Vec<f64> = joints.iter().map(|(_, target, _)| *target).collect();
        let limits: Vec<JointMotionLimits> = joints.iter().map(|(.., limits)| *limits).collect();
        let names = names(joints.len());
        let trajectory = plan(&names, &from, std::slice::from_ref(&target), &limits, Duration::from_millis(10));
        let trajectory = match trajectory {
            Ok(trajectory) => trajectory,
            Err(error) => return Err(TestCaseError::fail(error.to_string())),
        };
        let mut longest_s = 0.0_f64;
        for (joint, name) in names.iter().enumerate() {
            let path = JointPath::of(&trajectory, name).expect("it is planned");
            let limit = &limits[joint];
            prop_assert_eq!(path.target(), target[joint]);
            prop_assert!((path.at(0.0).position - from[joint].position).abs() < 1e-9);
            let steps = 2_000;
            for step in 0..=steps {
                let point = path.at(path.duration_s() * f64::from(step) / f64::from(steps));
                prop_assert!((-3.0 - 1e-6..=3.0 + 1e-6).contains(&point.position));
                // Points are exact. Between two of them, 10 ms apart, the polynomial rounds off a jump of the acceleration.
                let rounded = limit.acceleration * 0.01 / 14.0;
                prop_assert!(point.velocity.abs() <= limit.velocity + rounded + 1e-9, "{point:?} {limit:?}");
            }
            for point in trajectory.points.iter() {
                prop_assert!(point.velocities[joint].abs() <= limit.velocity * (1.0 + 1e-9) + 1e-9);
                prop_assert!(point.accelerations[joint].abs() <= limit.acceleration * (1.0 + 1e-9) + 1e-9);
            }
            longest_s = longest_s.max(shortest_s((target[joint] - from[joint].position).abs(), limit));
        }
        let duration_s = trajectory.points.last().expect("it ends").time_from_start.as_secs_f64();
        prop_assert!(duration_s >= longest_s - 1e-6, "{duration_s} is less than {longest_s}");
        if limits.iter().all(|limit| limit.jerk.is_infinite()) {
            prop_assert!((duration_s - longest_s).abs() < 1e-6, "{duration_s}, not {longest_s}");
        }
    }

    #[test]
    fn it_passes_through_its_waypoints(
        way in proptest::collection::vec(proptest::collection::vec(-2.0..2.0, 3), 2..5),
    ) {
        let limit = JointMotionLimits { lower: -3.0, upper: 3.0, velocity: 1.0, acceleration: 4.0, jerk: 40.0 };
        let trajectory = plan(&names(3), &[JointPoint::default(); 3], &way, &[limit; 3], Duration::from_millis(5));
        let trajectory = match trajectory {
            Ok(trajectory) => trajectory,
            Err(error) => return Err(TestCaseError::fail(error.to_string())),
        };
        for waypoint in &way {
            let nearest = trajectory.points.iter().map(|point| {
                let pairs = point.positions.iter().zip(waypoint);
                pairs.map(|(is, wanted)| (is - wanted).abs()).fold(0.0, f64::max)
            });
            // A point each 5 ms at up to 1 rad/s.
            let nearest = nearest.fold(f64::INFINITY, f64::min);
            prop_assert!(nearest < 3e-3, "{nearest} from a waypoint");
        }
        for point in trajectory.points.iter() {
            prop_assert!(point.velocities.iter().all(|velocity| velocity.abs() <= 1.0 + 1e-6));
            prop_assert!(point.accelerations.iter().all(|acceleration| acceleration.abs() <= 4.0 + 1e-6));
        }
    }
}

#[test]
fn what_cannot_be_planned_is_an_error_that_says_why() {
    let limit = JointMotionLimits { lower: -1.0, upper: 1.0, velocity: 1.0, acceleration: 1.0, jerk: 1.0 };
    let at_rest = [JointPoint::default()];
    let period = Duration::from_millis(10);
    let error = |target: f64, limit: JointMotionLimits| {
        plan(&names(1), &at_rest, &[vec![target]], &[limit], period).expect_err("it cannot be").to_string()
    };
    assert_eq!(error(2.0, limit), "the target 2 of `joint_0` is not within -1..=1");
    assert_eq!(error(f64::NAN, limit), "the target NaN of `joint_0` is not within -1..=1");
    assert!(
        error(0.5, JointMotionLimits { velocity: 0.0, ..limit }).starts_with("`joint_0` needs positive limits")
    );
    let shape = plan(&names(2), &at_rest, &[vec![0.0]], &[limit], period).expect_err("it cannot be");
    assert_eq!(shape.to_string(), "2 joints need as many states, limits and target positions");
    let twice: Arc<[String]> = ["one".to_owned(), "one".to_owned()].into();
    let twice = plan(&twice, &[at_rest[0]; 2], &[vec![0.0, 0.5]], &[limit; 2], period).expect_err("it cannot be");
    assert!(twice.to_string().contains("`one` is named twice"), "{twice}");
    let moving = [JointPoint { velocity: f64::NAN, ..JointPoint::default() }];
    assert!(plan(&names(1), &moving, &[vec![0.0]], &[limit], period).is_err());
}

#[test]
fn it_stays_where_it_is() {
    let limit = JointMotionLimits { lower: -1.0, upper: 1.0, velocity: 1.0, acceleration: 1.0, jerk: 1.0 };
    let at_rest = [JointPoint { position: 0.5, ..JointPoint::default() }];
    let trajectory =
        plan(&names(1), &at_rest, &[vec![0.5]], &[limit], Duration::from_millis(10)).expect("it is there already");
    assert_eq!(trajectory.points.len(), 1);
    assert_eq!(trajectory.points[0].positions, [0.5]);
}
