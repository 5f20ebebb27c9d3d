//! Random bad days, each run once and then again from its journal: everything that was published, and every count, must be
//! the same. `BB_STRESS_SECONDS` says for how long, `BB_STRESS_SEED` which days.

mod robot;

use bb_core::journal::{Entry, Event};
use bb_core::prelude::*;
use bb_core::{DynamicSubscription, Report, Stamped};
use bb_tests::random::Random;
use robot::{Add, Ask, Dice, STOPPED, Weathered, weathered};
use std::collections::{BTreeMap, BTreeSet};
use std::error::Error;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

type Lines = Arc<Mutex<Vec<Entry>>>;

/// Messages published, path by path, to the last bit of payload and stamp.
type Messages = BTreeMap<&'static str, Vec<String>>;

fn messages(subscription: &DynamicSubscription) -> Messages {
    assert_eq!(subscription.lagged(), 0);
    texts(subscription)
}

fn texts(subscription: &DynamicSubscription) -> Messages {
    let mut heard = Messages::new();
    for message in subscription.drain() {
        let payload = match message.downcast::<Dice>() {
            Some(dice) => format!("{:016x}", dice.0.to_bits()),
            None => format!("{message:?}"),
        };
        heard.entry(message.path()).or_default().push(format!("{:?} {payload}", message.stamp()));
    }
    heard
}

/// Subscriptions that lose messages on purpose.
struct Few {
    /// The newest of each path, at a highest rate.
    rated: DynamicSubscription,
    /// The newest of each path.
    latest: DynamicSubscription,
}

impl Few {
    fn of(builder: &bb_core::Builder<Weathered>) -> Self {
        let rate = room().at_most_every(Duration::from_millis(7));
        let rated = builder.subscribe_any(Select::All, None, rate);
        Self { rated, latest: builder.subscribe_any(Select::All, None, Overflow::LatestPerPath) }
    }

    /// Checks it against what was published; returns what came at the highest rate.
    fn check(&self, all: &Messages) -> Result<Messages, String> {
        let newest: BTreeMap<_, _> =
            all.iter().map(|(path, all)| (*path, all.last().into_iter().cloned().collect())).collect();
        let latest = texts(&self.latest);
        if latest != newest {
            return Err(format!("the newest of each path: {latest:?}, but published {newest:?}"));
        }
        let rated = texts(&self.rated);
        for (path, all) in all {
            let heard = rated.get(path).ok_or_else(|| format!("{path} was not heard"))?;
            let mut published = all.iter();
            if !heard.iter().all(|heard| published.any(|published| published == heard))
                || heard.last() != all.last()
            {
                return Err(format!("{path}: at a highest rate {heard:?} of {all:?}"));
            }
        }
        Ok(rated)
    }
}

/// Counts of estimators, topics and commands; measured durations are not part of it.
fn counts(report: &Report) -> Vec<String> {
    let estimators = report.estimators.iter().map(|estimator| {
        let mut estimator = estimator.clone();
        estimator.latency = Default::default();
        estimator.inputs.iter_mut().for_each(|input| input.age = Default::default());
        format!("{estimator:?}")
    });
    let topics = report.topics.iter().map(|topic| format!("{} {}", topic.path, topic.published));
    let commands = report.commands.iter().map(|command| format!("{command:?}"));
    let whole = [format!("{} {}", report.state, report.safety)];
    estimators.chain(topics).chain(commands).chain(whole).collect()
}

fn room() -> Overflow {
    Overflow::DropOldest { capacity: Overflow::MAX_CAPACITY }
}

/// A robot of this seed: with some seeds panics escalate, with others the budgets are wide.
fn builder(random: &mut Random) -> bb_core::Builder<Weathered> {
    let mut builder = Weathered::builder();
    builder.supervision().max_restarts = [3, 10, 1_000_000][random.below(3) as usize];
    builder.options(weathered::sensor::base::a).seed = random.below(1 << 30);
    builder.options(weathered::sensor::base::b).seed = random.below(1 << 30);
    builder
}

