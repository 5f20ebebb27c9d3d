//! Mahony's explicit complementary filter, with six axes or nine.
//!
//! R. Mahony, T. Hamel, J.-M. Pflimlin, "Nonlinear complementary filters on the special orthogonal group", IEEE
//! Transactions on Automatic Control 53(5), 2008: the explicit complementary filter with bias correction, their
//! equations (32).
//!
//! The gyroscope is integrated. The deviation of gravity and field from their expected directions gives an angular
//! velocity, the sum of the cross products of measured and expected directions. The proportional part turns the
//! orientation, and the integral is the gyroscope's bias.
//!
//! # Differences from the paper
//!
//! * The paper's reference vectors are known. Here the field's reference is the measured field turned north, as in
//!   [`madgwick`](super::madgwick): its dip need not be known.
//! * The weights `k_i` of the directions are all 1.
//! * The error is taken where the gyroscope leads, not at the previous orientation: what was measured now is
//!   compared with what is expected now. It turns the orientation from there on, in one turn with the gyroscope's
//!   next sample, as in the paper's differential equation; never beyond what was missed, however late that comes.
//! * Exactly upside down the error is zero; the paper leaves this set of measure zero out, and here it is left
//!   about a horizontal axis.

mod filter;
mod params;
#[cfg(test)]
mod tests;

pub use filter::MahonyFilter;
pub use params::MahonyParams;

/// Purpose of the filter.
pub const ABOUT: super::About = super::About {
    when: "the least work, with a bias",
    idea: "proportional and integral feedback of what gravity and field miss their expected directions by",
};
