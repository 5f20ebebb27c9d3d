//! Parameters of algorithms. Documentation, default, range and unit of each are stated once, in `params!`, and everything
//! else is derived from there: the struct, its [`Default`], the options in `robot!`, the check at run time, setting by name
//! from a text, and what the command prints.
//!
//! ```
//! use bb_estimators::attitude::MadgwickParams;
//! use bb_estimators::params::Params;
//!
//! let mut params = MadgwickParams::default();
//! params.set("beta", "5 deg/s")?;
//! assert_eq!(params.beta, 5_f64.to_radians());
//!
//! let error = params.set("betta", "0.1").unwrap_err();
//! assert_eq!(error.to_string(), "there is no parameter `betta`; did you mean `beta`?");
//! let error = params.set("beta", "-1").unwrap_err();
//! assert_eq!(error.to_string(), "`beta` is -1 rad/s: choose a value from 0 to 1000 rad/s");
//! # Ok::<(), bb_estimators::params::SetError<'static>>(())
//! ```
//!
//! All of it works without the standard library and without allocation.

mod error;
mod nearest;
mod table;
#[cfg(test)]
mod tests;
mod text;
mod units;
mod value;

pub use error::{ParamsError, SetError};
pub use nearest::nearest;
pub(crate) use table::params;
pub use value::{Field, Kind, Range, Value};

/// Description of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// The name of the field.
    pub name: &'static str,
    /// Meaning, and the effect of small and large values; paragraphs are separated by blank lines.
    pub doc: &'static str,
    /// Kind of its values.
    pub kind: Kind,
    /// The accepted numbers; of a [`Kind::Process`], of its deviation.
    pub range: Range,
    /// The unit; empty for plain numbers.
    pub unit: &'static str,
}

impl Parameter {
    /// Returns the first paragraph of the documentation, with its line breaks.
    pub fn summary(&self) -> &'static str {
        self.doc.split("\n\n").next().unwrap_or("").trim()
    }

    /// Accepts a value within the range; NaN is never within.
    fn check(&self, value: Value) -> Result<(), ParamsError> {
        let accept = |value: f64, range: Range, unit| {
            let Range { min, max } = range;
            let error = ParamsError { parameter: self.name, value, min, max, unit };
            if range.has(value) { Ok(()) } else { Err(error) }
        };
        match value {
            Value::Switch(_) | Value::Choice(_) => Ok(()),
            Value::Count(count) => accept(f64::from(count), self.range, self.unit),
            Value::Number(number) => accept(number, self.range, self.unit),
            Value::Process { deviation, time_s } => {
                accept(deviation, self.range, self.unit)?;
                accept(time_s, PROCESS_TIME, "s")
            }
        }
    }
}

/// The correlation times of processes, s; infinite for a constant.
const PROCESS_TIME: Range = Range { min: 1e-3, max: f64::INFINITY };

/// The tuning of an algorithm: a struct with one public field a parameter.
pub trait Params {
    /// The parameters, in the order of the fields.
    fn parameters(&self) -> &'static [Parameter];

    /// The value of the parameter at this place in [`parameters`](Self::parameters).
    fn value(&self, index: usize) -> Option<Value>;

    /// Replaces the value of the parameter at this place, whatever its range. Returns whether there is one of that kind.
    fn replace(&mut self, index: usize, value: Value) -> bool;

    /// Accepts the parameters if each is in its range; NaN never is.
    ///
    /// # Errors
    ///
    /// The first parameter outside its range, with its value, range and unit.
    fn check(&self) -> Result<(), ParamsError> {
        let mut values = self.parameters().iter().enumerate().filter_map(|(i, one)| Some((one, self.value(i)?)));
        values.try_for_each(|(parameter, value)| parameter.check(value))
    }

    /// The value of the parameter of this name.
    fn get(&self, name: &str) -> Option<Value> {
        self.value(self.parameters().iter().position(|parameter| parameter.name == name)?)
    }

    /// Sets the parameter `name` to what `text` says: a number in SI or with a unit (`0.1`, `5 deg/s`), `true` or `false`,
    /// a count, or for a [`Kind::Process`] a deviation and its correlation time (`0.02 for 20 s`, `0.1 m for ever`; without
    /// `for` the time stays).
    ///
    /// # Errors
    ///
    /// An unknown name, with the nearest one; a text that is not a value of the parameter; a value outside its range.
    /// Nothing is changed then.
    fn set<'t>(&mut self, name: &'t str, text: &'t str) -> Result<(), SetError<'t>> {
        let parameters = self.parameters();
        let found = parameters.iter().enumerate().find(|(_, parameter)| parameter.name == name);
        let (index, parameter) = found.ok_or(SetError::Unknown { name, parameters })?;
        let value = text::parse(parameter, text, self.value(index))?;
        parameter.check(value).map_err(SetError::Refused)?;
        self.replace(index, value);
        Ok(())
    }
}
