//! Heights above where a sensor was first read: of a barometer, and of a distance to the ground.

use super::input::{Mounting, deviation, place};
use super::options::NavigationOptions;
use crate::navigation::eskf::Estimate;
use crate::navigation::measurement::{BarometricHeight, Height};
use bb_core::payload::{FluidPressure, Range};
use nalgebra::Vector3;

/// The standard atmosphere, ISO 2533: pressure at sea level, Pa, and height over pressure.
const SEA_LEVEL: f64 = 101_325.0;
const SCALE: f64 = 44_330.77;
const EXPONENT: f64 = 0.190_263;

/// A beam that points down by less than this, cosine, says little about the height.
const DOWNWARD: f64 = 0.5;

/// What the first reading of each sensor was taken to be.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Heights {
    /// What the barometer reads more than the height, m.
    pressure: Option<f64>,
    /// Height of the ground, m.
    ground: Option<f64>,
}

impl Heights {
    /// The height that a pressure shows; none if it shows none. `drop` is how far the world's z is below the height at the
    /// body, m.
    pub(super) fn of_pressure<const N: usize>(
        &mut self,
        pressure: &FluidPressure,
        at: &Estimate<N>,
        drop: f64,
        options: &NavigationOptions,
        mounting: &Mounting,
    ) -> Option<BarometricHeight> {
        let ratio = pressure.fluid_pressure / SEA_LEVEL;
        // Nor if it is not a number.
        if !(ratio > 0.0 && ratio < 2.0) {
            return None;
        }
        let power = ratio.powf(EXPONENT);
        let sensor = (at.world_from_body * place(mounting.pressure.as_ref())).z;
        let height = SCALE * (1.0 - power) - sensor - drop;
        // What a pascal is in metres.
        let slope = SCALE * EXPONENT * power / pressure.fluid_pressure;
        let told = pressure.variance.map(|variance| variance * slope * slope);
        let first = *self.pressure.get_or_insert(height - at.position.z);
        Some(BarometricHeight { height: height - first, deviation: deviation(told, options.pressure_deviation) })
    }

    /// The height that a distance to the ground shows; none if it shows none.
    pub(super) fn of_range<const N: usize>(
        &mut self,
        range: &Range,
        at: &Estimate<N>,
        drop: f64,
        options: &NavigationOptions,
        mounting: &Mounting,
    ) -> Option<Height> {
        let body_from_sensor = mounting.range?;
        let distance = f64::from(range.range);
        if !(f64::from(range.min_range)..=f64::from(range.max_range)).contains(&distance) {
            return None;
        }
        let down = -(at.world_from_body * (body_from_sensor.rotation * Vector3::x())).z;
        if down.is_nan() || down < DOWNWARD {
            return None;
        }
        let sensor = (at.world_from_body * body_from_sensor.translation.vector).z;
        let above_ground = distance * down - sensor - drop;
        let ground = *self.ground.get_or_insert(at.position.z - above_ground);
        let told = range.variance.map(f64::from);
        Some(Height { height: ground + above_ground, deviation: deviation(told, options.range_deviation) })
    }
}
