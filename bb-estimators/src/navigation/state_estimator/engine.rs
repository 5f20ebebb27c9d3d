//! The deterministic part of the estimator: the estimate, its label and the gate depend only on the inputs in their order. The
//! engine can be copied and run again, and a late input then gives the same result as one that arrives in time.

use alloc::collections::VecDeque;

use nalgebra::{Matrix3, Vector3};

use super::agreement::Agreement;
use super::entry::{Entry, Key, Outcome, Payload};
use super::error::Reason;
use super::event::StartedFrom;
use super::factor::ProvidedFactor;
use super::gate::{Rejection, SpoofGate};
use super::input::{GnssReading, HEIGHTS, ImuBias, MOST_VELOCITY, PoseAnchor, TakeoffOrigin, VioOutput, blocks};
use super::label::Sources;
use super::params::{StateEstimatorConfig, ns};
use super::start::{Starter, at_anchor, warm};
use super::strategy::{Failure, Measured, PATIENCE, Place, Pose, Predictor, Strategy, Trust, id_of};
use super::world::World;
use crate::attitude::ParamsError;
use crate::navigation::eskf::{ImuMean, Start};
use crate::navigation::fused::Fused;
use crate::navigation::measurement::{GnssPosition, RelativePose};
use crate::navigation::refusal::Refusal;

/// How long an estimate is distrusted after an input that does not fit, s.
const DISTRUST: f64 = 1.0;

/// Number of consecutive positions that must fit before an estimate is trusted again after positions overruled it.
const CONFIRMATIONS: u32 = 5;

/// Normalised innovation squared over the dimension up to which a position fits.
const FITS: f64 = 3.0;

/// Largest possible distance from the origin, m: beyond the other side of the Earth.
const FARTHEST: f64 = 1.4e7;

/// Number of consecutive refused relative poses that are more than outliers.
const STORM: u64 = 3;

/// Number of consecutive refused positions that are more than outliers. Positions arrive about once a second.
const DOUBT: u64 = 2;

/// Normalised innovation squared over the dimension at which a single position makes the estimate doubtful: thirty standard
/// deviations. A position that overrules the estimate from this far restarts it instead of correcting it.
const FAR: f64 = 1000.0;

/// Time without a camera or an anchor after which a trusted receiver may overrule the estimate, ns: the IMU alone is less certain.
const ALONE_NS: i64 = 60_000_000_000;

