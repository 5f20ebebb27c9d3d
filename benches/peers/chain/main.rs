//! A chain of sixteen components that pass on 80 bytes, between a source and a sink: ours beside Copper's.
//!
//! `cargo run --release --features copper --bin chain`; with `--json`, one object a line. A figure is the smallest of many
//! batches, which are run in turn.

mod copper;
mod ours;

use bb_core::Payload;
use std::time::Instant;

/// An inertial sensor's reading with a temperature.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    Payload,
    bincode::Encode,
    bincode::Decode,
    serde::Serialize,
    serde::Deserialize,
    cu29::prelude::Reflect,
)]
struct Inertial {
    values: [f64; 10],
}

impl Inertial {
    const ONES: Self = Self { values: [1.0; 10] };
}

const BATCHES: u32 = 200;
const ITERATIONS: u32 = 2_000;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let json = std::env::args().any(|argument| argument == "--json");
    let mut chain = ours::Ours::start()?;
    let mut timed = ours::Ours::start_timed()?;
    let ([chain_ns, timed_ns, copper_ns], taken) = copper::run(|copper| {
        let mut best = [f64::INFINITY; 3];
        for _ in 0..BATCHES {
            best[0] = best[0].min(batch(&mut || chain.iterate(&Inertial::ONES)));
            best[1] = best[1].min(batch(&mut || timed.iterate(&Inertial::ONES)));
            best[2] = best[2].min(batch(copper));
        }
        best
    })?;
    let all = u64::from(BATCHES * ITERATIONS);
    assert_eq!([chain.stop(), timed.stop(), taken], [all; 3], "every message has come to its sink");

    for (name, ours_ns) in [("chain_16/copper", chain_ns), ("chain_16_with_latency_budget/copper", timed_ns)] {
        let ratio = ours_ns / copper_ns;
        if json {
            let line = serde_json::json!({
                "name": name, "ours_ns": ours_ns, "beside_ns": copper_ns, "ratio": ratio,
            });
            println!("{line}");
        } else {
            println!("{name:<36} ours {ours_ns:>8.1} ns  beside {copper_ns:>8.1} ns  ratio {ratio:>6.3}");
        }
    }
    Ok(())
}

/// Nanoseconds of one iteration, in the mean over a batch.
fn batch(iterate: &mut dyn FnMut()) -> f64 {
    let start = Instant::now();
    (0..ITERATIONS).for_each(|_| iterate());
    start.elapsed().as_nanos() as f64 / f64::from(ITERATIONS)
}
