//! States of joints, and the transforms across them.

use crate::joint_history::Keeper;
use crate::kit::*;
use bb_core::component::{InputTransforms, JointPublisher};
use bb_core::joints::{JointRefusal, LookupError};
use bb_core::nalgebra::{Isometry3, UnitQuaternion, Vector3};
use std::f64::consts::FRAC_PI_2;

/// Measurement of a camera.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
pub(crate) struct Pixel(pub(crate) f64);

/// Position of an input, m, and its x axis.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
pub(crate) struct Spot {
    pub(crate) at: Vector3<f64>,
    pub(crate) x: Vector3<f64>,
}

/// Publishes the position of its input.
#[derive(Default)]
pub(crate) struct Spotter {
    frame_from_camera: Isometry3<f64>,
}

impl Estimator for Spotter {
    type Options = NoOptions;
    type Input = Pixel;
    type Output = Spot;
    const HANDLES_MOVING_JOINTS: bool = true;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self::default())
    }

    fn handle_transforms(&mut self, transforms: &InputTransforms<'_>) -> Result<(), Fault> {
        self.frame_from_camera = transforms.frame_from_driver()?;
        Ok(())
    }

    fn handle_input(&mut self, _: &Stamped<Pixel>) -> Result<Reply<Spot>, Fault> {
        let Isometry3 { translation, rotation } = self.frame_from_camera;
        Ok(Reply::emit(Spot { at: translation.vector, x: rotation * Vector3::x() }))
    }
}

/// Inputs from the base, from the tip, and from a joint.
#[derive(Clone, Copy, Debug, Inputs)]
pub(crate) struct Views<'a> {
    pub(crate) imu: Input<'a, Pixel>,
    #[allow(dead_code, reason = "it is placed, and not looked at")]
    pub(crate) camera: Option<Input<'a, Pixel>>,
    pub(crate) lift: Option<Input<'a, JointState>>,
}

/// Inputs that [`Fusion`] received.
#[derive(Clone, Debug, PartialEq, Payload)]
pub(crate) struct Received {
    /// Position of the camera, or the reason for which it is not known.
    pub(crate) camera: String,
    pub(crate) lift: Option<f64>,
}

#[derive(Default)]
pub(crate) struct Fusion {
    camera: String,
}

impl Estimator for Fusion {
    type Options = NoOptions;
    type Input = Views<'static>;
    type Output = Received;
    const HANDLES_MOVING_JOINTS: bool = true;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self::default())
    }

    fn handle_transforms(&mut self, transforms: &InputTransforms<'_>) -> Result<(), Fault> {
        assert_eq!(transforms.frame_from_input("imu")?, Isometry3::identity());
        assert_refused(transforms.frame_from_input("lift"), "the input `lift` depends on no frame");
        self.camera = match transforms.frame_from_input("camera") {
            Ok(camera) => format!("{:.3}", camera.translation.vector.x),
            Err(fault) => fault.to_string(),
        };
        Ok(())
    }

    fn handle_input(&mut self, views: Views<'_>) -> Result<Reply<Received>, Fault> {
        assert!(views.imu.0 >= 0.0);
        Ok(Reply::emit(Received { camera: self.camera.clone(), lift: views.lift.map(|lift| lift.position) }))
    }
}

stateless! {
    /// Passes on the position of a joint across another that moves, although it handles fixed transforms only.
    Watch: JointState => Pixel, |joint: &Stamped<JointState>| Ok(Reply::emit(Pixel(joint.position)));
}

robot! {
    pub(crate) robot Reach;

    sensors { sensor bus: External<JointStates>(); }
    bridges { bridge joint_states: JointPublisher() { rate: 100 Hz; } }

    link base {
        sensor imu: External<Pixel>();
        estimator spot: Spotter() { input camera: sensor::base::shoulder::arm::lift::carriage::camera; recover_after: 2; }
        estimator fusion: Fusion() {
            input imu: sensor::base::imu, driver;
            input camera: sensor::base::shoulder::arm::lift::carriage::camera, optional;
            input lift: sensor::base::shoulder::arm::lift::encoder, optional;
            sync_tolerance: 20 ms;
        }
        estimator keeper: Keeper() {
            input imu: sensor::base::imu, driver;
            input camera: sensor::base::shoulder::arm::lift::carriage::camera;
        }
        estimator watch: Watch() { input lift: sensor::base::shoulder::arm::lift::encoder; }
        joint shoulder: continuous {
            axis: z;
            transmission: { reduction: 50, offset: 90 deg, reversed: true };
            sensor encoder: External<JointState>();
            sensor motor: External<MotorState>();
            link arm {
                joint lift: prismatic {
                    axis: x;
                    limit: { lower: 0 m, upper: 2 m, velocity: 1 m/s, effort: 10 N };
                    sensor encoder: External<JointState>();
                    link carriage { sensor camera: External<Pixel>(); }
                }
                joint counter: prismatic {
                    axis: x;
                    limit: { lower: -2 m, upper: 2 m, velocity: 1 m/s, effort: 10 N };
                    mimic: { joint: lift, multiplier: -0.5, offset: 10 cm };
                    link weight;
                }
                joint plate: fixed { origin: { xyz: [0 m, 0 m, 1 m] }; link top; }
            }
        }
    }
}