/// Disturbs a robot from outside: the same calls on a simulated robot and on a running one.
fn disturb(live: &bb_core::Live<Weathered>, random: &mut Random) {
    let dice = Dice(random.below(1000) as f64);
    match random.below(18) {
        0..3 => live.publish(weathered::sensor::base::fed, live.clock().now(), dice),
        3 => drop(live.command(weathered::command::drive, NoArguments)),
        4 => drop(live.command(weathered::command::halt, NoArguments)),
        5 => {
            if let Ok(execution) = live.command(weathered::command::drive, NoArguments) {
                execution.cancel();
            }
        }
        6 => drop(live.set_parameter(weathered::param::gain, dice.0 / 500.0 - 0.5)),
        7 => drop(live.set_parameter(weathered::param::pace, dice.0)),
        8 => drop(live.call(weathered::sensor::base::a::near, Ask(dice.0 / 10.0))),
        9 => drop(live.cast(weathered::estimator::base::far, Ask(dice.0 / 10.0))),
        10 => drop(live.cast(weathered::sensor::base::b::beside, Add(dice.0))),
        11 if dice.0 < 500.0 => drop(live.cast(weathered::estimator::base::far, Add(dice.0))),
        11 => drop(live.call(weathered::estimator::base::last, Ask(dice.0 / 10.0))),
        12 if dice.0 < 300.0 => drop(live.disarm()),
        13 | 14 => drop(live.publisher("weather/front").map(|front| front.publish(dice))),
        15 => {
            let early = live.clock().now() - Duration::from_millis(random.below(30));
            drop(live.publisher("weather/front").map(|front| front.forward(&Stamped::new(early, dice))));
        }
        16 => drop(live.set_parameter(weathered::param::lull, dice.0)),
        _ => drop(live.arm()),
    }
}

fn virtual_day(seed: u64) -> Result<bool, Box<dyn Error>> {
    let mut random = Random::new(seed);
    let mut builder = builder(&mut random);
    let lines = Lines::default();
    let sink = Arc::clone(&lines);
    builder.journal(move |entry| sink.lock().unwrap_or_else(PoisonError::into_inner).push(entry));
    let (all, few) = (builder.subscribe_any(Select::All, None, room()), Few::of(&builder));
    let mut simulation = builder.simulate()?;
    simulation.arm().expect("it may be armed");
    let live = simulation.live();
    for _ in 0..60 {
        simulation.run_for(Duration::from_micros(random.below(9000)));
        for _ in 0..random.below(4) {
            disturb(&live, &mut random);
        }
        if random.below(20) == 0 {
            let latency = Duration::from_micros(random.below(600));
            simulation.pretend_latency(weathered::sensor::base::a::near, latency);
        }
    }
    let report = simulation.stop();
    is_same_again(seed, &lines, (&messages(&all), &few), &report)
}

fn real_day(seed: u64) -> Result<bool, Box<dyn Error>> {
    let mut random = Random::new(seed);
    let mut builder = builder(&mut random);
    let lines = Lines::default();
    let sink = Arc::clone(&lines);
    builder.journal(move |entry| sink.lock().unwrap_or_else(PoisonError::into_inner).push(entry));
    let (all, few) = (builder.subscribe_any(Select::All, None, room()), Few::of(&builder));
    let running = builder.start()?;
    running.arm().expect("it may be armed");
    let disturbers: Vec<_> = (0..2)
        .map(|number| {
            let live = running.live();
            let mut random = Random::new(seed ^ (number << 40));
            std::thread::spawn(move || {
                for _ in 0..80 {
                    std::thread::sleep(Duration::from_micros(random.below(5000)));
                    disturb(&live, &mut random);
                }
            })
        })
        .collect();
    std::thread::sleep(Duration::from_millis(100 + random.below(150)));
    // Callers go on while it stops, and after that, as do sensors, services, timers and commands.
    STOPPED.lock().unwrap_or_else(PoisonError::into_inner).0 = Some(Instant::now());
    let report = running.stop();
    disturbers.into_iter().try_for_each(std::thread::JoinHandle::join).map_err(|_| "a disturber panicked")?;
    is_same_again(seed, &lines, (&messages(&all), &few), &report)
}

/// Events that must have happened on some day.
const HAPPENS: [&str; 4] =
    ["weather/front", "estimator/base/squall", "controller/gale starts", "controller/calm starts"];

/// Records which of the events have happened.
fn note(heard: &Messages) {
    let starts = |caller: &str| {
        let texts = heard.iter().filter(|(path, _)| path.starts_with("command/")).flat_map(|(_, texts)| texts);
        let caller = format!("caller: \"{caller}\"");
        texts.into_iter().any(|text| text.contains("phase: Started") && text.contains(&caller))
    };
    let has = |what: &str| what.strip_suffix(" starts").map_or(heard.contains_key(what), starts);
    let happens = HAPPENS.into_iter().filter(|what| has(what));
    HAPPENED.lock().unwrap_or_else(PoisonError::into_inner).extend(happens);
}

