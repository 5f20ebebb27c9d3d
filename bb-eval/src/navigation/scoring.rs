//! The comparison of a filter's record with the truth: instants, errors, states and the run over time.

mod worlds;

use super::bag::TrueTrack;
use super::data::{Truth, TruthMessage};
use super::drive::RecordedTruth;
use super::errors::{Errors, Known};
use super::feed::{Feed, Time, What};
use super::record::{Estimate, Record};
use super::score::{NavigationScore, Scored, Scores};
use super::trace::{Innovation, Row, State, Trace};
use crate::periods::{Gap, Periods};
use bb_core::nalgebra::{Isometry3, Matrix6, Vector3};
use bb_estimators::navigation::{Geodetic, GnssPosition, LocalFrame};

/// Less than a tenth of a second, so that a truth at 10 Hz is scored at each message even if its clock jitters.
const SCORED_PERIOD_NS: i64 = 90_000_000;

/// An estimate is compared with the truth up to this time after it, ns.
const OLDEST_NS: i64 = 200_000_000;

/// Instants at the start that are not scored: a tenth of all, but at most this many.
const MOST_LEFT_OUT: usize = 50;

/// An instant at which the truth is known.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Instant {
    pub(crate) time_ns: Time,
    pub(crate) truth: Truth,
    /// `None` where the filter was silent.
    pub(crate) known: Option<Known>,
    pub(crate) errors: Option<Errors>,
    pub(crate) is_scored: bool,
}

pub(super) struct Scoring<'a> {
    feed: &'a Feed,
    record: &'a Record,
    truth: &'a RecordedTruth,
    /// The world of the truth, on the Earth.
    world: Option<LocalFrame>,
    /// The point of the robot that a truth without orientations is about, m.
    antenna: Vector3<f64>,
    first_ns: Time,
    imu_stamps: Vec<Time>,
    /// Median period of the positions in the world, ns.
    fix_period_ns: Time,
    /// States, each from its time on.
    states: Vec<(Time, State)>,
}

impl<'a> Scoring<'a> {
    pub(super) fn new(
        origin: Option<Geodetic>,
        feed: &'a Feed,
        record: &'a Record,
        truth: &'a RecordedTruth,
    ) -> Self {
        let of_filter = record.estimates.iter().find_map(|estimate| estimate.origin);
        let world = origin.or(of_filter).map(LocalFrame::new);
        let stamps = |inputs: &[&str]| -> Vec<Time> {
            let mut stamps: Vec<Time> =
                inputs.iter().flat_map(|input| feed.usable(input)).map(|message| message.stamp_ns).collect();
            stamps.sort_unstable();
            stamps
        };
        let imu_stamps = stamps(&["imu"]);
        let fix_period_ns = period(stamps(&["gnss", "pose"]).into_iter());
        let first_ns = feed.first_ns().unwrap_or(0);
        let states = states(record, first_ns, &imu_stamps);
        let antenna = truth.base_from_part.translation.vector;
        Self { feed, record, truth, world, antenna, first_ns, imu_stamps, fix_period_ns, states }
    }

    fn seconds(&self, time_ns: Time) -> f64 {
        (time_ns - self.first_ns) as f64 * 1e-9
    }

    /// An estimate in the world of the truth.
    fn known(&self, estimate: &Estimate) -> Known {
        let own = estimate.origin.map(LocalFrame::new);
        // An estimate in the world of the truth needs no conversion.
        let elsewhere = own.filter(|own| self.world != Some(*own));
        let moved = elsewhere.zip(self.world).map(|(own, world)| own.other_from_self(&world));
        let Some(moved) = moved else {
            let Estimate { position, velocity, world_from_body, covariance, .. } = *estimate;
            return Known { position, velocity, world_from_body, covariance };
        };
        let turn = moved.rotation.to_rotation_matrix().into_inner();
        let mut both = Matrix6::zeros();
        both.fixed_view_mut::<3, 3>(0, 0).copy_from(&turn);
        both.fixed_view_mut::<3, 3>(3, 3).copy_from(&turn);
        Known {
            position: moved.transform_point(&estimate.position.into()).coords,
            velocity: moved.rotation * estimate.velocity,
            world_from_body: moved.rotation * estimate.world_from_body,
            covariance: both * estimate.covariance * both.transpose(),
        }
    }

    /// The error of an estimate, as far as the filter estimates it.
    fn errors(&self, truth: &Truth, known: &Known) -> Errors {
        let errors = Errors::between(truth, &self.antenna, known);
        Errors { position: self.estimated(errors.position), ..errors }
    }

