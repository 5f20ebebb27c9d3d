use super::*;
use crate::motion::{Easing, Pace, Profile};
use bb_tests::laws;
use proptest::prelude::*;

fn drivetrains() -> impl Strategy<Value = Drivetrain> {
    (0.2..3.0, 0.5..10.0, 0.5..20.0, 0.01..1.0, 0.0..0.5, 0.0..0.4).prop_map(
        |(velocity, effort, acceleration, inertia, damping, friction)| Drivetrain {
            lower: -1.5,
            upper: 1.5,
            velocity,
            effort,
            acceleration,
            inertia,
            damping,
            friction,
        },
    )
}

fn goals() -> impl Strategy<Value = Goal> {
    prop_oneof![
        Just(Goal::Hold),
        Just(Goal::Stop),
        Just(Goal::Free),
        (-20.0..20.0).prop_map(Goal::Effort),
        (-5.0..5.0).prop_map(Goal::Velocity),
        (-1.5..=1.5, 0.05..5.0).prop_map(|(target, speed)| Goal::Position { target, speed }),
    ]
}

fn at(millis: i64) -> MonotonicTime {
    MonotonicTime::from_nanos(millis * 1_000_000)
}

const PLAIN: Drivetrain = Drivetrain {
    lower: -1.5,
    upper: 1.5,
    velocity: 1.0,
    effort: 10.0,
    acceleration: 4.0,
    inertia: 0.5,
    damping: 0.2,
    friction: 0.3,
};

laws! {
    /// Random commands at random times.
    #[test]
    fn limits_hold_under_random_commands(
        drivetrain in drivetrains(), commands in proptest::collection::vec((goals(), 1_i64..800), 1..12),
    ) {
        let mut plant = Plant::new(drivetrain, 0.0, at(0));
        let mut now = 0;
        let mut last = JointPoint::default();
        for (goal, millis) in commands {
            let is_servo = !matches!(goal, Goal::Free | Goal::Effort(_));
            plant.set(goal.clone(), at(now));
            let entered = plant.at(at(now)).point.velocity.abs();
            for _ in 0..millis {
                now += 1;
                let PlantState { point, effort, .. } = plant.at(at(now));
                prop_assert!((-1.5..=1.5).contains(&point.position), "{point:?}");
                prop_assert!(effort.abs() <= drivetrain.effort * (1.0 + 1e-12) || point.velocity == 0.0, "{effort}");
                if is_servo {
                    // An effort alone may have brought it beyond.
                    let most = drivetrain.velocity.max(entered);
                    prop_assert!(point.velocity.abs() <= most * (1.0 + 1e-9), "{point:?} {goal:?}");
                }
                // It does not jump: by no more than it moves within a millisecond, and than it is drawn to rest at a target.
                let fastest = last.velocity.abs().max(point.velocity.abs()) + 1e-3 * drivetrain.effort / drivetrain.inertia;
                let step = (point.position - last.position).abs();
                prop_assert!(step <= 1e-3 * fastest + 1e-6 * drivetrain.acceleration, "a jump of {step}");
                last = point;
            }
        }
    }

    /// A joint comes to rest at a position, without overshoot, in the time of the trapezoid.
    #[test]
    fn it_reaches_its_target_in_the_shortest_time(
        drivetrain in drivetrains(), from in -1.5..1.5, target in -1.5..1.5,
    ) {
        // A motor that can just as well brake as the servo asks.
        let needed = drivetrain.inertia * drivetrain.acceleration + drivetrain.friction + drivetrain.damping * drivetrain.velocity;
        let drivetrain = Drivetrain { effort: needed, ..drivetrain };
        let mut plant = Plant::new(drivetrain, from, at(0));
        plant.set(Goal::Position { target, speed: drivetrain.velocity }, at(0));
        let pace = Pace::Speed(drivetrain.velocity);
        let profile = Profile::new(Easing::Trapezoidal, from, target, pace, Some(drivetrain.acceleration));
        let expected = (profile.duration_s() * 1e3).ceil() as i64;
        let overshoot = drivetrain.acceleration * STEP_S * STEP_S;
        for millis in 0..expected + 60 {
            let point = plant.at(at(millis)).point;
            let beyond = (point.position - target) * (target - from).signum();
            prop_assert!(beyond <= overshoot, "{beyond} beyond");
        }
        // Each change of the acceleration falls on a step; at the end a few more are needed.
        let point = plant.at(at(expected + 60)).point;
        prop_assert_eq!((point.velocity, (point.position - target).abs() < 1e-9), (0.0, true), "{:?}", point);
        let early = plant_at(&drivetrain, from, target, expected - 3);
        prop_assert!((early.position - target).abs() > 0.0 || expected < 5, "sooner than it can");
    }

    /// Monotony that the search for the loads of coupled joints relies on: more load never accelerates more, and no load is a threshold.
    #[test]
    fn the_acceleration_falls_with_the_load_continuously(
        drivetrain in drivetrains(), goal in goals(), velocity in prop_oneof![Just(0.0), -0.01..0.01, -4.0..4.0],
        load in -20.0..20.0, more in prop_oneof![1e-6..1e-3, 0.0..5.0],
    ) {
        let drivetrain = Drivetrain { lower: f64::NEG_INFINITY, upper: f64::INFINITY, ..drivetrain };
        let mut plant = Plant::new(drivetrain, 0.0, at(0));
        plant.state.point.velocity = velocity;
        plant.set(goal, at(0));
        let mut with = |effort| {
            plant.load = Load { inertia: 0.1, effort };
            plant.mean_acceleration()
        };
        let less = with(load) - with(load + more);
        let most = more / (drivetrain.inertia + 0.1);
        prop_assert!((-1e-8..=most + 1e-8).contains(&less), "{less} of {most}");
    }

    /// Queries, by any caller and at any rate, do not change how a joint moves.
    #[test]
    fn questions_do_not_change_it(
        goals in proptest::collection::vec((goals(), 1_i64..400_000_000), 1..6),
        questions in proptest::collection::vec(0_i64..2_000_000_000, 0..60),
    ) {
        let (mut asked, mut unasked) = (Plant::new(PLAIN, 0.1, at(0)), Plant::new(PLAIN, 0.1, at(0)));
        let mut questions = questions;
        questions.sort_unstable();
        let mut now = 0;
        for (goal, nanos) in goals {
            asked.set(goal.clone(), MonotonicTime::from_nanos(now));
            unasked.set(goal, MonotonicTime::from_nanos(now));
            for question in questions.iter().filter(|question| (now..now + nanos).contains(question)) {
                let _ = asked.at(MonotonicTime::from_nanos(*question));
            }
            now += nanos;
        }
        prop_assert_eq!(asked.at(MonotonicTime::from_nanos(now)), unasked.at(MonotonicTime::from_nanos(now)));
    }
}

