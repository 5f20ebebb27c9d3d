//! Transforms between any two frames at any time.

use super::error::LookupError;
use super::route::{Latest, Place, Route, place_of};
use super::store::Joints;
use bb_message::__private::{nanos_of, nearest};
use bb_message::time::MonotonicTime;
use nalgebra::Isometry3;
use std::time::Duration;

/// A prepared transform from one frame to another: fixed joints are multiplied out.
#[derive(Clone, Debug)]
pub struct TransformHandle {
    joints: Joints,
    route: Route,
}

impl Joints {
    /// Prepares the transforms that take points from the frame `source` to the frame `target`. Each is the name of a link or joint,
    /// or the path of a sensor, estimator or actuator, which denotes its frame.
    ///
    /// # Errors
    /// [`LookupError::UnknownFrame`] if the robot has no frame of that name; it contains the nearest existing name.
    pub fn between(&self, target: &str, source: &str) -> Result<TransformHandle, LookupError> {
        let find = |name: &str| self.place(name).ok_or_else(|| self.unknown_frame(name));
        let (target, source) = (find(target)?, find(source)?);
        let route = Route::new(self.topology(), self.kinematics(), &target, &source);
        let route = route.ok_or_else(|| self.unknown_frame(""))?;
        Ok(TransformHandle { joints: self.clone(), route })
    }

    /// `target_from_source` at a time: [`Self::between`] and [`TransformHandle::at`] in one call, for infrequent lookups.
    ///
    /// # Errors
    /// As for [`Self::between`] and [`TransformHandle::at`].
    pub fn transform(
        &self,
        target: &str,
        source: &str,
        time: MonotonicTime,
    ) -> Result<Isometry3<f64>, LookupError> {
        self.between(target, source)?.at(time)
    }

    fn place(&self, name: &str) -> Option<Place> {
        let frame = self.component(name);
        place_of(self.topology(), frame.map_or(name, |frame| frame.name()))
    }

    fn unknown_frame(&self, name: &str) -> LookupError {
        let mut frames: Vec<&str> = self.topology().links.iter().map(|link| link.name).collect();
        frames.extend(self.topology().joints.iter().map(|joint| joint.name));
        frames.extend(self.components());
        LookupError::UnknownFrame { name: name.to_owned(), nearest: nearest(name, frames).map(str::to_owned) }
    }
}

impl TransformHandle {
    /// `target_from_source` at a time up to the newest state, interpolated between the states of the joints.
    ///
    /// # Errors
    /// A joint between the frames is unknown, its history begins later, or its newest state is older.
    pub fn at(&self, time: MonotonicTime) -> Result<Isometry3<f64>, LookupError> {
        self.within(time, 0)
    }

    /// Returns the transform as [`Self::at`] does, but predicted where the newest state of a joint is older by no more than `tolerance`.
    ///
    /// # Errors
    /// As for [`Self::at`].
    pub fn at_within(&self, time: MonotonicTime, tolerance: Duration) -> Result<Isometry3<f64>, LookupError> {
        self.within(time, nanos_of(tolerance))
    }

    #[inline]
    fn within(&self, time: MonotonicTime, tolerance_nanos: i64) -> Result<Isometry3<f64>, LookupError> {
        self.route.at(self.joints.states(), time, tolerance_nanos).map_err(|gap| self.joints.error(gap))
    }

    /// `target_from_source` at the newest time for which all joints between the frames are known.
    ///
    /// # Errors
    /// A joint between the frames is unknown, or its history begins after the newest state of another.
    pub fn latest(&self) -> Result<Latest, LookupError> {
        let found = self.route.latest(self.joints.states());
        found.map_err(|gap| self.joints.error(gap))
    }

    /// Returns the transform as [`Self::at`] does, after waiting at most `timeout` for joints whose state at that time has not arrived
    /// yet. This blocks the thread, so commands, which share theirs, should use [`Self::at`] and sleep between attempts. On virtual
    /// time no state arrives in the meantime, so this does not wait.
    ///
    /// # Errors
    /// As for [`Self::at`].
    pub fn wait_until(&self, time: MonotonicTime, timeout: Duration) -> Result<Isometry3<f64>, LookupError> {
        let timeout = if self.joints.clock().is_virtual() { Duration::ZERO } else { timeout };
        let found = self.route.waited_for(self.joints.states(), time, timeout);
        found.map_err(|gap| self.joints.error(gap))
    }

    /// The number of moving joints between the frames.
    pub fn moving_joints(&self) -> usize {
        self.route.moving_joints()
    }
}
