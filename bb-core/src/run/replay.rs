//! A run from a journal.

use super::machine::Machine;
use super::{Live, Report, Robot};
use crate::control::{SafetyError, Setter};
use crate::journal::{Entry, Event};
use crate::node::Key;
use std::collections::HashMap;
use std::fmt;
use std::ops::Deref;
use std::sync::Arc;
use std::time::Duration;

/// A robot that is run again from its journal, on the caller's thread. Whoever subscribes gets what was published then,
/// bit for bit.
pub struct Replay<R: Robot> {
    live: Live<R>,
    /// The number of the last line.
    last: u64,
}

/// Why a journal cannot be replayed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReplayError {
    /// The number of the line.
    pub line: u64,
    /// What is wrong with it.
    pub message: String,
}

impl<R: Robot> Replay<R> {
    pub(super) fn new(machine: Machine<R>) -> Self {
        (0..R::ISLANDS.len()).filter_map(|number| machine.island(number)).for_each(|island| island.begin_replay());
        Self { live: Live(Arc::new(machine)), last: 0 }
    }

    /// Replays lines, in the order of their numbers. A journal may be handed over in parts; a callback that took too long
    /// does so again if its line and the one that says so are in the same part.
    ///
    /// # Errors
    /// The first line that does not fit this robot; it was made by another one, or lines are missing.
    pub fn play(&mut self, mut entries: Vec<Entry>) -> Result<(), ReplayError> {
        entries.sort_by_key(|entry| entry.number);
        let mut overruns: HashMap<u64, Vec<usize>> = HashMap::new();
        let mut answers: HashMap<u64, Vec<SafetyError>> = HashMap::new();
        for entry in &entries {
            match &entry.event {
                Event::Overrun { cause, estimator } => overruns.entry(*cause).or_default().push(*estimator),
                Event::Unsafe { cause, errors } => drop(answers.insert(*cause, errors.clone())),
                _ => {}
            }
        }
        for entry in entries {
            let slow = overruns.get(&entry.number).map_or(&[][..], Vec::as_slice);
            let line = entry.number;
            if line != self.last + 1 {
                let message = format!("it follows line {}; the lines between are missing", self.last);
                return Err(ReplayError { line, message });
            }
            self.last = line;
            self.live.0.startup.control.replay_answer(answers.remove(&line));
            self.line(entry, slow).map_err(|message| ReplayError { line, message: message.to_owned() })?;
        }
        Ok(())
    }

    /// Stops it, and gives the last report.
    pub fn stop(self) -> Report {
        self.live.0.terminate(Duration::ZERO);
        self.live.report()
    }

    fn line(&self, entry: Entry, slow: &[usize]) -> Result<(), &'static str> {
        const MISSING: &str = "no such message waits: it is of another robot, or lines are missing";
        let Entry { number, time, event } = entry;
        let machine = &self.live.0;
        let startup = &machine.startup;
        startup.clock.advance_to(time);
        let island = |number| machine.island(number).ok_or("the robot has no such island");
        match event {
            Event::Message { publisher, message } => {
                let feed = R::FEEDS.get(publisher).copied().flatten().ok_or("the robot has no such sensor")?;
                startup.replay_line(number);
                if !feed(&machine.wiring, &message, time) {
                    return Err("the sensor has another payload");
                }
            }
            Event::Deliver { island: number, entry, message } => {
                let island = island(number)?;
                let key = Key { entry, line: message };
                if !self.slowly(slow, || island.replay(&machine.wiring, key, time)) {
                    return Err(MISSING);
                }
            }
            Event::Drop { island: number, entry, message } => {
                if !island(number)?.replay_drop(&machine.wiring, Key { entry, line: message }) {
                    return Err(MISSING);
                }
            }
            Event::Wake { island: number } => {
                let island = island(number)?;
                self.slowly(slow, || island.replay_wake(&machine.wiring, time));
            }
            Event::Failed { supervisor, path } => {
                let verdict = startup.supervisors().failed(supervisor, time);
                startup.carry_out(verdict, path, time);
            }
            // What was refused then is refused again.
            Event::Parameter { parameter, value } => {
                let _ = startup.control.set_parameter(parameter, value, Setter::Outside(time));
            }
            Event::Command { command } => startup.control.replay(command, time),
            Event::Drive { health, given_up } => startup.control.replay_drive(time, &health, &given_up),
            Event::Arm => drop(startup.control.arm(time)),
            Event::Disarm { force } => drop(startup.control.disarm(force, time)),
            Event::Stop => drop(startup.control.stop(time)),
            Event::Overrun { .. } | Event::Unsafe { .. } => {}
        }
        // The journal says when islands wake.
        while startup.agenda().take(crate::time::MonotonicTime::MAX).is_some() {}
        Ok(())
    }

    /// Has some estimators overrun their budgets meanwhile.
    fn slowly<T>(&self, estimators: &[usize], call: impl FnOnce() -> T) -> T {
        let pretend = |nanos| {
            estimators.iter().for_each(|number| self.live.0.startup.node(*number).pretend_latency(nanos));
        };
        pretend(i64::MAX / 2);
        let result = call();
        pretend(0);
        result
    }
}

impl<R: Robot> Deref for Replay<R> {
    type Target = Live<R>;
    fn deref(&self) -> &Live<R> {
        &self.live
    }
}

impl<R: Robot> fmt::Debug for Replay<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Replay").field(&R::NAME).finish()
    }
}

impl fmt::Display for ReplayError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {} of the journal cannot be replayed: {}", self.line, self.message)
    }
}

impl std::error::Error for ReplayError {}
