//! The list of families.

use super::simulated::Body;
use super::trial::Change;
use crate::filters::Axes;

/// Trials that have something in common, whose errors are averaged.
#[derive(Debug)]
pub struct Family {
    /// Name on the command line and in the table.
    pub name: &'static str,
    /// A description.
    pub about: &'static str,
    /// The half that it belongs to; `None` if it is a part of another family, and so in no average over families.
    pub half: Option<Half>,
    /// The angle that counts.
    pub measure: Measure,
    pub(super) axes: Axes,
    pub(super) source: Source,
    pub(super) change: Change,
}

/// One of the two halves of the families: numbers of a filter that are chosen on one are reported on the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Half {
    /// The first half.
    #[cfg_attr(feature = "clap", value(name = "A", alias = "a"))]
    A,
    /// The second half.
    #[cfg_attr(feature = "clap", value(name = "B", alias = "b"))]
    B,
}

/// The angle by which filters are compared in a family.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// The whole error.
    Total,
    /// The drift of the heading, after its mean error is taken away.
    Drift,
    /// The error of the inclination.
    Inclination,
}

/// The origin of a family's trials.
#[derive(Clone, Copy, Debug)]
pub(super) enum Source {
    /// The recordings in a folder whose names contain all of these words.
    Recordings {
        folder: &'static str,
        words: &'static [&'static str],
    },
    Simulated(Body),
}

const PHONES: Source = phones(&["clear", "calibrated"]);
const NEXUS: Source = phones(&["nexus5", "calibrated"]);
const BROAD: Source = Source::Recordings { folder: "broad", words: &[] };
const EUROC: Source = Source::Recordings { folder: "navigation", words: &["euroc", "imu"] };

const fn phones(words: &'static [&'static str]) -> Source {
    Source::Recordings { folder: "phones", words }
}

const A: Option<Half> = Some(Half::A);
const B: Option<Half> = Some(Half::B);

const MICROTESLA: f64 = 1e-6;
const DEGREE: f64 = std::f64::consts::PI / 180.0;

const fn given(name: &'static str, half: Option<Half>, source: Source, about: &'static str) -> Family {
    changed(name, half, source, Change::None, about)
}

const fn changed(
    name: &'static str,
    half: Option<Half>,
    source: Source,
    change: Change,
    about: &'static str,
) -> Family {
    Family { name, about, half, measure: Measure::Total, axes: Axes::Nine, source, change }
}

const fn six(
    name: &'static str,
    half: Option<Half>,
    source: Source,
    measure: Measure,
    about: &'static str,
) -> Family {
    Family { name, about, half, measure, axes: Axes::Six, source, change: Change::None }
}

const fn simulated(
    name: &'static str,
    half: Option<Half>,
    body: Body,
    measure: Measure,
    about: &'static str,
) -> Family {
    Family { name, about, half, measure, axes: Axes::Nine, source: Source::Simulated(body), change: Change::None }
}