fn plant_at(drivetrain: &Drivetrain, from: f64, target: f64, millis: i64) -> JointPoint {
    let mut plant = Plant::new(*drivetrain, from, at(0));
    plant.set(Goal::Position { target, speed: drivetrain.velocity }, at(0));
    plant.at(at(millis)).point
}

#[test]
fn an_effort_accelerates_the_inertia_against_friction() {
    let mut plant = Plant::new(Drivetrain { damping: 0.0, lower: -1e9, upper: 1e9, ..PLAIN }, 0.0, at(0));
    plant.set(Goal::Effort(1.3), at(0));
    // (1.3 − 0.3) N·m on 0.5 kg·m² for 2 s.
    let point = plant.at(at(2000)).point;
    assert!((point.velocity - 4.0).abs() < 1e-9 && (point.position - 4.0).abs() < 1e-9, "{point:?}");
    // Then friction alone: 0.6 rad/s².
    plant.set(Goal::Free, at(2000));
    let point = plant.at(at(3000)).point;
    assert!((point.velocity - 3.4).abs() < 1e-9, "{point:?}");
    assert_eq!(plant.at(at(12_000)).point.velocity, 0.0);
}

#[test]
fn friction_holds_what_is_pushed_less() {
    let mut plant = Plant::new(PLAIN, 0.2, at(0));
    plant.set(Goal::Effort(0.29), at(0));
    assert_eq!(plant.at(at(5000)).point, JointPoint { position: 0.2, ..JointPoint::default() });
    // A motor that is too weak for its own joint stalls.
    let mut weak = Plant::new(Drivetrain { effort: 0.2, ..PLAIN }, 0.0, at(0));
    weak.set(Goal::Position { target: 1.0, speed: 1.0 }, at(0));
    let state = weak.at(at(1000));
    assert_eq!(state.point.position, 0.0);
    assert!((state.stalled_s - 1.0).abs() < 1e-9, "{state:?}");
}

