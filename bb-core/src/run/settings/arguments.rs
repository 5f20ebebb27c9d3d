//! Settings from the command line.

use super::SettingsError;
use super::assign::{Assignment, assign};
use super::error::Place;
use super::list::list;
use super::schema::settings_schema;
use crate::run::draft::Draft;
use crate::run::{Builder, Robot};
use std::ffi::OsString;
use std::io::{ErrorKind, Write};

impl<R: Robot> Builder<R> {
    /// Takes the settings out of a program's arguments and returns the others:
    ///
    /// | argument | effect |
    /// |---|---|
    /// | `--config FILE` | loads a TOML file, see `load_settings`; may be repeated |
    /// | `--set PATH=VALUE` | sets one option or parameter, after all files; may be repeated |
    /// | `--list` | prints all settings as a TOML file; `None` is returned |
    /// | `--schema` | prints their JSON Schema; `None` is returned |
    ///
    /// Arguments after `--` are returned unchanged.
    ///
    /// ```no_run
    /// use bb_core::prelude::*;
    ///
    /// robot! {
    ///     robot Rover;
    ///     link base {
    ///         sensor imu: External<Imu>();
    ///     }
    /// }
    ///
    /// fn main() -> Result<(), Box<dyn std::error::Error>> {
    ///     let mut builder = Rover::builder();
    ///     let Some(others) = builder.take_arguments(std::env::args_os().skip(1))? else { return Ok(()) };
    ///     if let Some(other) = others.first() {
    ///         return Err(format!("there is no argument `{}`", other.display()).into());
    ///     }
    ///     let running = builder.start()?;
    ///     running.stop();
    ///     Ok(())
    /// }
    /// ```
    ///
    /// # Errors
    /// All wrong settings of a file; if the files are right, all wrong arguments. None of these is set.
    pub fn take_arguments(
        &mut self,
        arguments: impl IntoIterator<Item = OsString>,
    ) -> Result<Option<Vec<OsString>>, SettingsError> {
        self.draft.take_arguments(&mut arguments.into_iter())
    }
}

impl Draft {
    fn take_arguments(
        &mut self,
        arguments: &mut dyn Iterator<Item = OsString>,
    ) -> Result<Option<Vec<OsString>>, SettingsError> {
        let mut read = Arguments::default();
        read.read(arguments)?;
        for file in &read.files {
            self.load_file(file.as_ref())?;
        }
        assign(self, &read.settings)?;
        if read.lists {
            say(&list(self).to_string())?;
        }
        if read.shows_schema {
            say(&format!("{}\n", settings_schema(self.robot, (self.declared_options)())))?;
        }
        Ok((!read.lists && !read.shows_schema).then_some(read.others))
    }
}

#[derive(Default)]
struct Arguments {
    files: Vec<OsString>,
    settings: Vec<Assignment>,
    lists: bool,
    shows_schema: bool,
    others: Vec<OsString>,
}

impl Arguments {
    fn read(&mut self, arguments: &mut dyn Iterator<Item = OsString>) -> Result<(), SettingsError> {
        while let Some(argument) = arguments.next() {
            let Some(text) = argument.to_str() else {
                self.others.push(argument);
                continue;
            };
            let (name, value) = match text.split_once('=') {
                Some((name, value)) if name.starts_with("--") => (name, Some(OsString::from(value))),
                _ => (text, None),
            };
            match name {
                "--config" => self.files.push(value_of(name, value, arguments)?),
                "--set" => self.settings.push(setting(value_of(name, value, arguments)?)?),
                "--list" => self.lists = true,
                "--schema" => self.shows_schema = true,
                "--" => {
                    self.others.push(argument);
                    self.others.extend(arguments);
                    return Ok(());
                }
                _ => self.others.push(argument),
            }
        }
        Ok(())
    }
}

fn value_of(
    name: &str,
    value: Option<OsString>,
    arguments: &mut dyn Iterator<Item = OsString>,
) -> Result<OsString, SettingsError> {
    let example = if name == "--set" { "PATH=VALUE" } else { "FILE" };
    value.or_else(|| arguments.next()).ok_or_else(|| wrong(format!("`{name}` needs a value: `{name} {example}`")))
}

fn setting(argument: OsString) -> Result<Assignment, SettingsError> {
    let Some((path, value)) = argument.to_str().and_then(|text| text.split_once('=')) else {
        let argument = argument.display();
        return Err(wrong(format!("expected `--set PATH=VALUE`, found `--set {argument}`")));
    };
    Ok(Assignment::from_text(Place::Argument, path.trim(), value))
}

/// A reader that stops reading early (`| head`) is no mistake.
fn say(text: &str) -> Result<(), SettingsError> {
    match std::io::stdout().lock().write_all(text.as_bytes()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(wrong(format!("cannot print: {error}"))),
        _ => Ok(()),
    }
}

fn wrong(message: impl Into<String>) -> SettingsError {
    SettingsError::one(Place::Code, "", message)
}
