//! Reports on the receiver at random, with stamps of all kinds, among inputs that are late: a model of the gate, which knows all
//! reports and nothing of the queue, judges every fix in the estimate.

use super::*;
use alloc::collections::BTreeMap;
use bb_tests::laws;
use proptest::prelude::*;

const DWELL_NS: i64 = SECOND / 2;
const GAP_NS: i64 = 3 * SECOND / 10;
const LATENESS_NS: i64 = SECOND;
const LEAD_NS: i64 = SECOND / 5;
const LENGTH_S: i64 = 6;

/// The stamp of a report, relative to the IMU's clock when it arrives.
#[derive(Clone, Copy, Debug)]
enum Stamp {
    /// Stamp of the regular report before.
    Same,
    By(i64),
    Absolute(i64),
}

fn stamp() -> impl Strategy<Value = Stamp> {
    prop_oneof![
        2 => Just(Stamp::Same),
        2 => (-LATENESS_NS..=0).prop_map(Stamp::By),
        // Too old, or of a clock that is behind.
        1 => (-4 * SECOND..-LATENESS_NS).prop_map(Stamp::By),
        1 => (0..=LEAD_NS).prop_map(Stamp::By),
        // In the future, or of a clock that is ahead.
        1 => (LEAD_NS + 1..4 * SECOND).prop_map(Stamp::By),
        1 => prop::sample::select(std::vec![i64::MIN, -1, 0, 1000 * SECOND, i64::MAX]).prop_map(Stamp::Absolute),
    ]
}

/// A report beside the regular ones.
#[derive(Clone, Copy, Debug)]
struct Report {
    at_ns: i64,
    stamp: Stamp,
    health: GpsHealth,
    /// Number of times that it is sent.
    times: usize,
    /// `true` if so many other inputs come first that there is no room.
    is_flooded: bool,
}

fn report() -> impl Strategy<Value = Report> {
    let health = prop_oneof![
        3 => Just(GpsHealth::Spoofed),
        1 => prop::sample::select(std::vec![GpsHealth::Stable, GpsHealth::Unstable, GpsHealth::NoFix]),
    ];
    let time = 0..LENGTH_S * SECOND;
    (time, stamp(), health, 1..3_usize, prop::bool::weighted(0.1))
        .prop_map(|(at_ns, stamp, health, times, is_flooded)| Report { at_ns, stamp, health, times, is_flooded })
}

/// Returns the rank of a health: of reports of one time, the worst counts.
fn badness(health: GpsHealth) -> u8 {
    match health {
        GpsHealth::Stable => 0,
        GpsHealth::Unstable => 1,
        GpsHealth::NoFix => 2,
        GpsHealth::Spoofed => 3,
    }
}

/// Reports that are known on one clock.
#[derive(Debug, Default)]
struct Model {
    /// The worst report of each time.
    reports: BTreeMap<i64, GpsHealth>,
    /// A report of spoofing was refused: up to this time all others count as such.
    spoofed_ns: Option<i64>,
    /// Fixes, and whether they are in the estimate.
    fixes: BTreeMap<i64, bool>,
    anchors: Vec<i64>,
    newest_ns: Option<i64>,
}

impl Model {
    fn accepted(&mut self, time_ns: i64, health: GpsHealth) {
        let worst = self.reports.entry(time_ns).or_insert(health);
        if badness(health) > badness(*worst) {
            *worst = health;
        }
    }

    /// Before the first sample there is no present: it counts for all times.
    fn refused_alarm(&mut self) {
        self.spoofed_ns = self.spoofed_ns.max(Some(self.newest_ns.unwrap_or(i64::MIN)));
    }

    /// Reports up to a time, from the last to the first.
    fn reports_until(&self, time_ns: i64) -> impl Iterator<Item = (i64, GpsHealth)> {
        let spoofed_ns = self.spoofed_ns;
        let after = move |at_ns: &i64| spoofed_ns.is_none_or(|spoofed_ns| *at_ns > spoofed_ns);
        let reports = self.reports.range(..=time_ns).rev().map(|(at_ns, health)| (*at_ns, *health));
        let spoofed = spoofed_ns.filter(|spoofed_ns| *spoofed_ns <= time_ns);
        reports
            .take_while(move |(at_ns, _)| after(at_ns))
            .chain(spoofed.map(|spoofed_ns| (spoofed_ns, GpsHealth::Spoofed)))
    }

