//! A run from a journal gives what the first run gave, bit for bit: outputs, transitions, drops.

use crate::components::{Doing, Failure, GainOptions, Number, Replied, Seen, Snapshot, Task, at, lock};
use bb_core::journal::{Entry, Event, JournalReader};
use bb_core::message::codec::{decode, encode};
use bb_core::prelude::*;
use bb_core::{Builder, DynamicMessage, DynamicSubscription, HealthTransition, Report, Robot};
pub(crate) use bb_tests::random::Random;
use std::cell::Cell;
use std::collections::BTreeMap;
use std::marker::PhantomData;
use std::sync::{Arc, Mutex};

/// Readings on a bad day: they come late, twice, with a NaN, or not at all.
pub(crate) trait OnBadDay: Payload {
    /// Reads, with a number that the sensor keeps.
    fn on_bad_day(random: &mut Random, kept: &mut f64, now: MonotonicTime) -> Reading<Self>;
}

/// Sensor on a bad day.
pub(crate) struct BadDay<T = Number>(Random, u32, f64, PhantomData<fn() -> T>);

/// Options of [`BadDay`].
#[derive(Clone, Debug, Options)]
pub(crate) struct BadDayOptions {
    #[option(default = 1)]
    pub(crate) seed: u64,
    #[option(default = 0)]
    pub(crate) reads: u32,
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

impl OnBadDay for Number {
    fn on_bad_day(random: &mut Random, _: &mut f64, now: MonotonicTime) -> Reading<Self> {
        let number = Number(random.below(1000) as f64 - 20.0);
        match random.below(200) {
            0 => Reading::now(Number(f64::NAN)),
            1 => Reading::at(now - Duration::from_millis(50), number),
            2 => Reading::at(now + Duration::from_secs(5), number),
            3..8 => Reading::nothing(),
            _ => Reading::now(number),
        }
    }
}

/// Passes on; negative numbers diverge, −20 panics, −19 is an error; beyond 970 it works for a while.
pub(crate) struct Moody {
    sum: f64,
    gain: f64,
}

impl Estimator for Moody {
    type Options = GainOptions;
    type Input = Number;
    type Output = Number;

    fn init(options: GainOptions, context: &Context) -> Result<Self, Fault> {
        context.request(Request::Tick(Duration::from_millis(70)));
        Ok(Self { sum: 0.0, gain: options.gain })
    }

    fn handle_input(&mut self, number: &Stamped<Number>) -> Replied {
        self.sum += self.gain * number.0;
        let reply = Reply::emit(Number(self.sum));
        match number.0 {
            -20.0 => panic!("too low"),
            -19.0 => Err(Fault::new("low")),
            low if low < 0.0 => Ok(reply.diverged("negative")),
            // Sums are larger.
            high if (970.0..1000.0).contains(&high) => {
                std::thread::sleep(Duration::from_micros(300));
                Ok(reply.and(Request::Timer(1, Duration::from_millis(3))))
            }
            _ => Ok(reply),
        }
    }

    fn handle_info(&mut self, _: Info) -> Replied {
        self.sum *= 0.5;
        Ok(Reply::emit(Number(self.sum)))
    }

