//! Payloads whose `Clone` panics at random: the publisher is charged, everybody gets the message, and the run is the same again
//! from its journal, whether the same code panics then, other code, or none.

use crate::components::{Number, at};
use crate::gate::wait_until;
use crate::replay::{Heard, Lines, counts, hear, overflow, same};
use bb_core::component::InputTransforms;
use bb_core::journal::{JournalLine, JournalReader};
use bb_core::message::codec::{decode, encode};
use bb_core::nalgebra::Isometry3;
use bb_core::prelude::*;
use bb_core::{Builder, Report};
use bb_tests::random::Random;
use std::error::Error;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// When `Clone` panics.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Panics {
    Never = 0,
    /// Once in about thirty times, whatever the content.
    AtRandom = 1,
    /// For one of thirty numbers, each time.
    ByContent = 2,
}

static PANICS: AtomicU32 = AtomicU32::new(0);
static CLONES: AtomicU64 = AtomicU64::new(0);
static HAS_PANICKED: AtomicU64 = AtomicU64::new(0);
static ALONE: Mutex<()> = Mutex::new(());

fn set(panics: Panics) {
    PANICS.store(panics as u32, Ordering::SeqCst);
}

/// A message that is not easy to copy.
#[derive(Debug, PartialEq, Payload)]
pub(crate) struct Glass {
    number: f64,
}

impl Clone for Glass {
    fn clone(&self) -> Self {
        let number = match PANICS.load(Ordering::SeqCst) {
            1 => CLONES.fetch_add(1, Ordering::SeqCst),
            2 => self.number.to_bits(),
            _ => return Self { number: self.number },
        };
        let mixed = number.wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        if (mixed >> 32).is_multiple_of(30) {
            HAS_PANICKED.fetch_add(1, Ordering::SeqCst);
            panic!("glass breaks");
        }
        Self { number: self.number }
    }
}

/// Gives random numbers, stamped a little ago.
#[derive(Debug)]
struct Source {
    random: Random,
    reads: u32,
}

/// Options of [`Source`] and [`Encoder`].
#[derive(Clone, Debug, Options)]
struct SourceOptions {
    #[option(default = 1)]
    seed: u64,
    #[option(default = 0)]
    reads: u32,
}

impl Sensor for Source {
    type Options = SourceOptions;
    type Output = Number;

    fn init(SourceOptions { seed, reads }: SourceOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self { random: Random::new(seed), reads })
    }

    fn read(&mut self, now: MonotonicTime) -> Result<Reading<Number>, Fault> {
        let Some(reads) = self.reads.checked_sub(1) else { return Ok(Reading::finished()) };
        self.reads = reads;
        let ago = Duration::from_micros(self.random.below(1500));
        Ok(Reading::at(now - ago, Number(self.random.below(100) as f64)))
    }
}

/// Turns a joint.
#[derive(Debug)]
struct Encoder {
    random: Random,
    reads: u32,
}

impl Sensor for Encoder {
    type Options = SourceOptions;
    type Output = JointState;

    fn init(SourceOptions { seed, reads }: SourceOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self { random: Random::new(seed), reads })
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<JointState>, Fault> {
        let Some(reads) = self.reads.checked_sub(1) else { return Ok(Reading::finished()) };
        self.reads = reads;
        let position = self.random.below(1000) as f64 * 1e-3;
        Ok(Reading::now(JointState { position, velocity: None, effort: None }))
    }
}

/// Adds up numbers, which a restart forgets.
#[derive(Debug, Default)]
struct Blower {
    sum: f64,
}

impl Estimator for Blower {
    type Options = NoOptions;
    type Input = Number;
    type Output = Glass;

    fn init(_: NoOptions, context: &Context) -> Result<Self, Fault> {
        context.request(Request::Tick(Duration::from_millis(9)));
        Ok(Self::default())
    }

    fn handle_input(&mut self, number: &Stamped<Number>) -> Result<Reply<Glass>, Fault> {
        self.sum += number.0;
        Ok(Reply::emit(Glass { number: self.sum }))
    }

    fn handle_info(&mut self, _: Info) -> Result<Reply<Glass>, Fault> {
        self.sum *= 0.75;
        Ok(Reply::emit(Glass { number: self.sum }))
    }
}

/// The same from glass.
#[derive(Debug, Default)]
struct Melter(Blower);

impl Estimator for Melter {
    type Options = NoOptions;
    type Input = Glass;
    type Output = Glass;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self::default())
    }

    fn handle_input(&mut self, glass: &Stamped<Glass>) -> Result<Reply<Glass>, Fault> {
        self.0.sum += 0.5 * glass.number;
        Ok(Reply::emit(Glass { number: self.0.sum }))
    }
}

