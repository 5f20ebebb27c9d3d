//! Laws that hold for the filter with any input.

use core::f64::consts::{PI, TAU};

use bb_tests::laws;
use nalgebra::{Matrix2, Rotation2, Vector2, Vector3};
use proptest::prelude::*;

use super::super::{
    GYROSCOPE_BIAS, HEADING, PlanarFilter, PlanarHeading, PlanarParams, PlanarPose, PlanarPosition, PlanarStart,
    STATES, VELOCITY, WheelVelocity, YawRate,
};
use super::{sample, started, started_with, vector};
use crate::navigation::eskf::tests::open;
use crate::navigation::history::tests::{over_a_gap, replayed};
use crate::navigation::math::wrapped;
use crate::navigation::{Fused, History, ImuMean, Refusal, Replayed, Stream};

/// Three seconds with wheels, fixes, headings and poses, in a world that is rotated and shifted.
fn drive(turn: f64, shift: Vector2<f64>) -> PlanarFilter {
    let rotation = Rotation2::new(turn);
    let to_world = |point: Vector2<f64>| rotation * point + shift;
    let start =
        PlanarStart::at(0, (to_world(Vector2::zeros()), 2.0), (0.3 + turn, 0.2), (Vector2::new(2.0, 0.0), 0.5));
    let mut filter = started_with(PlanarParams::default(), &start);
    let mut stream = open();
    let noise = Matrix2::new(1.0, 0.4, 0.4, 2.0);
    for i in 1..=300 {
        filter.propagate(&sample(i)).unwrap();
        let t = i as f64 * 0.01;
        if i % 5 == 0 {
            let velocity = Vector2::new(2.0 + 0.2 * t.sin(), 0.03);
            let lever_arm = Vector2::new(0.2, -0.1);
            filter.update(&mut stream, &WheelVelocity { lever_arm, ..WheelVelocity::new(velocity, 0.1) }).unwrap();
            filter.update(&mut stream, &YawRate { rate: 0.4 * (0.7 * t).sin() + 0.01, deviation: 0.05 }).unwrap();
        }
        if i % 50 == 0 {
            let covariance = rotation * noise * rotation.inverse();
            let position = to_world(Vector2::new(2.0 * t, 0.3 * t * t));
            let fix = PlanarPosition { position, covariance, lever_arm: Vector2::new(-0.5, 0.2) };
            filter.update(&mut stream, &fix).unwrap();
            filter.update(&mut stream, &PlanarHeading { heading: turn + 0.3 + 7.0 * TAU, deviation: 0.2 }).unwrap();
            let mut covariance = nalgebra::Matrix3::identity();
            covariance[(2, 2)] = 0.1;
            filter.update(&mut stream, &PlanarPose { position, heading: turn + 0.4, covariance }).unwrap();
        }
    }
    filter
}