static HAPPENED: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());

/// Replays the journal. Prints the first difference and returns `false` if messages or counts differ.
fn is_same_again(
    seed: u64,
    lines: &Lines,
    (first, few): (&Messages, &Few),
    report: &Report,
) -> Result<bool, Box<dyn Error>> {
    let builder = builder(&mut Random::new(seed));
    let (all, few_again) = (builder.subscribe_any(Select::All, None, room()), Few::of(&builder));
    let mut replay = builder.replay()?;
    let lines = std::mem::take(&mut *lines.lock().unwrap_or_else(PoisonError::into_inner));
    let is_virtual = lines.iter().any(|line| matches!(line.event, Event::Begin { is_virtual: true, .. }));
    assert!(
        lines.windows(2).all(|pair| pair[0].number + 1 == pair[1].number),
        "lines come in order, without a gap"
    );
    replay.play(lines)?;
    let report_again = replay.stop();
    let again = messages(&all);
    for path in first.keys().chain(again.keys()) {
        let none = Vec::new();
        let (then, now) = (first.get(path).unwrap_or(&none), again.get(path).unwrap_or(&none));
        if then != now {
            let at = (0..).find(|&at| then.get(at) != now.get(at)).unwrap_or(0);
            println!("seed {seed}: {path}, message {at}:\n  then {:?}\n  now  {:?}", then.get(at), now.get(at));
            return Ok(false);
        }
    }
    note(first);
    let (then, now) = (few.check(first)?, few_again.check(&again)?);
    // In real time, a period of a replay ends at another line.
    if is_virtual && then != now {
        println!("seed {seed}, at a highest rate:\n  then {then:?}\n  now  {now:?}");
        return Ok(false);
    }
    let (then, now) = (counts(report), counts(&report_again));
    if let Some((then, now)) = then.iter().zip(&now).find(|(then, now)| then != now) {
        println!("seed {seed}:\n  then {then}\n  now  {now}");
        return Ok(false);
    }
    Ok(then.len() == now.len())
}

fn from_environment(name: &str) -> Option<u64> {
    std::env::var(name).ok()?.parse().ok()
}

/// Runs `few` days, or as many as fit into `BB_STRESS_SECONDS`.
fn days(kind: &str, few: u64, day: fn(u64) -> Result<bool, Box<dyn Error>>) {
    std::panic::set_hook(Box::new(|info| {
        let of_test = std::thread::current().name().is_some_and(|name| name.contains("days"));
        if of_test {
            println!("{info}");
        }
    }));
    let first = from_environment("BB_STRESS_SEED").unwrap_or(1);
    let seconds = from_environment("BB_STRESS_SECONDS");
    let start = Instant::now();
    let mut different = Vec::new();
    let mut seed = first;
    while seconds.map_or(seed < first + few, |seconds| start.elapsed() < Duration::from_secs(seconds)) {
        match day(seed) {
            Ok(true) => {}
            Ok(false) => different.push(seed),
            Err(error) => {
                println!("seed {seed}: {error}");
                different.push(seed);
            }
        }
        seed += 1;
    }
    println!("{kind}: {} days from seed {first}, different: {different:?}", seed - first);
    assert!(different.is_empty(), "{kind}: different at the seeds {different:?}");
    let happened = HAPPENED.lock().unwrap_or_else(PoisonError::into_inner);
    assert!(HAPPENS.iter().all(|what| happened.contains(what)), "{kind}: only {happened:?} of {HAPPENS:?}");
}

#[test]
fn days_on_virtual_time() {
    days("virtual time", 40, virtual_day);
}

#[test]
fn days_on_many_threads() {
    days("many threads", 6, real_day);
    let mut took = STOPPED.lock().unwrap_or_else(PoisonError::into_inner).1.clone();
    took.sort_unstable();
    let (Some(median), Some(most)) = (took.get(took.len() / 2), took.last()) else {
        panic!("no motor was made safe")
    };
    println!(
        "told to stop, {} motors were being made safe after {median:?} in the median, {most:?} at most",
        took.len()
    );
    assert!(*median < Duration::from_millis(10), "{took:?}");
}
