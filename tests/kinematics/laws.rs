//! Laws of the kinematics of any robot.

use super::robots::{Anymal, panda, ur5};
use bb_core::kinematics::{Frames, InverseKinematics, InverseParams, Kinematics, KinematicsError, Target};
use bb_core::nalgebra::{Isometry3, Matrix6xX, Vector3};
use bb_core::prelude::*;
use bb_core::topology::{Joint, JointKind, Limit, Link, Mimic, Origin, Topology};
use bb_tests::laws;
use proptest::prelude::{Strategy, any, prop_assert};

robot! {
    robot Every;
    link base {
        joint drive: planar {
            axis: [0, 0, 1];
            link platform {
                joint lift: prismatic {
                    axis: [0, 0, 1];
                    limit: { lower: 0 m, upper: 1 m, velocity: 1 m/s, effort: 100 N };
                    link column {
                        joint swivel: continuous {
                            origin: { xyz: [10 cm, 0 m, 20 cm], rpy: [10 deg, 0 deg, 0 deg] };
                            axis: [1, 1, 0];
                            link head;
                        }
                        joint left: revolute {
                            origin: { xyz: [0 m, 30 cm, 0 m] };
                            axis: [0, 1, 0];
                            limit: { lower: -1 rad, upper: 2 rad, velocity: 1 rad/s, effort: 1 N*m };
                            link finger { joint nail: fixed { origin: { xyz: [0 m, 0 m, 10 cm] }; link tip; } }
                        }
                    }
                }
                joint ball: floating { link ball_link; }
            }
        }
    }
}

fn every() -> Kinematics {
    Kinematics::new(Every::TOPOLOGY).expect("`robot!` has checked it")
}

/// A position, a velocity, and two links of that robot.
fn states() -> impl Strategy<Value = (Vec<f64>, Vec<f64>, usize, usize)> {
    let kinematics = every();
    let positions = proptest::collection::vec(-2.0..2.0_f64, kinematics.positions());
    let velocities = proptest::collection::vec(-1.0..1.0_f64, kinematics.velocities());
    (positions, velocities, 0..Every::TOPOLOGY.links.len(), 0..Every::TOPOLOGY.links.len())
}

laws! {
    /// The Jacobian is the derivative of the transform along `integrate`.
    #[test]
    fn jacobians_are_derivatives((mut positions, velocity, base, tip) in states()) {
        let kinematics = every();
        let ball = kinematics.joint("ball").expect("it is declared").positions.clone();
        let norm = positions[ball.start + 3..].iter().take(4).map(|part| part * part).sum::<f64>().sqrt();
        proptest::prop_assume!(norm > 0.1);
        positions[ball.start + 3..ball.start + 7].iter_mut().for_each(|part| *part /= norm);
        let link = |number: usize| kinematics.link(Every::TOPOLOGY.links[number].name).expect("it is declared");
        let chain = kinematics.chain(link(base), link(tip)).expect("both are its links");
        let mut jacobian = Matrix6xX::zeros(kinematics.velocities());
        let now = chain.jacobian(&positions, &mut jacobian).expect("it fits");
        let twist = jacobian * bb_core::nalgebra::DVector::from_column_slice(&velocity);
        let at = |duration_s: f64| {
            let mut moved = positions.clone();
            kinematics.integrate(&mut moved, &velocity, duration_s).expect("it fits");
            chain.transform(&moved).expect("it fits")
        };
        let step = 1e-4;
        let (before, after) = (at(-step), at(step));
        let linear = (after.translation.vector - before.translation.vector) / (2.0 * step);
        let angular = (after.rotation * before.rotation.inverse()).scaled_axis() / (2.0 * step);
        prop_assert!((linear - twist.fixed_rows::<3>(0)).norm() < 1e-6, "{} at {}", linear, now);
        prop_assert!((angular - twist.fixed_rows::<3>(3)).norm() < 1e-6, "{} at {}", angular, now);
    }

    /// Moving on and back again leads to where it began.
    #[test]
    fn integration_is_undone_by_its_opposite((mut positions, velocity, ..) in states(), duration_s in 0.0..3.0_f64) {
        let kinematics = every();
        let ball = kinematics.joint("ball").expect("it is declared").positions.clone();
        positions[ball.start + 3..ball.start + 7].copy_from_slice(&[0.5, 0.5, -0.5, 0.5]);
        let mut moved = positions.clone();
        kinematics.integrate(&mut moved, &velocity, duration_s).expect("it fits");
        kinematics.integrate(&mut moved, &velocity, -duration_s).expect("it fits");
        for (number, (moved, position)) in moved.iter().zip(&positions).enumerate() {
            prop_assert!((moved - position).abs() < 1e-12, "number {}", number);
        }
    }

    /// A joint that turns without end is where it was after a whole turn.
    #[test]
    fn whole_turns_change_nothing(angle in -50.0..50.0_f64, _seed in any::<u8>()) {
        let kinematics = every();
        let (column, head) = (kinematics.link("column"), kinematics.link("head"));
        let chain = kinematics.chain(column.expect("declared"), head.expect("declared")).expect("its links");
        let mut positions = kinematics.neutral();
        let swivel = kinematics.joint("swivel").expect("it is declared").positions.start;
        positions[swivel] = angle;
        let once = chain.transform(&positions).expect("it fits");
        positions[swivel] = angle + std::f64::consts::TAU;
        let again = chain.transform(&positions).expect("it fits");
        prop_assert!((once.to_homogeneous() - again.to_homogeneous()).norm() < 1e-13);
    }
}

