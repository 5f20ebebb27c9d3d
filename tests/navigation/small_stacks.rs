//! Filters with all states that there are, their generic code not optimised, in a thread with half of the stack that a thread has by
//! default.

use bb_core::nalgebra::{Matrix3, UnitQuaternion, Vector3};
use bb_core::payload::{
    FluidPressure, GeodeticPosition, GnssFix, GnssServices, GnssStatus, MagneticField, RelativePose, Twist,
};
use bb_core::prelude::*;
use bb_estimators::Eskf;
use bb_estimators::navigation::{Geodetic, LocalFrame, NavigationOutputs, Optional, States};

/// Every state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Everything;

impl States for Everything {
    const OPTIONAL: &'static [Optional] = &[
        Optional::Keyframe,
        Optional::RelativeScale,
        Optional::GnssLeverArm,
        Optional::GnssDelay,
        Optional::WheelScale,
        Optional::HardIron,
        Optional::BarometerBias,
    ];
}

robot! {
    robot Laden;

    link body {
        sensor imu: External<Imu>();
        sensor gnss: External<GnssFix>();
        sensor wheels: External<Odometry>();
        sensor map: External<Pose>();
        sensor camera: External<RelativePose>();
        sensor compass: External<MagneticField>();
        sensor barometer: External<FluidPressure>();
        estimator navigation: Eskf<NavigationOutputs, Everything, { Everything::DIMENSION }>() {
            input imu: sensor::body::imu, driver;
            input gnss: sensor::body::gnss, optional;
            input odometry: sensor::body::wheels, optional;
            input pose: sensor::body::map, optional;
            input relative: sensor::body::camera, optional;
            input magnetic_field: sensor::body::compass, optional;
            input pressure: sensor::body::barometer, optional;
            output odometry;
            output status;
        }
    }
}

const STACK: usize = 1 << 20;

fn on_a_small_stack<T: Send + 'static>(run: impl FnOnce() -> T + Send + 'static) -> T {
    let thread = std::thread::Builder::new().stack_size(STACK).spawn(run).expect("there is room for a thread");
    thread.join().expect("it has run to its end")
}

/// A filter with all states runs on a small stack: at rest with every sensor, a kilometre away from the fifth second on, it starts, fuses
/// what comes late, is moved, and its world moves on.
#[test]
fn a_filter_with_all_states_runs_on_a_small_stack() {
    let last = on_a_small_stack(|| {
        let builder = Laden::builder();
        let status = builder.subscribe(laden::estimator::body::navigation::status);
        let mut simulation = builder.simulate().expect("it starts");
        let frame = LocalFrame::new(Geodetic::from_degrees(48.1, 11.6, 520.0));
        for millis in (0..10_000_u64).step_by(10) {
            let time = MonotonicTime::ZERO + Duration::from_millis(millis);
            let away = if millis < 5_000 { 0.0 } else { 9_000.0 };
            if millis % 200 == 0 {
                let at = frame.geodetic(&Vector3::new(away, 0.0, 0.0));
                let position = GeodeticPosition {
                    latitude_rad: at.latitude,
                    longitude_rad: at.longitude,
                    altitude: Some(at.height),
                };
                let (status, services) = (GnssStatus::Fix, GnssServices::default());
                let position_covariance = Some(Matrix3::identity() * 0.09);
                let fix = GnssFix { status, services, position: Some(position), position_covariance };
                // Late by a tenth of a second.
                let then = MonotonicTime::ZERO + Duration::from_millis(millis.saturating_sub(100));
                simulation.live().publish(laden::sensor::body::gnss, then, fix);
            }
            if millis % 100 == 0 {
                let (position, world_from_body) = (Vector3::new(away, 0.0, 0.0), UnitQuaternion::identity());
                let pose = Pose { position, world_from_body, covariance: None };
                simulation.publish(laden::sensor::body::map, time, pose);
                let twist = Twist { linear: Vector3::zeros(), angular: Vector3::zeros(), covariance: None };
                simulation.publish(laden::sensor::body::wheels, time, Odometry { pose, twist });
                let start = MonotonicTime::ZERO + Duration::from_millis(millis.saturating_sub(100));
                let relative = RelativePose {
                    start,
                    end: time,
                    position: Vector3::zeros(),
                    start_from_end: UnitQuaternion::identity(),
                    covariance: None,
                };
                simulation.publish(laden::sensor::body::camera, time, relative);
                let field = MagneticField::new(Vector3::new(0.0, 2e-5, -4e-5));
                simulation.publish(laden::sensor::body::compass, time, field);
                let pressure = FluidPressure { fluid_pressure: 95_000.0, variance: None };
                simulation.publish(laden::sensor::body::barometer, time, pressure);
            }
            let at_rest = Imu::new(Vector3::zeros(), Vector3::new(0.0, 0.0, 9.80665));
            simulation.publish(laden::sensor::body::imu, time, at_rest);
        }
        status.drain().last().map(|status| status.payload)
    });
    let status = last.expect("it has emitted");
    assert!(status.resets >= 1 && status.gnss.fused > 10 && status.pressure.fused > 10, "{status:?}");
    assert!(
        status.relative.fused > 10 && status.magnetic_field.fused > 10 && status.odometry.fused > 10,
        "{status:?}"
    );
}
