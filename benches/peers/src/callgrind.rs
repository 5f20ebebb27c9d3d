//! Instructions per update, over the same samples in motion; `bb_benches::callgrind` says how they are counted.

use crate::pairs::{PAIRS, Pair};
use crate::{Side, in_motion, start};
use bb_benches::callgrind::per_step;
use std::error::Error;
use std::hint::black_box;
use std::path::Path;

const SHORT: usize = 2000;
const LONG: usize = 12_000;

/// The argument that makes this program a run to be counted.
const COUNT: &str = "count";

/// A run to be counted.
pub struct Count {
    pair: &'static Pair,
    side: Side,
    updates: usize,
    file: String,
}

impl Count {
    pub fn parse(arguments: &[String]) -> Option<Self> {
        let [word, pair, side, updates, file] = arguments else { return None };
        let pair = PAIRS.iter().find(|candidate| candidate.name == *pair)?;
        let side = if side == "ours" { Side::Ours } else { Side::Peer };
        (word == COUNT).then_some(Self { pair, side, updates: updates.parse().ok()?, file: file.clone() })
    }
}

/// Reads as many samples whatever the length, and plays the first of them.
pub fn run(count: &Count) -> Result<(), Box<dyn Error>> {
    let samples = in_motion(count.pair, Path::new(&count.file), LONG)?;
    let mut estimates = Vec::with_capacity(LONG);
    let mut filter = start(count.pair, count.side)?;
    filter.run(samples.get(..count.updates).ok_or("too many updates")?, &mut estimates);
    black_box(estimates);
    Ok(())
}

/// Instructions per update, with reading the orientation after each.
pub fn instructions(pair: &Pair, side: Side, file: &Path) -> Result<f64, Box<dyn Error>> {
    let side = if side == Side::Ours { "ours" } else { "peer" };
    let file = file.to_str().ok_or_else(|| format!("{}: a name that is not UTF-8", file.display()))?;
    per_step(&[], SHORT, LONG, |updates| {
        [COUNT, pair.name, side, &updates.to_string(), file].map(String::from).to_vec()
    })
}
