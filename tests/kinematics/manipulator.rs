//! A mobile manipulator: a platform that drives, an arm on it, a camera at the arm's hand, a scanner on the platform, and one estimator
//! across all of it, beside what Pinocchio computes of the same ride (`manipulator.py`). More rides: `tests/kinematics/check`.

use bb_core::component::InputTransforms;
use bb_core::nalgebra::{Isometry3, Matrix3, Matrix4};
use bb_core::prelude::*;
use bb_core::{JointPositions, JointReading};
use serde_json::Value;
use std::error::Error;
use std::sync::Arc;

type Failure = Box<dyn Error>;

/// Position of the platform by its wheels: x, y, m; heading, rad.
#[derive(Clone, Debug, PartialEq, Payload)]
#[payload(joint_position)]
struct Driven([f64; 3]);

impl JointPositions for Driven {
    fn tell(&self, listener: &mut dyn FnMut(JointReading<'_>)) {
        listener(JointReading::at(&self.0));
    }
}

/// Detection of a camera or a lidar.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
struct Flash;

/// Poses of both, in the frame of the map.
#[derive(Clone, Debug, PartialEq, Payload)]
struct View {
    camera: Isometry3<f64>,
    lidar: Isometry3<f64>,
    scan: MonotonicTime,
}

#[derive(Clone, Copy, Debug, Inputs)]
struct Eyes<'a> {
    #[allow(dead_code, reason = "it is placed, and not looked at")]
    camera: Input<'a, Flash>,
    lidar: Input<'a, Flash>,
}

#[derive(Debug, Default)]
struct Viewer {
    camera: Isometry3<f64>,
    lidar: Isometry3<f64>,
}

impl Estimator for Viewer {
    type Options = NoOptions;
    type Input = Eyes<'static>;
    type Output = View;
    const HANDLES_MOVING_JOINTS: bool = true;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self::default())
    }

    fn handle_transforms(&mut self, transforms: &InputTransforms<'_>) -> Result<(), Fault> {
        self.camera = transforms.frame_from_driver()?;
        self.lidar = transforms.frame_from_input("lidar")?;
        Ok(())
    }

    fn handle_input(&mut self, eyes: Eyes<'_>) -> Result<Reply<View>, Fault> {
        Ok(Reply::emit(View { camera: self.camera, lidar: self.lidar, scan: eyes.lidar.monotonic_time }))
    }
}

