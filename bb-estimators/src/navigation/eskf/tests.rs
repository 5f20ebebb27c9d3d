//! The transition and every Jacobian against numeric differentiation, and the laws of the filter.

mod adopt;
mod attack;
mod cases;
mod consistency;
#[cfg(feature = "eskf")]
mod jacobians;
mod laws;
mod transition;

use nalgebra::{SMatrix, SVector, UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::params::EskfParams;
use super::{EskfFilter, ImuMean, Start};
use crate::navigation::covariance::Covariance;
use crate::navigation::state::{Estimate, Navigation, Optional, States};
use crate::navigation::update::Composed;
use crate::navigation::{Keyframe, NAVIGATION, Refusal, Stream, StreamParams};

/// All optional states.
#[derive(Clone, Copy, Debug, PartialEq)]
struct All;

impl States for All {
    const OPTIONAL: &'static [Optional] = &[
        Optional::GnssLeverArm,
        Optional::RelativeScale,
        Optional::Keyframe,
        Optional::GnssDelay,
        Optional::WheelScale,
        Optional::WheelMounting,
        Optional::HardIron,
        Optional::BarometerBias,
    ];
}

/// Wheels that wear and an antenna on a mast.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Rover;

impl States for Rover {
    const OPTIONAL: &'static [Optional] = &[Optional::WheelScale, Optional::GnssLeverArm, Optional::GnssDelay];
}

/// Poses from a camera, relative to keyframes.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Drone;

impl States for Drone {
    const OPTIONAL: &'static [Optional] = &[Optional::Keyframe, Optional::RelativeScale];
}

const ALL: usize = All::DIMENSION;

type Plain = EskfFilter<Navigation, NAVIGATION>;

/// A stream without a gate.
pub(in crate::navigation) fn open() -> Stream {
    Stream::new(StreamParams { gate: 0.0, ..StreamParams::default() })
}

pub(in crate::navigation) fn vector(limit: f64) -> impl Strategy<Value = Vector3<f64>> {
    proptest::array::uniform3(-limit..limit).prop_map(Vector3::from)
}

fn orientation() -> impl Strategy<Value = UnitQuaternion<f64>> {
    vector(3.0).prop_map(UnitQuaternion::from_scaled_axis)
}

pub(in crate::navigation) fn matrix<const R: usize, const C: usize>(rows: &[[f64; C]; R]) -> SMatrix<f64, R, C> {
    SMatrix::from_fn(|i, j| rows[i][j])
}

pub(in crate::navigation) fn rows<const R: usize, const C: usize>(matrix: &SMatrix<f64, R, C>) -> [[f64; C]; R] {
    core::array::from_fn(|i| core::array::from_fn(|j| matrix[(i, j)]))
}

/// The covariance with this root, as a matrix and as the filters hold it.
pub(in crate::navigation) fn covariance<const N: usize>(root: Vec<f64>) -> (SMatrix<f64, N, N>, Covariance<N>) {
    let root = SMatrix::<f64, N, N>::from_iterator(root);
    let mut covariance = Covariance::new();
    let dense = root * root.transpose();
    *covariance.rows_mut() = rows(&SMatrix::<f64, N, N>::from_fn(|i, j| dense[(i.min(j), i.max(j))]));
    (dense, covariance)
}

/// The derivative of `of` at zero, by central differences.
pub(in crate::navigation) fn derivative<const R: usize, const C: usize>(
    step: f64,
    of: impl Fn(&SVector<f64, C>) -> SVector<f64, R>,
) -> SMatrix<f64, R, C> {
    let column = |state: usize| {
        let mut error = SVector::<f64, C>::zeros();
        error[state] = step;
        (of(&error) - of(&-error)) / (2.0 * step)
    };
    SMatrix::from_columns(&core::array::from_fn::<_, C, _>(column))
}

/// Checks T, which takes a change of an error to errors of the state that is composed with it.
pub(in crate::navigation) fn is_transported<E: Composed<N>, const N: usize>(
    (at, error): (&E::State, &SVector<f64, N>),
    root: Vec<f64>,
    between: impl Fn(&E::State, &E::State) -> SVector<f64, N>,
) -> Result<(), TestCaseError> {
    let composed = E::composed(at, error);
    let numeric = derivative(1e-5, |change| between(&composed, &E::composed(at, &(error + change))));
    let mut transport = rows(&SMatrix::<f64, N, N>::identity());
    E::transport_jacobian(error, &mut transport);
    let transport = matrix(&transport);
    prop_assert!((numeric - transport).amax() < 1e-7, "{} is not {}", transport, numeric);
    let (dense, mut covariance) = covariance::<N>(root);
    E::transport_covariance(error, &mut covariance);
    let expected = transport * dense * transport.transpose();
    prop_assert!((covariance.matrix() - expected).amax() < 1e-12 * (1.0 + expected.amax()));
    prop_assert_eq!(covariance.matrix(), &covariance.matrix().transpose());
    Ok(())
}

