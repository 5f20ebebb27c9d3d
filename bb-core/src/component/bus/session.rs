//! A bus for a caller whose rights end, such as the user of a connection.

use super::Bus;
use std::ops::Deref;
use std::time::Duration;

/// A [`Bus`] that acts until the session is dropped. From then on, everything obtained through it refuses to act, on any thread. A joint
/// that one of its links has moved stops when the link is dropped. Commands that it has started run on.
///
/// A call that another thread has begun is completed if it has passed its last check, and refused otherwise. The end does not
/// wait for such calls, since code of a component may hang in one; [`Self::end_within`] does, with a time limit.
///
/// ```
/// use bb_core::prelude::*;
/// # robot! { robot Rig; parameters { speed: f64 = 1.0; } link base; }
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let rig = Rig::builder().simulate()?;
/// let session = rig.session("page 1", Rights::ALL);
/// let bus = session.bus();
/// bus.set_parameter("param/speed", 2.0)?;
/// drop(session);
/// let refused = bus.set_parameter("param/speed", 3.0).unwrap_err();
/// assert_eq!(refused.to_string(), "param/speed is not set: the session of `page 1` has ended");
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Session(Bus);

impl Session {
    pub(super) fn new(bus: Bus) -> Self {
        Self(bus)
    }

    /// Returns a bus that acts for this session until it ends.
    pub fn bus(&self) -> Bus {
        self.0.clone()
    }

    /// Ends the session as dropping it does, even if other threads still hold it.
    pub fn end(&self) {
        self.0.caller.revoke();
    }

    /// Ends the session, and waits until the calls that other threads have begun through it are completed, at most `timeout`. Returns
    /// whether they are: after `true`, nothing more is done for the session. A call that contains this one, on the same thread, is not
    /// waited for.
    pub fn end_within(&self, timeout: Duration) -> bool {
        self.end();
        self.0.caller.wait_for_calls(timeout)
    }
}

impl Deref for Session {
    type Target = Bus;
    fn deref(&self) -> &Bus {
        &self.0
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        self.end();
    }
}
