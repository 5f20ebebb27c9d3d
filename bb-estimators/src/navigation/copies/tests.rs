//! Random drives of a car: what is unknown is found, and what is wrong is not believed for long.

use bb_tests::laws;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::{Copies, Ways};
use crate::navigation::eskf::{EskfFilter, EskfParams, ImuMean, Start};
use crate::navigation::math::wrapped;
use crate::navigation::measurement::{BodyVelocity, GnssPosition, GnssVelocity};
use crate::navigation::noise::Noise;
use crate::navigation::propagate::Propagate;
use crate::navigation::state::{Aided, POSITION, States, Vehicle};
use crate::navigation::stream::Stream;
use crate::navigation::{Fused, GaussMarkov, Optional, Refusal, nees, offset};

const STEP_NS: i64 = 20_000_000;
const STEP_S: f64 = 0.02;
const FIX_M: f64 = 0.5;

/// A car on a plane, and its IMU, which is turned in it.
pub(in crate::navigation) struct Car {
    noise: Noise,
    pub(in crate::navigation) time_ns: i64,
    pub(in crate::navigation) position: Vector3<f64>,
    pub(in crate::navigation) heading: f64,
    pub(in crate::navigation) speed: f64,
    phase: [f64; 4],
    /// The IMU's white noise, rad/s/√Hz and m/s²/√Hz.
    densities: [f64; 2],
    vehicle_from_imu: UnitQuaternion<f64>,
    biases: [Vector3<f64>; 2],
}

impl Car {
    /// Deviations of the biases of the gyroscope, rad/s, and the accelerometer, m/s².
    pub(in crate::navigation) const BIASES: [f64; 2] = [0.005, 0.05];

    pub(in crate::navigation) fn new(seed: u64, densities: [f64; 2], yaw: f64) -> Self {
        let mut noise = Noise::new(seed);
        let phase = core::array::from_fn(|_| noise.between(0.0, 6.0));
        let heading = noise.between(-3.0, 3.0);
        let biases = Self::BIASES.map(|deviation| noise.vector(deviation));
        Self {
            noise,
            time_ns: 0,
            position: Vector3::zeros(),
            heading,
            speed: 8.0,
            phase,
            densities,
            vehicle_from_imu: UnitQuaternion::from_euler_angles(0.0, 0.0, yaw),
            biases,
        }
    }

    pub(in crate::navigation) fn world_from_imu(&self) -> UnitQuaternion<f64> {
        UnitQuaternion::from_euler_angles(0.0, 0.0, self.heading) * self.vehicle_from_imu
    }

    pub(in crate::navigation) fn velocity(&self) -> Vector3<f64> {
        Vector3::new(self.heading.cos(), self.heading.sin(), 0.0) * self.speed
    }

    pub(in crate::navigation) fn start(&self, heading_deviation: f64) -> Start {
        let attitude = UnitQuaternion::from_euler_angles(0.0, 0.0, 0.3) * self.world_from_imu();
        let start = Start::at(self.time_ns, (self.position, 1.0), (self.velocity(), 1.0), (attitude, 0.03));
        let variances = Vector3::new(1e-3, 1e-3, heading_deviation * heading_deviation);
        Start { rotation_covariance: Matrix3::from_diagonal(&variances), ..start }
    }

    /// Drives on, and returns the sample.
    pub(in crate::navigation) fn drive(&mut self) -> ImuMean {
        let t = self.time_ns as f64 * 1e-9;
        let rate = 0.25 * (0.21 * t + self.phase[0]).sin() + 0.1 * (0.53 * t + self.phase[1]).sin();
        let along = 0.8 * (0.17 * t + self.phase[2]).cos() * 0.7;
        let middle = self.heading + 0.5 * rate * STEP_S;
        let direction = Vector3::new(middle.cos(), middle.sin(), 0.0);
        let before = self.velocity();
        self.position += direction * ((self.speed + 0.5 * along * STEP_S) * STEP_S);
        self.heading += rate * STEP_S;
        self.speed += along * STEP_S;
        self.time_ns += STEP_NS;
        let acceleration = (self.velocity() - before) / STEP_S;
        let world_from_imu = UnitQuaternion::from_euler_angles(0.0, 0.0, middle) * self.vehicle_from_imu;
        let force = world_from_imu.inverse() * (acceleration + Vector3::new(0.0, 0.0, 9.80665));
        let white = |density: f64| density / STEP_S.sqrt();
        ImuMean {
            time_ns: self.time_ns,
            angular_velocity: Vector3::new(0.0, 0.0, rate)
                + self.noise.vector(white(self.densities[0]))
                + self.biases[0],
            specific_force: force + self.noise.vector(white(self.densities[1])) + self.biases[1],
        }
    }