pub(crate) const SHOULDER: SensorHandle<Reach, External<JointState>> = reach::sensor::base::shoulder::encoder;
const MOTOR: SensorHandle<Reach, External<MotorState>> = reach::sensor::base::shoulder::motor;
pub(crate) const LIFT: SensorHandle<Reach, External<JointState>> =
    reach::sensor::base::shoulder::arm::lift::encoder;
pub(crate) const CAMERA: SensorHandle<Reach, External<Pixel>> =
    reach::sensor::base::shoulder::arm::lift::carriage::camera;

fn moving(position: f64, velocity: f64) -> JointState {
    JointState { velocity: Some(velocity), ..joint(position) }
}

fn states(names: &[&str], positions: &[f64]) -> JointStates {
    let names = names.iter().map(|name| (*name).to_owned()).collect();
    JointStates { names, positions: positions.to_vec(), ..JointStates::default() }
}

#[test]
fn a_transform_is_that_of_the_time_of_the_message() {
    let mut simulation = Reach::builder().simulate().expect("it starts");
    let spots = simulation.subscribe(reach::estimator::base::spot);
    simulation.publish(SHOULDER, at(0), joint(0.0));
    simulation.publish(LIFT, at(0), moving(1.0, 0.5));
    simulation.publish(SHOULDER, at(20), joint(FRAC_PI_2));
    simulation.publish(LIFT, at(20), moving(1.4, 2.0));
    // Interpolated: the camera was late, and is placed where it was.
    simulation.publish(CAMERA, at(5), Pixel(1.0));
    // Predicted: one joint by its velocity, the other is held.
    simulation.publish(CAMERA, at(70), Pixel(2.0));
    let spots: Vec<_> = spots.drain().collect();
    let quarter = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), FRAC_PI_2 / 4.0);
    assert!((spots[0].at - quarter * Vector3::new(1.1, 0.0, 0.0)).norm() < 1e-12, "{:?}", spots[0]);
    assert!((spots[0].x - quarter * Vector3::x()).norm() < 1e-12);
    assert_eq!((spots[0].monotonic_time, spots[0].frame.name()), (at(5), "base"));
    assert!((spots[1].at - Vector3::new(0.0, 1.5, 0.0)).norm() < 1e-12, "{:?}", spots[1]);
    assert_eq!(spots.len(), 2);
}

#[test]
fn what_is_unknown_or_too_old_drops_the_dispatch_and_is_never_zero() {
    let mut simulation = Reach::builder().simulate().expect("it starts");
    let spots = simulation.subscribe(reach::estimator::base::spot);
    let health = simulation.subscribe(system::Health);
    simulation.publish(CAMERA, at(1), Pixel(1.0));
    let gap = |simulation: &Simulation<Reach>| {
        let report = simulation.report();
        let spot = report.estimator("estimator/base/spot").expect("it is declared");
        let dropped = spot.inputs[0].dropped(DropReason::NoTransform);
        (dropped, spot.last_gap.as_ref().map(ToString::to_string).unwrap_or_default())
    };
    assert_eq!(gap(&simulation), (1, "nothing is known yet of the joint `shoulder`".into()));
    simulation.publish(SHOULDER, at(2), joint(0.0));
    simulation.publish(CAMERA, at(3), Pixel(1.0));
    assert_eq!(gap(&simulation), (2, "nothing is known yet of the joint `lift`".into()));
    simulation.publish(LIFT, at(4), joint(1.0));
    // Older than what is known.
    simulation.publish(CAMERA, at(3), Pixel(1.0));
    assert_eq!(gap(&simulation), (3, "the history of the joint `lift` begins 1ms after the time asked for".into()));
    simulation.publish(CAMERA, at(102), Pixel(1.0));
    assert_eq!(gap(&simulation).0, 3, "100 ms are not too old");
    simulation.publish(CAMERA, at(103), Pixel(1.0));
    let old = "the newest state of the joint `shoulder` is 101ms older than the time asked for";
    assert_eq!(gap(&simulation), (4, old.into()));
    let changes: Vec<String> = health.drain().map(|change| change.payload.to_string()).collect();
    let camera = "sensor/base/shoulder/arm/lift/carriage/camera";
    let shown = format!("0.001000000 s: estimator/base/spot healthy -> degraded (no transform; {camera})");
    assert_eq!(changes, [shown]);
    assert_eq!(spots.drain().count(), 1);
    // The next run is good.
    simulation.publish(SHOULDER, at(104), joint(0.0));
    simulation.publish(LIFT, at(104), joint(1.0));
    simulation.publish(CAMERA, at(105), Pixel(1.0));
    simulation.publish(CAMERA, at(106), Pixel(1.0));
    assert_eq!(changes_of(&health), [(HealthState::Healthy, HealthReason::Recovered)]);
}

