//! Copies of messages that outlive the call that delivers them: for another thread, a subscriber, or later.

use super::codec::{decode, encode};
use super::{Payload, Stamped};
use crate::fault::discard;
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// The value carried by a panic.
pub(crate) type Panic = Box<dyn Any + Send>;

/// Copies `message` to `kept`. If the payload's `Clone` panics, the payload is copied through its encoded form, as in
/// a replay: whether a message arrives does not depend on which thread had to copy it. The panic is returned so that
/// the publisher can be charged with it. `kept` is `None` if the encoded form cannot be read either.
#[inline]
pub(crate) fn copy_to<T: Payload>(kept: &mut Option<Stamped<T>>, message: &Stamped<T>) -> Result<(), Panic> {
    let cloned = catch_unwind(AssertUnwindSafe(|| match &mut *kept {
        Some(kept) => kept.clone_from(message),
        none => *none = Some(message.clone()),
    }));
    cloned.inspect_err(|_| {
        // What was there may be half-written, and panic when it is dropped.
        discard(kept.take());
        *kept = by_encoding(message);
    })
}

/// Returns the copy as a new message; stores the first panic in `panic`.
#[inline]
pub(crate) fn copied<T: Payload>(message: &Stamped<T>, panic: &mut Option<Panic>) -> Option<Stamped<T>> {
    let mut copy = None;
    if let Err(another) = copy_to(&mut copy, message) {
        match panic {
            None => *panic = Some(another),
            Some(_) => discard(another),
        }
    }
    copy
}

#[cold]
fn by_encoding<T: Payload>(message: &Stamped<T>) -> Option<Stamped<T>> {
    let copied = catch_unwind(AssertUnwindSafe(|| {
        let mut bytes = Vec::new();
        encode(&message.payload, &mut bytes);
        decode(&bytes).ok()
    }));
    let payload = copied.map_err(discard).ok().flatten()?;
    Some(message.stamp().message(payload))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::Payload as DerivePayload;
    use crate::time::MonotonicTime;

    #[derive(Debug, DerivePayload)]
    struct Fragile {
        number: f64,
    }

    impl Clone for Fragile {
        fn clone(&self) -> Self {
            assert!(!self.number.is_sign_negative(), "it is negative");
            Self { number: self.number }
        }
    }

    #[test]
    fn a_message_whose_clone_panics_is_copied_to_the_last_bit() {
        let message = |number| Stamped::new(MonotonicTime::from_nanos(7), Fragile { number });
        let mut panic = None;
        let mut kept = None;
        for number in [1.5, -1.5, f64::from_bits(0xfff8_0000_0000_0123), 2.0, -0.0] {
            let message = message(number);
            let copy = copied(&message, &mut panic).expect("it has an encoded form");
            assert_eq!((copy.number.to_bits(), copy.stamp()), (number.to_bits(), message.stamp()));
            assert_eq!(copy_to(&mut kept, &message).is_err(), number.is_sign_negative());
            assert_eq!(kept.as_ref().map(|kept| kept.number.to_bits()), Some(number.to_bits()));
        }
        let panic = panic.expect("it has panicked");
        assert_eq!(panic.downcast_ref(), Some(&"it is negative"));
    }
}
