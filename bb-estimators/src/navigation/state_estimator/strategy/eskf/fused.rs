//! How measurements are fused: as usual, or if the attitude is lost, so that they determine it.

use super::super::{Failure, Trust, trusting};
use super::lost::{is_known, unknown};
use super::{Attitude, EskfStrategy};
use crate::navigation::fused::Fused;
use crate::navigation::jump::UNKNOWN;
use crate::navigation::measurement::{AbsolutePose, GnssPosition, GnssVelocity, RelativePose};
use crate::navigation::refusal::Refusal;
use nalgebra::Vector3;

impl EskfStrategy {
    pub(super) fn relative(&mut self, pose: &RelativePose) -> Result<Fused, Failure> {
        if !self.is_lost() {
            return self.filter.update(&mut self.streams.relative, pose).map_err(absurd);
        }
        if !self.is_keyframe_known() {
            return Err(Refusal::NoKeyframe { id: pose.keyframe }.into());
        }
        let before = self.filter;
        self.filter.set_attitude_from_keyframe(&pose.keyframe_from_body, UNKNOWN * UNKNOWN)?;
        self.filter.hold_attitude(false);
        match self.filter.update(&mut self.streams.relative, pose) {
            Ok(fused) => {
                self.know(Attitude::Known);
                Ok(fused)
            }
            Err(refusal) => {
                self.filter = before;
                Err(absurd(refusal))
            }
        }
    }

    pub(super) fn anchor(&mut self, pose: &AbsolutePose, trust: Trust) -> Result<Fused, Failure> {
        let stream = trusting(&mut self.streams.anchors, trust);
        if !matches!(self.attitude, Attitude::Lost(_)) {
            let result = self.filter.update(stream, pose);
            match &result {
                Ok(fused) if fused.raised <= 1.0 => self.confirm(),
                Err(Refusal::Gate { .. }) if matches!(self.attitude, Attitude::Doubted { .. }) => self.lose(),
                Ok(_) | Err(_) => {}
            }
            return result.map_err(absurd);
        }
        if !is_known(&pose.rotation_covariance) {
            // What it says of the attitude cannot be fused linearly.
            let position = GnssPosition {
                position: pose.position,
                covariance: pose.position_covariance,
                lever_arm: Vector3::zeros(),
            };
            let fused = self.filter.update(stream, &position).map_err(absurd)?;
            if fused.raised > 1.0 {
                self.begin_realignment();
            }
            self.realign(&position, None)?;
            return Ok(fused);
        }
        let before = self.filter;
        // At the measured attitude, its correction is zero: what is left of the measurement is linear.
        self.filter.set_attitude(&pose.world_from_body, &unknown())?;
        self.filter.hold_attitude(false);
        match self.filter.update(stream, pose) {
            Ok(fused) => {
                self.doubt();
                Ok(fused)
            }
            Err(refusal) => {
                self.filter = before;
                Err(absurd(refusal))
            }
        }
    }

    pub(super) fn gnss(
        &mut self,
        position: &GnssPosition,
        velocity: Option<&GnssVelocity>,
        trust: Trust,
    ) -> Result<Fused, Failure> {
        let was_lost = self.is_lost();
        let stream = trusting(&mut self.streams.positions, trust);
        let result = self.filter.update(stream, position);
        self.weigh(&result);
        let fused = result.map_err(absurd)?;
        // A receiver with a good position is trusted even if its velocity is refused.
        let velocity =
            velocity.filter(|velocity| self.filter.update(&mut self.streams.velocities, *velocity).is_ok());
        if fused.raised > 1.0 && was_lost {
            // Those before disagree.
            self.begin_realignment();
        }
        self.realign(position, velocity)?;
        Ok(fused)
    }
}

/// A correction that would move the filter farther than any distance on the Earth is fatal, as it is for the smoother.
pub(super) fn absurd(refusal: Refusal) -> Failure {
    match refusal {
        Refusal::OutOfRange => Failure::Fatal(refusal),
        _ => Failure::Refused(refusal),
    }
}