    pub(in crate::navigation) fn fix(&mut self) -> GnssPosition {
        GnssPosition::new(self.position + self.noise.vector(FIX_M), FIX_M, FIX_M)
    }

    fn wheels(&mut self) -> BodyVelocity {
        let off = self.noise.vector(0.05);
        self.rolling(&off)
    }

    /// The wheels with this error.
    pub(in crate::navigation) fn rolling(&self, off: &Vector3<f64>) -> BodyVelocity {
        BodyVelocity {
            velocity: Vector3::new(self.speed, 0.0, 0.0) + off,
            deviations: Vector3::new(0.1, 0.1, 0.2),
            body_from_sensor: UnitQuaternion::identity(),
            lever_arm: Vector3::zeros(),
        }
    }
}

/// Copies that know the noise of the car's own IMU, and those of fixes and wheels.
fn copies<S: States, const N: usize>(densities: [f64; 2], mounting: f64, noise: bool) -> Copies<EskfFilter<S, N>> {
    let params = EskfParams {
        gyroscope_noise: densities[0],
        accelerometer_noise: densities[1],
        gnss_delay: GaussMarkov::constant(1e-4),
        wheel_mounting: GaussMarkov::constant(mounting),
        ..EskfParams::default()
    };
    Copies::new(params, Ways { noise, scale: false }).unwrap()
}

/// Copies of a filter in a car, with the stream of its fixes.
struct Driven<S: States, const N: usize> {
    car: Car,
    copies: Copies<EskfFilter<S, N>>,
    gnss: Stream,
}

impl<S: States, const N: usize> Driven<S, N> {
    fn new(car: Car, copies: Copies<EskfFilter<S, N>>, heading_deviation: f64) -> Self {
        let mut driven = Self { car, copies, gnss: Stream::default() };
        driven.copies.start(&driven.car.start(heading_deviation)).unwrap();
        driven
    }

    /// A car with a quiet IMU, whose heading is known to so many radians.
    fn quiet(seed: u64, heading_deviation: f64) -> Self {
        Self::new(Car::new(seed, QUIET, 0.0), copies(QUIET, 0.0, false), heading_deviation)
    }

    /// Drives for some seconds, with a step of 20 ms after each sample.
    fn drive(&mut self, seconds: usize, mut step: impl FnMut(&mut Self, usize)) {
        for number in 1..=50 * seconds {
            self.copies.propagate(&self.car.drive()).unwrap();
            step(self, number);
        }
    }

    /// Drives for some seconds, with a step at the end of each.
    fn by_second(&mut self, seconds: usize, mut step: impl FnMut(&mut Self, usize)) {
        for second in 1..=seconds {
            self.drive(1, |_, _| ());
            step(self, second);
        }
    }

    /// Fuses a position that is this far away.
    fn fix(&mut self, away: &Vector3<f64>) -> Result<Fused, Refusal> {
        let mut fix = self.car.fix();
        fix.position += away;
        self.copies.update_position(&mut self.gnss, &fix)
    }

    fn heading_error(&self) -> f64 {
        let estimate = self.copies.estimate().unwrap();
        (self.car.world_from_imu() * estimate.world_from_body.inverse()).scaled_axis().z
    }
}

type FixedCar = Driven<Aided, { Aided::DIMENSION }>;
type WheelsCar = Driven<Vehicle, { Vehicle::DIMENSION }>;
type Fixed = Copies<EskfFilter<Aided, { Aided::DIMENSION }>>;
type Wheels = Copies<EskfFilter<Vehicle, { Vehicle::DIMENSION }>>;

const QUIET: [f64; 2] = [1e-3, 1e-2];

#[test]
fn an_unknown_heading_is_found_with_an_honest_deviation() {
    let (mut beyond, mut known) = (0, 0);
    for seed in 0..10 {
        let mut driven = FixedCar::quiet(seed, 4.0);
        assert_eq!(driven.copies.starts(), 6);
        driven.by_second(60, |driven, second| {
            assert!(driven.fix(&Vector3::zeros()).is_ok(), "seed {seed}, {second} s");
            let deviation = driven.copies.heading_deviation();
            if deviation < 0.5 {
                known += 1;
                beyond += u32::from(driven.heading_error().abs() > 4.0 * deviation);
            }
        });
        let copies = &driven.copies;
        assert!(driven.heading_error().abs() < 0.1, "seed {seed}");
        assert!(copies.starts() <= 3 && copies.heading_deviation() < 0.1, "seed {seed}: {}", copies.starts());
    }
    assert!(known > 300 && beyond == 0, "{beyond} of {known}");
}

