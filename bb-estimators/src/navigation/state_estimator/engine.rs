//! The deterministic part of the estimator: the estimate, its label and the gate depend only on the inputs in their order. The
//! engine can be copied and run again, and a late input then gives the same result as one that arrives in time.

use alloc::collections::VecDeque;

use super::entry::{Entry, Payload};
use super::error::{EstimatorError, Outcome, Reason};
use super::event::StartedFrom;
use super::factor::ProvidedFactor;
use super::gate::{Rejection, SpoofGate};
use super::input::{GpsHealth, ImuBias, TakeoffOrigin};
use super::label::Sources;
use super::params::{StateEstimatorConfig, ns};
use super::start::{Starter, warm};
use super::strategy::{Measured, Pose, Predictor, Strategy};
use super::world::World;
use crate::attitude::ParamsError;
use crate::navigation::eskf::{ImuMean, Start};
use crate::navigation::numbers::{CONFIRMATIONS, DISTRUST_NS, FARTHEST_FLIGHT, MOST_VELOCITY};
use crate::navigation::refusal::Refusal;

mod measured;

/// The deterministic part of the estimator.
#[derive(Clone, Debug)]
pub(super) struct Engine<F: ProvidedFactor> {
    /// The IMU time up to which it has run.
    now_ns: Option<i64>,
    /// The time from which the first sample continues.
    begun_ns: Option<i64>,
    world: Option<World>,
    origin: Option<TakeoffOrigin>,
    phase: Phase,
    strategy: Strategy<F>,
    started: Option<(i64, StartedFrom)>,
    /// Number of jumps since the first start.
    resets: u32,
    gate: SpoofGate,
    sources: Sources,
    /// Sources of the estimate at each keyframe.
    marks: VecDeque<(i64, Sources)>,
    bias: Option<ImuBias>,
    nis: Option<f64>,
    is_anchor_degraded: bool,
    /// The interval in which the estimate is distrusted.
    degraded_ns: Option<(i64, i64)>,
    /// Time of the last measurement that was neither from the IMU nor from the receiver.
    independent_ns: Option<i64>,
    /// Number of positions that must still fit.
    unconfirmed: u32,
    records: bool,
    left: VecDeque<Left>,
}

/// A keyframe that has left the window.
#[derive(Clone, Copy, Debug)]
pub(super) struct Left {
    pub(super) pose: Pose,
    pub(super) sources: Sources,
    /// The world of the pose, which may have moved on since.
    pub(super) world: World,
}

#[expect(clippy::large_enum_variant, reason = "there is one of it in an engine")]
#[derive(Clone, Copy, Debug)]
enum Phase {
    Starting(Starter),
    Running,
    /// The position is unknown until an anchor or the flight controller provides it.
    Lost,
}

/// State of the engine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Condition {
    Starting,
    Running,
    Lost,
}

impl<F: ProvidedFactor> Engine<F> {
    pub(super) fn new(config: &StateEstimatorConfig) -> Result<Self, ParamsError> {
        Ok(Self {
            now_ns: None,
            begun_ns: None,
            world: None,
            origin: None,
            phase: Phase::Starting(Starter::new(config)),
            strategy: Strategy::new(config)?,
            started: None,
            resets: 0,
            gate: SpoofGate::default(),
            sources: Sources::default(),
            marks: VecDeque::with_capacity(config.params.window as usize + 2),
            bias: None,
            nis: None,
            is_anchor_degraded: false,
            degraded_ns: None,
            independent_ns: None,
            unconfirmed: 0,
            records: config.params.record_keyframes,
            left: VecDeque::new(),
        })
    }

    pub(super) fn set_origin(&mut self, origin: &TakeoffOrigin) {
        self.origin = Some(*origin);
        self.world = Some(World::new(origin.position));
    }

    pub(super) fn now_ns(&self) -> Option<i64> {
        self.now_ns
    }

    /// The time from which the first sample continues: that of a warm start before it, or of the estimate that was taken to a new
    /// clock.
    pub(super) fn begun_ns(&self) -> Option<i64> {
        self.begun_ns
    }

