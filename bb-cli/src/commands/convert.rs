//! `bb convert`: converts recordings of other programs to bags.

mod cells;
mod columns;
mod entry;
mod input;
mod join;
mod nmea;
mod ros1;
mod rtklib;
mod source;
mod ulog;
mod units;
mod write;

use bb_eval::Progress;
use clap::Args;
use columns::{Quantity, What, has};
use entry::Entry;
use input::{Format, Input, Source};
use join::Join;
use std::path::{Path, PathBuf};

/// Converts recordings of other programs to a ROS 2 bag: an IMU on /imu, its magnetometer on /mag, fixes on /fix, truth on
/// /truth, and whether it moves on /moving.
///
/// INPUT is a CSV, a bag of ROS 1, a log of PX4 (ULog), sentences of a receiver (NMEA), a solution of RTKLIB (.pos), or a
/// description of several such files (.toml).
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// The file to convert, or `-` for a CSV on the standard input.
    #[arg(value_name = "INPUT")]
    input: PathBuf,
    /// The bag to write, which must not exist yet.
    #[arg(value_name = "OUT.mcap")]
    out: PathBuf,
    /// Contents of the columns of a CSV, with their units: QUANTITY=COLUMNS[:UNIT], separated by spaces.
    #[arg(long, value_name = "MAP", num_args = 1.., value_delimiter = ' ', long_help = MAP)]
    columns: Vec<Quantity>,
    /// The rate of the samples in Hz, for a CSV without times.
    #[arg(long, value_name = "HZ", value_parser = rate)]
    rate: Option<f64>,
    /// A further file on the same clock, with the map of its columns if it is a CSV; any number of times.
    #[arg(long, value_name = "FILE [MAP]", value_parser = Input::parse)]
    with: Vec<Input>,
}

const MAP: &str = "Contents of the columns of a CSV, with their units: QUANTITY=COLUMNS[:UNIT], separated by spaces.

  time    s (default), ms, us, ns; time=1:ms@1700000000.5 if the clock began then, s since 1970
  gyr     angular velocity: rad/s (default), deg/s
  acc     specific force: m/s2 (default), g, mg
  mag     magnetic field: T (default), mT, uT, nT, G, mG
  fix     latitude and longitude in degrees, height above the ellipsoid in m
  dev     standard deviations of the fix, horizontal and vertical: m (default), cm, mm
  quat    true orientation, sensor to east, north, up: wxyz (default), xyzw
  pos     true position: m (default), cm, mm
  moving  0 or 1: errors are scored while it is 1

COLUMNS are names, or numbers from 1, separated by commas; 2-4 means 2,3,4, and gyr_* means gyr_x,gyr_y,gyr_z. A unit in brackets \
at the end of a name may be omitted. A unit may have a factor: mag=12-14:50uT for a field in multiples of 50 µT.";

const EXAMPLES: &str = "Examples:
  bb convert log.csv log.mcap --columns time=t:us gyr=gyr_*:deg/s acc=acc_*:g mag=mag_*:uT
  bb convert walk.csv walk.mcap --rate 100 --columns gyr=1-3 acc=4-6 mag=7-9:uT quat=10-13
  bb convert gyroscope.txt phone.mcap --columns time=1 gyr=2-4 --with 'accelerometer.txt time=1 acc=2-4'
  bb convert phone.toml phone.mcap
  bb convert drive.bag drive.mcap";

fn rate(text: &str) -> Result<f64, String> {
    text.parse().map_err(|_| "not a number".to_owned()).and_then(hertz)
}

