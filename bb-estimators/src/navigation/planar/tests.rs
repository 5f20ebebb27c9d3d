//! The transition and every Jacobian against numeric differentiation, and the laws of the filter.

mod cases;
mod consistency;
mod jacobians;
mod laws;
#[cfg(feature = "alloc")]
mod wrong;

use nalgebra::{Vector2, Vector3};
use proptest::prelude::*;

use super::{PlanarEstimate, PlanarFilter, PlanarParams, PlanarStart};
use crate::navigation::ImuMean;

fn vector(limit: f64) -> impl Strategy<Value = Vector2<f64>> {
    (-limit..limit, -limit..limit).prop_map(|(x, y)| Vector2::new(x, y))
}

fn estimate() -> impl Strategy<Value = PlanarEstimate> {
    (vector(1000.0), -3.1..3.1, vector(20.0), -0.1..0.1, -0.2..0.2, -3.0..3.0).prop_map(
        |(position, heading, velocity, gyroscope_bias, wheel_scale, yaw_rate)| PlanarEstimate {
            time_ns: 0,
            position,
            heading,
            velocity,
            gyroscope_bias,
            wheel_scale,
            yaw_rate,
        },
    )
}

fn started_with(params: PlanarParams, start: &PlanarStart) -> PlanarFilter {
    let mut filter = PlanarFilter::new(params).unwrap();
    filter.start(start).unwrap();
    filter
}

/// A filter at rest at the origin with a moderate uncertainty.
fn started() -> PlanarFilter {
    let start = PlanarStart::at(0, (Vector2::zeros(), 2.0), (0.3, 0.1), (Vector2::zeros(), 0.5));
    started_with(PlanarParams::default(), &start)
}

/// A drive with turns in both directions, sampled at 100 Hz.
fn sample(i: i64) -> ImuMean {
    let t = i as f64 * 0.01;
    ImuMean {
        time_ns: i * 10_000_000,
        angular_velocity: Vector3::new(0.02 * (3.0 * t).sin(), 0.0, 0.4 * (0.7 * t).sin()),
        specific_force: Vector3::new(0.0, 0.0, 9.8),
    }
}
