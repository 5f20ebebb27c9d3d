//! Requests to an estimator from outside the dataflow, and how a replay repeats them.

use crate::component::{Estimator, HandleCall, HandleCast, Reply};
use crate::fault::Fault;
use crate::journal::RequestKind;
use std::any::{Any, TypeId, type_name};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// A one-way request waiting to be handled.
pub(crate) type Cast<E> = Box<dyn FnOnce(&mut E) -> Result<Reply<<E as Estimator>::Output>, Fault> + Send>;

/// Handles a request from its bytes in a journal.
pub(super) type Handle<E> = fn(&mut E, &[u8]) -> Result<Reply<<E as Estimator>::Output>, Fault>;

/// Handler of the requests of one type at one estimator; `handle` is a [`Handle`].
struct Known {
    estimator: TypeId,
    kind: RequestKind,
    /// The name of the request type.
    name: &'static str,
    handle: Box<dyn Any + Send + Sync>,
}

impl Known {
    fn is<E: Estimator>(&self, kind: RequestKind, name: &str) -> bool {
        self.estimator == TypeId::of::<E>() && self.kind == kind && self.name == name
    }
}

/// The request types that this process has seen or registered; a replay looks them up by name.
static KNOWN: Mutex<Vec<Known>> = Mutex::new(Vec::new());

/// Registers calls of type `Q` for replays.
pub(crate) fn know_calls<E: HandleCall<Q>, Q>() {
    if E::RECORD.is_some() {
        know::<E>(RequestKind::Call, type_name::<Q>(), |estimator, bytes| {
            let (_, reply) = estimator.handle_call(decoded(E::RECORD, bytes)?)?;
            Ok(reply)
        });
    }
}

/// Registers one-way requests of type `Q` for replays.
pub(crate) fn know_casts<E: HandleCast<Q>, Q>() {
    if E::RECORD.is_some() {
        know::<E>(RequestKind::Cast, type_name::<Q>(), |estimator, bytes| {
            estimator.handle_cast(decoded(E::RECORD, bytes)?)
        });
    }
}

fn decoded<Q>(codec: Option<crate::component::RequestCodec<Q>>, bytes: &[u8]) -> Result<Q, Fault> {
    let request = codec.and_then(|codec| codec.decode(bytes));
    request.ok_or_else(|| Fault::new(format!("the journal's `{}` cannot be read", type_name::<Q>())))
}

fn know<E: Estimator>(kind: RequestKind, name: &'static str, handle: Handle<E>) {
    let mut known = lock();
    if !known.iter().any(|known| known.is::<E>(kind, name)) {
        known.push(Known { estimator: TypeId::of::<E>(), kind, name, handle: Box::new(handle) });
    }
}

pub(super) fn find<E: Estimator>(kind: RequestKind, name: &str) -> Option<Handle<E>> {
    let known = lock();
    let found = known.iter().find(|known| known.is::<E>(kind, name))?;
    found.handle.downcast_ref::<Handle<E>>().copied()
}

fn lock() -> MutexGuard<'static, Vec<Known>> {
    KNOWN.lock().unwrap_or_else(PoisonError::into_inner)
}
