//! Motions of the bodies.
//!
//! The world is east, north, up, the body forward, left, up. Orientation and acceleration are functions of time in closed
//! form.

use super::GRAVITY;
use super::profile::Profile;
use crate::variants::Random;
use bb_core::nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use std::f64::consts::{FRAC_PI_2, TAU};

/// A function of time in s.
type OverTime<T> = Box<dyn Fn(f64) -> T>;

/// A magnetic field as a function of the position.
type Disturbance = Box<dyn Fn(&Vector3<f64>) -> Vector3<f64>>;

/// The motion of a body, and the disturbances of its sensors.
pub(super) struct Motion {
    /// Samples per second.
    pub(super) rate: f64,
    pub(super) length_s: f64,
    /// Initial time of rest, after which errors count.
    pub(super) rest_s: f64,
    /// The orientation, `world_from_body`.
    pub(super) rotation: OverTime<UnitQuaternion<f64>>,
    /// The acceleration in the world without gravity, m/s².
    pub(super) acceleration: OverTime<Vector3<f64>>,
    /// The velocity in the world, m/s; `None` if the body stays near its place.
    pub(super) velocity: Option<OverTime<Vector3<f64>>>,
    /// The standard deviation of the vibration on each axis of the accelerometer, m/s².
    pub(super) vibration: f64,
    /// The field of iron at a place of the world, T.
    pub(super) disturbance: Disturbance,
    /// The drift of the gyroscope's bias, rad/s.
    pub(super) bias: OverTime<f64>,
}

/// Initial time of rest of every body but the walker, s.
const REST_S: f64 = 10.0;

/// A course over ground.
#[derive(Clone, Default)]
struct Course {
    /// Speed, m/s.
    speed: Profile,
    /// Angular velocity to the left, rad/s.
    turn: Profile,
    /// Initial heading, rad from east to north.
    start: f64,
}

impl Course {
    fn direction(&self, time_s: f64) -> f64 {
        self.start + self.turn.integral(time_s)
    }

    fn velocity(&self, time_s: f64) -> Vector3<f64> {
        let (sin, cos) = self.direction(time_s).sin_cos();
        Vector3::new(cos, sin, 0.0) * self.speed.value(time_s)
    }

    /// The accelerations forward and to the left, m/s².
    fn accelerations(&self, time_s: f64) -> (f64, f64) {
        (self.speed.slope(time_s), self.speed.value(time_s) * self.turn.value(time_s))
    }

    fn acceleration(&self, time_s: f64) -> Vector3<f64> {
        let (forward, left) = self.accelerations(time_s);
        let (sin, cos) = self.direction(time_s).sin_cos();
        Vector3::new(forward * cos - left * sin, forward * sin + left * cos, 0.0)
    }

    /// Creates a motion along the course. `tilt` returns roll and pitch for a time and the accelerations forward and to the left.
    fn motion(self, rate: f64, length_s: f64, tilt: impl Fn(f64, (f64, f64)) -> (f64, f64) + 'static) -> Motion {
        let (other, third) = (self.clone(), self.clone());
        Motion {
            rate,
            length_s,
            rest_s: REST_S,
            rotation: Box::new(move |time_s| {
                let (roll, pitch) = tilt(time_s, self.accelerations(time_s));
                UnitQuaternion::from_euler_angles(roll, pitch, self.direction(time_s))
            }),
            acceleration: Box::new(move |time_s| other.acceleration(time_s)),
            velocity: Some(Box::new(move |time_s| third.velocity(time_s))),
            vibration: 0.0,
            disturbance: Box::new(|_| Vector3::zeros()),
            bias: Box::new(|_| 0.0),
        }
    }
}

/// A sum of sines: amplitude, frequency in Hz, phase.
#[derive(Clone)]
struct Sines(Vec<(f64, f64, f64)>);

impl Sines {
    fn new(random: &mut Random, sines: &[(f64, f64)]) -> Self {
        Self(sines.iter().map(|(size, frequency)| (*size, *frequency, random.uniform((0.0, TAU)))).collect())
    }

    fn at(&self, time_s: f64) -> f64 {
        self.0.iter().map(|(size, frequency, phase)| size * (TAU * frequency * time_s + phase).sin()).sum()
    }
}

/// A ramp from 0 at the end of the rest to 1, by which motions begin smoothly.
fn ramp(rest_s: f64, within_s: f64) -> Profile {
    let mut ramp = Profile::default();
    ramp.step(rest_s, within_s, 1.0);
    ramp
}

