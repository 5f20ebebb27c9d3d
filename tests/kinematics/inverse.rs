//! Inverse kinematics of arms with six and seven axes.

use super::robots::{Arm, panda, ur5};
use bb_core::kinematics::{InverseKinematics, InverseParams, KinematicsError, Target};
use bb_core::nalgebra::{Isometry3, Matrix6xX, Vector3};
use proptest::prelude::Rng;
use proptest::test_runner::{RngAlgorithm, TestRng};

/// Numbers from 0 to 1.
struct Uniform(TestRng);

impl Uniform {
    fn new(seed: u8) -> Self {
        Self(TestRng::from_seed(RngAlgorithm::ChaCha, &[seed; 32]))
    }

    fn next(&mut self) -> f64 {
        self.0.next_u64() as f64 / u64::MAX as f64
    }

    /// A position within the limits.
    fn position(&mut self, arm: &Arm) -> Vec<f64> {
        arm.kinematics.bounds().iter().map(|(lower, upper)| lower + (upper - lower) * self.next()).collect()
    }
}

fn solver(arm: &Arm, params: InverseParams) -> InverseKinematics {
    InverseKinematics::new(&arm.kinematics, arm.base, arm.tip, params).expect("both are its links")
}

/// Returns the distance between two poses: m, rad.
fn apart(left: &Isometry3<f64>, right: &Isometry3<f64>) -> (f64, f64) {
    let between = left.inv_mul(right);
    (between.translation.vector.norm(), between.rotation.angle())
}

#[test]
fn every_random_reachable_pose_is_reached_within_the_limits() -> Result<(), KinematicsError> {
    for (arm, typical) in [(panda(), 30), (ur5(), 16)] {
        let chain = arm.kinematics.chain(arm.base, arm.tip)?;
        let mut solver = solver(&arm, InverseParams::default());
        let mut random = Uniform::new(7);
        let mut iterations = Vec::new();
        for number in 0..1_000 {
            let target = chain.transform(&random.position(&arm))?;
            let solution = solver.solve(&Target::Pose(target), &arm.kinematics.neutral());
            let solution = solution.unwrap_or_else(|error| panic!("{} {number}: {error}", arm.name));
            let (position, rotation) = apart(&chain.transform(solution.positions)?, &target);
            assert!(
                position <= 1.001e-6 && rotation <= 1.001e-6,
                "{} {number}: {position} m, {rotation} rad",
                arm.name
            );
            let is_within = solution.positions.iter().zip(arm.kinematics.bounds());
            assert!(is_within.into_iter().all(|(position, (lower, upper))| lower <= position && position <= upper));
            iterations.push(solution.iterations);
        }
        iterations.sort_unstable();
        assert!(iterations[500] <= typical, "{}: {} iterations in the median", arm.name, iterations[500]);
    }
    Ok(())
}

#[test]
fn a_path_is_followed_without_jumps() -> Result<(), KinematicsError> {
    let arm = panda();
    let chain = arm.kinematics.chain(arm.base, arm.tip)?;
    let mut solver = solver(&arm, InverseParams::default());
    let mut positions = vec![0.3, -0.4, 0.2, -2.0, 0.1, 1.7, 0.5, 0.0];
    let begin = chain.transform(&positions)?;
    for step in 1..=200 {
        let angle = f64::from(step) * 0.05;
        let mut target = begin;
        target.translation.vector += Vector3::new(0.1 * (angle.cos() - 1.0), 0.1 * angle.sin(), 0.0);
        let solution = solver.solve(&Target::Pose(target), &positions)?;
        let jump =
            solution.positions.iter().zip(&positions).fold(0.0_f64, |most, (new, old)| most.max((new - old).abs()));
        assert!(jump < 0.05 && solution.restarts == 0, "step {step}: {jump} rad");
        positions.copy_from_slice(solution.positions);
    }
    Ok(())
}

