//! Copies of the filter with sensors that are wrong for a while: what the filter has believed must not outlast them.

use nalgebra::{Vector2, Vector3};

use super::super::{
    PlanarFilter, PlanarHeading, PlanarParams, PlanarPosition, PlanarStart, WheelVelocity, YawRate,
};
use crate::navigation::copies::{Copies, Ways};
use crate::navigation::math::{cos, sin, sqrt, wrapped};
use crate::navigation::noise::Noise;
use crate::navigation::propagate::Propagate;
use crate::navigation::{Fused, ImuMean, Refusal, Stream};

const DT: f64 = 0.01;
const WHEELS: f64 = 0.05;
const FIX: f64 = 0.5;
const YAW_RATE: f64 = 0.02;
const HEADING: f64 = 0.05;

/// The factor on deviations of readings at 10 Hz whose errors are alike for a second.
const ALIKE: f64 = 4.58;

/// A robot on a plane, and copies of a filter with its wheels and fixes.
struct Ride {
    copies: Copies<PlanarFilter>,
    wheels: Stream,
    gnss: Stream,
    noise: Noise,
    position: Vector2<f64>,
    heading: f64,
    speed: f64,
}

impl Ride {
    /// Starts copies at the origin with a heading and its deviation.
    fn new(noise: Noise, speed: f64, heading: f64, believed: (f64, f64)) -> Self {
        let start = PlanarStart::at(0, (Vector2::zeros(), 0.5), believed, (Vector2::new(speed, 0.0), 0.1));
        let mut copies = Copies::new(PlanarParams::default(), Ways { noise: true, scale: false }).unwrap();
        copies.start(&start).unwrap();
        let [wheels, gnss] = [Stream::default(); 2];
        Self { copies, wheels, gnss, noise, position: Vector2::zeros(), heading, speed }
    }

    /// Drives on to a sample, whose gyroscope is this much off.
    fn drive(&mut self, i: i64, rate: f64, off: f64) {
        let middle = self.heading + 0.5 * rate * DT;
        self.position += Vector2::new(cos(middle), sin(middle)) * (self.speed * DT);
        self.heading += rate * DT;
        let (angular_velocity, specific_force) = (Vector3::new(0.0, 0.0, rate + off), Vector3::zeros());
        self.copies.propagate(&ImuMean { time_ns: i * 10_000_000, angular_velocity, specific_force }).unwrap();
    }

    /// Fuses wheels of this speed with their noise.
    fn roll(&mut self, speed: f64) {
        let velocity = Vector2::new(speed + WHEELS * self.noise.next(), WHEELS * self.noise.next());
        let [own, alike] = [1.0, ALIKE].map(|factor| WheelVelocity::new(velocity, factor * WHEELS));
        let _ = self.copies.update_correlated(&mut self.wheels, &own, &alike);
    }

    /// Fuses a fix that is this far away, with its noise.
    fn fix(&mut self, away: &Vector2<f64>) -> Result<Fused, Refusal> {
        let fix = self.position + away + Vector2::new(self.noise.next(), self.noise.next()) * FIX;
        self.copies.update_fix(&mut self.gnss, &PlanarPosition::new(fix, FIX))
    }
}

/// Fault of a sensor.
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
    /// Faults of wheels, yaw rate, fixes in units of 10 m, and heading.
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

    /// The errors one and two minutes after the sensors are right again.
    fn drive(&self) -> [Driven; 2] {
        let mut ride = Ride::new(Noise::new(self.seed ^ 0x5eed), self.speed, 0.3, (0.3, 0.05));
        let ([mut rates, mut compass], mut held) = ([Stream::default(); 2], [0.0; 4]);
        let end_s = self.seconds.0 + self.seconds.1;
        let seen = [60.0, 120.0].map(|after_s| ((end_s + after_s) / DT) as i64);
        let mut driven = Vec::new();
        for i in 1..=seen[1] {
            let time_s = i as f64 * DT;
            let rate = self.rate.0 + self.rate.1 * sin(0.4 * time_s);
            let off = 0.01 + ride.noise.next() * PlanarParams::default().gyroscope_noise / sqrt(DT);
            ride.drive(i, rate, off);
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
                let forward = sensed(0, self.speed, &mut ride.noise);
                ride.roll(forward);
                let rate = sensed(1, rate, &mut ride.noise) + YAW_RATE * ride.noise.next();
                let [own, alike] = [1.0, ALIKE].map(|factor| YawRate { rate, deviation: factor * YAW_RATE });
                let _ = ride.copies.update_correlated(&mut rates, &own, &alike);
            }
            if i % 100 == 0 {
                let wrong = sensed(2, 0.0, &mut ride.noise) * 10.0;
                let _ = ride.fix(&(Vector2::new(cos(self.direction), sin(self.direction)) * wrong));
            }
            if self.has_heading && i % 50 == 0 {
                let heading = sensed(3, ride.heading, &mut ride.noise) + HEADING * ride.noise.next();
                let _ = ride.copies.update(&mut compass, &PlanarHeading { heading, deviation: HEADING });
            }
            if seen.contains(&i) {
                let estimate = ride.copies.estimate().unwrap();
                assert!(ride.copies.best().is_consistent());
                driven.push(Driven {
                    position: (estimate.position - ride.position).norm(),
                    heading: wrapped(estimate.heading - ride.heading).abs(),
                    deviation: ride.copies.heading_deviation(),
                });
            }
        }
        [driven[0], driven[1]]
    }
}

