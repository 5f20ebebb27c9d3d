//! Every algorithm in both scalars, in a library with a panic handler of its own: it does not build, with E0152, when one of
//! its dependencies brings the standard library in.

#![no_std]

use bb_estimators::attitude::average::{average, average_pair};
use bb_estimators::attitude::initial::initial_orientation;
use bb_estimators::attitude::{
    AnyFilter, AnyParams, AttitudeFilter, FilterParams, ImuSample, OrientationError, Real,
};
use bb_estimators::navigation::{EskfFilter, EskfParams, GnssPosition, ImuMean, Optional, Start, States, Stream};
use bb_estimators::navigation::planar::{PlanarFilter, PlanarParams, PlanarPosition, PlanarStart};
use bb_estimators::params::Params;
use nalgebra::{UnitQuaternion, Vector2, Vector3};

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}

/// The heading error of all filters together after one sample, rad, in `f64`.
pub fn double(sample: &ImuSample) -> Option<f64> {
    all(sample)
}

/// Computes the heading error of all filters together after one sample, rad, in `f32`.
pub fn single(sample: &ImuSample<f32>) -> Option<f64> {
    all(sample)
}

fn all<T: Real>(sample: &ImuSample<T>) -> Option<f64> {
    let truth = initial_orientation(&sample.specific_force, sample.magnetic_field.as_ref()).ok()?;
    let mut orientations = [UnitQuaternion::identity(); FilterParams::ALL.len()];
    for (orientation, default) in orientations.iter_mut().zip(FilterParams::ALL) {
        *orientation = updated(default(), sample)?;
    }
    let mean = average(&orientations.map(|orientation| (orientation, T::ONE))).ok()?;
    let mean = average_pair(&mean, T::ONE, &truth, T::HALF).ok()?;
    Some(OrientationError::between(&mean, &truth)?.heading)
}

/// A rover with an antenna on a mast.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Rover;

impl States for Rover {
    const OPTIONAL: &'static [Optional] = &[Optional::GnssLeverArm];
}

/// Returns the position after one sample and one fix, east of the origin, m.
pub fn navigate(sample: &ImuMean) -> Option<f64> {
    let mut filter = EskfFilter::<Rover, { Rover::DIMENSION }>::new(EskfParams::default()).ok()?;
    let rest = Vector3::zeros();
    filter.start(&Start::at(0, (rest, 5.0), (rest, 0.1), (UnitQuaternion::identity(), 0.1))).ok()?;
    filter.propagate(sample).ok()?;
    filter.update(&mut Stream::default(), &GnssPosition::new(rest, 1.0, 2.0)).ok()?;
    Some(filter.estimate()?.position.x)
}

/// Returns the position of the filter on a plane after one sample and one fix, east of the origin, m.
pub fn drive(sample: &ImuMean) -> Option<f64> {
    let mut filter = PlanarFilter::new(PlanarParams::default()).ok()?;
    let rest = Vector2::zeros();
    filter.start(&PlanarStart::at(0, (rest, 5.0), (0.0, 0.1), (rest, 0.1))).ok()?;
    filter.propagate(sample).ok()?;
    filter.update(&mut Stream::default(), &PlanarPosition::new(rest, 1.0)).ok()?;
    Some(filter.estimate()?.position.x)
}

/// Returns the orientation after a sample, with the first of the filter's parameters set by name.
fn updated<T: Real>(mut params: FilterParams, sample: &ImuSample<T>) -> Option<UnitQuaternion<T>> {
    let first = params.parameters().first()?.name;
    params.set(first, "0.5").ok()?;
    let mut filter = AnyFilter::new(AnyParams { filter: params }).ok()?;
    filter.update(sample).ok()?;
    filter.world_from_body()
}
