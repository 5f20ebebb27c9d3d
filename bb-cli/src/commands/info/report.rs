//! The output of `bb info`.

use super::date::date;
use super::remark::Remark;
use super::scan::{Content, TopicContent};
use bb_eval::Periods;
use bb_eval::table::aligned;
use serde::Serialize;

/// A file as an object of `--json`.
#[derive(Serialize)]
struct FileRow<'a> {
    file: String,
    bytes: u64,
    /// First log time, and the time from the first to the last.
    start_ns: Option<i64>,
    duration_s: Option<f64>,
    messages: usize,
    /// Place and cause of the damage that cuts the file off; `messages` counts those before it, which `bb recover` saves.
    damage: Option<&'a str>,
    topics: Vec<TopicRow<'a>>,
}

#[derive(Serialize)]
struct TopicRow<'a> {
    name: &'a str,
    #[serde(rename = "type")]
    schema: &'a str,
    encoding: &'a str,
    frames: &'a [String],
    messages: usize,
    rate_hz: Option<f64>,
    period: Option<&'a Periods>,
    gaps: usize,
    remarks: &'a [Remark],
}

pub(super) fn json(contents: &[Content]) -> Result<String, String> {
    let rows: Vec<_> = contents
        .iter()
        .map(|content| FileRow {
            file: content.file.display().to_string(),
            bytes: content.bytes,
            start_ns: content.span_ns.map(|(start, _)| start),
            duration_s: content.span_ns.map(|(start, end)| (end - start) as f64 * 1e-9),
            messages: content.messages,
            damage: content.damage.as_deref(),
            topics: content.topics.iter().map(topic_row).collect(),
        })
        .collect();
    Ok(serde_json::to_string_pretty(&rows).map_err(|error| error.to_string())? + "\n")
}

fn topic_row(topic: &TopicContent) -> TopicRow<'_> {
    TopicRow {
        name: &topic.name,
        schema: &topic.schema,
        encoding: &topic.encoding,
        frames: &topic.frames,
        messages: topic.messages,
        rate_hz: topic.periods.as_ref().and_then(Periods::rate_hz),
        period: topic.periods.as_ref(),
        gaps: topic.periods.as_ref().map_or(0, |periods| periods.gaps.len()),
        remarks: &topic.remarks,
    }
}

pub(super) fn text(contents: &[Content]) -> String {
    contents.iter().map(file_text).collect::<Vec<_>>().join("\n")
}

fn file_text(content: &Content) -> String {
    let file = content.file.display();
    let mut text = format!("{file}: {}, ", size(content.bytes));
    text += &match content.span_ns {
        Some((start, end)) => format!(
            "{:.1} s from {}, {} messages on {} topics\n\n",
            (end - start) as f64 * 1e-9,
            date(start),
            content.messages,
            content.topics.len()
        ),
        None => "no messages\n\n".to_owned(),
    };
    let mut rows = vec![["topic", "type", "frame", "messages", "rate", "longest period"].map(String::from)];
    for topic in &content.topics {
        // A single period gives no rate.
        let periods = topic.periods.as_ref().filter(|_| topic.messages > 2);
        rows.push([
            topic.name.clone(),
            topic.schema.clone(),
            frames(&topic.frames),
            topic.messages.to_string(),
            periods.map_or_else(|| "-".to_owned(), |periods| periods.rate_in_words(1)),
            periods.map_or_else(|| "-".to_owned(), |periods| format!("{:.3} s", periods.max_s)),
        ]);
    }
    text += &aligned(&rows, 3, usize::MAX);
    let remarks: Vec<_> = content
        .topics
        .iter()
        .flat_map(|topic| topic.remarks.iter().map(move |remark| format!("{}: {}\n", topic.name, remark.text)))
        .collect();
    if !remarks.is_empty() {
        text += &format!("\n{}", remarks.concat());
    }
    if let Some(damage) = &content.damage {
        text += &format!("\ndamaged: {damage}\n");
        text += &format!("to save the {} messages before it: bb recover {file} NEW.mcap\n", content.messages);
    }
    text
}

fn frames(frames: &[String]) -> String {
    let named: Vec<&str> = frames.iter().map(|frame| &**frame).filter(|frame| !frame.is_empty()).collect();
    if named.is_empty() { "-".to_owned() } else { named.join(", ") }
}

fn size(bytes: u64) -> String {
    match bytes {
        0..10_000 => format!("{bytes} bytes"),
        10_000..10_000_000 => format!("{:.1} kB", bytes as f64 * 1e-3),
        _ => format!("{:.1} MB", bytes as f64 * 1e-6),
    }
}
