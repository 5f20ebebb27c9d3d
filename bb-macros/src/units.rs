//! Units and their dimensions. All stored values are SI; a unit is a factor to it.

use proc_macro2::{Ident, Span, TokenStream};
use quote::{ToTokens, quote};
use syn::ext::IdentExt;
use syn::parse::ParseStream;
use syn::{LitInt, Token};

/// Exponents of metre, kilogram, second, ampere, kelvin and radian.
///
/// An angle counts as a dimension, so degrees are refused for a plain number or a length.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Dimension(pub(crate) [i8; 6]);

/// A `bb_core::declaration::Dimension`.
impl ToTokens for Dimension {
    fn to_tokens(&self, tokens: &mut TokenStream) {
        let (exponents, name) = (self.0, self.name());
        tokens.extend(quote!(::bb_core::__private::Dimension { exponents: [#(#exponents),*], name: #name }));
    }
}

impl Dimension {
    pub(crate) const NONE: Self = Self([0; 6]);
    pub(crate) const LENGTH: Self = Self([1, 0, 0, 0, 0, 0]);
    pub(crate) const TIME: Self = Self([0, 0, 1, 0, 0, 0]);
    pub(crate) const ANGLE: Self = Self([0, 0, 0, 0, 0, 1]);
    pub(crate) const FREQUENCY: Self = Self([0, 0, -1, 0, 0, 0]);
    pub(crate) const VELOCITY: Self = Self([1, 0, -1, 0, 0, 0]);
    pub(crate) const ANGULAR_VELOCITY: Self = Self([0, 0, -1, 0, 0, 1]);
    pub(crate) const FORCE: Self = Self([1, 1, -2, 0, 0, 0]);
    pub(crate) const TORQUE: Self = Self([2, 1, -2, 0, 0, 0]);
    pub(crate) const MASS: Self = Self([0, 1, 0, 0, 0, 0]);
    pub(crate) const MOMENT_OF_INERTIA: Self = Self([2, 1, 0, 0, 0, 0]);
    /// N·s/m
    pub(crate) const LINEAR_DAMPING: Self = Self([0, 1, -1, 0, 0, 0]);
    /// N·m·s/rad
    pub(crate) const ANGULAR_DAMPING: Self = Self([2, 1, -1, 0, 0, -1]);

    /// Returns the name of the dimension with its article, for messages.
    pub(crate) fn name(self) -> String {
        let named = NAMED.iter().find(|(dimension, _)| *dimension == self.0);
        named.map_or_else(|| format!("a quantity in {}", self.symbol()), |(_, name)| (*name).to_owned())
    }

    /// The SI unit of such quantities; empty for a plain number.
    pub(crate) fn unit(self) -> String {
        let named = SI.iter().find(|(dimension, _)| *dimension == self);
        named.map_or_else(|| self.symbol(), |(_, unit)| (*unit).to_owned())
    }

    fn symbol(self) -> String {
        let factors = self.0.iter().zip(["m", "kg", "s", "A", "K", "rad"]).filter(|(exponent, _)| **exponent != 0);
        let factors = factors.map(|(exponent, base)| match exponent {
            1 => base.to_owned(),
            exponent => format!("{base}^{exponent}"),
        });
        factors.collect::<Vec<_>>().join("*")
    }

    fn times(self, other: Self, sign: i8) -> Self {
        let mut product = self.0;
        for (exponent, added) in product.iter_mut().zip(other.0) {
            *exponent = exponent.saturating_add(added.saturating_mul(sign));
        }
        Self(product)
    }
}

const NAMED: &[([i8; 6], &str)] = &[
    ([0, 0, 0, 0, 0, 0], "a plain number"),
    ([1, 0, 0, 0, 0, 0], "a length"),
    ([2, 0, 0, 0, 0, 0], "an area"),
    ([0, 1, 0, 0, 0, 0], "a mass"),
    ([0, 0, 1, 0, 0, 0], "a time"),
    ([0, 0, 0, 1, 0, 0], "a current"),
    ([0, 0, 0, 0, 1, 0], "a temperature"),
    ([0, 0, 0, 0, 0, 1], "an angle"),
    ([0, 0, -1, 0, 0, 0], "a frequency"),
    ([1, 0, -1, 0, 0, 0], "a velocity"),
    ([1, 0, -2, 0, 0, 0], "an acceleration"),
    ([0, 0, -1, 0, 0, 1], "an angular velocity"),
    ([0, 0, -2, 0, 0, 1], "an angular acceleration"),
    ([1, 1, -2, 0, 0, 0], "a force"),
    ([2, 1, -2, 0, 0, 0], "a torque"),
    ([2, 1, -3, 0, 0, 0], "a power"),
    ([2, 1, 0, 0, 0, 0], "a moment of inertia"),
    ([0, 1, -1, 0, 0, 0], "a damping per velocity"),
    ([2, 1, -1, 0, 0, -1], "a damping per angular velocity"),
    ([-1, 1, -2, 0, 0, 0], "a pressure"),
    ([2, 1, -3, -1, 0, 0], "a voltage"),
    ([0, 1, -2, -1, 0, 0], "a magnetic field"),
];

/// Units for which products of base units are hard to read.
const SI: &[(Dimension, &str)] = &[
    (Dimension::FREQUENCY, "Hz"),
    (Dimension::VELOCITY, "m/s"),
    (Dimension([1, 0, -2, 0, 0, 0]), "m/s^2"),
    (Dimension::ANGULAR_VELOCITY, "rad/s"),
    (Dimension([0, 0, -2, 0, 0, 1]), "rad/s^2"),
    (Dimension::FORCE, "N"),
    (Dimension::TORQUE, "N*m"),
    (Dimension([2, 1, -3, 0, 0, 0]), "W"),
    (Dimension::LINEAR_DAMPING, "N*s/m"),
    (Dimension::ANGULAR_DAMPING, "N*m*s/rad"),
    (Dimension([-1, 1, -2, 0, 0, 0]), "Pa"),
    (Dimension([2, 1, -3, -1, 0, 0]), "V"),
    (Dimension([0, 1, -2, -1, 0, 0]), "T"),
];

use std::f64::consts::PI;

/// All units with their own symbol.
#[cfg(test)]
pub(crate) fn symbols() -> impl Iterator<Item = &'static str> {
    UNITS.iter().map(|(symbol, _, _)| *symbol)
}

/// Symbol, dimension, factor to SI.
const UNITS: &[(&str, [i8; 6], f64)] = &[
    ("m", [1, 0, 0, 0, 0, 0], 1.0),
    ("km", [1, 0, 0, 0, 0, 0], 1e3),
    ("cm", [1, 0, 0, 0, 0, 0], 1e-2),
    ("mm", [1, 0, 0, 0, 0, 0], 1e-3),
    ("um", [1, 0, 0, 0, 0, 0], 1e-6),
    ("µm", [1, 0, 0, 0, 0, 0], 1e-6),
    ("kg", [0, 1, 0, 0, 0, 0], 1.0),
    ("g", [0, 1, 0, 0, 0, 0], 1e-3),
    ("s", [0, 0, 1, 0, 0, 0], 1.0),
    ("ms", [0, 0, 1, 0, 0, 0], 1e-3),
    ("us", [0, 0, 1, 0, 0, 0], 1e-6),
    ("µs", [0, 0, 1, 0, 0, 0], 1e-6),
    ("ns", [0, 0, 1, 0, 0, 0], 1e-9),
    ("min", [0, 0, 1, 0, 0, 0], 60.0),
    ("h", [0, 0, 1, 0, 0, 0], 3600.0),
    ("A", [0, 0, 0, 1, 0, 0], 1.0),
    ("mA", [0, 0, 0, 1, 0, 0], 1e-3),
    ("K", [0, 0, 0, 0, 1, 0], 1.0),
    ("rad", [0, 0, 0, 0, 0, 1], 1.0),
    ("mrad", [0, 0, 0, 0, 0, 1], 1e-3),
    ("deg", [0, 0, 0, 0, 0, 1], PI / 180.0),
    ("rev", [0, 0, 0, 0, 0, 1], 2.0 * PI),
    ("Hz", [0, 0, -1, 0, 0, 0], 1.0),
    ("kHz", [0, 0, -1, 0, 0, 0], 1e3),
    ("MHz", [0, 0, -1, 0, 0, 0], 1e6),
    ("rpm", [0, 0, -1, 0, 0, 1], 2.0 * PI / 60.0),
    ("N", [1, 1, -2, 0, 0, 0], 1.0),
    ("kN", [1, 1, -2, 0, 0, 0], 1e3),
    ("mN", [1, 1, -2, 0, 0, 0], 1e-3),
    ("J", [2, 1, -2, 0, 0, 0], 1.0),
    ("W", [2, 1, -3, 0, 0, 0], 1.0),
    ("V", [2, 1, -3, -1, 0, 0], 1.0),
    ("mV", [2, 1, -3, -1, 0, 0], 1e-3),
    ("T", [0, 1, -2, -1, 0, 0], 1.0),
    ("mT", [0, 1, -2, -1, 0, 0], 1e-3),
    ("uT", [0, 1, -2, -1, 0, 0], 1e-6),
    ("µT", [0, 1, -2, -1, 0, 0], 1e-6),
    ("nT", [0, 1, -2, -1, 0, 0], 1e-9),
    ("Pa", [-1, 1, -2, 0, 0, 0], 1.0),
    ("hPa", [-1, 1, -2, 0, 0, 0], 1e2),
    ("kPa", [-1, 1, -2, 0, 0, 0], 1e3),
    ("bar", [-1, 1, -2, 0, 0, 0], 1e5),
];

/// The tables as constants, for the runtime: units in a settings file are those of `robot!`.
pub(crate) fn tables() -> TokenStream {
    let units = UNITS
        .iter()
        .map(|(symbol, [m, kg, s, a, k, rad], factor)| quote!((#symbol, [#m, #kg, #s, #a, #k, #rad], #factor)));
    let named = NAMED.iter().map(|([m, kg, s, a, k, rad], name)| quote!(([#m, #kg, #s, #a, #k, #rad], #name)));
    let si = SI.iter().map(|(Dimension([m, kg, s, a, k, rad]), unit)| quote!(([#m, #kg, #s, #a, #k, #rad], #unit)));
    quote! {
        /// Symbol, dimension, factor to SI.
        #[allow(clippy::approx_constant, reason = "a factor is a number here")]
        const UNITS: &[(&str, [i8; 6], f64)] = &[#(#units),*];
        /// Dimensions with their names, for messages.
        const NAMED: &[([i8; 6], &str)] = &[#(#named),*];
        /// Dimensions with their SI unit for display.
        const SI: &[([i8; 6], &str)] = &[#(#si),*];
    }
}

/// A time for messages: `250 ms`. Rounded up, so that a suggested value is sufficient.
pub(crate) fn time_text(seconds: f64) -> String {
    let (factor, unit) = match seconds {
        s if s >= 1.0 => (1.0, "s"),
        s if s >= 1e-3 => (1e3, "ms"),
        s if s >= 1e-6 => (1e6, "us"),
        _ => (1e9, "ns"),
    };
    // Three decimals, without trailing zeros: hides an error in the last digit of the double.
    let number = format!("{:.3}", (seconds * factor * 1e3 - 1e-6).ceil() / 1e3);
    let number = number.trim_end_matches('0').trim_end_matches('.');
    format!("{number} {unit}")
}

/// A unit: a symbol, or a product of powers of symbols as in `kg*m/s^2`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Unit {
    pub(crate) dimension: Dimension,
    pub(crate) factor: f64,
}

impl Unit {
    const ONE: Self = Self { dimension: Dimension::NONE, factor: 1.0 };
    pub(crate) const SECOND: Self = Self { dimension: Dimension::TIME, factor: 1.0 };

    /// Parses `deg/s`, `N*m`, `m/s^2`. A `/` applies only to the next symbol.
    pub(crate) fn parse(input: ParseStream<'_>) -> syn::Result<Self> {
        let first = power(input)?;
        Self::ONE.times(first, 1).rest(input)
    }

    /// The unit attached to a literal as its suffix, and the tokens after it: `60deg/s`.
    pub(crate) fn with_suffix(suffix: &str, place: Span, input: ParseStream<'_>) -> syn::Result<Self> {
        Self::ONE.times(factor(input, suffix, place)?, 1).rest(input)
    }

    fn rest(mut self, input: ParseStream<'_>) -> syn::Result<Self> {
        loop {
            let sign = if input.peek(Token![*]) {
                input.parse::<Token![*]>()?;
                1
            } else if input.peek(Token![/]) {
                input.parse::<Token![/]>()?;
                -1
            } else {
                return Ok(self);
            };
            self = self.times(power(input)?, sign);
        }
    }

    fn times(self, other: Self, sign: i8) -> Self {
        let dimension = self.dimension.times(other.dimension, sign);
        Self { dimension, factor: self.factor * other.factor.powi(sign.into()) }
    }
}

fn symbol(input: ParseStream<'_>) -> syn::Result<Ident> {
    let place = input.span();
    input.call(Ident::parse_any).map_err(|_| syn::Error::new(place, "expected a unit, as in `m` or `deg/s`"))
}

fn power(input: ParseStream<'_>) -> syn::Result<Unit> {
    let symbol = symbol(input)?;
    factor(input, &symbol.to_string(), symbol.span())
}

/// The two units in a product written as one word, `Nm`. Only for newtons: other first letters may be prefixes.
fn product(name: &str) -> Option<(&str, &str)> {
    let is_unit = |text: &str| UNITS.iter().any(|(unit, ..)| *unit == text);
    let (first, second) = name.split_at_checked(1)?;
    (first == "N" && is_unit(second)).then_some((first, second))
}

/// A symbol with its exponent, if it has one: `s`, `s^2`.
fn factor(input: ParseStream<'_>, name: &str, place: Span) -> syn::Result<Unit> {
    // Keyboards have the micro sign, U+00B5, or the Greek letter, U+03BC.
    let name = name.replace('\u{3bc}', "\u{b5}");
    let Some((_, dimension, factor)) = UNITS.iter().find(|(unit, ..)| *unit == name) else {
        let symbols = || UNITS.iter().map(|(unit, ..)| *unit);
        let in_other_case = symbols().find(|unit| unit.eq_ignore_ascii_case(&name));
        let near = in_other_case.or_else(|| crate::names::nearest(&name, symbols()));
        let hint = match (product(&name), near) {
            (Some((first, second)), _) if in_other_case.is_none() => {
                format!("a product is written with `*`: `{first}*{second}`")
            }
            (_, Some(near)) => format!("did you mean `{near}`?"),
            (_, None) => "units are symbols, as in `m`, `s`, `deg` or `Hz`, and a count has none".to_owned(),
        };
        return Err(syn::Error::new(place, format!("unknown unit `{name}`; {hint}")));
    };
    let unit = Unit { dimension: Dimension(*dimension), factor: *factor };
    if !input.peek(Token![^]) {
        return Ok(unit);
    }
    input.parse::<Token![^]>()?;
    let place = input.span();
    let expected = "expected an exponent from 1 to 9";
    let literal: LitInt = input.parse().map_err(|_| syn::Error::new(place, expected))?;
    let exponent = literal.base10_parse::<u8>().ok().filter(|exponent| (1..=9).contains(exponent));
    let exponent = exponent.ok_or_else(|| syn::Error::new(literal.span(), expected))?;
    let power = (0..exponent).fold(Unit::ONE, |power, _| power.times(unit, 1));
    Ok(power)
}

#[cfg(test)]
mod tests {
    use super::*;
    use syn::parse::Parser;

    fn unit(text: &str) -> Result<Unit, String> {
        Unit::parse.parse_str(text).map_err(|error| error.to_string())
    }

    #[test]
    fn products_and_powers_are_put_together() -> Result<(), String> {
        assert_eq!(unit("m/s^2")?.dimension.name(), "an acceleration");
        assert_eq!(unit("N*m")?.dimension, Dimension::TORQUE);
        assert_eq!(unit("kg*m^2/s^2")?, unit("J")?);
        assert!((unit("deg/s")?.factor - PI / 180.0).abs() < 1e-15);
        assert!((unit("km/h")?.factor - 1.0 / 3.6).abs() < 1e-15);
        assert_eq!(unit("m^2*kg")?.dimension.name(), "a moment of inertia");
        assert_eq!(unit("m^3")?.dimension.name(), "a quantity in m^3");
        Ok(())
    }

    #[test]
    fn times_are_short() {
        let times = [0.02, 0.1, 1.0, 2.5, 1.0 / 3.0, 4e-6, 1e-9, 3600.0].map(time_text);
        assert_eq!(times, ["20 ms", "100 ms", "1 s", "2.5 s", "333.334 ms", "4 us", "1 ns", "3600 s"]);
    }

    #[test]
    fn si_units_are_those_of_the_language() -> Result<(), String> {
        for (_, text) in SI {
            assert_eq!(unit(text)?.dimension.unit(), *text);
        }
        assert_eq!(unit("mm^2")?.dimension.unit(), "m^2");
        Ok(())
    }

    #[test]
    fn unknown_units_are_named_with_the_nearest() {
        assert_eq!(unit("dge"), Err("unknown unit `dge`; did you mean `deg`?".into()));
        assert_eq!(unit("s^0"), Err("expected an exponent from 1 to 9".into()));
    }
}
