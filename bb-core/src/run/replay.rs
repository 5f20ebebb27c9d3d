//! A run from a journal.

mod comparing;
mod cut;
mod publishing;

use self::publishing::handed_out;
use super::describe::difference;
use super::machine::Machine;
use super::source::AnySource;
use super::visit::Visitable;
use super::{Live, Report, Robot};
use crate::component::{Caller, HandleCall, HandleCast};
use crate::declaration::ParameterValues;
use crate::fault::{caught, discard};
use crate::joints::PlacedInput;
use crate::journal::{Callback, Entry, Event, Publishers, Request};
use crate::node::{Key, Missing, NodeEntry, Replayed, know_calls, know_casts};
use crate::pubsub::AnyTopic;
use crate::time::MonotonicTime;
use bb_message::__private::Sorted;
use std::collections::{HashMap, VecDeque};
use std::fmt;
use std::ops::Deref;
use std::sync::Arc;

/// A robot replayed from its journal, on the caller's thread. Subscribers receive the messages of that run.
pub struct Replay<R: Robot> {
    run: Replayer,
    live: Live<R>,
}

/// A run from a journal, without the type of its robot.
struct Replayer {
    machine: Arc<Machine>,
    /// The sensors and services, by publisher.
    sources: Sorted<usize, Box<dyn AnySource>>,
    /// Lines not played yet: the line of a measured turn waits for the line with the durations of its callbacks.
    waiting: VecDeque<Entry>,
    measured: HashMap<u64, Vec<Callback>>,
    placed: HashMap<u64, Vec<PlacedInput>>,
    /// The number of the last line that was handed over.
    last: u64,
    has_begun: bool,
    /// The last request to each island that the journal does not hold, by line and type.
    unrecorded: Sorted<usize, (u64, String)>,
    /// Turns that had not ended when the journal ended.
    cut: Vec<ReplayError>,
    /// Reason for which nothing more is played.
    refused: Option<ReplayError>,
}

/// Reason for which a journal cannot be replayed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReplayError {
    /// The number of the line.
    pub line: u64,
    /// Fault of the line.
    pub message: String,
}

impl<R: Robot> Replay<R> {
    pub(super) fn new(live: Live<R>) -> Self {
        Self { run: Replayer::new(Arc::clone(&live.machine)), live }
    }

    /// Replays lines, in the order of their numbers. A journal may be handed over in parts. The last lines of a part
    /// wait for the next part, or for [`Self::stop`], if their replay depends on lines that follow.
    ///
    /// # Errors
    /// The first line that does not fit: the journal is of another robot, lines are missing, or an algorithm is not
    /// deterministic. Nothing is played after it: later calls return the same error, and it is among the faults of the last report.
    pub fn play(&mut self, entries: Vec<Entry>) -> Result<(), ReplayError> {
        self.run.play(entries)
    }

    /// Lets calls of type `Q` to an estimator be repeated. Needed for journals of another process; requests made by
    /// this process are known.
    pub fn know_calls<V: Visitable<R>, Q>(&self, _: V)
    where
        V::Estimator: HandleCall<Q>,
    {
        know_calls::<V::Estimator, Q>();
    }

    /// Lets one-way requests of type `Q` to an estimator be repeated, as [`Self::know_calls`] does calls.
    pub fn know_casts<V: Visitable<R>, Q>(&self, _: V)
    where
        V::Estimator: HandleCast<Q>,
    {
        know_casts::<V::Estimator, Q>();
    }

    /// Plays the waiting lines, stops the robot, and returns the last report. Lines that do not fit are among its
    /// faults. So is a line at which the journal is cut: the turn that it begins had not ended, and is replayed as
    /// far as the journal goes.
    pub fn stop(mut self) -> Report {
        self.run.stop();
        self.live.report()
    }
}

impl Replayer {
    fn new(machine: Arc<Machine>) -> Self {
        Self {
            waiting: VecDeque::new(),
            measured: HashMap::new(),
            placed: HashMap::new(),
            last: 0,
            sources: machine.wired.sources().by_publisher(),
            has_begun: false,
            unrecorded: Sorted::default(),
            cut: Vec::new(),
            refused: None,
            machine,
        }
    }