#[test]
fn an_unknown_mounting_on_wheels_is_found_with_the_heading() {
    for (seed, yaw) in [(1, 0.0), (2, 1.6), (3, -2.4), (4, 3.1)] {
        let mut driven = WheelsCar::new(Car::new(seed, QUIET, yaw), copies(QUIET, 4.0, false), 4.0);
        assert_eq!(driven.copies.starts(), 36);
        let mut wheels = Stream::default();
        driven.drive(40, |driven, step| {
            if step % 5 == 0 {
                let _ = driven.copies.update(&mut wheels, &driven.car.wheels());
            }
            if step % 50 == 0 {
                let _ = driven.fix(&Vector3::zeros());
            }
        });
        assert!(driven.heading_error().abs() < 0.05, "yaw {yaw}: {}", driven.heading_error());
        let first = offset::<Vehicle>(Optional::WheelMounting).unwrap();
        let mounting = driven.copies.estimate().unwrap().optional[first];
        assert!(wrapped(mounting - yaw).abs() < 0.05, "yaw {yaw}: {mounting}");
    }
}

/// The data sheet is off by 1/25 to 5: the multiple makes up for it, within a factor of the search's step.
#[test]
fn noise_is_found_whatever_the_data_sheet_says() {
    for (seed, sheet) in [(1, 1.0), (2, 0.2), (3, 0.04)] {
        let real = [3e-3, 5e-2];
        let copies = copies(real.map(|density| density * sheet), 0.0, true);
        let mut driven = FixedCar::new(Car::new(seed, real, 0.0), copies, 0.4);
        let mut sum = 0.0;
        driven.by_second(400, |driven, second| {
            driven.fix(&Vector3::zeros()).unwrap();
            if second > 200 {
                let error = driven.car.position - driven.copies.estimate().unwrap().position;
                let covariance = driven.copies.best().covariance();
                sum += nees(&error, &covariance.fixed_view::<3, 3>(POSITION, POSITION).into_owned()).unwrap();
            }
        });
        let noise = driven.copies.noise();
        assert!((0.24..=17.0).contains(&(noise * sheet)), "sheet {sheet}: {noise}");
        let mean = sum / 200.0;
        assert!((1.0..5.0).contains(&mean), "sheet {sheet}: NEES {mean}");
    }
}

/// A gap in a curve: the error stays within what the filter says of it.
#[test]
fn gaps_are_doubted_as_much_as_they_do_wrong() {
    let (mut beyond, mut gaps) = (0, 0);
    for seed in 0..20 {
        let mut driven = FixedCar::quiet(seed, 0.3);
        let missing = 15 + 20 * usize::try_from(seed % 4).unwrap();
        for step in 1..=120 * 50_usize {
            let sample = driven.car.drive();
            let is_gap = step > 50 * 50 && step % (20 * 50) < missing;
            if !is_gap {
                driven.copies.propagate(&sample).unwrap();
            }
            if step > 50 * 50 && step % (20 * 50) == missing {
                gaps += 1;
                let deviation = driven.copies.heading_deviation();
                beyond += u32::from(driven.heading_error().abs() > 4.0 * deviation);
                assert!(deviation < 1.0, "{deviation}");
            }
            if step % 50 == 0 && !is_gap {
                let _ = driven.fix(&Vector3::zeros());
            }
        }
    }
    assert!(gaps >= 60 && beyond == 0, "{beyond} of {gaps}");
}

/// Fixes that are wrong for less than twenty seconds are refused; those that stay wrong are followed.
#[test]
fn a_newcomer_takes_over_after_twenty_seconds() {
    for (seed, wrong_s, is_followed) in [(1, 10, false), (2, 19, false), (3, 60, true)] {
        let mut driven = FixedCar::quiet(seed, 0.3);
        let mut followed_s = None;
        driven.by_second(180, |driven, second| {
            let is_wrong = (60..60 + wrong_s).contains(&second);
            let away = if is_wrong { Vector3::new(3000.0, -4000.0, 0.0) } else { Vector3::zeros() };
            let result = driven.fix(&away);
            assert!(second >= 60 || result.is_ok(), "{result:?}");
            if is_wrong && result.is_ok() {
                followed_s = followed_s.or(Some(second - 60));
            }
        });
        assert_eq!(followed_s.is_some(), is_followed, "{wrong_s} s");
        assert!(followed_s.is_none_or(|followed_s| followed_s <= 22), "{followed_s:?}");
        // After a minute of wrong ones, the right ones have been those of the newcomer for a minute.
        let off = (driven.copies.estimate().unwrap().position - driven.car.position).norm();
        assert!(off < 2.0, "{wrong_s} s: {off} m off at the end");
        assert_eq!(driven.copies.best().resets(), if is_followed { 3 } else { 1 });
        assert_eq!(driven.copies.elsewhere(), None);
    }
}