laws! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn the_worlds_heading_and_origin_do_not_matter(turn in -6.0..6.0, shift in vector(1000.0)) {
        let (plain, moved) = (drive(0.0, Vector2::zeros()), drive(turn, shift));
        let rotation = Rotation2::new(turn);
        let turned = |filter: &PlanarFilter, rotation: &Rotation2<f64>| -> Matrix2<f64> {
            let block = filter.covariance().fixed_view::<2, 2>(0, 0).into_owned();
            rotation * block * rotation.inverse()
        };
        prop_assert!((turned(&plain, &rotation) - turned(&moved, &Rotation2::identity())).amax() < 1e-8);
        for state in [HEADING, VELOCITY, VELOCITY + 1, GYROSCOPE_BIAS] {
            let at = (state, state);
            prop_assert!((plain.covariance()[at] - moved.covariance()[at]).abs() < 1e-9);
        }
        let (plain, moved) = (plain.estimate().unwrap(), moved.estimate().unwrap());
        prop_assert!((rotation * plain.position + shift - moved.position).norm() < 1e-8);
        prop_assert!(wrapped(plain.heading + turn - moved.heading).abs() < 1e-9);
        prop_assert!((plain.velocity - moved.velocity).norm() < 1e-9);
        prop_assert!((plain.gyroscope_bias - moved.gyroscope_bias).abs() < 1e-10);
        prop_assert!((plain.wheel_scale - moved.wheel_scale).abs() < 1e-10);
    }

    #[test]
    fn what_is_refused_changes_nothing_and_is_counted(
        numbers in proptest::collection::vec(
            prop_oneof![any::<f64>(), -10.0..10.0, Just(f64::NAN), Just(f64::INFINITY)], 12,
        ),
        time_ns in any::<i64>(),
    ) {
        let mut filter = started();
        for i in 1..20 {
            filter.propagate(&sample(i)).unwrap();
        }
        let mut stream = Stream::default();
        let pair = |from: usize| Vector2::new(numbers[from], numbers[from + 1]);
        let angular_velocity = Vector3::new(numbers[0], numbers[1], numbers[2]);
        let before = filter;
        if filter.propagate(&ImuMean { time_ns, angular_velocity, specific_force: Vector3::repeat(numbers[3]) }).is_err() {
            prop_assert_eq!(&filter, &before);
        }
        type Update<'a> = &'a dyn Fn(&mut PlanarFilter, &mut Stream) -> Result<Fused, Refusal>;
        let fix = PlanarPosition { lever_arm: pair(6), ..PlanarPosition::new(pair(4), numbers[8]) };
        let wheels = WheelVelocity { lever_arm: pair(2), ..WheelVelocity::new(pair(9), numbers[0]) };
        let heading = PlanarHeading { heading: numbers[11], deviation: numbers[5] };
        let rate = YawRate { rate: numbers[7], deviation: numbers[1] };
        let all: [Update<'_>; 4] = [
            &|filter, stream| filter.update(stream, &fix), &|filter, stream| filter.update(stream, &wheels),
            &|filter, stream| filter.update(stream, &heading), &|filter, stream| filter.update(stream, &rate),
        ];
        for update in all {
            let before = filter;
            if update(&mut filter, &mut stream).is_err() {
                prop_assert_eq!(&filter, &before);
            }
        }
        let estimate = filter.estimate().unwrap();
        prop_assert!(estimate.position.iter().all(|x| x.is_finite()) && filter.is_consistent());
        prop_assert!((-PI..=PI).contains(&estimate.heading));
        prop_assert_eq!(filter.covariance(), &filter.covariance().transpose());
        let counts = stream.counts();
        prop_assert_eq!(counts.fused + counts.gate + counts.invalid, 4);
    }

    /// Fixes at sample ends that arrive this many samples late: the result equals that of arrival in order, bit for bit.
    #[test]
    fn late_and_out_of_order_is_as_in_order(
        fixes in proptest::collection::btree_map(1..119_i64, (0..60_i64, -9.0..9.0), 1..30),
    ) {
        const SAMPLES: i64 = 120;
        let drive = |delayed: i64| {
            let one = |(taken, (delay, value)): (&i64, &(i64, f64))| {
                let fix = PlanarPosition::new(Vector2::new(*value, -value), 1.0);
                ((taken + delayed * delay).min(SAMPLES), taken * 10_000_000, fix)
            };
            replayed(fixed(0), SAMPLES, sample, fixes.iter().map(one).collect()).now().clone()
        };
        prop_assert_eq!(drive(0), drive(1));
    }

    /// Nearly exact measurements and nearly uninformative ones, in any order.
    #[test]
    fn the_covariance_stays_positive_definite(
        steps in proptest::collection::vec((0..5_u8, -8.0..3.0), 100..400),
    ) {
        let start = PlanarStart::at(0, (Vector2::zeros(), 1e5), (0.0, 3.0), (Vector2::zeros(), 1e3));
        let mut filter = started_with(PlanarParams::default(), &start);
        let mut stream = open();
        for (i, (kind, exponent)) in (1..).zip(steps) {
            filter.propagate(&sample(i)).unwrap();
            let deviation = 10_f64.powf(exponent);
            let fused = match kind {
                0 => filter.update(&mut stream, &PlanarPosition::new(Vector2::zeros(), deviation)),
                1 => filter.update(&mut stream, &WheelVelocity::new(Vector2::zeros(), deviation)),
                2 => filter.update(&mut stream, &YawRate { rate: 0.0, deviation }),
                3 => filter.update(&mut stream, &PlanarHeading { heading: 0.0, deviation }),
                _ => continue,
            };
            prop_assert!(fused.is_ok(), "{fused:?}");
            prop_assert!(filter.is_consistent(), "after {i} samples");
        }
        prop_assert_eq!(filter.repairs(), 0);
        prop_assert_eq!(filter.covariance(), &filter.covariance().transpose());
        prop_assert_eq!(filter.covariance().nrows(), STATES);
    }
}

#[derive(Clone, Debug, PartialEq)]
struct Fixed {
    filter: PlanarFilter,
    stream: Stream,
}

fn fixed(hold_ns: i64) -> History<Fixed, 150, 50, 6> {
    History::new(Fixed { filter: started(), stream: Stream::default() }, hold_ns).unwrap()
}

impl Replayed for Fixed {
    type Filter = PlanarFilter;
    type Measurement = PlanarPosition;

    fn filter(&self) -> &PlanarFilter {
        &self.filter
    }

    fn filter_mut(&mut self) -> &mut PlanarFilter {
        &mut self.filter
    }

    fn update(&mut self, measurement: &PlanarPosition) -> Result<Fused, Refusal> {
        self.filter.update(&mut self.stream, measurement)
    }
}

/// The gyroscope is silent for half a second, and fixes that say next to nothing divide the gap into parts that are shorter than a
/// sample may be.
#[test]
fn a_gap_that_fixes_divide_is_a_gap() {
    let fix = PlanarPosition::new(Vector2::zeros(), 1e6);
    let fixes: Vec<_> = (21..70).step_by(5).map(|taken| (taken * 10_000_000, fix)).collect();
    let after = |fixes: &[_], is_late| over_a_gap(fixed(500_000_000), (20, 70), sample, fixes, is_late);
    let (whole, divided) = (after(&[], false), after(&fixes, false));
    assert_eq!(divided, after(&fixes, true));
    assert_eq!((whole.filter.gaps(), divided.filter.gaps()), (1, 11));
    for i in HEADING..=VELOCITY + 1 {
        let (whole, divided) = (whole.filter.covariance()[(i, i)], divided.filter.covariance()[(i, i)]);
        assert!((0.99 * whole..1.01 * whole).contains(&divided), "{i}: {whole} and {divided}");
    }
}