#[test]
fn a_chain_of_fixed_joints_is_a_constant() -> Result<(), KinematicsError> {
    let kinematics = every();
    let link = |name: &str| kinematics.link(name).ok_or_else(|| KinematicsError::NoLink(name.to_owned()));
    let chain = kinematics.chain(link("finger")?, link("tip")?)?;
    assert_eq!(chain.joints(), 0);
    let nail = chain.transform(&kinematics.neutral())?;
    assert!((nail.translation.vector - Vector3::new(0.0, 0.0, 0.1)).norm() < 1e-15);
    // Between links that one joint carries together, only the joints between them move them.
    assert_eq!(kinematics.chain(link("head")?, link("tip")?)?.joints(), 2);
    Ok(())
}

#[test]
fn a_mobile_manipulator_drives_to_where_its_arm_reaches() -> Result<(), KinematicsError> {
    let kinematics = every();
    let link = |name: &str| kinematics.link(name).ok_or_else(|| KinematicsError::NoLink(name.to_owned()));
    let mut solver = InverseKinematics::new(&kinematics, link("base")?, link("tip")?, InverseParams::default())?;
    let chain = kinematics.chain(link("base")?, link("tip")?)?;
    let mut wanted = kinematics.neutral();
    let drive = kinematics.joint("drive").map(|joint| joint.positions.clone()).unwrap_or_default();
    wanted[drive].copy_from_slice(&[3.0, -2.0, 2.5]);
    wanted[kinematics.joint("lift").map_or(0, |joint| joint.positions.start)] = 0.7;
    wanted[kinematics.joint("left").map_or(0, |joint| joint.positions.start)] = 1.2;
    let target = chain.transform(&wanted)?;
    let solution = solver.solve(&Target::Pose(target), &kinematics.neutral())?;
    let reached = chain.transform(solution.positions)?;
    assert!((reached.to_homogeneous() - target.to_homogeneous()).norm() < 1e-5);
    Ok(())
}

#[test]
fn nothing_is_allocated_once_it_is_made() -> Result<(), KinematicsError> {
    let arm = panda();
    let chain = arm.kinematics.chain(arm.base, arm.tip)?;
    let mut jacobian = Matrix6xX::zeros(arm.kinematics.velocities());
    let mut frames = Frames::new(arm.kinematics.clone());
    let posture = InverseParams { posture: arm.kinematics.neutral(), ..InverseParams::default() };
    let mut solver = InverseKinematics::new(&arm.kinematics, arm.base, arm.tip, posture)?;
    let neutral = arm.kinematics.neutral();
    let velocities = vec![0.1; arm.kinematics.velocities()];
    let mut efforts = vec![0.0; arm.kinematics.velocities()];
    let target = Target::Pose(Isometry3::translation(0.4, 0.2, 0.4));
    let mut result = Ok(());
    let allocations = allocation_counter::measure(|| {
        result = (|| {
            chain.transform(&neutral)?;
            chain.jacobian(&neutral, &mut jacobian)?;
            frames.update_motion(&neutral, &velocities, &velocities)?;
            frames.motion(arm.tip)?;
            frames.gravity_efforts(&Vector3::new(0.0, 0.0, -9.81), &mut efforts)?;
            frames.centre_of_mass();
            solver.solve(&target, &neutral).map(drop)
        })();
    });
    result?;
    assert_eq!(allocations.count_total, 0);
    Ok(())
}