/// Six minutes of a plane that accelerates to 25 m/s on the runway, and flies circles of 120 m to the left, then to the right,
/// in coordinated turns.
pub(super) fn plane(rate: f64, random: &mut Random) -> Motion {
    const SPEED: f64 = 25.0;
    const RADIUS: f64 = 120.0;
    let mut course = Course { start: random.uniform((0.0, TAU)), ..Course::default() };
    course.speed.step(REST_S, 12.0, SPEED);
    for (begins_s, ends_s, side) in [(40.0, 190.0, 1.0), (205.0, 360.0, -1.0)] {
        course.turn.step(begins_s, 4.0, side * SPEED / RADIUS);
        course.turn.step(ends_s, 4.0, -side * SPEED / RADIUS);
    }
    let (flies, roll, pitch) = (
        ramp(REST_S + 12.0, 5.0),
        Sines::new(random, &[(0.03, 0.31), (0.02, 0.87)]),
        Sines::new(random, &[(0.02, 0.23), (0.015, 0.71)]),
    );
    let tilt = move |time_s: f64, (_, left): (f64, f64)| {
        let flies = flies.value(time_s);
        let bank = -(left / GRAVITY).atan();
        (bank + flies * roll.at(time_s), flies * (pitch.at(time_s) - 0.05))
    };
    Motion { vibration: 0.5, ..course.motion(rate, 360.0, tilt) }
}

/// Ten minutes of a car in a town: roundabouts of 20 m at 8 m/s, and stops at 0.35 g.
pub(super) fn car(random: &mut Random) -> Motion {
    const BRAKE: f64 = 0.35 * GRAVITY;
    const RADIUS: f64 = 20.0;
    /// Ratio of the largest slope of a step to its mean slope.
    const STEEPEST: f64 = 1.875;
    let mut course = Course { start: random.uniform((0.0, TAU)), ..Course::default() };
    let mut time_s = REST_S;
    while time_s < 560.0 {
        course.speed.step(time_s, 8.0, 14.0);
        time_s += 8.0 + random.uniform((2.0, 12.0));
        let slowed_s = STEEPEST * 6.0 / BRAKE;
        course.speed.step(time_s, slowed_s, -6.0);
        time_s += slowed_s;
        // To the left through the roundabout, between bends to the right into and out of it.
        let through_s = random.uniform((6.0, 14.0));
        for (length_s, side) in [(1.0, -1.0), (through_s, 1.0), (1.0, -1.0)] {
            course.turn.step(time_s, 1.0, side * 8.0 / RADIUS);
            course.turn.step(time_s + length_s, 1.0, -side * 8.0 / RADIUS);
            time_s += length_s + 1.0;
        }
        course.speed.step(time_s, 4.0, 6.0);
        time_s += 4.0 + random.uniform((2.0, 12.0));
        let stopped_s = STEEPEST * 14.0 / BRAKE;
        course.speed.step(time_s, stopped_s, -14.0);
        time_s += stopped_s + random.uniform((2.0, 10.0));
    }
    let (moves, roll, pitch) = (
        course.speed.clone(),
        Sines::new(random, &[(0.006, 0.9), (0.004, 2.3)]),
        Sines::new(random, &[(0.006, 1.1), (0.004, 2.7)]),
    );
    // The springs yield: outwards in a turn, and nose down under braking.
    let tilt = move |time_s: f64, (forward, left): (f64, f64)| {
        let rough = moves.value(time_s) / 14.0;
        (0.012 * left + rough * roll.at(time_s), -0.008 * forward + rough * pitch.at(time_s))
    };
    Motion { vibration: 0.2, ..course.motion(100.0, 600.0, tilt) }
}

/// Ten minutes of a boat in swell.
pub(super) fn boat(random: &mut Random) -> Motion {
    const SWELL: f64 = 0.15;
    let direction = random.uniform((0.0, TAU));
    let ramp = ramp(REST_S, 10.0);
    // Swell comes in groups: the frequencies beside the main one make its height vary.
    let swell = |random: &mut Random, size: f64| {
        Sines::new(random, &[(0.75 * size, SWELL), (0.25 * size, 0.9 * SWELL), (0.1 * size, 2.1 * SWELL)])
    };
    let (roll, pitch) = (swell(random, 15_f64.to_radians()), swell(random, 5_f64.to_radians()));
    let (surge, sway, heave) = (swell(random, 1.0), swell(random, 0.4), swell(random, 0.5));
    let yaw = Sines::new(random, &[(0.6, 0.004), (0.12, 0.07), (0.03, SWELL)]);
    let (also_ramp, first, also_yaw) = (ramp.clone(), yaw.at(0.0), yaw.clone());
    Motion {
        rate: 100.0,
        length_s: 600.0,
        rest_s: REST_S,
        rotation: Box::new(move |time_s| {
            let begun = ramp.value(time_s);
            UnitQuaternion::from_euler_angles(
                begun * roll.at(time_s),
                begun * pitch.at(time_s),
                direction + begun * (yaw.at(time_s) - first),
            )
        }),
        acceleration: Box::new(move |time_s| {
            let begun = also_ramp.value(time_s);
            let heading = direction + begun * (also_yaw.at(time_s) - first);
            let along = Vector3::new(surge.at(time_s), sway.at(time_s), heave.at(time_s));
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading) * along * begun
        }),
        velocity: None,
        vibration: 0.1,
        disturbance: Box::new(|_| Vector3::zeros()),
        bias: Box::new(|_| 0.0),
    }
}

