//! Services: the commands of the robot, and its parameters.

use crate::clients::Clients;
use crate::counts::Counts;
use crate::error::Ros2Error;
use crate::messages::{Nothing, Outcome, bytes_of};
use crate::node::{Request, RosNode, RosService};
use crate::parameters::ParameterService;
use bb_core::component::{CommandInfo, Description};
use bb_core::message::codec::{Shape, bytes_to_json, service_hash};
use bb_core::{Bus, Field};
use bb_ros2::Address;
use std::fmt::Display;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread::{self, JoinHandle};
use std::time::Duration;

/// Requests that wait to be looked at.
const WAITING: usize = 256;
/// Commands that clients wait for; each has a thread.
const MOST_COMMANDS: usize = 32;
/// Time after which a thread that waits for a command looks whether it is to end.
const PATIENCE: Duration = Duration::from_millis(50);
/// The service that disarms the robot, and the one that arms it, of robots without commands of these names.
const DISARM: &str = "disarm";
const ARM: &str = "arm";

/// Subject of a request.
#[derive(Clone, Copy, Debug)]
enum Subject {
    Parameters(ParameterService),
    /// The path of the command, and the shape of its arguments if it has any.
    Command(&'static str, Option<Shape>),
    Arm,
    Disarm,
}

/// A request with its subject; `None` ends the thread.
type Asked = Option<(Subject, Request)>;

/// The services, and the thread that answers.
#[derive(Debug)]
pub(crate) struct Services {
    services: Vec<RosService>,
    asked: SyncSender<Asked>,
    is_over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Services {
    pub(crate) fn start(
        bus: &Bus,
        node: &RosNode,
        clients: Clients,
        description: &Description,
        counts: &Arc<Counts>,
    ) -> Result<Self, Ros2Error> {
        let (asked, waiting) = sync_channel(WAITING);
        let mut services = Vec::new();
        let mut declare = |name: String, type_name: &str, type_hash: &str, subject: Subject| {
            let address = Address { name, type_name: type_name.parse()?, type_hash: type_hash.parse()? };
            let asked = asked.clone();
            services.push(node.service(&address, move |request| {
                if let Err(TrySendError::Full(Some((_, request)))) = asked.try_send(Some((subject, request))) {
                    request.refuse("too many requests wait".to_owned());
                }
            })?);
            Ok::<(), Ros2Error>(())
        };
        for service in ParameterService::ALL {
            let name = node.node().service(service.name())?;
            declare(name, &service.type_name(), &service.type_hash(), Subject::Parameters(service))?;
        }
        let (trigger, trigger_hash) = trigger();
        let mut names = Vec::new();
        for command in &description.commands {
            let name = match node.node().service(command.path) {
                Ok(name) => name,
                Err(error) => {
                    tracing::warn!(%error, path = command.path, "a command is no service");
                    continue;
                }
            };
            names.push(name.clone());
            match arguments(command) {
                None => declare(name, trigger, &trigger_hash, Subject::Command(command.path, None))?,
                Some(shape) => {
                    let type_name = command_type(command.path);
                    let hash = service_hash(&type_name, shape, Outcome::SHAPE);
                    declare(name, &type_name, &hash, Subject::Command(command.path, Some(shape)))?;
                }
            }
        }
        for (own, subject) in [(ARM, Subject::Arm), (DISARM, Subject::Disarm)] {
            let name = node.node().service(own)?;
            if !names.contains(&name) {
                declare(name, trigger, &trigger_hash, subject)?;
            }
        }
        let is_over = Arc::<AtomicBool>::default();
        let worker = Worker {
            bus: bus.clone(),
            clients,
            counts: Arc::clone(counts),
            running: Arc::default(),
            is_over: Arc::clone(&is_over),
        };
        let thread = thread::Builder::new().name("ros2 services".into()).spawn(move || worker.run(&waiting));
        Ok(Self { services, asked, is_over, thread: Some(thread.map_err(Ros2Error::Thread)?) })
    }

    pub(crate) fn stop(&mut self) {
        self.services.clear();
        self.is_over.store(true, Ordering::Release);
        let _ = self.asked.send(None);
        if let Some(thread) = self.thread.take() {
            // Its panic was printed.
            let _ = thread.join();
        }
    }
}

/// The name and the hash of `std_srvs/srv/Trigger`.
fn trigger() -> (&'static str, String) {
    const NAME: &str = "std_srvs/srv/Trigger";
    (NAME, service_hash(NAME, Nothing::SHAPE, Outcome::SHAPE))
}

/// The shape of a command's arguments, if it has any.
pub(crate) fn arguments(command: &CommandInfo) -> Option<Shape> {
    match command.arguments {
        Shape::Struct(_) if command.argument_list().is_empty() => None,
        shape => Some(shape),
    }
}

/// The type of the service for a command with arguments: `bb_msgs/srv/GoHome` for `command/go_home`.
pub(crate) fn command_type(path: &str) -> String {
    let path = path.strip_prefix("command/").unwrap_or(path);
    let mut name = String::new();
    for word in path.split(|letter: char| !letter.is_ascii_alphanumeric()) {
        let mut letters = word.chars();
        name.extend(letters.next().map(|first| first.to_ascii_uppercase()));
        name.push_str(letters.as_str());
    }
    format!("bb_msgs/srv/{name}")
}

/// State of the thread that answers.
struct Worker {
    bus: Bus,
    clients: Clients,
    counts: Arc<Counts>,
    /// Number of threads that wait for commands.
    running: Arc<AtomicUsize>,
    is_over: Arc<AtomicBool>,
}

impl Worker {
    fn run(self, waiting: &Receiver<Asked>) {
        while let Ok(Some((subject, request))) = waiting.recv() {
            let bus = self.bus.for_caller(self.clients.caller(request.client()), self.bus.rights());
            match subject {
                Subject::Parameters(service) => match service.answer(&bus, &request.bytes()) {
                    Ok(response) => {
                        Counts::add(&self.counts.requests, 1);
                        request.answer(response);
                    }
                    Err(error) => request.refuse(error.to_string()),
                },
                // Arming and disarming wait for the robot, and a command for its end.
                slow => self.begin(bus, slow, request),
            }
        }
        while self.running.load(Ordering::Acquire) != 0 {
            thread::sleep(PATIENCE);
        }
    }

