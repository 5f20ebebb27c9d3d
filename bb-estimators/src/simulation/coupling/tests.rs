use super::super::plant::{Drivetrain, Goal};
use super::super::{GRAVITY, SimulatedWorld};
use super::*;
use bb_core::kinematics::Frames;
use bb_core::topology::{Dynamics as Friction, Inertial, Joint, JointKind, Limit, Link, Origin};
use bb_tests::laws;
use nalgebra::{DVector, Isometry3, UnitQuaternion};
use proptest::prelude::*;

mod questions;

const fn joint(name: &'static str, child: usize, xyz: [f64; 3], axis: [f64; 3], kind: JointKind) -> Joint {
    let parent_from_joint = Origin { xyz, rpy: [0.0; 3] };
    let (limit, dynamics): (Option<Limit>, Option<Friction>) = (None, None);
    Joint {
        name,
        kind,
        parent: child - 1,
        child,
        parent_from_joint,
        axis: Some(axis),
        limit,
        dynamics,
        mimic: None,
        transmission: None,
    }
}

const fn link(name: &'static str, parent_joint: Option<usize>, mass: f64, xyz: [f64; 3]) -> Link {
    let link_from_inertia = Origin { xyz, rpy: [0.3, -0.2, 0.5] };
    let inertia = [0.02 * mass, 0.0, 0.001 * mass, 0.03 * mass, 0.0, 0.01 * mass];
    let inertial = Some(Inertial { link_from_inertia, mass, inertia });
    Link { name, parent_joint, root_from_link: None, inertial, visuals: &[], collisions: &[] }
}

/// Two joints that turn about skew axes and one that slides.
static ARM: Topology = Topology {
    links: &[
        link("base", None, 9.0, [0.0; 3]),
        link("upper", Some(0), 3.0, [0.2, 0.0, 0.05]),
        link("lower", Some(1), 2.0, [0.15, 0.02, 0.0]),
        link("tool", Some(2), 0.5, [0.0, 0.0, 0.1]),
    ],
    joints: &[
        joint("shoulder", 1, [0.0, 0.0, 0.4], [0.0, 1.0, 0.0], JointKind::Continuous),
        joint("elbow", 2, [0.4, 0.0, 0.0], [0.3, 0.9, 0.1], JointKind::Continuous),
        joint("slide", 3, [0.3, 0.0, 0.0], [0.0, 0.0, 1.0], JointKind::Prismatic),
    ],
};

const NAMES: [&str; 3] = ["shoulder", "elbow", "slide"];

const FREE: Drivetrain = Drivetrain {
    lower: f64::NEG_INFINITY,
    upper: f64::INFINITY,
    velocity: 5.0,
    effort: f64::INFINITY,
    acceleration: 20.0,
    inertia: 0.05,
    damping: 0.0,
    friction: 0.0,
};

fn at(micros: i64) -> MonotonicTime {
    MonotonicTime::from_nanos(micros * 1_000)
}

/// The world of the arm with a motor at each joint.
fn world(drivetrain: Drivetrain, positions: [f64; 3]) -> SimulatedWorld {
    let world = SimulatedWorld::new(&ARM);
    for (name, position) in NAMES.into_iter().zip(positions) {
        world.add(name, drivetrain, position, at(0)).expect("it is declared");
    }
    world
}

fn points(world: &SimulatedWorld, now: MonotonicTime) -> [JointPoint; 3] {
    NAMES.map(|name| world.joint(name, now).expect("it is declared").point)
}

/// Accelerations by the equations of motion, with the inertia of the motors.
fn accelerations(dynamics: &mut Dynamics, q: &[f64], v: &[f64], efforts: &[f64]) -> DVector<f64> {
    let (mut masses, mut bias) = (DMatrix::zeros(3, 3), vec![0.0; 3]);
    dynamics.frames_mut().update_motion(q, v, &[0.0; 3]).expect("three joints");
    dynamics.efforts(&Vector3::new(0.0, 0.0, -GRAVITY), &mut bias).expect("three joints");
    dynamics.mass_matrix(&mut masses).expect("three joints");
    masses += DMatrix::identity(3, 3) * FREE.inertia;
    let left = DVector::from_column_slice(efforts) - DVector::from(bias);
    masses.cholesky().expect("positive definite").solve(&left)
}

