//! Sensors that are wrong for a while, longer than a gate stays closed: what the filter has believed must not outlast them.

use nalgebra::{Vector2, Vector3};

use super::super::{PlanarEkf, PlanarHeading, PlanarParams, PlanarPosition, PlanarStart, WheelVelocity, YawRate};
use crate::navigation::math::{cos, sin, sqrt, wrapped};
use crate::navigation::noise::Noise;
use crate::navigation::{ImuMean, Stream};

const DT: f64 = 0.01;
const WHEELS: f64 = 0.05;
const FIX: f64 = 0.5;
const YAW_RATE: f64 = 0.02;
const HEADING: f64 = 0.05;

/// How a sensor is wrong.
#[derive(Clone, Copy, Debug)]
enum Fault {
    None,
    Offset(f64),
    /// Grows by so much a second.
    Drift(f64),
    /// Repeats its last value.
    Stuck,
    Noise(f64),
}

impl Fault {
    fn random(noise: &mut Noise) -> Self {
        let sign = if noise.between(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 };
        match noise.between(0.0, 6.0) as u8 {
            0 | 1 => Self::None,
            2 => Self::Offset(sign * noise.between(0.1, 3.0)),
            3 => Self::Drift(sign * noise.between(0.03, 0.6)),
            4 => Self::Stuck,
            _ => Self::Noise(noise.between(0.3, 3.0)),
        }
    }
}

/// A drive whose sensors are right, then wrong, and then right again.
#[derive(Clone, Copy, Debug)]
struct Case {
    seed: u64,
    speed: f64,
    /// The yaw rate: its mean, and the amplitude of its change.
    rate: (f64, f64),
    /// Of wheels, yaw rate, fixes in units of 10 m, and heading.
    faults: [Fault; 4],
    /// The direction in which fixes are wrong.
    direction: f64,
    has_heading: bool,
    /// Seconds before and during the fault.
    seconds: (f64, f64),
}

impl Case {
    fn random(seed: u64) -> Self {
        let mut noise = Noise::new(seed);
        let mut between = |low: f64, high: f64| noise.between(low, high);
        let (speed, rate) = (between(0.5, 5.0), (between(-0.2, 0.2), between(0.0, 0.4)));
        let (direction, has_heading) = (between(0.0, core::f64::consts::TAU), between(0.0, 1.0) < 0.3);
        let seconds = (between(5.0, 60.0), between(0.5, 12.0));
        let faults = core::array::from_fn(|_| Fault::random(&mut noise));
        Self { seed, speed, rate, faults, direction, has_heading, seconds }
    }

    /// A circle on which the yaw rate of a second sensor is 0.3 rad/s too large.
    fn circle(seed: u64, wrong_s: f64) -> Self {
        let faults = [Fault::None, Fault::Offset(0.3), Fault::None, Fault::None];
        Self {
            seed,
            speed: 2.0,
            rate: (0.1, 0.0),
            faults,
            direction: 0.0,
            has_heading: false,
            seconds: (60.0, wrong_s),
        }
    }

