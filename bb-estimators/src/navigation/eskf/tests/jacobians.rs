//! Jacobians of every measurement: the residual of an exact measurement is zero, and the Jacobian matches numeric differentiation.

use bb_tests::laws;
use nalgebra::{SVector, UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::super::EskfFilter;
use super::{ALL, All, estimate, is_transported, orientation, vector};
use crate::navigation::measurement::{
    AbsolutePose, BarometricHeight, BodyVelocity, GnssHeading, GnssPosition, GnssVelocity, Height, Linearised,
    MagneticField, MagneticHeading, Measurement, NonHolonomic, RelativePose, WheelSpeed, ZeroRotation,
    ZeroVelocity,
};
use crate::navigation::state::{Estimate, Optional, offset};

/// `measurement` is exact at `truth`; nearby, its residual matches the Jacobian.
fn check<const D: usize>(measurement: &impl Measurement<D>, truth: &Estimate<ALL>) -> Result<(), TestCaseError> {
    let at = |estimate: &Estimate<ALL>| {
        let mut model = Linearised::<D, ALL>::new();
        measurement.linearise::<All, ALL>(estimate, &mut model).map(|()| model)
    };
    let Ok(model) = at(truth) else { return Err(TestCaseError::reject("not observable")) };
    let exact = SVector::<f64, D>::from(model.residual);
    prop_assert!(exact.amax() < 1e-9, "residual {exact} of an exact measurement");
    for state in 0..ALL {
        let step = 1e-6;
        let [above, below] = [step, -step].map(|step| {
            at(&truth.corrected::<All>(&SVector::ith(state, step)))
                .map(|model| SVector::<f64, D>::from(model.residual))
        });
        let (Ok(above), Ok(below)) = (above, below) else { continue };
        // The residual is measured minus predicted, so it falls as the estimate grows.
        let numeric = (below - above) / (2.0 * step);
        let analytic = SVector::<f64, D>::from_fn(|row, _| model.jacobian[row][state]);
        let difference = (numeric - analytic).amax();
        prop_assert!(difference < 1e-6 * (1.0 + analytic.amax()), "state {state}: {numeric} {analytic}");
    }
    Ok(())
}

fn antenna_velocity(at: &Estimate<ALL>, lever_arm: Vector3<f64>) -> Vector3<f64> {
    at.velocity + at.world_from_body * at.angular_velocity.cross(&lever_arm)
}

laws! {
    #[test]
    fn of_the_composition(
        mut at in estimate(), error in proptest::collection::vec(-1.0..1.0, ALL),
        root in proptest::collection::vec(-1.0..1.0, ALL * ALL),
    ) {
        let delay = offset::<All>(Optional::GnssDelay).unwrap();
        at.optional[delay] = 0.1;
        let mut error = SVector::<f64, ALL>::from_column_slice(&error);
        // Within the largest delay.
        error[delay] *= 0.3;
        is_transported::<EskfFilter<All, ALL>, ALL>((&at, &error), root, Estimate::error_to::<All>)?;
    }

    #[test]
    fn gnss(mut at in estimate(), acceleration in vector(5.0), lever_arm in vector(3.0)) {
        at.acceleration = acceleration;
        let arm = lever_arm + at.vector::<All>(Optional::GnssLeverArm);
        let velocity = antenna_velocity(&at, arm);
        let delay = at.scalar::<All>(Optional::GnssDelay);
        let position = at.position + at.world_from_body * arm - (velocity - acceleration * 0.5 * delay) * delay;
        check(&GnssPosition { lever_arm, ..GnssPosition::new(position, 1.0, 2.0) }, &at)?;
        let pull = at.world_from_body * at.angular_velocity.cross(&at.angular_velocity.cross(&arm));
        let velocity = velocity - (acceleration + pull) * delay;
        check(&GnssVelocity { lever_arm, ..GnssVelocity::new(velocity, 0.1, 0.2) }, &at)?;
    }

    #[test]
    fn headings(at in estimate(), baseline in vector(2.0), field in vector(50e-6)) {
        let turned = at.angular_velocity.cross(&baseline) * at.scalar::<All>(Optional::GnssDelay);
        let direction = at.world_from_body * (baseline - turned);
        prop_assume!(direction.xy().norm() > 0.2);
        let heading = direction.y.atan2(direction.x) + 4.0 * core::f64::consts::PI;
        check(&GnssHeading { heading, deviation: 0.02, baseline }, &at)?;
        prop_assume!(field.xy().norm() > 5e-6);
        // Scaled to unit size, so that numeric steps are small for all measurements.
        let field = field * 1e5;
        let measured = at.world_from_body.inverse() * field + at.vector::<All>(Optional::HardIron);
        check(&MagneticField { field: measured, reference: field, deviation: 1.0 }, &at)?;
        let declination = field.x.atan2(field.y);
        check(&MagneticHeading { field: measured, declination, deviation: 0.05 }, &at)?;
    }

    #[test]
    fn poses(at in estimate()) {
        check(&AbsolutePose::new((at.position, 1.0), (at.world_from_body, 0.1)), &at)?;
        let keyframe = at.keyframe.unwrap();
        let from_world = keyframe.world_from_body.inverse();
        let scale = 1.0 + at.scalar::<All>(Optional::RelativeScale);
        let translation = from_world * (at.position - keyframe.position) * scale;
        check(&RelativePose::new(7, (translation, 0.1), (from_world * at.world_from_body, 0.01)), &at)?;
    }

    #[test]
    fn heights(at in estimate()) {
        check(&Height { height: at.position.z, deviation: 1.0 }, &at)?;
        let height = at.position.z + at.scalar::<All>(Optional::BarometerBias);
        check(&BarometricHeight { height, deviation: 1.0 }, &at)?;
    }

    #[test]
    fn velocities(at in estimate(), lever_arm in vector(3.0), mounting in orientation()) {
        let in_body = at.world_from_body.inverse() * at.velocity + at.angular_velocity.cross(&lever_arm);
        let body_from_sensor = mounting;
        let first = offset::<All>(Optional::WheelMounting).unwrap();
        let yaw = UnitQuaternion::from_euler_angles(0.0, 0.0, at.optional[first]);
        let pitch = UnitQuaternion::from_euler_angles(0.0, at.optional[first + 1], 0.0);
        let mut velocity = pitch * (yaw * (mounting.inverse() * in_body));
        velocity.x *= 1.0 + at.scalar::<All>(Optional::WheelScale);
        check(&BodyVelocity { velocity, deviations: Vector3::new(0.1, 0.2, 0.3), body_from_sensor, lever_arm }, &at)?;
        let forward = mounting * Vector3::x();
        let speed = forward.dot(&in_body) * (1.0 + at.scalar::<All>(Optional::WheelScale));
        check(&WheelSpeed { speed, deviation: 0.1, forward, lever_arm }, &at)?;
        let mut rolling = at;
        let along = mounting * Vector3::x() * forward.dot(&in_body);
        rolling.velocity = at.world_from_body * (along - at.angular_velocity.cross(&lever_arm));
        let wheels = NonHolonomic { lateral: 0.1, vertical: 0.1, body_from_vehicle: mounting, lever_arm };
        check(&wheels, &rolling)?;
    }

    #[test]
    fn rest(at in estimate()) {
        let still = Estimate { velocity: Vector3::zeros(), angular_velocity: Vector3::zeros(), ..at };
        check(&ZeroVelocity { deviation: 0.01 }, &still)?;
        check(&ZeroRotation { deviation: 0.001 }, &still)?;
    }
}
