//! A sensor at rest converges from any start.

use core::f64::consts::PI;

use nalgebra::{UnitQuaternion, Vector3};

use super::{Filter, at_rest};

/// Runs a filter at rest in `truth` at 100 Hz, from `start`, and returns where it ends.
fn settle<F: Filter>(filter: &F, start: UnitQuaternion<f64>, truth: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    let mut filter = filter.clone();
    filter.start_at(0, start).unwrap();
    for i in 1..20_000 {
        filter.update(&at_rest(i * 10_000_000, truth)).unwrap();
    }
    filter.world_from_body().unwrap()
}

fn starts() -> [UnitQuaternion<f64>; 6] {
    let about = |axis, angle| UnitQuaternion::from_axis_angle(&axis, angle);
    [
        about(Vector3::x_axis(), PI),
        about(Vector3::y_axis(), PI),
        about(Vector3::x_axis(), PI - 1e-9),
        about(Vector3::y_axis(), -1.5),
        UnitQuaternion::from_euler_angles(2.0, 1.0, -2.0),
        UnitQuaternion::identity(),
    ]
}

pub(in crate::attitude) fn tilt_converges<F: Filter>(filter: &F) {
    for truth in [UnitQuaternion::identity(), UnitQuaternion::from_euler_angles(0.5, -0.3, 1.0)] {
        for start in starts() {
            // Rotated by the truth, so that some starts are exactly upside down.
            let end = settle(filter, truth * start, &truth);
            let error = (end * truth.inverse() * Vector3::z()).angle(&Vector3::z());
            assert!(error.to_degrees() < 0.1, "{} degrees from {start}", error.to_degrees());
        }
    }
}

pub(in crate::attitude) fn heading_converges<F: Filter>(filter: &F) {
    let truth = UnitQuaternion::from_euler_angles(0.5, -0.3, 1.0);
    for start in starts() {
        let error = settle(filter, start, &truth).angle_to(&truth);
        assert!(error.to_degrees() < 0.1, "{} degrees from {start}", error.to_degrees());
    }
    for heading in [-3.0, -1.0, 2.0] {
        let start = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading) * truth;
        let error = settle(filter, start, &truth).angle_to(&truth);
        assert!(error.to_degrees() < 0.1, "{} degrees from heading {heading}", error.to_degrees());
    }
}

pub(in crate::attitude) fn heading_is_left_alone<F: Filter>(filter: &F) {
    let tilt = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 0.5);
    let heading = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 1.0);
    let end = settle(filter, heading, &tilt);
    assert!(end.angle_to(&(heading * tilt)).to_degrees() < 0.1);
}
