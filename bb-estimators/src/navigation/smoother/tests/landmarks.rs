//! Landmarks against a dense batch solution that has them as unknowns of their own, on random problems.

use bb_tests::laws;
use nalgebra::{DMatrix, DVector, Matrix2, Matrix2x3, SMatrix, UnitQuaternion, Vector2, Vector3};
use proptest::prelude::*;

use super::super::landmark::Sight;
use super::dense::{Dense, agrees, agrees_at};
use super::flight::{matrix, open};
use crate::navigation::camera::Undistorted;
use crate::navigation::factor::Rows;
use crate::navigation::noise::Noise;
use crate::navigation::{
    Camera, FixedLagSmoother, Kernel, LandmarkParams, NAVIGATION, Navigation, POSITION, ROTATION, RelativePose,
    SmootherParams, Start,
};

type Plain = FixedLagSmoother;
const N: usize = NAVIGATION;

/// Two solutions may be apart by this part of the rounding of one number, times the condition of the system. The most found is
/// 0.006, at a stored seed with a condition of 2e9.
const ROUNDING: f64 = 0.02;

/// A smoother with a random problem in its window, and the same problem as one dense system: keyframes first, then landmarks.
struct Problem {
    smoother: Plain,
    dense: Dense<N>,
    keyframes: usize,
}

impl Problem {
    fn new(seed: u64, keyframes: usize, landmarks: usize) -> Self {
        let mut noise = Noise::new(seed);
        let params = SmootherParams { window: keyframes.max(2), ..SmootherParams::default() };
        let mut smoother = Plain::new(params).unwrap();
        let camera = Camera::pinhole((500.0, 500.0), (400.0, 300.0), (800.0, 600.0));
        // Some have to be cut.
        let persistent = (seed % 5) as usize;
        let of_landmarks =
            LandmarkParams { kernel: Kernel::Squares, landmarks, persistent, ..LandmarkParams::default() };
        smoother.set_camera(camera, of_landmarks).unwrap();
        smoother.landmarks.as_mut().unwrap().known_within = f64::INFINITY;
        let level = (UnitQuaternion::identity(), 1.0);
        smoother.start(0, &Start::at(0, (Vector3::zeros(), 1.0), (Vector3::zeros(), 1.0), level)).unwrap();
        let mut problem = Self { smoother, dense: Dense::new(keyframes * N + 3 * landmarks), keyframes };
        for k in 0..keyframes {
            problem.keyframe(&mut noise, k);
        }
        for landmark in 0..landmarks {
            problem.landmark(&mut noise, landmark);
        }
        problem.smoother.dirty = 0;
        problem
    }

    /// The covariance and the solution of the dense system, refined: its inverse alone loses digits to its condition. The last
    /// number is how far apart two solutions in floating point may be, as a fraction.
    fn batch(&self) -> (DMatrix<f64>, DVector<f64>, f64) {
        let Dense { matrix, vector } = &self.dense;
        let rough = matrix.clone().cholesky().unwrap().inverse();
        let identity = DMatrix::identity(matrix.nrows(), matrix.ncols());
        let covariance = &rough + &rough * (identity - matrix * &rough);
        let solution = &covariance * vector;
        let refined = &solution + &covariance * (vector - matrix * &solution);
        let condition = matrix.norm() * covariance.norm();
        (covariance, refined, 1e-8_f64.max(ROUNDING * f64::EPSILON * condition))
    }

    fn keyframe(&mut self, noise: &mut Noise, k: usize) {
        let own = self.dense.own(noise, k);
        if k > 0 {
            let mut keyframe = self.smoother.spare.pop().unwrap();
            let point = self.smoother.window[0].point;
            let motion = self.smoother.motion;
            keyframe.renew(k as u64, point, &motion);
            let len = self.smoother.window.len();
            self.smoother.landmarks.as_mut().unwrap().coupling.append(len);
            self.smoother.window.push_back(keyframe);
            self.smoother.window[k].link = self.dense.link(noise, k, 1.0);
        }
        self.smoother.window[k].prior = None;
        self.smoother.window[k].own = own;
    }

