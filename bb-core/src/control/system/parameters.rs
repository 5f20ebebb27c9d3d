//! Parameters: what is set, by whom it is checked, who is told.

use super::changes::Change;
use super::{Bound, Control};
use crate::control::parameters::{ParameterError, ParameterValue, ParameterValues};
use crate::control::tasks::lock;
use crate::journal::Event;
use crate::time::MonotonicTime;

/// Who sets a parameter.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Setter {
    /// Somebody outside, then.
    Outside(MonotonicTime),
    /// A command, whose time is that of all commands.
    Command,
}

impl Control {
    pub(crate) fn parameters(&self) -> ParameterValues {
        lock(&self.0.parameters).clone()
    }

    pub(crate) fn parameter_at(&self, path: &str) -> Option<ParameterValue> {
        let number = self.0.declared.parameters.iter().position(|parameter| parameter.path == path)?;
        self.parameters().0.get(number).cloned()
    }

    pub(crate) fn set_parameter_at(
        &self,
        path: &str,
        value: ParameterValue,
        setter: Setter,
    ) -> Result<(), ParameterError> {
        match self.0.declared.parameters.iter().position(|parameter| parameter.path == path) {
            Some(number) => self.set_parameter(number, value, setter),
            None => Err(ParameterError { path: path.to_owned(), message: "no such parameter is declared".into() }),
        }
    }

    /// Sets a parameter, unless it or the options of a component bound to it would be out of range.
    pub(crate) fn set_parameter(
        &self,
        number: usize,
        value: ParameterValue,
        setter: Setter,
    ) -> Result<(), ParameterError> {
        let Some(declared) = self.0.declared.parameters.get(number) else { return Ok(()) };
        declared.check(&value)?;
        let _acting = self.act();
        let bound = lock(&self.0.bound);
        let now = match setter {
            Setter::Outside(now) => {
                self.write(now, Event::Parameter { parameter: number, value: value.clone() });
                now
            }
            Setter::Command => self.moment(),
        };
        let from = {
            let mut values = lock(&self.0.parameters);
            let mut new = values.0.to_vec();
            let Some(slot) = new.get_mut(number) else { return Ok(()) };
            let from = std::mem::replace(slot, value.clone());
            let new = ParameterValues(new.into());
            for component in bound.iter().filter(|component| component.parameters.contains(&number)) {
                (component.check)(&new).map_err(|message| ParameterError {
                    path: declared.path.to_owned(),
                    message: format!("{} would refuse it: {message}", component.path),
                })?;
            }
            *values = new;
            from
        };
        for component in bound.iter().filter(|component| component.parameters.contains(&number)) {
            (component.notify)();
        }
        lock(&self.0.state).note(now, Change::Parameter(number, from, value));
        drop(bound);
        self.tell();
        Ok(())
    }

    /// Remembers that the options of a component are bound to parameters.
    pub(crate) fn bind(
        &self,
        path: &'static str,
        parameters: &'static [usize],
        check: impl Fn(&ParameterValues) -> Result<(), String> + Send + 'static,
        notify: impl Fn() + Send + 'static,
    ) {
        if !parameters.is_empty() {
            let bound = Bound { path, parameters, check: Box::new(check), notify: Box::new(notify) };
            lock(&self.0.bound).push(bound);
        }
    }
}
