//! The motion of a robot's root link in the simulated world.

use bb_core::MonotonicTime;
use bb_core::kinematics::LinkMotion;
use nalgebra::{Isometry3, Vector3};
use std::sync::Arc;

/// The pose of the root link, `world_from_root`, for seconds since its motion began.
pub(super) type Course = dyn Fn(f64) -> Isometry3<f64> + Send + Sync;

/// The pose of the root link as a function of time; by default it rests at the origin of the world.
#[derive(Clone, Default)]
pub(super) struct RootMotion(Option<(MonotonicTime, Arc<Course>)>);

/// The distance of the samples for the derivatives, s. The error of the differences below is 1e-9 m/s² for motions with
/// derivatives near 1 in SI units, half of it rounding.
const STEP_S: f64 = 5e-3;

impl RootMotion {
    pub(super) fn new(start: MonotonicTime, course: Arc<Course>) -> Self {
        Self(Some((start, course)))
    }

    pub(super) fn is_at_rest(&self) -> bool {
        self.0.is_none()
    }

    /// `world_from_root` at a time.
    pub(super) fn pose(&self, time: MonotonicTime) -> Isometry3<f64> {
        self.0.as_ref().map_or_else(Isometry3::identity, |(start, course)| course(time.seconds_since(*start)))
    }

    /// The motion of the root in the world, in the axes of the root, by central differences of fourth order.
    pub(super) fn motion(&self, time: MonotonicTime) -> LinkMotion {
        let Some((start, course)) = &self.0 else { return LinkMotion::REST };
        let time_s = time.seconds_since(*start);
        let root_from_world = course(time_s).inverse();
        // Pose by pose, position and rotation vector relative to the present one, in its axes. The derivatives of the rotation
        // vector at zero are the angular velocity and acceleration.
        let seen = [-2.0, -1.0, 1.0, 2.0].map(|steps| {
            let relative = root_from_world * course(time_s + steps * STEP_S);
            (relative.translation.vector, relative.rotation.scaled_axis())
        });
        let derivatives = |[far_before, before, after, far_after]: [Vector3<f64>; 4]| {
            let first = (far_before - far_after + (after - before) * 8.0) / (12.0 * STEP_S);
            let second = ((before + after) * 16.0 - far_before - far_after) / (12.0 * STEP_S * STEP_S);
            (first, second)
        };
        let (velocity, acceleration) = derivatives(seen.map(|(position, _)| position));
        let (angular_velocity, angular_acceleration) = derivatives(seen.map(|(_, rotation)| rotation));
        LinkMotion { velocity, angular_velocity, acceleration, angular_acceleration }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;

    #[test]
    fn derivatives_are_those_of_a_turn_on_a_circle() {
        let (radius, rate) = (3.0, 0.7);
        let course = move |time_s: f64| {
            let angle: f64 = rate * time_s * time_s;
            let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
            Isometry3::from_parts((turn * Vector3::new(radius, 0.0, 1.0)).into(), turn)
        };
        let root = RootMotion::new(MonotonicTime::from_nanos(5_000), Arc::new(course));
        let motion = root.motion(MonotonicTime::from_nanos(5_000 + 2_000_000_000));
        // The angle is 0.7 t²: at 2 s, 2.8 rad/s and 1.4 rad/s².
        let (omega, alpha) = (4.0 * rate, 2.0 * rate);
        let close = |is: Vector3<f64>, x: f64, y: f64, z: f64| {
            assert!((is - Vector3::new(x, y, z)).norm() < 1e-6, "{is} is not {x}, {y}, {z}");
        };
        close(motion.velocity, 0.0, radius * omega, 0.0);
        close(motion.angular_velocity, 0.0, 0.0, omega);
        close(motion.acceleration, -radius * omega * omega, radius * alpha, 0.0);
        close(motion.angular_acceleration, 0.0, 0.0, alpha);
    }
}
