//! `bb plot`: fields over time.

mod select;
mod series;
mod units;

use crate::topics::{TopicReader, find, log_ns, open, read_all};
use bb_mcap::{Bag, Topic};
use bb_plot::Picture;
use clap::Args;
pub(crate) use series::{Series, write};
use std::path::PathBuf;

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

/// The file of a picture, if one can be written there.
pub(crate) fn picture(file: &str) -> Result<PathBuf, String> {
    let file = PathBuf::from(file);
    Picture::check(&file, "--out").map(|()| file)
}

/// A topic and its selected fields.
struct Chosen<'a> {
    topic: &'a Topic,
    reader: TopicReader,
    series: Series,
}

pub(super) fn run(arguments: &Arguments) -> Result<bool, String> {
    let bag = open(&arguments.file)?;
    let mut chosen: Vec<Chosen<'_>> = Vec::new();
    for field in &arguments.fields {
        chosen.push(choose(&bag, field)?);
    }
    let broken = read(&bag, &mut chosen)?;
    let title = arguments.file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let series: Vec<&Series> = chosen.iter().map(|chosen| &chosen.series).collect();
    write(title, &series, &arguments.out)?;
    eprintln!("plotted {}", arguments.out.display());
    broken.map_or(Ok(true), Err)
}

/// The topic and the path of a field in it. The name of a topic may contain dots: the longest match is used.
fn topic_and_field<'a, 'b>(bag: &'a Bag, field: &'b str) -> Result<(&'a Topic, &'b str), String> {
    let dots = field.match_indices('.').map(|(at, _)| at).chain([field.len()]);
    let is_topic = |end: &usize| bag.topics().iter().any(|topic| topic.is_named(&field[..*end]));
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
    let series = Series::new(&topic.name, &topic.schema, &first, path).map_err(in_file)?;
    Ok(Chosen { topic, reader, series })
}

/// Reads the values; returns the damage that cut the file off, if any.
fn read(bag: &Bag, chosen: &mut [Chosen<'_>]) -> Result<Option<String>, String> {
    let is_chosen = |topic: &&Topic| chosen.iter().any(|chosen| chosen.topic.name == topic.name);
    let topics: Vec<&Topic> = bag.topics().iter().filter(is_chosen).collect();
    read_all(bag, &topics, |message| {
        for chosen in chosen.iter_mut().filter(|chosen| chosen.topic.name == message.topic) {
            let value = chosen.reader.read(message)?;
            let time_ns = chosen.reader.stamp_ns(message).unwrap_or_else(|| log_ns(message));
            chosen.series.add(time_ns, &value);
        }
        Ok(())
    })
}
