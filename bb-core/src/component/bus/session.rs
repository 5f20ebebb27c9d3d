//! A caller with an end, such as the user of a connection.

use super::Bus;
use std::ops::Deref;

/// A [`Bus`] until it is dropped. From then on, whatever was obtained through it refuses to act, on any thread, and a joint that one of its
/// links has moved stops when the link is dropped. Commands that it has started run on.
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

    /// Returns the bus that acts in its name, while it lasts.
    pub fn bus(&self) -> Bus {
        self.0.clone()
    }

    /// Ends it, as dropping it does: where other threads still hold it.
    pub fn end(&self) {
        self.0.caller.revoke();
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
