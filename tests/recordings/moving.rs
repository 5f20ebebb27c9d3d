//! Viewers see a robot move as the robot itself knows it: `/tf` and `/tf_static` lead to the same transforms.

use super::robot::Temporary;
use bb_core::message::codec::ros::TransformsMessage;
use bb_core::nalgebra::Isometry3;
use bb_core::payload::{EndMotion, MotionEnd};
use bb_core::prelude::*;
use bb_core::{JointPositions, JointReading};
use bb_estimators::{SimulatedActuator, SimulatedEncoder};
use bb_mcap::{Bag, Recorder, RecorderOptions, Recording};
use std::collections::HashMap;

/// Position that a platform has driven to: x, y, m; heading, rad.
#[derive(Clone, Debug, PartialEq, Payload)]
#[payload(joint_position)]
struct Driven([f64; 3]);

impl JointPositions for Driven {
    fn tell(&self, listener: &mut dyn FnMut(JointReading<'_>)) {
        listener(JointReading::at(&self.0));
    }
}

robot! {
    robot Mover;

    sensors { sensor fingers: External<JointStates>(); }

    link world_link {
        joint drive: planar {
            axis: [0, 1, 1];
            sensor odometry: External<Driven>();
            link platform {
                joint mount: fixed { origin: { xyz: [0.1 m, 0 m, 0.3 m], rpy: [0 deg, 20 deg, 0 deg] };
                    link tower {
                        joint turn: continuous {
                            axis: [1, 2, 3];
                            transmission: { reduction: 30, offset: -20 deg, reversed: true };
                            sensor motor: External<MotorState>();
                            link gripper {
                                joint left: prismatic {
                                    axis: y;
                                    limit: { lower: 0 m, upper: 0.1 m, velocity: 1 m/s, effort: 1 N };
                                    link left_finger;
                                }
                                joint right: prismatic {
                                    axis: y;
                                    limit: { lower: -0.1 m, upper: 0 m, velocity: 1 m/s, effort: 1 N };
                                    mimic: { joint: left, multiplier: -1, offset: 2 mm };
                                    link right_finger {
                                        joint claw: revolute {
                                            axis: x;
                                            limit: { lower: -1 rad, upper: 1 rad, velocity: 1 rad/s, effort: 1 N*m };
                                            link tip;
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

#[test]
fn viewers_see_the_robot_where_it_knows_itself() -> Result<(), Box<dyn std::error::Error>> {
    let file = Temporary::new("moving");
    let builder = Mover::builder();
    let all = builder.subscribe_any(Select::All, None, Overflow::default());
    let recorder = Recorder::new(&file, all, RecorderOptions::of::<Mover>())?;
    let mut simulation = builder.simulate()?;
    let time = MonotonicTime::from_nanos(1_000_000);
    let drive = mover::sensor::world_link::drive::odometry;
    simulation.publish(drive, time, Driven([1.0, -2.0, 0.7]));
    let turn = mover::sensor::world_link::drive::platform::mount::tower::turn::motor;
    simulation.publish(turn, time, MotorState { position: 45.0, velocity: None, effort: None });
    let fingers = JointStates {
        // By path, and by name.
        names: vec!["world_link/drive/platform/mount/tower/turn/gripper/left".to_owned(), "claw".to_owned()].into(),
        positions: vec![0.03, -0.4],
        ..JointStates::default()
    };
    simulation.publish(mover::sensor::fingers, time, fingers);
    // Nothing moves by what is not a number.
    simulation.publish(drive, time, Driven([f64::NAN; 3]));
    let joints = simulation.joints();
    simulation.stop();
    recorder.finish()?;

    // The last transform of each frame, as a viewer keeps it.
    let bag = Bag::open(&file)?;
    let mut parents: HashMap<String, (String, Isometry3<f64>)> = HashMap::new();
    for topic in ["/tf_static", "/tf"] {
        for message in bag.messages(&[topic])? {
            let TransformsMessage { transforms } = message?.decode()?;
            for transform in transforms {
                parents.insert(transform.child_frame_id, (transform.header.frame_id, transform.transform));
            }
        }
    }
    for link in Mover::TOPOLOGY.links {
        let (mut frame, mut root_from_link) = (link.name.to_owned(), Isometry3::identity());
        while let Some((parent, parent_from_frame)) = parents.get(&frame) {
            root_from_link = parent_from_frame * root_from_link;
            frame.clone_from(parent);
        }
        assert_eq!(frame, "world_link", "{} is connected", link.name);
        let known = joints.between("world_link", link.name)?.latest()?.transform;
        let error = (known.to_homogeneous() - root_from_link.to_homogeneous()).abs().max();
        assert!(error < 1e-12, "{}: {root_from_link} where it is {known}", link.name);
    }
    assert!(
        joints.between("world_link", "tip")?.latest()?.transform.translation.vector.norm() > 1.0,
        "it has moved"
    );
    Ok(())
}

robot! {
    robot Lifter;
    commands { arm: Arm; }
    link base {
        joint turn: revolute {
            axis: z;
            limit: { lower: -90 deg, upper: 90 deg, velocity: 2 rad/s, effort: 10 N*m };
            actuator motor: SimulatedActuator(acceleration = 10.0);
            sensor encoder: SimulatedEncoder() { rate: 100 Hz; }
            link hand;
        }
    }
}

#[test]
fn a_recorder_of_the_builder_has_the_commands_and_reports_of_an_arm() -> Result<(), Box<dyn std::error::Error>> {
    let file = Temporary::new("arm");
    let builder = Lifter::builder();
    let all = builder.subscribe_any(Select::All, None, Overflow::DropOldest { capacity: 10_000 });
    let recorder = Recorder::new(&file, all, RecorderOptions::of::<Lifter>())?;
    let mut simulation = builder.simulate()?;
    simulation.command(lifter::command::arm, NoArguments)?;
    simulation.run_for(Duration::ZERO);
    let there = PositionCommand { position: 0.5, ..Default::default() };
    simulation.actuate(lifter::actuator::base::turn::motor, there.into())?;
    simulation.run_for(Duration::from_secs(2));
    simulation.stop();
    recorder.finish()?;

    let recording = Recording::open(&file)?;
    let count = |path: &str| {
        recording.channels().iter().find(|channel| channel.path == path).map(|channel| channel.messages)
    };
    assert_eq!(count("actuator/base/turn/motor"), Some(1));
    assert_eq!(count("actuator/base/turn/motor/begin_motion"), Some(1));
    assert_eq!(count("actuator/base/turn/motor/end_motion"), Some(1));
    assert_eq!(count("command/arm"), Some(2));
    let end =
        recording.messages::<EndMotion>("actuator/base/turn/motor/end_motion")?.next().ok_or("it ended")??;
    assert_eq!((end.frame.name(), &end.end), ("turn", &MotionEnd::Reached));
    Ok(())
}