/// See the module.
#[derive(Clone, Debug)]
pub(super) struct Engine<F: ProvidedFactor> {
    /// The key of the last input that was applied.
    key: Key,
    /// The IMU time up to which it has run.
    now_ns: Option<i64>,
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
    /// Number of times that positions have overruled it since it was last confirmed.
    overruled: u32,
    /// Positions of the receiver and of the anchors. One that does not fit overrules the estimate only if earlier ones agree with
    /// it.
    fixes: Agreement,
    anchors: Agreement,
    /// Normalised innovations squared of the last refused fix and the last refused anchor, over their dimension.
    refused_fix: f64,
    refused_anchor: f64,
    left: Option<(Pose, Sources)>,
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
            key: Key::FIRST,
            now_ns: None,
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
            overruled: 0,
            fixes: Agreement::default(),
            anchors: Agreement::default(),
            refused_fix: 0.0,
            refused_anchor: 0.0,
            left: None,
        })
    }

    pub(super) fn set_origin(&mut self, origin: &TakeoffOrigin) {
        self.origin = Some(*origin);
        self.world = Some(World::new(origin.position));
    }

    pub(super) fn key(&self) -> Key {
        self.key
    }

    pub(super) fn now_ns(&self) -> Option<i64> {
        self.now_ns
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
        self.degraded_ns.is_some_and(|(from_ns, until_ns)| (from_ns..=until_ns).contains(&time_ns))
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
        (self.key, self.now_ns) = (Key::FIRST, None);
        self.sources = Sources::default();
        self.gate.forget_times();
        (self.fixes, self.anchors) = (Agreement::default(), Agreement::default());
        self.marks.clear();
        (self.degraded_ns, self.left) = (None, None);
        // The measurement counts as made now: a receiver must not benefit.
        self.independent_ns = self.independent_ns.and(Some(sample_ns));
        match self.phase {
            Phase::Starting(_) => self.phase = Phase::Starting(Starter::new(config)),
            Phase::Lost => {}
            Phase::Running => {
                let resumed_ns = sample_ns.saturating_sub(for_ns.saturating_mul(2));
                if self.strategy.set_clock(resumed_ns).is_ok() {
                    self.now_ns = Some(resumed_ns);
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

    pub(super) fn take_left(&mut self) -> Option<(Pose, Sources)> {
        self.left.take()
    }

    fn sources_at(&self, time_ns: i64) -> Sources {
        let mark = self.marks.iter().rev().find(|(at_ns, _)| *at_ns <= time_ns);
        mark.map_or(self.sources, |(_, sources)| *sources)
    }

    /// Advances by one sample of the IMU, or by part of one. A gap may precede it.
    pub(super) fn advance(
        &mut self,
        key: Key,
        sample: &ImuMean,
        is_gap: bool,
        config: &StateEstimatorConfig,
    ) -> Result<(), Reason> {
        self.key = key;
        let is_first = self.now_ns.is_none();
        self.now_ns = Some(sample.time_ns);
        match &mut self.phase {
            Phase::Starting(starter) => {
                starter.sample(sample);
                // A sample is a mean since the previous one. The first has none.
                if let (false, Some(origin)) = (is_first, &self.origin)
                    && let Some(start) = starter.at_origin(sample.time_ns, origin, config, self.bias.as_ref())
                {
                    self.start(&start, StartedFrom::Origin)?;
                }
                Ok(())
            }
            Phase::Lost => Ok(()),
            Phase::Running => {
                let gaps = self.strategy.gaps();
                let result = self.strategy.propagate(sample);
                if is_gap || self.strategy.gaps() != gaps || self.unconfirmed > 0 {
                    self.distrust(sample.time_ns);
                }
                match result {
                    Ok(()) if !self.is_bounded() => {
                        self.phase = Phase::Lost;
                        return Err(Refusal::OutOfRange.into());
                    }
                    Ok(()) => self.after(config),
                    Err(Failure::Refused(Refusal::Gap { seconds })) => {
                        self.phase = Phase::Lost;
                        return Err(Refusal::Gap { seconds }.into());
                    }
                    Err(Failure::Fatal(refusal)) => {
                        self.phase = Phase::Lost;
                        return Err(refusal.into());
                    }
                    Err(Failure::Refused(refusal)) => return Err(refusal.into()),
                }
                Ok(())
            }
        }
    }

    /// Applies an input at the present time. After `Fatal`, this engine must be discarded.
    pub(super) fn apply(
        &mut self,
        entry: &Entry<F>,
        config: &StateEstimatorConfig,
    ) -> (Outcome, Option<Rejection>) {
        self.key = entry.key;
        if matches!(entry.payload, Payload::Warm(_)) {
            // The first known time. The first sample continues from it.
            self.now_ns = self.now_ns.or(Some(entry.key.time_ns));
        }
        // Reports before the first sample count as well.
        let is_told = matches!(entry.payload, Payload::Attitude(_) | Payload::Health(_) | Payload::Frame);
        let Some(now_ns) = self.now_ns.or(is_told.then_some(entry.key.time_ns)) else {
            return (Outcome::Degraded(Refusal::NotStarted.into()), None);
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
                    self.start(&start, StartedFrom::FlightController).map(|()| None).map_err(Trouble::from)
                }
            }
            Payload::Attitude(attitude) => {
                if let Phase::Starting(starter) = &mut self.phase {
                    starter.attitude(attitude);
                }
                Ok(None)
            }
            Payload::Health(health) => {
                self.gate.health(entry.key.time_ns, *health, &config.params);
                Ok(None)
            }
            Payload::Frame => match self.phase {
                Phase::Running => self.strategy.frame().map(|()| None).map_err(Trouble::from),
                _ => Ok(None),
            },
            Payload::Vio(vio) => self.vio(vio, config),
            Payload::Anchor(anchor) => self.anchor(now_ns, anchor, config, &mut rejection),
            Payload::Gnss(fix) => self.fix(fix, config, &mut rejection),
            Payload::Provided(_, factor) => self.measure(&Measured::Provided(factor)).map(Some),
        };
        self.after(config);
        let outcome = match result {
            Ok(Some(fused)) => {
                let nis = fused.nis / fused.dimension.max(1) as f64;
                self.nis = Some(nis);
                if fused.raised > 1.0 {
                    self.distrust(now_ns);
                    Outcome::Degraded(Reason::Raised { factor: fused.raised })
                } else {
                    Outcome::Added { nis: Some(nis) }
                }
            }
            Ok(None) => Outcome::Added { nis: None },
            Err(Trouble::Degraded(reason)) => Outcome::Degraded(reason),
            Err(Trouble::Fatal(reason)) => Outcome::Fatal(reason),
        };
        (outcome, rejection)
    }

    fn start(&mut self, start: &Start, from: StartedFrom) -> Result<(), Reason> {
        self.strategy.start(start)?;
        self.phase = Phase::Running;
        self.resets = self.resets.wrapping_add(u32::from(self.started.is_some()));
        self.started = Some((start.time_ns, from));
        self.marks.clear();
        Ok(())
    }

    fn distrust(&mut self, now_ns: i64) {
        let goes_on = self.degraded_ns.filter(|(_, until_ns)| now_ns <= *until_ns);
        let from_ns = goes_on.map_or(now_ns, |(from_ns, _)| from_ns);
        self.degraded_ns = Some((from_ns, now_ns.saturating_add(ns(DISTRUST))));
    }

    /// Updates that follow every change of the strategy's state.
    fn after(&mut self, config: &StateEstimatorConfig) {
        if !matches!(self.phase, Phase::Running) {
            return;
        }
        if let Some(pose) = self.strategy.take_left() {
            self.left = Some((pose, self.sources_at(pose.time_ns)));
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
        if let (Some(world), Some((position, _))) = (&mut self.world, self.strategy.motion()) {
            let mut moved = *world;
            // If the move fails, the world stays where it is, and the move is tried again later.
            if let Some(new_from_old) = moved.moves_on(&position)
                && self.strategy.move_world(&new_from_old).is_ok()
            {
                *world = moved;
            }
        }
    }

    fn measure(&mut self, measured: &Measured<'_, F>) -> Result<Fused, Trouble> {
        if !matches!(self.phase, Phase::Running) {
            return Err(Refusal::NotStarted.into());
        }
        let result = self.strategy.measure(measured);
        let is_relative = matches!(measured, Measured::Relative(_));
        match &result {
            // After this, its earlier position is not reliable either.
            Ok(fused) if is_relative && fused.raised > 1.0 => self.unconfirmed = CONFIRMATIONS,
            result if !is_relative => {
                let refused = match measured {
                    Measured::Gnss(..) => self.strategy.refused_fixes(),
                    _ => self.strategy.refused_positions(),
                };
                self.weigh_position(result, refused >= DOUBT);
            }
            _ => {}
        }
        let is_storm = is_relative && self.strategy.refused_relative() >= STORM;
        if let (true, Some(now_ns)) = (is_storm || self.unconfirmed > 0, self.now_ns) {
            self.distrust(now_ns);
        }
        let fused = result?;
        self.resets = self.resets.wrapping_add(u32::from(fused.raised > 1.0));
        if !matches!(measured, Measured::Gnss(..)) {
            self.independent_ns = self.now_ns;
        }
        if !self.is_bounded() || (!is_relative && !self.is_height_plausible()) {
            return Err(Trouble::Fatal(Refusal::OutOfRange.into()));
        }
        Ok(fused)
    }

    /// Whether it is on the Earth and slow enough to be corrected. After corrupt samples, the state may be finite but neither.
    fn is_bounded(&self) -> bool {
        let Some((position, velocity)) = self.strategy.motion() else { return false };
        position.norm() < FARTHEST && velocity.norm() <= MOST_VELOCITY
    }

    /// Whether an aircraft can be at this height. With the IMU alone, the height may drift out of the range until a position
    /// corrects it. After that, it must be within the range.
    fn is_height_plausible(&self) -> bool {
        let (Some((position, _)), Some(world)) = (self.strategy.motion(), &self.world) else { return false };
        HEIGHTS.contains(&world.height(&position))
    }

    /// Updates the trust in the estimate from the result of a position.
    fn weigh_position(&mut self, result: &Result<Fused, Failure>, is_repeated: bool) {
        let is_far = |nis: f64| nis > FAR * 6.0;
        let is_doubtful = match result {
            Err(Failure::Refused(Refusal::Gate { nis, .. })) => is_repeated || is_far(*nis),
            _ => false,
        };
        match result {
            Ok(fused) if fused.raised > 1.0 => {
                self.unconfirmed = CONFIRMATIONS;
                self.overruled += 1;
            }
            Ok(fused) if fused.nis <= FITS * fused.dimension as f64 => {
                self.unconfirmed = self.unconfirmed.saturating_sub(1);
                if self.unconfirmed == 0 {
                    self.overruled = 0;
                }
            }
            _ if self.unconfirmed > 1 => self.unconfirmed = CONFIRMATIONS,
            _ if is_doubtful => self.unconfirmed = self.unconfirmed.max(1),
            _ => {}
        }
    }

    fn vio(&mut self, vio: &VioOutput, config: &StateEstimatorConfig) -> Result<Option<Fused>, Trouble> {
        self.bias = vio.bias.or(self.bias);
        let [translation_covariance, rotation_covariance] = blocks(&vio.covariance);
        let fused = self.measure(&Measured::Relative(RelativePose {
            keyframe: id_of(vio.from_ns),
            translation: vio.translation,
            keyframe_from_body: vio.from_to,
            translation_covariance,
            rotation_covariance,
        }))?;
        self.sources.seen(vio.to_ns, &config.params);
        Ok(Some(fused))
    }

    fn anchor(
        &mut self,
        now_ns: i64,
        anchor: &PoseAnchor,
        config: &StateEstimatorConfig,
        rejection: &mut Option<Rejection>,
    ) -> Result<Option<Fused>, Trouble> {
        let can_start = match self.phase {
            Phase::Lost => true,
            Phase::Starting(_) => self.origin.is_none(),
            Phase::Running => false,
        };
        if can_start {
            self.start_at(now_ns, anchor, config)?;
            // A single anchor may be an outlier.
            self.unconfirmed = self.unconfirmed.max(1);
            // From here on, an anchor supports the receiver.
            self.independent_ns = Some(now_ns);
            self.sources.anchored(anchor.time_ns, &config.params);
            self.is_anchor_degraded = anchor.is_covariance_degraded;
            return Ok(None);
        }
        let world = self.world.ok_or(Refusal::NotStarted)?;
        let measured = world.anchor(anchor);
        let trust = self.anchors.add(anchor.time_ns, &anchor.position, &blocks(&anchor.covariance)[0]);
        let is_repeated = self.strategy.refused_positions() >= u64::from(PATIENCE);
        if trust == Trust::Believed && is_repeated && self.refused_anchor > FAR {
            // The estimate is unreliable, and a correction might move it off the Earth.
            self.start_at(now_ns, anchor, config)?;
            self.unconfirmed = CONFIRMATIONS;
            self.overruled += 1;
            self.distrust(now_ns);
            self.independent_ns = Some(now_ns);
            self.sources.anchored(anchor.time_ns, &config.params);
            self.is_anchor_degraded = anchor.is_covariance_degraded;
            let factor = core::mem::take(&mut self.refused_anchor);
            return Err(Reason::Raised { factor }.into());
        }
        let result = self.measure(&Measured::Anchor(measured, trust));
        self.refused_anchor = match &result {
            Err(Trouble::Degraded(Reason::Refused(Refusal::Gate { nis, .. }))) => nis / 6.0,
            _ => 0.0,
        };
        let fused = result?;
        if fused.raised > FAR || (fused.raised > 1.0 && self.overruled > 1) {
            // Far off, or still wrong after the last correction: the estimate is unreliable.
            self.start_at(now_ns, anchor, config)?;
        }
        self.sources.anchored(anchor.time_ns, &config.params);
        self.is_anchor_degraded = anchor.is_covariance_degraded;
        if let Some((position, _)) = self.strategy.motion() {
            let offset = measured.position - position;
            *rejection = self.gate.anchor(anchor.time_ns, &offset, &config.params).and_then(Result::err);
        }
        Ok(Some(fused))
    }

    fn start_at(&mut self, now_ns: i64, anchor: &PoseAnchor, config: &StateEstimatorConfig) -> Result<(), Reason> {
        let world = *self.world.get_or_insert_with(|| World::new(anchor.position));
        self.start(&at_anchor(now_ns, anchor, &world, config, self.bias.as_ref()), StartedFrom::Anchor)
    }

    fn fix(
        &mut self,
        fix: &GnssReading,
        config: &StateEstimatorConfig,
        rejection: &mut Option<Rejection>,
    ) -> Result<Option<Fused>, Trouble> {
        let motion = self.strategy.motion().filter(|_| matches!(self.phase, Phase::Running));
        let (Some(world), Some((position, _))) = (self.world, motion) else {
            return Err(Refusal::NotStarted.into());
        };
        let (measured, velocity) = world.fix(fix);
        let offset: Vector3<f64> = measured.position - position;
        if let Err(rejected) = self.gate.fix(fix.time_ns, &offset, &config.params) {
            *rejection = Some(rejected);
            return Err(Trouble::Degraded(Reason::Gate(rejected)));
        }
        let trust = self.fixes.add(fix.time_ns, &fix.position, &fix.covariance);
        // With a camera or anchors, the receiver overrules nothing: a spoofer can be patient.
        let is_alone = self.independent_ns.is_none_or(|at_ns| fix.time_ns.saturating_sub(at_ns) > ALONE_NS);
        let trust = if is_alone { trust } else { Trust::Doubted };
        let is_repeated = self.strategy.refused_fixes() >= u64::from(PATIENCE);
        if trust == Trust::Believed && is_repeated && self.refused_fix > FAR {
            let told = velocity.map(|velocity| (velocity.velocity, velocity.covariance));
            self.relocate(&measured, told.or_else(|| self.fixes.velocity(&world)))?;
            self.sources.anchored(fix.time_ns, &config.params);
            let factor = core::mem::take(&mut self.refused_fix);
            return Err(Reason::Raised { factor }.into());
        }
        let result = self.measure(&Measured::Gnss(measured, velocity, trust));
        self.refused_fix = match &result {
            Err(Trouble::Degraded(Reason::Refused(Refusal::Gate { nis, .. }))) => nis / 3.0,
            _ => 0.0,
        };
        let fused = result?;
        self.sources.anchored(fix.time_ns, &config.params);
        Ok(Some(fused))
    }

    /// Moves to the position of fixes far from the estimate. A correction would also attribute the difference to errors of attitude
    /// and biases.
    fn relocate(
        &mut self,
        fix: &GnssPosition,
        velocity: Option<(Vector3<f64>, Matrix3<f64>)>,
    ) -> Result<(), Reason> {
        let place = Place { position: (fix.position, fix.covariance), lever_arm: fix.lever_arm, velocity };
        self.strategy.relocate(&place)?;
        self.marks.clear();
        self.unconfirmed = CONFIRMATIONS;
        self.overruled += 1;
        self.resets = self.resets.wrapping_add(1);
        if let Some(now_ns) = self.now_ns {
            self.distrust(now_ns);
            self.started = Some((now_ns, StartedFrom::Receiver));
        }
        Ok(())
    }
}

/// Why an input is not in the estimate.
enum Trouble {
    Degraded(Reason),
    Fatal(Reason),
}

impl From<Failure> for Trouble {
    fn from(failure: Failure) -> Self {
        match failure {
            Failure::Refused(refusal) => Self::Degraded(refusal.into()),
            Failure::Fatal(refusal) => Self::Fatal(refusal.into()),
        }
    }
}

impl From<Refusal> for Trouble {
    fn from(refusal: Refusal) -> Self {
        Self::Degraded(refusal.into())
    }
}

impl From<Reason> for Trouble {
    fn from(reason: Reason) -> Self {
        Self::Degraded(reason)
    }
}
