//! Laws of the filter that `Eskf` runs: copies with their streams, through a history, on random drives of a car.

use super::filter::Measured;
use super::input::keyframe_at;
use super::life::{Limits, Running, Sensed};
use super::options::NavigationOptions;
use crate::navigation::copies::tests::Car;
use crate::navigation::eskf::{EskfFilter, ImuMean, Start};
use crate::navigation::measurement::{BarometricHeight, GnssHeading, GnssPosition, GnssVelocity, RelativePose};
use crate::navigation::nees;
use crate::navigation::noise::Noise;
use crate::navigation::state::{Aided, Complete, POSITION, States};
use bb_tests::laws;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use proptest::prelude::*;

const STEP_NS: i64 = 20_000_000;
const STATES: usize = 8;

type OfFixes = Running<EskfFilter<Aided, { Aided::DIMENSION }>, STATES>;
type OfAll = Running<EskfFilter<Complete, { Complete::DIMENSION }>, STATES>;

fn running<S: States + Send, const N: usize>(
    options: &NavigationOptions,
    start: &Start,
) -> Running<EskfFilter<S, N>, STATES> {
    let limits = Limits { dead_reckoning_s: None, deviation: 1e6 };
    let sensed = Sensed::new(options.params(), start, options.odometry_correlation).unwrap();
    Running::new(sensed, limits, None).unwrap()
}

/// Mean NEES of the position of one drive, after half a minute, with sensors whose noise is what their data sheets say: an IMU of a random
/// grade, fixes of random noise, rate and delay, that also arrive late.
fn nees_of_a_drive(seed: u64) -> f64 {
    let mut noise = Noise::new(seed);
    let mut scale = |low: f64, high: f64| (low.ln() + (high / low).ln() * noise.between(0.0, 1.0)).exp();
    let densities = [scale(3e-4, 3e-3), scale(3e-3, 3e-2)];
    let (fix_m, heading_deviation) = (scale(0.1, 3.0), scale(0.05, 0.45));
    let apart = [10, 25, 50, 100][noise.between(0.0, 4.0) as usize];
    let (delay_s, late) = (0.05 * noise.next(), noise.between(0.0, 30.0) as i64);
    let mut car = Car::new(seed, densities, 0.0);
    let options = NavigationOptions {
        gyroscope_noise: densities[0],
        accelerometer_noise: densities[1],
        gnss_delay: 0.05,
        ..NavigationOptions::default()
    };
    let deviations = Vector3::new(0.02, 0.02, heading_deviation);
    let turn = UnitQuaternion::from_scaled_axis(noise.vector(1.0).component_mul(&deviations));
    let start = Start {
        rotation_covariance: Matrix3::from_diagonal(&deviations.component_mul(&deviations)),
        gyroscope_bias_deviation: Car::BIASES[0],
        accelerometer_bias_deviation: Car::BIASES[1],
        ..Start::at(
            0,
            (car.position + noise.vector(1.0), 1.0),
            (car.velocity() + noise.vector(0.5), 0.5),
            (turn * car.world_from_imu(), 0.02),
        )
    };
    let mut running: OfFixes = running(&options, &start);
    let (mut way, mut waiting) = (vec![car.position], Vec::new());
    let (mut sum, mut count) = (0.0, 0.0);
    for step in 1..=100 * 50_i64 {
        let sample = car.drive();
        way.push(car.position);
        running.past.propagate(&sample).unwrap();
        if step % apart == 0 && step > 50 {
            // Between two samples, it is as good as straight on.
            let ahead = way[way.len() - 1] + car.velocity() * -delay_s;
            let back = (delay_s * 50.0).floor();
            let place = way
                .get((step as f64 - back) as usize)
                .map_or(ahead, |place| place + car.velocity() * (back / 50.0 - delay_s));
            waiting.push((step + late, GnssPosition::new(place + noise.vector(fix_m), fix_m, fix_m)));
        }
        waiting.retain(|(arrives, fix)| {
            if *arrives == step {
                running.fuse((step - late) * STEP_NS, Measured::Gnss(*fix));
            }
            *arrives != step
        });
        if step > 30 * 50 && step % 50 == 0 {
            let now = running.now();
            let error = now.copies.estimate().unwrap().position - car.position;
            let covariance = now.best().covariance().fixed_view::<3, 3>(POSITION, POSITION).into_owned();
            sum += nees(&error, &covariance).unwrap();
            count += 1.0;
        }
    }
    sum / count
}

#[test]
fn errors_are_as_large_as_the_filter_says() {
    let drives = 200;
    let mean = (0..drives).map(nees_of_a_drive).sum::<f64>() / drives as f64;
    println!("NEES of the position over {drives} drives: {mean}");
    assert!((2.5..3.6).contains(&mean), "NEES {mean}");
}

