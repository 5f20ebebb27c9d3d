//! Requests to disarm from a network, apart from all others.

use crate::schedule::start_thread;
use std::io;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::JoinHandle;

/// Requests that wait, at most.
const MOST: usize = 256;

/// Requests to disarm from a network, in a queue of their own, with a thread of their own: whatever else is asked, the robot is disarmed, and no number of
/// requests takes more threads.
///
/// A request for which there is no room comes back; those that wait are carried out after it came.
///
/// ```
/// use bb_core::component::DisarmQueue;
/// use bb_core::prelude::*;
/// # robot! { robot Rig; link base; }
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let rig = Rig::builder().simulate()?;
/// let bus = rig.bus().clone();
/// let (answers, answered) = std::sync::mpsc::channel();
/// let (queue, _thread) = DisarmQueue::start("disarm", move |clients: Vec<u32>| {
///     let result = bus.disarm().map_err(|error| error.to_string());
///     clients.into_iter().for_each(|client| _ = answers.send((client, result.clone())));
/// })?;
/// assert!(queue.put(7).is_ok());
/// assert_eq!(answered.recv()?, (7, Ok(())));
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct DisarmQueue<R>(SyncSender<R>);

impl<R: Send + 'static> DisarmQueue<R> {
    /// Starts a thread of that name, to which all requests are given that wait, as one attempt to disarm answers them all. It ends once the
    /// queue is dropped, after what waits.
    ///
    /// # Errors
    /// The system has no thread.
    pub fn start(
        name: &str,
        mut carry_out: impl FnMut(Vec<R>) + Send + 'static,
    ) -> io::Result<(Self, JoinHandle<()>)> {
        let (sender, waiting) = sync_channel(MOST);
        let run = move || {
            while let Ok(first) = waiting.recv() {
                carry_out(std::iter::once(first).chain(waiting.try_iter().take(MOST)).collect());
            }
        };
        Ok((Self(sender), start_thread(name, Box::new(run))?))
    }

    /// Adds a request, and does not wait.
    ///
    /// # Errors
    /// The request, if there is no room.
    pub fn put(&self, request: R) -> Result<(), R> {
        use std::sync::mpsc::TrySendError::{Disconnected, Full};
        self.0.try_send(request).map_err(|(Full(request) | Disconnected(request))| request)
    }
}