    /// An error of the position without that of a height that the filter does not estimate.
    fn estimated(&self, error: Vector3<f64>) -> Vector3<f64> {
        if self.record.is_planar { Vector3::new(error.x, error.y, 0.0) } else { error }
    }

    /// The estimate for a time: the last one before it, moved on.
    fn at(&self, time_ns: Time) -> Option<Estimate> {
        let estimates = &self.record.estimates;
        let next = estimates.partition_point(|estimate| estimate.time_ns <= time_ns);
        let estimate = estimates.get(next.checked_sub(1)?)?;
        (time_ns - estimate.time_ns <= OLDEST_NS).then(|| estimate.at(time_ns))
    }

    fn track(&self) -> TrueTrack {
        TrueTrack::new(&self.truth.messages, &self.truth.base_from_part, self.world.as_ref())
    }

    /// All instants with truth: those of the truth, or of the estimates where these are the rarer ones.
    pub(super) fn all(&self, notes: &mut Vec<String>) -> Vec<Instant> {
        let track = self.track();
        let points = track.points();
        if let Err(why) = &self.truth.topic {
            notes.push(format!("no truth, so no errors: {why}"));
        } else if points.is_empty() {
            let topic = self.truth.topic.as_deref().unwrap_or_default();
            let is_on_earth =
                |(_, message): &(Time, TruthMessage)| matches!(message, TruthMessage::OnEarth(Some(_)));
            notes.push(match self.truth.messages.iter().any(is_on_earth) {
                true => format!(
                    "no truth, so no errors: {topic} is fixes, and without a fix the filter's world has no place on the Earth; \
                     give it fixes as well (--gnss-topic), withhold some of them (--every, --outage), or say where its world \
                     begins (--origin)"
                ),
                false => format!("no truth, so no errors: {topic} holds no position that is a number"),
            });
        }
        let estimates = &self.record.estimates;
        let (Some(begin), Some(end)) = (self.imu_stamps.first(), self.imu_stamps.last()) else { return Vec::new() };
        let truths: Vec<(Time, Truth)> = if period(estimates.iter().map(|estimate| estimate.time_ns))
            > 2 * period(points.iter().map(|(time, _)| *time)).min(SCORED_PERIOD_NS)
        {
            let at = |estimate: &Estimate| Some((estimate.time_ns, track.at(estimate.time_ns)?));
            estimates.iter().filter_map(at).collect()
        } else {
            points.iter().filter(|(time, _)| (begin..=end).contains(&time)).copied().collect()
        };
        let is_of_fixes = self.truth.is_of_fixes;
        let mut last = i64::MIN;
        let mut instants: Vec<Instant> = Vec::new();
        for (time_ns, truth) in truths {
            if time_ns < last.saturating_add(SCORED_PERIOD_NS) {
                continue;
            }
            last = time_ns;
            let estimate = self.at(time_ns).map(|estimate| match is_of_fixes {
                // In the clock of the fixes: where the robot was when they were measured.
                true => estimate.at(time_ns - (estimate.delay_s * 1e9) as Time),
                false => estimate,
            });
            let known = estimate.map(|estimate| self.known(&estimate));
            let errors = known.map(|known| self.errors(&truth, &known));
            instants.push(Instant { time_ns, truth, known, errors, is_scored: false });
        }
        if !points.is_empty() && instants.is_empty() {
            let topic = self.truth.topic.as_deref().unwrap_or_default();
            notes.push(format!(
                "no errors: {topic} has no message while the IMU has; are both stamped by one clock?"
            ));
        }
        let last = self.record.estimates.last();
        let (delay_s, deviation_s) = last.map_or((0.0, 0.0), |of| (of.delay_s, of.delay_deviation_s));
        if is_of_fixes && delay_s.abs() > deviation_s {
            notes.push(format!(
                "scored in the clock of the fixes: where the robot was {:.0} ± {:.0} ms before the stamp of a fix, as the filter has \
                 found in the end",
                1e3 * delay_s,
                1e3 * deviation_s
            ));
        }
        // Before the first estimate there is nothing to score.
        let with = instants.iter().filter(|instant| instant.known.is_some()).count();
        let left_out = MOST_LEFT_OUT.min(with.saturating_sub(1) / 10);
        let mut seen = 0;
        for instant in &mut instants {
            seen += usize::from(instant.known.is_some());
            instant.is_scored = instant.known.is_some() && seen > left_out;
        }
        instants
    }

