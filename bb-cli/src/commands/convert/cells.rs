//! The rows of a CSV as quantities in SI.

use super::columns::{Column, Columns, Quantity, What};
use super::entry::{Entry, FIX, What as Content};
use super::source::{LONGEST_HEAD, Source, exact_ns, is_number};
use bb_core::nalgebra::{Matrix3, Vector3};
use bb_core::payload::{GeodeticPosition, GnssFix, GnssServices, GnssStatus};
use bb_eval::filters::near;
use csv::StringRecord;
use std::path::Path;
use std::sync::Arc;

/// The last time of a ROS stamp, whose seconds have 32 bits, ns.
pub(super) const LAST_NS: i64 = i32::MAX as i64 * 1_000_000_000 + 999_999_999;

/// The source of the rows' times.
#[derive(Clone, Copy, Debug)]
pub(super) enum Times {
    Column,
    /// Rate in Hz; the first row is at zero.
    Rate(f64),
}

/// The contents of a row.
#[derive(Clone, Debug, Default, PartialEq)]
struct Row {
    time_ns: i64,
    /// Angular velocity, rad/s.
    angular_velocity: Option<[f64; 3]>,
    /// Specific force, m/s².
    specific_force: Option<[f64; 3]>,
    /// Magnetic field, T.
    magnetic_field: Option<[f64; 3]>,
    /// Components w, x, y, z; NaN if unknown.
    orientation: Option<[f64; 4]>,
    /// Position, m; NaN if unknown.
    position: Option<[f64; 3]>,
    moving: Option<bool>,
    /// Latitude and longitude, rad, and height, m; NaN if unknown.
    fix: Option<[f64; 3]>,
    /// Standard deviations of the fix, horizontal and vertical, m; NaN if unknown.
    deviations: Option<[f64; 2]>,
}

impl Row {
    fn entries(self, topic: &Arc<str>) -> Vec<Entry> {
        let moving = self.moving.map(Content::Moving);
        let inertial = match (self.angular_velocity, self.specific_force) {
            (Some(angular_velocity), Some(specific_force)) => {
                Some(Content::Imu { angular_velocity, specific_force })
            }
            (Some(rate), None) => Some(Content::AngularVelocity(rate)),
            (None, Some(force)) => Some(Content::SpecificForce(force)),
            (None, None) => None,
        };
        let field = self.magnetic_field.map(Content::MagneticField);
        let truth = (self.orientation.is_some() || self.position.is_some()).then(|| Content::Truth {
            orientation: self.orientation.unwrap_or([f64::NAN; 4]),
            position: self.position.unwrap_or([f64::NAN; 3]),
        });
        let fix = self.fix.map(|place| fix(place, self.deviations));
        let fix = fix.map(|fix| Content::Fix { topic: Arc::clone(topic), fix });
        let all = [moving, inertial, field, truth, fix].into_iter().flatten();
        all.map(|what| Entry { time_ns: self.time_ns, what }).collect()
    }
}

fn fix([latitude_rad, longitude_rad, height]: [f64; 3], deviations: Option<[f64; 2]>) -> GnssFix {
    let is_known = latitude_rad.is_finite() && longitude_rad.is_finite();
    let position = is_known.then(|| GeodeticPosition {
        latitude_rad,
        longitude_rad,
        altitude: Some(height).filter(|height| height.is_finite()),
    });
    let deviations = deviations.filter(|deviations| deviations.iter().all(|x| x.is_finite() && *x > 0.0));
    let covariance = deviations.map(|[h, v]| Matrix3::from_diagonal(&Vector3::new(h * h, h * h, v * v)));
    GnssFix {
        status: if is_known { GnssStatus::Fix } else { GnssStatus::NoFix },
        services: GnssServices::default(),
        position,
        position_covariance: covariance,
    }
}

/// A CSV being read.
pub(super) struct Table {
    source: Source,
    times: Times,
    quantities: Vec<(Quantity, Vec<usize>)>,
    /// Number of lines before the first row.
    head: usize,
    /// The first row with its line, until it is returned.
    first: Option<(u64, StringRecord)>,
    /// The number of rows returned.
    rows: u64,
    /// Topic of the fixes.
    topic: Arc<str>,
}

