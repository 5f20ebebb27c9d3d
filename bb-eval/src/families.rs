//! The families of motions, fields and faults that attitude filters are compared on: recordings as they are, the same
//! made harder, and simulated bodies with known truth. `bb eval families` is this module on the command line.

mod list;
mod report;
mod scored;
mod simulated;
mod trial;

pub use list::{FAMILIES, Family, Half, Measure};
pub use report::{families_json, families_list, families_table};
pub use scored::{FamilyScore, Share};

use crate::filters::{Axes, Chosen};
use crate::progress::Progress;
use list::Source;
use scored::{TrialScore, score};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use trial::Trial;

/// The filter that the others are compared with.
const REFERENCE: &str = "vqf";

/// A recording or a simulated body, with the families that contain it.
struct Unit {
    made: Made,
    /// Indices into the families.
    families: Vec<usize>,
}

enum Made {
    Read(PathBuf),
    Simulated(simulated::Body, u64),
}

/// Scores filters on families, on all cores. VQF is added if it is not among the filters, because the ratios refer to it.
///
/// The folder contains the recordings, in `broad`, `phones` and `navigation`; without it, only simulated families are
/// scored.
///
/// # Errors
/// A family lacks its recordings, one of them cannot be read, or a filter cannot be created; in words.
pub fn score_families(
    data: Option<&Path>,
    families: &[&'static Family],
    filters: &[Chosen],
) -> Result<Vec<FamilyScore>, String> {
    let mut filters = filters.to_vec();
    if filters.iter().all(|filter| filter.name() != REFERENCE) {
        filters.insert(0, Chosen::named(REFERENCE, Axes::Nine, &[])?);
    }
    let units = units(data, families)?;
    let progress = Progress::new("scoring", units.len() as u64);
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Vec::new());
    let cores = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| {
        for _ in 0..cores.min(units.len()) {
            scope.spawn(|| {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some(unit) = units.get(index) else { break };
                    let scores = unit.score(families, &filters);
                    // A thread that panicked leaves the list intact.
                    done.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).push((index, scores));
                    progress.add(1);
                }
            });
        }
    });
    progress.finish();
    let mut done = done.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner());
    done.sort_by_key(|(index, _)| *index);
    let mut rows: Vec<FamilyScore> = families
        .iter()
        .flat_map(|family| filters.iter().map(|filter| FamilyScore::new(family, filter.name())))
        .collect();
    for (_, scores) in done {
        for (family, filter, score) in scores? {
            if let Some(row) = rows.get_mut(family * filters.len() + filter) {
                row.add(score);
            }
        }
    }
    Ok(rows)
}

/// Lists the recordings to read and the bodies to simulate, each once.
fn units(data: Option<&Path>, families: &[&'static Family]) -> Result<Vec<Unit>, String> {
    let mut units: Vec<Unit> = Vec::new();
    for (index, family) in families.iter().enumerate() {
        let files = match family.source {
            Source::Simulated(body) => {
                let seeds = body.trials();
                units.extend(
                    (0..seeds).map(|seed| Unit { made: Made::Simulated(body, seed), families: vec![index] }),
                );
                continue;
            }
            Source::Recordings { folder, words } => {
                let data = data.ok_or_else(|| format!("{} needs recordings; name their folder", family.name))?;
                trial::files(&data.join(folder), words).map_err(|fault| format!("{}: {fault}", family.name))?
            }
        };
        for file in files {
            let is_it = |unit: &&mut Unit| matches!(&unit.made, Made::Read(other) if *other == file);
            match units.iter_mut().find(is_it) {
                Some(unit) => unit.families.push(index),
                None => units.push(Unit { made: Made::Read(file), families: vec![index] }),
            }
        }
    }
    Ok(units)
}

impl Unit {
    /// The scores of all filters in all families: index of the family, index of the filter, score.
    fn score(
        &self,
        families: &[&'static Family],
        filters: &[Chosen],
    ) -> Result<Vec<(usize, usize, TrialScore)>, String> {
        let whole = match &self.made {
            Made::Read(file) => Trial::read(file).map_err(|fault| format!("{}: {fault}", file.display()))?,
            Made::Simulated(body, seed) => body.trial(*seed),
        };
        let mut scores = Vec::new();
        for &index in &self.families {
            let Some(family) = families.get(index) else { continue };
            for part in 0..family.change.trials() {
                let changed = family.change.applied(&whole, part);
                let trial = changed.as_ref().unwrap_or(&whole);
                for (number, filter) in filters.iter().enumerate() {
                    let mut running = filter.on(family.axes)?.start()?;
                    scores.push((index, number, score(&mut *running, trial, family.axes)));
                }
            }
        }
        Ok(scores)
    }
}
