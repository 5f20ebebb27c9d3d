//! A replay gives estimators the transforms that they had, whatever raced.

use crate::components::at;
use crate::joints::{Fusion, Pixel, Spotter};
use crate::replay::{Heard, Lines, Random, counts, hear, overflow, same};
use bb_core::Report;
use bb_core::prelude::*;
use std::sync::PoisonError;

/// An encoder of a bad day: it pauses, repeats itself, stamps late, and now and then gives a NaN.
#[derive(Debug)]
struct Encoder {
    random: Random,
    reads: u32,
    angle: f64,
}

/// Options of [`Encoder`] and [`Camera`].
#[derive(Clone, Debug, Options)]
pub(crate) struct DayOptions {
    #[option(default = 1)]
    pub(crate) seed: u64,
    #[option(default = 0)]
    pub(crate) reads: u32,
}

impl Sensor for Encoder {
    type Options = DayOptions;
    type Output = JointState;

    fn init(DayOptions { seed, reads }: DayOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self { random: Random::new(seed), reads, angle: 0.0 })
    }

    fn read(&mut self, now: MonotonicTime) -> Result<Reading<JointState>, Fault> {
        let Some(reads) = self.reads.checked_sub(1) else { return Ok(Reading::finished()) };
        self.reads = reads;
        self.angle += self.random.below(1000) as f64 * 1e-3 - 0.5;
        let velocity = (self.random.below(2) == 0).then_some(self.angle * 0.7);
        let state = JointState { position: self.angle.clamp(0.0, 1.0), velocity, effort: None };
        Ok(match self.random.below(40) {
            0 => Reading::at(now - Duration::from_millis(30), state),
            1 => Reading::now(JointState { position: f64::NAN, ..state }),
            2 => Reading::nothing().next_at(now + Duration::from_millis(50)),
            3 => Reading::at(now + Duration::from_secs(3), state),
            _ => Reading::now(state),
        })
    }
}

/// Gives numbers, stamped a little ago.
#[derive(Debug)]
struct Camera {
    random: Random,
    reads: u32,
}

impl Sensor for Camera {
    type Options = DayOptions;
    type Output = Pixel;

    fn init(DayOptions { seed, reads }: DayOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self { random: Random::new(seed), reads })
    }

    fn read(&mut self, now: MonotonicTime) -> Result<Reading<Pixel>, Fault> {
        let Some(reads) = self.reads.checked_sub(1) else { return Ok(Reading::finished()) };
        self.reads = reads;
        let ago = Duration::from_micros(self.random.below(8000));
        Ok(Reading::at(now - ago, Pixel(self.random.below(100) as f64)))
    }
}

robot! {
    robot Swing;

    bridges { bridge joint_states: bb_core::component::JointPublisher() { rate: 100 Hz; } }

    link base {
        sensor imu: Camera(seed = 4) { rate: 300 Hz; }
        estimator spot: Spotter() {
            input camera: sensor::base::shoulder::arm::lift::carriage::camera;
            lost_after: 40 ms;
            recover_after: 2;
        }
        estimator busy: Spotter() {
            input camera: sensor::base::shoulder::arm::lift::carriage::camera;
            latency_budget: 5 us;
            runs_on: worker;
        }
        estimator fusion: Fusion() {
            input imu: sensor::base::imu, driver;
            input camera: sensor::base::shoulder::arm::lift::carriage::camera, optional;
            input lift: sensor::base::shoulder::arm::lift::encoder, optional;
            sync_tolerance: 4 ms;
        }
        joint shoulder: continuous {
            axis: z;
            sensor encoder: Encoder() { rate: 1 kHz; }
            link arm {
                joint lift: prismatic {
                    axis: x;
                    limit: { lower: 0 m, upper: 2 m, velocity: 1 m/s, effort: 10 N };
                    sensor encoder: Encoder(seed = 2) { rate: 700 Hz; }
                    link carriage { sensor camera: Camera(seed = 3) { rate: 500 Hz; } }
                }
            }
        }
    }
}

fn builder(seed: u64, reads: u32) -> (bb_core::Builder<Swing>, Lines) {
    let mut builder = Swing::builder();
    builder.joints().stale_after = Duration::from_millis(3);
    *builder.options(swing::sensor::base::imu) = DayOptions { seed, reads };
    *builder.options(swing::sensor::base::shoulder::encoder) = DayOptions { seed: seed + 1, reads };
    *builder.options(swing::sensor::base::shoulder::arm::lift::encoder) = DayOptions { seed: seed + 2, reads };
    let camera = builder.options(swing::sensor::base::shoulder::arm::lift::carriage::camera);
    *camera = DayOptions { seed: seed + 3, reads };
    let lines = Lines::default();
    let sink = lines.clone();
    builder.journal(move |entry| sink.lock().unwrap_or_else(PoisonError::into_inner).push(entry));
    (builder, lines)
}

/// Plays the journal in parts of random length.
fn replayed(lines: &Lines, random: &mut Random) -> Result<(Heard, Report), Box<dyn std::error::Error>> {
    let mut builder = Swing::builder();
    // What the store would answer is another matter: the journal has what it did answer.
    builder.joints().states = 2;
    let all = builder.subscribe_any(Select::All, None, overflow());
    let mut replay = builder.replay()?;
    let mut lines = std::mem::take(&mut *lines.lock().unwrap_or_else(PoisonError::into_inner));
    lines.sort_by_key(|line| line.number);
    let mut heard = Heard::new();
    while !lines.is_empty() {
        let rest = lines.split_off((1 + random.below(200) as usize).min(lines.len()));
        replay.play(std::mem::replace(&mut lines, rest))?;
        hear(&all, &mut heard);
    }
    let report = replay.stop();
    hear(&all, &mut heard);
    Ok((heard, report))
}

/// That some were answered, and some were not, for each of the reasons.
fn is_a_bad_day(report: &Report) {
    for path in ["estimator/base/spot", "estimator/base/busy"] {
        let estimator = report.estimator(path).expect("it is declared");
        assert!(estimator.emitted > 20, "{report}");
        assert!(estimator.inputs[0].dropped(bb_core::run::DropReason::NoTransform) > 3, "{report}");
    }
}

#[test]
fn random_days_on_virtual_time_are_the_same_again() -> Result<(), Box<dyn std::error::Error>> {
    for day in 1..=12 {
        let mut random = Random::new(day);
        let (builder, lines) = builder(day * 10, 400);
        let all = builder.subscribe_any(Select::All, None, overflow());
        let mut simulation = builder.simulate()?;
        simulation.run_until(at(1000));
        let report = simulation.stop();
        is_a_bad_day(&report);
        let mut first = Heard::new();
        hear(&all, &mut first);
        let (again, report_again) = replayed(&lines, &mut random)?;
        same(&first, &again);
        assert_eq!(counts(&report), counts(&report_again));
    }
    Ok(())
}

#[test]
fn random_days_on_many_threads_are_the_same_again() -> Result<(), Box<dyn std::error::Error>> {
    for day in 1..=4 {
        let mut random = Random::new(day);
        let (builder, lines) = builder(day * 100, 300);
        let all = builder.subscribe_any(Select::All, None, overflow());
        let running = builder.start()?;
        // Sensors have 300 readings and are done after a second; the bridge goes on.
        std::thread::sleep(Duration::from_millis(1100));
        let report = running.stop();
        is_a_bad_day(&report);
        let mut first = Heard::new();
        hear(&all, &mut first);
        let (again, report_again) = replayed(&lines, &mut random)?;
        same(&first, &again);
        assert_eq!(counts(&report), counts(&report_again));
    }
    Ok(())
}