    pub(super) fn condition(&self) -> Condition {
        match self.phase {
            Phase::Starting(_) => Condition::Starting,
            Phase::Running => Condition::Running,
            Phase::Lost => Condition::Lost,
        }
    }

    pub(super) fn started(&self) -> Option<(i64, StartedFrom)> {
        self.started
    }

    pub(super) fn resets(&self) -> u32 {
        self.resets
    }

    pub(super) fn world(&self) -> Option<&World> {
        self.world.as_ref()
    }

    pub(super) fn gate(&self) -> &SpoofGate {
        &self.gate
    }

    /// Handles a report of spoofing for which there is no place in the queue.
    pub(super) fn alarm(&mut self, time_ns: i64, config: &StateEstimatorConfig) {
        self.gate.health(time_ns, GpsHealth::Spoofed, &config.params);
    }

    pub(super) fn sources(&self) -> &Sources {
        &self.sources
    }

    pub(super) fn nis(&self) -> Option<f64> {
        self.nis
    }

    pub(super) fn is_anchor_degraded(&self) -> bool {
        self.is_anchor_degraded
    }

    pub(super) fn is_degraded(&self, time_ns: i64) -> bool {
        let is_within = |(from_ns, until_ns)| (from_ns..=until_ns).contains(&time_ns);
        // Until now, and what is predicted from now on.
        let is_now = !self.strategy.is_attitude_known() && self.now_ns.is_none_or(|now_ns| time_ns >= now_ns);
        is_now || self.degraded_ns.is_some_and(is_within)
    }

    pub(super) fn predictor(&self) -> Option<Predictor> {
        matches!(self.phase, Phase::Running).then(|| self.strategy.predictor()).flatten()
    }

    /// The newest keyframe and its sources.
    pub(super) fn newest(&self) -> Option<(Pose, Sources)> {
        let pose = matches!(self.phase, Phase::Running).then(|| self.strategy.newest()).flatten()?;
        Some((pose, self.sources_at(pose.time_ns)))
    }

    /// Keyframes before the newest, and whether they are smoothed.
    pub(super) fn history(&mut self, most: usize) -> (impl Iterator<Item = (Pose, Sources)> + use<'_, F>, bool) {
        let (poses, is_smoothed) = self.strategy.history(most);
        let this = &*self;
        (poses.into_iter().map(|pose| (pose, this.sources_at(pose.time_ns))), is_smoothed)
    }

    /// The time from which IMU samples are needed to run on and to predict.
    pub(super) fn needed_ns(&self) -> i64 {
        let now_ns = self.now_ns.unwrap_or(i64::MIN);
        match self.phase {
            Phase::Running => now_ns.min(self.strategy.keyframe_ns()),
            Phase::Starting(_) | Phase::Lost => now_ns,
        }
    }

    /// The clock of the IMU was set back. The estimate is kept, but the times of its measurements are dropped. A receiver that was
    /// not let in stays out. The new clock has been seen for `for_ns`, and the same time again may have passed before.
    pub(super) fn set_clock_back(&mut self, sample_ns: i64, for_ns: i64, config: &StateEstimatorConfig) {
        (self.now_ns, self.begun_ns) = (None, None);
        self.sources = Sources::default();
        self.gate.forget_times();
        self.marks.clear();
        self.degraded_ns = None;
        // The measurement counts as made now: a receiver must not benefit.
        self.independent_ns = self.independent_ns.and(Some(sample_ns));
        match self.phase {
            Phase::Starting(_) => self.phase = Phase::Starting(Starter::new(config)),
            Phase::Lost => {}
            Phase::Running => {
                let passed_ns = for_ns.saturating_mul(2);
                let resumed_ns = sample_ns.saturating_sub(passed_ns);
                // It was silent for any time before it was seen: what has passed is known to within itself.
                if self.strategy.set_clock(resumed_ns, passed_ns as f64 * 1e-9).is_ok() {
                    (self.now_ns, self.begun_ns) = (Some(resumed_ns), Some(resumed_ns));
                    self.unconfirmed = CONFIRMATIONS;
                    self.resets = self.resets.wrapping_add(1);
                } else {
                    self.phase = Phase::Lost;
                }
            }
        }
    }

