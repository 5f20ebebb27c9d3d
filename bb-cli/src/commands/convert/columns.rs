//! Descriptions of a CSV's columns: `gyr=gyr_*:deg/s`.

use super::source::exact_ns;
use super::units::{self, Units};
use bb_eval::filters::near;
use std::fmt;
use std::str::FromStr;

/// The quantities that a CSV may contain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum What {
    Time,
    AngularVelocity,
    SpecificForce,
    MagneticField,
    Orientation,
    Position,
    Moving,
    /// Latitude and longitude in degrees, and height.
    Fix,
    /// Standard deviations of a fix, horizontal and vertical.
    Deviations,
}

const WHATS: [(&str, What); 9] = [
    ("time", What::Time),
    ("gyr", What::AngularVelocity),
    ("acc", What::SpecificForce),
    ("mag", What::MagneticField),
    ("quat", What::Orientation),
    ("pos", What::Position),
    ("moving", What::Moving),
    ("fix", What::Fix),
    ("dev", What::Deviations),
];

impl What {
    /// The text matched by `*`, one for each column.
    fn components(self) -> &'static [&'static str] {
        match self {
            Self::Time | Self::Moving => &[""],
            Self::Orientation => &["w", "x", "y", "z"],
            Self::Fix => &["lat", "lon", "alt"],
            Self::Deviations => &["h", "v"],
            _ => &["x", "y", "z"],
        }
    }

    fn units(self) -> Units {
        match self {
            Self::Time => units::TIME,
            Self::AngularVelocity => units::RATE,
            Self::SpecificForce => units::FORCE,
            Self::MagneticField => units::FIELD,
            Self::Position | Self::Deviations => units::LENGTH,
            Self::Orientation | Self::Moving | Self::Fix => &[],
        }
    }
}

impl fmt::Display for What {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = WHATS.iter().find(|(_, what)| what == self).map_or("", |(name, _)| name);
        f.write_str(name)
    }
}

/// A column as named on the command line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Column {
    /// Index of the column, from 0.
    Number(usize),
    Name(String),
}

impl fmt::Display for Column {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(index) => write!(f, "{}", index + 1),
            Self::Name(name) => f.write_str(name),
        }
    }
}

/// One quantity and its columns: `gyr=gyr_*:deg/s`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Quantity {
    pub(super) what: What,
    /// Columns in the order of the quantity: x, y, z, or w, x, y, z.
    pub(super) columns: Vec<Column>,
    /// Factor of the conversion to SI.
    pub(super) factor: f64,
    /// Time at which the clock was zero, ns since 1970; 0 but for a time.
    pub(super) zero_ns: i64,
}

impl FromStr for Quantity {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, rest) =
            text.split_once('=').ok_or("no `=` in it; write QUANTITY=COLUMNS:UNIT, as gyr=gyr_*:deg/s")?;
        let what = WHATS.iter().find(|(known, _)| *known == name).map(|(_, what)| *what);
        let names = WHATS.map(|(name, _)| name);
        let what = what.ok_or_else(|| format!("no quantity `{name}`; {}", near(name, &names)))?;
        let (rest, zero_ns) = match rest.rsplit_once('@') {
            Some((rest, zero)) if what == What::Time => {
                let wrong = || format!("`{zero}` is no number of seconds since 1970, at which the clock was zero");
                (rest, exact_ns(zero, 1.0).ok_or_else(wrong)?)
            }
            _ => (rest, 0),
        };
        let (columns, unit) = match rest.rsplit_once(':') {
            Some((columns, unit)) => (columns, Some(unit)),
            None => (rest, None),
        };
        let mut columns = parse_columns(columns, what)?;
        let count = what.components().len();
        if columns.len() != count {
            let found = columns.len();
            return Err(format!(
                "`{name}` has {count} column{}, and {found} are named",
                if count == 1 { "" } else { "s" }
            ));
        }
        let factor = match (what, unit) {
            (_, None) | (What::Orientation, Some("wxyz")) => 1.0,
            (What::Orientation, Some("xyzw")) => {
                // A `*` is already in the quantity's own order.
                if !rest.contains('*') {
                    columns.rotate_right(1);
                }
                1.0
            }
            (What::Orientation, Some(other)) => return Err(format!("no order `{other}`; there are wxyz, xyzw")),
            (What::Moving | What::Fix, Some(_)) => return Err(format!("`{name}` has no unit to choose")),
            (_, Some(unit)) => units::factor(unit, what.units())?,
        };
        Ok(Self { what, columns, factor, zero_ns })
    }
}

