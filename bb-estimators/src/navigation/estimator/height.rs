//! Heights relative to the first barometer reading.

use super::input::{Mounting, deviation, place};
use super::options::NavigationOptions;
use crate::navigation::measurement::BarometricHeight;
use crate::navigation::state::Estimate;
use bb_core::payload::FluidPressure;

/// The standard atmosphere, ISO 2533: pressure at sea level, Pa, and height as a function of pressure.
const SEA_LEVEL: f64 = 101_325.0;
const SCALE: f64 = 44_330.77;
const EXPONENT: f64 = 0.190_263;

/// The height assigned to the first reading. The remainder is a state.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Heights {
    /// Excess of the barometer's reading over the height, m.
    pressure: Option<f64>,
}

impl Heights {
    /// The height for a pressure. `None` if it is invalid. `drop` is how far the world's z is below the height at the body, m.
    pub(super) fn of_pressure<const N: usize>(
        &mut self,
        pressure: &FluidPressure,
        at: &Estimate<N>,
        drop: f64,
        options: &NavigationOptions,
        mounting: &Mounting,
    ) -> Option<BarometricHeight> {
        let ratio = pressure.fluid_pressure / SEA_LEVEL;
        // NaN fails this test as well.
        if !(ratio > 0.0 && ratio < 2.0) {
            return None;
        }
        let power = ratio.powf(EXPONENT);
        let sensor = (at.world_from_body * place(mounting.pressure.as_ref())).z;
        let height = SCALE * (1.0 - power) - sensor - drop;
        // Metres per pascal.
        let slope = SCALE * EXPONENT * power / pressure.fluid_pressure;
        let told = pressure.variance.map(|variance| variance * slope * slope);
        let first = *self.pressure.get_or_insert(height - at.position.z);
        Some(BarometricHeight { height: height - first, deviation: deviation(told, options.pressure_deviation) })
    }
}
