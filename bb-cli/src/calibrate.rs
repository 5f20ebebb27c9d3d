//! `bb calibrate imu BAG`: offsets, scale and misalignment of a recorded IMU.

mod report;

use bb_core::nalgebra::Vector3;
use bb_estimators::attitude::ImuSample;
use bb_estimators::calibration::{
    AccelerometerFit, CalibrationError, GyroscopeFit, MagnetometerFit, Rest, RestParams, Rests, accelerometer,
    gyroscope, magnetometer,
};
use bb_estimators::params::Params;
use bb_eval::Axes;
use bb_eval::{End, Recording, Topics};
use bb_plot::Picture;
use clap::{Args, Subcommand};
use std::path::{Path, PathBuf};

/// The kind of calibration.
#[derive(Debug, Subcommand)]
pub(crate) enum Calibrate {
    /// Finds offsets, scale and misalignment of gyroscope, accelerometer and magnetometer.
    ///
    /// The gyroscope's offset is its reading at rest. The accelerometer needs rests of at least two seconds in six
    /// directions for offset and scale, and in nine for misalignment; they need not be exact. The magnetometer needs free
    /// motion in all directions, far from iron. One recording may contain all of this.
    #[command(after_help = EXAMPLES)]
    Imu(Box<ImuArguments>),
}

const EXAMPLES: &str =
    "Exit code: 0; 1 if the recording could not be read, or gave no calibration at all; 2 for a wrong use.

Examples:
  bb calibrate imu poses.mcap
  bb calibrate imu poses.mcap --field 48uT --plot calibration.svg";

#[derive(Debug, Args)]
pub(crate) struct ImuArguments {
    /// A ROS 2 bag in MCAP.
    #[arg(value_name = "BAG")]
    file: PathBuf,
    /// Local gravity, m/s².
    #[arg(long, value_name = "ACCELERATION", default_value_t = 9.80665)]
    gravity: f64,
    /// Local strength of the magnetic field, as 48uT. By default the calibration keeps the measured strength.
    #[arg(long, value_name = "FIELD")]
    field: Option<bb_eval::Field>,
    /// Sets what counts as rest: window, time, rotation and force, in SI or with a unit.
    #[arg(long = "set", value_name = "NAME=VALUE")]
    settings: Vec<String>,
    /// The topic of the IMU, if there are several (sensor_msgs/Imu).
    #[arg(long, value_name = "TOPIC")]
    imu_topic: Option<String>,
    /// The topic of the magnetometer, if there are several (sensor_msgs/MagneticField).
    #[arg(long, value_name = "TOPIC")]
    mag_topic: Option<String>,
    /// Plots the norms of specific force and field, measured and calibrated, to this file, an SVG or a PNG.
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
}

/// The calibration of each sensor, from one recording.
#[derive(Debug)]
struct Calibration {
    rests: Vec<Rest>,
    gyroscope: Result<GyroscopeFit, CalibrationError>,
    accelerometer: Result<AccelerometerFit, CalibrationError>,
    /// `None` if no field was recorded.
    magnetometer: Option<Result<MagnetometerFit, CalibrationError>>,
}

impl Calibrate {
    /// Returns the text to print, and whether any sensor was calibrated.
    pub(crate) fn run(&self) -> Result<(String, bool), String> {
        let Self::Imu(arguments) = self;
        arguments.run()
    }
}

impl ImuArguments {
    fn run(&self) -> Result<(String, bool), String> {
        if let Some(plot) = &self.plot {
            Picture::check(plot, "--plot")?;
        }
        let params = self.rest_params()?;
        if !(1.0..=30.0).contains(&self.gravity) {
            return Err(format!("--gravity is {}, but must be in 1..=30 m/s²", self.gravity));
        }
        let samples = read(&self.file, self.topics())?;
        let calibration = Calibration::of(&samples, params, self.gravity, self.field)?;
        if let Some(plot) = &self.plot {
            report::picture(&self.file, &samples, &calibration, self.gravity).write(plot)?;
            eprintln!("plotted {}", plot.display());
        }
        Ok((report::text(&self.file, &calibration), calibration.is_any()))
    }

    fn topics(&self) -> Topics {
        let (imu, magnetometer) = (self.imu_topic.clone(), self.mag_topic.clone());
        Topics { imu, magnetometer, ..Topics::default() }
    }

    fn rest_params(&self) -> Result<RestParams, String> {
        let mut params = RestParams::default();
        for setting in &self.settings {
            let (name, value) = setting
                .split_once('=')
                .ok_or_else(|| format!("--set {setting}: no `=` in it; write NAME=VALUE, as force=0.3"))?;
            params.set(name.trim(), value).map_err(|error| format!("--set {setting}: {error}"))?;
        }
        Ok(params)
    }
}

/// Reads all samples, with the field if there is one.
fn read(file: &Path, topics: Topics) -> Result<Vec<ImuSample>, String> {
    let fault = |error: String| format!("{}: {error}", file.display());
    let wants_field = topics.magnetometer.is_some();
    let mut recording = match Recording::open(file, &topics, Axes::Nine, None) {
        Ok(recording) => recording,
        // Without a magnetometer, the other sensors are calibrated.
        Err(error) if wants_field => return Err(fault(error)),
        Err(_) => Recording::open(file, &topics, Axes::Six, None).map_err(fault)?,
    };
    let mut samples = Vec::new();
    loop {
        match recording.read(&mut samples, usize::MAX).map_err(fault)? {
            End::NotYet => {}
            End::Whole => return Ok(samples),
            End::Broken(why) => {
                eprintln!("warning: {}: {why}; calibrated from what comes before", file.display());
                return Ok(samples);
            }
        }
    }
}

impl Calibration {
    fn of(
        samples: &[ImuSample],
        params: RestParams,
        gravity: f64,
        field: Option<bb_eval::Field>,
    ) -> Result<Self, String> {
        let mut finder = Rests::new(params).map_err(|error| error.to_string())?;
        let mut rests: Vec<_> = samples.iter().filter_map(|sample| finder.add(sample)).collect();
        rests.extend(finder.finish());
        let fields: Vec<Vector3<f64>> = samples.iter().filter_map(|sample| sample.magnetic_field).collect();
        let norm = field.map(|field| field.tesla());
        Ok(Self {
            gyroscope: gyroscope(&rests),
            accelerometer: accelerometer(&rests, gravity),
            magnetometer: (!fields.is_empty()).then(|| magnetometer(&fields, norm)),
            rests,
        })
    }

    fn is_any(&self) -> bool {
        self.gyroscope.is_ok() || self.accelerometer.is_ok() || matches!(self.magnetometer, Some(Ok(_)))
    }
}
