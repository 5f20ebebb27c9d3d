//! Services: the commands of the robot, and its parameters.

use crate::clients::Clients;
use crate::counts::{Counts, Repetitions};
use crate::error::Ros2Error;
use crate::messages::{Nothing, Outcome, bytes_of};
use crate::node::{Refusal, Request, RosNode, RosService, address};
use crate::parameters::ParameterService;
use bb_core::component::{Description, DisarmQueue};
use bb_core::message::codec::{Shape, bytes_to_json, service_hash};
use bb_core::{Bus, Field, Role};
use bb_ros2::command_type;
use std::fmt::Display;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// Requests that wait to be looked at, of all services but those that disarm.
const WAITING: usize = 256;
/// Refused requests whose clients are to be told.
const REFUSED: usize = 1024;
/// Commands that clients wait for; each has a thread.
const MOST_COMMANDS: usize = 32;
/// Time after which a thread that waits for a command looks whether it is to end.
const PATIENCE: Duration = Duration::from_millis(50);
/// Time for which the end waits for requests that have begun: code of the robot may never return.
const LAST: Duration = Duration::from_secs(2);
/// Lists of clients that wait to be told that the robot is disarmed; beyond that it is disarmed, and they are not told.
const UNTOLD: usize = 16;
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
}

/// A request with its subject, and the bus of the client that was there when it came.
type Asked = (Subject, Bus, Request);

/// The services, and the threads that answer.
#[derive(Debug)]
pub(crate) struct Services {
    services: Vec<RosService>,
    /// `None` once it has ended.
    asked: Option<SyncSender<Asked>>,
    is_over: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
    running: Arc<AtomicUsize>,
}

impl Services {
    pub(crate) fn start(
        node: &RosNode,
        clients: Clients,
        description: &Description,
        counts: &Arc<Counts>,
    ) -> Result<Self, Ros2Error> {
        let (asked, waiting) = sync_channel::<Asked>(WAITING);
        let clients = Arc::new(clients);
        let (refusals, refused_requests) = sync_channel(REFUSED);
        let full = |request: Request| request.refuse("too many requests wait");
        let (mut services, mut disarms) = (Vec::new(), Vec::new());
        let mut declare = |name: String, type_name: &str, type_hash: &str, subject: Subject| {
            let (asked, clients) = (asked.clone(), Arc::clone(&clients));
            services.push(node.service(&address(name, type_name, type_hash)?, &refusals, move |request| {
                let bus = clients.bus(request.client());
                if let Err(TrySendError::Full((_, _, request))) = asked.try_send((subject, bus, request)) {
                    full(request);
                }
            })?);
            Ok::<(), Ros2Error>(())
        };
        for service in ParameterService::ALL {
            let (name, type_name, type_hash) = service.declaration();
            declare(node.node().service(name)?, &type_name, &type_hash, Subject::Parameters(service))?;
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
            let shape = command.argument_shape();
            let (type_name, hash) = match shape {
                None => (trigger.to_owned(), trigger_hash.clone()),
                Some(shape) => {
                    let type_name = command_type(command.path);
                    let hash = service_hash(&type_name, shape, Outcome::SHAPE);
                    (type_name, hash)
                }
            };
            match command.role {
                Role::Disarming => disarms.push((address(name, &type_name, &hash)?, Some((command.path, shape)))),
                _ => declare(name, &type_name, &hash, Subject::Command(command.path, shape))?,
            }
        }
        let name = node.node().service(ARM)?;
        if !names.contains(&name) {
            declare(name, trigger, &trigger_hash, Subject::Arm)?;
        }
        let name = node.node().service(DISARM)?;
        if !names.contains(&name) {
            disarms.push((address(name, trigger, &trigger_hash)?, None));
        }
        let worker = Worker {
            clients: Arc::clone(&clients),
            counts: Arc::clone(counts),
            running: Arc::default(),
            is_over: Arc::default(),
        };
        let mut all = Self {
            services: Vec::new(),
            asked: Some(asked),
            is_over: Arc::clone(&worker.is_over),
            threads: Vec::new(),
            running: Arc::clone(&worker.running),
        };
        for (address, command) in disarms {
            let (done, untold) = sync_channel(UNTOLD);
            let disarm = Disarm { worker: worker.clone(), command, done, untold: Repetitions::default() };
            let started = DisarmQueue::start("ros2 disarm", move |requests| disarm.run(requests));
            let (queue, thread) = started.map_err(Ros2Error::Thread)?;
            all.threads.push(thread);
            all.spawn("ros2 disarmed", move || tell(&untold))?;
            let put = move |request| _ = queue.put(request).map_err(full);
            services.push(node.service(&address, &refusals, put)?);
        }
        all.spawn("ros2 refused", move || refused_requests.iter().for_each(Refusal::tell))?;
        all.services = services;
        all.spawn("ros2 services", move || worker.run(&waiting))?;
        Ok(all)
    }