/// Elbow stretched, wrist stretched, both, or all at zero: there a direction is left in which no joint moves the tip.
#[test]
fn singular_poses_are_reached_and_left_again() -> Result<(), KinematicsError> {
    let arm = ur5();
    let chain = arm.kinematics.chain(arm.base, arm.tip)?;
    let mut solver = solver(&arm, InverseParams::default());
    let mut random = Uniform::new(11);
    let mut jacobian = Matrix6xX::zeros(arm.kinematics.velocities());
    let (elbow, wrist) = (2, 4);
    for stretched in [&[elbow][..], &[wrist], &[elbow, wrist], &[0, 1, 2, 3, 4, 5]] {
        for number in 0..50 {
            let mut singular = random.position(&arm);
            stretched.iter().for_each(|joint| singular[*joint] = 0.0);
            let target = chain.jacobian(&singular, &mut jacobian)?;
            let smallest = jacobian.singular_values().min();
            assert!(smallest < 1e-9, "{stretched:?}: {smallest} is not singular");
            let solution = solver.solve(&Target::Pose(target), &arm.kinematics.neutral());
            let solution = solution.unwrap_or_else(|error| panic!("{stretched:?} {number}: {error}"));
            let (position, rotation) = apart(&chain.transform(solution.positions)?, &target);
            assert!(position <= 1.001e-6 && rotation <= 1.001e-6, "{stretched:?}: {position} m, {rotation} rad");
            // Back towards the base by a millimetre, which is where an arm that is stretched cannot go at once.
            let mut back = target;
            back.translation.vector *= 1.0 - 1e-3 / target.translation.vector.norm();
            let told = match solver.solve(&Target::Pose(back), &singular) {
                Ok(solution) => solution.position_error,
                // No other pose of a stretched wrist need be in reach.
                Err(KinematicsError::NotConverged { position_error, .. }) if stretched.contains(&wrist) => {
                    position_error
                }
                Err(error) => panic!("{stretched:?} {number}, back: {error}"),
            };
            let is = apart(&chain.transform(solver.best())?, &back).0;
            assert!((told - is).abs() < 1e-12 && is < 1e-3, "{stretched:?} {number}: {told} m, but {is} m");
        }
    }
    Ok(())
}

#[test]
fn what_is_out_of_reach_is_said_to_be_off_by_what_it_is() -> Result<(), KinematicsError> {
    let arm = ur5();
    let chain = arm.kinematics.chain(arm.base, arm.tip)?;
    let mut solver = solver(&arm, InverseParams { max_iterations: 500, ..InverseParams::default() });
    let far = Vector3::new(3.0, 0.0, 0.1);
    let error = solver.solve(&Target::Position(far), &arm.kinematics.neutral()).expect_err("it is 3 m away");
    let KinematicsError::NotConverged { position_error, rotation_error, iterations } = error else {
        panic!("{error}");
    };
    let best = chain.transform(solver.best())?.translation.vector;
    assert!(((far - best).norm() - position_error).abs() < 1e-12);
    // Its arm is 0.95 m long, from a shoulder at 0.09 m: it points there.
    assert!((position_error - 2.05).abs() < 0.02, "{position_error}");
    assert_eq!((rotation_error, iterations), (0.0, 500));
    Ok(())
}

#[test]
fn a_position_alone_leaves_the_orientation_free() -> Result<(), KinematicsError> {
    let arm = ur5();
    let chain = arm.kinematics.chain(arm.base, arm.tip)?;
    let mut solver = solver(&arm, InverseParams::default());
    let mut random = Uniform::new(3);
    for _ in 0..200 {
        let target = chain.transform(&random.position(&arm))?.translation.vector;
        let solution = solver.solve(&Target::Position(target), &arm.kinematics.neutral())?;
        assert!((chain.transform(solution.positions)?.translation.vector - target).norm() <= 1.001e-6);
        assert_eq!(solution.rotation_error, 0.0);
    }
    Ok(())
}

