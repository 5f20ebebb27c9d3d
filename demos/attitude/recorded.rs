//! A recorded IMU, played as the sensor.

use crate::arguments::Arguments;
use crate::outcome::{Outcome, Series};
use bb_core::prelude::*;
use bb_estimators::attitude::{AnyFilter, AnyParams, Attitude};
use bb_eval::{Axes, Progress};
use bb_mcap::{Bag, BagImu, IMU, Truth};
use std::error::Error;
use std::path::Path;
use std::time::Instant;

robot! {
    /// The IMU of a recording.
    robot Recorded;

    link body {
        sensor imu: BagImu() {
            estimator orientation: Attitude<AnyFilter, Marg>();
        }
    }
}

pub(crate) fn run(file: &Path, arguments: &Arguments, params: AnyParams) -> Result<Outcome, Box<dyn Error>> {
    let bag = Bag::open(file)?;
    let magnetometer = arguments.axes == Axes::Nine;
    if magnetometer && arguments.mag_topic.is_none() {
        let imu = bag.choose(IMU, arguments.imu_topic.as_deref())?;
        bag.magnetometer_of(&imu.name, None).map_err(|error| format!("{error} (or choose --axes 6)"))?;
    }
    let truth = Truth::read(&bag)?;

    let mut builder = Recorded::builder();
    let imu = builder.options(recorded::sensor::body::imu);
    imu.file = file.to_owned();
    imu.imu_topic = arguments.imu_topic.clone().unwrap_or_default();
    imu.magnetometer_topic = arguments.mag_topic.clone().unwrap_or_default();
    imu.magnetometer = magnetometer;
    *builder.options(recorded::sensor::body::imu::orientation) = params;
    let orientation = builder.subscribe(recorded::sensor::body::imu::orientation);

    let mut simulation = builder.simulate()?;
    let samples = bag.topics().iter().filter(|topic| &*topic.schema == IMU).find_map(|topic| topic.messages);
    let progress = Progress::new("playing", samples.unwrap_or(0));
    let mut series = Series::new("estimate");
    let mut first = None;
    let started = Instant::now();
    while simulation.step() {
        for message in orientation.drain() {
            let time = message.monotonic_time;
            let start = *first.get_or_insert(time);
            let (truth, moving) = truth.at(time.as_nanos());
            series.add(time.seconds_since(start), message.world_from_body, truth, moving);
        }
        progress.set(series.len() as u64);
    }
    let seconds = started.elapsed().as_secs_f64();
    progress.finish();
    let report = simulation.stop().ok()?;
    if series.len() == 0 {
        return Err(
            format!("{}: no orientation came out of it; it may hold no sample of the IMU", file.display()).into()
        );
    }
    let (has_truth, has_heading) = (truth.is_known(), magnetometer);
    Ok(Outcome { filter: params.filter.name(), series: vec![series], report, seconds, has_truth, has_heading })
}
