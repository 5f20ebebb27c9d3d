//! Measurements of the position: how they are fused, how far they are trusted, and when they move the estimate.

use nalgebra::Vector3;

use super::{CONFIRMATIONS, Engine, Phase};
use crate::navigation::fused::Fused;
use crate::navigation::measurement::RelativePose;
use crate::navigation::numbers::{ALONE_NS, DOUBTFUL_POSITION, FITS, HEIGHTS, POSITION_STORM, STORM};
use crate::navigation::refusal::Refusal;
use crate::navigation::state_estimator::error::{EstimatorError, Reason};
use crate::navigation::state_estimator::event::StartedFrom;
use crate::navigation::state_estimator::factor::ProvidedFactor;
use crate::navigation::state_estimator::gate::Rejection;
use crate::navigation::state_estimator::given::{FactorForm, GivenFactor};
use crate::navigation::state_estimator::input::{Feature, GnssReading, PoseAnchor, VioOutput, blocks};
use crate::navigation::state_estimator::params::StateEstimatorConfig;
use crate::navigation::state_estimator::start::at_anchor;
use crate::navigation::state_estimator::strategy::{Measured, Streams, Trust, id_of};
use crate::navigation::state_estimator::world::World;
use crate::navigation::stream::Stream;

impl<F: ProvidedFactor> Engine<F> {
    pub(super) fn measure(&mut self, measured: &Measured<'_, F>) -> Result<Fused, EstimatorError> {
        if !matches!(self.phase, Phase::Running) {
            return Err(Refusal::NotStarted.into());
        }
        let resets = self.strategy.resets();
        let result = self.strategy.measure(measured);
        let is_relative = matches!(measured, Measured::Relative(_) | Measured::Between(_) | Measured::Features(_));
        if self.strategy.resets() != resets {
            return self.moved(&result, matches!(measured, Measured::Gnss(..)));
        }
        let refused = |stream: &Stream| stream.counts().gate_in_a_row;
        let Streams { relative, anchors, positions, provided, .. } = self.strategy.streams();
        let is_storm = is_relative && refused(relative) >= STORM;
        let refused_positions = match measured {
            Measured::Gnss(..) => refused(positions),
            _ => refused(anchors).max(refused(provided)),
        };
        if !is_relative {
            self.weigh_position(&result, refused_positions >= POSITION_STORM);
        }
        if let (true, Some(now_ns)) = (is_storm || self.unconfirmed > 0, self.now_ns) {
            self.distrust(now_ns);
        }
        let fused = result?;
        // Landmarks that wait for another direction say nothing yet.
        if !matches!(measured, Measured::Gnss(..)) && fused.dimension > 0 {
            self.independent_ns = self.now_ns;
        }
        if !self.is_bounded() || (!is_relative && !self.is_height_plausible()) {
            return Err(EstimatorError::fatal(Refusal::OutOfRange));
        }
        Ok(fused)
    }

    /// The estimate has gone on where positions are that it had refused, the last of them with this result.
    fn moved(&mut self, result: &Result<Fused, EstimatorError>, is_fix: bool) -> Result<Fused, EstimatorError> {
        self.gate.moved();
        self.marks.clear();
        self.unconfirmed = CONFIRMATIONS;
        self.resets = self.resets.wrapping_add(1);
        if let Some(now_ns) = self.now_ns {
            self.distrust(now_ns);
            let from = if is_fix { StartedFrom::Receiver } else { StartedFrom::Anchor };
            self.started = Some((now_ns, from));
            self.independent_ns = if is_fix { self.independent_ns } else { Some(now_ns) };
        }
        let nis = match result {
            Ok(fused) => fused.nis,
            Err(EstimatorError::Degraded(Reason::Refused(Refusal::Gate { nis, .. }))) => *nis,
            Err(_) => 0.0,
        };
        Err(Reason::Overruled { nis }.into())
    }

    /// Returns whether an aircraft can be at this height. With the IMU alone, the height may drift out of the range until a position
    /// corrects it. After that, it must be within the range.
    fn is_height_plausible(&self) -> bool {
        let (Some((position, _)), Some(world)) = (self.strategy.motion(), &self.world) else { return false };
        HEIGHTS.contains(&world.height(&position))
    }

