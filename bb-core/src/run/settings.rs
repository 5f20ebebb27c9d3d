//! Options and parameters by path, set at run time: from a TOML file, from the command line, or from code.
//!
//! A setting is `PATH/NAME` for an option of the component at `PATH`, or the path of a parameter. Values are checked
//! like the literals in `robot!`: a number that states a unit is written as a string with a unit of that dimension,
//! `"20 ms"`.
//!
//! ```toml
//! [sensor.base.imu]
//! port = "/dev/ttyUSB0"
//! maximum_range = "12 m"
//!
//! [param.imu]
//! beta = 0.05
//! ```

mod arguments;
mod assign;
mod error;
#[cfg(feature = "toml")]
mod file;
mod list;
mod schema;
mod stored;

pub use error::{SettingProblem, SettingsError};
pub use list::SettingsList;
pub(super) use schema::settings_schema;

use super::draft::Draft;
use super::{Builder, Robot};
use assign::Assignment;
use error::Place;

impl<R: Robot> Builder<R> {
    /// Sets an option or a parameter by path: `set("sensor/base/imu/maximum_range", "12 m")`. The value is JSON;
    /// anything else is taken as a string.
    ///
    /// # Errors
    /// Why it was not set: an unknown path, with the nearest one, or what was expected.
    pub fn set(&mut self, path: &str, value: &str) -> Result<(), SettingsError> {
        assign::assign(&mut self.draft, &[Assignment::from_text(Place::Code, path, value)])
    }

    /// Applies the settings of a TOML file: all of them, or none if any is wrong.
    ///
    /// # Errors
    /// All problems, each with its line and column.
    #[cfg(feature = "toml")]
    pub fn load_settings(&mut self, file: impl AsRef<std::path::Path>) -> Result<(), SettingsError> {
        self.draft.load_file(file.as_ref())
    }

    /// Sets options and parameters from TOML text, as [`Builder::load_settings`] does from a file; errors name it `name`.
    ///
    /// # Errors
    /// As [`Builder::load_settings`].
    #[cfg(feature = "toml")]
    pub fn set_from_toml(&mut self, name: &str, text: &str) -> Result<(), SettingsError> {
        self.draft.set_from_toml(name, text)
    }

    /// All settings with their values: its `Display` is a TOML file that [`Builder::load_settings`] reads.
    pub fn settings(&mut self) -> SettingsList {
        list::list(&mut self.draft)
    }
}

#[cfg(feature = "toml")]
impl Draft {
    fn load_file(&mut self, file: &std::path::Path) -> Result<(), SettingsError> {
        let name = file.display().to_string();
        let text = std::fs::read_to_string(file).map_err(|error| SettingsError::of_file(&name, &error))?;
        self.set_from_toml(&name, &text)
    }

    fn set_from_toml(&mut self, name: &str, text: &str) -> Result<(), SettingsError> {
        let names = assign::names(self.robot, &mut self.options);
        let known = |path: &str| match (names.get(path).is_some(), assign::is_beginning(&names, path)) {
            (true, true) => file::Known::Both,
            (true, false) => file::Known::Setting,
            (false, true) => file::Known::Table,
            (false, false) => file::Known::No,
        };
        let assignments = file::read(name, text, &known)?;
        assign::assign(self, &assignments)
    }
}

#[cfg(not(feature = "toml"))]
impl Draft {
    fn load_file(&mut self, _: &std::path::Path) -> Result<(), SettingsError> {
        Err(SettingsError::one(Place::Code, "", "a file of settings needs the feature `toml` of `bb-core`"))
    }
}