#[test]
fn an_optional_input_gets_the_reason_for_a_missing_transform() {
    let mut simulation = Reach::builder().simulate().expect("it starts");
    let received = simulation.subscribe(reach::estimator::base::fusion);
    let imu = reach::sensor::base::imu;
    let next = |simulation: &mut Simulation<Reach>, ms| {
        simulation.publish(imu, at(ms), Pixel(0.0));
        received.drain().last().map(|message| message.payload)
    };
    let some = |camera: &str, lift| Some(Received { camera: camera.into(), lift });
    assert_eq!(next(&mut simulation, 1), some("the input `camera` takes no part in this dispatch", None));
    simulation.publish(CAMERA, at(2), Pixel(0.0));
    let unknown = "the input `camera` has no transform: nothing is known yet of the joint `shoulder`";
    assert_eq!(next(&mut simulation, 3), some(unknown, None));
    simulation.publish(SHOULDER, at(4), joint(0.0));
    simulation.publish(LIFT, at(4), joint(0.5));
    simulation.publish(CAMERA, at(20), Pixel(0.0));
    assert_eq!(next(&mut simulation, 24), some("0.500", Some(0.5)));
    // Its own tolerance, 20 ms, not that of the robot.
    simulation.publish(CAMERA, at(26), Pixel(0.0));
    let old = "the input `camera` has no transform: the newest state of the joint `shoulder` is 22ms older than the time asked for";
    assert_eq!(next(&mut simulation, 26), some(old, None));
    // An input that depends on no frame spans joints as it likes.
    assert_eq!(simulation.report().estimator("estimator/base/watch").map(|watch| watch.emitted), Some(1));
}

#[test]
fn any_frame_can_be_looked_up_at_any_time() -> Result<(), Failure> {
    let mut simulation = Reach::builder().simulate()?;
    let joints = simulation.joints();
    let handle = joints.between("base", "sensor/base/shoulder/arm/lift/carriage/camera")?;
    assert_eq!(handle.moving_joints(), 2);
    let unknown = LookupError::UnknownJoint { joint: "shoulder" };
    assert_eq!((handle.at(at(0)), handle.latest().map(drop)), (Err(unknown.clone()), Err(unknown)));
    simulation.publish(SHOULDER, at(10), joint(0.0));
    simulation.publish(SHOULDER, at(30), joint(0.2));
    simulation.publish(LIFT, at(12), joint(1.0));
    simulation.publish(LIFT, at(20), joint(2.0));
    let ms = Duration::from_millis;
    assert_eq!(handle.at(at(11)), Err(LookupError::TooOld { joint: "lift", by: ms(1) }));
    assert_eq!(handle.at(at(9)), Err(LookupError::TooOld { joint: "shoulder", by: ms(1) }));
    assert_eq!(handle.at(at(25)), Err(LookupError::InFuture { joint: "lift", by: ms(5) }));
    assert!((handle.at_within(at(25), ms(5))?.translation.vector.norm() - 2.0).abs() < 1e-12);
    assert_eq!(handle.at_within(at(26), ms(5)), Err(LookupError::InFuture { joint: "lift", by: ms(6) }));
    // Nothing comes on virtual time.
    assert!(handle.wait_until(at(26), Duration::from_secs(3600)).is_err());
    let latest = handle.latest()?;
    assert_eq!(latest.time, Some(at(20)));
    assert_eq!(latest.transform, handle.at(at(20))?);
    let expected = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.06) * Vector3::new(1.5, 0.0, 0.0);
    assert!((handle.at(at(16))?.translation.vector - expected).norm() < 1e-12);
    // The way back is the inverse; what follows a joint moves with it; fixed joints cost no state.
    let back = joints.transform("carriage", "base", at(16))?;
    assert!(((back * handle.at(at(16))?).translation.vector).norm() < 1e-12);
    let weight = joints.transform("arm", "weight", at(16))?;
    assert!((weight.translation.vector - Vector3::new(-0.65, 0.0, 0.0)).norm() < 1e-12, "{weight}");
    let fixed = joints.between("top", "plate")?.latest()?;
    assert_eq!((fixed.time, fixed.transform), (None, Isometry3::identity()));
    assert_eq!(joints.transform("arm", "top", at(-1))?.translation.vector, Vector3::z());
    // The frame of a joint is fixed to what it is mounted on.
    assert_eq!(joints.transform("base", "shoulder", at(-1))?, Isometry3::identity());
    assert_refused(joints.between("base", "carage"), "the robot has no frame `carage`; did you mean `carriage`?");
    assert_eq!(simulation.bus().joints().status("lift").map(|lift| lift.position), Some(vec![2.0]));
    Ok(())
}

