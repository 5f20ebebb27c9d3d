//! `bb eval noise BAG`: the noise of an IMU at rest, by its Allan deviation.

mod moving;
mod report;
mod still;

use bb_core::nalgebra::Vector3;
use bb_estimators::calibration::{AllanError, SensorNoise, integrate, sensor_noise};
use bb_eval::Progress;
use bb_eval::files;
use bb_eval::inertial;
use bb_eval::{End, Recording, Topics};
use bb_plot::Picture;
use clap::Args;
use std::path::{Path, PathBuf};
use still::{Still, still};

pub(crate) const EXAMPLES: &str = "Exit code: 0; 1 if the noise of an axis could not be found; 2 for a wrong use.

Examples:
  bb eval noise night.mcap --plot allan.svg
  bb eval noise night.mcap --imu-topic /imu/data_raw --json
  bb eval noise night_imu.csv";

#[derive(Debug, Args)]
pub(crate) struct NoiseArguments {
    /// ROS 2 bags in MCAP, folders of them, or CSV files of t (s), angular velocity (rad/s) and specific force (m/s²), with a
    /// header row. The IMU must be at rest, for three hours to show its random walk.
    #[arg(value_name = "BAG", required = true)]
    paths: Vec<PathBuf>,
    /// The topic of the IMU, if there are several (sensor_msgs/Imu).
    #[arg(long, value_name = "TOPIC")]
    imu_topic: Option<String>,
    /// Prints an array of objects instead of the text.
    #[arg(long)]
    json: bool,
    /// Plots the Allan deviations and the fitted models to this file, an SVG or a PNG.
    #[arg(long, value_name = "FILE", value_parser = picture)]
    plot: Option<PathBuf>,
}

fn picture(file: &str) -> Result<PathBuf, String> {
    let file = PathBuf::from(file);
    Picture::check(&file, "it")?;
    Ok(file)
}

/// The names of the axes.
const AXES: [&str; 6] =
    ["gyroscope x", "gyroscope y", "gyroscope z", "accelerometer x", "accelerometer y", "accelerometer z"];

/// A sample: time, then the six axes.
#[derive(Clone, Copy, Debug)]
struct Sample {
    time_ns: i64,
    axes: [f64; 6],
}

impl Sample {
    fn new(time_ns: i64, angular_velocity: &Vector3<f64>, specific_force: &Vector3<f64>) -> Self {
        let [a, b] = [angular_velocity, specific_force];
        Self { time_ns, axes: [a.x, a.y, a.z, b.x, b.y, b.z] }
    }
}

/// The noise found in a recording.
#[derive(Debug)]
struct Noise {
    file: PathBuf,
    still: Still,
    axes: [Result<SensorNoise, AllanError>; 6],
}

impl NoiseArguments {
    /// The text to print, and whether noise was found for all axes of all recordings.
    pub(crate) fn run(&self) -> Result<(String, bool), String> {
        let (mut found, mut is_whole) = (Vec::new(), true);
        for (file, there) in self.files() {
            match there.and_then(|()| self.noise(&file, &mut is_whole)) {
                Ok(noise) => found.push(noise),
                Err(fault) => {
                    eprintln!("error: {}: {fault}", file.display());
                    is_whole = false;
                }
            }
        }
        for noise in &found {
            is_whole &= report::complain(noise);
        }
        if let Some(plot) = &self.plot
            && !found.is_empty()
        {
            report::picture(&found).write(plot)?;
            eprintln!("plotted {}", plot.display());
        }
        let text = if self.json { report::json(&found)? } else { report::text(&found) };
        Ok((text, is_whole))
    }

    fn files(&self) -> Vec<(PathBuf, Result<(), String>)> {
        let (csv, bags): (Vec<_>, Vec<_>) = self.paths.iter().cloned().partition(|path| is_csv(path));
        let csv = csv.into_iter().map(|file| (file, Ok(())));
        csv.chain(files::recordings(&bags)).collect()
    }

    fn noise(&self, file: &Path, is_whole: &mut bool) -> Result<Noise, String> {
        let (samples, moving) = match is_csv(file) {
            true => (of_csv(file)?, Vec::new()),
            false => {
                let samples = self.of_bag(file, is_whole)?;
                (samples, moving::moving(file).map_err(|error| error.kind().to_string())?)
            }
        };
        let still = still(&samples, &moving)?;
        let progress = Progress::new("averaging", AXES.len() as u64);
        let part = samples.get(still.samples.clone()).unwrap_or_default();
        let axes = std::array::from_fn(|axis| {
            let mut integrals: Vec<f64> =
                std::iter::once(0.0).chain(part.iter().map(|sample| sample.axes[axis])).collect();
            integrate(&mut integrals);
            let noise = sensor_noise(&integrals, still.period_s);
            progress.add(1);
            noise
        });
        progress.finish();
        Ok(Noise { file: file.to_owned(), still, axes })
    }

    fn of_bag(&self, file: &Path, is_whole: &mut bool) -> Result<Vec<Sample>, String> {
        let topics = Topics { imu: self.imu_topic.clone(), ..Topics::default() };
        // The truth, if any, is irrelevant here.
        let mut recording = Recording::inertial(file, &topics)?;
        let progress = Progress::new("reading", recording.expected);
        let (mut samples, mut block) = (Vec::new(), Vec::new());
        loop {
            block.clear();
            let end = recording.read(&mut block, 10_000)?;
            samples.extend(
                block
                    .iter()
                    .map(|sample| Sample::new(sample.time_ns, &sample.angular_velocity, &sample.specific_force)),
            );
            progress.set(samples.len() as u64);
            match end {
                End::NotYet => {}
                End::Whole => break,
                End::Broken(why) => {
                    eprintln!("error: {}: {why}; taken up to there", file.display());
                    *is_whole = false;
                    break;
                }
            }
        }
        progress.finish();
        Ok(samples)
    }
}

fn is_csv(path: &Path) -> bool {
    path.extension().is_some_and(|end| end == "csv")
}

fn of_csv(file: &Path) -> Result<Vec<Sample>, String> {
    // The error already names the file.
    let name = format!("{}: ", file.display());
    let rows = inertial(file).map_err(|fault| fault.strip_prefix(&name).unwrap_or(&fault).to_owned())?;
    let sample = |(time_s, rate, force): &(f64, Vector3<f64>, Vector3<f64>)| {
        Sample::new((time_s * 1e9).round() as i64, rate, force)
    };
    Ok(rows.iter().map(sample).collect())
}
