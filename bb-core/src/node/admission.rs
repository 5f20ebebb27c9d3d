//! Which messages of an input are let in.

use super::DropReason;
use crate::Payload;
use crate::message::Stamped;
use crate::time::MonotonicTime;

/// Remembers the time of the last message of each input.
#[derive(Debug)]
pub(super) struct Admission(Box<[MonotonicTime]>);

impl Admission {
    pub(super) fn new(inputs: usize) -> Self {
        Self(vec![MonotonicTime::from_nanos(i64::MIN); inputs].into())
    }

    /// Lets `message` in, or says why not. Equal times are in order.
    #[inline]
    pub(super) fn admit<T: Payload>(&mut self, input: usize, message: &Stamped<T>) -> Result<(), DropReason> {
        if !message.payload.is_finite() {
            return Err(DropReason::NonFinite);
        }
        if let Some(last) = self.0.get_mut(input) {
            if message.monotonic_time < *last {
                return Err(DropReason::OutOfOrder);
            }
            *last = message.monotonic_time;
        }
        Ok(())
    }
}
