//! Plays samples in motion through one filter, for callgrind to count; the commands are in `book/src/laboratory/attitude.md`.
//!
//! `instructions FILE FILTER six|nine UPDATES [each]`: in one call, as `benches/peers` counts; with `each` one call an update.

use bb_core::nalgebra::UnitQuaternion;
use bb_estimators::attitude::ImuSample;
use bb_eval::{Axes, Chosen, End, Recording, Running, Topics};
use std::error::Error;
use std::hint::black_box;
use std::path::Path;

/// Number of samples that are read for any number of updates, so that the difference of two runs is the filter's alone.
const SAMPLES: usize = 20_000;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let ([file, name, axes, updates], each) = (match &*arguments {
        [four @ .., each] if each == "each" => (four, true),
        all => (all, false),
    }) else {
        return Err("write: instructions FILE FILTER six|nine UPDATES [each]".into());
    };
    let axes = if axes == "six" { Axes::Six } else { Axes::Nine };
    let mut filter = Chosen::named(name, axes, &[])?.start()?;
    let mut recording = Recording::open(Path::new(file), &Topics::default(), axes, Some(0.0))?;
    let mut samples = Vec::new();
    while samples.len() < SAMPLES && matches!(recording.read(&mut samples, SAMPLES)?, End::NotYet) {}
    let samples = samples.get(..updates.parse()?).ok_or("the recording has not so many samples in motion")?;
    let mut estimates = Vec::with_capacity(SAMPLES);
    if each {
        for sample in samples {
            one(&mut *filter, sample, &mut estimates);
        }
    } else {
        filter.run(samples, &mut estimates);
    }
    black_box(estimates);
    Ok(())
}

/// One update with reading the orientation after it. A function of its own, for callgrind to dump after.
#[inline(never)]
fn one(filter: &mut dyn Running, sample: &ImuSample, estimates: &mut Vec<Option<UnitQuaternion<f64>>>) {
    filter.run(std::slice::from_ref(sample), estimates);
}
