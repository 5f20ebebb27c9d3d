//! Units that the values of a topic suggest.

use super::remark::{Remark, Subject};
use bb_core::payload::{FluidPressure, Imu, MagneticField};
use bb_eval::units::Units;
use bb_mcap::{BagMessage, IMU, MAGNETIC_FIELD, RecordingError};

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

/// Remarks on units that look wrong; not on a field whose offset is known.
pub(super) fn remarks(units: &Units, has_offset: bool) -> Vec<Remark> {
    let mut remarks = Vec::new();
    if units.not_finite() > 0 {
        let text = format!("{} messages hold NaN or infinity", units.not_finite());
        remarks.push(Remark::new(Subject::Values, text));
    }
    let units =
        units.of_imu().into_iter().chain(units.of_field().filter(|_| !has_offset)).chain(units.of_pressure());
    remarks.extend(units.map(|text| Remark::new(Subject::Unit, text)));
    remarks
}