fn hertz(rate: f64) -> Result<f64, String> {
    match rate > 0.0 && rate <= 1e6 {
        true => Ok(rate),
        false => Err("must be above 0 and at most 1000000 Hz".into()),
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<bool, String> {
    let Arguments { input, out, columns, rate, with } = arguments;
    let first = Input { file: input.clone(), columns: columns.clone(), rate: *rate, topic: None };
    let mut inputs = Vec::new();
    for input in std::iter::once(&first).chain(with) {
        inputs.extend(files(input)?);
    }
    for (input, format) in &inputs {
        input.check(*format).map_err(|fault| in_file(&input.file, fault))?;
    }
    if let [(bag, Format::Ros1)] = &inputs[..] {
        return write(out, |each| ros1::each(&bag.file, each).map_err(|fault| in_file(&bag.file, fault)));
    }
    if let Some((bag, _)) = inputs.iter().find(|(_, format)| *format == Format::Ros1) {
        return Err(in_file(&bag.file, "a bag of ROS 1 is converted alone, since it has topics of its own".into()));
    }
    check_columns(&inputs)?;
    let mut sources = Vec::new();
    for (input, format) in &inputs {
        sources.push(Source::open(input, *format).map_err(|fault| in_file(&input.file, fault))?);
    }
    write(out, |each| merge(sources, each))
}

/// The input with its format, or the files of a description with theirs.
fn files(input: &Input) -> Result<Vec<(Input, Format)>, String> {
    let in_input = |fault| in_file(&input.file, fault);
    let format = input.format().map_err(in_input)?;
    if format != Format::Description {
        return Ok(vec![(input.clone(), format)]);
    }
    input.check(format).map_err(in_input)?;
    let mut files = Vec::new();
    for file in input::described(&input.file).map_err(in_input)? {
        let format = file.format().map_err(|fault| in_file(&file.file, fault))?;
        if format == Format::Description {
            return Err(in_input(format!(
                "it names {}, another description; list that one's files here, or name both with --with",
                file.file.display()
            )));
        }
        files.push((file, format));
    }
    Ok(files)
}

fn in_file(file: &Path, fault: String) -> String {
    format!("{}: {fault}", file.display())
}

/// Checks that a specific force comes with the angular velocity, perhaps in another file.
fn check_columns(inputs: &[(Input, Format)]) -> Result<(), String> {
    let has = |what: What| inputs.iter().any(|(input, _)| has(&input.columns, what));
    let is_table_alone = inputs.iter().all(|(_, format)| *format == Format::Csv);
    let columns = inputs.iter().any(|(input, _)| !input.columns.is_empty());
    let (gyr, acc) = (has(What::AngularVelocity), has(What::SpecificForce));
    if gyr != acc || is_table_alone && columns && !gyr && !has(What::Fix) {
        return Err(
            "--columns: gyr and acc are needed, as gyr=gyr_*:deg/s acc=acc_*:g; one of them may be in a file \
                    named with --with"
                .into(),
        );
    }
    Ok(())
}

/// Writes the entries that `read` passes on, and prints their counts and its notes. Removes an incomplete bag.
fn write(
    out: &Path,
    read: impl FnOnce(&mut dyn FnMut(Entry) -> Result<(), String>) -> Result<Vec<String>, String>,
) -> Result<bool, String> {
    let mut bag = write::Bag::create(out)?;
    let read = read(&mut |entry| bag.entry(entry));
    match read.and_then(|notes| Ok((notes, bag.finish()?))) {
        Ok((notes, counts)) => {
            let notes: String = notes.iter().map(|note| format!(", {note}")).collect();
            crate::say(&format!("{}: {counts}{notes}\n", out.display()))?;
            Ok(true)
        }
        Err(fault) => {
            let _ = std::fs::remove_file(out);
            Err(fault)
        }
    }
}

/// Passes on the entries of all files in the order of their times, and returns notes on them.
fn merge(
    mut sources: Vec<Source>,
    each: &mut dyn FnMut(Entry) -> Result<(), String>,
) -> Result<Vec<String>, String> {
    let bytes = sources.iter().map(Source::bytes).sum::<Option<u64>>();
    let progress =
        bytes.map_or_else(|| Progress::spinner("converting"), |bytes| Progress::new("converting", bytes));
    let mut join = Join::default();
    let merged = loop {
        let mut next: Option<(i64, usize)> = None;
        for (index, source) in sources.iter_mut().enumerate() {
            let time_ns = source.time_ns().map_err(|fault| in_file(&source.file, fault))?;
            if let Some(time_ns) = time_ns
                && next.is_none_or(|(first, _)| time_ns < first)
            {
                next = Some((time_ns, index));
            }
        }
        let Some(entry) = next.and_then(|(_, index)| sources[index].next()) else { break join.finish(each) };
        if let Err(fault) = join.push(entry, each) {
            break Err(fault);
        }
        progress.set(sources.iter().map(Source::byte).sum());
    };
    progress.finish();
    merged?;
    let mut notes = Vec::new();
    for source in &sources {
        match source.head() {
            0 => {}
            1 => notes.push("after one line of head".to_owned()),
            lines => notes.push(format!("after {lines} lines of head")),
        }
    }
    notes.dedup();
    if join.alone > 0 {
        let velocities = if join.alone == 1 { "angular velocity" } else { "angular velocities" };
        notes.push(format!("{} {velocities} without a specific force within 0.1 s left out", join.alone));
    }
    notes.extend(sources.iter().flat_map(|source| source.notes.iter().cloned()));
    Ok(notes)
}