/// The families, in the order of the table.
pub const FAMILIES: [&Family; 33] = [
    &given("phones", A, PHONES, "phones, calibrated, no magnets near"),
    &given("phones-magnets", B, phones(&["magnets", "calibrated"]), "phones, calibrated, magnets brought near"),
    &given("os", A, phones(&["os"]), "phones, the magnetometer as the operating system calibrates it"),
    &given("os-clear", None, phones(&["clear", "os"]), "of these, no magnets near"),
    &given("os-magnets", None, phones(&["magnets", "os"]), "of these, magnets brought near"),
    &given("raw", B, phones(&["raw"]), "phones, nothing calibrated: offsets up to 600 µT, biases up to 6 °/s"),
    &given("raw-clear", None, phones(&["clear", "raw"]), "of these, no magnets near"),
    &given("raw-magnets", None, phones(&["magnets", "raw"]), "of these, magnets brought near"),
    &given("broad", B, BROAD, "BROAD, from rest"),
    &changed("start-2s", A, BROAD, Change::StartBeforeMotion(2.0), "BROAD, started 2 s before the motion"),
    &changed("start-moving", B, BROAD, Change::StartBeforeMotion(-20.0), "BROAD, started 20 s into the motion"),
    &changed(
        "gaps-0.3s",
        B,
        NEXUS,
        Change::Gaps(&[(10.0, 0.3), (1.0, 0.02)]),
        "Nexus 5, 0.3 s missing every 10 s and 20 ms every second, in four phases",
    ),
    &changed("gaps-1s", A, NEXUS, Change::Gaps(&[(20.0, 1.0)]), "Nexus 5, 1 s missing every 20 s, in four phases"),
    &changed("offset-10", A, PHONES, Change::Offset(10.0 * MICROTESLA), "phones, 10 µT added to the magnetometer"),
    &changed("offset-22", B, PHONES, Change::Offset(22.0 * MICROTESLA), "phones, 22 µT added"),
    &changed("offset-47", A, PHONES, Change::Offset(47.0 * MICROTESLA), "phones, 47 µT added"),
    &changed("offset-22-broad", A, BROAD, Change::Offset(22.0 * MICROTESLA), "BROAD, 22 µT added"),
    &changed("offset-300-broad", B, BROAD, Change::Offset(300.0 * MICROTESLA), "BROAD, 300 µT added"),
    &changed("bias-1", A, PHONES, Change::Bias(DEGREE), "phones, 1 °/s added to the gyroscope"),
    &changed("bias-4", B, PHONES, Change::Bias(4.0 * DEGREE), "phones, 4 °/s added"),
    &changed("jitter", A, PHONES, Change::Jitter(2e-3), "phones, stamps off by up to 2 ms"),
    &changed("half", B, PHONES, Change::EverySecond, "phones, every second sample missing"),
    &six("six-phones", A, PHONES, Measure::Drift, "phones without the magnetometer, heading aligned by its mean"),
    &six(
        "six-broad",
        B,
        BROAD,
        Measure::Inclination,
        "BROAD without the magnetometer, heading aligned by its mean",
    ),
    &six("six-euroc", A, EUROC, Measure::Inclination, "EuRoC MH_01, a drone, without a magnetometer"),
    &simulated(
        "plane-50",
        B,
        Body::Plane { rate: 50.0 },
        Measure::Inclination,
        "plane, 25 m/s, circles of 120 m, 50 Hz",
    ),
    &simulated("plane-200", B, Body::Plane { rate: 200.0 }, Measure::Inclination, "the same at 200 Hz"),
    &simulated("car", A, Body::Car, Measure::Inclination, "car, roundabouts of 20 m at 8 m/s, braking at 0.35 g"),
    &simulated("boat", B, Body::Boat, Measure::Inclination, "boat, swell of 0.15 Hz, 15° of roll, 1 m/s² of surge"),
    &simulated("drone", A, Body::Drone, Measure::Total, "drone that always pushes along its own axis"),
    &simulated("walker", B, Body::Walker, Measure::Total, "phone in the hand of a walker"),
    &simulated("steel", A, Body::Steel, Measure::Total, "machine that drives and stops beside steel"),
    &simulated("warm", B, Body::Warm, Measure::Total, "three hours, the bias drifts by 0.3 °/s with temperature"),
];

impl Family {
    /// The family of a name.
    pub fn named(name: &str) -> Option<&'static Self> {
        FAMILIES.into_iter().find(|family| family.name == name)
    }

    /// Returns whether it needs recordings.
    pub fn is_recorded(&self) -> bool {
        matches!(self.source, Source::Recordings { .. })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_halves_are_even() {
        for (index, family) in FAMILIES.iter().enumerate() {
            let named = FAMILIES.iter().position(|other| other.name == family.name);
            assert_eq!(named, Some(index), "{}", family.name);
        }
        let of = |half| FAMILIES.iter().filter(|family| family.half == half).count();
        assert!(of(A).abs_diff(of(B)) <= 1, "{} and {}", of(A), of(B));
        // Parts of another family.
        assert_eq!(of(None), 4);
    }
}