#[test]
fn positions_on_another_part_of_the_earth_do_not_move_the_filter() {
    let mut driven = FixedCar::quiet(5, 0.3);
    driven.by_second(60, |driven, second| {
        let _ = driven.fix(&(Vector3::x() * if second > 20 { 3e5 } else { 0.0 }));
    });
    assert!(driven.copies.elsewhere().is_some_and(|distance| distance > 2e5));
}

/// Fixes in two worlds are not compared with each other: their distance is no noise.
#[test]
fn another_world_is_no_scatter_of_fixes() {
    let noise_after = |change: fn(&mut Fixed, &Car, &Vector3<f64>)| {
        let mut driven = FixedCar::quiet(7, 0.3);
        let (mut world, mut noise) = (Vector3::zeros(), 0.0_f64);
        driven.by_second(40, |driven, second| {
            if second == 35 {
                world = Vector3::new(5000.0, 0.0, 0.0);
                change(&mut driven.copies, &driven.car, &world);
            }
            let fix = driven.car.fix();
            let fix = GnssPosition { position: fix.position + world, ..fix };
            if second >= 35 {
                noise = noise.max({ driven.copies.scatter }.fix(&fix).covariance[(0, 0)].sqrt());
            }
            driven.copies.update_fix(&mut driven.gnss, &fix).unwrap();
        });
        noise
    };
    let moved = noise_after(|copies, _, world| copies.move_world(&(*world).into()).unwrap());
    let restarted = noise_after(|copies, car, world| {
        let start = car.start(0.3);
        copies.start(&Start { position: start.position + world, ..start }).unwrap();
    });
    assert!(moved < 2.0 * FIX_M && restarted < 2.0 * FIX_M, "{moved} m, {restarted} m");
}

laws! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// A refusal changes no copy: only the counts, the scatter of fixes and a newcomer.
    #[test]
    fn what_is_refused_changes_nothing(
        seed in 0..1000_u64, heading_deviation in prop_oneof![Just(0.3), Just(4.0)],
        numbers in proptest::collection::vec(prop_oneof![any::<f64>(), -10.0..10.0, -1e5..1e5, Just(f64::NAN)], 12),
        dt_ns in any::<i64>(),
    ) {
        let mut driven = WheelsCar::new(Car::new(seed, QUIET, 0.0), copies(QUIET, 0.1, true), heading_deviation);
        driven.by_second(10, |driven, _| {
            driven.copies.update_fix(&mut driven.gnss, &driven.car.fix()).unwrap();
        });
        let Driven { car, copies, mut gnss } = driven;
        let mut refused = 0;
        let states = |copies: &Wheels| format!("{:?} {:?}", copies.starts, copies.search);
        let vector = |first: usize| Vector3::new(numbers[first], numbers[first + 1], numbers[first + 2]);
        let fix = GnssPosition::new(vector(0), numbers[3], numbers[4]);
        let wheels = BodyVelocity { deviations: vector(5), ..car.rolling(&vector(1)) };
        let velocity = GnssVelocity::new(vector(8), numbers[2], numbers[3]);
        let time_ns = car.time_ns.wrapping_add(dt_ns);
        let sample = ImuMean { time_ns, angular_velocity: vector(3), specific_force: vector(9) };
        type Input<'a> = &'a dyn Fn(&mut Wheels, &mut Stream) -> bool;
        let inputs: [Input<'_>; 5] = [
            &|copies, stream| copies.update_fix(stream, &fix).is_err(),
            &|copies, stream| copies.update_position(stream, &fix).is_err(),
            &|copies, stream| copies.update(stream, &wheels).is_err(),
            &|copies, stream| copies.update(stream, &velocity).is_err(),
            &|copies, _| copies.propagate(&sample).is_err(),
        ];
        for input in inputs {
            let mut after = copies.clone();
            if input(&mut after, &mut gnss) {
                prop_assert_eq!(states(&copies), states(&after));
                refused += 1;
            }
        }
        let counts = gnss.counts();
        prop_assert!(counts.gate + counts.invalid <= refused && counts.gate + counts.invalid + 1 >= refused);
    }
}
