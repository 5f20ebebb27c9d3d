//! Allocations on the way from a sensor's publish to the outputs of all estimators downstream: there are none.

use bb_core::component::InputTransforms;
use bb_core::nalgebra::{UnitQuaternion, Vector2, Vector3};
use bb_core::prelude::*;
use bb_core::pubsub::Topic;
use bb_estimators::attitude::ImuAndMagnetometer;
use bb_estimators::navigation::{
    AbsolutePose, Camera, EskfParams, FixedLagSmoother, GnssPosition, ImuMean, Kernel, LandmarkParams, Observation,
    Refusal, RelativePose, SmootherParams, Start, Stream,
};
use bb_estimators::{Madgwick, OrientationAverage};
use std::future::Future;
use std::pin::pin;
use std::task::{Context as TaskContext, Waker};

robot! {
    robot TwoImus;

    link base {
        sensor imu: External<Marg>() {
            estimator orientation: Madgwick<Marg>();
        }
        sensor inertial: External<Imu>();
        sensor magnetic: External<MagneticField>();
        estimator separate: Madgwick<ImuAndMagnetometer>() {
            input imu: sensor::base::inertial, driver;
            input magnetic_field: sensor::base::magnetic, optional;
        }
        estimator attitude: OrientationAverage() {
            input first: sensor::base::imu::orientation, driver;
            input second: estimator::base::separate;
            sync_tolerance: 10 ms;
        }
    }
}

#[test]
fn nothing_is_allocated_from_publish_to_output() -> Result<(), StartError> {
    let builder = TwoImus::builder();
    let attitude = builder.subscribe(two_imus::estimator::base::attitude);
    let mut simulation = builder.simulate()?;
    let imu = Imu::new([0.0, 0.0, 0.1].into(), [0.0, 0.0, 9.81].into());
    let field = MagneticField::new([0.0, 20e-6, -40e-6].into());
    let mut publish = |millis: i64| {
        let time = MonotonicTime::from_nanos(millis * 1_000_000);
        simulation.publish(two_imus::sensor::base::magnetic, time, field);
        simulation.publish(two_imus::sensor::base::inertial, time, imu);
        simulation.publish(two_imus::sensor::base::imu, time, Marg { imu, magnetic_field: Some(field) });
        // A drop is no excuse.
        simulation.publish(two_imus::sensor::base::inertial, MonotonicTime::ZERO, imu);
    };
    publish(0);
    assert!(attitude.try_recv().is_some());
    let allocations = allocation_counter::measure(|| (1..=1000).for_each(&mut publish));
    assert_eq!(attitude.drain().count(), 1000);
    assert_eq!(allocations.count_total, 0);
    Ok(())
}

/// The memory of written lines is used again. It may still grow once, with the lines that wait for the sink's thread at once.
#[test]
fn a_journal_allocates_for_no_message() -> Result<(), StartError> {
    const MESSAGES: u64 = 20_000;
    let mut builder = TwoImus::builder();
    builder.journal(drop);
    let running = builder.start()?;
    let imu = Imu::new([0.0, 0.0, 0.1].into(), [0.0, 0.0, 9.81].into());
    let publish = || running.publish(two_imus::sensor::base::inertial, running.clock().now(), imu);
    (0..MESSAGES).for_each(|_| publish());
    let allocations = allocation_counter::measure(|| (0..MESSAGES).for_each(|_| publish()));
    assert!(allocations.count_total < MESSAGES / 100, "{} allocations", allocations.count_total);
    Ok(())
}

/// A payload whose clone allocates nothing, although it holds the heap.
#[derive(Clone, Debug, Payload)]
struct Shared {
    pixels: std::sync::Arc<[u8]>,
}