#[test]
fn a_quadruped_holds_itself_up() -> Result<(), KinematicsError> {
    let kinematics = Kinematics::new(Anymal::TOPOLOGY)?;
    let mut frames = Frames::new(kinematics.clone());
    let mut efforts = vec![0.0; kinematics.velocities()];
    frames.gravity_efforts(&Vector3::new(0.0, 0.0, -9.81), &mut efforts)?;
    assert_eq!(kinematics.velocities(), 12);
    // Legs that hang down are pulled back by their weight times how far their centre is from the axis: the change of the
    // potential energy with each joint.
    let energy = |positions: &[f64]| -> Result<f64, KinematicsError> {
        let mut frames = Frames::new(kinematics.clone());
        frames.update(positions)?;
        Ok(frames.mass() * 9.81 * frames.centre_of_mass().map_or(0.0, |centre| centre.z))
    };
    for (index, effort) in efforts.iter().enumerate() {
        let at = |by: f64| {
            let mut positions = kinematics.neutral();
            positions[index] += by;
            energy(&positions)
        };
        let slope = (at(1e-5)? - at(-1e-5)?) / 2e-5;
        assert!((slope - effort).abs() < 1e-6, "joint {index}: {slope} and {effort}");
    }
    Ok(())
}

const LINK: Link =
    Link { name: "link", parent_joint: None, root_from_link: None, inertial: None, visuals: &[], collisions: &[] };

const JOINT: Joint = Joint {
    name: "joint",
    kind: JointKind::Revolute,
    parent: 0,
    child: 1,
    parent_from_joint: Origin::IDENTITY,
    axis: Some([0.0, 0.0, 2.0]),
    limit: None,
    dynamics: None,
    mimic: None,
    transmission: None,
};

fn made(joints: &[Joint], links: usize) -> Result<Kinematics, KinematicsError> {
    Kinematics::new(&Topology { links: vec![LINK; links].leak(), joints: joints.to_vec().leak() })
}

