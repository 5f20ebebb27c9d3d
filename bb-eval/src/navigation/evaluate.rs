//! Runs a filter in its robot on a bag, and scores what it publishes.

use super::doubt::{distrusted, is_most};
use super::drive::{Drive, RecordedTruth};
use super::feed::{Feed, Time};
use super::record::{Estimate, Record};
use super::robot::{self, NavigationFilter, RobotSettings};
use super::score::NavigationScore;
use super::scoring::Scoring;
use super::trace::Trace;
use crate::disturb::Disturbances;
use crate::turns::Align;
use bb_core::nalgebra::Isometry3;

/// Options of scoring a bag.
#[derive(Clone, Debug, Default)]
pub struct NavigationRun {
    /// The filter's settings.
    pub settings: RobotSettings,
    /// Changes to the messages.
    pub disturbances: Disturbances,
    /// Rotation that is taken from the truth.
    pub align: Align,
    /// True to keep the run over time.
    pub keep_trace: bool,
}

/// The result of a run.
#[derive(Clone, Debug)]
pub struct Played {
    /// Errors of the filter.
    pub score: NavigationScore,
    /// Assumptions, and what was left out.
    pub notes: Vec<String>,
    /// Reasons for which its figures mislead, and options that changed nothing.
    pub doubts: Vec<String>,
    /// The run over time, if it was to be kept.
    pub trace: Option<Trace>,
}

/// Reason for which a deviation of fixes changes nothing.
const GIVEN: &str = ": it is that of fixes without a covariance, and these have one";

/// Runs a filter on a recording. `progress` is called for each sample of the IMU.
///
/// # Errors
///
/// Why the filter cannot be created or never started.
pub fn play_navigation(
    drive: &Drive,
    filter: &NavigationFilter,
    run: &NavigationRun,
    mut progress: impl FnMut(),
) -> Result<Played, String> {
    let Drive { mut feed, mut truth, mut notes, mut doubts, origin, imu, gnss, noise, declination } = drive.clone();
    let settings = run.settings.over(noise.as_ref(), declination);
    if let Some(setting) = declination.and(run.settings.setting("declination")) {
        return Err(format!("{setting}, and --declination: give it once"));
    }
    if declination.is_some() && !filter.has("declination") {
        doubts.push(format!("--declination changes nothing: {} uses no magnetometer", filter.name));
    }
    let withheld = feed.disturb(&run.disturbances)?;
    if !withheld.is_empty() && (truth.topic.is_err() || truth.topic.as_ref().ok() == gnss.as_ref()) {
        truth = RecordedTruth::of_fixes(&withheld, feed.mounts[1].unwrap_or_else(Isometry3::identity));
        notes.push("the fixes that the filter does not get are the truth".to_owned());
    }
    let record = robot::run(filter, &feed, &settings, &mut progress)?;
    if record.estimates.is_empty() {
        return Err(never_started(&record));
    }
    for (setting, others) in settings.each(filter) {
        // The only proof that works for every option of every filter.
        if is_same(&record, &robot::run(filter, &feed, &others, &mut || {})?) {
            let why = if setting.to_string().contains("gnss_deviation") { GIVEN } else { "" };
            doubts.push(format!("{setting} changes nothing on this recording{why}"));
        }
    }
    doubts.extend(left_out(&feed, &record));
    let scoring = Scoring::new(origin, &feed, &record, &truth);
    let mut scored = scoring.all(&mut notes);
    let (aligned, said) = scoring.aligned(&mut scored, run.align).unzip();
    notes.extend(said);
    notes.extend(scoring.explained(filter.name, &imu, &scored, run.align));
    notes.extend(scoring.displaced(&scored, run.align, origin.is_some()));
    let score = scoring.score(&scored);
    let trace = run.keep_trace.then(|| scoring.trace(&scored, &aligned.unwrap_or_default()));
    Ok(Played { score, notes, doubts, trace })
}

/// Returns whether two runs published the same.
pub(crate) fn is_same(one: &Record, other: &Record) -> bool {
    let same = |(a, b): (&Estimate, &Estimate)| {
        a.time_ns == b.time_ns
            && a.position == b.position
            && a.velocity == b.velocity
            && a.world_from_body == b.world_from_body
            && a.covariance == b.covariance
    };
    one.estimates.len() == other.estimates.len()
        && one.health == other.health
        && one.estimates.iter().zip(&other.estimates).all(same)
}

fn never_started(record: &Record) -> String {
    let reason = record.reasons.iter().rev().flatten().next();
    let reason = reason.map_or(String::new(), |reason| format!(": {reason}"));
    format!(
        "it never started{reason}; a robot starts at rest, or once three fixes agree, or at a state that it is given: \
         --start truth or a topic"
    )
}

/// The inputs of which most measurements were refused or not used.
fn left_out(feed: &Feed, record: &Record) -> Vec<String> {
    let all = record.verdicts.iter().map(|of| (of, of.fused + of.refused + of.unused));
    let most = all.filter(|(of, all)| is_most(of.refused + of.unused, *all));
    most.map(|(of, all)| {
        let (count, verb) = if of.refused > of.unused { (of.refused, "refused") } else { (of.unused, "not used") };
        let why = if verb == "refused" { None } else { misstamped(feed, of.input) };
        let why = why.unwrap_or_default();
        distrusted(&format!("{count} of {all} measurements of `{}` were {verb}{why}", of.input))
    })
    .collect()
}

/// Difference of the stamps of messages that arrive at one time above which they are not of one clock, ns.
const ONE_CLOCK_NS: Time = 1_000_000_000;

/// Says how the stamps of an input differ from those of the IMU at arrival, if they do.
fn misstamped(feed: &Feed, input: &str) -> Option<String> {
    let age_ns = |input: &str| {
        let mut ages: Vec<Time> = feed.usable(input).map(|message| message.arrival_ns - message.stamp_ns).collect();
        ages.sort_unstable();
        ages.get(ages.len() / 2).copied()
    };
    let older_ns = age_ns(input)?.saturating_sub(age_ns("imu")?);
    let sense = if older_ns > 0 { "before" } else { "after" };
    (older_ns.abs() > ONE_CLOCK_NS).then(|| {
        format!(
            ", being stamped {:.1} s {sense} the samples of the IMU that arrive with them; correct their stamps",
            older_ns.abs() as f64 * 1e-9
        )
    })
}
