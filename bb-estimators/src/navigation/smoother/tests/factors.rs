//! Every factor: its derivatives by both keyframes match numeric differentiation, whether it fits or not.

#![allow(clippy::needless_range_loop, reason = "the indices are those of the equations")]

use bb_tests::laws;
use nalgebra::{SMatrix, SVector, UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::super::link::{Link, predicted};
use super::flight::{Drone, N, derivative, matrix, sensors, vector};
use crate::navigation::factor::Factor;
use crate::navigation::factor::Rows;
use crate::navigation::{
    Estimate, NAVIGATION, NavigationFactor, POSITION, Preintegration, ROTATION, RelativePose, VELOCITY,
};

type Error = SVector<f64, N>;

fn estimate() -> impl Strategy<Value = Estimate<N>> {
    let motion = (vector(100.0), vector(20.0), vector(3.0), vector(0.3), vector(0.05));
    (motion, -0.05..0.05, vector(0.3)).prop_map(|((position, velocity, turn, force, rate), scale, arm)| {
        let mut error = Error::zeros();
        error.fixed_rows_mut::<3>(NAVIGATION + 1).copy_from(&arm);
        error[NAVIGATION] = scale;
        Estimate {
            position,
            velocity,
            world_from_body: UnitQuaternion::from_scaled_axis(turn),
            accelerometer_bias: force,
            gyroscope_bias: rate,
            ..Estimate::unknown()
        }
        .corrected::<Drone>(&error)
    })
}

/// An error of this many standard units in all states.
fn error() -> impl Strategy<Value = Error> {
    proptest::array::uniform19(-1.0..1.0).prop_map(|x| Error::from_fn(|i, _| x[i]))
}

fn motion(samples: usize, turn: Vector3<f64>, force: Vector3<f64>) -> Preintegration {
    let mut motion = Preintegration::new(Vector3::new(0.1, 0.0, -0.1), Vector3::new(0.01, -0.01, 0.0));
    for i in 0..samples {
        let t = i as f64 * 0.1;
        motion.add(&(turn * t.cos()), &(force + Vector3::z() * t.sin()), 0.005, &sensors().densities());
    }
    motion
}

fn relative(previous: &Estimate<N>, at: &Estimate<N>, off: &Vector3<f64>) -> RelativePose {
    let back = previous.world_from_body.inverse();
    let translation = back * (at.position - previous.position) + off;
    let turn = back * at.world_from_body * UnitQuaternion::from_scaled_axis(off * 0.3);
    RelativePose::new(0, (translation, 0.05), (turn, 2e-3))
}

/// The error of every state if the world is turned about the vertical.
fn turned(at: &Estimate<N>) -> Error {
    let mut error = Error::zeros();
    let mut set = |first: usize, part: Vector3<f64>| error.fixed_rows_mut::<3>(first).copy_from(&part);
    set(POSITION, Vector3::z().cross(&at.position));
    set(VELOCITY, Vector3::z().cross(&at.velocity));
    set(ROTATION, Vector3::z());
    error
}

laws! {
    /// The gradient of the cost matches numeric differentiation even if the measurement does not fit.
    #[test]
    fn gradients_of_relative_poses(previous in estimate(), at in estimate(), off in vector(1.0)) {
        let factor = NavigationFactor::from(relative(&previous, &at, &off));
        let rows = |previous: &Estimate<N>, at: &Estimate<N>| {
            let mut rows = Rows::<N>::new();
            Factor::<Drone, N>::linearise(&factor, Some(previous), at, &mut rows).unwrap();
            rows
        };
        let here = rows(&previous, &at);
        let cost = |rows: &Rows<N>| 0.5 * rows.residual[..rows.count].iter().map(|r| r * r).sum::<f64>();
        for of_previous in [true, false] {
            let jacobian = matrix(if of_previous { &here.previous } else { &here.at });
            let analytic = jacobian.transpose() * matrix(&[here.residual]).transpose();
            let numeric = derivative::<1, N>(1e-5, |error| {
                let moved = |estimate: &Estimate<N>| estimate.corrected::<Drone>(error);
                let rows = if of_previous { rows(&moved(&previous), &at) } else { rows(&previous, &moved(&at)) };
                [-cost(&rows)].into()
            });
            let apart = (numeric.transpose() - analytic).amax();
            let scale = 1.0 + analytic.amax() + cost(&here);
            prop_assert!(apart < 1e-5 * scale, "of the previous: {of_previous}: {numeric}, not {analytic}");
        }
    }

    /// No factor between two keyframes observes the heading of the world, wherever they are linearised.
    #[test]
    fn the_world_may_turn(from in estimate(), off in error(), samples in 1_usize..40, turn in vector(2.0)) {
        let motion = motion(samples, turn, Vector3::new(3.0, -1.0, 9.0));
        let to = predicted::<Drone, N>(&from, &motion, &sensors()).corrected::<Drone>(&(off * 0.3));
        let link = Link::<N>::of_motion::<Drone>(&from, &to, &motion, &sensors());
        let back = matrix(&link.back);
        let apart = (back * turned(&to) - turned(&from)).amax();
        prop_assert!(apart < 1e-9, "{apart}");
        let factor = NavigationFactor::from(relative(&from, &to, &Vector3::new(0.3, -0.2, 0.1)));
        let mut rows = Rows::<N>::new();
        Factor::<Drone, N>::linearise(&factor, Some(&from), &to, &mut rows).unwrap();
        for row in 0..rows.count {
            let (before, here) = (turned(&from), turned(&to));
            let seen: f64 = (0..N).map(|i| rows.previous[row][i] * before[i] + rows.at[row][i] * here[i]).sum();
            // Rows are divided by deviations as small as 2e-3, for positions of up to 170 m.
            prop_assert!(seen.abs() < 1e-8, "row {row}: {seen}");
        }
    }

    /// The backward link is the inverse of the forward transition.
    #[test]
    fn the_link_is_the_motion_backwards(
        from in estimate(),
        samples in 1_usize..40,
        turn in vector(2.0),
        force in vector(15.0),
    ) {
        let motion = motion(samples, turn, force);
        let params = sensors();
        let there = |from: &Estimate<N>| predicted::<Drone, N>(from, &motion, &params);
        let to = there(&from);
        let link = Link::<N>::of_motion::<Drone>(&from, &to, &motion, &params);
        let back = matrix(&link.back);
        let forward = derivative(1e-5, |error| to.error_to::<Drone>(&there(&from.corrected::<Drone>(error))));
        let product = back * forward;
        let apart = (product - SMatrix::identity()).amax();
        // The derivative by the gyroscope's bias is of second order in the turn of a sample.
        prop_assert!(apart < 1e-5, "{apart}: {product:.6}");
        prop_assert!(link.offset.iter().all(|x| x.abs() < 1e-9));
        // Forward, the noise is that of preintegration, in the axes of the first body.
        let noise = matrix(&link.noise);
        let forward = forward * noise * forward.transpose();
        let mut to_world = SMatrix::<f64, NAVIGATION, NAVIGATION>::identity();
        for first in [POSITION, VELOCITY, ROTATION] {
            to_world.fixed_view_mut::<3, 3>(first, first).copy_from(&from.rotation());
        }
        let known = to_world * matrix(&motion.covariance()) * to_world.transpose();
        for i in 0..NAVIGATION {
            for j in 0..NAVIGATION {
                let scale = (known[(i, i)] * known[(j, j)]).sqrt();
                let apart = (forward[(i, j)] - known[(i, j)]).abs();
                prop_assert!(apart < 1e-3 * scale, "{i} {j}: {} of {}", forward[(i, j)], known[(i, j)]);
            }
        }
    }
}

/// Whitened rows carry the information of the noise: `Hᵀ R⁻¹ H` and `Hᵀ R⁻¹ r`.
#[test]
fn rows_are_divided_by_their_noise() {
    let noise = SMatrix::<f64, 2, 2>::new(4.0, 1.0, 1.0, 0.5);
    let (at, previous) = ([[1.0, -2.0, 0.5], [0.0, 3.0, 1.0]], [[2.0, 0.0, 1.0], [1.0, 1.0, 1.0]]);
    let mut rows = Rows::<3>::new();
    rows.set([0.3, -0.7], Some(&previous), &at, &noise).unwrap();
    let inverse = noise.try_inverse().unwrap();
    let residual = SVector::<f64, 2>::new(0.3, -0.7);
    for (jacobian, whitened) in [(&at, &rows.at), (&previous, &rows.previous)] {
        let (whole, whitened) = (matrix(jacobian), matrix(whitened).fixed_rows::<2>(0).into_owned());
        let weighted = whole.transpose() * inverse;
        assert!((whitened.transpose() * whitened - weighted * whole).amax() < 1e-13);
        let vector = SVector::<f64, 2>::new(rows.residual[0], rows.residual[1]);
        assert!((whitened.transpose() * vector - weighted * residual).amax() < 1e-13);
    }
    assert!((rows.log_density + 0.5 * noise.determinant().ln()).abs() < 1e-13);
}