    fn last_alarm_ns(&self, time_ns: i64) -> Option<i64> {
        self.reports_until(time_ns).find(|(_, health)| *health == GpsHealth::Spoofed).map(|(at_ns, _)| at_ns)
    }

    /// The first of the stable reports without interruption up to a time.
    fn stable_since_ns(&self, time_ns: i64) -> Option<i64> {
        let mut since_ns = None;
        let mut later_ns = time_ns;
        for (at_ns, health) in self.reports_until(time_ns) {
            if health != GpsHealth::Stable || later_ns.saturating_sub(at_ns) > GAP_NS {
                break;
            }
            (since_ns, later_ns) = (Some(at_ns), at_ns);
        }
        since_ns
    }

    /// Returns whether an anchor may have let the receiver in after the last report of spoofing.
    fn is_let_in(&self, time_ns: i64) -> bool {
        let Some(alarm_ns) = self.last_alarm_ns(time_ns) else { return true };
        self.anchors.iter().filter(|anchor_ns| (alarm_ns..=time_ns).contains(*anchor_ns)).any(|anchor_ns| {
            self.stable_since_ns(*anchor_ns).is_some_and(|since_ns| {
                let recent = (anchor_ns - GAP_NS).max(since_ns)..=*anchor_ns;
                anchor_ns - since_ns >= DWELL_NS && self.fixes.range(recent).next().is_some()
            })
        })
    }

    /// The clock was set back: reports are dropped, and a receiver that was not let in stays out.
    fn set_back(&mut self) {
        let is_let_in = self.is_let_in(i64::MAX);
        *self = Self { spoofed_ns: (!is_let_in).then_some(i64::MIN), ..Self::default() };
    }

    fn take(&mut self, events: &[Event]) {
        for event in events {
            let is_in = match event.kind {
                EventKind::Added { input: InputKind::Gnss, waits, .. } => !waits,
                EventKind::Revised { input: InputKind::Gnss } => true,
                EventKind::Degraded { input: InputKind::Gnss, reason } => {
                    matches!(reason, Reason::Overruled { .. } | Reason::NotConverged)
                }
                // Of a fix, or of an anchor.
                EventKind::Rejected { .. } => false,
                _ => continue,
            };
            self.fixes.entry(event.time_ns).and_modify(|was_in| *was_in = is_in).or_insert(is_in);
        }
    }

    fn check(&self) -> Result<(), TestCaseError> {
        // A refused report counts from the present on only.
        let after_ns = self.spoofed_ns.unwrap_or(i64::MIN);
        for (time_ns, _) in self.fixes.iter().filter(|(time_ns, is_in)| **is_in && **time_ns > after_ns) {
            prop_assert!(self.stable_since_ns(*time_ns).is_some(), "{time_ns} without a stable report, {self:?}");
            prop_assert!(self.is_let_in(*time_ns), "{time_ns} before the receiver was let in, {self:?}");
        }
        Ok(())
    }
}

/// The inputs by arrival. From `jump_ns` on, stamps are those of another clock.
fn arriving(flight: &Flight, extra: &[Report], shares: &[f64], jump: Option<(i64, i64)>) -> Vec<Sent> {
    let behind_ns = |at_ns: i64| jump.filter(|(jump_ns, _)| at_ns >= *jump_ns).map_or(0, |(_, by_ns)| by_ns);
    let regular = flight.sent(true, true, true).into_iter().enumerate().map(|(i, sent)| {
        let at_ns = sent.time_ns();
        let most = if matches!(sent, Sent::Imu(_)) { 0.0 } else { 0.8e9 };
        let share = shares[i % shares.len()];
        (at_ns + (most * share * share * share) as i64, sent.behind(behind_ns(at_ns)))
    });
    let mut all: Vec<(i64, Sent)> = regular.collect();
    for report in extra {
        let now_ns = report.at_ns - behind_ns(report.at_ns);
        let time_ns = match report.stamp {
            Stamp::Same => now_ns / (SECOND / 5) * (SECOND / 5),
            Stamp::By(by_ns) => now_ns + by_ns,
            Stamp::Absolute(time_ns) => time_ns,
        };
        if report.is_flooded {
            let stable = |i: i64| GpsHealthReading { time_ns: now_ns - i * 1000, health: GpsHealth::Stable };
            all.extend((0..300).map(|i| (report.at_ns, Sent::Health(stable(i)))));
        }
        let sent = Sent::Health(GpsHealthReading { time_ns, health: report.health });
        all.extend((0..report.times).map(|_| (report.at_ns, sent)));
    }
    all.sort_by_key(|(at_ns, _)| *at_ns);
    all.into_iter().map(|(_, sent)| sent).collect()
}