    fn handle_options(&mut self, options: GainOptions, _: &Context) -> Result<(), Fault> {
        self.gain = options.gain;
        Ok(())
    }
}

/// Takes a while, and names where it leads.
fn settle(context: CommandContext) -> Doing {
    Box::pin(async move {
        context.sleep(Duration::from_millis(15)).await;
        if let Some(health) = context.health() {
            // What a command sets follows from what came in, and is not in the journal.
            context.set_parameter("param/gain", if health.to == HealthState::Healthy { 1.0 } else { 0.5 })?;
        }
        Ok(Outcome::done(()).next_state(if context.now() > at(200) { "settled" } else { "idle" }))
    })
}

robot! {
    robot Day;

    parameters { gain: f64 = 1.0, range: 0.0..=2.0; }
    states { settled; }
    commands {
        arm: Arm;
        settle: Task(run = settle) { allowed_states: [idle, executing, settled]; cancel: all; }
    }

    link base {
        sensor a: BadDay() {
            rate: 1 kHz;
            estimator own: Moody(gain = param::gain) {
                latency_budget: 200 us;
                lost_after: 6 ms;
                recover_after: 3;
                on_degraded: settle;
                on_lost: settle;
                on_recovered: settle;
            }
        }
        sensor b: BadDay(seed = 2) { rate: 900 Hz; }
        sensor fed: External<Number>();
        estimator pair: Snapshot() {
            input driver: sensor::base::a::own, driver;
            input second: sensor::base::b;
            input third: sensor::base::fed, optional, within: 5 ms;
            sync_tolerance: 2 ms;
            latency_budget: 1 s;
        }
        estimator slow: Moody() { input number: sensor::base::b; runs_on: worker; }
        estimator last: Moody() { input number: slow; }
    }
}

/// Writes a message as text that differs if a bit of payload or stamp does.
pub(crate) fn text(message: &DynamicMessage) -> String {
    let stamp = message.stamp();
    let payload = message
        .downcast::<Number>()
        .map(|number| format!("{:016x}", number.0.to_bits()))
        .or_else(|| message.downcast::<Seen>().map(|seen| format!("{:?}", seen.payload)))
        .or_else(|| message.downcast::<HealthTransition>().map(|change| change.to_string()))
        .unwrap_or_else(|| format!("{message:?}"));
    format!("{} {stamp:?} {payload}", message.path())
}

/// Whatever is published while the robot runs, path by path.
pub(crate) type Published = BTreeMap<&'static str, Vec<String>>;

pub(crate) fn collect(subscription: &DynamicSubscription, heard: &mut Published) {
    assert_eq!(subscription.lagged(), 0);
    for message in subscription.drain() {
        heard.entry(message.path()).or_default().push(text(&message));
    }
}

/// Counts of estimators, topics and commands; how long callbacks took is no part of it.
pub(crate) fn counts(report: &Report) -> String {
    let estimators: Vec<String> = report
        .estimators
        .iter()
        .map(|estimator| {
            let mut estimator = estimator.clone();
            estimator.latency = Default::default();
            estimator.inputs.iter_mut().for_each(|input| input.age = Default::default());
            format!("{estimator:?}")
        })
        .collect();
    let published: Vec<_> =
        report.topics.iter().map(|topic| (topic.path, topic.payload, topic.published)).collect();
    format!("{estimators:#?} {published:?} {:#?} {} {}", report.commands, report.state, report.safety)
}

pub(crate) type Lines = Arc<Mutex<Vec<Entry>>>;

/// Makes a robot write its journal.
pub(crate) fn journal<R: Robot>(builder: &mut Builder<R>) -> Lines {
    let lines = Lines::default();
    let sink = Arc::clone(&lines);
    builder.journal(move |entry| lock(&sink).push(entry));
    lines
}

/// Returns the entries that were written, in their order.
pub(crate) fn entries(lines: &Lines) -> Vec<Entry> {
    let mut entries = std::mem::take(&mut *lock(lines));
    entries.sort_by_key(|entry| entry.number);
    entries
}

/// Returns what a file would hold of a journal, read back: payloads are known by their paths alone.
pub(crate) fn read_back<R: Robot>(entries: &[Entry]) -> Result<Vec<Entry>, Failure> {
    let reader = JournalReader::<R>::default();
    let read = entries.iter().map(|line| {
        let mut bytes = Vec::new();
        encode(line, &mut bytes);
        Ok(reader.entry(&decode(&bytes)?)?)
    });
    read.collect()
}

pub(crate) fn overflow() -> Overflow {
    Overflow::DropOldest { capacity: Overflow::MAX_CAPACITY }
}

thread_local! {
    static IS_AGAIN: Cell<bool> = const { Cell::new(false) };
}

/// Returns whether this thread plays a journal: components of a first run that behave differently ask for it.
pub(crate) fn is_again() -> bool {
    IS_AGAIN.get()
}

/// Runs code as a part of a replay.
pub(crate) fn once_more<T>(run: impl FnOnce() -> T) -> T {
    IS_AGAIN.set(true);
    let result = run();
    IS_AGAIN.set(false);
    result
}

/// Runs a robot from its journal; what it gives.
pub(crate) fn play<R: Robot>(builder: Builder<R>, entries: &[Entry]) -> Result<(Published, Report), Failure> {
    let all = builder.subscribe_any(Select::All, None, overflow());
    let mut heard = Published::new();
    let report = once_more(|| {
        let mut replay = builder.replay()?;
        // In parts, as from a file.
        for part in entries.chunks((entries.len() / 1000).max(7)) {
            replay.play(part.to_vec())?;
            collect(&all, &mut heard);
        }
        Ok::<_, Failure>(replay.stop())
    })?;
    collect(&all, &mut heard);
    Ok((heard, report))
}

/// Runs a robot, and once more from its journal: all that is published and counted is the same.
pub(crate) fn same_again<R: Robot>(
    builder: impl Fn() -> Builder<R>,
    run: impl FnOnce(Builder<R>) -> Result<Report, Failure>,
) -> Result<(Published, Report), Failure> {
    run_again(builder, run, Ok)
}

/// Runs a robot, and once more from what a file would hold of its journal: all that is published and counted is the same.
pub(crate) fn same_from_file<R: Robot>(
    builder: impl Fn() -> Builder<R>,
    run: impl FnOnce(Builder<R>) -> Result<Report, Failure>,
) -> Result<(Published, Report), Failure> {
    run_again(builder, run, |entries| read_back::<R>(&entries))
}

fn run_again<R: Robot>(
    builder: impl Fn() -> Builder<R>,
    run: impl FnOnce(Builder<R>) -> Result<Report, Failure>,
    keep: impl FnOnce(Vec<Entry>) -> Result<Vec<Entry>, Failure>,
) -> Result<(Published, Report), Failure> {
    let mut first_builder = builder();
    let lines = journal(&mut first_builder);
    let all = first_builder.subscribe_any(Select::All, None, overflow());
    let report = run(first_builder)?;
    let mut first = Published::new();
    collect(&all, &mut first);
    let (again, report_again) = play(builder(), &keep(entries(&lines))?)?;
    same(&first, &again);
    assert_eq!(counts(&report), counts(&report_again));
    assert_eq!((&report.faults, report.all_faults), (&report_again.faults, report_again.all_faults));
    Ok((first, report))
}

pub(crate) fn same(first: &Published, again: &Published) {
    let paths = |heard: &Published| heard.iter().map(|(path, texts)| (*path, texts.len())).collect::<Vec<_>>();
    assert_eq!(paths(first), paths(again));
    for ((path, first), (_, again)) in first.iter().zip(again) {
        if let Some(line) = (0..first.len()).find(|line| first[*line] != again[*line]) {
            panic!("{path}, message {line}: {} then, {} now", first[line], again[line]);
        }
    }
}

fn builder(reads: u32) -> Builder<Day> {
    let mut builder = Day::builder();
    builder.supervision().max_restarts = 1_000_000;
    builder.options(day::sensor::base::a).reads = reads;
    builder.options(day::sensor::base::b).reads = reads;
    builder
}

/// Runs as many readings of each sensor, and a number, a parameter and now and then a command for every hundred.
fn virtual_days(reads: u32) -> Result<(), Failure> {
    let mut builder = self::builder(reads);
    let lines = journal(&mut builder);
    let all = builder.subscribe_any(Select::All, None, overflow());
    let mut simulation = builder.simulate()?;
    simulation.command(day::command::arm, NoArguments)?;
    let mut first = Published::new();
    for step in 1..=i64::from(reads / 100) {
        simulation.publish(day::sensor::base::fed, at(step * 100), Number(step as f64));
        simulation.set_parameter(day::param::gain, (step % 20) as f64 / 10.0)?;
        if step % 50 == 0 {
            // Refused, or not, as its state has it.
            let _ = simulation.command(day::command::settle, NoArguments);
            collect(&all, &mut first);
        }
    }
    let report = simulation.stop();
    let (again, report_again) = play(self::builder(reads), &entries(&lines))?;
    collect(&all, &mut first);
    let of = |path: &str| first.get(path).map_or(0, Vec::len);
    assert!(of("health") > 100 && of("command/settle") > 100 && of("estimator/base/pair") > 1000, "much happens");
    assert!(report.estimators.iter().any(|estimator| estimator.restarts > 3));
    same(&first, &again);
    assert_eq!(counts(&report), counts(&report_again));
    Ok(())
}

#[test]
fn a_run_on_virtual_time_is_the_same_again() -> Result<(), Failure> {
    virtual_days(10_000)
}

#[test]
#[ignore = "a million messages take half a minute"]
fn long_a_run_of_a_million_messages_is_the_same_again() -> Result<(), Failure> {
    virtual_days(500_000)
}

#[test]
fn a_run_on_many_threads_is_the_same_again() -> Result<(), Failure> {
    same_again(
        || builder(1500),
        |builder| {
            let mut running = builder.start()?;
            running.command(day::command::arm, NoArguments)?.wait()?;
            let live = running.live();
            let feeder = std::thread::spawn(move || {
                for step in 0..300 {
                    live.publish(day::sensor::base::fed, live.clock().now(), Number(f64::from(step)));
                    if step % 30 == 0 {
                        let _ = live.command(day::command::settle, NoArguments);
                    }
                    std::thread::sleep(Duration::from_millis(3));
                }
            });
            running.wait();
            feeder.join().map_err(|_| "the feeder panicked")?;
            Ok(running.stop())
        },
    )?;
    Ok(())
}

#[test]
fn a_journal_of_another_robot_is_refused_with_its_line() -> Result<(), Failure> {
    let begin = |robot: &str| {
        let mut builder = builder(0);
        let lines = journal(&mut builder);
        builder.simulate().map(drop).expect("it starts");
        let mut begin = entries(&lines).swap_remove(0);
        if let Event::Begin { declaration, .. } = &mut begin.event {
            declaration[0] = format!("robot {robot}");
        }
        begin
    };
    let play = |event| -> Result<_, StartError> {
        let mut replay = builder(0).replay()?;
        let lines = vec![begin("Day"), Entry { number: 2, time: at(0), event }];
        Ok(replay.play(lines).expect_err("it does not fit").to_string())
    };
    assert_eq!(
        play(Event::Deliver { island: 1, entry: 0, message: 3 })?,
        "line 2 of the journal cannot be replayed: no such message waits: it is of another robot, or lines are missing"
    );
    assert_eq!(
        play(Event::Wake { island: 99 })?,
        "line 2 of the journal cannot be replayed: the robot has no such island"
    );
    let error = Day::builder().replay()?.play(vec![begin("Night")]).expect_err("it is of another robot");
    assert_eq!(
        error.to_string(),
        "line 1 of the journal cannot be replayed: the journal is of another robot: it says `robot Night`, and this \
         robot has `robot Day`"
    );
    let mut replay = Day::builder().replay()?;
    let gap = replay
        .play(vec![Entry { number: 3, time: at(0), event: Event::Arm { caller: String::new() } }])
        .expect_err("two are missing");
    let message = "line 3 of the journal cannot be replayed: it follows line 0; the lines between are missing";
    assert_eq!(gap.to_string(), message);
    Ok(())
}