#[test]
fn a_free_arm_swings_as_a_fine_integration_has_it() {
    let start = [0.3, -0.8, 0.1];
    let efforts = [2.0, -1.0, 4.0];
    let world = world(FREE, start);
    for (joint, effort) in efforts.into_iter().enumerate() {
        world.set_goal(joint, Goal::Effort(effort), at(0));
    }
    // Runge and Kutta's fourth order, at a fifth of the step.
    let mut dynamics = Dynamics::new(Kinematics::new(&ARM).expect("a tree"));
    let (mut q, mut v) = (DVector::from_row_slice(&start), DVector::<f64>::zeros(3));
    let mut rate = |q: &DVector<f64>, v: &DVector<f64>| {
        (v.clone(), accelerations(&mut dynamics, q.as_slice(), v.as_slice(), &efforts))
    };
    let h = 2e-4;
    for step in 1..=5_000_i64 {
        let one = rate(&q, &v);
        let two = rate(&(&q + &one.0 * (h / 2.0)), &(&v + &one.1 * (h / 2.0)));
        let three = rate(&(&q + &two.0 * (h / 2.0)), &(&v + &two.1 * (h / 2.0)));
        let four = rate(&(&q + &three.0 * h), &(&v + &three.1 * h));
        q += (one.0 + two.0 * 2.0 + three.0 * 2.0 + four.0) * (h / 6.0);
        v += (one.1 + two.1 * 2.0 + three.1 * 2.0 + four.1) * (h / 6.0);
        if step % 500 == 0 {
            let points = points(&world, at(step * 200));
            for (joint, point) in points.iter().enumerate() {
                let (off, off_v) = (point.position - q[joint], point.velocity - v[joint]);
                assert!(off.abs() < 1e-4 && off_v.abs() < 1e-3, "{step}: {joint} is off by {off} and {off_v}");
            }
        }
    }
    assert!(v.norm() > 1.0, "it swings: {v}");
}

#[test]
fn without_gravity_a_motor_turns_the_rest_the_other_way() {
    let world = world(Drivetrain { inertia: 1e-6, ..FREE }, [0.2, 0.5, 0.0]);
    world.set_gravity(at(0), Vector3::zeros());
    world.set_goal(1, Goal::Effort(0.5), at(0));
    let kinematics = Kinematics::new(&ARM).expect("a tree");
    let mut dynamics = Dynamics::new(kinematics);
    let mut masses = DMatrix::zeros(3, 3);
    for millis in 1..=500 {
        let points = points(&world, at(millis * 1_000));
        let [q, v] = [points.map(|point| point.position), points.map(|point| point.velocity)];
        dynamics.frames_mut().update_motion(&q, &v, &[0.0; 3]).expect("three joints");
        dynamics.mass_matrix(&mut masses).expect("three joints");
        // Nothing turns the whole arm about the axis of the shoulder.
        let momentum = masses.row(0).iter().zip(v).map(|(mass, v)| mass * v).sum::<f64>();
        assert!(momentum.abs() < 2e-6, "at {millis} ms: {momentum} kg·m²/s");
    }
    let [shoulder, elbow, _] = points(&world, at(500_000));
    assert!(elbow.velocity > 0.5 && shoulder.velocity < -0.1, "{shoulder:?} {elbow:?}");
}