    /// The errors some time after the sensors are right again.
    fn drive(&self, after_s: f64) -> Driven {
        let mut noise = Noise::new(self.seed ^ 0x5eed);
        let mut filter = PlanarEkf::new(PlanarParams::default()).unwrap();
        let (mut position, mut heading, mut held) = (Vector2::zeros(), 0.3, [0.0; 4]);
        let start = PlanarStart::at(0, (position, 0.5), (heading, 0.05), (Vector2::new(self.speed, 0.0), 0.1));
        filter.start(&start).unwrap();
        let [mut wheels, mut rates, mut gnss, mut compass] = [Stream::default(); 4];
        let end_s = self.seconds.0 + self.seconds.1;
        let mut refused_since = 0;
        let last = ((end_s + after_s) / DT) as i64;
        for i in 1..=last {
            let time_s = i as f64 * DT;
            let rate = self.rate.0 + self.rate.1 * sin(0.4 * time_s);
            let middle = heading + 0.5 * rate * DT;
            position += Vector2::new(cos(middle), sin(middle)) * (self.speed * DT);
            heading += rate * DT;
            let measured = rate + 0.01 + noise.next() * PlanarParams::default().gyroscope_noise / sqrt(DT);
            let angular_velocity = Vector3::new(0.0, 0.0, measured);
            let specific_force = Vector3::zeros();
            filter.propagate(&ImuMean { time_ns: i * 10_000_000, angular_velocity, specific_force }).unwrap();
            let since_s = time_s - self.seconds.0;
            let is_wrong = (0.0..self.seconds.1).contains(&since_s);
            let mut sensed = |sensor: usize, truth: f64, noise: &mut Noise| match self.faults[sensor] {
                _ if !is_wrong => {
                    held[sensor] = truth;
                    truth
                }
                Fault::None => truth,
                Fault::Offset(offset) => truth + offset,
                Fault::Drift(drift) => truth + drift * since_s,
                Fault::Stuck => held[sensor],
                Fault::Noise(deviation) => truth + deviation * noise.next(),
            };
            if i % 10 == 0 {
                let forward = sensed(0, self.speed, &mut noise) + WHEELS * noise.next();
                let velocity = Vector2::new(forward, WHEELS * noise.next());
                let _ = filter.update(&mut wheels, &WheelVelocity::new(velocity, WHEELS));
                let rate = sensed(1, rate, &mut noise) + YAW_RATE * noise.next();
                let _ = filter.update(&mut rates, &YawRate { rate, deviation: YAW_RATE });
            }
            if i % 100 == 0 {
                let wrong = Vector2::new(cos(self.direction), sin(self.direction)) * sensed(2, 0.0, &mut noise);
                let fix = position + wrong * 10.0 + Vector2::new(noise.next(), noise.next()) * FIX;
                let result = filter.update(&mut gnss, &PlanarPosition::new(fix, FIX));
                refused_since += i32::from(since_s > self.seconds.1 && result.is_err());
            }
            if self.has_heading && i % 50 == 0 {
                let heading = sensed(3, heading, &mut noise) + HEADING * noise.next();
                let _ = filter.update(&mut compass, &PlanarHeading { heading, deviation: HEADING });
            }
        }
        let estimate = filter.estimate().unwrap();
        assert!(filter.is_consistent());
        Driven {
            position: (estimate.position - position).norm(),
            heading: wrapped(estimate.heading - heading).abs(),
            deviation: filter.covariance()[(2, 2)].sqrt(),
            refused_since,
        }
    }
}

#[derive(Clone, Copy, Debug)]
struct Driven {
    position: f64,
    heading: f64,
    deviation: f64,
    /// Fixes refused since the sensors are right again.
    refused_since: i32,
}

/// It overrides its gate and is taken for a jump of the bias. What the heading has turned by then is not lost sight of when the bias
/// jumps back.
#[test]
fn the_heading_recovers_from_a_wrong_yaw_rate() {
    for (seed, wrong_s) in (1..=20).flat_map(|seed| [(seed, 3.0), (seed, 10.0)]) {
        let driven = Case::circle(seed, wrong_s).drive(30.0);
        assert!(driven.heading < 0.1 && driven.heading < 4.0 * driven.deviation, "{seed}, {wrong_s} s: {driven:?}");
        assert!(driven.position < 2.0 && driven.refused_since <= 12, "{seed}, {wrong_s} s: {driven:?}");
    }
}

/// The heading says how wrong it may be as soon as the sensor is right again, and not when fixes have shown it.
#[test]
fn a_bias_that_jumps_back_makes_the_heading_uncertain() {
    for (seed, wrong_s) in (1..=20).flat_map(|seed| [(seed, 1.0), (seed, 3.0)]) {
        let driven = Case::circle(seed, wrong_s).drive(0.5);
        assert!(driven.heading > 0.1 && driven.heading < 4.0 * driven.deviation, "{seed}, {wrong_s} s: {driven:?}");
    }
}

