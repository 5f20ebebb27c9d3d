//! How measurements are fused: as usual, or if the attitude is lost, so that they determine it.

use super::super::{Failure, Trust, trusting};
use super::lost::{is_known, unknown};
use super::{Attitude, EskfStrategy};
use crate::navigation::fused::Fused;
use crate::navigation::jump::UNKNOWN;
use crate::navigation::measurement::{
    AbsolutePose, GnssPosition, GnssVelocity, Linearised, Measurement, RelativePose,
};
use crate::navigation::navigator::{NAVIGATED, Navigated};
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{Estimate, States, VELOCITY};
use crate::navigation::stream::Stream;
use nalgebra::Vector3;

/// Standard deviation of the velocity, m/s, from which on a relative pose is linearised where it leads: the way between two frames is then
/// wrong by more than the camera is.
const SLOW: f64 = 1.0;

/// Number of times that it is.
const ITERATIONS: usize = 3;

impl EskfStrategy {
    pub(super) fn relative(&mut self, pose: &RelativePose) -> Result<Fused, Failure> {
        if !self.is_lost() {
            return self.relate(pose).map_err(absurd);
        }
        if !self.is_keyframe_known() {
            return Err(Refusal::NoKeyframe { id: pose.keyframe }.into());
        }
        let before = self.filter;
        self.filter.set_attitude_from_keyframe(&pose.keyframe_from_body, UNKNOWN * UNKNOWN)?;
        self.filter.hold_attitude(false);
        self.is_fast = true;
        match self.relate(pose) {
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

    /// Fuses a relative pose. Its derivative with respect to the attitude of the keyframe is the way since. As long as an unknown velocity
    /// makes that a wrong one, the pose is linearised again where it leads: else it seems to tell the attitude, and tells a wrong one.
    pub(super) fn relate(&mut self, pose: &RelativePose) -> Result<Fused, Refusal> {
        let covariance = self.filter.covariance();
        self.is_fast &= (VELOCITY..VELOCITY + 3).any(|i| covariance[(i, i)] > SLOW * SLOW);
        let (true, Some(estimate)) = (self.is_fast, self.filter.estimate().copied()) else {
            return self.filter.update(&mut self.streams.relative, pose);
        };
        let mut at = estimate;
        for _ in 0..ITERATIONS {
            let mut led = self.filter;
            led.update_ungated(&mut Stream::default(), &Relinearised::new(pose, &estimate, &at)?)?;
            at = *led.estimate().ok_or(Refusal::NotStarted)?;
        }
        self.filter.update(&mut self.streams.relative, &Relinearised::new(pose, &estimate, &at)?)
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
                self.is_fast = true;
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

/// A relative pose linearised at another estimate, for the filter's.
struct Relinearised(Linearised<6, NAVIGATED>);

impl Relinearised {
    fn new(pose: &RelativePose, estimate: &Estimate<NAVIGATED>, at: &Estimate<NAVIGATED>) -> Result<Self, Refusal> {
        let mut model = Linearised::new();
        pose.linearise::<Navigated, NAVIGATED>(at, &mut model)?;
        let error = estimate.error_to::<Navigated>(at);
        for (residual, row) in model.residual.iter_mut().zip(&model.jacobian) {
            *residual += row.iter().zip(&error).map(|(derivative, error)| derivative * error).sum::<f64>();
        }
        Ok(Self(model))
    }
}

impl Measurement<6> for Relinearised {
    fn linearise<S: States, const N: usize>(
        &self,
        _: &Estimate<N>,
        model: &mut Linearised<6, N>,
    ) -> Result<(), Refusal> {
        (model.residual, model.noise) = (self.0.residual, self.0.noise);
        for (row, from) in model.jacobian.iter_mut().zip(&self.0.jacobian) {
            row.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
        }
        Ok(())
    }
}