/// Five minutes of a multirotor, whose thrust is along its vertical axis, so that its accelerometer always shows it
/// level.
pub(super) fn drone(random: &mut Random) -> Motion {
    let start = ramp(REST_S, 5.0);
    let east = Sines::new(random, &[(1.5, 1.0 / 23.0), (0.8, 1.0 / 7.0)]);
    let north = Sines::new(random, &[(1.9, 1.0 / 40.0), (2.4, 1.0 / 11.0)]);
    let up = Sines::new(random, &[(0.4, 1.0 / 31.0), (1.4, 1.0 / 9.0)]);
    let yaw = Sines::new(random, &[(1.5, 1.0 / 47.0), (0.4, 1.0 / 13.0)]);
    let wobble = [Sines::new(random, &[(0.035, 1.3)]), Sines::new(random, &[(0.035, 0.7)])];
    let acceleration =
        move |time_s: f64| Vector3::new(east.at(time_s), north.at(time_s), up.at(time_s)) * start.value(time_s);
    let (thrust, start) = (acceleration.clone(), ramp(REST_S, 5.0));
    Motion {
        rate: 200.0,
        length_s: 300.0,
        rest_s: REST_S,
        rotation: Box::new(move |time_s| {
            let up = (thrust(time_s) + Vector3::z() * GRAVITY).normalize();
            let (sin, cos) = yaw.at(time_s).sin_cos();
            let left = up.cross(&Vector3::new(cos, sin, 0.0)).normalize();
            let axes = Matrix3::from_columns(&[left.cross(&up), left, up]);
            let [roll, pitch] = wobble.each_ref().map(|sines| start.value(time_s) * sines.at(time_s));
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes))
                * UnitQuaternion::from_euler_angles(roll, pitch, 0.0)
        }),
        acceleration: Box::new(acceleration),
        velocity: None,
        vibration: 0.5,
        disturbance: Box::new(|_| Vector3::zeros()),
        bias: Box::new(|_| 0.0),
    }
}

/// Five minutes of a phone in the swinging hand of a walker, who turns corners and walks from the first sample on.
pub(super) fn walker(random: &mut Random) -> Motion {
    const STEPS: f64 = 1.8;
    let mut turn = Profile::default();
    let mut time_s = 5.0;
    while time_s < 300.0 {
        let angle = random.uniform((-FRAC_PI_2, FRAC_PI_2));
        turn.step(time_s, 0.8, angle);
        turn.step(time_s + 0.8, 0.8, -angle);
        time_s += random.uniform((6.0, 20.0));
    }
    let start = random.uniform((0.0, TAU));
    let held = UnitQuaternion::from_euler_angles(random.uniform((-1.0, 1.0)), random.uniform((-1.0, 1.0)), 0.5);
    let swing = Sines::new(random, &[(0.35, 0.5 * STEPS), (0.05, STEPS)]);
    let roll = Sines::new(random, &[(0.1, 0.5 * STEPS), (0.05, 0.37)]);
    let yaw = Sines::new(random, &[(0.12, 0.5 * STEPS), (0.1, 0.21)]);
    let up = Sines::new(random, &[(3.0, STEPS), (1.0, 2.0 * STEPS)]);
    let forward = Sines::new(random, &[(1.5, STEPS), (2.0, 0.5 * STEPS)]);
    let left = Sines::new(random, &[(1.0, 0.5 * STEPS)]);
    let other = turn.clone();
    Motion {
        rate: 100.0,
        length_s: 300.0,
        rest_s: 0.0,
        rotation: Box::new(move |time_s| {
            let yaw = start + turn.integral(time_s) + yaw.at(time_s);
            UnitQuaternion::from_euler_angles(roll.at(time_s), swing.at(time_s), yaw) * held
        }),
        acceleration: Box::new(move |time_s| {
            let (sin, cos) = (start + other.integral(time_s)).sin_cos();
            let (ahead, aside) = (forward.at(time_s), left.at(time_s));
            Vector3::new(ahead * cos - aside * sin, ahead * sin + aside * cos, up.at(time_s))
        }),
        velocity: None,
        vibration: 0.0,
        disturbance: Box::new(|_| Vector3::zeros()),
        bias: Box::new(|_| 0.0),
    }
}

