//! A simulated IMU on a moving link.

use crate::kit::*;
use bb_core::kinematics::Kinematics;
use bb_core::nalgebra::{Isometry3, Vector3};
use bb_estimators::simulation::{GRAVITY, SimulatedWorld};
use bb_estimators::{SimulatedActuator, SimulatedEncoder, SimulatedLinkImu};

robot! {
    pub(crate) robot Swing;
    link base {
        joint turn: continuous {
            origin: { xyz: [0.1 m, 0 m, 0.2 m], rpy: [10 deg, 20 deg, 30 deg] };
            axis: z;
            limit: { velocity: 2 rad/s, effort: 20 N*m };
            actuator motor: SimulatedActuator(acceleration = 5.0);
            sensor encoder: SimulatedEncoder() { rate: 100 Hz; }
            link arm {
                joint slide: prismatic {
                    origin: { xyz: [0.3 m, 0 m, 0 m] };
                    axis: [1, 0, 1];
                    limit: { lower: -1 m, upper: 1 m, velocity: 1 m/s, effort: 20 N };
                    actuator motor: SimulatedActuator(acceleration = 3.0);
                    sensor encoder: SimulatedEncoder() { rate: 100 Hz; }
                    link carriage {
                        sensor imu: SimulatedLinkImu(
                            gyroscope_noise = 0.0, gyroscope_bias = 0 rad/s, accelerometer_noise = 0.0,
                            accelerometer_bias = 0 m/s^2,
                        ) { rate: 1 kHz; }
                    }
                }
            }
        }
    }
}

/// An IMU on a moving link reads what follows from the link's motion: second differences of its position, and the turning of its axes. This
/// uses the kinematics of positions alone, not those of velocities and accelerations that the sensor uses. Joints accelerate evenly within
/// a millisecond of the world, so the three poses are taken within one.
#[test]
fn an_imu_on_a_moving_link_measures_how_that_moves() -> Result<(), Failure> {
    let mut simulation = armed_simulation(Swing::builder());
    // The world's steps begin with a command; the sensor is read in the middle of them.
    simulation.run_until(MonotonicTime::from_nanos(500_000));
    simulation.actuate(swing::actuator::base::turn::motor, move_at(1.5))?;
    simulation.actuate(swing::actuator::base::turn::arm::slide::motor, move_to(0.8))?;
    let readings = simulation.subscribe(swing::sensor::base::turn::arm::slide::carriage::imu);
    let kinematics = Kinematics::new(Swing::TOPOLOGY)?;
    let (base, carriage) = (kinematics.link("base").ok_or("a link")?, kinematics.link("carriage").ok_or("a link")?);
    let chain = kinematics.chain(base, carriage)?;
    let world = simulation.shared(|| SimulatedWorld::new(Swing::TOPOLOGY));
    let (mut worst_force, mut worst_rate, mut fastest) = (0.0_f64, 0.0_f64, 0.0_f64);
    for millis in 1..1200_i64 {
        let mut pose_at = |micros: i64| -> Result<Isometry3<f64>, Failure> {
            let time = MonotonicTime::from_nanos((millis * 1000 + micros) * 1000);
            simulation.run_until(time);
            let (turn, slide) = (world.joint("turn", time)?.point, world.joint("slide", time)?.point);
            Ok(chain.transform(&[turn.position, slide.position])?)
        };
        let (before, now, after) = (pose_at(-100)?, pose_at(0)?, pose_at(100)?);
        let reading = readings.drain().last().ok_or("it is read each millisecond")?;
        assert_eq!(reading.monotonic_time, at(millis));
        let sum = before.translation.vector + after.translation.vector - 2.0 * now.translation.vector;
        let force = now.rotation.inverse() * (sum / 1e-8 + Vector3::new(0.0, 0.0, GRAVITY));
        let rate = (before.rotation.inverse() * after.rotation).scaled_axis() / 2e-4;
        let (force_error, rate_error) =
            ((reading.linear_acceleration - force).norm(), (reading.angular_velocity - rate).norm());
        assert!(force_error.is_finite() && rate_error.is_finite(), "at {millis} ms: {reading:?}");
        (worst_force, worst_rate) = (worst_force.max(force_error), worst_rate.max(rate_error));
        fastest = fastest.max(reading.angular_velocity.norm());
    }
    assert!(fastest > 1.4, "{fastest}");
    // Rounding of a position, 1e-16 m, over the square of 0.1 ms; and its fourth derivative.
    assert!(worst_force < 1e-6, "{worst_force}");
    assert!(worst_rate < 1e-6, "{worst_rate}");
    Ok(())
}
