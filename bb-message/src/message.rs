//! Messages: a payload with its time, its frame and its origin.

pub mod codec;
mod finite;
mod joint;
mod joint_command;
pub(crate) mod nearest;
mod stamped;

pub use bb_macros::Payload;
pub use codec::{DecodeError, Field, RosLayout, RosMessage, Schema};
pub use finite::Finite;
pub use joint::{JointPositions, JointReading, JointSide, Transmission};
pub use joint_command::{Exceeded, JointBounds, JointCommand, LimitedQuantity, OutOfBounds};
pub use stamped::{BothKnown, Feeds, Frame, Origin, Stamp, Stamped};

/// The content of a message: plain data in SI units. Derive it:
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
/// A message with a NaN or an infinity is dropped before an estimator sees it. A field that holds such values on
/// purpose, such as the range of a beam that hit nothing, says so:
///
/// ```
/// use bb_core::prelude::*;
///
/// /// One beam.
/// #[derive(Clone, Debug, Payload)]
/// pub struct Beam {
///     /// Direction, rad.
///     pub angle: f64,
///     /// Distance, m; infinite if nothing was hit.
///     #[payload(non_finite)]
///     pub range: f64,
/// }
///
/// assert!(bb_core::Finite::is_finite(&Beam { angle: 0.0, range: f64::INFINITY }));
/// assert!(!bb_core::Finite::is_finite(&Beam { angle: f64::NAN, range: 1.0 }));
/// ```
///
/// Payloads are passed by reference. A clone is made only for a subscriber and for the cache of an input that is not
/// the driver, so put large data in an `Arc`.
///
/// The derive also implements recording and reading back, bit for bit: see [`codec`]. All its fields must be
/// [`Field`]s. `#[payload(ros)]` records it as a ROS message, defined by its [`RosMessage`] implementation.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a payload",
    label = "cannot be the payload of a message",
    note = "derive it: `#[derive(Clone, Debug, Payload)]`",
    note = "messages cross threads: share data by `Arc` instead of `Rc`"
)]
pub trait Payload: Clone + std::fmt::Debug + Send + Sync + Field + 'static {
    /// The type's name, for messages: `Imu`.
    const NAME: &'static str;

    /// Layout in ROS, if ROS has a message for the payload.
    #[doc(hidden)]
    const ROS: Option<RosLayout<Self>> = None;

    /// `true` if the payload reports the position of the joint at which it is measured; set by `#[payload(joint_position)]`. Each joint
    /// with an actuator needs a sensor, or an estimator in one, that publishes such a payload. It implements [`JointPositions`].
    const TELLS_JOINT_POSITION: bool = false;

    /// `true` if the values are relative to a frame, unlike the state of a joint or of a battery. `#[payload(no_frame)]` says that they
    /// are not. An input of such a payload may span moving joints.
    const DEPENDS_ON_FRAME: bool = true;

    /// Calls `listener` with what it reports about joints, see [`JointPositions`].
    #[doc(hidden)]
    fn tell_joints(&self, listener: &mut dyn FnMut(JointReading<'_>)) {
        let _ = listener;
    }

    /// `true` if the payload commands a joint, whose limits are then applied; set by `#[payload(joint_command)]`. It implements
    /// [`JointCommand`].
    const COMMANDS_JOINT: bool = false;

    /// Clamps values that exceed the bounds of a joint, see [`JointCommand`].
    #[doc(hidden)]
    fn limit_command(&mut self, bounds: &JointBounds) -> Result<Exceeded, OutOfBounds> {
        let _ = bounds;
        Ok(Exceeded::default())
    }

    /// The command that stops a joint, see [`JointCommand`].
    #[doc(hidden)]
    fn stop_command() -> Option<Self> {
        None
    }

    /// The command to the motor of a joint, see [`JointCommand`].
    #[doc(hidden)]
    fn command_at_motor(&self, joint: &str, transmission: &Transmission) -> Option<Self> {
        let _ = (joint, transmission);
        None
    }

    /// `false` for the placeholder of an unknown payload, in a robot that does not compile.
    #[doc(hidden)]
    const KNOWN: bool = true;
}
