//! Who asks a robot for something, and what it may ask for.

use super::Fault;
use crate::event::{Forbidden, Right, Rights};
use std::borrow::Cow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Who asks a robot for something. Handles that were obtained for a caller act in its name.
#[derive(Clone, Debug)]
pub(crate) struct Caller {
    name: Cow<'static, str>,
    rights: Rights,
    /// Flag of a command that has ended or was cancelled. Its handles then refuse to act, even if its code still runs.
    is_over: Option<Arc<AtomicBool>>,
    /// It calls from outside of the robot: on virtual time, what follows from its calls is settled before they return.
    is_outside: bool,
}

impl Caller {
    /// The program that runs the robot.
    pub(crate) const PROGRAM: Self =
        Self { name: Cow::Borrowed("program"), rights: Rights::ALL, is_over: None, is_outside: true };

    /// The component at `path`.
    pub(crate) const fn component(path: &'static str) -> Self {
        Self { name: Cow::Borrowed(path), rights: Rights::ALL, is_over: None, is_outside: false }
    }

    /// An execution of the command at `path`.
    pub(crate) fn execution(path: &'static str) -> Self {
        Self { is_over: Some(Arc::default()), ..Self::component(path) }
    }

    /// Another caller with those of these rights that this one has.
    pub(crate) fn restricted(&self, name: String, rights: Rights) -> Self {
        Self { name: name.into(), rights: self.rights.and(rights), ..self.clone() }
    }

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    pub(crate) fn rights(&self) -> Rights {
        self.rights
    }

    pub(crate) fn is_outside(&self) -> bool {
        self.is_outside
    }

    /// # Errors
    /// The caller lacks the right.
    pub(crate) fn check(&self, right: Right) -> Result<(), Forbidden> {
        if self.rights.contains(right) { Ok(()) } else { Err(Forbidden { caller: self.name.to_string(), right }) }
    }

    /// Makes its handles refuse to act from now on.
    pub(crate) fn revoke(&self) {
        if let Some(is_over) = &self.is_over {
            is_over.store(true, Ordering::SeqCst);
        }
    }

    /// Whether both are of the same execution of a command.
    pub(crate) fn is_of_same(&self, other: &Self) -> bool {
        matches!((&self.is_over, &other.is_over), (Some(one), Some(other)) if Arc::ptr_eq(one, other))
    }

    pub(crate) fn is_valid(&self) -> bool {
        self.is_over.as_ref().is_none_or(|is_over| !is_over.load(Ordering::SeqCst))
    }

    /// # Errors
    /// It is a command that has ended or was cancelled.
    pub(crate) fn check_valid(&self) -> Result<(), Fault> {
        if self.is_valid() {
            return Ok(());
        }
        Err(Fault::new("the command that asks for this has ended or was cancelled"))
    }
}
