//! Operations of an island on one of its estimators, other than delivering messages.

use crate::message::Stamp;
use crate::node::{NodeEntry, Turn};
use crate::pubsub::DynamicMessage;
use std::any::Any;

/// A function called with an estimator, a `Node<E>`, once it is free, and with the slot for what it emits, an
/// `Option<E::Output>`; it returns the stamp of what was emitted.
pub(crate) type Visit<'a> = dyn FnMut(&mut dyn Any, &Turn<'_>, &mut dyn Any) -> Option<Stamp> + 'a;

/// An operation of an island on one of its estimators, other than delivering messages.
#[allow(missing_debug_implementations)]
pub enum Act<'a, 'b> {
    /// Do all that is due.
    Turn(&'a Turn<'b>),
    /// Handle an entry.
    Handle(NodeEntry, &'a Turn<'b>),
    /// Let a caller visit it.
    Visit(&'a mut Visit<'a>, &'a Turn<'b>),
    /// Create the estimator, in a replay.
    BeginReplay,
    /// Publish the output emitted in reply to a request missing from the journal, in a replay.
    Emit(&'a DynamicMessage, &'a Turn<'b>),
}
