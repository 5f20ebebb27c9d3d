//! 2,000 sensors at 100 Hz for 5 s: how many of the readings that were due were taken, beside as many threads that do nothing
//! but sleep until the next one is due.
//!
//! `cargo bench -p bb-benches --bench sensors --features large` prints one JSON object a line. Without the feature there are 20
//! sensors, so that a check of the workspace is not held up.

use bb_core::prelude::*;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Instant;

/// Counts up.
#[derive(Debug)]
struct Counter(u64);

/// Number of times that it was read.
#[derive(Clone, Copy, Debug, Payload)]
struct Count {
    value: u64,
}

impl Sensor for Counter {
    type Options = NoOptions;
    type Output = Count;

    fn init(_: NoOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self(0))
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Count>, Fault> {
        self.0 += 1;
        Ok(Reading::now(Count { value: self.0 }))
    }
}

/// Declares the same sensors in each of the links.
macro_rules! rack {
    (joints: $($joint:ident)*; links: $($link:ident)*; sensors: $($sensor:ident)*;) => {
        rack! { @ $($joint $link)*; { $(sensor $sensor: Counter() { rate: 100 Hz; })* } }
    };
    (@ $($joint:ident $link:ident)*; $sensors:tt) => {
        robot! {
            robot Rack;
            link base { $(joint $joint: fixed { link $link $sensors })* }
        }
    };
}

// Takes three minutes to build in release.
#[cfg(feature = "large")]
rack! {
    joints: j0 j1 j2 j3 j4 j5 j6 j7 j8 j9 j10 j11 j12 j13 j14 j15 j16 j17 j18 j19
        j20 j21 j22 j23 j24 j25 j26 j27 j28 j29 j30 j31 j32 j33 j34 j35 j36 j37 j38 j39;
    links: l0 l1 l2 l3 l4 l5 l6 l7 l8 l9 l10 l11 l12 l13 l14 l15 l16 l17 l18 l19
        l20 l21 l22 l23 l24 l25 l26 l27 l28 l29 l30 l31 l32 l33 l34 l35 l36 l37 l38 l39;
    sensors: s0 s1 s2 s3 s4 s5 s6 s7 s8 s9 s10 s11 s12 s13 s14 s15 s16 s17 s18 s19
        s20 s21 s22 s23 s24 s25 s26 s27 s28 s29 s30 s31 s32 s33 s34 s35 s36 s37 s38 s39
        s40 s41 s42 s43 s44 s45 s46 s47 s48 s49;
}

#[cfg(not(feature = "large"))]
rack! {
    joints: j0 j1;
    links: l0 l1;
    sensors: s0 s1 s2 s3 s4 s5 s6 s7 s8 s9;
}

const SENSORS: usize = if cfg!(feature = "large") { 2_000 } else { 20 };
const PERIOD: Duration = Duration::from_millis(10);
const WARM_UP: Duration = Duration::from_secs(1);
const MEASURED: Duration = Duration::from_secs(5);

fn main() -> Result<(), StartError> {
    let begin = Instant::now();
    let running = Rack::builder().start()?;
    let start_ms = begin.elapsed().as_secs_f64() * 1e3;
    let ours = fraction(|| {
        let report = running.report();
        let counts: Vec<u64> =
            report.topics.iter().filter(|topic| topic.payload == "Count").map(|topic| topic.published).collect();
        assert_eq!(counts.len(), SENSORS, "every sensor has a topic");
        counts
    });
    let begin = Instant::now();
    drop(running.stop());
    let stop_ms = begin.elapsed().as_secs_f64() * 1e3;
    let beside = threads();
    for (name, ours, beside) in
        [("readings_taken", ours.all, beside.all), ("readings_taken_least", ours.least, beside.least)]
    {
        let line = serde_json::json!({
            "name": name, "sensors": SENSORS, "unit": "of those due",
            "ours": ours, "beside": beside, "ratio": ours / beside,
        });
        println!("{line}");
    }
    for (name, ours) in [("start", start_ms), ("stop", stop_ms)] {
        println!("{}", serde_json::json!({ "name": name, "sensors": SENSORS, "unit": "ms", "ours": ours }));
    }
    Ok(())
}

/// Readings taken, as a fraction of those due.
struct Fraction {
    all: f64,
    /// Fraction of the sensor that was read least.
    least: f64,
}

fn fraction(counts: impl Fn() -> Vec<u64>) -> Fraction {
    std::thread::sleep(WARM_UP);
    let begin = Instant::now();
    let before = counts();
    std::thread::sleep(MEASURED);
    let due = begin.elapsed().as_secs_f64() / PERIOD.as_secs_f64();
    let taken: Vec<u64> = counts().iter().zip(before).map(|(after, before)| after - before).collect();
    let least = taken.iter().min().map_or(0.0, |least| *least as f64 / due);
    Fraction { all: taken.iter().sum::<u64>() as f64 / (due * taken.len() as f64), least }
}

/// A thread for each, which skips what it missed, as the runtime does.
fn threads() -> Fraction {
    let is_over = AtomicBool::new(false);
    let counts: Vec<AtomicU64> = (0..SENSORS).map(|_| AtomicU64::new(0)).collect();
    std::thread::scope(|scope| {
        for count in &counts {
            let is_over = &is_over;
            scope.spawn(move || {
                let mut due = Instant::now();
                while !is_over.load(Ordering::Relaxed) {
                    std::thread::sleep(due.saturating_duration_since(Instant::now()));
                    count.fetch_add(1, Ordering::Relaxed);
                    while due <= Instant::now() {
                        due += PERIOD;
                    }
                }
            });
        }
        let fraction = fraction(|| counts.iter().map(|count| count.load(Ordering::Relaxed)).collect());
        is_over.store(true, Ordering::Relaxed);
        fraction
    })
}
