//! Readings whose `Clone` panics: each subscriber and each estimator gets them, however busy it is, and the panic is a fault of the
//! sensor, which continues.

use crate::components::Number;
use crate::fragile_copies::{Vase, alone, faults, of, set_breaks};
use crate::replay::Lines;
use bb_core::prelude::*;
use bb_core::{Builder, Report};
use std::error::Error;
use std::sync::PoisonError;
use std::time::Instant;

/// Options of [`Kiln`].
#[derive(Clone, Debug, Options)]
struct KilnOptions {
    #[option(default = 0)]
    count: u32,
}

/// Gives vases with the numbers from 1 to `count`.
#[derive(Debug)]
struct Kiln {
    count: u32,
    next: u32,
}

impl Sensor for Kiln {
    type Options = KilnOptions;
    type Output = Vase;

    fn init(KilnOptions { count }: KilnOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self { count, next: 1 })
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Vase>, Fault> {
        if self.next > self.count {
            return Ok(Reading::finished());
        }
        self.next += 1;
        Ok(Reading::now(Vase { number: f64::from(self.next - 1) }))
    }
}

/// Emits the number of each vase.
#[derive(Debug)]
struct Buyer;

impl Estimator for Buyer {
    type Options = NoOptions;
    type Input = Vase;
    type Output = Number;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, vase: &Stamped<Vase>) -> Result<Reply<Number>, Fault> {
        Ok(Reply::emit(Number(vase.number)))
    }
}

robot! {
    robot Market;
    link base {
        sensor fed: External<Vase>() { estimator beside: Buyer(); }
        sensor kiln: Kiln() { rate: 1 kHz; estimator beside: Buyer(); }
        estimator first: Buyer() { input vase: sensor::base::fed; runs_on: worker; }
        estimator second: Buyer() { input vase: sensor::base::fed; runs_on: worker; }
        estimator third: Buyer() { input vase: sensor::base::kiln; runs_on: worker; }
        estimator fourth: Buyer() { input vase: sensor::base::kiln; runs_on: worker; }
    }
}

const OF_FED: [&str; 3] = ["estimator/base/first", "estimator/base/second", "sensor/base/fed/beside"];
const OF_KILN: [&str; 3] = ["estimator/base/fourth", "estimator/base/third", "sensor/base/kiln/beside"];
const COUNT: u32 = 12;

fn builder(is_journaled: bool) -> (Builder<Market>, Option<Lines>) {
    let mut builder = Market::builder();
    builder.options(market::sensor::base::kiln).count = COUNT;
    let lines = is_journaled.then(|| {
        let lines = Lines::default();
        let sink = lines.clone();
        builder.journal(move |line| sink.lock().unwrap_or_else(PoisonError::into_inner).push(line));
        lines
    });
    (builder, lines)
}

/// Whether each of the estimators has emitted for each vase.
fn have_all(report: &Report) -> bool {
    report.estimators.iter().all(|estimator| estimator.emitted == u64::from(COUNT))
}

/// The paths that these have been published at, with the numbers there.
fn numbers(heard: &bb_core::DynamicSubscription) -> Vec<(&'static str, Vec<f64>)> {
    let mut numbers = std::collections::BTreeMap::<_, Vec<f64>>::new();
    for message in heard.drain() {
        let number = message.downcast::<Number>().map(|number| number.0);
        let number = number.or_else(|| message.downcast::<Vase>().map(|vase| vase.number));
        numbers.entry(message.path()).or_default().extend(number);
    }
    numbers.into_iter().collect()
}

const READINGS: Select<'static> = Select::AnyOf(&[Select::Below("sensor"), Select::Below("estimator")]);

#[test]
fn a_reading_whose_clone_panics_gets_to_all_estimators_and_subscribers() -> Result<(), Box<dyn Error>> {
    let _alone = alone();
    for case in 0..4 {
        let [is_journaled, is_heard] = [1, 2].map(|bit| case & bit != 0);
        let (builder, lines) = builder(is_journaled);
        let heard = is_heard.then(|| builder.subscribe_any(READINGS, None, Overflow::default()));
        set_breaks(true);
        let running = builder.start()?;
        for number in 1..=COUNT {
            let vase = Vase { number: f64::from(number) };
            running.publish(market::sensor::base::fed, running.clock().now(), vase);
        }
        let start = Instant::now();
        while !have_all(&running.report()) && start.elapsed() < Duration::from_secs(10) {
            std::thread::sleep(Duration::from_millis(5));
        }
        let report = running.stop();
        set_breaks(false);
        assert!(have_all(&report), "{case}: {report}");
        let all: Vec<f64> = (1..=COUNT).map(f64::from).collect();
        let mut expected: Vec<_> = OF_FED.into_iter().chain(OF_KILN).map(|path| (path, all.clone())).collect();
        expected.extend(["sensor/base/fed", "sensor/base/kiln"].map(|path| (path, all.clone())));
        expected.sort_by_key(|(path, _)| *path);
        if let Some(heard) = &heard {
            assert_eq!(numbers(heard), expected, "{case}");
        }
        // One of three breaks: once for each of the two workers, for the subscriber or the journal, and for the estimator beside
        // the sensor if another thread holds it just then.
        for path in ["sensor/base/fed", "sensor/base/kiln"] {
            let fault = format!("{path} failed: its message panicked: the vase breaks");
            let count = faults(&report).iter().filter(|text| **text == fault).count();
            let (broken, copies) = (COUNT as usize / 3, if is_journaled || is_heard { 3 } else { 2 });
            assert!((broken * copies..=broken * (copies + 1)).contains(&count), "{case} {path}: {count}");
        }
        assert!(report.sources.iter().all(|source| source.restarts == 0 && source.stopped.is_none()));

        let Some(lines) = lines else { continue };
        for breaks in [false, true] {
            let replay = Market::builder();
            let again = replay.subscribe_any(READINGS, None, Overflow::default());
            let mut replay = replay.replay()?;
            set_breaks(breaks);
            let played = replay.play(of(&lines));
            let report_again = replay.stop();
            set_breaks(false);
            played?;
            assert_eq!(numbers(&again), expected, "{case}");
            assert_eq!(faults(&report_again), faults(&report), "{case}");
        }
    }
    Ok(())
}