    pub(super) fn keyframes(&self) -> usize {
        if matches!(self.phase, Phase::Running) { self.strategy.keyframes() } else { 0 }
    }

    pub(super) fn take_left(&mut self) -> Option<Left> {
        self.left.pop_front()
    }

    /// Keeps all keyframes for the recorder, before the window restarts.
    pub(super) fn leave(&mut self) {
        if !self.records || self.started.is_none() {
            return;
        }
        let (mut poses, _) = self.strategy.history(usize::MAX);
        poses.reverse();
        poses.extend(self.strategy.newest());
        poses.into_iter().for_each(|pose| self.note(pose));
    }

    fn note(&mut self, pose: Pose) {
        if let Some(world) = self.world {
            self.left.push_back(Left { pose, sources: self.sources_at(pose.time_ns), world });
        }
    }

    fn sources_at(&self, time_ns: i64) -> Sources {
        let mark = self.marks.iter().rev().find(|(at_ns, _)| *at_ns <= time_ns);
        mark.map_or(self.sources, |(_, sources)| *sources)
    }

    /// Advances to a time within one sample of the IMU, which began at `since_ns`: at a gap, long before.
    pub(super) fn advance(
        &mut self,
        until_ns: i64,
        sample: &ImuMean,
        since_ns: i64,
        config: &StateEstimatorConfig,
    ) -> Result<(), Reason> {
        let is_first = self.now_ns.is_none();
        self.now_ns = Some(until_ns);
        match &mut self.phase {
            Phase::Starting(starter) => {
                starter.sample(&ImuMean { time_ns: until_ns, ..*sample });
                // A sample is a mean since the previous one. The first has none.
                if let (false, Some(origin)) = (is_first, &self.origin)
                    && let Some(start) = starter.at_origin(until_ns, origin, config, self.bias.as_ref())
                {
                    self.start(&start, StartedFrom::Origin)?;
                }
                Ok(())
            }
            Phase::Lost => Ok(()),
            Phase::Running => {
                let gaps = self.strategy.gaps();
                let result = self.strategy.propagate(until_ns, sample, since_ns);
                if self.strategy.gaps() != gaps || self.unconfirmed > 0 || !self.strategy.is_converged() {
                    self.distrust(until_ns);
                }
                if !self.strategy.is_attitude_known() {
                    // Until the next sample.
                    self.distrust_until(until_ns, until_ns.saturating_add(ns(config.sensors.longest_sample)));
                }
                match result {
                    Ok(()) if !self.is_bounded() => {
                        self.phase = Phase::Lost;
                        return Err(Refusal::OutOfRange.into());
                    }
                    Ok(()) => self.after(config),
                    Err(error) => {
                        if error.is_fatal() || matches!(error.reason(), Reason::Refused(Refusal::Gap { .. })) {
                            self.phase = Phase::Lost;
                        }
                        return Err(error.reason());
                    }
                }
                Ok(())
            }
        }
    }

