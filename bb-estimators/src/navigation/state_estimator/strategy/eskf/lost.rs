//! Whether the attitude is known, and how a lost one is determined.

use super::super::Failure;
use super::{Attitude, EskfStrategy};
use crate::navigation::eskf::seconds_between;
use crate::navigation::fused::Fused;
use crate::navigation::jump::UNKNOWN;
use crate::navigation::measurement::{GnssPosition, GnssVelocity};
use crate::navigation::realignment::{KNOWN, Realigned, Realignment};
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{Estimate, NAVIGATION, Optional, ROTATION, offset};
use crate::navigation::state::{NAVIGATED, Navigated};
use alloc::boxed::Box;
use nalgebra::{Matrix3, SMatrix, UnitQuaternion};

/// Standard deviation of the attitude after a gap, rad, from which on a filter does not correct it: a gap of two thirds of a second.
const LOST: f64 = 0.8;

/// Standard deviation of an attitude that is well known, rad.
const WELL: f64 = 0.3;

/// How long fixes have to fit, ns, before an attitude that was given is trusted. If it is wrong, gravity has led the position away by
/// then.
const LASTING_NS: i64 = 3_000_000_000;

impl EskfStrategy {
    /// Adds a position that the gate has let in to those that determine the attitude.
    pub(super) fn realign(
        &mut self,
        position: &GnssPosition,
        velocity: Option<&GnssVelocity>,
    ) -> Result<(), Failure> {
        let Some(realignment) = self.realignment() else { return Ok(()) };
        realignment.position(position);
        if let Some(velocity) = velocity {
            realignment.velocity(velocity);
        }
        match realignment.solve() {
            Ok(Some(realigned)) if !self.is_lost() && self.agrees(&realigned.world_from_body) => {
                self.confirm();
                Ok(())
            }
            Ok(Some(realigned)) => self.adopt(&realigned),
            Ok(None) => Ok(()),
            Err(_) => {
                self.moved();
                Ok(())
            }
        }
    }

    /// The fixes since the attitude was lost.
    pub(super) fn realignment(&mut self) -> Option<&mut Realignment> {
        match &mut self.attitude {
            Attitude::Lost(realignment) | Attitude::Doubted { realignment, .. } => realignment.as_deref_mut(),
            Attitude::Known => None,
        }
    }

    /// Whether an attitude is about that of the filter.
    fn agrees(&self, world_from_body: &UnitQuaternion<f64>) -> bool {
        self.attitude().is_some_and(|attitude| attitude.angle_to(world_from_body) < 2.0 * KNOWN)
    }

    /// Continues from the state that fixes have determined.
    pub(super) fn adopt(&mut self, realigned: &Realigned) -> Result<(), Failure> {
        let estimate = Estimate {
            position: realigned.position,
            velocity: realigned.velocity,
            world_from_body: realigned.world_from_body,
            accelerometer_bias: realigned.accelerometer_bias,
            gyroscope_bias: realigned.gyroscope_bias,
            ..*self.filter.estimate().ok_or(Refusal::NotStarted)?
        };
        let before = self.filter.covariance();
        let covariance =
            SMatrix::<f64, NAVIGATED, NAVIGATED>::from_fn(|i, j| match (i < NAVIGATION, j < NAVIGATION) {
                (true, true) => realigned.covariance[(i, j)],
                (false, false) => before[(i, j)],
                _ => 0.0,
            });
        // If it cannot be used, the attitude remains lost.
        match self.filter.adopt::<Navigated, NAVIGATED>(&estimate, &covariance) {
            Ok(()) => self.know(Attitude::Known),
            Err(_) => {
                self.filter.hold_attitude(true);
                self.begin_realignment();
            }
        }
        Ok(())
    }

    /// Begins to doubt the attitude, which is new.
    pub(super) fn doubt(&mut self) {
        let since_ns = self.filter.estimate().map_or(i64::MAX, |estimate| estimate.time_ns);
        let realignment = match core::mem::replace(&mut self.attitude, Attitude::Known) {
            Attitude::Lost(realignment) | Attitude::Doubted { realignment, .. } => realignment,
            Attitude::Known => None,
        };
        self.know(Attitude::Doubted { since_ns, realignment });
    }

    /// Ends the doubt.
    pub(super) fn confirm(&mut self) {
        if matches!(self.attitude, Attitude::Doubted { .. }) {
            self.attitude = Attitude::Known;
        }
    }

    /// Whether an attitude has been in doubt for long enough, and nothing was refused.
    fn has_lasted(&self) -> bool {
        let now_ns = self.filter.estimate().map(|estimate| estimate.time_ns);
        matches!((&self.attitude, now_ns), (Attitude::Doubted { since_ns, .. }, Some(now_ns))
            if now_ns.saturating_sub(*since_ns) >= LASTING_NS)
    }

    /// Judges an attitude in doubt by a fix: it is lost if the fix had to be forced, and doubted for longer if the fix was refused.
    pub(super) fn weigh(&mut self, result: &Result<Fused, Refusal>) {
        match result {
            Ok(fused) if fused.raised > 1.0 => {
                if matches!(self.attitude, Attitude::Doubted { .. }) {
                    self.lose();
                }
            }
            Ok(_) if self.has_lasted() => self.confirm(),
            Err(Refusal::Gate { .. }) if matches!(self.attitude, Attitude::Doubted { .. }) => self.doubt(),
            Ok(_) | Err(_) => {}
        }
    }

