//! Messages: a payload with its time, its frame and its origin.

mod finite;
mod stamped;

pub use finite::Finite;
pub use stamped::{Feeds, Frame, Origin, Stamp, Stamped};

/// What a message carries: plain data in SI units. Derive it:
///
/// ```
/// use bb_core::prelude::*;
///
/// /// Temperature of a motor's winding.
/// #[derive(Clone, Debug, Payload)]
/// pub struct WindingTemperature {
///     /// Kelvin.
///     pub temperature_k: f64,
/// }
///
/// assert!(!bb_core::Finite::is_finite(&WindingTemperature { temperature_k: f64::NAN }));
/// ```
///
/// Payloads are handed on by reference; a clone is made only for a subscriber and for the cache of an input that is
/// not the driver, so large data belongs behind an `Arc`.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a payload",
    label = "cannot be the payload of a message",
    note = "derive it: `#[derive(Clone, Debug, Payload)]`"
)]
pub trait Payload: Clone + std::fmt::Debug + Send + Sync + Finite + 'static {
    /// The type's name, for people: `Imu`.
    const NAME: &'static str;

    /// False for the stand-in of a payload that is not known, in a robot that does not compile.
    #[doc(hidden)]
    const KNOWN: bool = true;
}