    fn state(&self, time_ns: Time) -> State {
        let next = self.states.partition_point(|(time, _)| *time <= time_ns);
        next.checked_sub(1).and_then(|last| self.states.get(last)).map_or(State::Starting, |(_, state)| *state)
    }

    /// Time since the filter last fused a position in the world, s.
    fn age_s(&self, time_ns: Time) -> Option<f64> {
        let positions = &self.record.positions;
        let next = positions.partition_point(|time| *time <= time_ns);
        let last = positions.get(next.checked_sub(1)?)?;
        Some((time_ns - last) as f64 * 1e-9)
    }

    pub(super) fn score(&self, instants: &[Instant]) -> NavigationScore {
        let scored = instants.iter().filter(|instant| instant.is_scored).filter_map(|instant| {
            let (known, errors) = instant.known.zip(instant.errors)?;
            let velocity = instant.truth.velocity.map(|velocity| (velocity - known.velocity).norm());
            Some(Scored {
                errors,
                velocity,
                state: self.state(instant.time_ns),
                age_s: self.age_s(instant.time_ns),
            })
        });
        let started_s = self.record.estimates.first().map_or(f64::NAN, |estimate| self.seconds(estimate.time_ns));
        Scores {
            scored: scored.collect(),
            silent: instants.iter().filter(|instant| instant.known.is_none()).count(),
            started_s,
            states: self.durations(),
            fix_period_s: self.fix_period_ns as f64 * 1e-9,
            sample_s: period(self.imu_stamps.iter().copied()) as f64 * 1e-9,
            gaps: self.gaps().len(),
            record: self.record,
        }
        .score()
    }

    /// Time in each state, s.
    fn durations(&self) -> Vec<(State, f64)> {
        let end = self.imu_stamps.last().copied().unwrap_or(self.first_ns);
        let ends = self.states.iter().skip(1).map(|(time, _)| *time).chain([end]);
        let mut durations: Vec<(State, f64)> = Vec::new();
        for ((from, state), to) in self.states.iter().zip(ends) {
            let seconds = to.saturating_sub(*from).max(0) as f64 * 1e-9;
            match durations.iter_mut().find(|(known, _)| known == state) {
                Some((_, sum)) => *sum += seconds,
                None => durations.push((*state, seconds)),
            }
        }
        durations.sort_by_key(|(state, _)| *state);
        durations
    }

    /// The run over time, with the truth as it was aligned.
    pub(super) fn trace(&self, instants: &[Instant], aligned: &Isometry3<f64>) -> Trace {
        let track = self.track();
        // Fixes have a clock of their own.
        let truth_at = |time_ns: Time| if self.truth.is_of_fixes { None } else { track.at(time_ns) };
        let mut rows: Vec<Row> = Vec::new();
        let mut last = i64::MIN;
        let mut next = 0;
        for estimate in &self.record.estimates {
            // The estimates, and the instants that are compared between them.
            while let Some(instant) = instants.get(next).filter(|instant| instant.time_ns <= estimate.time_ns) {
                if let (Some(known), Some(errors)) = (instant.known, instant.errors) {
                    rows.push(Row {
                        time_s: self.seconds(instant.time_ns),
                        position: known.position,
                        known,
                        truth: Some(instant.truth),
                        errors: Some(errors),
                        anchor_age_s: self.age_s(instant.time_ns),
                    });
                    last = instant.time_ns;
                }
                next += 1;
            }
            if estimate.time_ns > last {
                last = estimate.time_ns;
                let known = self.known(estimate);
                rows.push(Row {
                    time_s: self.seconds(estimate.time_ns),
                    position: known.position,
                    known,
                    truth: truth_at(estimate.time_ns).map(|truth| truth.moved(aligned)),
                    errors: None,
                    anchor_age_s: self.age_s(estimate.time_ns),
                });
            }
        }
        let spans = |times: &[Time], longest_ns: Time| -> Vec<(f64, f64)> {
            let long = times.windows(2).filter(|pair| pair[1] - pair[0] > longest_ns);
            long.map(|pair| (self.seconds(pair[0]), self.seconds(pair[1]))).collect()
        };
        Trace {
            first_ns: self.first_ns,
            is_planar: self.record.is_planar,
            rows,
            innovations: self.innovations(),
            fixes: self.fixes().map(|(_, fix)| fix.position).collect(),
            health: self.states.iter().map(|(time, state)| (self.seconds(*time), state.name())).collect(),
            outages: spans(&self.record.positions, 3 * self.fix_period_ns),
            gaps: self.gaps(),
        }
    }

