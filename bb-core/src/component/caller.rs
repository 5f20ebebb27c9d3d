//! Callers of a robot, and their rights.

use super::Fault;
use super::tenure::{Over, Permit, Tenure};
use crate::event::{Forbidden, Right, Rights};
use std::borrow::Cow;
use std::sync::Arc;
use std::time::Duration;

/// A caller of a robot. Handles that were obtained for a caller act in its name.
#[derive(Clone, Debug)]
pub(crate) struct Caller {
    name: Cow<'static, str>,
    rights: Rights,
    /// The execution of a command or the session that it belongs to, after whose end its handles refuse to act, even if code of it still
    /// runs.
    within: Option<Arc<Tenure>>,
    /// `true` for a caller outside of the robot: on virtual time, what follows from its calls is settled before they return.
    is_outside: bool,
}

impl Caller {
    /// The program that runs the robot.
    pub(crate) const PROGRAM: Self =
        Self { name: Cow::Borrowed("program"), rights: Rights::ALL, within: None, is_outside: true };

    /// The component at `path`.
    pub(crate) const fn component(path: &'static str) -> Self {
        Self { name: Cow::Borrowed(path), rights: Rights::ALL, within: None, is_outside: false }
    }

    /// An execution of the command at `path`.
    pub(crate) fn execution(path: &'static str) -> Self {
        Self { within: Some(Arc::default()), ..Self::component(path) }
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

    /// Returns the same caller in a session of that name, which [`Self::revoke`] ends.
    pub(crate) fn in_session(&self) -> Self {
        let tenure = Tenure::session(self.name.to_string(), self.within.clone());
        Self { within: Some(Arc::new(tenure)), ..self.clone() }
    }

    /// Permits the calling thread to act until the permit is dropped: for an act whose order with [`Self::revoke`] counts.
    ///
    /// # Errors
    /// As [`Self::check_valid`].
    pub(crate) fn permit(&self) -> Result<Permit<'_>, Fault> {
        match &self.within {
            Some(within) => within.permit().map_err(ended),
            None => Ok(Permit::ENDLESS),
        }
    }

    /// Makes its handles refuse to act from now on. A call that holds a permit is completed: [`Self::wait_for_calls`] waits for it.
    pub(crate) fn revoke(&self) {
        if let Some(within) = &self.within {
            within.end();
        }
    }

    /// Waits until no other thread acts in its name, at most `timeout`. Returns whether none does.
    pub(crate) fn wait_for_calls(&self, timeout: Duration) -> bool {
        self.within.as_ref().is_none_or(|within| within.wait(timeout))
    }

    /// Returns whether both are of the same execution of a command, or of the same session outside of commands.
    pub(crate) fn is_of_same(&self, other: &Self) -> bool {
        let (Some(one), Some(other)) = (&self.within, &other.within) else { return false };
        std::ptr::eq(one.outermost(), other.outermost())
    }

    pub(crate) fn is_valid(&self) -> bool {
        self.within.as_ref().is_none_or(|within| within.over().is_none())
    }

    /// # Errors
    /// It is a command that has ended or was cancelled, or a session that has ended.
    pub(crate) fn check_valid(&self) -> Result<(), Fault> {
        self.within.as_ref().and_then(|within| within.over()).map_or(Ok(()), |over| Err(ended(over)))
    }
}

fn ended(over: Over<'_>) -> Fault {
    match over.session {
        Some(name) => Fault::new(format!("the session of `{name}` has ended")),
        None => Fault::new("the command that asks for this has ended or was cancelled"),
    }
}
