//! `HIGHRES_IMU` and `SCALED_IMU2`.

use super::stream::{Stream, choose};
use crate::axes::swap_body;
use crate::link::Peer;
use crate::stamps::{Stamps, Unit};
use bb_core::nalgebra::Vector3;
use bb_core::payload::Imu;
use bb_core::{Fault, MonotonicTime, Options, Reading, Sensor, SensorContext};
use mavlink::MessageData;
use mavlink::dialects::ardupilotmega::{HIGHRES_IMU_DATA, HighresImuUpdatedFlags, MavMessage, SCALED_IMU2_DATA};
use std::time::Duration;

/// Options of [`MavlinkImu`].
#[derive(Clone, Debug, Options)]
pub struct MavlinkImuOptions {
    /// Address of the flight controller: see [`Address`](crate::Address).
    #[option(required)]
    pub link: String,
    /// `highres_imu` or `scaled_imu2`.
    #[option(default = "highres_imu")]
    pub message: String,
    /// Number of the IMU, of a flight controller that sends `HIGHRES_IMU` of several.
    #[option(default = 0)]
    pub id: u8,
    /// System that sends; 0 for any.
    #[option(default = 1)]
    pub system_id: u8,
    /// Component that sends; 0 for any.
    #[option(default = 1)]
    pub component_id: u8,
    /// Time for which it may send nothing that can be used.
    #[option(default = Duration::from_secs(1))]
    pub timeout: Duration,
}

/// The flight controller's IMU, in its body axes: forward, left, up.
///
/// A sample is used if it has both acceleration and angular velocity: for `HIGHRES_IMU`, if `fields_updated` says
/// that all six were updated. Other messages are not readings.
#[derive(Debug)]
pub struct MavlinkImu {
    stream: Stream,
    stamps: Stamps,
    id: u8,
}

#[derive(Clone, Copy, Debug)]
enum Kind {
    HighRes,
    Scaled2,
}

impl Sensor for MavlinkImu {
    type Options = MavlinkImuOptions;
    type Output = Imu;

    fn init(options: MavlinkImuOptions, context: &SensorContext) -> Result<Self, Fault> {
        let kinds = [("highres_imu", Kind::HighRes), ("scaled_imu2", Kind::Scaled2)];
        let (message, unit) = match choose("message", &options.message, &kinds)? {
            Kind::HighRes => ((HIGHRES_IMU_DATA::NAME, HIGHRES_IMU_DATA::ID), Unit::Micros),
            Kind::Scaled2 => ((SCALED_IMU2_DATA::NAME, SCALED_IMU2_DATA::ID), Unit::Millis),
        };
        let peer = Peer { system_id: options.system_id, component_id: options.component_id };
        let stream = Stream::open(&options.link, peer, &[message], options.timeout, context)?;
        Ok(Self { stream, stamps: Stamps::new(unit, options.timeout), id: options.id })
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Imu>, Fault> {
        let Some(received) = self.stream.next()? else { return Ok(Reading::nothing()) };
        let (ticks, sample) = match &received.message {
            MavMessage::HIGHRES_IMU(data) if data.id != self.id => (0, Err("they are of another IMU")),
            MavMessage::HIGHRES_IMU(data) => (data.time_usec, high_res(data)),
            MavMessage::SCALED_IMU2(data) => (data.time_boot_ms.into(), Ok(scaled(data))),
            _ => return Ok(Reading::nothing()),
        };
        let time = match sample {
            Ok(_) => self.stamps.time_of(ticks, received.arrival).map_err(|fault| self.stream.fault(fault))?,
            Err(_) => None,
        };
        match (sample, time) {
            (Ok(sample), Some(time)) => {
                self.stream.has_value();
                Ok(Reading::at(time, sample))
            }
            (Ok(_), None) => {
                self.stream.has_none("stamps are repeated or out of order").map(|()| Reading::nothing())
            }
            (Err(why), _) => self.stream.has_none(why).map(|()| Reading::nothing()),
        }
    }
}

fn high_res(data: &HIGHRES_IMU_DATA) -> Result<Imu, &'static str> {
    use HighresImuUpdatedFlags as Flags;
    let needed = Flags::HIGHRES_IMU_UPDATED_XACC
        | Flags::HIGHRES_IMU_UPDATED_YACC
        | Flags::HIGHRES_IMU_UPDATED_ZACC
        | Flags::HIGHRES_IMU_UPDATED_XGYRO
        | Flags::HIGHRES_IMU_UPDATED_YGYRO
        | Flags::HIGHRES_IMU_UPDATED_ZGYRO;
    if !data.fields_updated.contains(needed) {
        return Err("`fields_updated` lacks acceleration or angular velocity");
    }
    let force = Vector3::new(data.xacc, data.yacc, data.zacc).cast();
    let rate = Vector3::new(data.xgyro, data.ygyro, data.zgyro).cast();
    if !force.iter().chain(rate.iter()).all(|value: &f64| value.is_finite()) {
        return Err("a value is not a number");
    }
    Ok(Imu::new(swap_body(&rate), swap_body(&force)))
}

/// Converts mrad/s and thousandths of standard gravity to SI.
fn scaled(data: &SCALED_IMU2_DATA) -> Imu {
    const G: f64 = 9.80665;
    let force = Vector3::new(data.xacc, data.yacc, data.zacc).cast::<f64>() * (1e-3 * G);
    let rate = Vector3::new(data.xgyro, data.ygyro, data.zgyro).cast::<f64>() * 1e-3;
    Imu::new(swap_body(&rate), swap_body(&force))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at_rest() -> HIGHRES_IMU_DATA {
        HIGHRES_IMU_DATA {
            xacc: 1.0,
            yacc: 2.0,
            zacc: -9.75,
            xgyro: 0.125,
            ygyro: 0.25,
            zgyro: 0.5,
            fields_updated: HighresImuUpdatedFlags::from_bits_truncate(0x3f),
            ..Default::default()
        }
    }

    #[test]
    fn axes_are_forward_left_and_up() {
        let imu = high_res(&at_rest()).expect("it has all values");
        assert_eq!(imu.linear_acceleration, Vector3::new(1.0, -2.0, 9.75));
        assert_eq!(imu.angular_velocity, Vector3::new(0.125, -0.25, -0.5));
    }

    #[test]
    fn a_sample_that_lacks_a_value_is_none() {
        for bit in 0..6 {
            let fields_updated = HighresImuUpdatedFlags::from_bits_truncate(0x1fff & !(1 << bit));
            let lacks = HIGHRES_IMU_DATA { fields_updated, ..at_rest() };
            assert_eq!(high_res(&lacks), Err("`fields_updated` lacks acceleration or angular velocity"));
        }
        for value in [f32::NAN, f32::INFINITY] {
            assert_eq!(high_res(&HIGHRES_IMU_DATA { zgyro: value, ..at_rest() }), Err("a value is not a number"));
        }
    }

    #[test]
    fn scaled_values_are_converted_up_to_their_limits() {
        let data = SCALED_IMU2_DATA {
            xacc: i16::MAX,
            yacc: i16::MIN,
            zacc: -1000,
            xgyro: i16::MIN,
            ygyro: i16::MAX,
            zgyro: 0,
            ..Default::default()
        };
        let imu = scaled(&data);
        let near = |a: Vector3<f64>, b: [f64; 3]| assert!((a - Vector3::from(b)).norm() < 1e-9, "{a} {b:?}");
        near(imu.linear_acceleration, [32.767 * 9.80665, 32.768 * 9.80665, 9.80665]);
        near(imu.angular_velocity, [-32.768, -32.767, 0.0]);
    }
}
