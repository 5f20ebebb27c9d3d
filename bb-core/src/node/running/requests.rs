//! Entries for an estimator other than messages.

use super::{Next, Node, Turn};
use crate::component::RequestCodec;
use crate::component::{Estimator, HandleCall, HandleCast, Reply};
use crate::fault::{Failed, Fault};
use crate::journal::{Request, RequestKind};
use crate::message::Stamp;
use crate::node::entry::NodeEntry;
use crate::node::health::Event as HealthEvent;
use crate::node::requests::{Cast, find};
use std::any::Any;

impl<E: Estimator> Node<E> {
    /// Handles an entry. Anything that becomes due is left to [`Self::turn`].
    pub fn handle(&mut self, entry: NodeEntry, turn: &Turn<'_>, emitted: &mut Option<E::Output>) -> Next {
        match entry {
            NodeEntry::Start => self.begin(turn),
            NodeEntry::Options(values) => {
                self.parameters = values;
                self.change_options(turn);
            }
            NodeEntry::Restart => self.restart_from_above(turn),
            NodeEntry::GiveUp => {
                self.slot.give_up();
                if self.slot.restart_at().is_none() && !self.slot.is_running() {
                    self.drop_backlog();
                    if let Some(stopped) = self.shared.stopped() {
                        self.set_stopped(Some((stopped.reason, true)));
                    }
                }
            }
            NodeEntry::Silence { epoch, last_run } => {
                self.epoch = epoch;
                // The control state has already published it.
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
            NodeEntry::Cast { request, handle } => {
                self.shared.end_cast();
                let handle = match handle {
                    Some(handle) => handle.downcast::<Cast<E>>().ok().map(|handle| *handle),
                    None => Self::replayed(&request),
                };
                // Any entry ends the timeout.
                let handle = handle.unwrap_or_else(|| Box::new(|_| Ok(Reply::none())));
                let declaration = self.declaration;
                return self.run(turn, emitted, |estimator| {
                    if request.bytes.is_none() {
                        turn.set_unrecorded(declaration);
                    }
                    estimator.declared().map_or_else(|| Ok(Reply::none()), handle)
                });
            }
            NodeEntry::OutputFailed { message } => {
                let failed = Failed { fault: Fault::new(message), panicked: true };
                if self.slot.is_running() {
                    self.fail(failed, turn);
                } else {
                    self.report_failure(&failed);
                }
            }
            NodeEntry::Retire => {
                if let Some(fault) = self.slot.retire() {
                    let failed = Failed::from(fault);
                    self.report_failure(&failed);
                    self.set_stopped(Some((failed.fault.to_string(), true)));
                }
                self.slot.stop();
                self.drop_backlog();
            }
        }
        Next::Quiet
    }

    /// A request from a journal, if this process can decode it.
    fn replayed(request: &Request) -> Option<Cast<E>> {
        let handle = find::<E>(request.kind, &request.name)?;
        let bytes = request.bytes.clone()?;
        Some(Box::new(move |estimator| handle(estimator, &bytes)))
    }

    /// The number of the declared output at that path.
    pub(crate) fn output_at(&self, path: &str) -> Option<usize> {
        self.declaration.outputs.iter().position(|output| *output == path)
    }

    /// In a replay: creates the estimator when the journal begins.
    pub fn begin_replay(&mut self) {
        self.make_first(self.environment.clock().now());
    }

    /// Answers a request; returns the stamp of the output put into `emitted`, if any.
    pub(crate) fn call<Q>(
        &mut self,
        request: Q,
        is_unrecorded: bool,
        turn: &Turn<'_>,
        emitted: &mut Option<E::Output>,
    ) -> (Result<E::Response, Fault>, Option<Stamp>)
    where
        E: HandleCall<Q>,
    {
        let mut response = Err(Fault::new(format!("{} does not run", self.declaration.path)));
        if self.slot.running().is_none_or(|estimator| estimator.declared().is_none()) {
            return (response, None);
        }
        let declaration = self.declaration;
        let next = self.run(turn, emitted, |estimator| {
            if is_unrecorded {
                turn.set_unrecorded(declaration);
            }
            let Some(estimator) = estimator.declared() else { return Ok(Reply::none()) };
            let (answer, reply) = estimator.handle_call(request)?;
            response = Ok(answer);
            Ok(reply)
        });
        match next {
            Next::Emitted(stamp) => (response, Some(stamp)),
            Next::Idle | Next::Quiet if !self.slot.is_running() => {
                let (path, reason) = (self.declaration.path, self.shared.stopped().map(|stopped| stopped.reason));
                let reason = reason.unwrap_or_default();
                (Err(Fault::new(format!("{path} failed at this call: {reason}"))), None)
            }
            Next::Idle | Next::Quiet => (response, None),
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
