//! The drone, and its flight on virtual time.

use crate::outcome::Outcome;
use crate::recorded::{Recorded, Sent};
use crate::sensors::{END, FIX, FRAME, STEP, Sensors, at, frame};
use crate::trajectory::{heading, motion};
use bb_core::Builder;
use bb_core::payload::GnssFix;
use bb_core::prelude::*;
use bb_estimators::StateEstimator;
use bb_estimators::navigation::state_estimator::{
    AnchorReading, FlightEstimate, FlightEvents, FlightHealth, GpsHealth, GpsReport, RelativePoseReading,
    WarmStartReport,
};
use bb_mcap::{Recorder, RecorderOptions};
use std::error::Error;
use std::path::Path;
use std::sync::Arc;

robot! {
    /// A flight controller, a camera, and what compares its frames with satellite images.
    pub robot Drone;

    link base {
        sensor imu: External<Imu>();
        sensor camera: External<RelativePoseReading>();
        sensor matcher: External<AnchorReading>();
        sensor gps: External<GnssFix>();
        sensor gps_report: External<GpsReport>();
        sensor state: External<WarmStartReport>();
        estimator navigation: StateEstimator() {
            input imu: sensor::base::imu, driver;
            input vio: sensor::base::camera, optional;
            input anchor: sensor::base::matcher, optional;
            input gnss: sensor::base::gps, optional;
            input gps_health: sensor::base::gps_report, optional;
            input warm_start: sensor::base::state, optional;
            output estimate;
            output health;
            output events;
            runs_on: worker;
        }
    }
}

/// Time that the matcher takes to find where an image is, ms.
const MATCHING: i64 = 300;

/// A drone in flight, on virtual time.
struct Flying {
    simulation: Simulation<Drone>,
    outcome: Outcome,
    estimates: Subscription<FlightEstimate>,
    health: Subscription<FlightHealth>,
    events: Subscription<FlightEvents>,
    recorder: Option<Recorder>,
}

impl Flying {
    /// Begins, and records it where a file is named.
    fn begin(builder: Builder<Drone>, outcome: Outcome, record: Option<&Path>) -> Result<Self, Box<dyn Error>> {
        let estimates = builder.subscribe(drone::estimator::base::navigation::estimate);
        let health = builder.subscribe(drone::estimator::base::navigation::health);
        let events = builder.subscribe(drone::estimator::base::navigation::events);
        let all = builder.subscribe_any(Select::Below("estimator"), None, Overflow::default());
        let recorder = match record {
            Some(file) => Some(Recorder::new(file, all, RecorderOptions::of::<Drone>())?),
            None => None,
        };
        Ok(Self { simulation: builder.simulate()?, outcome, estimates, health, events, recorder })
    }

    /// Takes what was published since the last time.
    fn take(&mut self) -> Result<(), Box<dyn Error>> {
        self.outcome.take(self.estimates.drain(), self.health.drain(), self.events.drain());
        if let Some(recorder) = &mut self.recorder {
            recorder.drain()?;
        }
        Ok(())
    }

    fn end(self) -> Result<Outcome, Box<dyn Error>> {
        let Self { simulation, mut outcome, estimates, health, events, recorder } = self;
        simulation.stop().ok()?;
        // With the keyframes that were still in the window.
        outcome.take(estimates.drain(), health.drain(), events.drain());
        if let Some(recorder) = recorder {
            recorder.finish()?;
        }
        Ok(outcome)
    }
}

/// Flies the simulated flight, and records it if a file is named.
pub(crate) fn fly(strategy: &str, record: Option<&Path>) -> Result<Outcome, Box<dyn Error>> {
    let mut builder = Drone::builder();
    let options = builder.options(drone::estimator::base::navigation);
    let origin = *frame().origin();
    options.strategy = strategy.to_owned();
    (options.origin_latitude, options.origin_longitude) = (origin.latitude, origin.longitude);
    (options.origin_height, options.heading) = (origin.height, heading());
    let mut flying = Flying::begin(builder, Outcome::new(|time_s| Some(motion(time_s).position)), record)?;
    let mut sensors = Sensors::new();
    let mut matching = Vec::new();
    for millis in (STEP..=END).step_by(STEP as usize) {
        let simulation = &mut flying.simulation;
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
        flying.take()?;
    }
    flying.end()
}

/// Flies a recorded flight again.
pub(crate) fn fly_recorded(
    strategy: &str,
    recorded: &Arc<Recorded>,
    record: Option<&Path>,
) -> Result<Outcome, Box<dyn Error>> {
    let mut builder = Drone::builder();
    let options = builder.options(drone::estimator::base::navigation);
    options.strategy = strategy.to_owned();
    [options.gyroscope_noise, options.accelerometer_noise, options.gravity] = recorded.noise;
    let truth = Arc::clone(recorded);
    let mut flying = Flying::begin(builder, Outcome::new(move |time_s| truth.position(time_s)), record)?;
    let (time, state) = recorded.start;
    flying.simulation.publish(drone::sensor::base::state, time, state);
    for (time, sent) in &recorded.sent {
        let simulation = &mut flying.simulation;
        match *sent {
            Sent::Imu(sample) => simulation.publish(drone::sensor::base::imu, *time, sample),
            Sent::Vio(reading) => simulation.publish(drone::sensor::base::camera, *time, reading),
            Sent::Anchor(reading, _) => simulation.publish(drone::sensor::base::matcher, *time, reading),
            Sent::Fix(fix) => {
                // Recordings hold what was let in.
                let report = GpsReport { health: GpsHealth::Stable };
                simulation.publish(drone::sensor::base::gps_report, *time, report);
                simulation.publish(drone::sensor::base::gps, *time, fix);
            }
        }
        flying.take()?;
    }
    flying.end()
}