    fn play(&mut self, entries: Vec<Entry>) -> Result<(), ReplayError> {
        if let Some(refused) = &self.refused {
            return Err(refused.clone());
        }
        self.play_on(entries).inspect_err(|error| {
            self.refused = Some(error.clone());
            self.waiting.clear();
        })
    }

    fn play_on(&mut self, mut entries: Vec<Entry>) -> Result<(), ReplayError> {
        entries.sort_by_key(|entry| entry.number);
        for entry in entries {
            let line = entry.number;
            if line != self.last + 1 {
                let message = format!("it follows line {}; the lines between are missing", self.last);
                // The lines before it are still played.
                self.advance(true)?;
                return Err(ReplayError { line, message });
            }
            self.last = line;
            if let Event::Measured { cause, callbacks } = &entry.event {
                self.measured.insert(*cause, callbacks.clone());
            }
            if let Event::Placed { cause, inputs } = &entry.event {
                self.placed.insert(*cause, inputs.clone());
            }
            self.waiting.push_back(entry);
        }
        self.advance(false)
    }

    fn stop(&mut self) {
        let refused = self.refused.take().or_else(|| self.advance(true).err());
        for error in self.cut.drain(..).chain(refused) {
            self.machine.fault("journal", error.to_string());
        }
        let machine = &self.machine;
        machine.control.replay_stop(Caller::PROGRAM.name().to_owned());
        if machine.control.is_disarming() {
            machine.control.disarmed(Vec::new());
        }
        self.machine.retire_quietly();
        machine.end(std::time::Instant::now());
    }

    /// Plays waiting lines, up to one whose turn may go on in lines to come unless it is to be the end.
    fn advance(&mut self, to_the_end: bool) -> Result<(), ReplayError> {
        while let Some(entry) = self.waiting.front() {
            if !to_the_end && self.is_open(entry) {
                return Ok(());
            }
            let Some(entry) = self.waiting.pop_front() else { return Ok(()) };
            let line = entry.number;
            if let Err(message) = self.line(entry) {
                // The consequences of a turn that the journal cuts are in the journal, and are not repeated now.
                if !self.cut.is_empty() {
                    self.waiting.clear();
                    return Ok(());
                }
                return Err(ReplayError { line, message });
            }
        }
        Ok(())
    }

    /// The estimator that a publisher belongs to, and its island.
    fn emitter(&self, publisher: usize) -> Option<(usize, usize)> {
        let path = self.path_of(publisher);
        let number = self.machine.robot.estimators.iter().position(|declared| declared.outputs.contains(&path))?;
        Some((number, self.machine.robot.estimators[number].island))
    }

    /// The island that processes a line.
    fn island_of(&self, event: &Event) -> Option<usize> {
        match event {
            Event::Deliver { island, .. }
            | Event::Start { island }
            | Event::Wake { island }
            | Event::Retire { island } => Some(*island),
            Event::Options { estimator, .. }
            | Event::Restart { estimator }
            | Event::GiveUp { estimator }
            | Event::Silence { estimator, .. }
            | Event::Request { estimator, .. } => {
                self.machine.robot.estimators.get(*estimator).map(|declared| declared.island)
            }
            _ => None,
        }
    }

    /// Plays a line. If the journal is cut in that line's turn, it lacks some of the data that the estimators ask
    /// for.
    fn line(&mut self, entry: Entry) -> Result<(), String> {
        let Entry { number, time, event } = entry;
        if !self.has_begun {
            return self.begin(time, event);
        }
        let island = self.island_of(&event);
        let is_whole = island.is_none_or(|island| self.prepare(island, number));
        self.play_event(number, time, event)?;
        match self.machine.environment.replayed().take_missing() {
            None => Ok(()),
            Some(Missing { estimator, what }) if is_whole => {
                // An estimator before it may have emitted something else, which is the cause.
                if let Some(island) = island {
                    self.compare_outputs_of(island)?;
                }
                Err(format!(
                    "`{estimator}` asks {what}, and did not then: the algorithm is not deterministic{}",
                    island.map_or_else(String::new, |island| self.hint(island))
                ))
            }
            Some(Missing { estimator, what }) => {
                let message = format!("the journal is cut here: it does not say {what} for `{estimator}`");
                self.cut.push(ReplayError { line: number, message });
                Ok(())
            }
        }
    }