#[test]
fn a_servo_carries_the_arm_or_is_too_weak() {
    let positions = [0.4, 0.3, 0.05];
    let mut held = vec![0.0; 3];
    let mut frames = Frames::new(Kinematics::new(&ARM).expect("a tree"));
    frames.update(&positions).expect("three joints");
    frames.gravity_efforts(&Vector3::new(0.0, 0.0, -GRAVITY), &mut held).expect("three joints");
    let strong = world(FREE, positions);
    for joint in 0..3 {
        strong.set_goal(joint, Goal::Hold, at(0));
    }
    for (name, (position, effort)) in NAMES.into_iter().zip(positions.into_iter().zip(&held)) {
        let state = strong.joint(name, at(2_000_000)).expect("a joint");
        assert_eq!((state.point.position, state.point.velocity), (position, 0.0), "{name}");
        assert!((state.effort - effort).abs() < 1e-9, "{name}: {} instead of {effort} N·m", state.effort);
    }
    // Twelve newton metres are needed.
    assert!(held[0].abs() > 10.0, "{held:?}");
    let weak = world(Drivetrain { effort: 8.0, ..FREE }, positions);
    for joint in 0..3 {
        weak.set_goal(joint, Goal::Hold, at(0));
    }
    assert!(points(&weak, at(1_000_000))[0].position - positions[0] > 0.1, "it sags");
    // Dry friction carries what is left.
    let sticky = world(Drivetrain { effort: 8.0, friction: held[0].abs() - 7.0, ..FREE }, positions);
    for joint in 0..3 {
        sticky.set_goal(joint, Goal::Hold, at(0));
    }
    assert_eq!(points(&sticky, at(1_000_000)).map(|point| point.position), positions);
}

#[test]
fn a_base_that_accelerates_throws_the_arm_back() {
    let world = world(FREE, [0.0; 3]);
    world.set_gravity(at(0), Vector3::zeros());
    // Up with 2 m/s², as gravity does it to a base at rest.
    world.move_root(at(0), |time_s| Isometry3::translation(0.0, 0.0, time_s * time_s));
    let falling = self::world(FREE, [0.0; 3]);
    falling.set_gravity(at(0), Vector3::new(0.0, 0.0, -2.0));
    for name in NAMES {
        let [is, expected] = [&world, &falling].map(|world| world.joint(name, at(800_000)).expect("a joint").point);
        assert!((is.position - expected.position).abs() < 1e-6, "{name}: {is:?} {expected:?}");
    }
    assert!(points(&world, at(800_000))[0].position > 0.3);
    // Gravity points down in the world, even if the base is upside down.
    let tilted = self::world(FREE, [0.0; 3]);
    let upside_down = UnitQuaternion::from_euler_angles(std::f64::consts::PI, 0.0, 0.0);
    tilted.move_root(at(0), move |_| Isometry3::from_parts([0.0, 0.0, 0.0].into(), upside_down));
    assert!(points(&tilted, at(500_000))[0].position < -0.3);
}

#[test]
fn a_root_that_is_nowhere_does_not_take_the_joints_along() {
    let world = world(FREE, [0.1; 3]);
    world.move_root(at(0), |time_s| {
        Isometry3::translation(if (0.1..0.2).contains(&time_s) { f64::NAN } else { 0.0 }, 0.0, 0.0)
    });
    let [during, after] = [150_000, 300_000].map(|micros| points(&world, at(micros)));
    let numbers = |point: &JointPoint| [point.position, point.velocity, point.acceleration];
    assert!(during.iter().chain(&after).flat_map(numbers).all(f64::is_finite), "{during:?} {after:?}");
    assert!(after[0].position > during[0].position, "it goes on falling: {during:?} {after:?}");
}

