//! Entries for an estimator other than messages.

use super::common::Common;
use super::{Next, Node, Turn};
use crate::component::{Estimator, HandleCall, HandleCast, Reply, RequestCodec};
use crate::fault::{Failed, Fault, Termination};
use crate::journal::{Request, RequestKind};
use crate::message::Stamp;
use crate::node::act::Act;
use crate::node::entry::NodeEntry;
use crate::node::health::Event as HealthEvent;
use crate::node::requests::{Cast, find};
use crate::pubsub::DynamicMessage;
use crate::time::MonotonicTime;
use std::any::Any;

impl<E: Estimator> Node<E> {
    /// Performs an act, or does one thing that is due. `emitted_at` emits a recorded message alone at the output with that number.
    pub(crate) fn step(
        &mut self,
        act: Option<Act<'_, '_>>,
        emitted_at: fn(usize, &DynamicMessage) -> Option<E::Output>,
        turn: &Turn<'_>,
        emitted: &mut Option<E::Output>,
    ) -> Next {
        match act {
            None | Some(Act::Turn(_)) => self.turn(turn, emitted),
            Some(Act::Handle(entry, _)) => self.handle(entry, turn, emitted),
            Some(Act::Visit(visit, _)) => visit(self, turn, emitted).map_or(Next::Quiet, Next::Emitted),
            Some(Act::Emit(message, _)) => {
                let output = self.common.declaration.outputs.iter().position(|output| *output == message.path());
                *emitted = output.and_then(|output| emitted_at(output, message));
                if emitted.is_some() { Next::Emitted(message.stamp()) } else { Next::Idle }
            }
            Some(Act::BeginReplay) => Next::Idle,
        }
    }

    /// Handles an entry. Anything that becomes due is left to [`Self::turn`].
    fn handle(&mut self, entry: NodeEntry, turn: &Turn<'_>, emitted: &mut Option<E::Output>) -> Next {
        match entry {
            NodeEntry::Start => self.common.begin_life(turn),
            NodeEntry::Options(values) => {
                self.common.parameters = values;
                return self.change_options(turn, emitted);
            }
            NodeEntry::Restart => {
                let ended = self.end(turn, emitted);
                self.restart_from_above(Termination::Supervisor, turn);
                return ended;
            }
            NodeEntry::GiveUp => {
                self.slot.give_up();
                if self.slot.restart_at().is_none() && !self.slot.is_running() {
                    self.drop_backlog();
                    if let Some(stopped) = self.common.shared.stopped() {
                        self.common.set_stopped(Some((stopped.reason, true)));
                    }
                }
            }
            NodeEntry::Silence { epoch, last_run } => self.common.note_silence(epoch, last_run, turn),
            NodeEntry::Cast { request, handle } => {
                self.common.shared.end_cast();
                let handle = match handle {
                    Some(handle) => handle.downcast::<Cast<E>>().ok().map(|handle| *handle),
                    None => Self::replayed(&request),
                };
                // Any entry ends the timeout.
                let handle = handle.unwrap_or_else(|| Box::new(|_| Ok(Reply::none())));
                let declaration = self.common.declaration;
                return self.run(turn, emitted, |estimator| {
                    if request.bytes.is_none() {
                        turn.set_unrecorded(declaration);
                    }
                    estimator.declared().map_or_else(|| Ok(Reply::none()), handle)
                });
            }
            NodeEntry::Retire => {
                let ended = self.end(turn, emitted);
                self.retire();
                return ended;
            }
        }
        Next::Quiet
    }

    /// Stops the estimator for good, and drops the messages that it keeps.
    fn retire(&mut self) {
        if let Some(fault) = self.slot.retire(Termination::Stop) {
            let failed = Failed::from(fault);
            self.common.report_failure(&failed);
            self.common.set_stopped(Some((failed.fault.to_string(), true)));
        }
        self.slot.stop();
        self.drop_backlog();
        self.cache = (self.make_cache)();
    }

    /// A request from a journal, if this process can decode it.
    fn replayed(request: &Request) -> Option<Cast<E>> {
        let handle = find::<E>(request.kind, &request.name)?;
        let bytes = request.bytes.clone()?;
        Some(Box::new(move |estimator| handle(estimator, &bytes)))
    }

    /// Creates the estimator in a replay, when the journal begins.
    pub fn begin_replay(&mut self) {
        self.make_first(self.common.environment.clock().now());
    }

    /// Answers a request: puts the answer into `response`, unless the estimator fails at it. Returns the stamp of the output put into
    /// `emitted`, if any.
    pub(crate) fn call<Q>(
        &mut self,
        request: Q,
        is_unrecorded: bool,
        turn: &Turn<'_>,
        emitted: &mut Option<E::Output>,
        response: &mut Option<Result<E::Response, Fault>>,
    ) -> Option<Stamp>
    where
        E: HandleCall<Q>,
    {
        let declaration = self.common.declaration;
        if self.slot.running().is_none_or(|estimator| estimator.declared().is_none()) {
            *response = Some(Err(Fault::new(format!("{} does not run", declaration.path))));
            return None;
        }
        let next = self.run(turn, emitted, |estimator| {
            if is_unrecorded {
                turn.set_unrecorded(declaration);
            }
            let Some(estimator) = estimator.declared() else { return Ok(Reply::none()) };
            let (answer, reply) = estimator.handle_call(request)?;
            *response = Some(Ok(answer));
            Ok(reply)
        });
        match next {
            Next::Emitted(stamp) => Some(stamp),
            Next::Idle | Next::Quiet => None,
        }
    }

    /// A waiting one-way request of type `Q`, with its bytes for the journal.
    pub(crate) fn cast<Q: Send + 'static>(request: Q) -> (Request, Box<dyn Any + Send>)
    where
        E: HandleCast<Q>,
    {
        let recorded = RequestCodec::record(RequestKind::Cast, <E as HandleCast<Q>>::RECORD, &request);
        let cast: Cast<E> = Box::new(|estimator| estimator.handle_cast(request));
        (recorded, Box::new(cast))
    }
}

impl Common {
    /// Notes that the estimator is lost, which the control state has already published.
    fn note_silence(&mut self, epoch: u32, last_run: MonotonicTime, turn: &Turn<'_>) {
        self.epoch = epoch;
        let _ = self.health.on(HealthEvent::Silence, self.declaration.health.recover_after);
        if self.shared.last_run() > last_run {
            let source = self.declaration.driver().map_or(self.declaration.path, |driver| driver.source);
            self.judge(HealthEvent::Run, source, turn.now());
            if self.was_good {
                self.judge(HealthEvent::Good, source, turn.now());
            }
        } else if let Some((input, reason)) = self.shared.counters().last_drop(self.declaration) {
            let (estimator, reason) = (self.declaration.path, reason.name());
            tracing::info!(estimator, input, reason, "lost; its last message was dropped");
        }
    }
}