    /// Answers on a thread of its own.
    fn begin(&self, bus: Bus, subject: Subject, request: Request) {
        if self.running.fetch_add(1, Ordering::AcqRel) >= MOST_COMMANDS && !matches!(subject, Subject::Disarm) {
            self.running.fetch_sub(1, Ordering::AcqRel);
            return request.answer(refused("too many commands run"));
        }
        let (counts, is_over, running) =
            (Arc::clone(&self.counts), Arc::clone(&self.is_over), Running(Arc::clone(&self.running)));
        let spawned = thread::Builder::new().name("ros2 command".into()).spawn(move || {
            let _running = running;
            let response = match subject {
                Subject::Arm => outcome(bus.arm().map(|()| "armed")),
                Subject::Disarm => outcome(bus.disarm().map(|()| "disarmed")),
                Subject::Command(path, shape) => match command(&bus, path, shape, &request.bytes(), &is_over) {
                    Some(result) => outcome(result),
                    None => refused("the bridge ends; the command may run on"),
                },
                Subject::Parameters(_) => return,
            };
            Counts::add(&counts.requests, 1);
            request.answer(response);
        });
        if let Err(error) = spawned {
            tracing::error!(%error, "a request was not answered");
        }
    }
}

/// A thread that answers, counted while it lasts.
struct Running(Arc<AtomicUsize>);

impl Drop for Running {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::AcqRel);
    }
}

/// Runs a command to its end; `None` if the bridge ends before.
fn command(
    bus: &Bus,
    path: &str,
    shape: Option<Shape>,
    request: &[u8],
    is_over: &AtomicBool,
) -> Option<Result<String, String>> {
    let json = match shape.map(|shape| bytes_to_json(request, shape)) {
        None => String::new(),
        Some(Ok(json)) => json,
        Some(Err(error)) => return Some(Err(format!("the request cannot be read: {error}"))),
    };
    let execution = match bus.start_command(path, &json) {
        Ok(execution) => execution,
        Err(error) => return Some(Err(error.to_string())),
    };
    loop {
        if let Some(result) = execution.wait_timeout(PATIENCE) {
            return Some(result.map_err(|error| error.to_string()));
        }
        if is_over.load(Ordering::Acquire) {
            return None;
        }
    }
}

/// The response with the reason of a refusal.
fn refused(why: &str) -> Vec<u8> {
    bytes_of(&Outcome { success: false, message: why.to_owned() })
}

/// The response with the result in JSON, or with the reason of the refusal.
fn outcome(result: Result<impl Display, impl Display>) -> Vec<u8> {
    match result {
        Ok(result) => bytes_of(&Outcome { success: true, message: result.to_string() }),
        Err(error) => refused(&error.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bb_ros2::TypeName;

    #[test]
    fn a_command_gives_its_service_a_valid_type() {
        for (path, expected) in
            [("command/go_home", "GoHome"), ("command/arm/reach", "ArmReach"), ("command/go", "Go")]
        {
            let name = command_type(path);
            assert_eq!(name, format!("bb_msgs/srv/{expected}"));
            assert!(name.parse::<TypeName>().is_ok());
        }
    }
}
