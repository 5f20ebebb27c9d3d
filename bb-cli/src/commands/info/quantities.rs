//! Units that the values of a topic suggest.

use super::remark::{Remark, Subject};
use bb_core::payload::{FluidPressure, Imu, MagneticField};
use bb_eval::units::Units;
use bb_mcap::{BagMessage, IMU, MAGNETIC_FIELD, ODOMETRY, RecordingError, Value};

const PRESSURE: &str = "sensor_msgs/msg/FluidPressure";

/// Adds a message, if its type has units that can be judged.
pub(super) fn take(units: &mut Units, message: &BagMessage) -> Result<(), RecordingError> {
    if units.is_full() {
        return Ok(());
    }
    match &*message.schema {
        IMU => {
            let (imu, time) = message.payload::<Imu>()?;
            units.take_imu(time.as_unix_nanos(), imu.angular_velocity, imu.linear_acceleration);
        }
        MAGNETIC_FIELD => units.take_field(&message.payload::<MagneticField>()?.0.magnetic_field),
        PRESSURE => units.take_pressure(message.payload::<FluidPressure>()?.0.fluid_pressure),
        _ => {}
    }
    Ok(())
}

/// Returns whether the numbers of a type must be finite. In others, as of a truth without positions, NaN or infinity says that there
/// is no measurement.
pub(super) fn must_be_finite(schema: &str) -> bool {
    [IMU, MAGNETIC_FIELD, ODOMETRY, PRESSURE].contains(&schema) || schema.starts_with("geometry_msgs/msg/Twist")
}

/// Returns whether all numbers of a message are finite, but for covariances, which may be unknown.
pub(super) fn is_finite(value: &Value) -> bool {
    match value {
        Value::F32(value) => value.is_finite(),
        Value::F64(value) => value.is_finite(),
        Value::List(values) => values.iter().all(is_finite),
        Value::Message(fields) => fields.iter().all(|(name, of)| name.ends_with("covariance") || is_finite(of)),
        _ => true,
    }
}

/// Remarks on units that look wrong; not on a field whose offset is known.
pub(super) fn remarks(units: &Units, has_offset: bool) -> Vec<Remark> {
    let units =
        units.of_imu().into_iter().chain(units.of_field().filter(|_| !has_offset)).chain(units.of_pressure());
    units.map(|text| Remark::new(Subject::Unit, text)).collect()
}
