//! The numbers of a topic over time, and their picture.

use super::select::{Group, Path, groups};
use super::units;
use bb_core::nalgebra::{Quaternion, UnitQuaternion};
use bb_eval::Periods;
use bb_mcap::Value;
use bb_plot::{Line, PALETTE, Panel, Picture, Point};
use std::collections::HashSet;

/// Largest number of panels; most viewers cannot open larger pictures.
const MOST_PANELS: usize = 40;

/// The selected fields of a topic.
pub(crate) struct Series {
    /// The topic.
    name: String,
    /// The type of its messages, which gives the units.
    schema: String,
    groups: Vec<Group>,
    /// Times in nanoseconds, and for each group and field the values.
    times_ns: Vec<i64>,
    values: Vec<Vec<Vec<Option<f64>>>>,
}

impl Series {
    /// The numbers at and below `field` in messages like the `first`; all but the header and covariances if it is empty.
    pub(crate) fn new(name: &str, schema: &str, first: &Value, field: &str) -> Result<Self, String> {
        let path = Path::parse(field).map_err(|fault| format!("{name}.{field}: {fault}"))?;
        let groups = groups(first, &path).map_err(|fault| format!("{name}: {fault}"))?;
        let values = groups.iter().map(|group| vec![Vec::new(); group.fields.len()]).collect();
        Ok(Self { name: name.to_owned(), schema: schema.to_owned(), groups, times_ns: Vec::new(), values })
    }

    /// Adds the numbers of a message.
    pub(crate) fn add(&mut self, time_ns: i64, message: &Value) {
        self.times_ns.push(time_ns);
        for (group, values) in self.groups.iter().zip(&mut self.values) {
            for (field, values) in group.fields.iter().zip(values) {
                values.push(field.path.of(message).and_then(Value::as_f64));
            }
        }
    }
}

/// Writes all of them as one picture, over the time since the first.
pub(crate) fn write(title: String, all: &[&Series], out: &std::path::Path) -> Result<(), String> {
    let start_ns = all.iter().flat_map(|series| &series.times_ns).min().copied().unwrap_or(0);
    let panels: Vec<_> = all.iter().flat_map(|series| panels(series, start_ns)).collect();
    if panels.len() > MOST_PANELS {
        return Err(format!(
            "at most {MOST_PANELS} panels are plotted, and these are {}; name fields",
            panels.len()
        ));
    }
    Picture { title, panels, panel_size: (1400, 260) }.write(out)
}

fn panels(series: &Series, start_ns: i64) -> Vec<Panel> {
    let gaps: HashSet<usize> =
        Periods::of(&series.times_ns).iter().flat_map(|periods| &periods.gaps).map(|gap| gap.after).collect();
    let points = |values: &mut dyn Iterator<Item = Option<f64>>| {
        let mut points: Vec<Point> = Vec::new();
        for (index, (time_ns, value)) in series.times_ns.iter().zip(values).enumerate() {
            let time_s = time_ns.saturating_sub(start_ns) as f64 * 1e-9;
            points.push((time_s, value));
            if gaps.contains(&index) {
                points.push((time_s, None));
            }
        }
        points
    };
    let panels = series.groups.iter().zip(&series.values).map(|(group, values)| {
        let title = format!("{} {}", series.name, group.path);
        let colour = |index: usize| PALETTE[index % PALETTE.len()];
        if group.is_quaternion() {
            let angles = angles(values);
            let lines = ["roll", "pitch", "yaw"].into_iter().enumerate().map(|(index, name)| {
                let mut values = angles.iter().map(|angles| angles.map(|angles| angles[index].to_degrees()));
                Line::degrees(name, colour(index), 1, &points(&mut values))
            });
            return Panel::new(format!("{} (deg)", group.axis()), lines.collect()).title(title);
        }
        let lines = group.fields.iter().zip(values).enumerate().map(|(index, (field, values))| {
            Line::new(field.label.clone(), colour(index), 1, &points(&mut values.iter().copied()))
        });
        let axis = match (group.axis(), units::of(&series.schema, &group.path)) {
            (name, Some(unit)) => format!("{name} ({unit})"),
            (name, None) => name,
        };
        Panel::new(axis, lines.collect()).title(title)
    });
    panels.collect()
}

/// Roll, pitch and yaw, rad, of the components x, y, z, w of quaternions.
fn angles(values: &[Vec<Option<f64>>]) -> Vec<Option<[f64; 3]>> {
    let [x, y, z, w] = values else { return Vec::new() };
    let of = |index: usize| {
        let component = |values: &[Option<f64>]| values.get(index).copied().flatten();
        let read = Quaternion::new(component(w)?, component(x)?, component(y)?, component(z)?);
        let (roll, pitch, yaw) = UnitQuaternion::try_new(read, 0.5)?.euler_angles();
        Some([roll, pitch, yaw])
    };
    (0..x.len()).map(of).collect()
}