#[test]
fn a_motor_is_seen_through_its_transmission() {
    let mut simulation = Reach::builder().simulate().expect("it starts");
    simulation.publish(MOTOR, at(0), MotorState { position: 5.0, velocity: Some(10.0), effort: Some(0.2) });
    let shoulder = simulation.joints().status("shoulder").expect("it is declared");
    assert_eq!(shoulder.time, Some(at(0)));
    assert!((shoulder.position[0] - (FRAC_PI_2 - 0.1)).abs() < 1e-15);
    assert!((shoulder.velocity[0] + 0.2).abs() < 1e-15 && (shoulder.effort[0] + 10.0).abs() < 1e-15);
    // A joint-side encoder needs none.
    simulation.publish(SHOULDER, at(1), joint(0.25));
    assert_eq!(simulation.joints().status("shoulder").map(|shoulder| shoulder.position), Some(vec![0.25]));
}

/// States at a path of one's own below `sensor` are kept as those of declared sensors, also in a replay.
#[test]
fn states_at_a_path_of_ones_own_below_sensor_are_kept() -> Result<(), Failure> {
    let (heard, report) = same_again(Reach::builder, |builder| {
        let mut simulation = builder.simulate()?;
        let seen = simulation.bus().publisher("sensor/vision/arm")?;
        simulation.run_until(at(10));
        seen.publish(states(&["shoulder", "base/shoulder/arm/lift"], &[FRAC_PI_2, 1.5]));
        seen.publish(states(&["elbow"], &[0.1]));
        simulation.publish(CAMERA, at(10), Pixel(1.0));
        // Not below `sensor`, and of no joint.
        simulation.bus().publisher("vision/arm")?.publish(states(&["lift"], &[0.5]));
        simulation.bus().publisher("sensor/extra")?.publish(joint(0.3));
        assert_eq!(simulation.joints().status("lift").map(|lift| lift.position), Some(vec![1.5]));
        let at_top = simulation.joints().between("base", "carriage")?.latest()?.transform;
        assert!((at_top.translation.vector - Vector3::new(0.0, 1.5, 0.0)).norm() < 1e-12);
        Ok(simulation.stop())
    })?;
    assert_eq!(heard.get("estimator/base/spot").map(Vec::len), Some(1), "the camera was placed");
    let count = |name: &str| {
        report.joints.iter().find(|joint| joint.joint == name).map(|joint| (joint.states, joint.unknown))
    };
    assert_eq!([count("shoulder"), count("lift")], [Some((1, 0)), Some((1, 0))]);
    assert_eq!([count("elbow"), count("sensor/extra")], [Some((0, 1)), Some((0, 1))]);
    Ok(())
}

#[test]
fn what_does_not_fit_is_refused_and_counted() {
    let mut simulation = Reach::builder().simulate().expect("it starts");
    simulation.run_until(at(5000));
    for (millis, names, positions) in [
        // By name and by path; mimic joints are not named.
        (10, &["shoulder", "base/shoulder/arm/lift", "counter"][..], &[0.1, 0.2, 0.3][..]),
        (10, &["shoulder"], &[0.2]),
        (9, &["shoulder"], &[0.2]),
        (11, &["shoulder", "lift"], &[f64::NAN, 0.4]),
        (12, &["lift"], &[f64::INFINITY]),
        (13, &["wrist", "plate"], &[0.0, 0.0]),
        (14, &["wrist"], &[0.0]),
        // A second ahead is the clock's fault, more is the sender's.
        (6_000, &["shoulder"], &[0.3]),
    ] {
        simulation.publish(reach::sensor::bus, at(millis), states(names, positions));
    }
    // Sent at 5 s.
    simulation.publish(SHOULDER, at(5_000), joint(0.3));
    let shoulder = simulation.joints().status("shoulder").expect("it is declared");
    let report = simulation.report();
    let count = |name: &str| report.joints.iter().find(|joint| joint.joint == name).expect("it was counted");
    let reasons =
        |name: &str| JointRefusal::ALL.iter().map(|reason| count(name).refused(*reason)).collect::<Vec<_>>();
    assert_eq!(shoulder.position, [0.3]);
    assert_eq!((count("lift").states, reasons("lift")), (2, vec![0, 0, 1, 0, 0]));
    assert_eq!((count("wrist").unknown, count("plate").unknown, count("wrist").is_declared), (2, 1, false));
    let text = report.to_string();
    assert!(text.contains("2 states of `wrist`, which is no moving joint of this robot"), "{text}");
    assert!(text.contains("joint lift: 2 states, 1 refused: non-finite"), "{text}");
    assert_eq!(reasons("shoulder")[..4], [2, 1, 1, 0], "{text}");
}

