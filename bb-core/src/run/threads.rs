//! The threads of a robot that runs in real time: one for each sensor and service, one for each estimator with
//! `runs_on: worker`, and one that keeps time. The pool's threads run the rest.

use super::StartError;
use super::machine::Machine;
use super::source::Source;
use super::timekeeper::keep_time;
use crate::component::Fault;
use crate::control::Control;
use crate::declaration::WorkerDeclaration;
use crate::fault::guarded;
use crate::schedule::start_thread;
use crate::time::MonotonicTime;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// A thread, by the path of what it runs.
pub(super) type Thread = (&'static str, JoinHandle<()>);

/// Starts the threads that run until the robot stops.
pub(super) fn serve(machine: &Arc<Machine>) -> Result<(), StartError> {
    for (number, island) in machine.islands().enumerate() {
        let Some(worker) = island.declaration().worker else { continue };
        let name = island.declaration().name;
        let served = Arc::clone(machine);
        island.give_to_worker();
        spawn(name, move || {
            if let Err(message) = set_up(worker) {
                served.control.log(|| tracing::warn!(estimator = name, message, "its thread runs as any other"));
                served.fault(name, format!("its thread runs as any other: {message}"));
            }
            while let Some(island) = served.island(number).filter(|island| !island.has_retired()) {
                // A panic not caught for any component, for example in a payload's code, must not end a thread that serves others.
                if let Err(fault) = guarded(|| island.serve()) {
                    served.fault(name, fault.to_string());
                }
            }
        })?;
    }
    let kept = Arc::clone(machine);
    spawn("timekeeper", move || keep_time(&kept))?;
    Ok(())
}

pub(super) fn source(mut source: Box<dyn Source>, machine: &Machine) -> Result<Thread, StartError> {
    let environment = machine.environment.clone();
    let stop = machine.control.stop_signal().clone();
    let control = machine.control.clone();
    spawn(source.path(), move || {
        let _finished = Finished(control.clone());
        source.shared().adopt();
        stop.register();
        let path = source.path();
        let read = guarded(|| {
            source.begin();
            while let Some(due) = source.due() {
                let wait = due.duration_since(environment.clock().now());
                if !wait.is_zero() {
                    stop.sleep(wait);
                }
                if stop.is_set() {
                    break;
                }
                if due <= environment.clock().now() {
                    source.fire();
                } else {
                    // Woken before its time, to carry out a request.
                    source.obey();
                }
            }
        });
        if let Err(fault) = read {
            control.note_fault(path, fault.to_string());
        }
        source.terminate();
    })
}

/// Counts a sensor or service as finished when its thread ends, however that ends.
struct Finished(Control);

impl Drop for Finished {
    fn drop(&mut self) {
        self.0.end_source();
    }
}

/// Waits for the thread until `deadline`; the error says what went wrong.
pub(super) fn join(thread: JoinHandle<()>, deadline: Instant) -> Result<(), &'static str> {
    if thread.thread().id() == std::thread::current().id() {
        return Err("has stopped the robot itself, and cannot be waited for");
    }
    while !thread.is_finished() {
        if Instant::now() >= deadline {
            return Err("did not come back from its read, or from an estimator downstream, in time");
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    thread.join().map_err(|_| "its thread panicked")
}

/// Returns the time since a source that did not return was entered, in words.
pub(super) fn since(entered_at: Option<MonotonicTime>, now: MonotonicTime) -> String {
    let entered = entered_at.map(|at| format!("; its code was entered {:.1?} ago", now.duration_since(at)));
    entered.unwrap_or_default()
}

fn spawn(path: &'static str, run: impl FnOnce() + Send + 'static) -> Result<Thread, StartError> {
    match start_thread(path, Box::new(run)) {
        Ok(thread) => Ok((path, thread)),
        Err(error) => Err(StartError::component(path, Fault::from(error))),
    }
}

/// Sets priority and core of the calling thread.
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
