//! A replay gives estimators the transforms that they had, whatever raced.

use crate::joints::{Fusion, Pixel, Spotter};
use crate::kit::*;
use std::collections::BTreeSet;
use std::marker::PhantomData;

/// Readings on a bad day: they come late, twice, with a NaN, or not at all.
trait OnBadDay: Payload {
    /// Reads, with a number that the sensor keeps.
    fn on_bad_day(random: &mut Random, kept: &mut f64, now: MonotonicTime) -> Reading<Self>;
}

/// Sensor on a bad day.
struct BadDay<T>(Random, u32, f64, PhantomData<fn() -> T>);

/// Options of [`BadDay`].
#[derive(Clone, Debug, Options)]
struct BadDayOptions {
    #[option(default = 1)]
    seed: u64,
    #[option(default = 0)]
    reads: u32,
}

impl<T: OnBadDay> Sensor for BadDay<T> {
    type Options = BadDayOptions;
    type Output = T;

    fn init(options: BadDayOptions, _: &SensorContext) -> Result<Self, Fault> {
        // One that restarts must not give the same again.
        Ok(Self(Random::new(options.seed), options.reads, 0.0, PhantomData))
    }

    fn read(&mut self, now: MonotonicTime) -> Result<Reading<T>, Fault> {
        let Some(reads) = self.1.checked_sub(1) else { return Ok(Reading::finished()) };
        self.1 = reads;
        Ok(T::on_bad_day(&mut self.0, &mut self.2, now))
    }
}

/// States of a joint: they pause, repeat themselves, are stamped late, and now and then give a NaN.
impl OnBadDay for JointState {
    fn on_bad_day(random: &mut Random, angle: &mut f64, now: MonotonicTime) -> Reading<Self> {
        *angle += random.below(1000) as f64 * 1e-3 - 0.5;
        let velocity = (random.below(2) == 0).then_some(*angle * 0.7);
        let state = JointState { position: angle.clamp(0.0, 1.0), velocity, effort: None };
        match random.below(40) {
            0 => Reading::at(now - Duration::from_millis(30), state),
            1 => Reading::now(JointState { position: f64::NAN, ..state }),
            2 => Reading::nothing().next_at(now + Duration::from_millis(50)),
            3 => Reading::at(now + Duration::from_secs(3), state),
            _ => Reading::now(state),
        }
    }
}

/// Numbers that are stamped a little ago.
impl OnBadDay for Pixel {
    fn on_bad_day(random: &mut Random, _: &mut f64, now: MonotonicTime) -> Reading<Self> {
        let ago = Duration::from_micros(random.below(8000));
        Reading::at(now - ago, Pixel(random.below(100) as f64))
    }
}

robot! {
    robot Swing;

    bridges { bridge joint_states: bb_core::component::JointPublisher() { rate: 100 Hz; } }

    link base {
        sensor imu: BadDay<Pixel>(seed = 4) { rate: 300 Hz; }
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
            sensor encoder: BadDay<JointState>() { rate: 1 kHz; }
            link arm {
                joint lift: prismatic {
                    axis: x;
                    limit: { lower: 0 m, upper: 2 m, velocity: 1 m/s, effort: 10 N };
                    sensor encoder: BadDay<JointState>(seed = 2) { rate: 700 Hz; }
                    link carriage { sensor camera: BadDay<Pixel>(seed = 3) { rate: 500 Hz; } }
                }
            }
        }
    }
}

fn builder(seed: u64, reads: u32) -> Builder<Swing> {
    let mut builder = Swing::builder();
    builder.joints().stale_after = Duration::from_millis(3);
    *builder.options(swing::sensor::base::imu) = BadDayOptions { seed, reads };
    *builder.options(swing::sensor::base::shoulder::encoder) = BadDayOptions { seed: seed + 1, reads };
    *builder.options(swing::sensor::base::shoulder::arm::lift::encoder) = BadDayOptions { seed: seed + 2, reads };
    let camera = builder.options(swing::sensor::base::shoulder::arm::lift::carriage::camera);
    *camera = BadDayOptions { seed: seed + 3, reads };
    builder
}