fn parse_columns(text: &str, what: What) -> Result<Vec<Column>, String> {
    let mut columns = Vec::new();
    for part in text.split(',') {
        let number = |text: &str| text.parse::<usize>().ok().filter(|number| (1..=100_000).contains(number));
        let range = part.split_once('-').and_then(|(first, last)| Some((number(first)?, number(last)?)));
        match (range, number(part), part.split_once('*')) {
            (Some((first, last)), ..) if first < last && last - first < 4 => {
                columns.extend((first..=last).map(|number| Column::Number(number - 1)));
            }
            (None, Some(number), _) => columns.push(Column::Number(number - 1)),
            (None, None, Some((start, end))) => {
                let names = what.components().iter().map(|component| format!("{start}{component}{end}"));
                columns.extend(names.map(Column::Name));
            }
            (None, None, None) if !part.is_empty() && part != "0" => columns.push(Column::Name(part.to_owned())),
            _ => return Err(format!("`{part}` is not a column; name it, or count from 1, as 2-4")),
        }
    }
    Ok(columns)
}

/// All quantities of a CSV.
#[derive(Clone, Debug)]
pub(super) struct Columns {
    pub(super) quantities: Vec<Quantity>,
}

impl Columns {
    /// Checks that there is a time, or a rate instead, and that no quantity is given twice.
    pub(super) fn new(quantities: &[Quantity], rate: Option<f64>) -> Result<Self, String> {
        let columns = Self { quantities: quantities.to_vec() };
        for (index, quantity) in quantities.iter().enumerate() {
            if quantities[..index].iter().any(|other| other.what == quantity.what) {
                return Err(format!("{} is given twice", quantity.what));
            }
        }
        match (has(quantities, What::Time), rate) {
            (false, None) => Err("time is needed, as time=1:us, or --rate".into()),
            (true, Some(_)) => Err("time and --rate are both given; leave one out".into()),
            _ => Ok(columns),
        }
    }
}

/// Returns whether `what` is among the quantities.
pub(super) fn has(quantities: &[Quantity], what: What) -> bool {
    quantities.iter().any(|quantity| quantity.what == what)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn columns(text: &str) -> Result<Vec<String>, String> {
        text.parse::<Quantity>().map(|quantity| quantity.columns.iter().map(ToString::to_string).collect())
    }

    #[test]
    fn columns_are_names_numbers_and_ranges() {
        assert_eq!(columns("gyr=gyr_*:deg/s"), Ok(vec!["gyr_x".into(), "gyr_y".into(), "gyr_z".into()]));
        assert_eq!(columns("acc=2-4"), Ok(vec!["2".into(), "3".into(), "4".into()]));
        assert_eq!(columns("acc=a,7,c:g"), Ok(vec!["a".into(), "7".into(), "c".into()]));
        assert_eq!(columns("quat=5-8"), Ok(vec!["5".into(), "6".into(), "7".into(), "8".into()]));
        // Stored in the order w, x, y, z.
        assert_eq!(columns("quat=5-8:xyzw"), Ok(vec!["8".into(), "5".into(), "6".into(), "7".into()]));
        assert_eq!(columns("quat=q_*:xyzw").expect("are some")[0], "q_w");
        assert_eq!(columns("time=t:us"), Ok(vec!["t".into()]));
        let time: Quantity = "time=7:ms@1752003257.25".parse().expect("is one");
        assert_eq!((time.factor, time.zero_ns), (1e-3, 1_752_003_257_250_000_000));
        assert_eq!("time=1@-2.76".parse().map(|time: Quantity| time.zero_ns), Ok(-2_760_000_000));
    }

    #[test]
    fn mistakes_are_named() {
        let fault = |text: &str| text.parse::<Quantity>().expect_err("is wrong");
        assert_eq!(fault("gyr"), "no `=` in it; write QUANTITY=COLUMNS:UNIT, as gyr=gyr_*:deg/s");
        assert_eq!(fault("gyro=1-3"), "no quantity `gyro`; did you mean `gyr`?");
        assert_eq!(fault("gyr=1-2"), "`gyr` has 3 columns, and 2 are named");
        assert_eq!(fault("time=1,2"), "`time` has 1 column, and 2 are named");
        assert_eq!(fault("gyr=1-3:dgs/s"), "no unit `dgs/s`; there are rad/s, deg/s, dps");
        assert_eq!(fault("time=1@noon"), "`noon` is no number of seconds since 1970, at which the clock was zero");
        assert_eq!(fault("gyr=0-2"), "`gyr` has 3 columns, and 1 are named");
        assert_eq!(fault("quat=1-4:zyx"), "no order `zyx`; there are wxyz, xyzw");
        assert_eq!(fault("acc=4-2"), "`4-2` is not a column; name it, or count from 1, as 2-4");
        let of = |texts: &[&str], rate| {
            let quantities: Vec<Quantity> = texts.iter().map(|text| text.parse().expect("is one")).collect();
            Columns::new(&quantities, rate).expect_err("is wrong")
        };
        assert_eq!(of(&["gyr=1-3"], None), "time is needed, as time=1:us, or --rate");
        assert_eq!(of(&["time=1"], Some(100.0)), "time and --rate are both given; leave one out");
        assert_eq!(of(&["time=1", "acc=1-3", "acc=2-4"], None), "acc is given twice");
    }
}