    /// A gap, or a part of one, was bridged.
    pub(super) fn bridged(&mut self, dt: f64) {
        let (covariance, gap_rotation) = (self.filter.covariance(), self.filter.params().gap_rotation);
        let variance = (ROTATION..ROTATION + 3).map(|i| covariance[(i, i)]).fold(0.0, f64::max);
        let added = gap_rotation * gap_rotation * dt;
        // Earlier gaps count until the attitude is well known again.
        let earlier = if variance - added < WELL * WELL { 0.0 } else { self.by_gaps };
        self.by_gaps = earlier + added;
        // What is fused within a gap is corrected linearly too, and must not hide how long the gap is.
        let now_ns = self.filter.estimate().map_or(i64::MAX, |estimate| estimate.time_ns);
        let goes_on = (seconds_between(self.gap.0, now_ns).unwrap_or(f64::INFINITY) - dt).abs() < 1e-6;
        self.gap = (now_ns, added + if goes_on { self.gap.1 } else { 0.0 });
        // A heading that was never known is not lost in a short gap.
        let is_lost = (variance > LOST * LOST && self.by_gaps > 0.5 * LOST * LOST) || self.gap.1 > LOST * LOST;
        if self.is_lost() || is_lost {
            self.filter.forget_attitude();
            self.filter.hold_attitude(true);
            self.begin_realignment();
        } else {
            self.moved();
        }
    }

    /// The attitude is not what it was believed to be.
    pub(super) fn lose(&mut self) {
        let Some(attitude) = self.attitude() else { return };
        if self.filter.set_attitude(&attitude, &unknown()).is_ok() {
            self.filter.hold_attitude(true);
            match core::mem::replace(&mut self.attitude, Attitude::Known) {
                // The biases are not those that the filter has corrected with a wrong attitude.
                Attitude::Doubted { realignment: Some(realignment), .. } => {
                    self.attitude = Attitude::Lost(Some(realignment));
                }
                _ => self.begin_realignment(),
            }
        }
    }

    /// The fixes so far are of no use any more: time, place or motion since are others.
    pub(super) fn moved(&mut self) {
        match &mut self.attitude {
            Attitude::Lost(_) => self.begin_realignment(),
            Attitude::Doubted { realignment, .. } => *realignment = None,
            Attitude::Known => {}
        }
    }

    /// Forgets the fixes so far, and begins again.
    pub(super) fn begin_realignment(&mut self) {
        let begun = |estimate| Realignment::new(estimate, self.filter.covariance(), self.filter.params());
        let begun = self.filter.estimate().and_then(begun);
        match (&mut self.attitude, begun) {
            (Attitude::Lost(Some(realignment)), Some(begun)) => **realignment = begun,
            (attitude, begun) => *attitude = Attitude::Lost(begun.map(Box::new)),
        }
    }

    pub(super) fn know(&mut self, attitude: Attitude) {
        self.filter.hold_attitude(false);
        (self.attitude, self.by_gaps) = (attitude, 0.0);
    }

    /// Whether the attitude is too uncertain to be corrected.
    pub(in crate::navigation::state_estimator::strategy) fn is_lost(&self) -> bool {
        matches!(self.attitude, Attitude::Lost(_))
    }

    /// Whether the attitude is to be trusted.
    pub(in crate::navigation::state_estimator::strategy) fn is_attitude_known(&self) -> bool {
        matches!(self.attitude, Attitude::Known)
    }

    /// Whether the keyframe is from before the attitude was lost.
    pub(super) fn is_keyframe_known(&self) -> bool {
        let Some(first) = offset::<Navigated>(Optional::Keyframe) else { return false };
        let has_keyframe = self.filter.estimate().is_some_and(|estimate| estimate.keyframe.is_some());
        has_keyframe && is_known(&self.filter.covariance().fixed_view::<3, 3>(first + 3, first + 3).into_owned())
    }

    /// Takes an attitude of another source, if it is lost. Another one some seconds later ends the doubt in it, if they agree.
    pub(in crate::navigation::state_estimator::strategy) fn level(
        &mut self,
        world_from_body: &UnitQuaternion<f64>,
        covariance: &Matrix3<f64>,
    ) {
        if self.is_lost() && is_known(covariance) && self.filter.set_attitude(world_from_body, covariance).is_ok() {
            self.doubt();
        } else if self.has_lasted() && is_known(covariance) && self.agrees(world_from_body) {
            self.confirm();
        }
    }
}

/// Whether an attitude of this covariance can be corrected linearly.
pub(super) fn is_known(covariance: &Matrix3<f64>) -> bool {
    covariance.trace() < KNOWN * KNOWN
}

/// The covariance of an attitude of which nothing is known.
pub(super) fn unknown() -> Matrix3<f64> {
    Matrix3::identity() * (UNKNOWN * UNKNOWN)
}