    /// Updates the trust in the estimate from the result of a position.
    fn weigh_position(&mut self, result: &Result<Fused, EstimatorError>, is_repeated: bool) {
        let is_far = |nis: f64| nis > DOUBTFUL_POSITION * 6.0;
        let is_doubtful = match result {
            Err(EstimatorError::Degraded(Reason::Refused(Refusal::Gate { nis, .. }))) => {
                is_repeated || is_far(*nis)
            }
            _ => false,
        };
        match result {
            Ok(fused) if fused.nis <= FITS * fused.dimension as f64 => {
                self.unconfirmed = self.unconfirmed.saturating_sub(1);
            }
            _ if self.unconfirmed > 1 => self.unconfirmed = CONFIRMATIONS,
            _ if is_doubtful => self.unconfirmed = self.unconfirmed.max(1),
            _ => {}
        }
    }

    pub(super) fn vio(
        &mut self,
        vio: &VioOutput,
        config: &StateEstimatorConfig,
    ) -> Result<Option<Fused>, EstimatorError> {
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

    pub(super) fn features(
        &mut self,
        now_ns: i64,
        features: &[Feature],
        config: &StateEstimatorConfig,
    ) -> Result<Fused, EstimatorError> {
        let fused = self.measure(&Measured::Features(features))?;
        if fused.dimension > 0 {
            self.sources.seen(now_ns, &config.params);
        }
        Ok(fused)
    }

    pub(super) fn given(&mut self, given: &GivenFactor) -> Result<Fused, EstimatorError> {
        match &given.form {
            FactorForm::Linear(linear) => {
                let rows = self.world.ok_or(Refusal::NotStarted)?.rows(linear)?;
                self.measure(&Measured::Linear(&rows))
            }
            FactorForm::Relative(relative) => {
                let [translation_covariance, rotation_covariance] = blocks(&relative.covariance);
                self.measure(&Measured::Between(RelativePose {
                    keyframe: id_of(relative.from_ns),
                    translation: relative.translation,
                    keyframe_from_body: relative.from_to,
                    translation_covariance,
                    rotation_covariance,
                }))
            }
        }
    }

    pub(super) fn anchor(
        &mut self,
        now_ns: i64,
        anchor: &PoseAnchor,
        config: &StateEstimatorConfig,
        rejection: &mut Option<Rejection>,
    ) -> Result<Option<Fused>, EstimatorError> {
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
        // Like fixes, anchors are compared with the estimate before they correct it.
        let before = self.strategy.motion();
        let result = self.measure(&Measured::Anchor(measured));
        if self.is_in(&result) {
            self.sources.anchored(anchor.time_ns, &config.params);
            self.is_anchor_degraded = anchor.is_covariance_degraded;
        }
        let fused = result?;
        if let Some((position, _)) = before {
            let offset = measured.position - position;
            *rejection = self.gate.anchor(anchor.time_ns, &offset, &config.params).and_then(Result::err);
        }
        Ok(Some(fused))
    }

    /// Use of a position by the estimate.
    fn is_in(&self, result: &Result<Fused, EstimatorError>) -> bool {
        matches!(result, Ok(_) | Err(EstimatorError::Degraded(Reason::Overruled { .. })))
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
    ) -> Result<Option<Fused>, EstimatorError> {
        let motion = self.strategy.motion().filter(|_| matches!(self.phase, Phase::Running));
        let (Some(world), Some((position, _))) = (self.world, motion) else {
            return Err(Refusal::NotStarted.into());
        };
        let (measured, velocity) = world.fix(fix);
        // The fix is compared with anchors, which are positions of the body.
        let antenna = self.strategy.attitude().map_or_else(Vector3::zeros, |attitude| attitude * fix.lever_arm);
        let offset = measured.position - antenna - position;
        if let Err(rejected) = self.gate.fix(fix.time_ns, &offset, &config.params) {
            *rejection = Some(rejected);
            return Err(EstimatorError::Degraded(Reason::Gate(rejected)));
        }
        // While there is a camera or an anchor, fixes must not move the estimate: a spoofer can wait for the time that a newcomer needs.
        let is_alone = self.independent_ns.is_none_or(|at_ns| fix.time_ns.saturating_sub(at_ns) > ALONE_NS);
        let trust = if is_alone { Trust::Believed } else { Trust::Doubted };
        let result = self.measure(&Measured::Gnss(measured, velocity, trust));
        if self.is_in(&result) {
            self.sources.located(fix.time_ns, &config.params);
        }
        Ok(Some(result?))
    }
}
