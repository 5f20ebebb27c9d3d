//! Numbers with units: `20 ms`, `-90 deg`, `9.81 m/s^2`, also without a space, `20ms`.

use super::tokens::{place_since, starts_item};
use crate::diagnostics::Place;
use crate::units::{Dimension, Unit};
use proc_macro2::Ident;
use syn::ext::IdentExt;
use syn::parse::ParseStream;
use syn::{Lit, LitInt, Token};

/// A literal number with its unit, if it has one.
#[derive(Clone, Debug)]
pub(crate) struct Quantity {
    /// Value, in SI.
    pub(crate) value: f64,
    pub(crate) dimension: Dimension,
    /// `true` if a unit was written.
    pub(crate) has_unit: bool,
    pub(crate) place: Place,
}

/// Spellings of π by people who think in radians.
const PI: [&str; 6] = ["pi", "PI", "M_PI", "math", "np", "std"];
/// Spellings of a setting that does not apply.
const NO_NUMBER: [&str; 9] = ["None", "none", "null", "nil", "inf", "infinity", "infinite", "never", "unlimited"];
const ANGLES: &str = "expected a number with its unit; nothing is computed here, write `90 deg` for π / 2";
const NAMES: &str = "expected a number with its unit; write it out, the value of a name is not known here";

impl Quantity {
    /// Returns whether a number starts here.
    pub(crate) fn peek(input: ParseStream<'_>) -> bool {
        let is_number =
            |input: ParseStream<'_>| matches!(input.fork().parse::<Lit>(), Ok(Lit::Int(_) | Lit::Float(_)));
        if input.peek(Token![-]) {
            let ahead = input.fork();
            return ahead.parse::<Token![-]>().is_ok() && is_number(&ahead);
        }
        is_number(input)
    }

    /// Reads a number, and the unit if one follows.
    pub(crate) fn parse(input: ParseStream<'_>) -> syn::Result<Self> {
        decimal_comma(&input.fork()).map_or(Ok(()), Err)?;
        Self::parse_element(input)
    }

    /// Parses a quantity in a list, where a number may follow a comma.
    pub(crate) fn parse_element(input: ParseStream<'_>) -> syn::Result<Self> {
        let start = input.cursor();
        let sign = if input.peek(Token![-]) {
            input.parse::<Token![-]>()?;
            -1.0
        } else {
            1.0
        };
        let place = input.span();
        let expected = match input.fork().call(Ident::parse_any).map(|word| word.to_string()) {
            Ok(word) if PI.contains(&&*word) => ANGLES,
            Ok(word) if NO_NUMBER.contains(&&*word) => {
                "expected a number with its unit; leave the setting out to have its default"
            }
            Ok(_) => NAMES,
            Err(_) => "expected a number with its unit",
        };
        let literal: Lit = input.parse().map_err(|_| syn::Error::new(place, expected))?;
        let (digits, suffix) = match &literal {
            Lit::Int(literal) => {
                let text = literal.to_string();
                let has_radix = text.starts_with("0x") || text.starts_with("0o") || text.starts_with("0b");
                if has_radix {
                    let message = "a number in hexadecimal, octal or binary takes no unit; write it in decimal";
                    return Err(syn::Error::new(literal.span(), message));
                }
                (literal.base10_digits().to_owned(), literal.suffix().to_owned())
            }
            Lit::Float(literal) => (literal.base10_digits().to_owned(), literal.suffix().to_owned()),
            other => return Err(syn::Error::new(other.span(), "expected a number with its unit")),
        };
        let number = digits.parse::<f64>().ok().filter(|number| number.is_finite());
        let number = number.ok_or_else(|| syn::Error::new(literal.span(), "this number is too large"))?;
        let unit = if !suffix.is_empty() {
            Some(Unit::with_suffix(&suffix, literal.span(), input)?)
        } else if input.peek(Ident::peek_any) && !starts_item(input) {
            Some(Unit::parse(input)?)
        } else {
            None
        };
        if input.peek(Token![*]) || input.peek(Token![/]) || input.peek(Token![+]) {
            return Err(input.error("a number is written out, with its unit after it; nothing is computed here"));
        }
        let (dimension, factor) = unit.map_or((Dimension::NONE, 1.0), |unit| (unit.dimension, unit.factor));
        let value = sign * scaled(number, factor);
        if !value.is_finite() {
            return Err(syn::Error::new(literal.span(), "this number is too large"));
        }
        Ok(Self { value, dimension, has_unit: unit.is_some(), place: place_since(start, input) })
    }
}

/// The error for a decimal comma, `0,5`, if such a number starts here.
pub(super) fn decimal_comma(input: ParseStream<'_>) -> Option<syn::Error> {
    let start = input.cursor();
    input.parse::<Option<Token![-]>>().ok()?;
    let whole: LitInt = input.parse().ok()?;
    input.parse::<Token![,]>().ok()?;
    let digits: LitInt = input.parse().ok()?;
    if !whole.suffix().is_empty() {
        return None;
    }
    let message = format!("a decimal point is written `.`; try `{whole}.{digits}`");
    Some(place_since(start, input).syntax(message))
}

/// Divides if the factor is the inverse of a whole number, so that `20 ms` is the double nearest to 0.02.
fn scaled(number: f64, factor: f64) -> f64 {
    let inverse = (1.0 / factor).round();
    if factor < 1.0 && (1.0 / inverse - factor).abs() <= f64::EPSILON * factor {
        number / inverse
    } else {
        number * factor
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use syn::parse::Parser;

    fn quantity(text: &str) -> Result<(f64, String), String> {
        let quantity = Quantity::parse.parse_str(text).map_err(|error| error.to_string())?;
        Ok((quantity.value, quantity.dimension.name()))
    }

    #[test]
    fn glued_and_spaced_are_the_same() {
        for (glued, spaced) in [("20ms", "20 ms"), ("-90deg", "-90 deg"), ("5e-3m", "5e-3 m"), ("1µs", "1 µs")] {
            assert_eq!(quantity(glued), quantity(spaced));
        }
        assert_eq!(quantity("60deg/s"), quantity("60 deg/s"));
        assert_eq!(quantity("5N*m"), Ok((5.0, "a torque".into())));
    }

    #[test]
    fn values_are_si_and_exact_where_they_can_be() {
        assert_eq!(quantity("20 ms"), Ok((0.02, "a time".into())));
        assert_eq!(quantity("9.80665 m/s^2"), Ok((9.80665, "an acceleration".into())));
        assert_eq!(quantity("0.1 km"), Ok((100.0, "a length".into())));
        assert_eq!(quantity("3"), Ok((3.0, "a plain number".into())));
    }

    #[test]
    fn traps_are_refused() {
        assert!(quantity("0xFFdeg").is_err());
        assert!(quantity("3 parsec").is_err());
        assert!(quantity("1e999 m").is_err());
        assert!(quantity("\"3 m\"").is_err());
    }
}