#[test]
fn an_obstacle_stops_it_and_is_noticed() {
    let mut plant = Plant::new(PLAIN, 0.0, at(0));
    plant.obstruct(-0.5, 0.5, at(0));
    plant.set(Goal::Position { target: 1.0, speed: 1.0 }, at(0));
    let state = plant.at(at(3000));
    assert_eq!((state.point.position, state.point.velocity), (0.5, 0.0));
    assert!(state.stalled_s > 2.0, "{state:?}");
    // Away from it, it moves; and once it is gone.
    plant.set(Goal::Position { target: 0.2, speed: 1.0 }, at(3000));
    assert!((plant.at(at(5000)).point.position - 0.2).abs() < 1e-9);
    plant.obstruct(f64::NEG_INFINITY, f64::INFINITY, at(5000));
    plant.set(Goal::Position { target: 1.0, speed: 1.0 }, at(5000));
    assert!((plant.at(at(8000)).point.position - 1.0).abs() < 1e-9);
}

#[test]
fn a_trajectory_within_its_means_is_followed() {
    use bb_core::payload::{JointTrajectory, TrajectoryPoint};
    let profile = Profile::new(Easing::SCurve, 0.0, 1.2, Pace::Speed(0.8), Some(1.5));
    let points = (0..=100).map(|step| {
        let time_s = profile.duration_s() * f64::from(step) / 100.0;
        let point = profile.at(time_s);
        TrajectoryPoint {
            positions: vec![point.position],
            velocities: vec![point.velocity],
            accelerations: vec![point.acceleration],
            efforts: Vec::new(),
            time_from_start: Duration::from_secs_f64(time_s),
        }
    });
    let trajectory = JointTrajectory { joint_names: ["lift".to_owned()].into(), points: points.collect() };
    let path = Arc::new(JointPath::of(&trajectory, "lift").expect("it is whole"));
    let mut plant = Plant::new(PLAIN, 0.0, at(0));
    plant.set(Goal::Path { start: at(0), path: Arc::clone(&path) }, at(0));
    for millis in 0..=3000 {
        let (is, wanted) = (plant.at(at(millis)).point, path.at(millis as f64 * 1e-3));
        assert!((is.position - wanted.position).abs() < 2e-6, "at {millis} ms: {is:?}, not {wanted:?}");
    }
    assert_eq!(plant.at(at(3000)).point, JointPoint { position: 1.2, ..JointPoint::default() });
}

/// A light joint in thick oil comes to the velocity of its effort; with an explicit step, friction would turn the
/// velocity round each millisecond, tenfold.
#[test]
fn a_light_joint_in_thick_oil_comes_to_the_velocity_of_its_effort() {
    let light = Drivetrain {
        lower: f64::NEG_INFINITY,
        upper: f64::INFINITY,
        velocity: f64::INFINITY,
        inertia: 1e-5,
        damping: 0.1,
        friction: 0.0,
        ..PLAIN
    };
    let mut plant = Plant::new(light, 0.0, at(0));
    plant.set(Goal::Effort(0.5), at(0));
    let mut before = 0.0;
    for millis in 1..200 {
        let velocity = plant.at(at(millis)).point.velocity;
        assert!((before..=5.0 + 1e-9).contains(&velocity), "{before} {velocity}");
        before = velocity;
    }
    assert!((before - 5.0).abs() < 1e-9, "{before}");
    plant.set(Goal::Free, at(200));
    assert!(plant.at(at(400)).point.velocity.abs() < 1e-9);
}

#[test]
fn a_joint_at_rest_catches_up_at_once() {
    let hour = at(3_600_000);
    for goal in
        [Goal::Free, Goal::Hold, Goal::Stop, Goal::Position { target: 0.5, speed: 1.0 }, Goal::Velocity(1.0)]
    {
        let mut plant = Plant::new(PLAIN, 0.1, at(0));
        plant.set(goal.clone(), at(0));
        assert!(plant.advance(hour, 5000), "{goal:?}: it rests after less than 5 s");
        assert_eq!(plant.time, hour);
        assert_eq!(plant.at(at(3_600_000)).point.velocity, 0.0);
    }
    // One that moves needs its steps, as many as it may take at a time.
    let mut plant = Plant::new(Drivetrain { upper: f64::INFINITY, ..PLAIN }, 0.1, at(0));
    plant.set(Goal::Velocity(1.0), at(0));
    assert!(!plant.advance(at(10_000), 9_999));
    assert!(plant.advance(at(10_000), 1));
}

#[test]
fn the_same_command_again_does_not_free_a_joint_that_is_held() {
    let mut plant = Plant::new(PLAIN, 0.0, at(0));
    plant.obstruct(-0.1, 0.1, at(0));
    for millis in 0..1000 {
        plant.set(Goal::Velocity(1.0), at(millis));
    }
    assert!(plant.at(at(1000)).stalled_s > 0.5);
    plant.set(Goal::Velocity(-1.0), at(1000));
    assert_eq!(plant.at(at(1000)).stalled_s, 0.0);
}