    fn spawn(&mut self, name: &str, run: impl FnOnce() + Send + 'static) -> Result<(), Ros2Error> {
        self.threads.push(thread::Builder::new().name(name.into()).spawn(run).map_err(Ros2Error::Thread)?);
        Ok(())
    }

    /// Takes no more requests, and waits for those that have begun.
    pub(crate) fn stop(&mut self) {
        self.services.clear();
        self.is_over.store(true, Ordering::Release);
        self.asked = None;
        let deadline = Instant::now() + LAST;
        let is_running =
            || self.threads.iter().any(|thread| !thread.is_finished()) || self.running.load(Ordering::Acquire) != 0;
        while is_running() {
            if Instant::now() > deadline {
                tracing::warn!("requests that the robot has not carried out are left");
                break;
            }
            thread::sleep(Duration::from_millis(2));
        }
        self.threads.clear();
    }
}

impl Drop for Services {
    fn drop(&mut self) {
        self.stop();
    }
}

/// Disarms, and hands over what is to be answered: another thread waits for the network.
struct Disarm {
    worker: Worker,
    /// The command that disarms, with the robot's own code; `None` without one.
    command: Option<(&'static str, Option<Shape>)>,
    done: SyncSender<(Vec<Request>, Vec<u8>)>,
    untold: Repetitions,
}

impl Disarm {
    fn run(&self, requests: Vec<Request>) {
        match self.command {
            // Each with its own arguments.
            Some((_, Some(_))) => requests.into_iter().for_each(|request| self.carry_out(vec![request])),
            _ => self.carry_out(requests),
        }
    }

    fn carry_out(&self, requests: Vec<Request>) {
        let (worker, Some(first)) = (&self.worker, requests.first()) else { return };
        // Also in the name of a client that has left.
        let all = worker.clients.bus(None);
        let bus = all.for_caller(worker.clients.bus(first.client()).caller(), all.rights());
        let response = match self.command {
            None => outcome(bus.disarm().map(|()| "disarmed")),
            Some((path, shape)) => answered(command(&bus, path, shape, first.bytes(), &worker.is_over)),
        };
        Counts::add(&worker.counts.requests, requests.len() as u64);
        if self.done.try_send((requests, response)).is_err()
            && let Some(times) = self.untold.add()
        {
            tracing::warn!(times, "clients are not told that the robot was disarmed");
        }
    }
}

/// Answers the clients that waited.
fn tell(done: &Receiver<(Vec<Request>, Vec<u8>)>) {
    while let Ok((requests, response)) = done.recv() {
        requests.iter().for_each(|request| request.answer(response.clone()));
    }
}

/// The name and the hash of `std_srvs/srv/Trigger`.
fn trigger() -> (&'static str, String) {
    const NAME: &str = "std_srvs/srv/Trigger";
    (NAME, service_hash(NAME, Nothing::SHAPE, Outcome::SHAPE))
}

/// State of the threads that answer.
#[derive(Clone)]
struct Worker {
    clients: Arc<Clients>,
    counts: Arc<Counts>,
    /// Number of threads that wait for commands.
    running: Arc<AtomicUsize>,
    is_over: Arc<AtomicBool>,
}

impl Worker {
    fn run(self, waiting: &Receiver<Asked>) {
        while let Ok((subject, bus, request)) = waiting.recv() {
            match subject {
                _ if self.is_over.load(Ordering::Acquire) => request.refuse("the bridge ends"),
                Subject::Parameters(service) => match service.answer(&bus, request.bytes()) {
                    Ok(response) => {
                        Counts::add(&self.counts.requests, 1);
                        request.answer(response);
                    }
                    Err(error) => request.refuse(error.to_string()),
                },
                // Arming waits for the robot, and a command for its end.
                slow => self.begin(bus, slow, request),
            }
        }
    }

    /// Answers on a thread of its own.
    fn begin(&self, bus: Bus, subject: Subject, request: Request) {
        if self.running.fetch_add(1, Ordering::AcqRel) >= MOST_COMMANDS {
            self.running.fetch_sub(1, Ordering::AcqRel);
            return request.answer(refused("too many commands run"));
        }
        let (counts, is_over, running) =
            (Arc::clone(&self.counts), Arc::clone(&self.is_over), Running(Arc::clone(&self.running)));
        let spawned = thread::Builder::new().name("ros2 command".into()).spawn(move || {
            let _running = running;
            let response = match subject {
                Subject::Arm => outcome(bus.arm().map(|()| "armed")),
                Subject::Command(path, shape) => answered(command(&bus, path, shape, request.bytes(), &is_over)),
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

/// The response to a command.
fn answered(ended: Option<Result<String, String>>) -> Vec<u8> {
    match ended {
        Some(result) => outcome(result),
        None => refused("the bridge ends; the command may run on"),
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