#[test]
fn nothing_is_allocated_for_subscribers_that_are_full_or_awaited() {
    let topic = Topic::<Shared>::new("sensor/base/camera");
    let by_number = topic.subscribe(Overflow::DropOldest { capacity: 4 });
    let by_bytes = topic.subscribe(Overflow::DropOldestWithin { capacity: 1 << 17, bytes: 10_000 });
    let latest = topic.subscribe(Overflow::KeepLatest);
    let mut awaited = topic.subscribe(Overflow::default());
    let message = Stamped::new(MonotonicTime::ZERO, Shared { pixels: [0; 1000].into() });
    let mut publish = || {
        let next = pin!(awaited.recv_async());
        assert!(next.poll(&mut TaskContext::from_waker(Waker::noop())).is_pending());
        topic.publish(&message);
        assert!(awaited.try_recv().is_some());
    };
    publish();
    let allocations = allocation_counter::measure(|| (0..1000).for_each(|_| publish()));
    assert_eq!(allocations.count_total, 0);
    assert_eq!((by_number.lagged(), by_bytes.lagged(), latest.lagged()), (997, 991, 1000));
}

/// Detection of a camera.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
struct Flash;

/// Position of a camera, m.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
struct Spot(Vector3<f64>);

/// Says where its camera is.
struct Spotter(Vector3<f64>);

impl Estimator for Spotter {
    type Options = NoOptions;
    type Input = Flash;
    type Output = Spot;
    const HANDLES_MOVING_JOINTS: bool = true;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self(Vector3::zeros()))
    }

    fn handle_transforms(&mut self, transforms: &InputTransforms<'_>) -> Result<(), Fault> {
        self.0 = transforms.frame_from_driver()?.translation.vector;
        Ok(())
    }

    fn handle_input(&mut self, _: &Stamped<Flash>) -> Result<Reply<Spot>, Fault> {
        Ok(Reply::emit(Spot(self.0)))
    }
}

robot! {
    robot Arm;

    sensors { sensor bus: External<JointStates>(); }

    link base {
        estimator spot: Spotter() { input camera: sensor::base::shoulder::upper::elbow::lower::camera; }
        joint shoulder: continuous {
            axis: z;
            transmission: { reduction: 10 };
            sensor motor: External<MotorState>();
            link upper {
                joint elbow: prismatic {
                    axis: x;
                    limit: { lower: 0 m, upper: 1 m, velocity: 1 m/s, effort: 1 N };
                    link lower { sensor camera: External<Flash>(); }
                }
            }
        }
    }
}

/// The first states of joints make room for a history; those after it, the estimator that is told transforms and others that ask for them
/// need none, whether they get one or not.
#[test]
fn nothing_is_allocated_for_joints_and_transforms() -> Result<(), Box<dyn std::error::Error>> {
    let builder = Arm::builder();
    let spots = builder.subscribe(arm::estimator::base::spot);
    let mut simulation = builder.simulate()?;
    let handle = simulation.joints().between("base", "lower")?;
    let names: std::sync::Arc<[String]> = ["elbow".to_owned()].into();
    let time = |step: i64| MonotonicTime::from_nanos(step * 100_000);
    let states = |step: i64| JointStates {
        names: std::sync::Arc::clone(&names),
        positions: vec![(step as f64 * 0.01).sin().abs()],
        ..JointStates::default()
    };
    let mut told: Vec<JointStates> = (0..1100).map(states).collect();
    let mut publish = |step: i64| {
        let motor = MotorState { position: step as f64, velocity: Some(1.0), effort: None };
        simulation.publish(arm::sensor::base::shoulder::motor, time(step), motor);
        simulation.publish(arm::sensor::bus, time(step), told.pop().expect("there are enough"));
        simulation.publish(arm::sensor::base::shoulder::upper::elbow::lower::camera, time(step), Flash);
        let unknown = handle.at(time(step + 1)).is_err();
        (handle.at(time(step)).is_ok(), unknown, handle.latest().is_ok())
    };
    for step in 0..10 {
        publish(step);
    }
    spots.drain().for_each(drop);
    let mut all = true;
    let allocations = allocation_counter::measure(|| {
        for step in 10..1010 {
            all &= publish(step) == (true, true, true);
        }
    });
    assert!(all && spots.drain().count() == 1000);
    assert_eq!(allocations.count_total, 0);
    Ok(())
}