#[test]
fn links_that_are_no_tree_and_joints_that_cannot_move_are_refused() {
    assert!(made(&[JOINT], 2).is_ok());
    assert!(made(&[], 0).is_ok(), "a robot without links has no coordinates");
    let error = |joints: &[Joint], links| made(joints, links).expect_err("it is refused");
    assert_eq!(error(&[JOINT, JOINT], 2), KinematicsError::TwoParents { link: "link" });
    assert_eq!(error(&[Joint { child: 0, ..JOINT }], 2), KinematicsError::TwoParents { link: "link" });
    assert_eq!(error(&[Joint { child: 9, ..JOINT }], 2), KinematicsError::TwoParents { link: "" });
    assert_eq!(error(&[JOINT], 3), KinematicsError::Unreachable { link: "link" });
    let circle = [Joint { parent: 2, child: 1, ..JOINT }, Joint { parent: 1, child: 2, ..JOINT }];
    assert_eq!(error(&circle, 3), KinematicsError::Unreachable { link: "link" });
    for axis in [None, Some([0.0; 3]), Some([f64::NAN, 0.0, 1.0]), Some([f64::INFINITY, 0.0, 0.0])] {
        assert_eq!(error(&[Joint { axis, ..JOINT }], 2), KinematicsError::NoAxis { joint: "joint" }, "{axis:?}");
    }
    let limit = Limit { lower: Some(-1.0), upper: Some(1.0), velocity: Some(2.0), effort: Some(3.0) };
    let refused = [
        Limit { lower: Some(1.1), ..limit },
        Limit { lower: Some(f64::NAN), ..limit },
        Limit { upper: Some(f64::NAN), ..limit },
        Limit { velocity: Some(f64::NAN), ..limit },
        Limit { effort: Some(f64::NAN), lower: None, ..limit },
    ];
    for limit in refused {
        let joint = Joint { limit: Some(limit), ..JOINT };
        assert_eq!(error(&[joint], 2), KinematicsError::Limit { joint: "joint" }, "{limit:?}");
        let joint = Joint { kind: JointKind::Continuous, ..joint };
        assert_eq!(error(&[joint], 2), KinematicsError::Limit { joint: "joint" }, "{limit:?}");
    }
    let message = "the lower limit of the joint `joint` is above the upper one, or a limit is NaN";
    assert_eq!(KinematicsError::Limit { joint: "joint" }.to_string(), message);
    assert!(made(&[Joint { limit: Some(Limit { lower: Some(1.0), ..limit }), ..JOINT }], 2).is_ok());
    let mimic = |joint| Some(Mimic { joint, multiplier: 1.0, offset: 0.0 });
    assert_eq!(error(&[Joint { mimic: mimic(0), ..JOINT }], 2), KinematicsError::Mimic { joint: "joint" });
    assert_eq!(error(&[Joint { mimic: mimic(7), ..JOINT }], 2), KinematicsError::Mimic { joint: "joint" });
    let floating = Joint { kind: JointKind::Floating, ..JOINT };
    let follower = Joint { mimic: mimic(0), child: 2, ..JOINT };
    assert_eq!(error(&[floating, follower], 3), KinematicsError::Mimic { joint: "joint" });
    let planar = Joint { kind: JointKind::Planar, mimic: mimic(0), child: 2, ..JOINT };
    assert_eq!(error(&[JOINT, planar], 3), KinematicsError::Mimic { joint: "joint" });
}

#[test]
fn limits_of_a_joint_that_mimics_are_limits_of_the_other() -> Result<(), KinematicsError> {
    let limit = |lower, upper| Some(Limit { lower: Some(lower), upper: Some(upper), velocity: None, effort: None });
    let first = Joint { limit: limit(-3.0, 3.0), ..JOINT };
    let mimic = Some(Mimic { joint: 0, multiplier: -2.0, offset: 1.0 });
    let second = Joint { child: 2, mimic, limit: limit(-1.0, 5.0), ..JOINT };
    let kinematics = made(&[first, second], 3)?;
    // -1 <= -2 q + 1 <= 5
    assert_eq!(kinematics.bounds(), [(-2.0, 1.0)]);
    assert_eq!((kinematics.positions(), kinematics.velocities()), (1, 1));
    Ok(())
}

#[test]
fn a_state_of_another_length_is_an_error() -> Result<(), KinematicsError> {
    let arm = ur5();
    let chain = arm.kinematics.chain(arm.base, arm.tip)?;
    let given = KinematicsError::Coordinates { what: "positions", expected: 6, given: 5 };
    assert_eq!(chain.transform(&[0.0; 5]), Err(given.clone()));
    assert_eq!(chain.jacobian(&[0.0; 5], &mut Matrix6xX::zeros(6)), Err(given.clone()));
    let columns = KinematicsError::Coordinates { what: "columns", expected: 6, given: 7 };
    assert_eq!(chain.jacobian(&[0.0; 6], &mut Matrix6xX::zeros(7)), Err(columns));
    let mut frames = Frames::new(arm.kinematics.clone());
    assert_eq!(frames.update(&[0.0; 5]), Err(given));
    assert!(frames.update_motion(&[0.0; 6], &[0.0; 5], &[0.0; 6]).is_err());
    assert!(frames.update_motion(&[0.0; 6], &[0.0; 6], &[0.0; 7]).is_err());
    assert!(frames.gravity_efforts(&Vector3::z(), &mut [0.0; 5]).is_err());
    assert!(arm.kinematics.integrate(&mut [0.0; 6], &[0.0; 7], 1.0).is_err());
    Ok(())
}
