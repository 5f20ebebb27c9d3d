//! Requests to an estimator from outside the dataflow: calls, casts, new options.

use super::{Node, Turn};
use crate::component::{Context, Estimator, Fault, HandleCall, HandleCast, Reply};
use crate::message::Stamp;
use crate::run::{Failed, caught};
use crate::time::MonotonicTime;
use std::any::Any;

/// A one-way request, as it waits.
pub(super) type Cast<E> = Box<dyn FnOnce(&mut E) -> Result<Reply<<E as Estimator>::Output>, Fault> + Send>;

impl<E: Estimator> Node<E> {
    /// Answers a request; the stamp of what it put into `emitted`, if anything.
    pub(crate) fn call<Q>(
        &mut self,
        request: Q,
        now: MonotonicTime,
        emitted: &mut Option<E::Output>,
    ) -> (Result<E::Response, Fault>, Option<Stamp>)
    where
        E: HandleCall<Q>,
    {
        let mut response = Err(Fault::new(format!("{} does not run", self.declaration.path)));
        if self.estimator.is_none() {
            return (response, None);
        }
        let turn = self.run(now, emitted, |estimator| {
            let (answer, reply) = estimator.handle_call(request)?;
            response = Ok(answer);
            Ok(reply)
        });
        match turn {
            Turn::Emitted(stamp) => (response, Some(stamp)),
            Turn::Idle | Turn::Quiet if self.estimator.is_none() => {
                let (path, reason) = (self.declaration.path, self.shared.stopped().unwrap_or_default());
                (Err(Fault::new(format!("{path} failed at this call: {reason}"))), None)
            }
            Turn::Idle | Turn::Quiet => (response, None),
        }
    }

    /// A one-way request of type `Q`, as it is left for [`Self::turn`].
    pub(crate) fn cast<Q: Send + 'static>(request: Q) -> Box<dyn Any + Send>
    where
        E: HandleCast<Q>,
    {
        let cast: Cast<E> = Box::new(|estimator| estimator.handle_cast(request));
        Box::new(cast)
    }

    pub(super) fn change_options(&mut self, now: MonotonicTime) {
        let Some(estimator) = &mut self.estimator else { return };
        let context = Context::new(self.startup.robot(), self.declaration, now);
        let options = self.startup.bound(&self.recipe.options, self.recipe.binding);
        let changed = match options {
            Ok(options) => caught(|| estimator.handle_options(options, &context)),
            Err(fault) => Err(Failed { fault, panicked: false }),
        };
        match changed {
            Ok(()) => {
                for request in context.into_requests() {
                    self.timers.request(request, now);
                }
                self.schedule();
            }
            Err(failed) => self.fail(failed, now),
        }
    }
}