/// Gives a filter at `time_ns` samples that it refuses.
pub(in crate::navigation) fn bad_samples_are_refused(
    time_ns: i64,
    mut propagate: impl FnMut(&ImuMean) -> Result<(), Refusal>,
) {
    let good = ImuMean { time_ns: time_ns + 10_000_000, ..sample(1) };
    let again = Refusal::TimeNotIncreasing { previous_ns: time_ns, time_ns };
    assert_eq!(propagate(&ImuMean { time_ns, ..good }), Err(again));
    for (number, refusal) in [(1e7, Refusal::OutOfRange), (f64::NAN, Refusal::NonFinite)] {
        let bad = Vector3::new(0.0, 0.0, number);
        assert_eq!(propagate(&ImuMean { specific_force: bad, ..good }), Err(refusal), "specific force {number}");
        assert_eq!(
            propagate(&ImuMean { angular_velocity: bad, ..good }),
            Err(refusal),
            "angular velocity {number}"
        );
    }
    assert!(matches!(propagate(&ImuMean { time_ns: i64::MAX, ..good }), Err(Refusal::Gap { .. })));
}

/// Run with sensors that err as the filter assumes: its normalised error, the number of states in it, and the sensors' streams.
pub(in crate::navigation) struct Run {
    pub(in crate::navigation) nees: f64,
    pub(in crate::navigation) dimension: usize,
    pub(in crate::navigation) streams: Vec<Stream>,
}

/// Checks that the errors of runs are as large as the filter says, and innovations of the named streams, to so many deviations of their
/// means. Returns how many streams were in use.
pub(in crate::navigation) fn are_consistent(runs: &[Run], names: &[&str], deviations: f64) -> usize {
    let count = runs.len() as f64;
    let over = |of: &dyn Fn(&Run) -> f64| runs.iter().map(of).sum::<f64>() / count;
    let (mean, dimension) = (over(&|run| run.nees), runs[0].dimension as f64);
    // Three standard deviations of a mean of χ² with the same number of dimensions.
    let spread = 3.0 * (2.0 * dimension / count).sqrt();
    assert!((mean - dimension).abs() < spread, "NEES {mean}, not {dimension} ± {spread}");
    let mut used = 0;
    for (i, name) in names.iter().enumerate() {
        let first = runs[0].streams[i].consistency();
        if first.count() == 0 {
            continue;
        }
        used += 1;
        let nis = over(&|run| run.streams[i].consistency().mean_nis().unwrap());
        let correlation = over(&|run| run.streams[i].consistency().correlation().unwrap());
        // Of a mean of χ², and of a correlation, over the same number of innovations.
        let spread = deviations * (first.nis_bounds().1 - 1.0) / 1.96 / count.sqrt();
        assert!((nis - 1.0).abs() < spread, "{name}: NIS {nis}, not 1 ± {spread}");
        let spread = deviations / (first.count() as f64 * count).sqrt();
        let what = "from one innovation to the next";
        assert!(correlation.abs() < spread, "{name}: {correlation} {what}, not 0 ± {spread}");
    }
    used
}

/// An estimate with a keyframe and all optional states.
fn estimate() -> impl Strategy<Value = Estimate<ALL>> {
    let motion = (vector(100.0), vector(20.0), orientation(), vector(2.0), vector(20.0));
    let rest = (vector(0.5), vector(0.1), vector(30.0), orientation(), proptest::array::uniform32(-0.2..0.2));
    (motion, rest).prop_map(|((position, velocity, world_from_body, angular_velocity, specific_force), rest)| {
        let (accelerometer_bias, gyroscope_bias, way, turn, optional) = rest;
        let keyframe = Keyframe { id: 7, position: position - way, world_from_body: turn * world_from_body };
        let estimate = Estimate {
            time_ns: 0,
            position,
            velocity,
            world_from_body,
            accelerometer_bias,
            gyroscope_bias,
            angular_velocity,
            specific_force,
            acceleration: Vector3::zeros(),
            keyframe: Some(keyframe),
            optional: SVector::from_fn(|i, _| if i < NAVIGATION { 0.0 } else { optional[i % 32] }),
        };
        // The keyframe has no values of its own in this vector.
        estimate.corrected::<All>(&SVector::zeros())
    })
}

/// A level start at rest at the origin, with these deviations of position, velocity and rotation.
fn at_rest(position: f64, velocity: f64, rotation: f64) -> Start {
    let (origin, level) = (Vector3::zeros(), UnitQuaternion::identity());
    Start::at(0, (origin, position), (origin, velocity), (level, rotation))
}

fn started_with<S: States, const N: usize>(params: EskfParams, start: &Start) -> EskfFilter<S, N> {
    let mut filter = EskfFilter::new(params).unwrap();
    filter.start(start).unwrap();
    filter
}

/// A level filter at rest at the origin with a moderate uncertainty.
fn started<S: States, const N: usize>() -> EskfFilter<S, N> {
    started_with(EskfParams::default(), &at_rest(2.0, 0.5, 0.1))
}

/// A flight with turns and accelerations, sampled at 100 Hz.
pub(in crate::navigation) fn sample(i: i64) -> ImuMean {
    let t = i as f64 * 0.01;
    ImuMean {
        time_ns: i * 10_000_000,
        angular_velocity: Vector3::new(0.3 * t.sin(), 0.2 * (1.3 * t).cos(), 0.4 * (0.7 * t).sin()),
        specific_force: Vector3::new(t.cos(), (0.8 * t).sin(), 9.8 + 0.5 * (0.5 * t).sin()),
    }
}