    fn play_event(&mut self, number: u64, time: MonotonicTime, event: Event) -> Result<(), String> {
        let machine = Arc::clone(&self.machine);
        let control = &machine.control;
        machine.environment.clock().set_to(time);
        // Subscribers wait for messages of the run at the same times.
        while control.wake_sleepers(time) {}
        match event {
            Event::Begin { .. } => return Err("the journal begins again".to_owned()),
            Event::WallClock { offset_nanos } => machine.environment.clock().set_wall_offset_nanos(offset_nanos),
            Event::Message { publisher, message } => {
                let message = self.message(publisher, message)?;
                machine.environment.set_replayed_line(number);
                let mut is_fed = true;
                let source = self.sources.get(&publisher);
                handed_out(|| is_fed = source.is_some_and(|source| source.feed(&message, time)));
                discard(message);
                if !is_fed {
                    return Err("the robot has no such sensor, or one of another payload".to_owned());
                }
            }
            Event::Own { path, message } => self.publish_own(path, time, message)?,
            // Who has published changes nothing.
            Event::Publisher { .. } => {}
            Event::OwnPublisher { path, payload } => control.topics().registry.expect(path, payload),
            Event::Actuated { actuator, message } => self.actuated(actuator, message)?,
            Event::Deliver { island, entry, message } => {
                self.island(island, time, Replayed::Deliver(Key { entry, line: message }))?;
            }
            Event::Drop { island, entry, message } => {
                self.island(island, time, Replayed::Drop(Key { entry, line: message }))?;
            }
            Event::Start { island } => self.island(island, time, Replayed::Start)?,
            Event::Wake { island } => self.island(island, time, Replayed::Wake)?,
            Event::Retire { island } => self.island(island, time, Replayed::Retire)?,
            Event::Options { estimator, values } => {
                self.node(estimator, time, NodeEntry::Options(ParameterValues::new(values)))?;
            }
            Event::Restart { estimator } => self.node(estimator, time, NodeEntry::Restart)?,
            Event::GiveUp { estimator } => self.node(estimator, time, NodeEntry::GiveUp)?,
            Event::Silence { estimator, epoch, last_run } => {
                self.node(estimator, time, NodeEntry::Silence { epoch, last_run })?;
            }
            Event::Request { estimator, request } => self.request(number, estimator, time, request)?,
            Event::Measured { .. } | Event::Placed { .. } => {}
            Event::Output { island, publisher, checksum } => self.compare(island, publisher, checksum)?,
            Event::Emission { publisher, is_first, message } => self.emit(publisher, is_first, time, message)?,
            Event::Report { estimator } => {
                if !control.replay_report(estimator) {
                    let declared = self.machine.robot.estimators.get(estimator);
                    let path = declared.map_or("?", |declared| declared.path);
                    let hint = declared.map_or_else(String::new, |declared| self.hint(declared.island));
                    return Err(format!(
                        "`{path}` reported a change of health or a failure then, and does not now{hint}"
                    ));
                }
            }
            Event::Lost { estimator, last_run } => control.replay_lost(estimator, last_run),
            Event::Failed { path, supervisor, message, panicked } => {
                control.component_failed(path, supervisor, message, panicked);
            }
            Event::Noted { path, message } => drop(control.note_fault(path, message)),
            Event::HardwareError { path, error } => control.note_hardware_error(path, error),
            Event::Parameters { changes, caller } => control.replay_parameters(changes, &caller),
            Event::Command { command, caller } => control.replay_command(command, caller),
            Event::Ended { execution, end } => control.replay_end(execution, end),
            Event::Transition { execution, state } => control.replay_transition(execution, &state),
            Event::Cancel { execution } => control.cancel_execution(execution),
            Event::Timeout { execution } => control.timed_out(execution),
            Event::Gone { execution } => control.future_dropped(execution),
            Event::Arm { caller } => control.replay_arm(caller),
            Event::Disarm { force, caller } => control.replay_disarm(force, caller),
            Event::Disarmed { errors } => control.disarmed(errors),
            Event::ArmTimeout => control.arm_timeout(),
            Event::Stop { caller } => control.replay_stop(caller),
        }
        // The journal says when islands wake.
        while machine.environment.agenda().take(MonotonicTime::MAX).is_some() {}
        Ok(())
    }