#[derive(Clone, Copy, Debug)]
struct Driven {
    position: f64,
    heading: f64,
    deviation: f64,
}

/// Sensors that were wrong do no harm a minute later: of wheels, yaw rates, fixes and headings, any may be wrong in any
/// way for up to twelve seconds.
#[test]
fn whatever_was_wrong_is_over_a_minute_later() {
    let cases: Vec<_> = (0..200).map(Case::random).map(|case| (case.drive(), case)).collect();
    let off = |minutes: usize| -> Vec<(Driven, &Case)> {
        let is_right = |driven: &Driven| {
            driven.position < 2.0 && driven.heading < 0.2 && driven.heading < 4.0 * driven.deviation.max(0.01)
        };
        let driven = cases.iter().map(|(driven, case)| (driven[minutes - 1], case));
        driven.filter(|(driven, _)| !is_right(driven)).collect()
    };
    let (minute, two) = (off(1), off(2));
    assert!(minute.len() <= 2, "{}: {minute:?}", minute.len());
    // Where the robot turns fast, or the heading is off by little, fixes take longer to find it.
    assert!(two.len() <= 2 && two.iter().all(|(driven, _)| driven.heading < 0.2), "{}: {two:?}", two.len());
}

/// A heading that nobody knows is found by the way that it makes of the wheels.
#[test]
fn an_unknown_heading_is_found_forwards_and_backwards() {
    for (seed, speed) in (1..=10).flat_map(|seed| [(seed, 2.0), (seed, -1.0)]) {
        let mut noise = Noise::new(seed);
        let heading = noise.between(-3.0, 3.0);
        let mut ride = Ride::new(noise, speed, heading, (0.0, 4.0));
        let mut known_s = None;
        for i in 1..=3000_i64 {
            ride.drive(i, 0.0, 0.0);
            if i % 10 == 0 {
                ride.roll(speed);
            }
            if i % 100 == 0 {
                ride.fix(&Vector2::zeros()).unwrap();
                let deviation = ride.copies.heading_deviation();
                if deviation < 0.5 {
                    known_s = known_s.or(Some(i / 100));
                    let off = wrapped(ride.copies.estimate().unwrap().heading - heading).abs();
                    assert!(off < 4.0 * deviation, "{seed}, {speed} m/s, {i}: {off} of {deviation}");
                }
            }
        }
        assert!(known_s.is_some_and(|known_s| known_s <= 10), "{seed}, {speed} m/s: {known_s:?}");
    }
}

/// Fixes that stay wrong are followed after 20 s, and the true ones again.
#[test]
fn fixes_that_stay_elsewhere_move_the_filter() {
    for (wrong_s, resets) in [(15, 1), (60, 3)] {
        let mut ride = Ride::new(Noise::new(3), 2.0, 0.3, (0.3, 0.05));
        for i in 1..=18_000_i64 {
            ride.drive(i, 0.2 * sin(0.003 * i as f64), 0.0);
            if i % 10 == 0 {
                ride.roll(2.0);
            }
            if i % 100 == 0 {
                let is_wrong = (6000..6000 + 100 * wrong_s).contains(&i);
                let _ = ride.fix(&if is_wrong { Vector2::new(300.0, -400.0) } else { Vector2::zeros() });
            }
        }
        let off = (ride.copies.estimate().unwrap().position - ride.position).norm();
        assert!(off < 1.5, "{wrong_s} s: {off} m");
        assert_eq!(ride.copies.best().resets(), resets, "{wrong_s} s");
    }
}
