//! Whether a filter has accepted its input.

use super::doubt::{distrusted, is_most};
use super::measured::Sensor;
use super::step::Step;

/// Of one sensor.
#[derive(Debug, Default)]
struct Verdict {
    all: u64,
    refused: u64,
    first: Option<String>,
}

/// The results of the IMU samples, of the measurements, and of the observations of landmarks.
#[derive(Debug, Default)]
pub(crate) struct Verdicts {
    samples: Verdict,
    landmarks: Verdict,
    measured: [Verdict; Sensor::ALL.len()],
}

impl Verdicts {
    /// Adds the results of a step to a keyframe, over this many samples.
    pub(crate) fn add(&mut self, step: &Step, samples: usize) {
        let (refused, first) = &step.samples;
        self.samples.all += samples as u64;
        self.samples.refused += refused;
        if self.samples.first.is_none() {
            self.samples.first.clone_from(first);
        }
        let seen = &step.landmarks;
        self.landmarks.all += seen.all;
        self.landmarks.refused += seen.refused;
        if self.landmarks.first.is_none() {
            self.landmarks.first = seen.first.map(|refusal| refusal.to_string());
        }
        for (verdict, taken) in self.measured.iter_mut().zip(&step.taken) {
            let Some(taken) = taken else { continue };
            verdict.all += 1;
            if let Err(why) = taken {
                verdict.refused += 1;
                verdict.first.get_or_insert_with(|| why.clone());
            }
        }
    }

    /// The sensors with more than half refused, and why the first was.
    pub(crate) fn doubts(&self) -> Vec<String> {
        let names = Sensor::ALL.iter().map(|sensor| sensor.name());
        let all = std::iter::once(("samples of the IMU", &self.samples)).chain(names.zip(&self.measured));
        let all = all.chain(std::iter::once(("observations of landmarks", &self.landmarks)));
        let refused = all.filter(|(_, verdict)| is_most(verdict.refused, verdict.all));
        let said = |(name, Verdict { all, refused, first }): (&str, &Verdict)| {
            let why = first.as_ref().map_or_else(String::new, |why| format!(" (the first: {why})"));
            distrusted(&format!("{refused} of {all} {name} were refused{why}"))
        };
        refused.map(said).collect()
    }
}
