//! Options that are bound to parameters.

use super::{FromQuantity, Options};
use crate::declaration::ParameterValues;
use std::time::Duration;

/// Parameters that the options of a component are bound to.
#[derive(Debug)]
pub struct Binding<O> {
    /// Puts the values of the parameters into the options.
    pub apply: fn(&mut O, &ParameterValues),
    /// Numbers of the parameters.
    pub parameters: &'static [usize],
}

impl<O> Clone for Binding<O> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<O> Copy for Binding<O> {}

impl<O: Options> Binding<O> {
    /// A binding to no parameter.
    pub const NONE: Self = Self { apply: |_, _| {}, parameters: &[] };

    /// The options with the values put in, validated.
    pub(crate) fn bound(&self, options: &O, values: &ParameterValues) -> Result<O, String> {
        let mut options = options.clone();
        (self.apply)(&mut options, values);
        options.validate()?;
        Ok(options)
    }
}

/// The type of an option that can be bound to a parameter of type `T`.
#[diagnostic::on_unimplemented(
    message = "an option of type `{Self}` cannot be bound to a parameter of type `{T}`",
    label = "is a parameter of type `{T}`"
)]
pub trait FromParameter<T> {
    /// The option's value.
    fn from_parameter(value: T) -> Self;
}

macro_rules! from_parameter {
    ($($parameter:ty => $($option:ty: |$value:ident| $make:expr),+;)*) => { $($(
        impl FromParameter<$parameter> for $option {
            fn from_parameter($value: $parameter) -> Self {
                $make
            }
        }
    )+)* };
}

from_parameter! {
    bool => bool: |value| value;
    f64 => f64: |value| value, f32: |value| (value as f32).clamp(f32::MIN, f32::MAX), Duration: |value| FromQuantity::from_quantity(value);
    // The nearest number, even beyond the option's own range: a value outside its stated range is refused.
    i64 => i64: |value| value,
        i32: |value| clamped(value),
        i16: |value| clamped(value),
        i8: |value| clamped(value),
        u64: |value| clamped(value),
        u32: |value| clamped(value),
        u16: |value| clamped(value),
        u8: |value| clamped(value),
        usize: |value| clamped(value);
    String => String: |value| value, std::path::PathBuf: |value| value.into();
}

impl<T, O: FromParameter<T>> FromParameter<T> for Option<O> {
    fn from_parameter(value: T) -> Self {
        Some(O::from_parameter(value))
    }
}

fn clamped<I: TryFrom<i64> + Bounded>(value: i64) -> I {
    I::try_from(value).unwrap_or(if value < 0 { I::LEAST } else { I::MOST })
}

trait Bounded: Sized {
    const LEAST: Self;
    const MOST: Self;
}

macro_rules! bounded {
    ($($kind:ty),*) => { $(impl Bounded for $kind {
        const LEAST: Self = <$kind>::MIN;
        const MOST: Self = <$kind>::MAX;
    })* };
}

bounded!(i8, i16, i32, u8, u16, u32, u64, usize);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_become_the_nearest_of_their_option() {
        let option = |value| <u8 as FromParameter<i64>>::from_parameter(value);
        assert_eq!([option(7), option(-1), option(i64::MAX)], [7, 0, 255]);
        assert_eq!(<Option<Duration>>::from_parameter(0.25), Some(Duration::from_millis(250)));
    }

    #[test]
    fn floats_beyond_f32_become_the_nearest() {
        assert_eq!(<f32 as FromParameter<f64>>::from_parameter(-1e300), f32::MIN);
    }
}
