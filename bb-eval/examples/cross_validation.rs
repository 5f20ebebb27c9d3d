//! Cross-validation of the parameters of `Mekf`: how much worse are those that fit some recordings best on the others?
//!
//! `cross_validation FILE…`: five parameters at half, one and two times their defaults on all recordings from rest; the mean
//! total error decides. `docs/attitude-filter.md` has what it prints for ten trials of BROAD.

use bb_estimators::attitude::FilterParams;
use bb_estimators::params::{Params, Value};
use bb_eval::{Axes, Chosen, Degrees, Evaluator, Progress, Setting, Topics, Variants, evaluate};
use std::error::Error;
use std::path::{Path, PathBuf};

const PARAMETERS: [&str; 5] =
    ["calibration_error", "gyroscope_rate_noise", "field_disturbance", "velocity", "acceleration_time"];

const FACTORS: [f64; 3] = [0.5, 1.0, 2.0];

/// The index of the defaults in the grid.
const DEFAULTS: usize = GRID / 2;

const GRID: usize = FACTORS.len().pow(PARAMETERS.len() as u32);

/// The errors of every setting of the grid on one recording.
type Scores = Vec<Degrees>;

fn main() -> Result<(), Box<dyn Error>> {
    let files: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    if files.len() < 4 {
        return Err("write: cross_validation FILE…, four recordings or more".into());
    }
    let filters = (0..GRID).map(setting).collect::<Result<Vec<_>, _>>()?;
    let scores = files.iter().map(|file| scores(file, &filters)).collect::<Result<Vec<_>, _>>()?;
    let all: Vec<usize> = (0..files.len()).collect();

    for (name, of) in [("total", total as fn(&Degrees) -> f64), ("inclination", inclination)] {
        let mut means: Vec<_> = (0..GRID).map(|point| mean(&scores, &all, point, of)).collect();
        let defaults = means[DEFAULTS];
        means.sort_by(f64::total_cmp);
        println!(
            "{GRID} settings, mean {name}: {:.3} to {:.3}, median {:.3}, defaults {defaults:.3}",
            means[0],
            means[GRID - 1],
            means[GRID / 2]
        );
    }

    let evens: Vec<usize> = all.iter().copied().step_by(2).collect();
    let half: Vec<usize> = all[..files.len() / 2].to_vec();
    for fitted in [evens, half] {
        let others = without(&all, &fitted);
        for (fitted, held_out) in [(&fitted, &others), (&others, &fitted)] {
            let best = best(&scores, fitted);
            println!(
                "fitted on {}; held out: total {:.2} / {:.2}, inclination {:.2} / {:.2}; defaults there {:.2}, {:.2}",
                names(&files, fitted),
                mean(&scores, held_out, best, total),
                worst(&scores, held_out, best, total),
                mean(&scores, held_out, best, inclination),
                worst(&scores, held_out, best, inclination),
                mean(&scores, held_out, DEFAULTS, total),
                mean(&scores, held_out, DEFAULTS, inclination),
            );
        }
    }
    let each: Vec<_> =
        all.iter().map(|&left_out| scores[left_out][best(&scores, &without(&all, &[left_out]))]).collect();
    let count = each.len() as f64;
    println!(
        "fitted on all but one, each in turn; held out: total {:.2} / {:.2}, inclination {:.2}",
        each.iter().map(total).sum::<f64>() / count,
        each.iter().map(total).fold(0.0, f64::max),
        each.iter().map(inclination).sum::<f64>() / count,
    );
    Ok(())
}

/// The filter at one point of the grid.
fn setting(point: usize) -> Result<Chosen, Box<dyn Error>> {
    let defaults = FilterParams::named("mekf").ok_or("there is a filter `mekf`")?;
    let mut digits = point;
    let mut settings = Vec::new();
    for name in PARAMETERS {
        let Some(Value::Number(default)) = defaults.get(name) else {
            return Err(format!("no number {name}").into());
        };
        settings.push(format!("{name}={}", default * FACTORS[digits % FACTORS.len()]).parse::<Setting>()?);
        digits /= FACTORS.len();
    }
    Ok(Chosen::named("mekf", Axes::Nine, &settings)?)
}

fn scores(file: &Path, filters: &[Chosen]) -> Result<Scores, Box<dyn Error>> {
    let evaluator = Evaluator {
        filters: filters.to_vec(),
        axes: Axes::Nine,
        topics: Topics::default(),
        before_motion_s: None,
        variants: Variants::default(),
        keep_errors: false,
    };
    let runs = evaluate(file, &evaluator, &Progress::new("", 0)).runs?;
    let scores = runs.into_iter().map(|run| run.score.rms().ok_or("no sample moves and has truth"));
    Ok(scores.collect::<Result<_, _>>()?)
}

fn total(errors: &Degrees) -> f64 {
    errors.total
}

fn inclination(errors: &Degrees) -> f64 {
    errors.inclination
}

fn mean(scores: &[Scores], recordings: &[usize], point: usize, of: fn(&Degrees) -> f64) -> f64 {
    recordings.iter().map(|&recording| of(&scores[recording][point])).sum::<f64>() / recordings.len() as f64
}

fn worst(scores: &[Scores], recordings: &[usize], point: usize, of: fn(&Degrees) -> f64) -> f64 {
    recordings.iter().map(|&recording| of(&scores[recording][point])).fold(0.0, f64::max)
}

/// The point of the grid with the least mean total error.
fn best(scores: &[Scores], recordings: &[usize]) -> usize {
    let mean = |point: &usize| mean(scores, recordings, *point, total);
    (0..GRID).min_by(|a, b| mean(a).total_cmp(&mean(b))).unwrap_or(DEFAULTS)
}

fn without(all: &[usize], some: &[usize]) -> Vec<usize> {
    all.iter().copied().filter(|recording| !some.contains(recording)).collect()
}

/// The first words of the names.
fn names(files: &[PathBuf], recordings: &[usize]) -> String {
    let first = |&recording: &usize| {
        let name = files[recording].file_stem().unwrap_or_default().to_string_lossy();
        name.split('_').next().unwrap_or_default().to_owned()
    };
    recordings.iter().map(first).collect::<Vec<_>>().join(" ")
}
