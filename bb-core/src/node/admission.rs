//! Which messages of an input are let in.

use super::DropReason;
use crate::Payload;
use crate::message::Stamped;
use crate::time::{Clock, MonotonicTime};

/// How far ahead of the clock a stamp may be, in nanoseconds: 1 s.
const MAX_SKEW_NANOS: i64 = 1_000_000_000;

/// Remembers the time of the last message of each input, and up to when stamps are known not to be ahead of the clock.
#[derive(Debug)]
pub(super) struct Admission {
    last: Box<[MonotonicTime]>,
    /// The clock as it was last read, and the bound. Time does not run back, so that a stamp up to here is within the
    /// bound whatever the clock is now: it has to be read about once a second.
    horizon: MonotonicTime,
}

impl Admission {
    pub(super) fn new(inputs: usize) -> Self {
        let never = MonotonicTime::from_nanos(i64::MIN);
        Self { last: vec![never; inputs].into(), horizon: never }
    }

    /// Lets `message` in, or says why not. Equal times are in order.
    #[inline]
    pub(super) fn admit<T: Payload>(
        &mut self,
        input: usize,
        message: &Stamped<T>,
        clock: &Clock,
    ) -> Result<(), DropReason> {
        if !message.payload.is_finite() {
            return Err(DropReason::NonFinite);
        }
        let time = message.monotonic_time;
        if time > self.horizon {
            self.horizon = clock.now().plus_nanos(MAX_SKEW_NANOS);
            if time > self.horizon {
                return Err(DropReason::ClockSkew);
            }
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
