//! `sensor_msgs`

mod battery;
mod joint;

use super::{covariance, number, ros_message};
use crate::message::Payload;
use crate::message::codec::{Field, RosCompanion};
use crate::message::{DecodeError, RosMessage, Stamped};
use crate::payload::{
    FluidPressure, GeodeticPosition, GnssFix, GnssServices, GnssStatus, Image, Imu, LaserScan, MagneticField, Marg,
    Radiation, Range,
};
use crate::time::WallTime;
use nalgebra::{Matrix3, UnitQuaternion, Vector3, Vector4};
use std::sync::Arc;

/// The covariance of a value that is not measured: −1 first, as `sensor_msgs/Imu` documents.
const NO_ORIENTATION: [f64; 9] = [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];

/// An orientation is absent if the first element of its covariance is −1, as `sensor_msgs/Imu` documents. A
/// quaternion of zeros is not a rotation, and is absent as well: drivers that do not set the field send it. Any other
/// quaternion is read unchanged.
fn orientation_from_ros(
    orientation: UnitQuaternion<f64>,
    covariance: &[f64; 9],
) -> (Option<UnitQuaternion<f64>>, Option<Matrix3<f64>>) {
    match covariance[0] == NO_ORIENTATION[0] || orientation.coords == Vector4::zeros() {
        true => (None, None),
        false => (Some(orientation), covariance::from_ros(covariance)),
    }
}

/// The covariance of a rate or an acceleration. If marked as absent, it is unknown. The value beside it is kept,
/// since drivers also use the mark for an unknown covariance.
fn measured(covariance: &[f64; 9]) -> Option<Matrix3<f64>> {
    covariance::from_ros(covariance).filter(|_| covariance[0] != NO_ORIENTATION[0])
}

ros_message! {
    Imu => ImuMessage "sensor_msgs/Imu";
    write(imu) {
        orientation: UnitQuaternion<f64> = imu.orientation.unwrap_or_else(UnitQuaternion::identity),
        orientation_covariance: [f64; 9] = match imu.orientation {
            Some(_) => covariance::to_ros(&imu.orientation_covariance),
            None => NO_ORIENTATION,
        },
        angular_velocity: Vector3<f64> = imu.angular_velocity,
        angular_velocity_covariance: [f64; 9] = covariance::to_ros(&imu.angular_velocity_covariance),
        linear_acceleration: Vector3<f64> = imu.linear_acceleration,
        linear_acceleration_covariance: [f64; 9] = covariance::to_ros(&imu.linear_acceleration_covariance),
    }
    read {
        let (orientation, orientation_covariance) = orientation_from_ros(orientation, &orientation_covariance);
        Self {
            angular_velocity,
            linear_acceleration,
            orientation,
            orientation_covariance,
            angular_velocity_covariance: measured(&angular_velocity_covariance),
            linear_acceleration_covariance: measured(&linear_acceleration_covariance),
        }
    }
}

ros_message! {
    MagneticField => MagneticFieldMessage "sensor_msgs/MagneticField";
    write(field) {
        magnetic_field: Vector3<f64> = field.magnetic_field,
        magnetic_field_covariance: [f64; 9] = covariance::to_ros(&field.covariance),
    }
    read { Self { magnetic_field, covariance: covariance::from_ros(&magnetic_field_covariance) } }
}

/// An IMU and a magnetometer are two topics in ROS.
impl RosMessage for Marg {
    type Message = ImuMessage;

    const COMPANION: Option<RosCompanion<Self>> = Some(RosCompanion {
        topic: "magnetic_field",
        shape: MagneticFieldMessage::SHAPE,
        write: |marg, writer| {
            let Some(field) = marg.magnetic_field else { return false };
            MagneticField::to_ros(&marg.stamp().message(field)).write(writer);
            true
        },
        read: |marg, reader| {
            let (field, _) = MagneticField::from_ros(MagneticFieldMessage::read(reader)?)?;
            marg.magnetic_field = Some(field);
            Ok(())
        },
    });

    fn to_ros(marg: &Stamped<Self>) -> ImuMessage {
        Imu::to_ros(&marg.stamp().message(marg.imu))
    }

    fn from_ros(message: ImuMessage) -> Result<(Self, WallTime), DecodeError> {
        let (imu, time) = Imu::from_ros(message)?;
        Ok((Self { imu, magnetic_field: None }, time))
    }
}

ros_message! {
    FluidPressure => FluidPressureMessage "sensor_msgs/FluidPressure";
    write(pressure) {
        fluid_pressure: f64 = pressure.fluid_pressure,
        variance: f64 = pressure.variance.unwrap_or_default(),
    }
    read { Self { fluid_pressure, variance: number::unless_zero(variance) } }
}

const RADIATIONS: [Radiation; 2] = [Radiation::Ultrasound, Radiation::Infrared];

