//! Parameters: setting and validating them, and notifying components.
//!
//! The options of bound components are validated without the lock, since that is user code. If a parameter that one of them is bound to
//! was set meanwhile, they are validated again; otherwise one entry sets all values and leaves an entry for each estimator. The others
//! are told to look.

use super::step::Step;
use super::{Bound, Control};
use crate::component::{Caller, ParameterControls};
use crate::declaration::{ParameterError, ParameterValues};
use crate::event::{ParameterChange, ParameterValue};
use crate::journal::{Event, ParameterEntry};
use crate::node::{BindTarget, Check, NodeEntry};
use bb_message::__private::{did_you_mean, nearest_path};
use std::sync::Arc;

impl ParameterControls for Control {
    fn parameter(&self, path: &str) -> Option<ParameterValue> {
        let number = self.0.declared.parameters.iter().position(|parameter| parameter.path == path)?;
        self.parameters().all().get(number).cloned()
    }

    fn set_parameters(
        &self,
        changes: Vec<(String, ParameterValue)>,
        caller: &Caller,
    ) -> Result<(), ParameterError> {
        let mut entries = Vec::new();
        for (path, value) in changes {
            entries.push(ParameterEntry { parameter: self.parameter_number(&path)?, value });
        }
        self.set_entries(entries, caller)
    }
}

impl Control {
    pub(crate) fn parameters(&self) -> ParameterValues {
        self.lock().parameters.clone()
    }

    /// The path of a parameter.
    pub(crate) fn parameter_path(&self, number: usize) -> Option<&'static str> {
        self.0.declared.parameters.get(number).map(|declared| declared.path)
    }

    fn parameter_number(&self, path: &str) -> Result<usize, ParameterError> {
        let paths = self.0.declared.parameters.iter().map(|parameter| parameter.path);
        paths.clone().position(|declared| declared == path).ok_or_else(|| {
            let hint = did_you_mean(nearest_path(path, paths));
            ParameterError { path: path.to_owned(), message: format!("no such parameter is declared{hint}") }
        })
    }

    /// Sets parameters at once, in one entry: all of them, or none if one of them, or the options of a component bound to them,
    /// would be out of range.
    pub(crate) fn set_entries(&self, changes: Vec<ParameterEntry>, caller: &Caller) -> Result<(), ParameterError> {
        let Some(first) = changes.first() else { return Ok(()) };
        let path_of = |number: usize| self.0.declared.parameters.get(number).map_or("?", |declared| declared.path);
        let refuse = |path: &str, message: String| ParameterError { path: path.to_owned(), message };
        let first_path = path_of(first.parameter);
        for (index, change) in changes.iter().enumerate() {
            let Some(declared) = self.0.declared.parameters.get(change.parameter) else { return Ok(()) };
            declared.check(&change.value)?;
            if changes[..index].iter().any(|other| other.parameter == change.parameter) {
                return Err(refuse(declared.path, "it is set twice at once".to_owned()));
            }
        }
        if let Some(journal) = &self.0.journal {
            journal.wait_for_room();
        }
        let is_bound_to_any =
            |bound: &Bound| changes.iter().any(|change| bound.parameters.contains(&change.parameter));
        // Validation of options is user code, so it runs without the lock, and again if another parameter that the component is bound
        // to was set meanwhile.
        loop {
            let (before, checks) = {
                let state = self.lock();
                let mut checks = Vec::new();
                for component in state.bound.iter().filter(|component| is_bound_to_any(component)) {
                    checks.push((component.path, component.parameters, Arc::clone(&component.check)));
                }
                (state.parameters.clone(), checks)
            };
            let values = before.with(changed(&changes));
            for (path, bound_to, check) in &checks {
                let Err(message) = check(&values) else { continue };
                // Of several that the component is bound to, the one that it also refuses alone.
                let bound: Vec<_> = changes.iter().filter(|change| bound_to.contains(&change.parameter)).collect();
                let refuses = |change: &&&ParameterEntry| {
                    check(&before.with(changed(std::slice::from_ref(**change)))).is_err()
                };
                let refused = bound.iter().find(refuses).or(bound.first());
                let parameter = refused.map_or(first_path, |change| path_of(change.parameter));
                return Err(refuse(parameter, format!("{path} would refuse it: {message}")));
            }
            let mut step = self.step();
            let _permit = caller.permit().map_err(|fault| refuse(first_path, fault.to_string()))?;
            if step.state.parameters_are_final {
                return Err(refuse(first_path, "the robot has stopped".to_owned()));
            }
            let is_as_checked =
                |number: &usize| step.state.parameters.all().get(*number) == before.all().get(*number);
            if !checks.iter().all(|(_, bound_to, _)| bound_to.iter().all(is_as_checked)) {
                continue;
            }
            let values = step.state.parameters.with(changed(&changes));
            let caller = caller.name().to_owned();
            step.line(Event::Parameters { changes: changes.clone(), caller: caller.clone() });
            let mut estimators = Vec::new();
            for component in step.state.bound.iter().filter(|component| is_bound_to_any(component)) {
                match &component.target {
                    BindTarget::Estimator(estimator) => estimators.push(*estimator),
                    BindTarget::Other(tell) => tell(),
                    BindTarget::Nobody => {}
                }
            }
            for estimator in estimators {
                step.post(estimator, NodeEntry::Options(values.clone()));
            }
            if let Some(keep) = self.0.on_parameters.get() {
                keep(&changes);
            }
            step.change_parameters(values, changes, &caller);
            step.finish();
            return Ok(());
        }
    }

    /// Accepts no parameter from here on.
    pub(crate) fn close_parameters(&self) {
        self.lock().parameters_are_final = true;
    }

    /// Replays a set of parameters. Components whose options are bound to them are notified by their own lines.
    pub(crate) fn replay_parameters(&self, changes: Vec<ParameterEntry>, caller: &str) {
        let mut step = self.step();
        let values = step.state.parameters.with(changed(&changes));
        step.change_parameters(values, changes, caller);
        step.finish();
    }

    /// Calls `keep` with each set of parameters, under the lock of the control state: it must not block.
    pub(crate) fn on_parameters(&self, keep: impl Fn(&[ParameterEntry]) + Send + Sync + 'static) {
        // It is set once, before the robot runs.
        let _ = self.0.on_parameters.set(Box::new(keep));
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

impl Step<'_> {
    /// Changes the values, and publishes the changes.
    fn change_parameters(&mut self, values: ParameterValues, changes: Vec<ParameterEntry>, caller: &str) {
        let before = std::mem::replace(&mut self.state.parameters, values);
        let control = self.control;
        for ParameterEntry { parameter, value } in changes {
            let (topics, declared) = (&control.0.topics.parameters, control.0.declared.parameters);
            if let (Some(topic), Some(declared), Some(from)) =
                (topics.get(parameter), declared.get(parameter), before.all().get(parameter))
            {
                let (path, from, caller) = (declared.path, from.clone(), caller.to_owned());
                let change = ParameterChange { path, from, to: value, caller };
                self.publish(topic, change, self.now);
            }
        }
    }
}

fn changed(changes: &[ParameterEntry]) -> impl Iterator<Item = (usize, &ParameterValue)> {
    changes.iter().map(|change| (change.parameter, &change.value))
}
