//! Error-state Kalman filters with an IMU: ours beside those of `multicalc` and `eskf`; time and instructions of a sample, and of
//! updates by a position and by a height.
//!
//! `cargo run --release --bin navigation`; with `--json`, one object a line. A time is the smallest of many batches, which are
//! run in turn. `README.md` says what each filter computes.

mod readings;
mod sides;

use bb_benches::callgrind;
use readings::{READINGS, Reading, readings};
use serde_json::json;
use sides::{EskfCrate, Multicalc, Navigating, Ours};
use std::error::Error;
use std::hint::black_box;
use std::time::Instant;

const BATCHES: u32 = 300;

/// Steps of the two runs under callgrind that are subtracted.
const SHORT: usize = 1000;
const LONG: usize = READINGS;

/// The argument that makes this program a run to be counted.
const COUNT: &str = "count";

/// Work of a filter for a reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum What {
    /// Takes the sample of the IMU.
    Predict,
    /// Prediction and update with the position.
    Position,
    /// Prediction and update with the height alone.
    Height,
}

const WHAT: [(&str, What); 3] =
    [("predict_and_position", What::Position), ("predict_and_height", What::Height), ("predict", What::Predict)];

/// A filter by name.
type Side = (&'static str, fn(What, &[Reading]) -> Result<(), Box<dyn Error>>);

const OURS: Side = ("ours", run::<Ours>);
const PEERS: [Side; 3] = [
    ("multicalc", run::<Multicalc<false>>),
    ("multicalc_naive", run::<Multicalc<true>>),
    ("eskf", run::<EskfCrate>),
];

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [word, side, what, steps] = &*arguments
        && word == COUNT
    {
        let (_, run) = sides().find(|(name, _)| name == side).ok_or("no such filter")?;
        let (_, what) = WHAT.into_iter().find(|(name, _)| name == what).ok_or("nothing that a filter does")?;
        return run(what, readings().get(..steps.parse()?).ok_or("too many steps")?);
    }
    let json = arguments.iter().any(|argument| argument == "--json");
    let times = costs(&times()?);
    let [ours, peers @ ..] = &*times else { return Err("no filter".into()) };
    for ((peer, _), beside) in PEERS.iter().zip(peers) {
        print(json, peer, "ns", ours, beside);
    }
    let counted = sides().map(|side| instructions(side.0)).collect::<Result<Vec<_>, _>>();
    match counted.map(|counted| costs(&counted)).as_deref() {
        Ok([ours, peers @ ..]) => {
            for ((peer, _), beside) in PEERS.iter().zip(peers) {
                print(json, peer, "instructions", ours, beside);
            }
        }
        Ok([]) => {}
        Err(error) => eprintln!("left out: instructions: {error}"),
    }
    Ok(())
}

fn sides() -> impl Iterator<Item = Side> {
    std::iter::once(OURS).chain(PEERS)
}

/// Runs the filter `F` on the readings, and checks that it stays where it is, if it is told.
fn run<F: Navigating>(what: What, readings: &[Reading]) -> Result<(), Box<dyn Error>> {
    let mut filter = F::start()?;
    // One loop for each, so that none asks which it is.
    match what {
        What::Predict => {
            for reading in readings {
                filter.predict(black_box(reading))?;
            }
        }
        What::Position => {
            for reading in readings {
                filter.predict(black_box(reading))?;
                filter.position(black_box(reading))?;
            }
        }
        What::Height => {
            for reading in readings {
                filter.predict(black_box(reading))?;
                filter.height(black_box(reading))?;
            }
        }
    }
    let told = match what {
        What::Predict => 0.0,
        What::Position => filter.at().norm(),
        What::Height => filter.at().z.abs(),
    };
    // A NaN is not less.
    if told < 1.0 { Ok(()) } else { Err(format!("{what:?}: a filter at rest is at {}", filter.at()).into()) }
}

/// Measures nanoseconds per step, of each side, of each of [`WHAT`].
fn times() -> Result<Vec<[f64; 3]>, Box<dyn Error>> {
    let readings = readings();
    let mut least = vec![[f64::INFINITY; 3]; sides().count()];
    for _ in 0..BATCHES {
        for ((_, run), least) in sides().zip(&mut least) {
            for ((_, what), least) in WHAT.into_iter().zip(least) {
                let began = Instant::now();
                run(what, &readings)?;
                *least = least.min(began.elapsed().as_nanos() as f64 / readings.len() as f64);
            }
        }
    }
    Ok(least)
}

/// Counts instructions per step of each of [`WHAT`].
fn instructions(side: &str) -> Result<[f64; 3], Box<dyn Error>> {
    let mut counted = [0.0; 3];
    for ((what, _), counted) in WHAT.into_iter().zip(&mut counted) {
        *counted = callgrind::per_step(&[], SHORT, LONG, |steps| {
            [COUNT, side, what, &steps.to_string()].map(String::from).to_vec()
        })?;
    }
    Ok(counted)
}

/// Returns the costs of a sample, and of the updates without the samples before them.
fn costs(sides: &[[f64; 3]]) -> Vec<[(&'static str, f64); 3]> {
    let cost = |&[position, height, predict]: &[f64; 3]| {
        [("predict", predict), ("position", position - predict), ("height", height - predict)]
    };
    sides.iter().map(cost).collect()
}

fn print(json: bool, peer: &str, unit: &str, ours: &[(&str, f64); 3], beside: &[(&str, f64); 3]) {
    for ((what, ours), (_, beside)) in ours.iter().zip(beside) {
        let name = format!("eskf/{peer}/{what}/{unit}");
        let ratio = ours / beside;
        if json {
            println!("{}", json!({ "name": name, "ours": ours, "beside": beside, "ratio": ratio }));
        } else {
            println!("{name:44} ours {ours:9.1}  beside {beside:9.1}  ratio {ratio:6.3}");
        }
    }
}
