//! What all components of one run share.

use super::agenda::Agenda;
use super::bus::{Bus, Directory};
use super::error::Faults;
use super::supervision::{Failures, Supervision, Supervisor, Supervisors, Verdict};
use super::{Robot, StartError, StopSignal, caught};
use crate::component::{Fault, Options, Then};
use crate::control::{Binding, Control, ParameterValues};
use crate::journal::{Event, Journal};
use crate::message::{Origin, Payload, Stamped};
use crate::node::{HealthTransition, SharedNode};
use crate::pubsub::DynamicMessage;
use crate::time::{Clock, MonotonicTime};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// What the components of a robot are started with, and report to while they run.
#[derive(Clone, Debug)]
pub struct Startup {
    pub(super) clock: Clock,
    pub(super) origin: Origin,
    pub(super) stop: StopSignal,
    pub(super) faults: Faults,
    pub(super) control: Control,
    agenda: Agenda,
    supervisors: Supervisors,
    nodes: Arc<[SharedNode]>,
    periodic: Periodic,
    journal: Option<Journal>,
    /// Whether a journal is replayed: nothing is opened that reaches the world.
    is_replay: bool,
    /// The line of the journal that is replayed.
    replayed_line: Arc<AtomicU64>,
    /// The first component that could not start; those behind it are not started any more.
    refusal: Arc<Mutex<Option<StartError>>>,
}

/// Sensors and what else is called at a rate: who looks after each, and whether it is to be started anew.
type Periodic = Arc<Mutex<Vec<(Supervisor, Arc<AtomicBool>)>>>;

impl Startup {
    pub(super) fn new<R: Robot>(clock: Clock, origin: Origin, control: Control, supervision: Supervision) -> Self {
        Self {
            clock,
            origin,
            stop: StopSignal::default(),
            faults: Faults::default(),
            control,
            agenda: Agenda::default(),
            supervisors: Supervisors::new(R::TOPOLOGY, supervision),
            nodes: R::ESTIMATORS
                .iter()
                .enumerate()
                .map(|(number, declared)| SharedNode::new(number, declared))
                .collect(),
            periodic: Periodic::default(),
            journal: None,
            is_replay: false,
            replayed_line: Arc::default(),
            refusal: Arc::default(),
        }
    }

    /// Makes a component with validated options, unless another one could not start; if it cannot start either, that is
    /// kept. The error says why it does not run.
    pub(crate) fn make<O: Options, C>(
        &self,
        path: &'static str,
        options: &O,
        binding: Binding<O>,
        make: impl FnOnce(O) -> Result<C, Fault>,
    ) -> Result<C, String> {
        let mut refusal = self.refusal.lock().unwrap_or_else(PoisonError::into_inner);
        if refusal.is_some() {
            return Err("the robot does not start".into());
        }
        let made = self.bound(options, binding);
        let made = made.and_then(|options| caught(|| make(options)).map_err(|failed| failed.fault));
        made.map_err(|fault| {
            let reason = fault.to_string();
            if fault.then == Then::Skip {
                tracing::info!(component = path, reason, "left out");
            } else {
                *refusal = Some(StartError::component(path, fault));
            }
            reason
        })
    }

    /// Options with the values that parameters have now, validated.
    pub(crate) fn bound<O: Options>(&self, options: &O, binding: Binding<O>) -> Result<O, Fault> {
        binding.bound(options, &self.control.parameters()).map_err(Fault::new)
    }

    /// Has `notify` called when a parameter has changed that these options are bound to. A value with which they would not
    /// be valid is refused.
    pub(crate) fn bind<O: Options>(
        &self,
        path: &'static str,
        options: &O,
        binding: Binding<O>,
        notify: impl Fn() + Send + 'static,
    ) {
        if !binding.parameters.is_empty() {
            let options = options.clone();
            let check = move |values: &ParameterValues| binding.bound(&options, values).map(drop);
            self.control.bind(path, binding.parameters, check, notify);
        }
    }

    /// The same for an estimator, which is told through its node.
    pub(crate) fn bind_node<O: Options>(&self, node: &SharedNode, options: &O, binding: Binding<O>) {
        let (node, agenda, clock) = (node.clone(), self.agenda.clone(), self.clock.clone());
        self.bind(node.declaration().path, options, binding, move || {
            node.change_options();
            agenda.wake_at(clock.now(), node.declaration().island);
        });
    }

