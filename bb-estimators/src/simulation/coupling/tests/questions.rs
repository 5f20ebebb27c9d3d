//! Queries of a world, by any caller, at any rate and about any time, do not change what happens in it.

use super::{ARM, FREE, NAMES, at};
use crate::motion::JointPath;
use crate::simulation::plant::{Drivetrain, Goal};
use crate::simulation::world::{SimulatedJoint, SimulatedWorld};
use bb_core::payload::{JointTrajectory, TrajectoryPoint};
use bb_core::topology::{Link, Topology};
use bb_tests::laws;
use nalgebra::{Isometry3, Vector3};
use proptest::prelude::*;
use std::sync::Arc;

/// Arm without masses: each joint moves by itself.
static LIGHT: Topology = Topology {
    links: &[
        Link { inertial: None, ..ARM.links[0] },
        Link { inertial: None, ..ARM.links[1] },
        Link { inertial: None, ..ARM.links[2] },
        Link { inertial: None, ..ARM.links[3] },
    ],
    joints: ARM.joints,
};

/// Event in a world.
#[derive(Clone, Debug)]
enum Happens {
    Goal(usize, Goal),
    /// An obstacle this far from a joint on both sides, or none.
    Obstacle(usize, Option<f64>),
    /// A motor is added, or its properties change.
    Motor(usize),
    Gravity(f64),
    Root(f64),
}

fn path(joint: usize, target: f64, seconds: f64) -> Goal {
    let point = |position: f64, seconds: f64| TrajectoryPoint {
        time_from_start: std::time::Duration::from_secs_f64(seconds),
        positions: vec![position],
        velocities: Vec::new(),
        accelerations: Vec::new(),
        efforts: Vec::new(),
    };
    let points = [point(0.0, 0.0), point(target, seconds)].into();
    let trajectory = JointTrajectory { joint_names: [NAMES[joint].to_owned()].into(), points };
    let path = JointPath::of(&trajectory, NAMES[joint]).expect("it has the joint");
    Goal::Path { start: at(0), path: Arc::new(path) }
}

fn happenings() -> impl Strategy<Value = Happens> {
    let goal = prop_oneof![
        3 => Just(Goal::Hold),
        1 => Just(Goal::Stop),
        1 => Just(Goal::Free),
        1 => (-30.0..30.0).prop_map(Goal::Effort),
        1 => (-4.0..4.0).prop_map(Goal::Velocity),
        2 => (-2.0..2.0).prop_map(|target| Goal::Position { target, speed: 2.0 }),
    ];
    prop_oneof![
        6 => (0_usize..3, goal).prop_map(|(joint, goal)| Happens::Goal(joint, goal)),
        1 => (0_usize..3, -1.0..1.0, 0.05..0.5).prop_map(|(joint, to, s)| Happens::Goal(joint, path(joint, to, s))),
        1 => (0_usize..3, proptest::option::of(0.0..0.5)).prop_map(|(joint, gap)| Happens::Obstacle(joint, gap)),
        1 => (0_usize..3).prop_map(Happens::Motor),
        1 => prop_oneof![Just(0.0), Just(-9.8)].prop_map(Happens::Gravity),
        1 => (0.0..3.0).prop_map(Happens::Root),
    ]
}

/// Lets it happen at `now`.
fn happen(world: &SimulatedWorld, happens: &Happens, drivetrain: Drivetrain, now: i64) {
    let state = |joint: usize| world.joint(NAMES[joint], at(now)).expect("it is declared").point;
    match happens {
        Happens::Goal(joint, Goal::Path { path, .. }) => {
            world.set_goal(*joint, Goal::Path { start: at(now), path: Arc::clone(path) }, at(now));
        }
        Happens::Goal(joint, goal) => world.set_goal(*joint, goal.clone(), at(now)),
        Happens::Obstacle(joint, gap) => {
            let (gap, position) = (gap.unwrap_or(f64::INFINITY), state(*joint).position);
            // A joint without an actuator has no obstacles: the error is not of interest here.
            let _ = world.obstruct(NAMES[*joint], position - gap, position + gap, at(now));
        }
        Happens::Motor(joint) => {
            let inertia = drivetrain.inertia * 1.5;
            world.add(NAMES[*joint], Drivetrain { inertia, ..drivetrain }, 0.2, at(now)).expect("it is declared");
        }
        Happens::Gravity(up) => world.set_gravity(at(now), Vector3::new(0.0, 0.0, *up)),
        Happens::Root(rate) => {
            let rate = *rate;
            world.move_root(at(now), move |time_s| Isometry3::translation(0.1 * (rate * time_s).sin(), 0.0, 0.0));
        }
    }
}

/// Runs a world of `topology`, of whose joints those in `has_motor` have a motor from the start, and asks it every
/// `every` microseconds, if at all, about then and about `back` microseconds before.
fn run(
    topology: &'static Topology,
    (has_motor, drivetrain): ([bool; 3], Drivetrain),
    happenings: &[(Happens, i64)],
    every: Option<(usize, i64)>,
) -> [SimulatedJoint; 3] {
    let world = SimulatedWorld::new(topology);
    for (name, _) in NAMES.into_iter().zip(has_motor).filter(|(_, has)| *has) {
        world.add(name, drivetrain, 0.1, at(0)).expect("it is declared");
    }
    let mut now = 0;
    for (happens, micros) in happenings {
        happen(&world, happens, drivetrain, now);
        let end = now + micros;
        if let Some((step, back)) = every {
            for asked in (now..end).step_by(step) {
                for name in NAMES {
                    world.joint(name, at(asked)).expect("it is declared");
                    world.joint(name, at(asked - back)).expect("it is declared");
                }
            }
        }
        now = end;
    }
    NAMES.map(|name| world.joint(name, at(now)).expect("it is declared"))
}

laws! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// One that is asked every millisecond takes each step; one that is asked once, at the end, skips those at rest.
    #[test]
    fn a_world_that_is_asked_all_the_time_agrees_with_one_that_is_asked_at_the_end(
        has_masses in any::<bool>(),
        has_motor in proptest::array::uniform3(proptest::bool::weighted(0.8)),
        happenings in proptest::collection::vec((happenings(), 1_i64..300_000), 1..8),
        (effort, friction, damping) in (0.5..60.0, 0.0..3.0, 0.0..2.0),
        rest in 1_i64..2_000_000,
        (every, back) in (prop_oneof![Just(1_000_usize), 300_usize..7_000], 0_i64..5_000),
    ) {
        let drivetrain = Drivetrain { effort, friction, damping, lower: -2.5, upper: 2.5, ..FREE };
        let mut happenings = happenings;
        if let Some((_, micros)) = happenings.last_mut() {
            *micros += rest;
        }
        let topology = if has_masses { &ARM } else { &LIGHT };
        let run = |every| run(topology, (has_motor, drivetrain), &happenings, every);
        prop_assert_eq!(run(Some((every, back))), run(None));
    }
}
