//! The motion of a simulated body: smooth, analytic, and the same for every sensor on it.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

/// The gravity of the simulated world, m/s².
pub const GRAVITY: f64 = 9.81;

/// The motion of a body's root link in a world east, north, up: it rests for [`REST_S`](Self::REST_S), then turns and
/// shakes, each angle and each coordinate a sum of two sines whose periods share no multiple.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion;

/// Amplitude and period in s.
type Sine = (f64, f64);

const ROLL: [Sine; 2] = [(0.6, 3.1), (0.2, 1.3)];
const PITCH: [Sine; 2] = [(0.5, 4.3), (0.15, 1.7)];
const YAW: [Sine; 2] = [(1.5, 11.0), (0.4, 2.9)];
const EAST: [Sine; 2] = [(0.4, 3.7), (0.05, 1.1)];
const NORTH: [Sine; 2] = [(0.3, 5.3), (0.05, 1.9)];
const UP: [Sine; 2] = [(0.2, 4.1), (0.03, 1.4)];

impl Motion {
    /// Time for which the body rests at first, s.
    pub const REST_S: f64 = 2.0;

    /// Half the step of the central second difference, s: its error is far below any sensor's noise.
    const STEP_S: f64 = 1e-3;

    /// The pose of the root link at `time_s`: `world_from_root`.
    pub fn world_from_root(self, time_s: f64) -> Isometry3<f64> {
        let moving = (time_s - Self::REST_S).max(0.0);
        // Goes from 0 to 1 within a second, with a continuous second derivative.
        let start = moving.min(1.0);
        let blend = start.powi(3) * (10.0 + start * (6.0 * start - 15.0));
        let at = |sines: [Sine; 2]| {
            blend
                * sines
                    .iter()
                    .map(|(size, period)| size * (std::f64::consts::TAU * moving / period).sin())
                    .sum::<f64>()
        };
        Isometry3::from_parts(
            Translation3::new(at(EAST), at(NORTH), at(UP)),
            UnitQuaternion::from_euler_angles(at(ROLL), at(PITCH), at(YAW)),
        )
    }

    /// Mean angular velocity of a frame fixed to the root from `from_s` to `to_s`, in that frame, rad/s.
    pub fn mean_angular_velocity(self, root_from_frame: &Isometry3<f64>, from_s: f64, to_s: f64) -> Vector3<f64> {
        let before = self.world_from_root(from_s).rotation * root_from_frame.rotation;
        let after = self.world_from_root(to_s).rotation * root_from_frame.rotation;
        (before.inverse() * after).scaled_axis() / (to_s - from_s)
    }

    /// Specific force at a frame fixed to the root, in that frame, m/s².
    pub fn specific_force(self, root_from_frame: &Isometry3<f64>, time_s: f64) -> Vector3<f64> {
        let at = |time_s: f64| self.world_from_root(time_s) * root_from_frame;
        let (before, now, after) = (at(time_s - Self::STEP_S), at(time_s), at(time_s + Self::STEP_S));
        let sum = before.translation.vector + after.translation.vector - 2.0 * now.translation.vector;
        let acceleration = sum / (Self::STEP_S * Self::STEP_S);
        now.rotation.inverse() * (acceleration + Vector3::new(0.0, 0.0, GRAVITY))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_rest_a_sensor_feels_gravity_alone() {
        let force = Motion.specific_force(&Isometry3::identity(), 1.0);
        assert!((force - Vector3::new(0.0, 0.0, GRAVITY)).norm() < 1e-9);
    }

    #[test]
    fn angular_velocity_integrates_to_the_orientation() {
        let mount = Isometry3::from_parts(
            Translation3::new(0.1, 0.2, 0.3),
            UnitQuaternion::from_euler_angles(0.3, -0.2, 1.0),
        );
        let mut orientation = Motion.world_from_root(0.0).rotation * mount.rotation;
        for step in 0..4000 {
            let (from, to) = (f64::from(step) * 5e-3, f64::from(step + 1) * 5e-3);
            let turned = Motion.mean_angular_velocity(&mount, from, to) * 5e-3;
            orientation *= UnitQuaternion::from_scaled_axis(turned);
        }
        let truth = Motion.world_from_root(20.0).rotation * mount.rotation;
        assert!(orientation.angle_to(&truth) < 1e-9);
    }

    #[test]
    fn a_lever_arm_is_felt() {
        let arm = Isometry3::translation(0.0, 0.0, 1.0);
        let difference = Motion.specific_force(&arm, 5.0) - Motion.specific_force(&Isometry3::identity(), 5.0);
        assert!(difference.norm() > 0.1);
    }
}