#[test]
fn what_the_target_leaves_free_goes_to_the_posture() -> Result<(), KinematicsError> {
    let arm = panda();
    let chain = arm.kinematics.chain(arm.base, arm.tip)?;
    let elbow = [0.0, -0.5, 0.0, -2.2, 0.0, 1.8, 0.8, 0.0];
    let start = [0.6, -0.2, -0.7, -2.0, 0.5, 2.0, 0.3, 0.0];
    let target = Target::Pose(chain.transform(&start)?);
    let distance =
        |positions: &[f64]| positions.iter().zip(&elbow).map(|(q, p)| (q - p).powi(2)).sum::<f64>().sqrt();
    let without = distance(solver(&arm, InverseParams::default()).solve(&target, &start)?.positions);
    let posture = InverseParams { posture: elbow.to_vec(), ..InverseParams::default() };
    let mut solver = solver(&arm, posture);
    let solution = solver.solve(&target, &start)?;
    let with = distance(solution.positions);
    assert!(
        solution.position_error <= 1e-6 && with < 0.8 * without,
        "{with} rad from the posture, {without} without"
    );
    // There it stays: nothing is left to gain.
    let nearest = solution.positions.to_vec();
    let again = distance(solver.solve(&target, &nearest)?.positions);
    assert!((again - with).abs() < 0.01 * with, "{again} and {with}");
    Ok(())
}

#[test]
fn a_posture_never_takes_a_solution_away() -> Result<(), KinematicsError> {
    let arm = ur5();
    let chain = arm.kinematics.chain(arm.base, arm.tip)?;
    let mut random = Uniform::new(11);
    for number in 0..300 {
        // Within and far beyond the limits.
        let posture = random.position(&arm).iter().map(|position| position * 3.0).collect();
        let start = random.position(&arm);
        let target = chain.transform(&start)?;
        let params = InverseParams { posture, ..InverseParams::default() };
        let solved = solver(&arm, params).solve(&Target::Pose(target), &start).map(|solution| solution.iterations);
        assert!(solved.as_ref().is_ok_and(|iterations| *iterations <= 61), "{number}: {solved:?}");
    }
    Ok(())
}

#[test]
fn a_joint_of_more_weight_moves_less() -> Result<(), KinematicsError> {
    let arm = panda();
    let chain = arm.kinematics.chain(arm.base, arm.tip)?;
    let start = [0.0, -0.5, 0.0, -2.2, 0.0, 1.8, 0.8, 0.0];
    let mut target = chain.transform(&start)?;
    target.translation.vector += Vector3::new(0.0, 0.15, 0.0);
    let moved = |weights: Vec<f64>| -> Result<f64, KinematicsError> {
        let params = InverseParams { weights, ..InverseParams::default() };
        let mut solver = solver(&arm, params);
        Ok((solver.solve(&Target::Pose(target), &start)?.positions[0] - start[0]).abs())
    };
    let mut heavy = vec![1.0; 8];
    heavy[0] = 50.0;
    let (heavy, light) = (moved(heavy)?, moved(Vec::new())?);
    assert!(heavy < 0.5 * light, "{heavy} rad, {light} rad without the weight");
    Ok(())
}

#[test]
fn bad_input_is_an_error() -> Result<(), KinematicsError> {
    let arm = ur5();
    let new = |params| InverseKinematics::new(&arm.kinematics, arm.base, arm.tip, params).map(drop);
    let short = KinematicsError::Coordinates { what: "weights", expected: 6, given: 2 };
    assert_eq!(new(InverseParams { weights: vec![1.0; 2], ..InverseParams::default() }), Err(short));
    for weight in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(new(InverseParams { weights: vec![weight; 6], ..InverseParams::default() }).is_err());
    }
    assert!(new(InverseParams { posture: vec![f64::NAN; 6], ..InverseParams::default() }).is_err());
    let mut solver = solver(&arm, InverseParams::default());
    let neutral = arm.kinematics.neutral();
    let nowhere = Target::Position(Vector3::new(f64::NAN, 0.0, 0.0));
    assert_eq!(solver.solve(&nowhere, &neutral), Err(KinematicsError::NotFinite { what: "target" }));
    let somewhere = Target::Position(Vector3::new(0.3, 0.3, 0.3));
    assert_eq!(solver.solve(&somewhere, &[f64::NAN; 6]), Err(KinematicsError::NotFinite { what: "start" }));
    let short = KinematicsError::Coordinates { what: "positions", expected: 6, given: 3 };
    assert_eq!(solver.solve(&somewhere, &neutral[..3]), Err(short));
    // Beyond all limits: it begins at the nearest.
    assert!(solver.solve(&somewhere, &[100.0; 6]).is_ok());
    Ok(())
}
