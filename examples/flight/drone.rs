//! The drone, and its flight on virtual time.

use crate::outcome::Outcome;
use crate::sensors::{END, FIX, FRAME, STEP, Sensors, at, frame};
use crate::trajectory::heading;
use bb_core::payload::GnssFix;
use bb_core::prelude::*;
use bb_estimators::StateEstimator;
use bb_estimators::navigation::state_estimator::{AnchorReading, GpsReport, RelativePoseReading};
use bb_mcap::{Recorder, RecorderOptions};
use std::error::Error;
use std::path::Path;

robot! {
    /// A flight controller, a camera, and what compares its frames with satellite images.
    pub robot Drone;

    link base {
        sensor imu: External<Imu>();
        sensor camera: External<RelativePoseReading>();
        sensor matcher: External<AnchorReading>();
        sensor gps: External<GnssFix>();
        sensor gps_report: External<GpsReport>();
        estimator navigation: StateEstimator() {
            input imu: sensor::base::imu, driver;
            input vio: sensor::base::camera, optional;
            input anchor: sensor::base::matcher, optional;
            input gnss: sensor::base::gps, optional;
            input gps_health: sensor::base::gps_report, optional;
            output estimate;
            output health;
            output events;
            runs_on: worker;
        }
    }
}

/// How long the matcher takes to find where an image is, ms.
const MATCHING: i64 = 300;

/// Flies, and records it where a file is named.
pub(crate) fn fly(strategy: &str, record: Option<&Path>) -> Result<Outcome, Box<dyn Error>> {
    let mut builder = Drone::builder();
    let options = builder.options(drone::estimator::base::navigation);
    let origin = *frame().origin();
    options.strategy = strategy.to_owned();
    (options.origin_latitude, options.origin_longitude) = (origin.latitude, origin.longitude);
    (options.origin_height, options.heading) = (origin.height, heading());
    let estimates = builder.subscribe(drone::estimator::base::navigation::estimate);
    let health = builder.subscribe(drone::estimator::base::navigation::health);
    let events = builder.subscribe(drone::estimator::base::navigation::events);
    let all = builder.subscribe_any(Select::Below("estimator"), None, Overflow::default());
    let mut recorder = match record {
        Some(file) => Some(Recorder::new(file, all, RecorderOptions::of::<Drone>())?),
        None => None,
    };
    let mut simulation = builder.simulate()?;
    let mut sensors = Sensors::new();
    let mut outcome = Outcome::default();
    let mut matching = Vec::new();
    for millis in (STEP..=END).step_by(STEP as usize) {
        simulation.publish(drone::sensor::base::imu, at(millis), sensors.imu(millis));
        if millis % FIX == 0 {
            simulation.publish(drone::sensor::base::gps_report, at(millis), Sensors::report(millis));
            simulation.publish(drone::sensor::base::gps, at(millis), sensors.fix(millis));
        }
        if millis % FRAME == 0 {
            if let Some(vio) = sensors.vio(millis) {
                simulation.publish(drone::sensor::base::camera, at(millis), vio);
            }
            matching.extend(sensors.anchor(millis).map(|anchor| (millis, anchor)));
        }
        if let Some((taken, anchor)) = matching.pop_if(|(taken, _)| *taken + MATCHING <= millis) {
            simulation.publish(drone::sensor::base::matcher, at(taken), anchor);
        }
        outcome.take(estimates.drain(), health.drain(), events.drain());
        if let Some(recorder) = &mut recorder {
            recorder.drain()?;
        }
    }
    simulation.stop().ok()?;
    if let Some(recorder) = recorder {
        recorder.finish()?;
    }
    Ok(outcome)
}
