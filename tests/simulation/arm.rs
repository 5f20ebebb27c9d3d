//! An arm with masses: what encoders, motors and IMUs on its links measure while it moves. `tests/simulation/check` compares
//! the same with MuJoCo.

use bb_core::kinematics::{Dynamics, Kinematics};
use bb_core::nalgebra::Vector3;
use bb_core::prelude::*;
use bb_estimators::simulation::{GRAVITY, SimulatedWorld};
use bb_estimators::{SimulatedActuator, SimulatedEncoder, SimulatedLinkImu};
use serde_json::json;

type Failure = Box<dyn std::error::Error>;

robot! {
    robot Arm;

    link base {
        joint pan: revolute {
            origin: { xyz: [0 m, 0 m, 20 cm], rpy: [0 deg, 5 deg, 0 deg] };
            axis: z;
            limit: { lower: -170 deg, upper: 170 deg, velocity: 3 rad/s, effort: 200 N*m };
            dynamics: { damping: 2 N*m*s/rad, friction: 0 N*m };
            actuator motor: SimulatedActuator(inertia = 0.3, acceleration = 6.0);
            sensor encoder: SimulatedEncoder() { rate: 100 Hz; }
            link shoulder {
                inertial: {
                    mass: 4 kg, origin: { xyz: [1 cm, -2 cm, 5 cm], rpy: [10 deg, 0 deg, 30 deg] },
                    inertia: { xx: 0.02 kg*m^2, yy: 0.03 kg*m^2, zz: 0.015 kg*m^2, xy: 0.001 kg*m^2, xz: 0 kg*m^2, yz: -0.002 kg*m^2 },
                };
                sensor imu: SimulatedLinkImu(
                    gyroscope_noise = 0.0, gyroscope_bias = 0 rad/s, accelerometer_noise = 0.0, accelerometer_bias = 0 m/s^2,
                ) { rate: 100 Hz; }
                joint lift: revolute {
                    origin: { xyz: [0 m, 10 cm, 12 cm], rpy: [0 deg, 90 deg, 0 deg] };
                    axis: y;
                    limit: { lower: -120 deg, upper: 120 deg, velocity: 3 rad/s, effort: 200 N*m };
                    dynamics: { damping: 1 N*m*s/rad, friction: 0 N*m };
                    actuator motor: SimulatedActuator(inertia = 0.2, acceleration = 5.0);
                    sensor encoder: SimulatedEncoder() { rate: 100 Hz; }
                    link upper {
                        inertial: {
                            mass: 3 kg, origin: { xyz: [0 m, 0 m, 20 cm], rpy: [0 deg, 0 deg, 0 deg] },
                            inertia: { xx: 0.04 kg*m^2, yy: 0.04 kg*m^2, zz: 0.01 kg*m^2, xy: 0 kg*m^2, xz: 0 kg*m^2, yz: 0 kg*m^2 },
                        };
                        joint elbow: revolute {
                            origin: { xyz: [0 m, -12 cm, 42 cm] };
                            axis: [0.1, 1, 0];
                            limit: { lower: -150 deg, upper: 150 deg, velocity: 4 rad/s, effort: 100 N*m };
                            dynamics: { damping: 0.5 N*m*s/rad, friction: 0 N*m };
                            actuator motor: SimulatedActuator(inertia = 0.1, acceleration = 8.0);
                            sensor encoder: SimulatedEncoder() { rate: 100 Hz; }
                            link lower {
                                inertial: {
                                    mass: 1.5 kg, origin: { xyz: [0 m, 1 cm, 15 cm], rpy: [0 deg, 20 deg, 0 deg] },
                                    inertia: { xx: 0.02 kg*m^2, yy: 0.02 kg*m^2, zz: 0.004 kg*m^2, xy: 0 kg*m^2, xz: 0 kg*m^2, yz: 0 kg*m^2 },
                                };
                                joint reach: prismatic {
                                    origin: { xyz: [0 m, 0 m, 35 cm], rpy: [15 deg, 0 deg, 0 deg] };
                                    axis: z;
                                    limit: { lower: 0 m, upper: 0.4 m, velocity: 1 m/s, effort: 100 N };
                                    dynamics: { damping: 3 N*s/m, friction: 0 N };
                                    actuator motor: SimulatedActuator(inertia = 0.5, acceleration = 3.0);
                                    sensor encoder: SimulatedEncoder() { rate: 100 Hz; }
                                    link tool {
                                        inertial: {
                                            mass: 0.8 kg, origin: { xyz: [2 cm, 0 m, 6 cm], rpy: [0 deg, 0 deg, 0 deg] },
                                            inertia: { xx: 0.002 kg*m^2, yy: 0.003 kg*m^2, zz: 0.001 kg*m^2, xy: 0 kg*m^2, xz: 0 kg*m^2, yz: 0 kg*m^2 },
                                        };
                                        sensor imu: SimulatedLinkImu(
                                            gyroscope_noise = 0.0, gyroscope_bias = 0 rad/s, accelerometer_noise = 0.0,
                                            accelerometer_bias = 0 m/s^2,
                                        ) { rate: 100 Hz; }
                                    }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

const JOINTS: [&str; 4] = ["pan", "lift", "elbow", "reach"];
const DAMPING: [f64; 4] = [2.0, 1.0, 0.5, 3.0];
const MOTORS: [f64; 4] = [0.3, 0.2, 0.1, 0.5];

/// Measurements at one time.
#[derive(Debug)]
struct Sample {
    position: [f64; 4],
    velocity: [f64; 4],
    /// The truth; nothing measures it.
    acceleration: [f64; 4],
    effort: [f64; 4],
    /// Specific force, then angular velocity, of the shoulder and of the tool.
    imus: [(Vector3<f64>, Vector3<f64>); 2],
}

/// The arm moves for two seconds, in every joint.
fn ride() -> Result<Vec<Sample>, Failure> {
    let mut simulation = Arm::builder().simulate()?;
    assert_eq!(simulation.arm(), Ok(()));
    // The world's steps begin with a command, and sensors are read in the middle of them: there, the acceleration of the
    // step goes with position and velocity, without a jump at its ends.
    simulation.run_until(MonotonicTime::from_nanos(500_000));
    let to = |position: f64| ActuatorCommand::from(PositionCommand { position, ..Default::default() });
    let pan = arm::actuator::base::pan::motor;
    let lift = arm::actuator::base::pan::shoulder::lift::motor;
    let elbow = arm::actuator::base::pan::shoulder::lift::upper::elbow::motor;
    let reach = arm::actuator::base::pan::shoulder::lift::upper::elbow::lower::reach::motor;
    simulation.actuate(pan, to(2.0))?;
    simulation.actuate(lift, to(-1.3))?;
    simulation.actuate(elbow, to(1.9))?;
    simulation.actuate(reach, to(0.35))?;
    let encoders = JOINTS.map(|joint| {
        let below =
            Arm::SENSORS.iter().find(|sensor| sensor.frame.name() == joint).map_or("", |sensor| sensor.path);
        simulation.bus().subscribe::<JointState>(below, Overflow::default())
    });
    let shoulder = simulation.subscribe(arm::sensor::base::pan::shoulder::imu);
    let tool = simulation.subscribe(arm::sensor::base::pan::shoulder::lift::upper::elbow::lower::reach::tool::imu);
    let world = simulation.shared(|| SimulatedWorld::new(Arm::TOPOLOGY));
    let mut samples = Vec::new();
    for step in 1..=200_u64 {
        let now = MonotonicTime::ZERO + Duration::from_millis(10 * step);
        simulation.run_until(now);
        let mut states = [JointState { position: 0.0, velocity: None, effort: None }; 4];
        for (state, encoder) in states.iter_mut().zip(&encoders) {
            let encoder = encoder.as_ref().map_err(ToString::to_string)?;
            *state = encoder.drain().last().ok_or("each encoder is read")?.payload;
        }
        let mut acceleration = [0.0; 4];
        for (acceleration, joint) in acceleration.iter_mut().zip(JOINTS) {
            *acceleration = world.joint(joint, now)?.point.acceleration;
        }
        let mut imus = [(Vector3::zeros(), Vector3::zeros()); 2];
        for (imu, readings) in imus.iter_mut().zip([&shoulder, &tool]) {
            let reading = readings.drain().last().ok_or("each IMU is read")?;
            *imu = (reading.linear_acceleration, reading.angular_velocity);
        }
        samples.push(Sample {
            position: states.map(|state| state.position),
            velocity: states.map(|state| state.velocity.unwrap_or(f64::NAN)),
            acceleration,
            effort: states.map(|state| state.effort.unwrap_or(f64::NAN)),
            imus,
        });
    }
    Ok(samples)
}

/// Motors give what gravity, the motion of all joints, damping and their own inertia take.
#[test]
fn motors_carry_and_accelerate_the_arm() -> Result<(), Failure> {
    let mut dynamics = Dynamics::new(Kinematics::new(Arm::TOPOLOGY)?);
    let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
    for sample in ride()? {
        dynamics.frames_mut().update_motion(&sample.position, &sample.velocity, &sample.acceleration)?;
        let mut efforts = vec![0.0; 4];
        dynamics.efforts(&Vector3::new(0.0, 0.0, -GRAVITY), &mut efforts)?;
        for joint in 0..4 {
            let own = MOTORS[joint] * sample.acceleration[joint] + DAMPING[joint] * sample.velocity[joint];
            let error = (efforts[joint] + own - sample.effort[joint]).abs();
            assert!(error.is_finite(), "joint {joint}: {sample:?}");
            worst = worst.max(error);
            largest = largest.max(sample.effort[joint].abs());
        }
    }
    println!("efforts up to {largest:.1} N·m, within {worst:.1e} of the equations of motion");
    assert!(largest > 20.0, "{largest}");
    // A step after an acceleration has jumped, the velocity in its middle is predicted by the one before: 12 rad/s² for half a
    // millisecond.
    assert!(worst < 3e-3, "{worst}");
    Ok(())
}

/// Writes the ride for `tests/simulation/beside_mujoco.py`.
#[test]
#[ignore = "tests/simulation/check runs it"]
fn a_ride_for_mujoco() -> Result<(), Failure> {
    let samples: Vec<_> = ride()?
        .iter()
        .map(|sample| {
            let imus =
                sample.imus.map(|(force, rate)| json!({ "force": force.as_slice(), "rate": rate.as_slice() }));
            json!({
                "position": sample.position, "velocity": sample.velocity, "acceleration": sample.acceleration,
                "effort": sample.effort, "imus": imus,
            })
        })
        .collect();
    let ride = json!({
        "urdf": Arm::to_urdf(), "joints": JOINTS, "damping": DAMPING, "motors": MOTORS, "links": ["shoulder", "tool"],
        "gravity": GRAVITY, "samples": samples,
    });
    std::fs::write(std::env::var("BB_MUJOCO_RIDE")?, ride.to_string())?;
    Ok(())
}