impl Table {
    /// Reads the header, and finds the columns. A file `-` is the standard input.
    pub(super) fn open(file: &Path, columns: &Columns, times: Times, topic: Option<&str>) -> Result<Self, String> {
        let mut source = Source::open(file)?;
        let mut head: Vec<StringRecord> = Vec::new();
        let first = loop {
            let Some((line, record)) = source.next()? else {
                return Err(match head.is_empty() {
                    true => "it is empty".into(),
                    false => "it has no line that begins with a number".to_owned(),
                });
            };
            if record.get(0).is_some_and(is_number) {
                break (line, record);
            }
            if head.len() == LONGEST_HEAD {
                return Err(format!("none of the first {LONGEST_HEAD} lines begins with a number"));
            }
            head.push(record);
        };
        let find = |column: &Column| find(column, &head);
        let quantities = columns.quantities.iter().map(|quantity| {
            let indices = quantity.columns.iter().map(find).collect::<Result<Vec<_>, _>>()?;
            Ok((quantity.clone(), indices))
        });
        let quantities = quantities.collect::<Result<_, String>>()?;
        let topic = topic.unwrap_or(FIX).into();
        Ok(Self { source, times, quantities, head: head.len(), first: Some(first), rows: 0, topic })
    }

    /// The length of the file; `None` for a pipe.
    pub(super) fn bytes(&self) -> Option<u64> {
        self.source.bytes()
    }

    /// The current position in the file.
    pub(super) fn byte(&self) -> u64 {
        self.source.byte()
    }

    /// The number of lines before the first row.
    pub(super) fn head(&self) -> usize {
        self.head
    }

    /// The entries of the next row; an error names its line and column.
    pub(super) fn next(&mut self) -> Result<Option<Vec<Entry>>, String> {
        let first = self.first.take();
        let Some((line, record)) = first.map_or_else(|| self.source.next(), |first| Ok(Some(first)))? else {
            return Ok(None);
        };
        let mut row = Row::default();
        if let Times::Rate(rate) = self.times {
            row.time_ns = (self.rows as f64 / rate * 1e9).round() as i64;
        }
        for (quantity, indices) in &self.quantities {
            take(&record, quantity, indices, &mut row).map_err(|fault| format!("line {line}, {fault}"))?;
        }
        self.rows += 1;
        Ok(Some(row.entries(&self.topic)))
    }
}

/// Finds a column's index by its name in any line of the header. A name in the header may end with a unit in brackets.
fn find(column: &Column, head: &[StringRecord]) -> Result<usize, String> {
    let name = match column {
        Column::Number(index) => return Ok(*index),
        Column::Name(name) => name,
    };
    let bare = |cell: &str| cell.split(['[', '(']).next().unwrap_or("").trim().trim_start_matches('#').to_owned();
    let is_same = |cell: &str| cell.eq_ignore_ascii_case(name) || bare(cell).eq_ignore_ascii_case(name);
    for line in head {
        let mut found = line.iter().enumerate().filter(|(_, cell)| is_same(cell)).map(|(index, _)| index);
        match (found.next(), found.next()) {
            (Some(index), None) => return Ok(index),
            (Some(_), Some(_)) => return Err(format!("several columns are called `{name}`; use numbers, from 1")),
            (None, _) => {}
        }
    }
    let names: Vec<String> = head.iter().flat_map(StringRecord::iter).map(bare).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).filter(|name| !name.is_empty()).collect();
    match names.is_empty() {
        true => Err(format!("no column `{name}`, since the CSV has no head; use numbers, from 1")),
        false => Err(format!("no column `{name}`; {}", near(name, &names))),
    }
}