laws! {
    /// Accelerations that the sweeps find solve the equations of motion.
    #[test]
    fn accelerations_are_those_of_the_equations_of_motion(
        q in proptest::array::uniform3(-2.0..2.0),
        efforts in proptest::array::uniform3(-30.0..30.0),
        millis in 1_i64..200,
    ) {
        let world = world(FREE, q);
        for (joint, effort) in efforts.into_iter().enumerate() {
            world.set_goal(joint, Goal::Effort(effort), at(0));
        }
        // A step ends here, and half of the next is done.
        let before = points(&world, at(millis * 1_000));
        let after = points(&world, at(millis * 1_000 + 500));
        // The middle of the step as it is predicted, by the acceleration of the step before.
        let h = 5e-4;
        let position = before.map(|p| p.position + h * (p.velocity + 0.5 * h * p.acceleration));
        let velocity = before.map(|p| p.velocity + h * p.acceleration);
        let mut dynamics = Dynamics::new(Kinematics::new(&ARM).expect("a tree"));
        let expected = accelerations(&mut dynamics, &position, &velocity, &efforts);
        for (is, expected) in after.iter().zip(expected.iter()) {
            let bound = 1e-9 * (1.0 + expected.abs());
            prop_assert!((is.acceleration - expected).abs() <= bound, "{is:?} is not {expected}");
        }
    }

    /// The sweeps converge also where motors are too weak, joints stick, and servos hold.
    #[test]
    fn loads_agree_with_what_the_joints_do(
        q in proptest::array::uniform3(-2.0..2.0),
        goals in proptest::array::uniform3(prop_oneof![
            Just(Goal::Hold),
            Just(Goal::Free),
            (-30.0..30.0).prop_map(Goal::Effort),
            (-4.0..4.0).prop_map(Goal::Velocity),
            (-2.0..2.0).prop_map(|target| Goal::Position { target, speed: 2.0 }),
        ]),
        effort in 0.5..40.0, friction in 0.0..3.0, damping in 0.0..2.0, inertia in 0.001..0.2,
    ) {
        let drivetrain = Drivetrain { effort, friction, damping, inertia, lower: -2.5, upper: 2.5, ..FREE };
        let mut coupling = Coupling::new(&ARM).expect("it has masses");
        let mut plants: Vec<_> = q.iter().map(|q| Some(Plant::new(drivetrain, *q, at(0)))).collect();
        for (plant, goal) in plants.iter_mut().flatten().zip(goals) {
            plant.set(goal, at(0));
        }
        for millis in 0..200 {
            coupling.load(&mut plants, &RootMotion::default(), &Vector3::new(0.0, 0.0, -GRAVITY), at(millis * 1_000));
            let accelerations: Vec<f64> = plants.iter().flatten().map(Plant::mean_acceleration).collect();
            let largest = accelerations.iter().fold(1.0_f64, |largest, a| largest.max(a.abs()));
            for (joint, plant) in plants.iter().flatten().enumerate() {
                let others = (0..3).filter(|other| *other != joint);
                let of_others: f64 = others.map(|other| coupling.masses[(joint, other)] * accelerations[other]).sum();
                let off = plant.load.effort - coupling.bias[joint] - of_others;
                prop_assert!(off.abs() <= 1e-9 * largest, "at {millis} ms, joint {joint} is off by {off} N·m");
            }
            plants.iter_mut().flatten().for_each(|plant| {
                plant.begin_step(at((millis + 1) * 1_000));
            });
        }
    }

    /// Queries, by any caller and at any rate, do not change how coupled joints move.
    #[test]
    fn questions_do_not_change_it(
        commands in proptest::collection::vec((0_usize..3, -5.0..5.0, 1_i64..90_000), 1..6),
        questions in proptest::collection::vec(0_i64..300_000, 0..40),
    ) {
        let (asked, unasked) = (world(FREE, [0.1; 3]), world(FREE, [0.1; 3]));
        let mut questions = questions;
        questions.sort_unstable();
        let mut now = 0;
        for (joint, effort, micros) in commands {
            asked.set_goal(joint, Goal::Effort(effort), at(now));
            unasked.set_goal(joint, Goal::Effort(effort), at(now));
            for question in questions.iter().filter(|question| (now..now + micros).contains(question)) {
                let _ = points(&asked, at(*question));
            }
            now += micros;
        }
        prop_assert_eq!(points(&asked, at(now)), points(&unasked, at(now)));
    }
}

#[test]
fn a_robot_without_masses_is_not_coupled() {
    assert!(Coupling::new(&ARM).is_some());
    const BARE: &[Link] = &[Link { inertial: None, ..link("base", None, 1.0, [0.0; 3]) }];
    assert!(Coupling::new(&Topology { links: BARE, joints: &[] }).is_none());
}

/// An hour has 3.6 million steps. What held the joints still does so afterwards, and no longer if gravity changes.
#[test]
fn an_arm_at_rest_catches_up_at_once() {
    let world = world(Drivetrain { effort: 200.0, ..FREE }, [0.3, -0.8, 0.1]);
    (0..3).for_each(|joint| world.set_goal(joint, Goal::Hold, at(0)));
    let hour = 3_600_000_000;
    let rest = points(&world, at(5_000_000));
    assert!(world.lock().advance(0, at(hour), 100), "it takes all steps of an hour");
    assert_eq!(points(&world, at(hour)), rest);
    world.set_goal(0, Goal::Free, at(hour));
    let fallen = points(&world, at(hour + 100_000));
    assert!((fallen[0].position - rest[0].position).abs() > 0.01, "{fallen:?}");
}

