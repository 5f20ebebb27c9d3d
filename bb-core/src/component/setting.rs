//! Options by name, for settings that are read at run time.
//!
//! An option can be of any type. Which of its values a file can contain is derived from its type at compile time: a
//! quantity with a unit, a value with a JSON form ([`Field`]), or a string.

use super::{FromQuantity, OptionField};
use crate::declaration::unit::{Quantity, dimension_name, si_unit};
use crate::message::Field;
use crate::message::codec::{Shape, from_json, to_json};
use std::ffi::OsStr;
use std::marker::PhantomData;

/// One option of a component.
pub trait Setting {
    /// Sets it from JSON.
    fn set(&mut self, json: &str) -> Result<(), String>;
    /// Returns the value as it would be written; `None` if it cannot be.
    fn value(&self) -> Option<String>;
    /// Returns the form in which the option can be written.
    fn kind(&self) -> SettingKind;
    /// Returns the value in SI, if it is a number.
    fn number(&self) -> Option<f64> {
        None
    }
}

/// Form in which an option can be written.
#[derive(Clone, Copy, Debug)]
pub enum SettingKind {
    /// A number with a unit, in a text.
    Quantity,
    /// A value of this shape.
    Value(Shape),
    /// A text.
    Text,
    /// Nothing: only code can set the option.
    Code,
}

/// Determines what can be written for an option of type `T`, by the order of method lookup: see [`WithUnit`],
/// [`ByValue`], [`ByText`] and [`ByCode`].
#[derive(Debug)]
pub struct SettingOf<T>(PhantomData<fn() -> T>);

impl<T> SettingOf<T> {
    /// Creates a marker of this type.
    #[expect(clippy::new_without_default, reason = "the expansion alone makes it")]
    pub const fn new() -> Self {
        Self(PhantomData)
    }
}

/// A number that states a unit.
pub trait WithUnit<T> {
    /// The option in `slot`.
    fn with_unit<'a>(&self, field: OptionField, slot: &'a mut T) -> Box<dyn Setting + 'a>;
}

impl<T: FromQuantity> WithUnit<T> for &&&SettingOf<T> {
    fn with_unit<'a>(&self, field: OptionField, slot: &'a mut T) -> Box<dyn Setting + 'a> {
        Box::new(QuantitySlot { field, slot })
    }
}

/// A value with a JSON form, such as a number, a list, or a type that derives `Payload`.
pub trait ByValue<T> {
    /// The option in `slot`.
    fn plain<'a>(&self, slot: &'a mut T) -> Box<dyn Setting + 'a>;
    /// Returns the option in `slot`, which states a unit and is not a single number: its numbers are in SI.
    fn with_unit<'a>(&self, _: OptionField, slot: &'a mut T) -> Box<dyn Setting + 'a> {
        self.plain(slot)
    }
}

impl<T: Field> ByValue<T> for &&SettingOf<T> {
    fn plain<'a>(&self, slot: &'a mut T) -> Box<dyn Setting + 'a> {
        Box::new(ValueSlot { slot })
    }
}

/// A `PathBuf` or an `OsString`.
pub trait ByText<T> {
    /// The option in `slot`.
    fn plain<'a>(&self, slot: &'a mut T) -> Box<dyn Setting + 'a>;
    /// Returns the option in `slot`, whatever unit it states.
    fn with_unit<'a>(&self, _: OptionField, slot: &'a mut T) -> Box<dyn Setting + 'a> {
        self.plain(slot)
    }
}

impl<T: From<String> + AsRef<OsStr>> ByText<T> for &SettingOf<T> {
    fn plain<'a>(&self, slot: &'a mut T) -> Box<dyn Setting + 'a> {
        Box::new(TextSlot { slot })
    }
}

/// Anything else.
pub trait ByCode<T> {
    /// The option in `slot`.
    fn plain<'a>(&self, _: &'a mut T) -> Box<dyn Setting + 'a> {
        Box::new(CodeSlot)
    }
    /// Returns the option in `slot`, whatever unit it states.
    fn with_unit<'a>(&self, _: OptionField, slot: &'a mut T) -> Box<dyn Setting + 'a> {
        self.plain(slot)
    }
}

impl<T> ByCode<T> for SettingOf<T> {}

struct QuantitySlot<'a, T> {
    field: OptionField,
    slot: &'a mut T,
}