    /// What kept the robot from starting, if anything did.
    pub(super) fn refusal(&self) -> Option<StartError> {
        self.refusal.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    /// Has `supervisor` look after a sensor or a service; true in the flag asks for a restart.
    pub(super) fn look_after(&self, supervisor: Supervisor) -> Arc<AtomicBool> {
        let flag = Arc::new(AtomicBool::new(false));
        self.periodic().push((supervisor, Arc::clone(&flag)));
        flag
    }

    /// Takes the failure of a component: what its supervisor decides is carried out. When it is made anew, if it is.
    /// `is_outside`: it is no estimator, so that a journal cannot know of it otherwise.
    pub(crate) fn failed(
        &self,
        failures: &mut Failures,
        supervisor: Supervisor,
        path: &'static str,
        now: MonotonicTime,
        is_outside: bool,
    ) -> Option<MonotonicTime> {
        if let Some(journal) = self.journal.as_ref().filter(|_| is_outside) {
            journal.write(now, Event::Failed { supervisor, path });
        }
        let at = self.supervisors.restart_at(failures, now);
        let verdict = self.supervisors.failed(supervisor, now);
        self.carry_out(verdict, path, now);
        (verdict != Verdict::GiveUp).then_some(at)
    }

    /// Does what a supervisor has decided after a failure at `path`, beyond that component's own restart.
    pub(crate) fn carry_out(&self, verdict: Verdict, path: &'static str, now: MonotonicTime) {
        match verdict {
            Verdict::Restart => {}
            Verdict::RestartAll(above) => {
                tracing::warn!(component = path, "failed too often: everything beside it starts anew");
                for node in self.nodes.iter().filter(|node| node.declaration().path != path) {
                    if self.supervisors.is_below(node.declaration().supervisor, above) {
                        node.restart();
                        self.agenda.wake_at(now, node.declaration().island);
                    }
                }
                let periodic = self.periodic();
                let below = periodic.iter().filter(|(supervisor, _)| self.supervisors.is_below(*supervisor, above));
                below.for_each(|(_, flag)| flag.store(true, Ordering::Release));
            }
            Verdict::GiveUp => self.control.give_up(path),
        }
    }

    /// Publishes a change of health and starts its command, if it has one.
    pub(crate) fn health_changed(&self, transition: HealthTransition, command: Option<usize>) {
        self.control.health_changed(transition, command);
    }

    /// Reports what went wrong with a component.
    pub(crate) fn fault(&self, path: &'static str, fault: &Fault) {
        self.faults.add(path, fault.to_string());
    }

    pub(crate) fn node(&self, number: usize) -> SharedNode {
        match self.nodes.get(number) {
            Some(node) => node.clone(),
            // Numbers and declarations come from one expansion.
            None => SharedNode::new(usize::MAX, &crate::node::EstimatorDeclaration::NONE),
        }
    }

    pub(crate) fn nodes(&self) -> &[SharedNode] {
        &self.nodes
    }

    pub(crate) fn supervisors(&self) -> &Supervisors {
        &self.supervisors
    }

    pub(crate) fn agenda(&self) -> &Agenda {
        &self.agenda
    }

    pub(crate) fn clock(&self) -> &Clock {
        &self.clock
    }

    pub(crate) fn robot(&self) -> &'static str {
        self.origin.robot
    }

    pub(crate) fn origin(&self) -> Origin {
        self.origin
    }

    fn periodic(&self) -> std::sync::MutexGuard<'_, Vec<(Supervisor, Arc<AtomicBool>)>> {
        self.periodic.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Says where topics and actuators are, once they are made.
    pub(super) fn set_directory(&self, directory: Arc<dyn Directory>) {
        self.control.set_directory(directory);
    }

    pub(super) fn bus(&self) -> Bus {
        Bus::new(self.control.clone())
    }

    pub(super) fn with_journal(mut self, journal: Option<Journal>) -> Self {
        self.journal = journal;
        self
    }

    pub(super) fn for_replay(mut self) -> Self {
        self.is_replay = true;
        self
    }

    pub(super) fn replay_line(&self, line: u64) {
        self.replayed_line.store(line, Ordering::Relaxed);
    }

    pub(super) fn is_replay(&self) -> bool {
        self.is_replay
    }

    /// Where the journal is written, if it is.
    #[inline]
    pub fn journal(&self) -> Option<&Journal> {
        self.journal.as_ref()
    }

    /// Writes into the journal, if there is one, what a sensor or a service publishes; the number of the line, or 0.
    #[inline]
    pub fn write<T: Payload>(
        &self,
        publisher: usize,
        path: &'static str,
        message: &Stamped<T>,
        now: MonotonicTime,
    ) -> u64 {
        match &self.journal {
            None => self.replayed_line.load(Ordering::Relaxed),
            Some(journal) => {
                let message = DynamicMessage::new(path, message);
                journal.write(now, Event::Message { publisher, message })
            }
        }
    }

    /// Counts a message that did not fit in the inbox of an estimator's island.
    pub fn overflow(&self, estimator: usize, input: usize) {
        if let Some(node) = self.nodes.get(estimator) {
            node.overflow(input);
        }
    }
}
