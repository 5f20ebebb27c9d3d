//! Numbers with units in texts: the units of `robot!`, written in the same way.

use core::f64::consts::PI;

/// Quantity that a text states.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Quantity {
    /// A number, in the unit that was asked for.
    Number(f64),
    /// A number with an unknown unit, or one of another dimension.
    OtherUnit,
    /// No number.
    None,
}

/// Reads `0.1`, `0.1 rad/s` and `5 deg/s` where `unit` is `rad/s`, an SI unit; without one the number is in it.
pub(super) fn quantity(text: &str, unit: &str) -> Quantity {
    let text = text.trim();
    if let Ok(number) = text.parse() {
        return Quantity::Number(number);
    }
    // The longest prefix that is a number: `5e-3` of `5e-3 m`, `5` of `5e m`.
    let starts = text.char_indices().map(|(index, _)| index).filter(|index| *index > 0).rev();
    let found = starts.into_iter().find_map(|end| {
        let (number, rest) = text.split_at(end);
        Some((number.trim_end().parse::<f64>().ok()?, rest.trim()))
    });
    let Some((number, given)) = found else { return Quantity::None };
    if given == unit {
        return Quantity::Number(number);
    }
    match (Unit::parse(given), Unit::parse(unit)) {
        (Some(given), Some(unit)) if given.dimension == unit.dimension => {
            Quantity::Number(number * given.factor / unit.factor)
        }
        _ => Quantity::OtherUnit,
    }
}

/// Exponents of metre, kilogram, second, ampere, kelvin and radian, and the factor to SI.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Unit {
    dimension: [i8; 6],
    factor: f64,
}

impl Unit {
    /// `deg/s`, `m/s^2`; a `/` applies to the next symbol only.
    fn parse(text: &str) -> Option<Self> {
        let mut product = Self { dimension: [0; 6], factor: 1.0 };
        let mut sign = 1;
        let mut rest = text;
        loop {
            let end = rest.find(['*', '/']).unwrap_or(rest.len());
            product = product.times(rest.get(..end)?.trim(), sign)?;
            let Some(operator) = rest.get(end..).and_then(|rest| rest.chars().next()) else { return Some(product) };
            sign = if operator == '*' { 1 } else { -1 };
            rest = rest.get(end + 1..)?;
        }
    }

    /// The product with a power of a symbol: `s`, `s^2`.
    fn times(mut self, power: &str, sign: i8) -> Option<Self> {
        let (symbol, exponent) = power.split_once('^').unwrap_or((power, "1"));
        let exponent = exponent.parse::<i8>().ok().filter(|exponent| (1..=9).contains(exponent))?;
        let (_, dimension, factor) = UNITS.iter().find(|(unit, ..)| *unit == symbol)?;
        for (sum, added) in self.dimension.iter_mut().zip(dimension) {
            *sum = sum.saturating_add(added * exponent * sign);
        }
        for _ in 0..exponent {
            self.factor = if sign > 0 { self.factor * factor } else { self.factor / factor };
        }
        Some(self)
    }
}

/// Symbol, dimension, factor to SI. `tests/architecture/` holds that it is the language's table.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_parsed_with_a_unit_and_without() {
        for (text, unit, expected) in [
            ("0.1", "rad/s", 0.1),
            (" 0.1 rad/s ", "rad/s", 0.1),
            ("180 deg/s", "rad/s", PI),
            ("60rpm", "rad/s", 2.0 * PI),
            ("500 ms", "s", 0.5),
            ("5e-3 km/s^2", "m/s^2", 5.0),
            ("30uT", "T", 30e-6),
            ("0.5 1/s", "1/s", 0.5),
            ("2 Hz", "Hz", 2.0),
            ("inf", "s", f64::INFINITY),
        ] {
            let Quantity::Number(number) = quantity(text, unit) else { panic!("{text}: no number") };
            assert!((number - expected).abs() <= 1e-15 * expected.abs() || number == expected, "{text}: {number}");
        }
    }

    #[test]
    fn other_units_and_no_numbers_are_distinguished() {
        for (text, unit) in
            [("5 m", "s"), ("5 furlong", "m"), ("5 m/", "m"), ("5 m^0", "m"), ("5 m", ""), ("5e m", "")]
        {
            assert_eq!(quantity(text, unit), Quantity::OtherUnit, "{text}");
        }
        for text in ["", "fast", "m", "-", "µ 5"] {
            assert_eq!(quantity(text, "m"), Quantity::None, "{text}");
        }
    }
}