/// Two panes, one of which is kept until the other comes.
#[derive(Clone, Debug, Inputs)]
struct Panes<'a> {
    first: Input<'a, Glass>,
    second: Option<Input<'a, Glass>>,
}

/// Sees both of them, from where they are.
#[derive(Debug, Default)]
struct Window {
    frame_from_first: Isometry3<f64>,
}

impl Estimator for Window {
    type Options = NoOptions;
    type Input = Panes<'static>;
    type Output = Glass;
    const HANDLES_MOVING_JOINTS: bool = true;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self::default())
    }

    fn handle_transforms(&mut self, transforms: &InputTransforms<'_>) -> Result<(), Fault> {
        self.frame_from_first = transforms.frame_from_driver()?;
        Ok(())
    }

    fn handle_input(&mut self, panes: Panes<'_>) -> Result<Reply<Glass>, Fault> {
        let second = panes.second.map_or(-1.0, |second| second.number);
        let at = self.frame_from_first.translation.vector.x;
        Ok(Reply::emit(Glass { number: panes.first.number + second + at }))
    }
}

robot! {
    robot Glazier;

    link base {
        sensor sand: Source(seed = 4) {
            rate: 600 Hz;
            estimator blown: Blower() { latency_budget: 30 us; recover_after: 2; }
        }
        estimator apart: Melter() { input glass: sensor::base::sand::blown; runs_on: worker; latency_budget: 1 s; }
        estimator after: Melter() { input glass: estimator::base::apart; }
        estimator window: Window() {
            input first: sensor::base::shoulder::arm::sand::blown, driver;
            input second: sensor::base::sand::blown, optional;
            sync_tolerance: 4 ms;
            lost_after: 40 ms;
        }
        estimator beside: Window() {
            input first: sensor::base::shoulder::arm::sand::blown, driver;
            input second: estimator::base::apart, optional;
            runs_on: worker;
            latency_budget: 20 us;
        }
        joint shoulder: continuous {
            axis: z;
            sensor encoder: Encoder() { rate: 1 kHz; }
            link arm {
                sensor sand: Source(seed = 5) { rate: 500 Hz; estimator blown: Blower(); }
            }
        }
    }
}

fn alone() -> MutexGuard<'static, ()> {
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

fn builder() -> Builder<Glazier> {
    let mut builder = Glazier::builder();
    builder.supervision().max_restarts = 1_000_000;
    builder.joints().stale_after = Duration::from_millis(5);
    builder
}

fn journaled(seed: u64, reads: u32) -> (Builder<Glazier>, Lines) {
    let mut builder = builder();
    *builder.options(glazier::sensor::base::sand) = SourceOptions { seed, reads };
    *builder.options(glazier::sensor::base::shoulder::encoder) = SourceOptions { seed: seed + 1, reads: 2 * reads };
    *builder.options(glazier::sensor::base::shoulder::arm::sand) = SourceOptions { seed: seed + 2, reads };
    let lines = Lines::default();
    let sink = lines.clone();
    builder.journal(move |line| sink.lock().unwrap_or_else(PoisonError::into_inner).push(line));
    (builder, lines)
}

/// Plays the journal in parts of random length while code panics in that way, and expects what was.
fn expect_the_same(
    lines: &Lines,
    seed: u64,
    first: &Heard,
    report: &Report,
    panics: Panics,
) -> Result<(), Box<dyn Error>> {
    set(panics);
    let mut random = Random::new(seed);
    let builder = builder();
    let all = builder.subscribe_any(Select::All, None, overflow());
    let typed = builder.subscribe_with(glazier::sensor::base::sand::blown, overflow());
    let mut replay = builder.replay()?;
    let mut lines = lines.lock().unwrap_or_else(PoisonError::into_inner).clone();
    if seed.is_multiple_of(2) {
        // As from a file.
        let reader = JournalReader::<Glazier>::default();
        let read = |line: &JournalLine| {
            let mut bytes = Vec::new();
            encode(line, &mut bytes);
            reader.entry(&decode(&bytes)?)
        };
        lines = lines.iter().map(read).collect::<Result<_, _>>()?;
    }
    let mut again = Heard::new();
    while !lines.is_empty() {
        let rest = lines.split_off((1 + random.below(200) as usize).min(lines.len()));
        replay.play(std::mem::replace(&mut lines, rest))?;
        hear(&all, &mut again);
    }
    let report_again = replay.stop();
    set(Panics::Never);
    hear(&all, &mut again);
    same(first, &again);
    assert_eq!(counts(report), counts(&report_again));
    assert_eq!(typed.drain().count(), first["sensor/base/sand/blown"].len());
    Ok(())
}