impl<T: FromQuantity> Setting for QuantitySlot<'_, T> {
    fn set(&mut self, json: &str) -> Result<(), String> {
        let Some(dimension) = self.field.dimension else { return Err("states no unit".to_owned()) };
        if json == "null"
            && let Some(none) = T::none()
        {
            *self.slot = none;
            return Ok(());
        }
        let value = quantity(json, dimension.exponents)?;
        let text = text_of(json);
        let number = text.trim().strip_suffix(&si_unit(dimension.exponents)).map(str::trim_end);
        let slot = number.and_then(T::from_exact).unwrap_or_else(|| T::from_quantity(value));
        // A `Duration` is neither negative nor infinite, and not finer than a nanosecond.
        let held = slot.to_quantity().unwrap_or(f64::NAN);
        if (held - value).abs() > 1e-6 * value.abs() {
            return Err(format!("cannot be {text}"));
        }
        *self.slot = slot;
        Ok(())
    }

    fn value(&self) -> Option<String> {
        let unit = si_unit(self.field.dimension?.exponents);
        match (self.slot.to_quantity(), self.slot.to_exact()) {
            (Some(_), Some(digits)) => Some(format!("\"{digits} {unit}\"")),
            (Some(value), None) if value.is_finite() => Some(format!("\"{value} {unit}\"")),
            (Some(_), None) => None,
            (None, _) => Some("null".to_owned()),
        }
    }

    fn kind(&self) -> SettingKind {
        SettingKind::Quantity
    }

    fn number(&self) -> Option<f64> {
        self.slot.to_quantity()
    }
}

/// The value in SI of a quantity of this dimension, written as a JSON string.
pub(crate) fn quantity(json: &str, exponents: [i8; 6]) -> Result<f64, String> {
    let expected = dimension_name(exponents);
    let example = si_unit(exponents);
    let Ok(text) = from_json::<String>(json) else {
        return match from_json::<f64>(json) {
            Ok(_) => Err(format!(
                "expected {expected}, found a number without a unit; write it with one, as in \"1 {example}\""
            )),
            Err(_) => Err(format!("expected {expected}, as in \"1 {example}\", found {json}")),
        };
    };
    let read = Quantity::parse(&text)?;
    match read.exponents {
        Some(found) if found == exponents => Ok(read.value),
        Some(found) => Err(format!("expected {expected}, found {}", dimension_name(found))),
        None => Err(format!(
            "expected {expected}, found a number without a unit; write it with one, as in \"{text} {example}\""
        )),
    }
}

struct ValueSlot<'a, T> {
    slot: &'a mut T,
}

impl<T: Field> Setting for ValueSlot<'_, T> {
    fn set(&mut self, json: &str) -> Result<(), String> {
        let value: T = from_json(json).map_err(|error| error.to_string())?;
        if !value.is_finite() {
            return Err("expected a finite number".to_owned());
        }
        *self.slot = value;
        Ok(())
    }

    fn value(&self) -> Option<String> {
        self.slot.is_finite().then(|| to_json(self.slot))
    }

    fn kind(&self) -> SettingKind {
        SettingKind::Value(T::SHAPE)
    }

    fn number(&self) -> Option<f64> {
        to_json(self.slot).parse().ok()
    }
}

struct TextSlot<'a, T> {
    slot: &'a mut T,
}

impl<T: From<String> + AsRef<OsStr>> Setting for TextSlot<'_, T> {
    fn set(&mut self, json: &str) -> Result<(), String> {
        let text: String = from_json(json).map_err(|error| error.to_string())?;
        *self.slot = text.into();
        Ok(())
    }

    fn value(&self) -> Option<String> {
        (*self.slot).as_ref().to_str().map(|text| to_json(&text.to_owned()))
    }

    fn kind(&self) -> SettingKind {
        SettingKind::Text
    }
}

struct CodeSlot;

impl Setting for CodeSlot {
    fn set(&mut self, _: &str) -> Result<(), String> {
        Err("cannot be written as text: its type has no JSON form. Derive `Payload` for it, or set it in code"
            .to_owned())
    }

    fn value(&self) -> Option<String> {
        None
    }

    fn kind(&self) -> SettingKind {
        SettingKind::Code
    }
}

/// A JSON string without its quotation marks.
fn text_of(json: &str) -> String {
    from_json(json).unwrap_or_else(|_| json.to_owned())
}