/// Eight parallel joints whose motors have little inertia, the worst case for the sweeps.
static CHAIN: Topology = Topology {
    links: &[
        link("base", None, 9.0, [0.0; 3]),
        link("l1", Some(0), 1.0, [0.2, 0.0, 0.0]),
        link("l2", Some(1), 1.0, [0.2, 0.0, 0.0]),
        link("l3", Some(2), 1.0, [0.2, 0.0, 0.0]),
        link("l4", Some(3), 1.0, [0.2, 0.0, 0.0]),
        link("l5", Some(4), 1.0, [0.2, 0.0, 0.0]),
        link("l6", Some(5), 1.0, [0.2, 0.0, 0.0]),
        link("l7", Some(6), 1.0, [0.2, 0.0, 0.0]),
        link("l8", Some(7), 1.0, [0.2, 0.0, 0.0]),
    ],
    joints: &[
        joint("j1", 1, [0.0, 0.0, 0.4], [0.0, 1.0, 0.0], JointKind::Continuous),
        joint("j2", 2, [0.4, 0.0, 0.0], [0.0, 1.0, 0.0], JointKind::Continuous),
        joint("j3", 3, [0.4, 0.0, 0.0], [0.0, 1.0, 0.0], JointKind::Continuous),
        joint("j4", 4, [0.4, 0.0, 0.0], [0.0, 1.0, 0.0], JointKind::Continuous),
        joint("j5", 5, [0.4, 0.0, 0.0], [0.0, 1.0, 0.0], JointKind::Continuous),
        joint("j6", 6, [0.4, 0.0, 0.0], [0.0, 1.0, 0.0], JointKind::Continuous),
        joint("j7", 7, [0.4, 0.0, 0.0], [0.0, 1.0, 0.0], JointKind::Continuous),
        joint("j8", 8, [0.4, 0.0, 0.0], [0.0, 1.0, 0.0], JointKind::Continuous),
    ],
};

/// Commands and disarming wait for the lock: what is done under it is bounded however slowly the sweeps converge.
#[test]
fn the_work_under_the_lock_is_bounded() {
    let world = SimulatedWorld::new(&CHAIN);
    for joint in CHAIN.joints {
        world.add(joint.name, Drivetrain { inertia: 0.01, ..FREE }, 0.1, at(0)).expect("it is declared");
    }
    let sweeps = || world.lock().coupling.as_ref().map_or(0, Coupling::sweeps);
    let (begun, mut most) = (sweeps(), 0);
    loop {
        let before = sweeps();
        let has_arrived = world.lock().advance(0, at(50_000), 1_000);
        most = most.max(sweeps() - before);
        if has_arrived {
            break;
        }
    }
    assert!(sweeps() - begun > 10_000, "it is a slow one: {}", sweeps() - begun);
    // The last step is finished.
    assert!(most < 1_000 + u64::from(SWEEPS), "{most}");
}

/// Two loops of control that are not synchronized: no step of the integration is whole.
#[test]
fn a_joint_arrives_while_another_one_is_commanded_all_the_time() {
    let world = world(Drivetrain { effort: 200.0, ..FREE }, [0.3, -0.8, 0.1]);
    let target = 0.5;
    world.set_goal(1, Goal::Position { target, speed: 1.0 }, at(0));
    world.set_goal(2, Goal::Hold, at(0));
    for step in 1..10_000 {
        world.set_goal(0, Goal::Effort(f64::from(step % 7)), at(i64::from(step) * 700));
    }
    let point = points(&world, at(10_000 * 700))[1];
    assert_eq!((point.position, point.velocity), (target, 0.0));
    world.set_goal(1, Goal::Stop, at(10_000 * 700));
    for step in 10_000..10_100 {
        world.set_goal(0, Goal::Effort(f64::from(step % 7)), at(i64::from(step) * 700));
    }
    assert_eq!(world.motor(1, at(10_100 * 700)).1, Goal::Free);
}
