//! `--start`, `--offset`, `--magnet`, `--disturb`, `--drift`: makes a recording harder, from a seed.
//!
//! Each variant of a recording is one evaluation. The field added to the magnetometer is either fixed to the body, as
//! from a magnetic part of it, or fixed in the world, as from iron that the body passes.

use crate::recording::Recording;
use bb_core::nalgebra::{UnitQuaternion, Vector3};
use bb_estimators::attitude::ImuSample;
use bb_mcap::Truth;
use std::path::Path;
use std::str::FromStr;

/// A magnet is attached this long before the first motion, s.
const MAGNET_ON_S: f64 = 4.0;

/// A magnet is removed this long after the first motion, s.
const MAGNET_OFF_S: f64 = 55.0;

/// Shortest and longest duration of a disturbance, s.
const PULSE_S: (f64, f64) = (1.0, 3.0);

/// Shortest and longest pause between disturbances, s.
const PAUSE_S: (f64, f64) = (2.0, 8.0);

/// The period of a drift, s.
const DRIFT_S: (f64, f64) = (60.0, 120.0);

/// Starts are within this part of the motion, so that there is motion left to score.
const STARTS_WITHIN: f64 = 0.6;

/// More variants of one recording are a mistake.
const MOST: u32 = 1000;

/// The modifications of recordings; each combination of a start and an offset is a variant.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Variants {
    /// Number of random starts in motion.
    pub starts: Option<Starts>,
    /// A constant offset of the magnetometer, in this many random directions.
    pub offset: Option<Offset>,
    /// A magnet on the body, attached before the motion and removed again.
    pub magnet: Option<Field>,
    /// Disturbances that are fixed in the world and last for one to three seconds each.
    pub disturb: Option<Field>,
    /// A field that changes slowly, fixed in the world.
    pub drift: Option<Field>,
    /// The seed of all random numbers.
    pub seed: u64,
}

/// `random:8`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Starts(u32);

/// `30uT:4`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Offset(Field, u32);

/// `30uT`, in T.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Field(f64);

impl Field {
    /// T.
    pub fn tesla(self) -> f64 {
        self.0
    }
}

impl Variants {
    /// The number of variants of one recording; also 1 if nothing is changed.
    pub fn count(&self) -> u32 {
        self.starts.map_or(1, |starts| starts.0) * self.offset.map_or(1, |offset| offset.1)
    }

    /// Returns whether the recording is modified.
    pub(crate) fn is_changed(&self) -> bool {
        *self != Self { seed: self.seed, ..Self::default() }
    }

    /// Returns whether the magnetometer's readings are modified.
    pub(crate) fn changes_field(&self) -> bool {
        self.offset.is_some() || self.magnet.is_some() || self.disturb.is_some() || self.drift.is_some()
    }

    /// Checks that they can be made with these axes.
    ///
    /// # Errors
    /// Which of them cannot; in words.
    pub fn check(&self, axes: crate::Axes) -> Result<(), String> {
        if self.count() > MOST {
            return Err(format!(
                "{} variants of each recording are asked for, but at most {MOST} are made",
                self.count()
            ));
        }
        if self.changes_field() && axes == crate::Axes::Six {
            return Err("--axes 6 takes no magnetometer, so --offset, --magnet, --disturb and --drift change \
                        nothing; leave them out"
                .into());
        }
        Ok(())
    }
}

/// One variant of one recording.
#[derive(Debug)]
pub(crate) struct Variant {
    /// Samples before this time are left out.
    pub(crate) start_ns: Option<i64>,
    /// Constant offset of the field on the body, T.
    offset: Vector3<f64>,
    /// Field of a magnet on the body, T, and the times from and to which it acts, ns.
    magnet: Option<(Vector3<f64>, i64, i64)>,
    pulses: Option<Pulses>,
    drift: Option<Drift>,
    /// The last field as read, and as modified: a driver that repeats a reading still does.
    last: Option<(Vector3<f64>, Vector3<f64>)>,
}

#[derive(Debug)]
struct Pulses {
    size: f64,
    random: Random,
    field: Vector3<f64>,
    is_on: bool,
    change_ns: Option<i64>,
}

#[derive(Debug)]
struct Drift {
    amplitude: Vector3<f64>,
    period_s: f64,
    start_ns: Option<i64>,
}

