//! Analytic derivatives compared with finite differences.

use bb_tests::laws;
use nalgebra::{Matrix2, Matrix3, SVector};
use proptest::prelude::*;
use proptest::test_runner::TestCaseError;

use super::super::estimate::STATES;
use super::super::params::PlanarParams;
use super::super::propagation::Transition;
use super::super::{
    PlanarEstimate, PlanarHeading, PlanarMeasurement, PlanarPose, PlanarPosition, WheelVelocity, YawRate,
};
use super::{estimate, vector};
use crate::navigation::Linearised;
use crate::navigation::covariance::Covariance;
use crate::navigation::eskf::tests::{covariance, derivative, is_transported, matrix};

const STEP: f64 = 1e-5;

/// The residual is measured minus predicted, so its derivative is the negative Jacobian.
fn check<const D: usize>(
    measurement: &impl PlanarMeasurement<D>,
    at: &PlanarEstimate,
) -> Result<(), TestCaseError> {
    let linearised = |at: &PlanarEstimate| {
        let mut model = Linearised::<D, STATES>::new();
        measurement.linearise(at, &mut model).unwrap();
        model
    };
    let model = linearised(at);
    let numeric = derivative(STEP, |error| SVector::<f64, D>::from(linearised(&at.corrected(error)).residual));
    let analytic = -matrix(&model.jacobian);
    let difference = (numeric - analytic).amax();
    prop_assert!(difference < 1e-6 * (1.0 + analytic.amax()), "{} is not {}", analytic, numeric);
    Ok(())
}

laws! {
    #[test]
    fn of_the_transition(at in estimate(), dt in 1e-4..0.5) {
        let mut moved = at;
        let transition = Transition::advance(&mut moved, dt);
        let numeric = derivative(STEP, |error| {
            let mut other = at.corrected(error);
            Transition::advance(&mut other, dt);
            moved.error_to(&other)
        });
        prop_assert!((numeric - transition.matrix()).amax() < 1e-6, "{} is not {}", transition.matrix(), numeric);
    }

    #[test]
    fn of_the_composition(
        at in estimate(), error in proptest::collection::vec(-2.0..2.0, STATES),
        root in proptest::collection::vec(-1.0..1.0, STATES * STATES),
    ) {
        let error = SVector::<f64, STATES>::from_column_slice(&error);
        is_transported::<PlanarEstimate, STATES>((&at, &error), root, PlanarEstimate::error_to)?;
    }

    #[test]
    fn of_every_measurement(at in estimate(), lever_arm in vector(3.0), off in vector(2.0), angle in -0.5..0.5) {
        let covariance = Matrix2::identity();
        check(&PlanarPosition { position: at.position + off, covariance, lever_arm }, &at)?;
        check(&WheelVelocity { velocity: at.velocity + off, covariance, lever_arm }, &at)?;
        check(&YawRate { rate: angle, deviation: 0.1 }, &at)?;
        check(&PlanarHeading { heading: at.heading + angle, deviation: 0.1 }, &at)?;
        let position = at.position + off;
        check(&PlanarPose { position, heading: at.heading + angle, covariance: Matrix3::identity() }, &at)?;
    }

    #[test]
    fn moves_the_covariance_as_the_whole_matrix_does(
        at in estimate(), dt in 1e-3..0.1, root in proptest::collection::vec(-1.0..1.0, STATES * STATES),
    ) {
        let (dense, mut covariance) = covariance::<STATES>(root);
        let none = PlanarParams { gyroscope_noise: 0.0, forward_acceleration: 0.0, ..PlanarParams::default() };
        let none = PlanarParams { gyroscope_bias_walk: 0.0, lateral_acceleration: 0.0, ..none };
        let mut moved = at;
        let transition = Transition::advance(&mut moved, dt);
        transition.apply(covariance.rows_mut(), &none.densities());
        let expected = transition.matrix() * dense * transition.matrix().transpose();
        let moved = covariance.matrix();
        prop_assert!((moved - expected).amax() < 1e-12 * (1.0 + expected.amax()), "{} is not {}", moved, expected);
        prop_assert_eq!(moved, &moved.transpose());
    }

    #[test]
    fn an_arc_is_exact(at in estimate(), dt in 1e-3..0.5) {
        let mut at_once = at;
        Transition::advance(&mut at_once, dt);
        let mut in_steps = at;
        for _ in 0..64 {
            Transition::advance(&mut in_steps, dt / 64.0);
        }
        prop_assert!(at_once.error_to(&in_steps).amax() < 1e-10);
    }

    /// Two halves of a sample add as much noise as the whole sample, to the order of the approximation.
    #[test]
    fn noise_does_not_depend_on_the_rate(at in estimate(), dt in 1e-3..0.02) {
        let densities = PlanarParams::default().densities();
        let grown = |steps: u32| {
            let (mut at, mut covariance) = (at, Covariance::<STATES>::new());
            for state in 0..STATES {
                covariance.forget(state, 1e-12);
            }
            for _ in 0..steps {
                Transition::advance(&mut at, dt / f64::from(steps)).apply(covariance.rows_mut(), &densities);
            }
            *covariance.matrix()
        };
        let (once, twice) = (grown(1), grown(2));
        for i in 0..STATES {
            for j in 0..STATES {
                let scale = (once[(i, i)] * once[(j, j)]).sqrt();
                // The body rotates by up to 0.06 rad over the sample, and the forward noise is three times the sideways noise.
                prop_assert!((once[(i, j)] - twice[(i, j)]).abs() < 0.05 * scale, "{i} {j} {once} {twice}");
            }
        }
    }

    #[test]
    fn errors_between_estimates_are_what_corrects_one_to_the_other(from in estimate(), to in estimate()) {
        let error = from.error_to(&to);
        prop_assert!(from.corrected(&error).error_to(&to).amax() < 1e-9);
    }
}