#[test]
fn a_joint_that_falls_silent_is_stale() {
    let mut simulation = Reach::builder().simulate().expect("it starts");
    let joints = simulation.joints();
    let unknown = joints.status("counter").expect("it moves");
    assert_eq!((unknown.time, unknown.is_stale, unknown.position.len()), (None, true, 0));
    simulation.publish(LIFT, at(0), JointState { position: 1.0, velocity: Some(0.5), effort: Some(3.0) });
    let stale = |ms, simulation: &mut Simulation<Reach>| {
        simulation.run_until(at(ms));
        joints.status("counter").map(|counter| counter.is_stale)
    };
    assert_eq!((stale(100, &mut simulation), stale(101, &mut simulation)), (Some(false), Some(true)));
    let counter = joints.status("counter").expect("it moves");
    assert_eq!((counter.time, counter.position, counter.velocity), (Some(at(0)), vec![-0.4], vec![-0.25]));
    assert!(joints.status("plate").is_none(), "it does not move");
    assert_eq!(joints.all().iter().map(|joint| joint.joint).collect::<Vec<_>>(), ["shoulder", "lift", "counter"]);
}

#[test]
fn all_joints_are_published_as_a_whole() {
    let mut simulation = Reach::builder().simulate().expect("it starts");
    let published = simulation.subscribe(reach::bridge::joint_states);
    simulation.publish(LIFT, at(1), moving(1.0, 1.0));
    simulation.publish(LIFT, at(9), moving(1.8, 1.0));
    simulation.publish(SHOULDER, at(5), moving(0.5, 0.0));
    simulation.run_until(at(35));
    let snapshots: Vec<_> = published.drain().collect();
    assert_eq!(snapshots.len(), 1, "nothing new came");
    assert_eq!(&snapshots[0].names[..], ["shoulder", "lift", "counter"]);
    assert_eq!(snapshots[0].monotonic_time, at(5));
    let expected = [0.5, 1.4, -0.6];
    assert!(snapshots[0].positions.iter().zip(expected).all(|(is, expected)| (is - expected).abs() < 1e-12));
    assert_eq!((&snapshots[0].velocities[..], snapshots[0].efforts.len()), (&[0.0, 1.0, -0.5][..], 0));
    // One that has fallen silent is left out, and the others go on.
    simulation.run_until(at(150));
    simulation.publish(LIFT, at(151), moving(1.8, 0.0));
    simulation.run_until(at(165));
    let last = published.drain().last().expect("it was published");
    assert_eq!((&last.names[..], last.monotonic_time), (&["lift".to_owned(), "counter".to_owned()][..], at(151)));
    assert_eq!(simulation.report().joints.iter().filter(|joint| !joint.is_declared).count(), 0);
}

#[test]
fn a_thread_waits_for_a_state_that_comes() -> Result<(), Failure> {
    let running = Reach::builder().start()?;
    let live = running.live();
    let handle = live.joints().between("arm", "carriage")?;
    let start = live.clock().now();
    let unknown = Err(LookupError::UnknownJoint { joint: "lift" });
    assert_eq!(handle.wait_until(start, Duration::from_millis(5)), unknown);
    live.publish(LIFT, start, joint(0.0));
    let waits =
        std::thread::spawn(move || handle.wait_until(start + Duration::from_micros(1), Duration::from_secs(60)));
    while !waits.is_finished() {
        live.publish(LIFT, live.clock().now(), joint(1.0));
        std::thread::sleep(Duration::from_millis(1));
    }
    assert!(waits.join().map_err(|_| "it panicked")?.is_ok());
    running.stop();
    Ok(())
}