impl Variant {
    /// The variant of an index below [`Variants::count`].
    pub(crate) fn new(
        variants: &Variants,
        index: u32,
        file: &Path,
        moving_ns: &[i64],
        truth: &Truth,
    ) -> Result<Self, String> {
        let starts = variants.starts.map_or(1, |starts| starts.0);
        // Each part has its own random numbers, so that one option does not change those of another.
        let random = |part: u64, index: u32| Random::new([variants.seed, hash(file), part, index.into()]);
        let no_motion = || "it never moves, so it has no variant that depends on motion".to_owned();
        let start_ns = match variants.starts {
            None => None,
            Some(_) => {
                let last = moving_ns.len().checked_sub(1).ok_or_else(no_motion)?;
                let place = random(1, index % starts).uniform((0.0, STARTS_WITHIN)) * last as f64;
                moving_ns.get(place as usize).copied()
            }
        };
        let magnet = match variants.magnet {
            None => None,
            Some(Field(size)) => {
                let motion = truth.first_motion().ok_or("--magnet: no topic says when it moves (std_msgs/Bool)")?;
                let at = |seconds: f64| motion.saturating_add((seconds * 1e9) as i64);
                Some((random(3, index).direction() * size, at(-MAGNET_ON_S), at(MAGNET_OFF_S)))
            }
        };
        let offset = variants
            .offset
            .map_or_else(Vector3::zeros, |Offset(Field(size), _)| random(2, index / starts).direction() * size);
        let pulses = variants.disturb.map(|Field(size)| Pulses {
            size,
            random: random(4, index),
            field: Vector3::zeros(),
            is_on: false,
            change_ns: None,
        });
        let drift = variants.drift.map(|Field(size)| {
            let mut random = random(5, index);
            Drift { amplitude: random.direction() * size, period_s: random.uniform(DRIFT_S), start_ns: None }
        });
        Ok(Self { start_ns, offset, magnet, pulses, drift, last: None })
    }

    /// Modifies samples, which come in the order of time.
    pub(crate) fn apply(&mut self, samples: &mut [ImuSample], truth: &Truth) {
        for sample in samples {
            let Some(field) = sample.magnetic_field else { continue };
            let added = match self.last {
                Some((last, added)) if last == field => added,
                _ => self.added(sample.time_ns, truth),
            };
            self.last = Some((field, added));
            sample.magnetic_field = Some(field + added);
        }
    }

    /// The field added to the magnetometer at a time, in the body frame, T.
    fn added(&mut self, time_ns: i64, truth: &Truth) -> Vector3<f64> {
        let magnet = self.magnet.filter(|(_, on, off)| (*on..*off).contains(&time_ns));
        let on_body = self.offset + magnet.map_or_else(Vector3::zeros, |(magnet, ..)| magnet);
        let mut in_world = Vector3::zeros();
        if let Some(pulses) = &mut self.pulses {
            in_world += pulses.at(time_ns);
        }
        if let Some(drift) = &mut self.drift {
            in_world += drift.at(time_ns);
        }
        if in_world == Vector3::zeros() {
            return on_body;
        }
        // Where the truth is unknown, a field cannot be fixed to the world.
        let body_from_world = truth.at(time_ns).0.map(|truth: UnitQuaternion<f64>| truth.inverse());
        on_body + body_from_world.map_or_else(Vector3::zeros, |body_from_world| body_from_world * in_world)
    }
}

impl Pulses {
    fn at(&mut self, time_ns: i64) -> Vector3<f64> {
        let mut change_ns =
            self.change_ns.unwrap_or_else(|| time_ns.saturating_add(seconds(self.random.uniform(PAUSE_S))));
        while time_ns >= change_ns {
            self.is_on = !self.is_on;
            self.field = if self.is_on { self.random.direction() * self.size } else { Vector3::zeros() };
            let length = if self.is_on { PULSE_S } else { PAUSE_S };
            change_ns = change_ns.saturating_add(seconds(self.random.uniform(length)));
        }
        self.change_ns = Some(change_ns);
        self.field
    }
}

impl Drift {
    fn at(&mut self, time_ns: i64) -> Vector3<f64> {
        let start_ns = *self.start_ns.get_or_insert(time_ns);
        let phase = time_ns.saturating_sub(start_ns) as f64 * 1e-9 / self.period_s;
        self.amplitude * (std::f64::consts::TAU * phase).sin()
    }
}

fn seconds(seconds: f64) -> i64 {
    (seconds * 1e9) as i64
}

/// The samples' times in motion.
pub(crate) fn moving_times(recording: &mut Recording) -> Result<Vec<i64>, String> {
    let mut samples = Vec::new();
    let mut times = Vec::new();
    loop {
        samples.clear();
        let end = recording.read(&mut samples, 4096)?;
        times.extend(samples.iter().map(|sample| sample.time_ns).filter(|time| recording.truth.at(*time).1));
        if !matches!(end, crate::End::NotYet) {
            return Ok(times);
        }
    }
}

impl FromStr for Starts {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let count = text.strip_prefix("random:").ok_or("write random:COUNT, as random:8")?;
        Ok(Self(self::count(count)?))
    }
}

impl FromStr for Offset {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (field, directions) = text.split_once(':').unwrap_or((text, "1"));
        Ok(Self(field.parse()?, count(directions)?))
    }
}

impl FromStr for Field {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let units = [("uT", 1e-6), ("µT", 1e-6), ("nT", 1e-9), ("mT", 1e-3), ("T", 1.0)];
        let (number, unit) = units
            .iter()
            .find_map(|(unit, value)| Some((text.strip_suffix(unit)?, *value)))
            .ok_or("no unit; write a number with nT, uT, mT or T, as 30uT")?;
        let number: f64 = number.trim().parse().map_err(|_| format!("`{number}` is not a number"))?;
        let tesla = number * unit;
        if !(0.0..=1.0).contains(&tesla) {
            return Err("must be from 0 to 1 T".into());
        }
        Ok(Self(tesla))
    }
}