/// A small jump of the bias that is two minutes old by then does not hide a large one that is taken back.
#[test]
fn a_small_jump_does_not_hide_a_large_one() {
    let mut filter = PlanarEkf::new(PlanarParams::default()).unwrap();
    filter.start(&PlanarStart::at(0, (Vector2::zeros(), 0.5), (0.0, 0.01), (Vector2::zeros(), 0.1))).unwrap();
    let (mut rates, mut noise, mut heading) = (Stream::default(), Noise::new(3), 0.0);
    for i in 1..=14_000_i64 {
        let time_s = i as f64 * DT;
        let rate = if (122.0..127.0).contains(&time_s) { 0.3 } else { 0.0 };
        let bias = if time_s > 5.0 { 0.02 } else { 0.0 };
        heading += rate * DT;
        let measured = rate + bias + noise.next() * PlanarParams::default().gyroscope_noise / sqrt(DT);
        let (angular_velocity, specific_force) = (Vector3::new(0.0, 0.0, measured), Vector3::zeros());
        filter.propagate(&ImuMean { time_ns: i * 10_000_000, angular_velocity, specific_force }).unwrap();
        if i % 10 == 0 {
            let _ = filter.update(&mut rates, &YawRate { rate: 0.002 * noise.next(), deviation: 0.002 });
        }
    }
    assert!(rates.counts().recoveries >= 3, "{:?}", rates.counts());
    let (error, deviation) = (heading - filter.estimate().unwrap().heading, filter.covariance()[(2, 2)].sqrt());
    assert!(error > 1.0 && error < 4.0 * deviation, "{error} rad, {deviation} rad");
}

/// Of wheels, yaw rates, fixes and headings, any may be wrong in any way for up to twelve seconds.
#[test]
fn whatever_was_wrong_is_over_a_minute_later() {
    let off = |after_s: f64| -> Vec<(Driven, Case)> {
        let cases = (0..200).map(Case::random).map(|case| (case.drive(after_s), case));
        let is_right = |driven: &Driven| {
            driven.position < 2.0 && driven.heading < 0.1 && driven.heading < 4.0 * driven.deviation.max(0.01)
        };
        cases.filter(|(driven, _)| !is_right(driven)).collect()
    };
    let (minute, two) = (off(60.0), off(120.0));
    assert!(minute.len() <= 4, "{}: {minute:?}", minute.len());
    // Where the robot turns fast, or the heading is off by little, fixes take longer to find it.
    assert!(two.len() <= 2 && two.iter().all(|(driven, _)| driven.heading < 0.2), "{}: {two:?}", two.len());
}

/// Nobody says that the filter was started with a wrong heading. Only the way that it makes of the wheels is wrong, fix after fix.
#[test]
fn fixes_find_a_heading_that_is_wrong_for_no_known_reason() {
    for error in [0.3_f64, -1.0, 2.0] {
        let mut filter = PlanarEkf::new(PlanarParams::default()).unwrap();
        let velocity = Vector2::new(2.0, 0.0);
        filter.start(&PlanarStart::at(0, (Vector2::zeros(), 0.5), (error, 0.01), (velocity, 0.1))).unwrap();
        let (mut wheels, mut gnss, mut noise) = (Stream::default(), Stream::default(), Noise::new(7));
        for i in 1..=6000_i64 {
            let (angular_velocity, specific_force) = (Vector3::zeros(), Vector3::zeros());
            filter.propagate(&ImuMean { time_ns: i * 10_000_000, angular_velocity, specific_force }).unwrap();
            if i % 10 == 0 {
                let velocity = velocity + Vector2::new(noise.next(), noise.next()) * WHEELS;
                let _ = filter.update(&mut wheels, &WheelVelocity::new(velocity, WHEELS));
            }
            if i % 100 == 0 {
                let position = Vector2::new(0.02 * i as f64 + FIX * noise.next(), FIX * noise.next());
                let _ = filter.update(&mut gnss, &PlanarPosition::new(position, FIX));
            }
        }
        let heading = filter.estimate().unwrap().heading;
        assert!(heading.abs() < 0.1, "{error} rad: {heading} rad");
    }
}
