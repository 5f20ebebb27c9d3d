//! `bb convert`: converts recordings of other programs to bags.

mod cells;
mod columns;
mod source;
mod units;
mod write;

use bb_eval::Progress;
use cells::{Table, Times};
use clap::Args;
use columns::{Columns, Quantity};
use std::path::{Path, PathBuf};

/// Converts CSV to a ROS 2 bag: an IMU on /imu, its magnetometer on /mag, truth on /truth, and whether it moves on /moving.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// The CSV, or `-` for standard input: with or without a head, with cells separated by commas, semicolons or tabs.
    #[arg(value_name = "INPUT.csv")]
    input: PathBuf,
    /// The bag to write, which must not exist yet.
    #[arg(value_name = "OUT.mcap")]
    out: PathBuf,
    /// What the columns contain, and in which unit: QUANTITY=COLUMNS[:UNIT], separated by spaces.
    #[arg(long, value_name = "MAP", required = true, num_args = 1.., value_delimiter = ' ', long_help = MAP)]
    columns: Vec<Quantity>,
    /// The rate of the samples in Hz, for a CSV without times.
    #[arg(long, value_name = "HZ", value_parser = rate)]
    rate: Option<f64>,
    /// A separate CSV with the truth.
    #[arg(long, value_name = "FILE.csv", requires = "truth_columns")]
    truth: Option<PathBuf>,
    /// What the columns of that CSV contain.
    #[arg(long, value_name = "MAP", requires = "truth", num_args = 1.., value_delimiter = ' ')]
    truth_columns: Vec<Quantity>,
}

const MAP: &str = "What the columns contain, and in which unit: QUANTITY=COLUMNS[:UNIT], separated by spaces.

  time    s (default), ms, us, ns
  gyr     angular velocity: rad/s (default), deg/s
  acc     specific force: m/s2 (default), g, mg
  mag     magnetic field: T (default), mT, uT, nT, G, mG
  quat    true orientation, sensor to east, north, up: wxyz (default), xyzw
  pos     true position: m (default), cm, mm
  moving  0 or 1: errors are scored while it is 1

COLUMNS are names, or numbers from 1, separated by commas; 2-4 means 2,3,4, and gyr_* means gyr_x,gyr_y,gyr_z. A unit in brackets \
at the end of a name may be omitted. A unit may have a factor: mag=12-14:50uT for a field in multiples of 50 µT.";

const EXAMPLES: &str = "Examples:
  bb convert log.csv log.mcap --columns time=t:us gyr=gyr_*:deg/s acc=acc_*:g mag=mag_*:uT
  bb convert data.csv flight.mcap --columns time=1:ns gyr=2-4 acc=5-7
  bb convert walk.csv walk.mcap --rate 100 --columns gyr=1-3 acc=4-6 mag=7-9:uT quat=10-13";

fn rate(text: &str) -> Result<f64, String> {
    let rate: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    match rate > 0.0 && rate <= 1e6 {
        true => Ok(rate),
        false => Err("must be above 0 and at most 1000000 Hz".into()),
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<bool, String> {
    let Arguments { input, out, columns, rate, truth, truth_columns } = arguments;
    let in_file = |file: &Path, fault: String| format!("{}: {fault}", file.display());
    let columns = Columns::new(columns, *rate).map_err(|fault| format!("--columns: {fault}"))?;
    if !columns.has_imu() {
        return Err("--columns: gyr and acc are needed, as gyr=gyr_*:deg/s acc=acc_*:g".into());
    }
    let mut truths = match truth {
        None => Vec::new(),
        Some(file) => {
            let columns = Columns::new(truth_columns, None).map_err(|fault| format!("--truth-columns: {fault}"))?;
            if !columns.has_truth() || columns.has_imu() {
                return Err("--truth-columns: quat or pos is needed, and neither gyr nor acc".into());
            }
            let mut rows = Vec::new();
            let mut table = Table::open(file, &columns, Times::Column).map_err(|fault| in_file(file, fault))?;
            while let Some(row) = table.next().map_err(|fault| in_file(file, fault))? {
                rows.push(row);
            }
            rows
        }
    };
    truths.sort_by_key(|row| row.time_ns);
    let times = rate.map_or(Times::Column, Times::Rate);
    let mut table = Table::open(input, &columns, times).map_err(|fault| in_file(input, fault))?;
    let mut bag = write::Bag::create(out)?;
    let progress =
        table.bytes().map_or_else(|| Progress::spinner("converting"), |bytes| Progress::new("converting", bytes));
    let mut truths = truths.into_iter().peekable();
    let written = loop {
        match table.next().map_err(|fault| in_file(input, fault)) {
            Ok(Some(row)) => {
                let before = std::iter::from_fn(|| truths.next_if(|truth| truth.time_ns <= row.time_ns));
                let before: Vec<_> = before.collect();
                if let Err(fault) = before.iter().chain([&row]).try_for_each(|row| bag.row(row)) {
                    break Err(fault);
                }
                progress.set(table.byte());
            }
            Ok(None) => break truths.try_for_each(|row| bag.row(&row)),
            Err(fault) => break Err(fault),
        }
    };
    progress.finish();
    let head = table.head();
    match written.and_then(|()| bag.finish()) {
        Ok(counts) => {
            let head = match head {
                0 => String::new(),
                1 => ", after one line of head".to_owned(),
                lines => format!(", after {lines} lines of head"),
            };
            crate::say(&format!("{}: {counts}{head}\n", out.display()))?;
            Ok(true)
        }
        Err(fault) => {
            // This run created it, and it is incomplete.
            let _ = std::fs::remove_file(out);
            Err(fault)
        }
    }
}