fn count(text: &str) -> Result<u32, String> {
    match text.parse() {
        Ok(count) if (1..=MOST).contains(&count) => Ok(count),
        _ => Err(format!("`{text}` is no count from 1 to {MOST}")),
    }
}

/// FNV-1a of a file's name, so that a recording has the same variants, whichever others are evaluated.
pub(crate) fn hash(file: &Path) -> u64 {
    let name = file.file_name().unwrap_or(file.as_os_str());
    let bytes = name.as_encoded_bytes().iter();
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3))
}

/// SplitMix64. It is kept although other code uses a crate's generator: the tables of `book/src/laboratory/attitude.md` were
/// measured with its numbers, and a recording has the same variants in every version.
#[derive(Debug)]
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seeds: [u64; 4]) -> Self {
        let mut random = Self(0);
        for seed in seeds {
            random.0 = random.next() ^ seed;
        }
        random
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub(crate) fn uniform(&mut self, (from, to): (f64, f64)) -> f64 {
        from + (to - from) * (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform on the sphere: a cylinder's surface has the same area between two heights.
    pub(crate) fn direction(&mut self) -> Vector3<f64> {
        let height = self.uniform((-1.0, 1.0));
        let angle = self.uniform((0.0, std::f64::consts::TAU));
        let radius = (1.0 - height * height).sqrt();
        Vector3::new(radius * angle.cos(), radius * angle.sin(), height)
    }

    /// Three independent standard normal numbers, by the method of Box and Muller.
    pub(crate) fn normal(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| {
            // Above zero, which has no logarithm.
            let radius = (-2.0 * (1.0 - self.uniform((0.0, 1.0))).ln()).sqrt();
            radius * self.uniform((0.0, std::f64::consts::TAU)).cos()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(time_ns: i64, field: f64) -> ImuSample {
        ImuSample {
            time_ns,
            angular_velocity: Vector3::zeros(),
            specific_force: Vector3::zeros(),
            magnetic_field: Some(Vector3::repeat(field)),
        }
    }

    fn variant(variants: &Variants, index: u32) -> Variant {
        let moving: Vec<_> = (0..1000).collect();
        Variant::new(variants, index, Path::new("walk.mcap"), &moving, &Truth::default()).expect("it moves")
    }

    #[test]
    fn fields_have_units_and_counts() {
        assert_eq!("30uT".parse(), Ok(Field(30.0 * 1e-6)));
        assert_eq!("0.5 mT".parse(), Ok(Field(0.5 * 1e-3)));
        assert_eq!("30uT:4".parse(), Ok(Offset(Field(30.0 * 1e-6), 4)));
        assert_eq!("random:8".parse(), Ok(Starts(8)));
        for wrong in ["30", "x uT", "-1uT", "NaNuT", "2T"] {
            assert!(wrong.parse::<Field>().is_err(), "{wrong}");
        }
        assert!("random".parse::<Starts>().is_err() && "random:0".parse::<Starts>().is_err());
        assert!("30uT:x".parse::<Offset>().is_err());
    }

    #[test]
    fn variants_are_their_seeds() {
        let variants = Variants {
            starts: Some(Starts(8)),
            offset: Some(Offset(Field(30e-6), 4)),
            seed: 7,
            ..Variants::default()
        };
        assert_eq!(variants.count(), 32);
        let starts: Vec<_> = (0..32).map(|index| variant(&variants, index).start_ns).collect();
        assert_eq!(starts, (0..32).map(|index| variant(&variants, index).start_ns).collect::<Vec<_>>());
        assert_eq!(starts[..8], starts[8..16], "an offset has the same starts");
        assert!(starts.iter().flatten().all(|start| (0..600).contains(start)));
        let other = Variants { seed: 8, ..variants.clone() };
        assert_ne!(variant(&other, 0).start_ns, starts[0]);
        let offset = |index| variant(&variants, index).offset;
        assert_eq!(offset(0), offset(7));
        assert_ne!(offset(0), offset(8));
        assert!((offset(9).norm() - 30e-6).abs() < 1e-15);
    }

    #[test]
    fn a_repeated_field_stays_repeated() {
        let variants = Variants { drift: Some(Field(6e-6)), disturb: Some(Field(20e-6)), ..Variants::default() };
        let mut variant = variant(&variants, 0);
        let mut samples = [sample(0, 1.0), sample(1_000_000_000, 1.0), sample(2_000_000_000, 2.0)];
        variant.apply(&mut samples, &Truth::default());
        assert_eq!(samples[0].magnetic_field, samples[1].magnetic_field);
    }

    #[test]
    fn disturbances_come_and_go() {
        let mut pulses =
            Pulses { size: 2.0, random: Random(1), field: Vector3::zeros(), is_on: false, change_ns: None };
        let sizes: Vec<_> = (0..10_000).map(|i| pulses.at(i * 10_000_000).norm()).collect();
        let on = sizes.iter().filter(|size| **size > 1.0).count();
        assert_eq!(sizes[0], 0.0);
        assert!((2000..4000).contains(&on), "2 s of 7, of 100 s: {on}");
    }
}
