//! A run that is recorded with its journal, read back from the file, and run again.

use bb_core::Report;
use bb_core::journal::{JournalLine, JournalReader};
use bb_core::prelude::*;
use bb_core::run::{DropReason, InputStatistics};
use bb_mcap::{Recorder, RecorderOptions, Recording};
use std::error::Error;
use std::time::Instant;

/// A number.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
struct Number(f64);

/// Returns numbers, and occasionally a NaN.
#[derive(Debug)]
struct Numbers(u32);

impl Sensor for Numbers {
    type Options = NoOptions;
    type Output = Number;

    fn init(_: NoOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self(0))
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Number>, Fault> {
        self.0 += 1;
        let number = f64::from(self.0).sqrt();
        Ok(Reading::now(Number(if self.0.is_multiple_of(50) { f64::NAN } else { number })))
    }
}

/// Adds numbers up; fails at every hundredth number.
#[derive(Debug)]
struct Sum(f64, u32);

impl Estimator for Sum {
    type Options = NoOptions;
    type Input = Number;
    type Output = Number;

    fn init(_: NoOptions, context: &Context) -> Result<Self, Fault> {
        context.request(Request::Tick(Duration::from_millis(7)));
        Ok(Self(0.0, 0))
    }

    fn handle_input(&mut self, number: &Stamped<Number>) -> Result<Reply<Number>, Fault> {
        self.1 += 1;
        if self.1 == 100 {
            return Err(Fault::new("a hundred is enough"));
        }
        self.0 += number.0;
        Ok(Reply::emit(Number(self.0)))
    }

    fn handle_info(&mut self, _: Info) -> Result<Reply<Number>, Fault> {
        Ok(Reply::emit(Number(-self.0)))
    }
}

robot! {
    robot Counting;
    parameters { pace: f64 = 1.0; }
    commands { arm: Arm; }
    link base {
        sensor numbers: Numbers() {
            rate: 1 kHz;
            estimator sum: Sum() { lost_after: 20 ms; on_lost: arm; }
        }
        estimator slow: Sum() { input number: numbers; runs_on: worker; }
    }
}

type Outputs = Vec<(MonotonicTime, u64)>;

fn outputs(subscription: &Subscription<Number>) -> Outputs {
    subscription.drain().map(|number| (number.monotonic_time, number.0.to_bits())).collect()
}

#[test]
fn a_recorded_journal_runs_again() -> Result<(), Box<dyn Error>> {
    let file = std::env::temp_dir().join(format!("bb-journal-{}.mcap", std::process::id()));
    // The file of a killed run.
    let _ = std::fs::remove_file(&file);
    let room = Overflow::DropOldest { capacity: 100_000 };
    let mut builder = Counting::builder();
    builder.publish_journal();
    let sums = [
        builder.subscribe_with(counting::sensor::base::numbers::sum, room),
        builder.subscribe_with(counting::estimator::base::slow, room),
    ];
    let journal = builder.subscribe_any(Select::Path("journal"), None, room);
    let recorder = Recorder::new(&file, journal, RecorderOptions::of::<Counting>())?.spawn()?;
    let running = builder.start()?;
    for pace in 0..40 {
        std::thread::sleep(Duration::from_millis(10));
        running.set_parameter(counting::param::pace, f64::from(pace))?;
    }
    // However busy the machine is.
    let start = Instant::now();
    let is_enough =
        |report: &Report| report.estimators.iter().all(|sum| sum.inputs.iter().all(|input| input.received > 400));
    while start.elapsed() < Duration::from_secs(30) && !is_enough(&running.report()) {
        std::thread::sleep(Duration::from_millis(10));
    }
    let report = running.stop();
    assert_eq!(recorder.stop()?.lost, 0);
    let first = sums.each_ref().map(outputs);
    assert!(first.iter().all(|sums| sums.len() > 200), "much happened");

    let reader = JournalReader::<Counting>::default();
    let lines = Recording::open(&file)?.messages::<JournalLine>("journal")?;
    let entries =
        lines.map(|line| Ok(reader.entry(&line?.payload)?)).collect::<Result<Vec<_>, Box<dyn Error>>>()?;
    std::fs::remove_file(&file)?;
    let builder = Counting::builder();
    let sums = [
        builder.subscribe_with(counting::sensor::base::numbers::sum, room),
        builder.subscribe_with(counting::estimator::base::slow, room),
    ];
    let mut replay = builder.replay()?;
    replay.play(entries)?;
    assert_eq!(replay.parameter(counting::param::pace), 39.0);
    let report_again = replay.stop();
    assert!(first == sums.each_ref().map(outputs), "every bit of every output, and its time");
    for (first, again) in report.estimators.iter().zip(&report_again.estimators) {
        assert_eq!((first.restarts, first.transitions), (again.restarts, again.transitions));
        let counts = |inputs: &[InputStatistics]| {
            let dropped =
                |input: &InputStatistics| DropReason::ALL.iter().map(|&reason| input.dropped(reason)).collect();
            inputs
                .iter()
                .map(|input| (input.name, input.received, dropped(input)))
                .collect::<Vec<(_, _, Vec<u64>)>>()
        };
        assert_eq!(counts(&first.inputs), counts(&again.inputs), "received, and dropped for which reason");
    }
    Ok(())
}