    /// A landmark with a prior that some of the keyframes see. Its observations are added one by one or at once, or
    /// removed in between.
    fn landmark(&mut self, noise: &mut Noise, number: usize) {
        let at = self.keyframes * N + 3 * number;
        let mean = noise.vector(1.0);
        let landmarks = self.smoother.landmarks.as_mut().unwrap();
        let index = landmarks.begin(number as u64, Some((mean, 2.0))).unwrap();
        let weight = 0.25;
        for i in 0..3 {
            self.dense.matrix[(at + i, at + i)] += weight;
        }
        let landmark = &mut landmarks.all[index];
        // Some are lost, some still tracked.
        landmark.last = if noise.next() > 0.0 { 100 } else { 0 };
        let mut order: Vec<usize> = (0..self.keyframes).filter(|_| noise.next() > -0.5).collect();
        if noise.next() > 0.0 {
            order.reverse();
        }
        let mut rows = [landmarks.coupling.row(), landmarks.coupling.row(), landmarks.coupling.row()];
        for (turn, k) in order.into_iter().enumerate() {
            let jacobian = Matrix2x3::from_fn(|_, _| noise.next());
            let seen = Undistorted { direction: Vector2::zeros(), jacobian: Matrix2::identity() };
            let sight = Sight {
                serial: k as u64,
                version: self.smoother.window[k].version,
                seen,
                precision: 1.0,
                weight: 0.2 + noise.next().abs(),
                jacobian,
                residual: Vector2::from_fn(|_, _| noise.next()),
                arm: noise.vector(2.0),
            };
            landmark.add_one(&sight, &mut landmarks.coupling, &mut rows, 1.0);
            if turn % 3 == 2 {
                landmark.add_one(&sight, &mut landmarks.coupling, &mut rows, -1.0);
                landmark.add_one(&sight, &mut landmarks.coupling, &mut rows, 1.0);
            }
            landmark.insert(sight);
            landmark.sum();
            assert!(landmark.is_used);
            if turn % 2 == 1 {
                landmark.add_to(&mut landmarks.coupling, &mut rows, -1.0);
                landmark.add_to(&mut landmarks.coupling, &mut rows, 1.0);
            }
            // The same rows, for keyframe and landmark.
            let mut dense = DMatrix::zeros(2, self.dense.vector.len());
            dense.view_mut((0, k * N + POSITION), (2, 3)).copy_from(&-jacobian);
            dense.view_mut((0, k * N + ROTATION), (2, 3)).copy_from(&(jacobian * sight.arm.cross_matrix()));
            dense.view_mut((0, at), (2, 3)).copy_from(&jacobian);
            let residual = DVector::from_column_slice(sight.residual.as_slice());
            self.dense.observe(0, &dense, &(DMatrix::identity(2, 2) * sight.weight), &residual);
        }
    }

    /// A relative pose between a keyframe and the previous one, more or less precise than the link between them.
    fn relative_pose(&mut self, noise: &mut Noise, k: usize) {
        let deviation = 0.3 * noise.next().exp();
        let level = UnitQuaternion::identity();
        let pose = RelativePose::new(k as u64 - 1, (noise.vector(1.0), deviation), (level, deviation));
        let (before, keyframe) = (&self.smoother.window[k - 1], &self.smoother.window[k]);
        let mut rows = Rows::new();
        keyframe.rows::<Navigation>(&pose.into(), Some(before), &mut rows).unwrap();
        let [before, here] = [rows.previous, rows.at].map(|rows| matrix(&rows).fixed_rows::<6>(0).into_owned());
        assert_eq!(rows.count, 6);
        self.dense.pair(
            k,
            &before,
            &here,
            &SMatrix::identity(),
            &matrix(&[rows.residual]).transpose().fixed_rows::<6>(0).into(),
        );
        self.smoother.add(&mut open(), k as u64, pose).unwrap();
    }
}