/// A measurement of some kind, whose error is `off` times a deviation.
///
/// A relative pose is since `since_ns`.
fn measured(kind: usize, car: &Car, off: f64, since_ns: i64, at_ns: i64) -> Measured {
    let off = Vector3::new(off, -off, 0.5 * off);
    match kind {
        0 => Measured::Gnss(GnssPosition::new(car.position + off, 1.0, 1.0)),
        1 => Measured::GnssVelocity(GnssVelocity::new(car.velocity() + off * 0.2, 0.2, 0.2)),
        2 => {
            let heading = car.heading + 0.02 * off.x;
            Measured::GnssHeading(GnssHeading { heading, deviation: 0.02, baseline: Vector3::x() })
        }
        3 => Measured::Pressure(BarometricHeight { height: off.z, deviation: 0.5 }),
        4 => {
            let way = Vector3::new(car.speed * (at_ns - since_ns) as f64 * 1e-9, 0.0, 0.0) + off * 0.05;
            let relative =
                RelativePose::new(keyframe_at(since_ns), (way, 0.05), (UnitQuaternion::identity(), 0.05));
            Measured::Relative(relative, at_ns)
        }
        _ => Measured::Odometry(car.rolling(&(off * 0.1))),
    }
}

/// The filter after a drive of six seconds with an unknown heading and mounting, with measurements that arrive some samples after the one
/// that follows them.
fn driven(seed: u64, taken: &[(i64, i64, usize, f64)], delayed: i64) -> OfAll {
    let mut car = Car::new(seed, [1e-3, 1e-2], 0.4);
    let mut running: OfAll = running(&NavigationOptions::default(), &car.start(4.0));
    let (last, mut since_ns, mut waiting) = (300, 0, Vec::new());
    for step in 1..=last {
        let sample = car.drive();
        running.past.propagate(&sample).unwrap();
        for (at_ns, delay, kind, off) in taken.iter().filter(|(at_ns, ..)| (at_ns + STEP_NS - 1) / STEP_NS == step)
        {
            let arrives = (step + delayed * delay).min(last);
            waiting.push((arrives, *at_ns, measured(*kind, &car, *off, since_ns, *at_ns)));
            since_ns = if *kind == 4 { *at_ns } else { since_ns };
        }
        for (_, at_ns, measured) in waiting.extract_if(.., |(arrives, ..)| *arrives <= step) {
            running.fuse(at_ns, measured);
        }
    }
    assert_eq!(running.past.arrivals().too_old, 0);
    running
}

/// Fixes of a drive in a world that is turned and moved: the errors in that of the car.
fn errors_in(seed: u64, turn: &UnitQuaternion<f64>, shift: &Vector3<f64>) -> Vec<[Vector3<f64>; 3]> {
    let mut car = Car::new(seed, [1e-3, 1e-2], 0.0);
    let start = car.start(0.3);
    let start = Start {
        position: turn * start.position + shift,
        velocity: turn * start.velocity,
        world_from_body: turn * start.world_from_body,
        ..start
    };
    let mut running: OfFixes = running(&NavigationOptions::default(), &start);
    let mut errors = Vec::new();
    for step in 1..=30 * 50 {
        let sample: ImuMean = car.drive();
        running.past.propagate(&sample).unwrap();
        if step % 50 == 0 {
            let fix = car.fix();
            let fix = GnssPosition { position: turn * fix.position + shift, ..fix };
            running.fuse(car.time_ns, Measured::Gnss(fix));
            let at = running.now().copies.estimate().unwrap();
            let attitude = turn.inverse() * at.world_from_body;
            errors.push([
                turn.inverse() * (at.position - shift) - car.position,
                turn.inverse() * at.velocity - car.velocity(),
                (attitude * car.world_from_imu().inverse()).scaled_axis(),
            ]);
        }
    }
    errors
}

laws! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// Equality to the last bit, whatever is fused, refused, or founds a newcomer.
    #[test]
    fn late_and_out_of_order_is_as_in_order(
        seed in 0..1000_u64,
        taken in proptest::collection::btree_map(
            1..298 * STEP_NS, (0..90_i64, 0..6_usize, prop_oneof![4 => -3.0..3.0, 1 => -3000.0..3000.0]), 1..60,
        ),
    ) {
        // Two with the same stamp are fused in the order of their arrival.
        let taken: Vec<_> = taken.into_iter().map(|(at_ns, (delay, kind, off))| (at_ns, delay, kind, off)).collect();
        let [in_order, late] = [0, 1].map(|delayed| format!("{:?}", driven(seed, &taken, delayed).now()));
        prop_assert_eq!(in_order, late);
    }

    /// Errors from a known start.
    #[test]
    fn the_worlds_heading_and_origin_do_not_matter(
        seed in 0..1000_u64, heading in -3.0..3.0, x in -5000.0..5000.0, y in -5000.0..5000.0, z in -500.0..500.0,
    ) {
        let turn = UnitQuaternion::from_euler_angles(0.0, 0.0, heading);
        let plain = errors_in(seed, &UnitQuaternion::identity(), &Vector3::zeros());
        let moved = errors_in(seed, &turn, &Vector3::new(x, y, z));
        for (plain, moved) in plain.iter().zip(&moved) {
            for (plain, moved) in plain.iter().zip(moved) {
                prop_assert!((plain - moved).norm() < 1e-7, "{plain} and {moved}");
            }
        }
    }
}
