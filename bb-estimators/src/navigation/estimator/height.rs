//! Heights relative to the first barometer reading.

use super::input::{Setup, place};
use super::life::World;
use super::measured::deviation;
use crate::navigation::measurement::BarometricHeight;
use crate::navigation::state::Estimate;
use bb_core::payload::FluidPressure;

/// The standard atmosphere, ISO 2533: pressure at sea level, Pa, and height as a function of pressure.
const SEA_LEVEL: f64 = 101_325.0;
const SCALE: f64 = 44_330.77;
const EXPONENT: f64 = 0.190_263;

/// The height for a pressure, relative to the first one in this world. `None` if it is invalid. The remainder is a state.
pub(super) fn of_pressure<const N: usize>(
    pressure: &FluidPressure,
    at: &Estimate<N>,
    world: &mut World,
    setup: &Setup,
) -> Option<BarometricHeight> {
    let ratio = pressure.fluid_pressure / SEA_LEVEL;
    // NaN fails this test as well.
    if !(ratio > 0.0 && ratio < 2.0) {
        return None;
    }
    let power = ratio.powf(EXPONENT);
    let sensor = (at.world_from_body * place(setup.pressure.as_ref())).z;
    let height = SCALE * (1.0 - power) - sensor - world.drop(&at.position);
    // Metres per pascal.
    let slope = SCALE * EXPONENT * power / pressure.fluid_pressure;
    let told = pressure.variance.map(|variance| variance * slope * slope);
    let first = *world.pressure.get_or_insert(height - at.position.z);
    Some(BarometricHeight { height: height - first, deviation: deviation(told, setup.options.pressure_deviation) })
}