    /// Applies an input of that stamp at the present time. After `Fatal`, this engine must be discarded.
    pub(super) fn apply(
        &mut self,
        time_ns: i64,
        entry: &Entry<F>,
        config: &StateEstimatorConfig,
    ) -> (Outcome, Option<Rejection>) {
        if matches!(entry.payload, Payload::Warm(_)) {
            // The first known time. The first sample continues from it.
            if self.now_ns.is_none() {
                (self.now_ns, self.begun_ns) = (Some(time_ns), Some(time_ns));
            }
        }
        // Reports before the first sample count as well.
        let is_told = matches!(entry.payload, Payload::Attitude(_) | Payload::Health(_) | Payload::Frame);
        let Some(now_ns) = self.now_ns.or(is_told.then_some(time_ns)) else {
            return (Err(Refusal::NotStarted.into()), None);
        };
        let mut rejection = None;
        let result = match &entry.payload {
            Payload::Warm(state) => {
                if matches!(self.phase, Phase::Running) {
                    // Only an estimator without a position accepts a warm start.
                    Err(Reason::Duplicate.into())
                } else {
                    let world = *self.world.get_or_insert_with(|| World::new(state.position));
                    let start = warm(now_ns, state, &world, config, self.bias.as_ref());
                    self.start(&start, StartedFrom::FlightController).map(|()| None).map_err(EstimatorError::from)
                }
            }
            Payload::Attitude(attitude) => {
                match &mut self.phase {
                    Phase::Starting(starter) => starter.attitude(attitude),
                    Phase::Running | Phase::Lost => {}
                }
                Ok(None)
            }
            Payload::Health(health) => {
                self.gate.health(time_ns, *health, &config.params);
                Ok(None)
            }
            Payload::Frame => match self.phase {
                Phase::Running => self.strategy.frame().map(|()| None),
                _ => Ok(None),
            },
            Payload::Vio(vio) => self.vio(vio, config),
            Payload::Anchor(anchor) => self.anchor(now_ns, anchor, config, &mut rejection),
            Payload::Gnss(fix) => self.fix(fix, config, &mut rejection),
            Payload::Provided(_, factor) => self.measure(&Measured::Provided(factor)).map(Some),
            Payload::Given(given) => self.given(given).map(Some),
            Payload::Features(features) => self.features(now_ns, features, config).map(Some),
        };
        self.after(config);
        let outcome = result.and_then(|fused| {
            let Some(fused) = fused else { return Ok(None) };
            // An image of landmarks that all wait for another direction is no measurement yet.
            let nis = (fused.dimension > 0).then(|| fused.nis / fused.dimension as f64);
            self.nis = nis.or(self.nis);
            if !self.strategy.is_converged() {
                self.distrust(now_ns);
                return Err(Reason::NotConverged.into());
            }
            Ok(nis)
        });
        (outcome, rejection)
    }

    fn start(&mut self, start: &Start, from: StartedFrom) -> Result<(), Reason> {
        self.leave();
        self.strategy.start(start)?;
        self.phase = Phase::Running;
        self.resets = self.resets.wrapping_add(u32::from(self.started.is_some()));
        self.started = Some((start.time_ns, from));
        self.marks.clear();
        self.gate.moved();
        Ok(())
    }

    fn distrust(&mut self, now_ns: i64) {
        self.distrust_until(now_ns, now_ns.saturating_add(DISTRUST_NS));
    }

    fn distrust_until(&mut self, now_ns: i64, until_ns: i64) {
        let goes_on = self.degraded_ns.filter(|(_, until_ns)| now_ns <= *until_ns);
        let (from_ns, before_ns) = goes_on.unwrap_or((now_ns, until_ns));
        self.degraded_ns = Some((from_ns, until_ns.max(before_ns)));
    }

    /// Updates that follow every change of the strategy's state.
    fn after(&mut self, config: &StateEstimatorConfig) {
        if !matches!(self.phase, Phase::Running) {
            return;
        }
        while let Some(pose) = self.strategy.take_left() {
            self.note(pose);
        }
        let keyframe_ns = self.strategy.keyframe_ns();
        match self.marks.back_mut() {
            Some((at_ns, sources)) if *at_ns == keyframe_ns => *sources = self.sources,
            _ => {
                if self.marks.len() > config.params.window as usize {
                    self.marks.pop_front();
                }
                self.marks.push_back((keyframe_ns, self.sources));
            }
        }
        if let (Some(world), Some((position, _))) = (self.world, self.strategy.motion()) {
            let mut moved = world;
            if let Some(new_from_old) = moved.moves_on(&position) {
                // The smoother's window restarts.
                self.leave();
                // If the move fails, the world stays where it is, and the move is tried again later.
                if self.strategy.move_world(&new_from_old).is_ok() {
                    self.world = Some(moved);
                }
            }
        }
    }

    /// Returns whether it is on the Earth and slow enough to be corrected. After corrupt samples, the state may be finite but neither.
    fn is_bounded(&self) -> bool {
        let Some((position, velocity)) = self.strategy.motion() else { return false };
        position.norm() < FARTHEST_FLIGHT && velocity.norm() <= MOST_VELOCITY
    }
}
