//! Measurements of the position: how they are fused, how far they are trusted, and when they move the estimate.

use nalgebra::{Matrix3, Vector3};

use super::{CONFIRMATIONS, Engine, Phase};
use crate::navigation::fused::Fused;
use crate::navigation::measurement::{GnssPosition, RelativePose};
use crate::navigation::refusal::Refusal;
use crate::navigation::state_estimator::error::Reason;
use crate::navigation::state_estimator::event::StartedFrom;
use crate::navigation::state_estimator::factor::ProvidedFactor;
use crate::navigation::state_estimator::gate::Rejection;
use crate::navigation::state_estimator::input::{GnssReading, HEIGHTS, PoseAnchor, VioOutput, blocks};
use crate::navigation::state_estimator::params::StateEstimatorConfig;
use crate::navigation::state_estimator::start::at_anchor;
use crate::navigation::state_estimator::strategy::{Failure, Measured, PATIENCE, Place, Trust, id_of};
use crate::navigation::state_estimator::world::World;

/// Normalised innovation squared over the dimension up to which a position fits.
const FITS: f64 = 3.0;

/// Number of consecutive refused relative poses that are more than outliers.
const STORM: u64 = 3;

/// Number of consecutive refused positions that are more than outliers. Positions arrive about once a second.
const DOUBT: u64 = 2;

/// Normalised innovation squared over the dimension at which a single position makes the estimate doubtful: thirty standard
/// deviations. A position that overrules the estimate from this far restarts it instead of correcting it.
const FAR: f64 = 1000.0;

/// Time without a camera or an anchor after which a trusted receiver may overrule the estimate, ns: the IMU alone is less certain.
const ALONE_NS: i64 = 60_000_000_000;

impl<F: ProvidedFactor> Engine<F> {
    pub(super) fn measure(&mut self, measured: &Measured<'_, F>) -> Result<Fused, Trouble> {
        if !matches!(self.phase, Phase::Running) {
            return Err(Refusal::NotStarted.into());
        }
        let was_lost = self.strategy.is_attitude_lost();
        let result = self.strategy.measure(measured);
        self.realigned(was_lost);
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

    pub(super) fn vio(&mut self, vio: &VioOutput, config: &StateEstimatorConfig) -> Result<Option<Fused>, Trouble> {
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

    pub(super) fn anchor(
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
            self.distrust(now_ns);
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
        // As the fixes are compared: what the anchor corrects is no difference between the two.
        let before = self.strategy.motion();
        let result = self.measure(&Measured::Anchor(measured, trust));
        self.refused_anchor = match &result {
            Err(Trouble::Degraded(Reason::Refused(Refusal::Gate { nis, .. }))) => nis / 6.0,
            _ => 0.0,
        };
        let fused = result?;
        if let Some((position, _)) = before {
            let offset = measured.position - position;
            *rejection = self.gate.anchor(anchor.time_ns, &offset, &config.params).and_then(Result::err);
        }
        if fused.raised > FAR || (fused.raised > 1.0 && self.overruled > 1) {
            // Far off, or still wrong after the last correction: the estimate is unreliable.
            self.start_at(now_ns, anchor, config)?;
        }
        self.sources.anchored(anchor.time_ns, &config.params);
        self.is_anchor_degraded = anchor.is_covariance_degraded;
        Ok(Some(fused))
    }

    fn start_at(&mut self, now_ns: i64, anchor: &PoseAnchor, config: &StateEstimatorConfig) -> Result<(), Reason> {
        let world = *self.world.get_or_insert_with(|| World::new(anchor.position));
        self.start(&at_anchor(now_ns, anchor, &world, config, self.bias.as_ref()), StartedFrom::Anchor)
    }

    pub(super) fn fix(
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
        // Anchors, with which it is compared, are positions of the body.
        let antenna = self.strategy.attitude().map_or_else(Vector3::zeros, |attitude| attitude * fix.lever_arm);
        let offset = measured.position - antenna - position;
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
        self.gate.moved();
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
pub(super) enum Trouble {
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
