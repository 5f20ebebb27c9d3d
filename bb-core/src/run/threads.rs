//! The threads of a robot that runs in real time: one for each sensor and service, one for each estimator with
//! `runs_on: worker`, one for what is due, one for commands.

use super::machine::Machine;
use super::{Robot, Source, StartError, Startup, caught};
use crate::component::Fault;
use crate::node::WorkerDeclaration;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// A thread, by the path of what it runs.
pub(super) type Thread = (&'static str, JoinHandle<()>);

/// The longest sleep of a thread that waits for what is due.
const LONGEST_WAIT: Duration = Duration::from_millis(200);

/// The threads that run until the robot stops, as far as they could be started.
pub(super) fn serve<R: Robot>(machine: &Arc<Machine<R>>, threads: &mut Vec<Thread>) -> Result<(), StartError> {
    for number in 0..R::ISLANDS.len() {
        let Some(island) = machine.island(number) else { continue };
        let Some(worker) = island.worker() else { continue };
        let (name, served) = (island.name(), Arc::clone(machine));
        island.give_to_thread();
        threads.push(spawn(name, move || {
            if let Err(message) = set_up(worker) {
                tracing::warn!(estimator = name, message, "its thread runs as any other");
            }
            while !served.startup.stop.is_set()
                && let Some(island) = served.island(number)
            {
                survive(&served.startup, name, || island.serve(&served.wiring, &served.startup.stop));
            }
        })?);
    }
    let served = Arc::clone(machine);
    threads.push(spawn("agenda", move || wake_what_is_due(&served))?);
    let served = Arc::clone(machine);
    threads.push(spawn("commands", move || drive_commands(&served.startup))?);
    Ok(())
}

pub(super) fn source(mut source: Box<dyn Source>, startup: &Startup) -> Result<Thread, StartError> {
    let startup = startup.clone();
    spawn(source.path(), move || {
        source.begin();
        while let Some(due) = source.due() {
            let wait = due.duration_since(startup.clock.now());
            if !wait.is_zero() {
                startup.stop.sleep(wait);
            }
            if startup.stop.is_set() {
                break;
            }
            source.fire();
        }
        source.terminate();
    })
}

/// Waits for the thread until `deadline`; what went wrong.
pub(super) fn join(thread: JoinHandle<()>, deadline: Option<Instant>) -> Result<(), &'static str> {
    if thread.thread().id() == std::thread::current().id() {
        return Err("has stopped the robot itself, and cannot be waited for");
    }
    while let Some(deadline) = deadline
        && !thread.is_finished()
    {
        if Instant::now() >= deadline {
            return Err("did not come back from its read, or from an estimator downstream, in time");
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    thread.join().map_err(|_| "its thread panicked")
}

fn spawn(path: &'static str, run: impl FnOnce() + Send + 'static) -> Result<Thread, StartError> {
    let thread = std::thread::Builder::new().name(path.to_owned());
    match thread.spawn(run) {
        Ok(thread) => Ok((path, thread)),
        Err(error) => Err(StartError::component(path, Fault::from(error))),
    }
}

fn wake_what_is_due<R: Robot>(machine: &Machine<R>) {
    let Startup { clock, stop, .. } = &machine.startup;
    let agenda = machine.startup.agenda();
    while !stop.is_set() {
        let now = clock.now();
        match agenda.take(now) {
            Some(number) => {
                let path = machine.island(number).map_or("agenda", |island| island.name());
                survive(&machine.startup, path, || machine.wake(number, now));
            }
            None => agenda.wait(clock, LONGEST_WAIT),
        }
    }
}

fn drive_commands(startup: &Startup) {
    while !startup.stop.is_set() {
        let now = startup.clock.now();
        survive(startup, "commands", || startup.control.drive(now));
        let wait = startup.control.next_due(now).map_or(LONGEST_WAIT, |next| next.duration_since(now));
        startup.control.wait(wait.min(LONGEST_WAIT));
    }
    // Those that came back late are ended.
    survive(startup, "commands", || startup.control.drive(startup.clock.now()));
}

/// A panic that no component has caught, in the code of a payload say, must not end a thread that serves others.
fn survive(startup: &Startup, path: &'static str, run: impl FnOnce()) {
    let survived = caught(|| {
        run();
        Ok(())
    });
    if let Err(failed) = survived {
        startup.fault(path, &failed.fault);
    }
}

/// Priority and core of the thread that calls it.
#[cfg(feature = "realtime")]
fn set_up(worker: WorkerDeclaration) -> Result<(), String> {
    if let Some(core) = worker.core
        && !core_affinity::set_for_current(core_affinity::CoreId { id: core })
    {
        return Err(format!("it cannot be bound to core {core}"));
    }
    if let Some(priority) = worker.priority {
        use thread_priority::{
            RealtimeThreadSchedulePolicy, ThreadPriority, ThreadPriorityValue, ThreadSchedulePolicy,
            set_thread_priority_and_policy, thread_native_id,
        };
        let value = ThreadPriorityValue::try_from(priority).map_err(|error| error.to_string())?;
        let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
        set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Crossplatform(value), policy)
            .map_err(|error| format!("it cannot have the priority {priority}: {error:?}"))?;
    }
    Ok(())
}

#[cfg(not(feature = "realtime"))]
fn set_up(worker: WorkerDeclaration) -> Result<(), String> {
    if worker.core.is_some() || worker.priority.is_some() {
        return Err("`priority` and `core` need the feature `realtime` of bb-core".into());
    }
    Ok(())
}
