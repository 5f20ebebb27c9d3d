//! Helpers to run a robot once more from its journal and compare the runs bit for bit: outputs, transitions, drops.
//! `tests/stress.rs` does so with random days of everything at once.

use crate::components::{Failure, Number, Seen, lock};
use bb_core::journal::{Entry, JournalReader};
use bb_core::message::codec::{decode, encode};
use bb_core::prelude::*;
use bb_core::{Builder, DynamicMessage, DynamicSubscription, HealthTransition, Report, Robot};
pub(crate) use bb_tests::random::Random;
use std::cell::Cell;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

/// Writes a message as text that differs if a bit of payload or stamp does.
pub(crate) fn text(message: &DynamicMessage) -> String {
    let stamp = message.stamp();
    let payload = message
        .downcast::<Number>()
        .map(|number| format!("{:016x}", number.0.to_bits()))
        .or_else(|| message.downcast::<Seen>().map(|seen| format!("{:?}", seen.payload)))
        .or_else(|| message.downcast::<HealthTransition>().map(|change| change.to_string()))
        .unwrap_or_else(|| format!("{message:?}"));
    format!("{} {stamp:?} {payload}", message.path())
}

/// Whatever is published while the robot runs, path by path.
pub(crate) type Published = BTreeMap<&'static str, Vec<String>>;

pub(crate) fn collect(subscription: &DynamicSubscription, heard: &mut Published) {
    assert_eq!(subscription.lagged(), 0);
    for message in subscription.drain() {
        heard.entry(message.path()).or_default().push(text(&message));
    }
}

/// Counts of estimators, topics and commands; how long callbacks took is no part of it.
pub(crate) fn counts(report: &Report) -> String {
    let estimators: Vec<String> = report
        .estimators
        .iter()
        .map(|estimator| {
            let mut estimator = estimator.clone();
            estimator.latency = Default::default();
            estimator.inputs.iter_mut().for_each(|input| input.age = Default::default());
            format!("{estimator:?}")
        })
        .collect();
    let published: Vec<_> =
        report.topics.iter().map(|topic| (topic.path, topic.payload, topic.published)).collect();
    format!("{estimators:#?} {published:?} {:#?} {} {}", report.commands, report.state, report.safety)
}

pub(crate) type Lines = Arc<Mutex<Vec<Entry>>>;

/// Makes a robot write its journal.
pub(crate) fn journal<R: Robot>(builder: &mut Builder<R>) -> Lines {
    let lines = Lines::default();
    let sink = Arc::clone(&lines);
    builder.journal(move |entry| lock(&sink).push(entry));
    lines
}

/// Returns the entries that were written, in their order.
pub(crate) fn entries(lines: &Lines) -> Vec<Entry> {
    let mut entries = std::mem::take(&mut *lock(lines));
    entries.sort_by_key(|entry| entry.number);
    entries
}

/// Returns what a file would hold of a journal, read back: payloads are known by their paths alone.
pub(crate) fn read_back<R: Robot>(entries: &[Entry]) -> Result<Vec<Entry>, Failure> {
    let reader = JournalReader::<R>::default();
    let read = entries.iter().map(|line| {
        let mut bytes = Vec::new();
        encode(line, &mut bytes);
        Ok(reader.entry(&decode(&bytes)?)?)
    });
    read.collect()
}

pub(crate) fn overflow() -> Overflow {
    Overflow::DropOldest { capacity: Overflow::MAX_CAPACITY }
}

thread_local! {
    static IS_AGAIN: Cell<bool> = const { Cell::new(false) };
}

/// Returns whether this thread plays a journal: components of a first run that behave differently ask for it.
pub(crate) fn is_again() -> bool {
    IS_AGAIN.get()
}

/// Runs code as a part of a replay.
pub(crate) fn once_more<T>(run: impl FnOnce() -> T) -> T {
    IS_AGAIN.set(true);
    let result = run();
    IS_AGAIN.set(false);
    result
}

/// Runs a robot from its journal; what it gives.
pub(crate) fn play<R: Robot>(builder: Builder<R>, entries: &[Entry]) -> Result<(Published, Report), Failure> {
    let all = builder.subscribe_any(Select::All, None, overflow());
    let mut heard = Published::new();
    let report = once_more(|| {
        let mut replay = builder.replay()?;
        // In parts, as from a file.
        for part in entries.chunks((entries.len() / 1000).max(7)) {
            replay.play(part.to_vec())?;
            collect(&all, &mut heard);
        }
        Ok::<_, Failure>(replay.stop())
    })?;
    collect(&all, &mut heard);
    Ok((heard, report))
}

/// Runs a robot, and once more from its journal: all that is published and counted is the same.
pub(crate) fn same_again<R: Robot>(
    builder: impl Fn() -> Builder<R>,
    run: impl FnOnce(Builder<R>) -> Result<Report, Failure>,
) -> Result<(Published, Report), Failure> {
    run_again(builder(), builder, run, Ok)
}

/// Runs a robot, and once more from what a file would hold of its journal: all that is published and counted is the same.
pub(crate) fn same_from_file<R: Robot>(
    builder: impl Fn() -> Builder<R>,
    run: impl FnOnce(Builder<R>) -> Result<Report, Failure>,
) -> Result<(Published, Report), Failure> {
    run_again(builder(), builder, run, |entries| read_back::<R>(&entries))
}

/// Runs a robot, and once more by another builder from what is kept of its journal.
pub(crate) fn run_again<R: Robot>(
    mut first_builder: Builder<R>,
    builder: impl FnOnce() -> Builder<R>,
    run: impl FnOnce(Builder<R>) -> Result<Report, Failure>,
    keep: impl FnOnce(Vec<Entry>) -> Result<Vec<Entry>, Failure>,
) -> Result<(Published, Report), Failure> {
    let lines = journal(&mut first_builder);
    let all = first_builder.subscribe_any(Select::All, None, overflow());
    let report = run(first_builder)?;
    let mut first = Published::new();
    collect(&all, &mut first);
    let (again, report_again) = play(builder(), &keep(entries(&lines))?)?;
    same(&first, &again);
    assert_eq!(counts(&report), counts(&report_again));
    assert_eq!((&report.faults, report.all_faults), (&report_again.faults, report_again.all_faults));
    Ok((first, report))
}

pub(crate) fn same(first: &Published, again: &Published) {
    let paths = |heard: &Published| heard.iter().map(|(path, texts)| (*path, texts.len())).collect::<Vec<_>>();
    assert_eq!(paths(first), paths(again));
    for ((path, first), (_, again)) in first.iter().zip(again) {
        if let Some(line) = (0..first.len()).find(|line| first[*line] != again[*line]) {
            panic!("{path}, message {line}: {} then, {} now", first[line], again[line]);
        }
    }
}