robot! {
    robot Butler;

    sensors { sensor arm: External<JointStates>(); }

    link map {
        estimator view: Viewer() {
            input camera: sensor::map::drive::platform::lift::column::shoulder::upper::elbow::lower::wrist::hand::eye::camera_link::camera, driver;
            input lidar: sensor::map::drive::platform::scanner::lidar_link::lidar;
            sync_tolerance: 30 ms;
        }
        joint drive: planar {
            origin: { xyz: [0.5 m, -0.2 m, 0 m], rpy: [0 deg, 0 deg, 30 deg] };
            axis: z;
            sensor odometry: External<Driven>();
            link platform {
                joint scanner: fixed {
                    origin: { xyz: [0.3 m, 0 m, 0.2 m], rpy: [180 deg, 0 deg, 0 deg] };
                    link lidar_link { sensor lidar: External<Flash>(); }
                }
                joint lift: prismatic {
                    origin: { xyz: [-0.1 m, 0 m, 0.4 m] };
                    axis: z;
                    limit: { lower: 0 m, upper: 0.5 m, velocity: 1 m/s, effort: 100 N };
                    link column {
                        joint shoulder: continuous {
                            origin: { xyz: [0 m, 0 m, 0.1 m] };
                            axis: z;
                            link upper {
                                joint elbow: revolute {
                                    origin: { xyz: [0.4 m, 0 m, 0 m], rpy: [90 deg, 0 deg, 0 deg] };
                                    axis: [0, 3, 4];
                                    limit: { lower: -2 rad, upper: 2 rad, velocity: 4 rad/s, effort: 20 N*m };
                                    link lower {
                                        joint wrist: revolute {
                                            origin: { xyz: [0.35 m, 0 m, 0.02 m], rpy: [0 deg, -40 deg, 0 deg] };
                                            axis: x;
                                            limit: { lower: -2 rad, upper: 2 rad, velocity: 4 rad/s, effort: 20 N*m };
                                            mimic: { joint: elbow, multiplier: -0.5, offset: 10 deg };
                                            link hand {
                                                joint eye: fixed {
                                                    origin: { xyz: [5 cm, 1 cm, 3 cm], rpy: [-90 deg, 0 deg, -90 deg] };
                                                    link camera_link { sensor camera: External<Flash>(); }
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
        }
    }
}

fn numbers(value: &Value) -> Result<Vec<f64>, Failure> {
    let all = value.as_array().ok_or_else(|| format!("no list: {value}"))?;
    all.iter().map(|number| number.as_f64().ok_or_else(|| format!("no number: {number}").into())).collect()
}

fn time(value: &Value) -> Result<MonotonicTime, Failure> {
    Ok(MonotonicTime::from_nanos(value.as_i64().ok_or_else(|| format!("no time: {value}"))?))
}

fn list<'a>(ride: &'a Value, name: &str) -> Result<&'a Vec<Value>, Failure> {
    ride[name].as_array().ok_or_else(|| format!("no {name}").into())
}

/// Translation, then the rotation row by row.
fn transform(value: &Value) -> Result<Matrix4<f64>, Failure> {
    let values = numbers(value)?;
    let (translation, rotation) = values.split_at_checked(3).ok_or("not twelve numbers")?;
    let mut transform = Matrix3::from_row_slice(rotation).to_homogeneous();
    transform.fixed_view_mut::<3, 1>(0, 3).copy_from_slice(translation);
    Ok(transform)
}

/// Message of a sensor, in the order of arrival.
enum Message {
    Odometry(Driven),
    Arm(JointStates),
    Lidar,
    Camera,
}

fn ride(ride: &Value) -> Result<(), Failure> {
    let mut messages = Vec::new();
    for state in list(ride, "odometry")? {
        let values = numbers(state)?;
        let driven = Driven([values[1], values[2], values[3]]);
        messages.push((time(&state[0])?, time(&state[0])?, Message::Odometry(driven)));
    }
    let names: Arc<[String]> = ["lift", "shoulder", "elbow"].map(str::to_owned).into();
    for state in list(ride, "arm")? {
        let positions = numbers(state)?.split_off(1);
        let states = JointStates { names: Arc::clone(&names), positions, ..JointStates::default() };
        messages.push((time(&state[0])?, time(&state[0])?, Message::Arm(states)));
    }
    // Pictures and scans take a while, so that the states of all joints are there.
    let delay = Duration::from_millis(20);
    for scan in list(ride, "lidar")? {
        messages.push((time(scan)? + delay, time(scan)?, Message::Lidar));
    }
    let expected = list(ride, "views")?;
    for view in expected {
        messages.push((time(&view["time"])? + delay, time(&view["time"])?, Message::Camera));
    }
    messages.sort_by_key(|(arrives, ..)| *arrives);

    let builder = Butler::builder();
    let views = builder.subscribe(butler::estimator::map::view);
    let mut simulation = builder.simulate()?;
    let camera = butler::sensor::map::drive::platform::lift::column::shoulder::upper::elbow::lower::wrist::hand::eye::camera_link::camera;
    let live = simulation.live();
    for (arrives, stamp, message) in messages {
        simulation.run_until(arrives);
        match message {
            Message::Odometry(driven) => live.publish(butler::sensor::map::drive::odometry, stamp, driven),
            Message::Arm(states) => live.publish(butler::sensor::arm, stamp, states),
            Message::Lidar => {
                live.publish(butler::sensor::map::drive::platform::scanner::lidar_link::lidar, stamp, Flash)
            }
            Message::Camera => live.publish(camera, stamp, Flash),
        }
    }
    let views: Vec<_> = views.drain().collect();
    assert_eq!(views.len(), expected.len());
    let mut farthest = 0.0_f64;
    for (view, expected) in views.iter().zip(expected) {
        assert_eq!((view.monotonic_time, view.scan), (time(&expected["time"])?, time(&expected["scan"])?));
        for (is, name) in [(&view.camera, "camera"), (&view.lidar, "lidar")] {
            let expected = transform(&expected[name])?;
            let error = (is.to_homogeneous() - expected).abs().max();
            farthest = farthest.max(error);
            assert!(
                error < 1e-12,
                "{name} at {}: {is} where Pinocchio has {expected}, {error}",
                view.monotonic_time
            );
        }
    }
    println!("a mobile manipulator, {} views: within {farthest:.1e}", views.len());
    // What a look-up of the past says is what the estimator was told.
    let joints = simulation.joints();
    let last = views.last().ok_or("there are views")?;
    assert_eq!(joints.transform("map", "camera_link", last.monotonic_time)?, last.camera);
    assert!(simulation.report().joints.iter().all(|joint| joint.is_declared), "{}", simulation.report());
    Ok(())
}

#[test]
fn one_estimator_spans_a_platform_and_its_arm() -> Result<(), Failure> {
    ride(&serde_json::from_str(include_str!("manipulator.json"))?)
}

#[test]
#[ignore = "tests/kinematics/check runs it"]
fn a_new_ride() -> Result<(), Failure> {
    let file = std::env::var("BB_MANIPULATOR_REFERENCE")?;
    ride(&serde_json::from_str(&std::fs::read_to_string(file)?)?)
}
