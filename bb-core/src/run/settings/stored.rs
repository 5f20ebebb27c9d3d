//! Parameters that an earlier run has stored.

use crate::component::{Fault, ParameterStore};
use crate::declaration::ParameterError;
use crate::event::ParameterValue;
use crate::run::draft::Draft;
use crate::run::keeper::Kept;
use crate::run::{Builder, Robot};

impl<R: Robot> Builder<R> {
    /// Keeps parameters over restarts of the program in `store`: sets those that it has now, and stores those that are set
    /// while the robot runs. Values of [`set`](Self::set), files and the command line that are set after this call
    /// take precedence, and are not stored. `bb-redb` is a crash-safe store in a file.
    ///
    /// A change is stored on another thread, moments after it was made; changes that follow each other closely are stored
    /// together. A set of [`Bus::set_parameters`](crate::Bus::set_parameters) is stored as a whole or not at all. In a
    /// simulation everything is stored as it ends. A replay does not change the store, but starts with its values, and refuses a
    /// journal that began with others: do not call this for a replay.
    ///
    /// Returns the stored values that are not used: their parameter is no longer declared, or accepts other values. They stay in
    /// the store until the parameter is set. Each value is checked alone: if the values of a component contradict each other, because
    /// one of them is no longer used, the robot does not start. Replace components before this call: the options of a declared
    /// component refuse values that its replacement may take.
    ///
    /// # Errors
    /// The store cannot be read.
    pub fn keep_parameters(&mut self, store: impl ParameterStore) -> Result<Vec<ParameterError>, Fault> {
        self.draft.keep_parameters(Box::new(store))
    }
}

impl Draft {
    fn keep_parameters(&mut self, store: Box<dyn ParameterStore>) -> Result<Vec<ParameterError>, Fault> {
        let kept = Kept::load(store)?;
        let values = kept.values().iter();
        let unused = values.filter_map(|(path, value)| self.take_stored(path, value).err()).collect();
        self.kept = Some(kept);
        Ok(unused)
    }

    fn take_stored(&mut self, path: &str, value: &ParameterValue) -> Result<(), ParameterError> {
        let number = self.robot.parameters.iter().position(|declared| declared.path == path);
        let refuse =
            || ParameterError { path: path.to_owned(), message: "no such parameter is declared".to_owned() };
        self.set_parameter(number.ok_or_else(refuse)?, value.clone())
    }
}
