//! Attitude filters beside those of other projects, on the same samples and by the same score: errors over a folder of
//! recordings, and instructions per update under callgrind. `README.md` says how to run it.

mod callgrind;
mod pairs;
mod peers;

use bb_eval::{Averages, Chosen, Degrees, End, Recording, Running, Score, Setting, Topics};
use bb_estimators::attitude::ImuSample;
use nalgebra::UnitQuaternion;
use pairs::{PAIRS, Pair};
use std::error::Error;
use std::path::{Path, PathBuf};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let Some(count) = callgrind::Count::parse(&arguments) {
        return callgrind::run(&count);
    }
    let json = arguments.iter().any(|argument| argument == "--json");
    let folder = arguments.iter().find(|argument| !argument.starts_with("--"));
    let folder = match folder {
        Some(folder) => PathBuf::from(folder),
        None => Path::new(&std::env::var("BB_DATA").map_err(|_| "name a folder of recordings, or set BB_DATA")?).join("broad"),
    };
    let files = recordings(&folder)?;
    for pair in PAIRS {
        if ours(pair).is_err() {
            eprintln!("left out: {}: there is no filter {} here", pair.name, pair.ours);
            continue;
        }
        compare(pair, &files, json)?;
    }
    Ok(())
}

/// One line a figure: ours, the peer's beside it, and their ratio; below 1 is better.
fn compare(pair: &Pair, files: &[PathBuf], json: bool) -> Result<(), Box<dyn Error>> {
    let [ours, beside] = [Side::Ours, Side::Peer].map(|side| mean(pair, side, files));
    let (ours, beside) = (ours?, beside?);
    let mut figures = vec![("inclination_deg", ours.inclination, beside.inclination)];
    if pair.nine() {
        figures.insert(0, ("heading_deg", ours.heading, beside.heading));
        figures.insert(0, ("total_deg", ours.total, beside.total));
    }
    let file = files.last().ok_or("no recording")?;
    let [ours, beside] = [Side::Ours, Side::Peer].map(|side| callgrind::instructions(pair, side, file));
    match (ours, beside) {
        (Ok(ours), Ok(beside)) => figures.push(("instructions", ours, beside)),
        (Err(error), _) | (_, Err(error)) => eprintln!("left out: {}: instructions: {error}", pair.name),
    }
    for (what, ours, beside) in figures {
        let name = format!("{}/{what}", pair.name);
        let ratio = ours / beside;
        if json {
            println!("{}", serde_json::json!({ "name": name, "ours": ours, "beside": beside, "ratio": ratio }));
        } else {
            println!("{name:52} ours {ours:9.3}  beside {beside:9.3}  ratio {ratio:6.3}");
        }
    }
    Ok(())
}

/// Side of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    Ours,
    Peer,
}

/// The mean of the root mean squares over the recordings.
fn mean(pair: &Pair, side: Side, files: &[PathBuf]) -> Result<Degrees, Box<dyn Error>> {
    let mut scores = Vec::new();
    for file in files {
        let mut recording = Recording::open(file, &Topics::default(), pair.axes, None)?;
        let mut samples = Vec::new();
        while let End::NotYet = recording.read(&mut samples, usize::MAX)? {}
        let mut estimates = Vec::with_capacity(samples.len());
        start(pair, side)?.run(&samples, &mut estimates);
        let enu_from_world = if side == Side::Ours { UnitQuaternion::identity() } else { (pair.peer)().enu_from_world };
        let mut score = Score::default();
        for (sample, estimate) in samples.iter().zip(&estimates) {
            if let Some(estimate) = estimate {
                score.add_at(&recording.truth, sample.time_ns, &(enu_from_world * estimate));
            }
        }
        let name = file.display();
        scores.push(score.rms().ok_or_else(|| format!("{name}: no sample moves and has truth"))?);
    }
    Ok(Averages::of(scores).ok_or("no recording")?.mean)
}

fn start(pair: &Pair, side: Side) -> Result<Box<dyn Running>, Box<dyn Error>> {
    match side {
        Side::Ours => Ok(ours(pair)?.start()?),
        Side::Peer => Ok((pair.peer)().running),
    }
}

fn ours(pair: &Pair) -> Result<Chosen, String> {
    let settings = pair.settings.iter().map(|text| text.parse()).collect::<Result<Vec<Setting>, _>>()?;
    Chosen::named(pair.ours, pair.axes, &settings)
}

/// The samples from the first motion on.
fn in_motion(pair: &Pair, file: &Path, most: usize) -> Result<Vec<ImuSample>, Box<dyn Error>> {
    let mut recording = Recording::open(file, &Topics::default(), pair.axes, Some(0.0))?;
    let mut samples = Vec::with_capacity(most);
    while let End::NotYet = recording.read(&mut samples, most)? {
        if samples.len() == most {
            return Ok(samples);
        }
    }
    Err(format!("{}: fewer than {most} samples after the first motion", file.display()).into())
}

fn recordings(folder: &Path) -> Result<Vec<PathBuf>, Box<dyn Error>> {
    let entries = std::fs::read_dir(folder)
        .map_err(|error| format!("{}: {error}; name the folder of the recordings", folder.display()))?;
    let files = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let mut files: Vec<_> = files.filter(|file| file.extension().is_some_and(|end| end == "mcap")).collect();
    files.sort();
    Ok(files)
}