fn take(record: &StringRecord, quantity: &Quantity, indices: &[usize], row: &mut Row) -> Result<(), String> {
    let cells = Cells { record, quantity, indices };
    match quantity.what {
        What::Time => row.time_ns = cells.time_ns()?,
        What::AngularVelocity => row.angular_velocity = Some(cells.measured()?),
        What::SpecificForce => row.specific_force = Some(cells.measured()?),
        What::MagneticField => {
            // A sensor slower than the IMU has no value in many rows.
            let field = cells.known_or_nan()?;
            row.magnetic_field = field.iter().all(|value: &f64| value.is_finite()).then_some(field);
        }
        What::Orientation => row.orientation = Some(cells.known_or_nan()?),
        What::Position => row.position = Some(cells.known_or_nan()?),
        What::Fix => {
            let [latitude, longitude, height] = cells.known_or_nan()?;
            row.fix = Some([latitude.to_radians(), longitude.to_radians(), height]);
        }
        What::Deviations => row.deviations = Some(cells.known_or_nan()?),
        What::Moving => row.moving = Some(cells.number(0)? != 0.0),
    }
    Ok(())
}

/// The cells of one quantity.
struct Cells<'a> {
    record: &'a StringRecord,
    quantity: &'a Quantity,
    indices: &'a [usize],
}

impl Cells<'_> {
    fn cell(&self, component: usize) -> Result<&str, String> {
        let index = self.indices[component];
        self.record.get(index).ok_or_else(|| {
            let columns = self.record.len();
            self.fault(component, format!("is missing, since the line has {columns} columns"))
        })
    }

    fn fault(&self, component: usize, fault: impl std::fmt::Display) -> String {
        let column = match &self.quantity.columns[component] {
            Column::Number(_) => self.quantity.what.to_string(),
            Column::Name(name) => name.clone(),
        };
        format!("column {} ({column}): {fault}", self.indices[component] + 1)
    }

    fn number(&self, component: usize) -> Result<f64, String> {
        let cell = self.cell(component)?;
        let value: Result<f64, _> = cell.parse();
        let fault = match value {
            Ok(value) if !value.is_infinite() => return Ok(value),
            Ok(_) => "is not a finite number",
            Err(_) if is_number(cell) => {
                "has a decimal comma; make it a point, as `tr , .` does where cells are not separated by commas"
            }
            Err(_) => "is not a number",
        };
        Err(self.fault(component, format!("`{cell}` {fault}")))
    }

    /// A number in SI.
    fn in_si(&self, component: usize) -> Result<f64, String> {
        let value = self.number(component)? * self.quantity.factor;
        match value.is_infinite() {
            true => Err(self.fault(component, format!("`{}` is too large", self.cell(component)?))),
            false => Ok(value),
        }
    }

    /// Required numbers in SI.
    fn measured<const N: usize>(&self) -> Result<[f64; N], String> {
        let mut values = [0.0; N];
        for (component, value) in values.iter_mut().enumerate() {
            *value = self.in_si(component)?;
        }
        Ok(values)
    }

    /// Numbers in SI; NaN for empty cells.
    fn known_or_nan<const N: usize>(&self) -> Result<[f64; N], String> {
        let mut values = [f64::NAN; N];
        for (component, value) in values.iter_mut().enumerate() {
            if !self.cell(component)?.is_empty() {
                *value = self.in_si(component)?;
            }
        }
        Ok(values)
    }

    fn time_ns(&self) -> Result<i64, String> {
        let cell = self.cell(0)?;
        // A float of nanoseconds since 1970 cannot resolve single nanoseconds.
        let time_ns = match exact_ns(cell, self.quantity.factor) {
            Some(time_ns) => time_ns,
            None => match self.number(0)? {
                nan if nan.is_nan() => return Err(self.fault(0, format!("`{cell}` is not a time"))),
                // Out of range it saturates, and is refused below.
                time => (time * self.quantity.factor * 1e9).round() as i64,
            },
        };
        let time_ns = time_ns.saturating_add(self.quantity.zero_ns);
        let fault = match time_ns {
            ..0 => "is before 1970, where no time of a bag is; say when the clock was zero, as time=1@1700000000",
            0..=LAST_NS => return Ok(time_ns),
            _ => "is after 2038, which no stamp of ROS holds; is the unit another (s, ms, us, ns)?",
        };
        Err(self.fault(0, format!("`{cell}` {fault}")))
    }
}