/// Compares every correction and covariance of the window, and every landmark.
fn compare(
    smoother: &mut Plain,
    left: usize,
    (covariance, solution, within): &(DMatrix<f64>, DVector<f64>, f64),
    keyframes: usize,
) -> Result<(), TestCaseError> {
    smoother.eliminate(usize::MAX);
    smoother.solve_all();
    for index in 0..smoother.window.len() {
        let known = smoother.covariance_now(index).unwrap();
        let mean = smoother.window[index].correction;
        agrees_at((&mean, &known), (solution, covariance), (index + left) * N, *within)?;
    }
    let landmarks = smoother.landmarks.as_ref().unwrap();
    for landmark in landmarks.all.iter().filter(|landmark| landmark.slot.is_some() || !landmark.sights.is_empty()) {
        let at = keyframes * N + 3 * landmark.id as usize;
        let correction = landmarks.correction(landmark, &smoother.window);
        agrees((0..3).map(|i| (correction[i], solution[at + i])), *within, "landmark")?;
    }
    Ok(())
}

laws! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn it_is_the_batch(seed in any::<u64>(), keyframes in 1_usize..8, landmarks in 1_usize..9) {
        let mut problem = Problem::new(seed, keyframes, landmarks);
        let batch = problem.batch();
        compare(&mut problem.smoother, 0, &batch, keyframes)?;
    }

    /// Information that leaves the window is not lost: the remaining keyframes match the solution with all of them.
    #[test]
    fn marginalised_is_the_batch(seed in any::<u64>(), keyframes in 3_usize..8, landmarks in 1_usize..9) {
        let mut problem = Problem::new(seed, keyframes, landmarks);
        let (covariance, solution, within) = problem.batch();
        // Each keyframe that leaves rounds once more.
        let batch = (covariance, solution, 30.0 * within);
        compare(&mut problem.smoother, 0, &batch, keyframes)?;
        for left in 1..keyframes - 1 {
            problem.smoother.marginalise();
            let found = |smoother: &Plain| {
                let landmarks = smoother.landmarks.as_ref().unwrap();
                let all = landmarks.all.iter().filter(|landmark| landmark.slot.is_some());
                all.map(|landmark| landmarks.correction(landmark, &smoother.window)).collect::<Vec<_>>()
            };
            let before = found(&problem.smoother);
            problem.smoother.solve_all();
            for (before, after) in before.iter().zip(found(&problem.smoother)) {
                prop_assert!((before - after).norm() <= 1e-9 * (1.0 + after.norm()), "{before} {after}");
            }
            compare(&mut problem.smoother, left, &batch, keyframes)?;
            // Also when everything is eliminated again.
            problem.smoother.dirty = 0;
            compare(&mut problem.smoother, left, &batch, keyframes)?;
        }
    }

    /// A relative pose may come at any keyframe, after landmarks that both its keyframes have seen.
    #[test]
    fn later_relative_poses_are_in_the_batch(
        seed in any::<u64>(),
        keyframes in 2_usize..8,
        landmarks in 1_usize..6,
        places in prop::collection::vec(1_usize..8, 1..5),
    ) {
        let mut problem = Problem::new(seed, keyframes, landmarks);
        let batch = problem.batch();
        compare(&mut problem.smoother, 0, &batch, keyframes)?;
        let mut noise = Noise::new(!seed);
        for place in places {
            problem.relative_pose(&mut noise, (place - 1) % (keyframes - 1) + 1);
            let (covariance, solution, within) = problem.batch();
            // The noise of the link is inverted once more.
            let batch = (covariance, solution, 100.0 * within);
            compare(&mut problem.smoother, 0, &batch, keyframes)?;
        }
    }

    /// Appending a keyframe does not eliminate all others again, and gives the same result as if it did.
    #[test]
    fn the_newest_alone_is_as_all(seed in any::<u64>(), landmarks in 1_usize..6) {
        let mut problem = Problem::new(seed, 5, landmarks);
        problem.smoother.eliminate(usize::MAX);
        problem.smoother.window[4].own.vector[2] += 1.0;
        problem.smoother.window[4].own.matrix[2][2] += 1.0;
        problem.dense.vector[4 * N + 2] += 1.0;
        problem.dense.matrix[(4 * N + 2, 4 * N + 2)] += 1.0;
        problem.smoother.dirty = 4;
        prop_assert_eq!(problem.smoother.eliminate(usize::MAX), 1);
        let (_, solution, within) = problem.batch();
        problem.smoother.solve_all();
        let mean = problem.smoother.window[0].correction;
        agrees((0..N).map(|i| (mean[i], solution[i])), within, "mean")?;
    }
}
