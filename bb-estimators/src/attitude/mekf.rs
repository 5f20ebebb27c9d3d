//! A self-calibrating multiplicative error-state Kalman filter, with six axes or nine.
//!
//! F. L. Markley, "Attitude error representations for Kalman filtering", Journal of Guidance, Control, and Dynamics
//! 26(2), 2003, for the error state; D. Laidig, T. Seel, "VQF: Highly accurate IMU orientation estimation with bias
//! estimation and magnetic disturbance rejection", Information Fusion 91, 2023, for typical sensor errors, and for
//! rest and disturbances. `book/src/laboratory/attitude.md` has the ablation of whole parts and the comparison.
//!
//! Eight states: the rotation error in the world, the gyroscope's bias, and the horizontal velocity. Samples are integrated
//! at once, errors propagated once per window. The offset of the magnetometer and its lag are a hypothesis beside the
//! filter; see `offset.rs`. `numbers.rs` has all numbers, and `book/src/explanation/attitude-filter.md` the equations.
//!
//! # What each rule contributes
//!
//! One rule of an earlier filter is left out at a time; the figures are the change of the geometric mean over the families of half A and of half B. The rules
//! of the first four rows were then dropped.
//!
//! | rule left out | A | B | |
//! |---|---|---|---|
//! | a field lasts at rest as well, ten times slower | 0.0 % | 0.0 % | |
//! | a gap is longer than 80 ms, and not only than four periods | 0.0 % | -0.1 % | |
//! | a gap lets the velocity be doubted, rest end, and the deviation of the heading begin again | 0.0 % | 0.0 % | |
//! | another reference after a field that lasts for 5 to 20 s, instead of slowly | 0.0 % | -0.1 % | `steel` +6 %, `os` -3 % |
//! | a newcomer also needs a smaller variance than its distance | 0.0 % | 0.0 % | a magnet put on and taken off: 15.1° instead of 13.5° |
//! | poses compare fields of one time, without the lag | +0.1 % | -0.3 % | `broad` is 2.63° in single precision instead of 1.41° |
//! | a newcomer that has not won within 500 poses starts again | 0.0 % | -0.1 % | `broad` +4 % |
//! | a disturbance is remembered for 0.3 s | -0.7 % | +0.1 % | `phones-magnets` +5 % |
//! | fields are learnt in fast motion alone | +7.1 % | +0.8 % | |
//! | noise of the offset in the heading | +3.2 % | +0.3 % | |
//! | the heading is doubted when the offset is known better | +0.5 % | +3.3 % | |
//! | a large step of the field counts as one | +0.3 % | +2.4 % | |
//! | the next newcomer has the learnt scale | 0.0 % | +1.8 % | |
//! | rest beyond four deviations counts less | +0.1 % | +1.2 % | |
//! | a repeated field is not a new one | +0.2 % | +0.6 % | |
//! | `PLACES` is `CALIBRATED` | +0.5 % | +0.5 % | |

mod doubt;
mod errors;
mod field;
mod filter;
mod numbers;
mod offset;
mod params;
mod rest;
#[cfg(test)]
mod tests;
mod window;

pub use filter::MekfFilter;
pub use params::{Magnetometer, MekfParams};

/// Purpose of the filter.
pub const ABOUT: super::About = super::About {
    when: "first choice: the most accurate from rest and in motion, without calibration, with a covariance",
    idea: "an error-state Kalman filter that also finds the gyroscope's bias, the body's velocity, and the magnetometer's offset and lag",
};