laws! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn no_fix_is_used_before_the_receiver_is_let_in(
        extra in prop::collection::vec(report(), 0..6),
        shares in prop::collection::vec(0.0..1.0_f64, 97),
        jump in prop::option::weighted(0.3, (SECOND..5 * SECOND, prop_oneof![
            2 => 700_000_000..100 * SECOND,
            1 => -100 * SECOND..-2 * SECOND,
        ])),
        seed in 0..100_u64,
    ) {
        let flight = Flight::new(LENGTH_S, seed);
        let sent = arriving(&flight, &extra, &shares, jump);
        for strategy in StrategyKind::ALL {
            let [dwell, health_gap, lateness, lead] = [DWELL_NS, GAP_NS, LATENESS_NS, LEAD_NS].map(|ns| ns as f64 * 1e-9);
            let mut config = config(*strategy);
            config.params = StateEstimatorParams { dwell, health_gap, lateness, lead, input_rate: 80.0, ..config.params };
            let mut estimator: Estimator = FlightNavigator::new(config, Events::new()).unwrap();
            estimator.warm_start(flight.warm_start(0)).unwrap();
            let mut model = Model::default();
            for sent in core::iter::once(&Sent::Imu(flight.samples[0])).chain(&sent) {
                let set_back = estimator.counts().set_back;
                let result = sent.to(&mut estimator);
                model.take(&core::mem::take(estimator.sink_mut()));
                if estimator.counts().set_back != set_back {
                    model.set_back();
                }
                match (sent, result) {
                    (Sent::Imu(ImuMean { time_ns, .. }), Ok(()) | Err(EstimatorError::Degraded(Reason::Bridged))) => {
                        model.newest_ns = model.newest_ns.max(Some(*time_ns));
                    }
                    (Sent::Health(reading), Ok(())) => model.accepted(reading.time_ns, reading.health),
                    (Sent::Health(reading), Err(EstimatorError::Degraded(reason)))
                        if reading.health == GpsHealth::Spoofed && reason != Reason::Duplicate =>
                    {
                        model.refused_alarm();
                    }
                    (Sent::Anchor(anchor), Ok(())) => model.anchors.push(anchor.time_ns),
                    _ => {}
                }
                if !matches!(sent, Sent::Imu(_)) {
                    model.check()?;
                    let was_alarmed = model.last_alarm_ns(i64::MAX).is_some();
                    prop_assert!(was_alarmed || estimator.health().gate.is_open(), "no report of spoofing");
                }
            }
            model.check()?;
        }
    }
}

/// The model is no stricter than the gate, nor as lax as to let everything pass.
#[test]
fn the_model_lets_a_receiver_in_by_an_anchor_after_the_dwell() {
    let mut model = Model { newest_ns: Some(SECOND), ..Model::default() };
    let stable = |model: &mut Model, range: core::ops::RangeInclusive<i64>| {
        range.for_each(|i| model.accepted(i * SECOND / 5, GpsHealth::Stable));
    };
    stable(&mut model, 0..=20);
    model.fixes.extend((1..20).map(|i| (i * SECOND / 5 + STEP, false)));
    model.anchors.extend([SECOND + STEP, 2 * SECOND + STEP, 3 * SECOND + STEP]);
    assert!(model.is_let_in(4 * SECOND));
    model.refused_alarm();
    assert!(!model.is_let_in(2 * SECOND) && model.is_let_in(2 * SECOND + STEP));
    model.accepted(8 * SECOND / 5, GpsHealth::Spoofed);
    assert!(!model.is_let_in(3 * SECOND) && model.is_let_in(3 * SECOND + STEP));
    model.accepted(14 * SECOND / 5, GpsHealth::Unstable);
    assert!(!model.is_let_in(4 * SECOND));
}
