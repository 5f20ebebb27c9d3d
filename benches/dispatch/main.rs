//! Costs of the runtime: a hop from estimator to estimator, within an island, between two, and to a worker; a publish, an allocation, a
//! journal; what an estimator that hangs on a worker does to a chain beside it; and how long `stop` takes.
//!
//! `cargo bench -p bb-benches --bench dispatch -- --json` prints one JSON object a line; without `--json`, a table. Names of
//! files here (`chain`, `stop`) run those alone. Nanoseconds are the smallest of many batches, beside the same work without
//! the runtime, run in turn with it.

mod chain;
mod clock;
mod hand_over;
mod hang;
mod journal;
mod publish;
mod stop;

use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Cargo itself adds `--bench`.
    let json = std::env::args().any(|argument| argument == "--json");
    let names: Vec<String> = std::env::args().skip(1).filter(|argument| !argument.starts_with("--")).collect();
    // The last one may leave threads that hang.
    let measures: [(&str, Measure); 7] = [
        ("clock", || Ok(clock::measure())),
        ("chain", || Ok(chain::measure()?)),
        ("hand_over", hand_over::measure),
        ("publish", || Ok(publish::measure())),
        ("journal", || Ok(journal::measure()?)),
        ("hang", || Ok(hang::measure()?)),
        ("stop", stop::measure),
    ];
    for (name, measure) in measures {
        if names.is_empty() || names.iter().any(|wanted| wanted == name) {
            measure()?.iter().for_each(|line| line.print(json));
        }
    }
    Ok(())
}

type Measure = fn() -> Result<Vec<Line>, Box<dyn std::error::Error>>;

/// One measure.
enum Line {
    /// Nanoseconds beside nanoseconds.
    Beside { name: &'static str, ours_ns: f64, beside_ns: f64 },
    /// A figure of its own.
    Figure { name: &'static str, ours: f64, unit: &'static str },
}

impl Line {
    fn print(&self, json: bool) {
        match *self {
            Self::Beside { name, ours_ns, beside_ns } if json => {
                let ratio = ours_ns / beside_ns;
                let line = serde_json::json!({
                    "name": name, "ours_ns": ours_ns, "beside_ns": beside_ns, "ratio": ratio,
                });
                println!("{line}");
            }
            Self::Figure { name, ours, unit } if json => {
                println!("{}", serde_json::json!({ "name": name, "ours": ours, "unit": unit }))
            }
            Self::Beside { name, ours_ns, beside_ns } => {
                println!(
                    "{name:>28} {ours_ns:>10.1} ns, beside {beside_ns:>8.1} ns, {:>8.1} ns more",
                    ours_ns - beside_ns
                );
            }
            Self::Figure { name, ours, unit } => println!("{name:>28} {ours:>10.1} {unit}"),
        }
    }
}

/// Nanoseconds of one call of each: the smallest of batches that are run in turn.
fn in_turn(calls: u32, mut ours: impl FnMut(), mut beside: impl FnMut()) -> (f64, f64) {
    const BATCHES: usize = 60;
    let batch = |call: &mut dyn FnMut(u32)| {
        let start = Instant::now();
        call(calls);
        start.elapsed().as_nanos() as f64 / f64::from(calls)
    };
    let (mut best_ours, mut best_beside) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..BATCHES {
        best_ours = best_ours.min(batch(&mut |calls| (0..calls).for_each(|_| ours())));
        best_beside = best_beside.min(batch(&mut |calls| (0..calls).for_each(|_| beside())));
    }
    (best_ours, best_beside)
}