#[test]
fn nothing_is_allocated_at_a_keyframe() -> Result<(), Box<dyn std::error::Error>> {
    let sensors = EskfParams { longest_sample: 0.05, ..EskfParams::default() };
    let params =
        SmootherParams { sensors, window: 12, factors: 4, relinearise_rotation: 1e-4, ..SmootherParams::default() };
    let mut smoother: FixedLagSmoother = FixedLagSmoother::new(params)?;
    let camera = Camera::pinhole((400.0, 400.0), (320.0, 240.0), (640.0, 480.0));
    smoother.set_camera(camera, LandmarkParams { landmarks: 40, ..LandmarkParams::default() })?;
    let mut sights = Stream::default();
    let (rest, level) = (Vector3::zeros(), UnitQuaternion::identity());
    let mut streams = [Stream::default(); 2];
    let [poses, odometry] = &mut streams;
    let mut moved = 0;
    let mut keyframe = |smoother: &mut FixedLagSmoother, k: u64| -> Result<(), Refusal> {
        let time_ns = |k: u64| i64::try_from(k).unwrap_or(i64::MAX) * 100_000_000;
        let sway = 0.3 * (k as f64).sin();
        // Now and then samples are missing.
        let samples = if k.is_multiple_of(40) { 1 } else { 5 };
        for i in 1..=samples {
            let specific_force = Vector3::new(sway, 0.0, 9.80665);
            let angular_velocity = Vector3::new(0.0, 0.1 * sway, sway);
            let time_ns = time_ns(k - 1) + i * 100_000_000 / samples;
            smoother.propagate(&ImuMean { time_ns, angular_velocity, specific_force })?;
        }
        smoother.add_keyframe(k)?;
        // Some of it is refused: it jumps, and four are too many.
        let jump = if k % 50 < 5 { 500.0 } else { 0.0 };
        let pose = AbsolutePose::new((Vector3::new(jump, sway, 0.0), 1.0), (level, 0.05));
        let _ = smoother.add_robust(poses, k, pose, Kernel::Cauchy(2.0));
        let _ = smoother.add(odometry, k, RelativePose::new(k - 1, (rest, 0.1), (level, 0.01)));
        for late in 0..4 {
            let fix = GnssPosition::new(Vector3::new(0.0, f64::NAN * f64::from(late == 3), 0.0), 2.0, 4.0);
            let _ = smoother.add(poses, k.saturating_sub(late * 5), fix);
        }
        // A camera that looks up: tracks of twenty keyframes, some late, some wrong, and more new ones than there is room for.
        for landmark in 0..12 {
            let (age, generation) = ((k + landmark) % 20, (k + landmark) / 20);
            let pixel = Vector2::new(30.0 * age as f64 + 20.0, 40.0 * landmark as f64 + sway);
            let id = landmark + 100 * generation;
            let place = (Vector3::new(0.5 * sway, 0.0, 30.0), 20.0);
            let guess = (landmark % 3 == 0).then_some(place);
            let seen = Observation { guess, ..Observation::new(id, pixel, 5.0) };
            let _ = smoother.observe(&mut sights, k.saturating_sub(landmark % 4), &seen);
            let new = Observation::new(1_000_000 + 20 * k + landmark, pixel, 1.0);
            let _ = smoother.observe(&mut sights, k, &new);
        }
        moved += smoother.update()?.relinearised;
        let _ = (smoother.estimate(), smoother.pose_covariance(), smoother.smoothed(k.saturating_sub(5)));
        Ok(())
    };
    smoother.start(0, &Start::at(0, (rest, 1.0), (rest, 0.1), (level, 0.05)))?;
    for k in 1..30 {
        keyframe(&mut smoother, k)?;
    }
    let mut result = Ok(());
    let allocations = allocation_counter::measure(|| {
        result = (30..150).try_for_each(|k| keyframe(&mut smoother, k));
    });
    result?;
    assert_eq!(allocations.count_total, 0);
    // It has seen all of it.
    let counts = poses.counts();
    assert!(counts.gate > 5 && counts.invalid > 20 && counts.not_applicable > 20, "{counts:?}");
    let seen = sights.counts();
    assert!(seen.fused + seen.weighed_down > 200 && seen.gate > 5 && seen.not_applicable > 40, "{seen:?}");
    assert!(moved > 40 && smoother.gaps() > 2 && smoother.marginalised() > 100, "{moved}");
    Ok(())
}
