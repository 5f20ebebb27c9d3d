//! Topics of other nodes that are inputs of the robot.

use crate::counts::{Counts, Repetitions};
use crate::error::Ros2Error;
use crate::node::{RosNode, RosSubscription, address};
use bb_core::component::Description;
use bb_core::{Bus, Fault};
use bb_ros2::Address;
use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};

/// Messages that wait for the robot, of all inputs. Beyond that they are refused, and counted: what zenoh's threads waited for would be late
/// as well.
const WAITING: usize = 1024;

/// Bytes of these messages, at most, unless one message alone is longer.
const WAITING_BYTES: usize = 16 * 1024 * 1024;

/// A message on its way in; `None` ends the thread.
type Message = Option<(&'static str, Vec<u8>)>;

/// The subscriptions, and the thread that publishes what they get.
#[derive(Debug)]
pub(crate) struct Inputs {
    subscriptions: Vec<RosSubscription>,
    messages: SyncSender<Message>,
    thread: Option<JoinHandle<()>>,
}

impl Inputs {
    pub(crate) fn start(
        bus: &Bus,
        node: &RosNode,
        description: &Description,
        paths: &[String],
        counts: &Arc<Counts>,
    ) -> Result<Self, Ros2Error> {
        let (messages, waiting) = sync_channel(WAITING);
        let waiting_bytes = Arc::<AtomicUsize>::default();
        let mut subscriptions = Vec::new();
        for path in paths {
            let (path, address) = input(node, description, path)?;
            let (messages, full, all) = (messages.clone(), Arc::clone(counts), Arc::clone(&waiting_bytes));
            let receive = move |bytes: Vec<u8>| {
                let length = bytes.len();
                let before = all.fetch_add(length, Ordering::Relaxed);
                let is_room = before == 0 || before.saturating_add(length) <= WAITING_BYTES;
                if !is_room || messages.try_send(Some((path, bytes))).is_err() {
                    all.fetch_sub(length, Ordering::Relaxed);
                    Counts::add(&full.refused, 1);
                }
            };
            let (refused, hash) = (Arc::clone(counts), address.type_hash);
            let of_other_type = Repetitions::default();
            let refuse = move |other: &str| {
                Counts::add(&refused.refused, 1);
                if let Some(times) = of_other_type.add() {
                    tracing::warn!(path, %hash, other, times, "a message of another definition of its type is refused");
                }
            };
            subscriptions.push(node.subscription(&address, receive, refuse)?);
        }
        let (bus, counts) = (bus.clone(), Arc::clone(counts));
        let thread = thread::Builder::new()
            .name("ros2 in".into())
            .spawn(move || publish(&bus, &waiting, &waiting_bytes, &counts));
        Ok(Self { subscriptions, messages, thread: Some(thread.map_err(Ros2Error::Thread)?) })
    }

    /// Takes no more messages, and publishes those that wait.
    pub(crate) fn stop(&mut self) {
        self.subscriptions.clear();
        let _ = self.messages.send(None);
        if let Some(thread) = self.thread.take() {
            // Its panic was printed.
            let _ = thread.join();
        }
    }
}

impl Drop for Inputs {
    fn drop(&mut self) {
        self.stop();
    }
}

/// The path of an input, and the address of the messages for it.
fn input(node: &RosNode, description: &Description, path: &str) -> Result<(&'static str, Address), Ros2Error> {
    let refused = |why: &str| Ros2Error::Options(Fault::new(format!("`subscribe` has `{path}`: {why}")));
    let Some(topic) = description.topic(path) else {
        return Err(refused("the robot has no topic there"));
    };
    if !topic.is_external {
        return Err(refused("only its own publisher publishes there"));
    }
    let (Some(name), Some(hash)) = (topic.layouts.ros_schema(), topic.layouts.ros_type_hash()) else {
        return Err(refused(&format!("ROS has no message for its payload `{}`", topic.payload)));
    };
    Ok((topic.path, address(node.node().topic(path)?, &name.name, &hash)?))
}

/// Publishes what comes, in the robot, until it is to end.
fn publish(bus: &Bus, waiting: &Receiver<Message>, waiting_bytes: &AtomicUsize, counts: &Counts) {
    let mut refused = HashMap::<&'static str, Repetitions>::new();
    while let Ok(Some((path, message))) = waiting.recv() {
        waiting_bytes.fetch_sub(message.len(), Ordering::Relaxed);
        match bus.publish_ros(path, &message) {
            Ok(()) => Counts::add(&counts.received, 1),
            Err(error) => {
                Counts::add(&counts.refused, 1);
                if let Some(times) = refused.entry(path).or_default().add() {
                    tracing::warn!(%error, times, "a message of another node is refused");
                }
            }
        }
    }
}