    /// The gaps in the samples of the IMU, from and to. They are counted in the order of arrival, as those of a recording are.
    fn gaps(&self) -> Vec<(f64, f64)> {
        let samples = self.feed.messages.iter().filter(|message| matches!(message.what, What::Imu(_)));
        let stamps: Vec<Time> = samples.map(|message| message.stamp_ns).collect();
        let gaps = Periods::of(&stamps).map(|periods| periods.gaps).unwrap_or_default();
        let ends =
            |gap: &Gap| Some((self.seconds(*stamps.get(gap.after)?), self.seconds(*stamps.get(gap.after + 1)?)));
        gaps.iter().filter_map(ends).collect()
    }

    /// The fixes that the filter got, in the world of the truth, each with its stamp.
    fn fixes(&self) -> impl Iterator<Item = (Time, GnssPosition)> + '_ {
        let antenna = self.feed.mounts[1].unwrap_or_else(Isometry3::identity).translation.vector;
        self.feed.messages.iter().filter_map(move |message| match &message.what {
            What::Gnss(fix) => {
                Some((message.stamp_ns, GnssPosition::of_fix(fix, self.world.as_ref()?, antenna, 5.0)?))
            }
            _ => None,
        })
    }

    /// The fixes against the estimates before them.
    fn innovations(&self) -> Vec<Innovation> {
        let innovation = |(time_ns, fix): (Time, GnssPosition)| {
            let known = self.known(&self.at(time_ns - 1)?.at(time_ns));
            let truth = Truth { position: fix.position, world_from_body: None, velocity: None };
            let mut errors = Errors::between(&truth, &fix.lever_arm, &known);
            let mut position = errors.covariance.fixed_view_mut::<3, 3>(0, 0);
            position += fix.covariance;
            let refusals = &self.record.refusals;
            let from = refusals.partition_point(|time| *time < time_ns);
            let is_fused = refusals.get(from).is_none_or(|time| time - time_ns > OLDEST_NS);
            let axes: &[usize] = if self.record.is_planar { &[0, 1] } else { &[0, 1, 2] };
            Some(Innovation { time_s: self.seconds(time_ns), nis: errors.normalised(axes)?, is_fused })
        };
        self.fixes().filter_map(innovation).collect()
    }
}

/// The median period of times in order, ns; the longest time there is for fewer than two.
fn period(times: impl Iterator<Item = Time>) -> Time {
    let times: Vec<Time> = times.collect();
    let mut periods: Vec<Time> =
        times.windows(2).map(|pair| pair[1] - pair[0]).filter(|period| *period > 0).collect();
    periods.sort_unstable();
    periods.get(periods.len() / 2).copied().unwrap_or(i64::MAX / 4)
}

/// The states of a filter over time. It is starting until its first estimate, and while it is silent although the IMU is not.
fn states(record: &Record, first_ns: Time, imu: &[Time]) -> Vec<(Time, State)> {
    let silence_ns = OLDEST_NS.max(3 * period(record.estimates.iter().map(|estimate| estimate.time_ns)));
    let mut silent: Vec<(Time, Time)> = Vec::new();
    let mut last = first_ns;
    let end = imu.last().copied().unwrap_or(first_ns);
    for time in record.estimates.iter().map(|estimate| estimate.time_ns).chain([end]) {
        let (after, before) =
            (imu.partition_point(|sample| *sample < time), imu.partition_point(|sample| *sample <= last));
        let samples = after.saturating_sub(before);
        if time - last > silence_ns && samples > 3 {
            silent.push((last, time));
        }
        last = time;
    }
    let mut changes: Vec<Time> = record.health.iter().map(|(time, _)| *time).collect();
    changes.extend(silent.iter().flat_map(|(from, to)| [*from, *to]));
    changes.push(first_ns);
    changes.retain(|time| *time >= first_ns);
    changes.sort_unstable();
    changes.dedup();
    let mut states: Vec<(Time, State)> = Vec::new();
    for time in changes {
        let health = record.health.iter().rev().find(|(at, _)| *at <= time).map(|(_, health)| *health);
        let is_silent = silent.iter().any(|(from, to)| (*from..*to).contains(&time));
        let state = if is_silent { State::Starting } else { State::Running(health.unwrap_or_default()) };
        if states.last().is_none_or(|(_, before)| *before != state) {
            states.push((time, state));
        }
    }
    states
}
