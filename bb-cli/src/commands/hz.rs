//! `bb hz`: the rates of topics.

use crate::topics::{TopicReader, find, is_of_events, log_ns, open, read_all};
use bb_eval::Periods;
use bb_eval::table::aligned;
use clap::Args;
use serde::Serialize;
use std::collections::HashMap;
use std::path::PathBuf;

/// Prints the rates of topics, by the stamps in the headers, or by the log times if there are none.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// A recording or a ROS 2 bag.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// The topics; by default all.
    #[arg(value_name = "TOPIC")]
    topics: Vec<String>,
    /// Prints an array of objects instead of the table.
    #[arg(long)]
    json: bool,
}

/// An object of `--json`.
#[derive(Serialize)]
struct Row<'a> {
    topic: &'a str,
    messages: usize,
    rate_hz: Option<f64>,
    period: Option<&'a Periods>,
    gaps: usize,
}

pub(super) fn run(arguments: &Arguments) -> Result<bool, String> {
    let bag = open(&arguments.file)?;
    let mut topics = Vec::new();
    for name in &arguments.topics {
        let topic = find(&bag, name)?;
        if !topics.contains(&topic) {
            topics.push(topic);
        }
    }
    if topics.is_empty() {
        topics = bag.topics().iter().collect();
    }
    let readers: HashMap<_, _> =
        topics.iter().filter_map(|topic| Some((topic.name.clone(), TopicReader::new(topic).ok()?))).collect();
    let mut times: HashMap<_, Vec<i64>> = HashMap::new();
    let broken = read_all(&bag, &topics, |message| {
        let stamp = readers.get(&message.topic).and_then(|reader| reader.stamp_ns(message));
        times.entry(message.topic.clone()).or_default().push(stamp.unwrap_or_else(|| log_ns(message)));
        Ok(())
    })?;
    let periods: Vec<_> = topics
        .iter()
        .map(|topic| {
            let times = times.get(&topic.name).map_or(&[][..], |times| times);
            // Two messages give no rate.
            let periods = Periods::of(times).filter(|_| times.len() > 2);
            (&*topic.name, times.len(), if is_of_events(topic) { periods.map(Periods::of_events) } else { periods })
        })
        .collect();
    crate::say(&if arguments.json { json(&periods)? } else { table(&periods) })?;
    broken.map_or(Ok(true), Err)
}

fn json(topics: &[(&str, usize, Option<Periods>)]) -> Result<String, String> {
    let rows: Vec<_> = topics
        .iter()
        .map(|(topic, messages, periods)| Row {
            topic,
            messages: *messages,
            rate_hz: periods.as_ref().and_then(Periods::rate_hz),
            period: periods.as_ref(),
            gaps: periods.as_ref().map_or(0, |periods| periods.gaps.len()),
        })
        .collect();
    Ok(serde_json::to_string_pretty(&rows).map_err(|error| error.to_string())? + "\n")
}

fn table(topics: &[(&str, usize, Option<Periods>)]) -> String {
    let head = ["topic", "messages", "rate", "mean", "min", "max", "std", "gaps"];
    let mut rows = vec![head.map(String::from)];
    for (topic, messages, periods) in topics {
        let ms = |value: fn(&Periods) -> f64| {
            periods.as_ref().map_or_else(|| "-".to_owned(), |periods| format!("{:.3} ms", value(periods) * 1e3))
        };
        let gaps =
            periods.as_ref().filter(|periods| periods.regular != Some(false)).map(|periods| periods.gaps.len());
        rows.push([
            (*topic).to_owned(),
            messages.to_string(),
            periods.as_ref().map_or_else(|| "-".to_owned(), |periods| periods.rate_in_words(2)),
            ms(|periods| periods.mean_s),
            ms(|periods| periods.min_s),
            ms(|periods| periods.max_s),
            ms(|periods| periods.std_s),
            gaps.map_or_else(|| "-".to_owned(), |gaps| gaps.to_string()),
        ]);
    }
    aligned(&rows, 1, usize::MAX)
}