ros_message! {
    Range => RangeMessage "sensor_msgs/Range";
    write(range) {
        radiation_type: u8 = number::code(&RADIATIONS, range.radiation),
        field_of_view: f32 = range.field_of_view,
        min_range: f32 = range.min_range,
        max_range: f32 = range.max_range,
        range: f32 = range.range,
        variance: f32 = range.variance.unwrap_or_default(),
    }
    read {
        let Some(radiation) = RADIATIONS.get(usize::from(radiation_type)).copied() else {
            return Err(DecodeError::new(0, "0 or 1", radiation_type.to_string()).within("radiation_type"));
        };
        let variance = number::unless_zero(variance);
        Self { radiation, field_of_view, min_range, max_range, range, variance }
    }
}

ros_message! {
    LaserScan => LaserScanMessage "sensor_msgs/LaserScan";
    write(scan) {
        angle_min: f32 = scan.angle_min,
        angle_max: f32 = scan.angle_max,
        angle_increment: f32 = scan.angle_increment,
        time_increment: f32 = scan.time_increment,
        scan_time: f32 = scan.scan_time,
        range_min: f32 = scan.range_min,
        range_max: f32 = scan.range_max,
        ranges: Arc<[f32]> = Arc::clone(&scan.ranges),
        intensities: Arc<[f32]> = Arc::clone(&scan.intensities),
    }
    read {
        Self {
            angle_min,
            angle_max,
            angle_increment,
            time_increment,
            scan_time,
            range_min,
            range_max,
            ranges,
            intensities,
        }
    }
}

ros_message! {
    Image => ImageMessage "sensor_msgs/Image";
    write(image) {
        height: u32 = image.height,
        width: u32 = image.width,
        encoding: &'static str = image.encoding,
        is_bigendian: u8 = u8::from(image.is_bigendian),
        step: u32 = image.step,
        data: Arc<[u8]> = Arc::clone(&image.data),
    }
    read { Self { height, width, encoding, is_bigendian: is_bigendian != 0, step, data } }
}

/// `sensor_msgs/NavSatStatus`
#[derive(Clone, Debug, Payload)]
#[payload(name = "sensor_msgs/NavSatStatus")]
struct NavSatStatus {
    status: i8,
    service: u16,
}

impl NavSatStatus {
    /// Statuses by number, from −2.
    const STATUSES: [GnssStatus; 5] = [
        GnssStatus::Unknown,
        GnssStatus::NoFix,
        GnssStatus::Fix,
        GnssStatus::SatelliteAugmented,
        GnssStatus::GroundAugmented,
    ];

    fn of(status: GnssStatus, services: GnssServices) -> Self {
        let GnssServices { gps, glonass, beidou, galileo } = services;
        let service = u16::from(gps) | u16::from(glonass) << 1 | u16::from(beidou) << 2 | u16::from(galileo) << 3;
        // There are five.
        Self { status: number::code(&Self::STATUSES, status) as i8 - 2, service }
    }

    fn status(&self) -> GnssStatus {
        u8::try_from(i16::from(self.status) + 2)
            .map_or(GnssStatus::Unknown, |code| number::of_code(&Self::STATUSES, code))
    }

    fn services(&self) -> GnssServices {
        let has = |bit: u16| self.service & bit != 0;
        GnssServices { gps: has(1), glonass: has(2), beidou: has(4), galileo: has(8) }
    }
}

/// `COVARIANCE_TYPE_UNKNOWN` and `COVARIANCE_TYPE_KNOWN`; the approximate ones between them are read as known.
const COVARIANCE_UNKNOWN: u8 = 0;
const COVARIANCE_KNOWN: u8 = 3;

ros_message! {
    GnssFix => NavSatFix "sensor_msgs/NavSatFix";
    write(fix) {
        status: NavSatStatus = NavSatStatus::of(fix.status, fix.services),
        latitude: f64 = fix.position.map_or(f64::NAN, |position| position.latitude_rad.to_degrees()),
        longitude: f64 = fix.position.map_or(f64::NAN, |position| position.longitude_rad.to_degrees()),
        altitude: f64 = fix.position.and_then(|position| position.altitude).unwrap_or(f64::NAN),
        position_covariance: [f64; 9] = covariance::to_ros(&fix.position_covariance),
        position_covariance_type: u8 = match fix.position_covariance {
            None => COVARIANCE_UNKNOWN,
            Some(_) => COVARIANCE_KNOWN,
        },
    }
    read {
        let is_known = position_covariance_type != COVARIANCE_UNKNOWN;
        let position = (!latitude.is_nan() && !longitude.is_nan()).then(|| GeodeticPosition {
            latitude_rad: latitude.to_radians(),
            longitude_rad: longitude.to_radians(),
            altitude: number::unless_nan(altitude),
        });
        Self {
            status: status.status(),
            services: status.services(),
            position,
            position_covariance: is_known.then(|| covariance::matrix(&position_covariance)),
        }
    }
}
