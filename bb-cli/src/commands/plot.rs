//! `bb plot`: fields over time.

mod select;
mod units;

use crate::periods::Periods;
use crate::topics::{TopicReader, find, is_named, log_ns, open};
use bb_core::nalgebra::{Quaternion, UnitQuaternion};
use bb_mcap::{Bag, Topic, Value};
use bb_plot::{Line, PALETTE, Panel, Picture, Point};
use clap::Args;
use select::{Group, Path, groups};
use std::collections::HashSet;
use std::path::PathBuf;
use std::sync::Arc;

/// Plots fields of messages over time, by the stamps in the headers, or by the log times if there are none.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// A recording or a ROS 2 bag.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Values to plot: a field of a topic with all numbers in it, or a whole topic except header and covariances.
    #[arg(value_name = "TOPIC[.FIELD]", required = true)]
    fields: Vec<String>,
    /// The SVG or PNG file to write; an existing one is replaced.
    #[arg(long, value_name = "FILE", value_parser = picture)]
    out: PathBuf,
}

const EXAMPLES: &str = "Examples:
  bb plot walk.mcap /imu --out imu.svg
  bb plot walk.mcap /imu.angular_velocity /imu.linear_acceleration.z --out imu.png
  bb plot walk.mcap '/scan.ranges[0]' --out front.svg";

/// Most viewers cannot open larger pictures.
const MOST_PANELS: usize = 40;

fn picture(file: &str) -> Result<PathBuf, String> {
    let file = PathBuf::from(file);
    Picture::check(&file, "--out").map(|()| file)
}

/// A topic and its selected fields.
struct Chosen<'a> {
    topic: &'a Topic,
    reader: TopicReader,
    groups: Vec<Group>,
    /// Times in nanoseconds, and for each group and field the values.
    times_ns: Vec<i64>,
    values: Vec<Vec<Vec<Option<f64>>>>,
}

pub(super) fn run(arguments: &Arguments) -> Result<bool, String> {
    let bag = open(&arguments.file)?;
    let mut chosen: Vec<Chosen<'_>> = Vec::new();
    for field in &arguments.fields {
        chosen.push(choose(&bag, field)?);
    }
    let broken = read(&bag, &mut chosen)?;
    let start_ns = chosen.iter().flat_map(|chosen| &chosen.times_ns).min().copied().unwrap_or(0);
    let panels: Vec<_> = chosen.iter().flat_map(|chosen| panels(chosen, start_ns)).collect();
    if panels.len() > MOST_PANELS {
        return Err(format!(
            "at most {MOST_PANELS} panels are plotted, and these are {}; name fields",
            panels.len()
        ));
    }
    let title = arguments.file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    Picture { title, panels, panel_size: (1400, 260) }.write(&arguments.out)?;
    eprintln!("plotted {}", arguments.out.display());
    match broken {
        Some(fault) => Err(fault),
        None => Ok(true),
    }
}

/// The topic and the path of a field in it. The name of a topic may contain dots: the longest match is used.
fn topic_and_field<'a, 'b>(bag: &'a Bag, field: &'b str) -> Result<(&'a Topic, &'b str), String> {
    let dots = field.match_indices('.').map(|(at, _)| at).chain([field.len()]);
    let is_topic = |end: &usize| bag.topics().iter().any(|topic| is_named(topic, &field[..*end]));
    let known = dots.rev().find(is_topic);
    let (name, path) = match known {
        Some(end) => (&field[..end], field[end..].trim_start_matches('.')),
        None => field.split_once('.').unwrap_or((field, "")),
    };
    Ok((find(bag, name)?, path))
}

/// Finds the topic, and the fields from its first message.
fn choose<'a>(bag: &'a Bag, field: &str) -> Result<Chosen<'a>, String> {
    let in_file = |fault: String| format!("{}: {fault}", bag.path().display());
    let (topic, path) = topic_and_field(bag, field)?;
    let reader = TopicReader::new(topic).map_err(in_file)?;
    let mut messages = bag.messages_in_any_encoding(&[&topic.name]).map_err(|error| error.to_string())?;
    let first = messages.next().ok_or_else(|| in_file(format!("{} has no messages", topic.name)))?;
    let first = reader.read(&first.map_err(|error| error.to_string())?)?;
    let path = Path::parse(path).map_err(|fault| in_file(format!("{field}: {fault}")))?;
    let groups = groups(&first, &path).map_err(|fault| in_file(format!("{}: {fault}", topic.name)))?;
    let values = groups.iter().map(|group| vec![Vec::new(); group.fields.len()]).collect();
    Ok(Chosen { topic, reader, groups, times_ns: Vec::new(), values })
}

/// Reads the values; returns the damage that cut the file off, if any.
fn read(bag: &Bag, chosen: &mut [Chosen<'_>]) -> Result<Option<String>, String> {
    let mut names: Vec<Arc<str>> = chosen.iter().map(|chosen| Arc::clone(&chosen.topic.name)).collect();
    names.sort_unstable();
    names.dedup();
    let is_read = |topic: &&Topic| names.contains(&topic.name);
    let progress = bb_eval::Progress::new(
        "reading",
        bag.topics().iter().filter(is_read).filter_map(|topic| topic.messages).sum(),
    );
    let mut broken = None;
    for message in bag.messages_in_any_encoding(&names).map_err(|error| error.to_string())? {
        let message = match message {
            Ok(message) => message,
            Err(error) => {
                broken = Some(error.to_string());
                break;
            }
        };
        progress.add(1);
        for chosen in chosen.iter_mut().filter(|chosen| chosen.topic.name == message.topic) {
            let value = chosen.reader.read(&message)?;
            chosen.times_ns.push(chosen.reader.stamp_ns(&message).unwrap_or_else(|| log_ns(&message)));
            for (group, values) in chosen.groups.iter().zip(&mut chosen.values) {
                for (field, values) in group.fields.iter().zip(values) {
                    values.push(field.path.of(&value).and_then(Value::as_f64));
                }
            }
        }
    }
    progress.finish();
    Ok(broken)
}

fn panels(chosen: &Chosen<'_>, start_ns: i64) -> Vec<Panel> {
    let gaps: HashSet<usize> =
        Periods::of(&chosen.times_ns).iter().flat_map(|periods| &periods.gaps).map(|gap| gap.after).collect();
    let points = |values: &mut dyn Iterator<Item = Option<f64>>| {
        let mut points: Vec<Point> = Vec::new();
        for (index, (time_ns, value)) in chosen.times_ns.iter().zip(values).enumerate() {
            let time_s = time_ns.saturating_sub(start_ns) as f64 * 1e-9;
            points.push((time_s, value));
            if gaps.contains(&index) {
                points.push((time_s, None));
            }
        }
        points
    };
    let panels = chosen.groups.iter().zip(&chosen.values).map(|(group, values)| {
        let title = format!("{} {}", chosen.topic.name, group.path);
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
        let axis = match (group.axis(), units::of(&chosen.topic.schema, &group.path)) {
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