/// A robot that plays journals. What its store would answer is another matter: the journal has what it did answer.
fn player() -> Builder<Swing> {
    let mut builder = Swing::builder();
    builder.joints().states = 2;
    builder
}

/// Returns whether some inputs were answered, and some were not, for each of the reasons.
fn is_a_bad_day(report: &Report) -> bool {
    ["estimator/base/spot", "estimator/base/busy"].iter().all(|path| {
        let estimator = report.estimator(path).expect("it is declared");
        estimator.emitted > 20 && estimator.inputs[0].dropped(DropReason::NoTransform) > 3
    })
}

/// Runs a bad day, and the same once more.
fn same_day(
    builder: Builder<Swing>,
    run: impl FnOnce(Builder<Swing>) -> Result<Report, Failure>,
) -> Result<Report, Failure> {
    let (_, report) = run_again(builder, player, run, Ok)?;
    assert!(is_a_bad_day(&report), "{report}");
    Ok(report)
}

fn on_virtual_time(builder: Builder<Swing>, millis: i64) -> Result<Report, Failure> {
    let mut simulation = builder.simulate()?;
    simulation.run_until(at(millis));
    Ok(simulation.stop())
}

#[test]
fn random_days_on_virtual_time_are_the_same_again() -> Result<(), Failure> {
    (1..=12)
        .try_for_each(|day| same_day(builder(day * 10, 400), |builder| on_virtual_time(builder, 1000)).map(drop))
}

#[test]
#[ignore = "so many messages take a minute"]
fn long_a_run_of_half_a_million_messages_is_the_same_again() -> Result<(), Failure> {
    let report = same_day(builder(10, u32::MAX), |builder| on_virtual_time(builder, 400_000))?;
    let published: u64 = report.topics.iter().map(|topic| topic.published).sum();
    assert!(published > 500_000, "{published}");
    Ok(())
}

#[test]
fn random_days_on_many_threads_are_the_same_again() -> Result<(), Failure> {
    (1..=2).try_for_each(|number| {
        let run = |builder: Builder<Swing>| {
            let running = builder.start()?;
            std::thread::sleep(Duration::from_millis(500));
            wait_until("it is a bad day", || is_a_bad_day(&running.report()));
            Ok(running.stop())
        };
        same_day(builder(number * 100, u32::MAX), run).map(drop)
    })
}

/// The lines of turns that have not ended there.
fn turns_without_an_end(lines: &[Entry]) -> BTreeSet<u64> {
    let mut open = BTreeSet::new();
    for line in lines {
        match &line.event {
            Event::Deliver { .. } | Event::Wake { .. } | Event::Start { .. } => drop(open.insert(line.number)),
            Event::Placed { cause, .. } => drop(open.remove(cause)),
            _ => {}
        }
    }
    open
}

#[test]
fn a_journal_that_is_cut_is_replayed_up_to_there_and_the_line_is_named() -> Result<(), Failure> {
    let mut builder = builder(70, 60);
    let (lines, all, mut first) =
        (journal(&mut builder), builder.subscribe_any(Select::All, None, overflow()), Published::new());
    on_virtual_time(builder, 200)?;
    collect(&all, &mut first);
    let lines = entries(&lines);
    let mut random = Random::new(7);
    let mut cuts = 0;
    for _ in 0..150 {
        let cut = 1 + random.below(lines.len() as u64 - 1) as usize;
        let (again, report) = play(player(), &lines[..cut])?;
        // What the store of joint states would answer is not the same, so what is said to be known must come from the journal.
        for (path, again) in again.iter().filter(|(path, _)| path.starts_with("estimator/")) {
            assert!(first[path].starts_with(again), "{path} up to line {cut}: {again:?}");
        }
        let open = turns_without_an_end(&lines[..cut]);
        for fault in report.faults.iter().filter(|fault| fault.path == "journal") {
            let line = fault.message.strip_prefix("line ").and_then(|rest| rest.split(' ').next()?.parse().ok());
            assert!(line.is_some_and(|line| open.contains(&line)), "{fault} of {open:?}");
            let says =
                ": the journal is cut here: it does not say where its input `camera` was for `estimator/base/";
            assert!(fault.message.contains(says), "{fault}");
            cuts += 1;
        }
    }
    assert!(cuts > 5, "{cuts}");
    Ok(())
}
