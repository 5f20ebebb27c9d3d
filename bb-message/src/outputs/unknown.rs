//! The payload that fits everywhere, in a robot that does not compile: see `stub` of `bb-core`.

use super::{At, OutputAt, Outputs};
use crate::message::codec::{Reader, Shape, Writer};
use crate::message::{DecodeError, Field, Finite, Payload, Stamp, Stamped};

/// A payload, sensor, estimator and so on, used wherever the real one is not known.
#[derive(Clone, Copy, Debug)]
pub struct Unknown;

/// The number of an input or output that does not exist.
pub const UNKNOWN_INDEX: usize = usize::MAX;

/// The field of an input or output that does not exist.
pub type NoField = At<UNKNOWN_INDEX>;

impl Finite for Unknown {
    fn is_finite(&self) -> bool {
        true
    }
}

#[diagnostic::do_not_recommend]
impl Field for Unknown {
    const SHAPE: Shape = <()>::SHAPE;
    const IS_INLINE: bool = true;

    fn write(&self, _: &mut Writer<'_>) {}

    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        Err(reader.error("a known payload", "one that is not known"))
    }
}

impl Payload for Unknown {
    const NAME: &'static str = "unknown";
    const KNOWN: bool = false;
    const TELLS_JOINT_POSITION: bool = true;
}

impl<O: Outputs> OutputAt<UNKNOWN_INDEX> for O {
    type Payload = Unknown;

    fn each(_: &mut Option<O>, _: Stamp, _: impl FnMut(&Stamped<Unknown>)) {}

    #[expect(clippy::panic, reason = "named only by a robot that did not verify, which does not compile")]
    fn alone(_: &Stamped<Unknown>) -> O {
        panic!("this robot did not verify")
    }
}