/// Ten minutes of a machine that drives round a block of steel columns, and stops here and there.
pub(super) fn steel(random: &mut Random) -> Motion {
    const SIDE: f64 = 24.0;
    const SPEED: f64 = 1.2;
    const CORNER_S: f64 = 2.0;
    let mut course = Course::default();
    let mut time_s = REST_S;
    while time_s < 590.0 {
        // It stops after a random part of each side, and at the corner, where it turns on the spot.
        let part = random.uniform((0.2, 0.8));
        for part in [part, 1.0 - part] {
            let drives_s = part * SIDE / SPEED;
            course.speed.step(time_s, 2.0, SPEED);
            course.speed.step(time_s + drives_s, 2.0, -SPEED);
            time_s += drives_s + 2.0 + random.uniform((1.0, 20.0));
        }
        course.turn.step(time_s, CORNER_S, FRAC_PI_2 / CORNER_S);
        course.turn.step(time_s + CORNER_S, CORNER_S, -FRAC_PI_2 / CORNER_S);
        time_s += 2.0 * CORNER_S + 0.5;
    }
    let columns: Vec<_> = (0..4)
        .flat_map(|side| (0..3).map(move |column| (side, 4.0 + 8.0 * f64::from(column))))
        .map(|(side, along)| {
            // A metre outside the path, at the height of the sensor.
            let place = Rotation3::from_axis_angle(&Vector3::z_axis(), f64::from(side) * FRAC_PI_2)
                * Vector3::new(along - 0.5 * SIDE, -0.5 * SIDE - 1.0, 0.0);
            (place + Vector3::new(0.5 * SIDE, 0.5 * SIDE, 0.0), random.direction() * 40e-6)
        })
        .collect();
    let disturbance = move |position: &Vector3<f64>| -> Vector3<f64> {
        let dipole = |(place, moment): &(Vector3<f64>, Vector3<f64>)| {
            let from = position - place;
            // At less than half a metre, the position is inside the column.
            let distance = from.norm().max(0.5);
            (from * (3.0 * from.dot(moment) / (distance * distance)) - moment) / (2.0 * distance.powi(3))
        };
        columns.iter().map(dipole).sum()
    };
    let (moves, rough) = (course.speed.clone(), Sines::new(random, &[(0.004, 1.7), (0.003, 3.1)]));
    let tilt = move |time_s: f64, _: (f64, f64)| {
        let tilt = moves.value(time_s) * rough.at(time_s);
        (tilt, 0.7 * tilt)
    };
    Motion { vibration: 0.2, disturbance: Box::new(disturbance), ..course.motion(100.0, 600.0, tilt) }
}

/// Three hours of a slow machine that stops every minute, while its gyroscope warms up.
pub(super) fn warm(random: &mut Random) -> Motion {
    const LENGTH_S: f64 = 3.0 * 3600.0;
    const WARMING_S: f64 = 2400.0;
    let mut course = Course { start: random.uniform((0.0, TAU)), ..Course::default() };
    let mut time_s = REST_S;
    while time_s < LENGTH_S - 60.0 {
        course.speed.step(time_s, 2.0, 1.0);
        for _ in 0..3 {
            let rate = random.uniform((-0.4, 0.4));
            let begins_s = time_s + 3.0;
            course.turn.step(begins_s, 1.0, rate);
            course.turn.step(begins_s + 6.0, 1.0, -rate);
            time_s += 10.0;
        }
        course.speed.step(time_s + 5.0, 2.0, -1.0);
        time_s += 7.0 + random.uniform((5.0, 25.0));
    }
    let (moves, rough) = (course.speed.clone(), Sines::new(random, &[(0.02, 0.4), (0.01, 1.3)]));
    let tilt = move |time_s: f64, _: (f64, f64)| {
        let tilt = moves.value(time_s) * rough.at(time_s);
        (tilt, -0.6 * tilt)
    };
    let bias = |time_s: f64| 0.3_f64.to_radians() * (1.0 - (-time_s / WARMING_S).exp());
    Motion { vibration: 0.05, bias: Box::new(bias), ..course.motion(50.0, LENGTH_S, tilt) }
}