/// What was published, the last report, and the journal.
type Day = (Heard, Report, Lines);

const CHARGED: [&str; 3] =
    ["sensor/base/sand/blown", "estimator/base/apart", "sensor/base/shoulder/arm/sand/blown"];

/// Whether much went wrong, and each was charged.
fn has_much_gone_wrong(report: &Report) -> bool {
    let is_charged = |path: &&str| report.estimator(path).expect("it is declared").restarts > 0;
    HAS_PANICKED.load(Ordering::SeqCst) > 20
        && CHARGED.iter().all(is_charged)
        && report.estimators.iter().all(|estimator| estimator.emitted > 20)
}

/// That much went wrong, and was noticed.
fn much_went_wrong(first: &Heard, report: &Report) {
    assert!(has_much_gone_wrong(report), "{} panics, {report}", HAS_PANICKED.load(Ordering::SeqCst));
    for path in CHARGED {
        let estimator = report.estimator(path).expect("it is declared");
        assert!(first.get(path).is_some_and(|heard| heard.len() as u64 == estimator.emitted), "{path} is heard");
    }
    assert!(first["fault"].iter().all(|fault| fault.contains("its output panicked: glass breaks")));
}

fn days(
    panics: Panics,
    again: [Panics; 3],
    run: fn(u64) -> Result<Day, Box<dyn Error>>,
    count: u64,
) -> Result<(), Box<dyn Error>> {
    let _alone = alone();
    for day in 1..=count {
        HAS_PANICKED.store(0, Ordering::SeqCst);
        set(panics);
        let (first, report, lines) = run(day)?;
        set(Panics::Never);
        much_went_wrong(&first, &report);
        for again in again {
            expect_the_same(&lines, day, &first, &report, again)?;
        }
    }
    Ok(())
}

fn on_virtual_time(day: u64) -> Result<Day, Box<dyn Error>> {
    let (builder, lines) = journaled(day * 10, 500);
    let all = builder.subscribe_any(Select::All, None, overflow());
    let _typed = builder.subscribe_with(glazier::sensor::base::sand::blown, overflow());
    let mut simulation = builder.simulate()?;
    for millis in (0..1100).step_by(50) {
        let latency = Duration::from_micros(millis * 7 % 60);
        simulation.pretend_latency(glazier::sensor::base::sand::blown, latency);
        simulation.pretend_latency(glazier::estimator::base::beside, latency);
        simulation.run_until(at(millis as i64 + 50));
    }
    let report = simulation.stop();
    let mut first = Heard::new();
    hear(&all, &mut first);
    Ok((first, report, lines))
}

fn on_many_threads(day: u64) -> Result<Day, Box<dyn Error>> {
    let (builder, lines) = journaled(day * 100, 400);
    let all = builder.subscribe_any(Select::All, None, overflow());
    let _typed = builder.subscribe_with(glazier::sensor::base::sand::blown, overflow());
    let running = builder.start()?;
    std::thread::sleep(Duration::from_millis(900));
    wait_until("much has gone wrong", || has_much_gone_wrong(&running.report()));
    let report = running.stop();
    let mut first = Heard::new();
    hear(&all, &mut first);
    Ok((first, report, lines))
}

#[test]
fn clones_that_panic_at_random_on_virtual_time_are_the_same_again() -> Result<(), Box<dyn Error>> {
    days(Panics::AtRandom, [Panics::Never, Panics::AtRandom, Panics::ByContent], on_virtual_time, 6)
}

#[test]
fn clones_that_panic_by_content_on_virtual_time_are_the_same_again() -> Result<(), Box<dyn Error>> {
    days(Panics::ByContent, [Panics::ByContent, Panics::Never, Panics::AtRandom], on_virtual_time, 4)
}

#[test]
fn clones_that_panic_at_random_on_many_threads_are_the_same_again() -> Result<(), Box<dyn Error>> {
    days(Panics::AtRandom, [Panics::Never, Panics::AtRandom, Panics::ByContent], on_many_threads, 3)
}

#[test]
fn clones_that_panic_by_content_on_many_threads_are_the_same_again() -> Result<(), Box<dyn Error>> {
    days(Panics::ByContent, [Panics::ByContent, Panics::Never, Panics::AtRandom], on_many_threads, 2)
}
