//! Reads a file once, from beginning to end.

use super::quantities::{self, is_finite, must_be_finite};
use super::remark::{Remark, Subject};
use super::signals::{self, Reference, Signal};
use super::times::Times;
use crate::topics::{TopicReader, is_of_events, log_ns};
use bb_eval::Periods;
use bb_eval::table::counted;
use bb_eval::units::Units;
use bb_mcap::Bag;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// The contents of a file.
pub(super) struct Content {
    pub(super) file: PathBuf,
    pub(super) bytes: u64,
    /// The first and the last log time, nanoseconds.
    pub(super) span_ns: Option<(i64, i64)>,
    pub(super) messages: usize,
    /// Topics in the order of the file.
    pub(super) topics: Vec<TopicContent>,
    /// Place and cause of the damage behind which the file cannot be read.
    pub(super) damage: Option<String>,
}

/// The contents of a topic.
pub(super) struct TopicContent {
    pub(super) name: String,
    pub(super) schema: String,
    pub(super) encoding: String,
    /// The frames in the headers, in the order of their first messages.
    pub(super) frames: Vec<String>,
    pub(super) messages: usize,
    pub(super) periods: Option<Periods>,
    pub(super) remarks: Vec<Remark>,
}

/// A topic while it is being read.
#[derive(Default)]
struct Open {
    reader: Option<TopicReader>,
    times: Times,
    units: Units,
    signal: Signal,
    frames: Vec<String>,
    /// Messages with a number that is not finite, and may not be so.
    not_finite: usize,
    /// The first message that cannot be read.
    fault: Option<String>,
}

/// Frames told of a topic; transforms have many.
const MOST_FRAMES: usize = 4;

/// Reads a whole file; the error says why not even its beginning can be read.
pub(super) fn scan(file: &Path) -> Result<Content, String> {
    let opening = bb_eval::Progress::spinner("opening");
    let bag = Bag::open(file);
    opening.finish();
    let bag = bag.map_err(|error| error.kind().to_string())?;
    let names: Vec<_> = bag.topics().iter().map(|topic| topic.name.clone()).collect();
    let expected = bag.topics().iter().filter_map(|topic| topic.messages).sum();

    let mut topics: HashMap<_, Open> = HashMap::new();
    for topic in bag.topics() {
        let (reader, times) = (TopicReader::new(topic).ok(), Times::new(is_of_events(topic), topic.is_own));
        topics.insert((topic.name.clone(), topic.schema.clone()), Open { reader, times, ..Open::default() });
    }
    let mut span_ns: Option<(i64, i64)> = None;
    let mut messages = 0;
    let mut damage = None;
    let progress = bb_eval::Progress::new("reading", expected);
    for message in bag.messages_in_any_encoding(&names).map_err(|error| error.kind().to_string())? {
        let message = match message {
            Ok(message) => message,
            Err(error) => {
                damage = Some(error.kind().to_string());
                break;
            }
        };
        messages += 1;
        progress.add(1);
        let log = log_ns(&message);
        span_ns = Some(span_ns.map_or((log, log), |(start, end)| (start.min(log), end.max(log))));
        let topic = topics.entry((message.topic.clone(), message.schema.clone())).or_default();
        topic.times.push(log, topic.reader.as_ref().and_then(|reader| reader.stamp_ns(&message)));
        let header = topic.reader.as_ref().and_then(|reader| reader.header(&message));
        if let Some(header) = header
            && topic.frames.len() < MOST_FRAMES
            && !topic.frames.contains(&header.frame_id)
        {
            topic.frames.push(header.frame_id);
        }
        let read = quantities::take(&mut topic.units, &message).and_then(|()| topic.signal.take(&message));
        let read = read.map_err(|error| error.to_string());
        let read = read.and_then(|()| match &topic.reader {
            // One message is enough for topics without numbers to judge.
            Some(reader) if topic.times.count() == 1 || must_be_finite(&message.schema) => {
                let value = reader.read(&message);
                value.map(|value| {
                    topic.not_finite += usize::from(must_be_finite(&message.schema) && !is_finite(&value))
                })
            }
            _ => Ok(()),
        });
        if let (None, Err(fault)) = (&topic.fault, read) {
            topic.fault = Some(fault);
        }
    }
    progress.finish();

    let start_ns = span_ns.map_or(0, |(start, _)| start);
    let reference = Reference::new(topics.iter().map(|((name, _), open)| (&**name, &open.signal)));
    let content = bag.topics().iter().map(|topic| {
        let none = Open::default();
        let open = topics.get(&(topic.name.clone(), topic.schema.clone())).unwrap_or(&none);
        let mut remarks = open.times.remarks(start_ns);
        // The poses that a robot publishes are estimates, and their delay is no fault of a sensor.
        let is_estimate = topic.is_own && matches!(open.signal, Signal::Orientations(_));
        let signal = if is_estimate { &Signal::None } else { &open.signal };
        let together = signals::remarks(signal, reference.as_ref(), start_ns);
        let has_offset = together.iter().any(|remark| remark.subject == Subject::Calibration);
        if open.not_finite > 0 {
            let count = counted(open.not_finite, "message holds", "messages hold");
            remarks.push(Remark::new(Subject::Values, format!("{count} NaN or infinity")));
        }
        remarks.extend(quantities::remarks(&open.units, has_offset));
        remarks.extend(together);
        remarks.extend(open.fault.clone().map(|fault| Remark::new(Subject::Messages, fault)));
        TopicContent {
            name: topic.name.to_string(),
            schema: topic.schema.to_string(),
            encoding: topic.encoding.to_string(),
            frames: open.frames.clone(),
            messages: open.times.count(),
            periods: open.times.periods(),
            remarks,
        }
    });
    let topics = content.collect();
    let bytes = std::fs::metadata(file).map_or(0, |about| about.len());
    Ok(Content { file: file.to_owned(), bytes, span_ns, messages, topics, damage })
}