    fn begin(&mut self, time: MonotonicTime, event: Event) -> Result<(), String> {
        let Event::Begin { declaration, wall_offset_nanos, .. } = event else {
            return Err("a journal begins with a description of the robot, and this one does not".to_owned());
        };
        let machine = &self.machine;
        if let Some(difference) = difference(&declaration, &machine.environment.all_facts()) {
            return Err(difference);
        }
        self.has_begun = true;
        machine.environment.clock().set_to(time);
        machine.environment.clock().set_wall_offset_nanos(wall_offset_nanos);
        machine.islands().for_each(|island| island.begin_replay());
        match machine.environment.take_refusal() {
            Some(refusal) => Err(format!("{} cannot start: {}", refusal.path, refusal.fault)),
            None => Ok(()),
        }
    }

    fn island(&self, number: usize, time: MonotonicTime, entry: Replayed<'_>) -> Result<(), String> {
        // A message may be dropped while a turn lasts, before its outputs.
        if !matches!(entry, Replayed::Drop(_)) {
            self.no_more_outputs_of(number)?;
        }
        self.go_on(number, time, entry)
    }

    /// Hands over an entry that belongs to the previous turn.
    fn go_on(&self, number: usize, time: MonotonicTime, entry: Replayed<'_>) -> Result<(), String> {
        let machine = &self.machine;
        let island = machine.island(number).ok_or("the robot has no such island")?;
        let replayed = caught(|| Ok(island.replay(time, entry)));
        if replayed.map_err(|failed| failed.fault.to_string())? {
            return Ok(());
        }
        Err("no such message waits: it is of another robot, or lines are missing".to_owned())
    }

    fn node(&self, estimator: usize, time: MonotonicTime, entry: NodeEntry) -> Result<(), String> {
        let declared = self.machine.robot.estimators.get(estimator).ok_or("the robot has no such estimator")?;
        self.island(declared.island, time, Replayed::Node(estimator, entry))
    }

    fn request(
        &mut self,
        line: u64,
        estimator: usize,
        time: MonotonicTime,
        request: Request,
    ) -> Result<(), String> {
        let declared = self.machine.robot.estimators.get(estimator).ok_or("the robot has no such estimator")?;
        if request.bytes.is_none() {
            self.unrecorded.insert(declared.island, (line, request.name.clone()));
            // Its outputs come before anything else that was due in that turn.
            let mut has_emitted = false;
            while let Some(next) = self.next_of(declared.island, 0)
                && matches!(self.waiting[next].event, Event::Emission { .. })
                && let Some(entry) = self.waiting.remove(next)
                && let Event::Emission { publisher, is_first, message } = entry.event
            {
                self.emit(publisher, is_first, entry.time, message)?;
                has_emitted = true;
            }
            if has_emitted {
                let entry = NodeEntry::Cast { request, handle: None };
                return self.go_on(declared.island, time, Replayed::Node(estimator, entry));
            }
        }
        self.island(declared.island, time, Replayed::Node(estimator, NodeEntry::Cast { request, handle: None }))
    }

    fn path_of(&self, publisher: usize) -> &'static str {
        let topics = self.machine.wired.topics();
        topics.get(publisher).map_or("?", |topic| topic.path())
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

impl<R: Robot> Publishers for R {
    type Topics = R::Topics;

    fn make_topics() -> R::Topics {
        R::topics()
    }

    fn list_topics(topics: &R::Topics) -> Vec<&dyn AnyTopic> {
        (0..).map_while(|publisher| R::topic(topics, publisher)).collect()
    }
}
