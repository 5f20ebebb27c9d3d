//! Units by their names in CSV headers.

/// The units of a quantity: names and factors to SI, the default first.
pub(super) type Units = &'static [(&'static str, f64)];

pub(super) const TIME: Units = &[("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("µs", 1e-6), ("μs", 1e-6), ("ns", 1e-9)];
pub(super) const RATE: Units =
    &[("rad/s", 1.0), ("deg/s", std::f64::consts::PI / 180.0), ("dps", std::f64::consts::PI / 180.0)];
/// The standard gravity denoted by g in data sheets, m/s².
const GRAVITY: f64 = 9.80665;
pub(super) const FORCE: Units =
    &[("m/s2", 1.0), ("m/s^2", 1.0), ("m/s²", 1.0), ("g", GRAVITY), ("mg", GRAVITY * 1e-3)];
pub(super) const FIELD: Units =
    &[("T", 1.0), ("mT", 1e-3), ("uT", 1e-6), ("µT", 1e-6), ("μT", 1e-6), ("nT", 1e-9), ("G", 1e-4), ("mG", 1e-7)];
pub(super) const LENGTH: Units = &[("m", 1.0), ("cm", 1e-2), ("mm", 1e-3)];

/// The factor of a unit, which may begin with a number: `50uT`.
pub(super) fn factor(text: &str, units: Units) -> Result<f64, String> {
    let is_number = |end: &usize| text.is_char_boundary(*end) && text[..*end].parse::<f64>().is_ok();
    // The longest number at the beginning.
    let end = (1..=text.len()).rev().find(is_number).unwrap_or(0);
    let (number, name) = text.split_at(end);
    let number: f64 = if number.is_empty() { 1.0 } else { number.parse().map_err(|_| "no number".to_owned())? };
    let found = units.iter().find(|(known, _)| *known == name).map(|(_, factor)| number * factor);
    let names =
        || units.iter().map(|(name, _)| *name).filter(|name| name.is_ascii()).collect::<Vec<_>>().join(", ");
    match found {
        Some(factor) if factor.is_finite() && factor > 0.0 => Ok(factor),
        Some(_) => Err(format!("the factor of `{text}` must be above 0")),
        None => Err(format!("no unit `{name}`; there are {}", names())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_lead_to_si() {
        let close = |text, units, wanted: f64| {
            let found = factor(text, units).expect("it is one");
            assert!((found / wanted - 1.0).abs() < 1e-12, "{text} {found}");
        };
        close("deg/s", RATE, std::f64::consts::PI / 180.0);
        close("mg", FORCE, 9.80665e-3);
        close("uT", FIELD, 1e-6);
        close("50uT", FIELD, 5e-5);
        close("1e-3rad/s", RATE, 1e-3);
        close("mG", FIELD, 1e-7);
        assert_eq!(factor("gauss", FIELD), Err("no unit `gauss`; there are T, mT, uT, nT, G, mG".into()));
        assert_eq!(factor("0uT", FIELD), Err("the factor of `0uT` must be above 0".into()));
        assert_eq!(factor("-2uT", FIELD), Err("the factor of `-2uT` must be above 0".into()));
        assert_eq!(factor("5", LENGTH), Err("no unit ``; there are m, cm, mm".into()));
    }
}
