//! Parameters: setting and validating them, and notifying components.

use super::{Bound, Control};
use crate::component::Permit;
use crate::declaration::{ParameterError, ParameterValues};
use crate::event::{ParameterChange, ParameterValue};
use crate::journal::Event;
use crate::node::{BindTarget, Check, NodeEntry};
use std::sync::Arc;

impl Control {
    pub(crate) fn parameters(&self) -> ParameterValues {
        self.lock().parameters.clone()
    }

    pub(crate) fn parameter_at(&self, path: &str) -> Option<ParameterValue> {
        let number = self.0.declared.parameters.iter().position(|parameter| parameter.path == path)?;
        self.parameters().all().get(number).cloned()
    }

    pub(crate) fn set_parameter_at(
        &self,
        path: &str,
        value: ParameterValue,
        permit: &Permit,
    ) -> Result<(), ParameterError> {
        if let Some(number) = self.0.declared.parameters.iter().position(|parameter| parameter.path == path) {
            return self.set_parameter(number, value, permit);
        }
        let near = crate::message::nearest::nearest_path(
            path,
            self.0.declared.parameters.iter().map(|parameter| parameter.path),
        );
        let hint = near.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
        Err(ParameterError { path: path.to_owned(), message: format!("no such parameter is declared{hint}") })
    }

    /// Sets a parameter, unless it or the options of a component bound to it would be out of range.
    pub(crate) fn set_parameter(
        &self,
        number: usize,
        value: ParameterValue,
        permit: &Permit,
    ) -> Result<(), ParameterError> {
        let Some(declared) = self.0.declared.parameters.get(number) else { return Ok(()) };
        declared.check(&value)?;
        if let Some(journal) = &self.0.journal {
            journal.wait_for_room();
        }
        let refuse = |message: String| ParameterError { path: declared.path.to_owned(), message };
        // Validation of options is user code, so it runs without the lock, and again if another parameter was set
        // meanwhile.
        loop {
            let (values, version, checks) = {
                let state = self.lock();
                let bound = state.bound.iter().filter(|component| component.parameters.contains(&number));
                let checks: Vec<_> =
                    bound.map(|component| (component.path, Arc::clone(&component.check))).collect();
                (state.parameters.clone(), state.version, checks)
            };
            let Some((values, from)) = values.with(number, value.clone()) else { return Ok(()) };
            for (path, check) in &checks {
                check(&values).map_err(|message| refuse(format!("{path} would refuse it: {message}")))?;
            }
            let mut step = self.step();
            if !permit.is_valid() {
                return Err(refuse("the command that sets it has ended or was cancelled".to_owned()));
            }
            if step.state.version != version {
                continue;
            }
            step.line(Event::Parameter { parameter: number, value: value.clone() });
            step.state.version += 1;
            step.state.parameters = values.clone();
            let mut estimators = Vec::new();
            for component in step.state.bound.iter().filter(|component| component.parameters.contains(&number)) {
                match &component.target {
                    BindTarget::Estimator(estimator) => estimators.push(*estimator),
                    BindTarget::Other(tell) => tell(),
                    BindTarget::Nobody => {}
                }
            }
            for estimator in estimators {
                step.post(estimator, NodeEntry::Options(values.clone()));
            }
            if let Some(topic) = self.0.topics.parameters.get(number) {
                step.publish(topic, ParameterChange { path: declared.path, from, to: value.clone() }, step.now);
            }
            step.finish();
            return Ok(());
        }
    }

    /// In a replay: a parameter was set. Components whose options are bound to it are notified by their own lines.
    pub(crate) fn replay_parameter(&self, number: usize, value: ParameterValue) {
        let mut step = self.step();
        let Some((values, from)) = step.state.parameters.with(number, value.clone()) else { return };
        step.state.parameters = values;
        if let (Some(topic), Some(declared)) =
            (self.0.topics.parameters.get(number), self.0.declared.parameters.get(number))
        {
            step.publish(topic, ParameterChange { path: declared.path, from, to: value }, step.now);
        }
        step.finish();
    }

    /// Records that the options of a component are bound to parameters.
    pub(super) fn bind_to(
        &self,
        path: &'static str,
        parameters: &'static [usize],
        check: Arc<Check>,
        target: BindTarget,
    ) {
        self.lock().bound.push(Bound { path, parameters, check, target });
    }

    /// Commands take their options when they start, so they need no notification.
    pub(super) fn bind_commands(&self) {
        for (number, command) in self.0.declared.commands.iter().enumerate() {
            let bound = self.0.commands.get(number).map_or(&[][..], |command| command.0.bound_to());
            if bound.is_empty() {
                continue;
            }
            let control = self.downgrade();
            let check: Check = Box::new(move |values: &ParameterValues| {
                let Some(control) = control.upgrade() else { return Ok(()) };
                control.0.commands.get(number).map_or(Ok(()), |command| command.0.check(values))
            });
            self.bind_to(command.path, bound, Arc::new(check), BindTarget::Nobody);
        }
    }
}
