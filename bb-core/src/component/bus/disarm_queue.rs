//! A queue of requests to disarm from a network, with its own thread.

use crate::schedule::start_thread;
use std::io;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::JoinHandle;

/// The capacity of the queue.
const CAPACITY: usize = 256;

/// A queue of requests to disarm from a network, with its own thread: other requests cannot delay disarming, and any number of requests
/// to disarm takes a single thread.
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
    /// Starts the thread `name`. It passes all waiting requests to `carry_out` at once, as one attempt to disarm answers them all, and
    /// ends once the queue is dropped and empty.
    ///
    /// # Errors
    /// The system cannot start a thread.
    pub fn start(
        name: &str,
        mut carry_out: impl FnMut(Vec<R>) + Send + 'static,
    ) -> io::Result<(Self, JoinHandle<()>)> {
        let (sender, waiting) = sync_channel(CAPACITY);
        let run = move || {
            while let Ok(first) = waiting.recv() {
                carry_out(std::iter::once(first).chain(waiting.try_iter().take(CAPACITY)).collect());
            }
        };
        Ok((Self(sender), start_thread(name, Box::new(run))?))
    }

    /// Adds a request without waiting.
    ///
    /// # Errors
    /// The queue is full: returns the request.
    pub fn put(&self, request: R) -> Result<(), R> {
        use std::sync::mpsc::TrySendError::{Disconnected, Full};
        self.0.try_send(request).map_err(|(Full(request) | Disconnected(request))| request)
    }
}
