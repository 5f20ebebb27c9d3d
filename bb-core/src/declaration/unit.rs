//! Quantities with units at run time: `20 ms`, `0.5 deg/s`. The units are those of `robot!`.

use bb_message::__private::nearest;

bb_macros::unit_tables!();

/// A quantity as written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Quantity {
    /// Value, in SI.
    pub(crate) value: f64,
    /// `None` for a number without a unit.
    pub(crate) exponents: Option<[i8; 6]>,
}

impl Quantity {
    /// Reads a number and a unit after it, if there is one.
    ///
    /// # Errors
    /// The text is not a number, or the unit is unknown; the error names the nearest one.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        let text = text.trim();
        let (number, unit) = split(text).ok_or_else(|| format!("expected a number with a unit, found `{text}`"))?;
        let (exponents, factor) = match unit.trim() {
            "" => (None, 1.0),
            unit => parse_unit(unit).map(|(exponents, factor)| (Some(exponents), factor))?,
        };
        let value = number * factor;
        if value.is_finite() { Ok(Self { value, exponents }) } else { Err(format!("`{text}` is too large")) }
    }
}

/// The longest prefix that is a number, and the rest: in `5e3 m` the `e` belongs to the number.
fn split(text: &str) -> Option<(f64, &str)> {
    let is_of_number = |letter: char| letter.is_ascii_digit() || "+-.eE_".contains(letter);
    let end = text.find(|letter| !is_of_number(letter)).unwrap_or(text.len());
    (1..=end).rev().find_map(|end| {
        let (number, rest) = text.split_at(end);
        Some((number.replace('_', "").parse().ok()?, rest))
    })
}

/// The dimension of a unit and its factor to SI: a symbol, or a product of powers of symbols, `kg*m/s^2`. A `/`
/// applies only to the symbol after it.
pub(crate) fn parse_unit(text: &str) -> Result<([i8; 6], f64), String> {
    let (mut exponents, mut factor) = ([0_i8; 6], 1.0);
    let mut sign = 1;
    let mut rest = text;
    loop {
        let end = rest.find(['*', '/']).unwrap_or(rest.len());
        let (symbol, of_symbol, power) = parse_power(rest[..end].trim())?;
        for (sum, exponent) in exponents.iter_mut().zip(symbol) {
            *sum = sum.saturating_add(exponent.saturating_mul(power).saturating_mul(sign));
        }
        factor *= f64::powi(of_symbol, i32::from(power * sign));
        let Some(separator) = rest[end..].chars().next() else { return Ok((exponents, factor)) };
        sign = if separator == '/' { -1 } else { 1 };
        rest = &rest[end + 1..];
    }
}

/// A symbol with its exponent, if it has one: `s`, `s^2`.
fn parse_power(text: &str) -> Result<([i8; 6], f64, i8), String> {
    let (name, power) = text.split_once('^').unwrap_or((text, "1"));
    let power: i8 = power
        .trim()
        .parse()
        .ok()
        .filter(|power| (1..=9).contains(power))
        .ok_or_else(|| format!("`{text}`: expected an exponent from 1 to 9"))?;
    // Keyboards have the micro sign, U+00B5, or the Greek letter, U+03BC.
    let name = name.trim().replace('\u{3bc}', "\u{b5}");
    match UNITS.iter().find(|(symbol, ..)| *symbol == name) {
        Some((_, exponents, factor)) => Ok((*exponents, *factor, power)),
        None => {
            let hint = match nearest(&name, UNITS.iter().map(|(symbol, ..)| *symbol)) {
                Some(near) => format!("did you mean `{near}`?"),
                None => "units are symbols, as in `m`, `s`, `deg` or `Hz`".to_owned(),
            };
            Err(format!("unknown unit `{name}`; {hint}"))
        }
    }
}

/// A dimension with its article, for messages.
pub(crate) fn dimension_name(exponents: [i8; 6]) -> String {
    let named = NAMED.iter().find(|(dimension, _)| *dimension == exponents);
    named.map_or_else(|| format!("a quantity in {}", symbol(exponents)), |(_, name)| (*name).to_owned())
}

/// The SI unit of a dimension; empty for a plain number.
pub(crate) fn si_unit(exponents: [i8; 6]) -> String {
    let named = SI.iter().find(|(dimension, _)| *dimension == exponents);
    named.map_or_else(|| symbol(exponents), |(_, unit)| (*unit).to_owned())
}

fn symbol(exponents: [i8; 6]) -> String {
    let factors = exponents.iter().zip(["m", "kg", "s", "A", "K", "rad"]).filter(|(exponent, _)| **exponent != 0);
    let factors = factors.map(|(exponent, base)| match exponent {
        1 => base.to_owned(),
        exponent => format!("{base}^{exponent}"),
    });
    factors.collect::<Vec<_>>().join("*")
}

#[cfg(test)]
mod tests {
    use super::*;
    use bb_tests::laws;
    use proptest::prelude::*;

    fn si(text: &str) -> Result<(f64, String), String> {
        Quantity::parse(text).map(|read| (read.value, read.exponents.map_or(String::new(), si_unit)))
    }

    #[test]
    fn quantities_are_read_as_in_the_language() {
        let read = |value: f64, unit: &str| Ok((value, unit.to_owned()));
        assert_eq!(si("20 ms"), read(0.02, "s"));
        assert_eq!(si("20ms"), read(0.02, "s"));
        assert_eq!(si(" -1.5e3 m/s^2 "), read(-1500.0, "m/s^2"));
        assert_eq!(si("180 deg/s"), read(std::f64::consts::PI, "rad/s"));
        assert_eq!(si("1_000 Hz"), read(1000.0, "Hz"));
        assert_eq!(si("12 \u{3bc}T"), read(12.0 * 1e-6, "T"));
        assert_eq!(si("2.5"), read(2.5, ""));
        assert_eq!(si("kg*m^2/s^2"), Err("expected a number with a unit, found `kg*m^2/s^2`".into()));
        assert_eq!(si("inf s"), Err("expected a number with a unit, found `inf s`".into()));
        assert_eq!(si("1e308 km"), Err("`1e308 km` is too large".into()));
        assert_eq!(si("3 dge"), Err("unknown unit `dge`; did you mean `deg`?".into()));
        assert_eq!(si("3 s^0"), Err("`s^0`: expected an exponent from 1 to 9".into()));
        assert!(si("3 m*").is_err() && si("3 /s").is_err() && si("").is_err());
    }

    laws! {
        #[test]
        fn no_text_panics(text in ".{0,24}") {
            let _ = Quantity::parse(&text);
        }

        #[test]
        fn every_unit_scales(value in -1e9..1e9_f64, index in 0..UNITS.len()) {
            let (symbol, exponents, factor) = UNITS[index];
            let read = Quantity::parse(&format!("{value} {symbol}"));
            prop_assert_eq!(read, Ok(Quantity { value: value * factor, exponents: Some(exponents) }));
        }
    }
}
