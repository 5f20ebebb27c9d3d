//! Decides which messages of an input are accepted.

use super::DropReason;
use crate::message::Payload;
use crate::message::Stamped;
use crate::time::MonotonicTime;

/// Time by which a stamp may be ahead of the clock, in nanoseconds: 1 s.
pub(super) const MAX_SKEW_NANOS: i64 = 1_000_000_000;

/// Remembers the time of the last message of each input.
#[derive(Debug)]
pub(super) struct Admission {
    last: Box<[MonotonicTime]>,
}

impl Admission {
    pub(super) fn new(inputs: usize) -> Self {
        let never = MonotonicTime::from_nanos(i64::MIN);
        Self { last: vec![never; inputs].into() }
    }

    /// The time of the last accepted message of an input.
    #[inline]
    pub(super) fn last(&self, input: usize) -> Option<MonotonicTime> {
        self.last.get(input).copied().filter(|last| last.as_nanos() > i64::MIN)
    }

    /// Accepts `message`, unless its stamp is after `latest`, or returns the reason for the drop. Equal times are in order.
    #[inline]
    pub(super) fn admit<T: Payload>(
        &mut self,
        input: usize,
        message: &Stamped<T>,
        latest: MonotonicTime,
    ) -> Result<(), DropReason> {
        if !message.payload.is_finite() {
            return Err(DropReason::NonFinite);
        }
        let time = message.monotonic_time;
        if time > latest {
            return Err(DropReason::ClockSkew);
        }
        if let Some(last) = self.last.get_mut(input) {
            if time < *last {
                return Err(DropReason::OutOfOrder);
            }
            *last = time;
        }
        Ok(())
    }
}
