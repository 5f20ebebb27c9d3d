//! The state estimator in a robot: where it starts, where its antenna is, and what its recorder holds.

use bb_core::Builder;
use bb_core::nalgebra::{Matrix3, UnitQuaternion, Vector3};
use bb_core::payload::{GeodeticPosition, GnssFix, GnssServices, GnssStatus};
use bb_core::prelude::*;
use bb_core::run::DropReason;
use bb_estimators::StateEstimator;
use bb_estimators::navigation::state_estimator::{
    AttitudeReport, FlightEstimate, FlightEvent, FlightEvents, FlightHealth, FlightOptions, GpsHealth, GpsReport,
    Level, WarmStartReport,
};
use bb_estimators::navigation::{Geodetic, LocalFrame};
use bb_mcap::{Recorder, RecorderOptions, Recording};
use std::path::Path;

robot! {
    robot Surveying;

    parameters { output_rate: f64 = 5 Hz; }

    link base {
        joint shelf: fixed {
            origin: { xyz: [20 cm, 0 m, 10 cm] };
            link board { sensor imu: External<Imu>(); }
        }
        joint mast: fixed {
            origin: { xyz: [-130 cm, 40 cm, 110 cm] };
            link antenna { sensor gps: External<GnssFix>(); }
        }
        sensor gps_report: External<GpsReport>();
        sensor attitude: External<AttitudeReport>();
        sensor state: External<WarmStartReport>();
        estimator navigation: StateEstimator(output_rate = param::output_rate) {
            input imu: sensor::base::shelf::board::imu, driver;
            input gnss: sensor::base::mast::antenna::gps, optional;
            input gps_health: sensor::base::gps_report, optional;
            input attitude: sensor::base::attitude, optional;
            input warm_start: sensor::base::state, optional;
            output estimate;
            output health;
            output events;
        }
    }
}

pub(crate) fn frame() -> LocalFrame {
    LocalFrame::new(Geodetic::from_degrees(48.0, 11.0, 500.0))
}

pub(crate) fn geodetic(position: Vector3<f64>) -> GeodeticPosition {
    let Geodetic { latitude, longitude, height } = frame().geodetic(&position);
    GeodeticPosition { latitude_rad: latitude, longitude_rad: longitude, altitude: Some(height) }
}

pub(crate) fn local(position: &GeodeticPosition) -> Vector3<f64> {
    let height = position.altitude.unwrap_or(f64::NAN);
    frame().position(&Geodetic { latitude: position.latitude_rad, longitude: position.longitude_rad, height })
}

/// The time `millis` after zero.
pub(crate) fn at(millis: i64) -> MonotonicTime {
    MonotonicTime::from_nanos(millis * 1_000_000)
}

fn at_rest() -> Imu {
    Imu::new(Vector3::zeros(), Vector3::new(0.0, 0.0, 9.80665))
}

/// The robot looks north.
fn north() -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::FRAC_PI_2)
}

pub(crate) fn attitude() -> AttitudeReport {
    AttitudeReport { world_from_body: north(), tilt_deviation: 0.01, heading_deviation: 0.02 }
}

/// A flight that is simulated, and what its estimator says.
struct Flight {
    simulation: Simulation<Surveying>,
    estimates: Subscription<FlightEstimate>,
    health: Subscription<FlightHealth>,
    events: Subscription<FlightEvents>,
}

impl Flight {
    /// One whose origin is known, and whose attitude the flight controller tells at the start.
    fn at_origin(strategy: &str) -> Result<Self, StartError> {
        let mut flight = Self::start(Self::builder(strategy, true))?;
        flight.attitude(at(0));
        Ok(flight)
    }

    fn builder(strategy: &str, has_origin: bool) -> Builder<Surveying> {
        let mut builder = Surveying::builder();
        let options = builder.options(surveying::estimator::base::navigation);
        options.strategy = strategy.to_owned();
        if has_origin {
            set_origin(options);
        }
        builder
    }

    fn start(builder: Builder<Surveying>) -> Result<Self, StartError> {
        let estimates = builder.subscribe(surveying::estimator::base::navigation::estimate);
        let health = builder.subscribe(surveying::estimator::base::navigation::health);
        let events = builder.subscribe(surveying::estimator::base::navigation::events);
        Ok(Self { simulation: builder.simulate()?, estimates, health, events })
    }

    fn attitude(&mut self, time: MonotonicTime) {
        self.simulation.publish(surveying::sensor::base::attitude, time, attitude());
    }

    fn imu(&mut self, time: MonotonicTime, imu: Imu) {
        self.simulation.publish(surveying::sensor::base::shelf::board::imu, time, imu);
    }

    fn gps(&mut self, time: MonotonicTime, health: GpsHealth) {
        self.simulation.publish(surveying::sensor::base::gps_report, time, GpsReport { health });
    }

    /// A fix of the antenna.
    fn fix(&mut self, time: MonotonicTime, position: [f64; 3], variance: f64) {
        let fix = GnssFix {
            status: GnssStatus::Fix,
            services: GnssServices::default(),
            position: Some(geodetic(position.into())),
            position_covariance: Some(Matrix3::identity() * variance),
        };
        self.simulation.publish(surveying::sensor::base::mast::antenna::gps, time, fix);
    }

    /// The events since the last time.
    fn events(&self) -> Vec<FlightEvent> {
        self.events.drain().flat_map(|events| events.payload.events).collect()
    }
}

const STRATEGIES: [&str; 2] = ["smoother", "eskf"];

#[test]
fn it_starts_from_the_flight_controller_and_knows_where_the_antenna_is() -> Result<(), StartError> {
    for strategy in STRATEGIES {
        let mut flight = Flight::start(Flight::builder(strategy, false))?;
        let state = WarmStartReport {
            attitude: attitude(),
            position: geodetic(Vector3::new(3.0, -2.0, 1.0)),
            position_covariance: Matrix3::identity() * 4.0,
            velocity: Vector3::zeros(),
            velocity_covariance: Matrix3::identity() * 0.01,
        };
        flight.simulation.publish(surveying::sensor::base::state, at(0), state);
        for step in 1..=600 {
            let time = at(5 * step);
            if step % 40 == 0 {
                flight.gps(time, GpsHealth::Stable);
                // From the IMU, the antenna is 1.5 m behind, 0.4 m to the left and 1 m above; it looks north.
                flight.fix(time, [-0.4, -1.5, 1.0], 0.01);
            }
            flight.imu(time, at_rest());
        }
        let started: Vec<_> = flight
            .events()
            .into_iter()
            .filter(|event| event.kind == "started")
            .filter_map(|event| event.from)
            .collect();
        assert_eq!(started, ["flight_controller"], "{strategy}: once");
        let all: Vec<_> = flight.estimates.drain().collect();
        let first = local(&all[0].position);
        assert!((first - Vector3::new(3.0, -2.0, 1.0)).norm() < 0.1, "{strategy}: {first}");
        let last = local(&all.last().expect("it runs").position);
        assert!(last.norm() < 0.15, "{strategy}: {last}, where the IMU is");
    }
    Ok(())
}

fn set_origin(options: &mut FlightOptions) {
    let origin = *frame().origin();
    (options.origin_latitude, options.origin_longitude) = (origin.latitude, origin.longitude);
    options.origin_height = origin.height;
}

/// Without samples nothing drives the estimator, but its ticks go on: one event when the fallback engages, one when it recovers, with
/// each of two outages.
#[test]
fn an_imu_that_stops_engages_the_fallback_and_its_return_recovers_it() -> Result<(), StartError> {
    for strategy in STRATEGIES {
        let mut flight = Flight::at_origin(strategy)?;
        let (mut told, mut engaged, mut times) = (Vec::new(), Vec::new(), Vec::new());
        // Samples for three seconds, and silence for seven.
        for step in (1..=4600).filter(|step| step % 2000 <= 600) {
            flight.imu(at(5 * step), at_rest());
            times.extend(flight.estimates.drain().map(|estimate| estimate.time));
            engaged.extend(flight.health.drain().map(|health| (health.state, health.is_fallback_engaged)));
            let fallbacks = flight.events().into_iter().filter(|event| event.kind.starts_with("fallback"));
            told.extend(fallbacks.map(|event| (event.time.as_nanos() / 1_000_000, event.level, event.kind)));
        }
        let expected = [
            (5000, Level::Error, "fallback_imminent"),
            (6000, Level::Error, "fallback_engaged"),
            // A gap of seven seconds is believed after half a second of samples.
            (10_500, Level::Info, "fallback_recovered"),
            (15_000, Level::Error, "fallback_imminent"),
            (16_000, Level::Error, "fallback_engaged"),
            (20_500, Level::Info, "fallback_recovered"),
        ];
        assert_eq!(told.len(), expected.len(), "{strategy}: {told:?}");
        for ((time_ms, level, kind), (expected_ms, of_level, name)) in told.iter().zip(expected) {
            let is_it = *level == of_level && kind == name;
            // Outputs and ticks are 0.2 s apart, and an estimate is predicted for as long.
            assert!(is_it && (0..=400).contains(&(time_ms - expected_ms)), "{strategy}: {told:?}");
        }
        let silent = |time: &MonotonicTime| (at(3300)..at(10_500)).contains(time);
        assert!(!times.iter().any(silent), "{strategy}: no estimate without the IMU");
        engaged.dedup_by_key(|(_, is_engaged)| *is_engaged);
        let engaged: Vec<bool> = engaged.iter().map(|(_, is_engaged)| *is_engaged).collect();
        assert_eq!(engaged, [false, true, false, true, false], "{strategy}");
    }
    Ok(())
}

fn recorded_events(file: &Path) -> Result<Vec<FlightEvent>, Box<dyn std::error::Error>> {
    let mut events = Vec::new();
    for message in Recording::open(file)?.messages::<FlightEvents>("estimator/base/navigation/events")? {
        let message = message?;
        events.extend(message.events.iter().cloned());
    }
    Ok(events)
}

/// All keyframes are still in the window when the estimator gets another rate, and again when the robot stops.
#[test]
fn every_keyframe_reaches_the_recorder_before_a_restart_and_at_the_stop() -> Result<(), Box<dyn std::error::Error>>
{
    for strategy in STRATEGIES {
        let file = std::env::temp_dir().join(format!("bb-keyframes-{strategy}-{}.mcap", std::process::id()));
        let builder = Flight::builder(strategy, true);
        let path = Select::Path("estimator/base/navigation/events");
        let recorded = builder.subscribe_any(path, None, Overflow::default());
        let recorder = Recorder::new(&file, recorded, RecorderOptions::of::<Surveying>())?;
        let mut flight = Flight::start(builder)?;
        for step in 1..=1700 {
            if step == 900 {
                flight.simulation.set_parameter(surveying::param::output_rate, 10.0)?;
            }
            flight.imu(at(5 * step), at_rest());
        }
        flight.simulation.stop().ok()?;
        recorder.finish()?;
        let keyframes = recorded_events(&file)?.into_iter().filter_map(|event| event.keyframe);
        let times: Vec<i64> = keyframes.map(|keyframe| keyframe.time.as_nanos() / 1_000_000).collect();
        std::fs::remove_file(&file)?;
        // Each instance levels for a second at rest, and makes a keyframe each second from there.
        let of = |span: std::ops::Range<i64>| times.iter().filter(|time| span.contains(time)).count();
        assert!(of(0..4500) >= 3 && of(4500..8501) >= 3, "{strategy}: {times:?}");
        assert!(times.is_sorted_by(|a, b| a < b), "{strategy}: {times:?}");
    }
    Ok(())
}

/// Events for the recorder are in the file, though nothing is logged: no subscriber of `tracing` is set.
#[test]
fn the_recorder_holds_labels_the_gate_rejections_and_faults() -> Result<(), Box<dyn std::error::Error>> {
    for strategy in STRATEGIES {
        let file = std::env::temp_dir().join(format!("bb-flights-{strategy}-{}.mcap", std::process::id()));
        let builder = Flight::builder(strategy, true);
        let path = Select::Path("estimator/base/navigation/events");
        let recorded = builder.subscribe_any(path, None, Overflow::default());
        let mut recorder = Recorder::new(&file, recorded, RecorderOptions::of::<Surveying>())?;
        let mut flight = Flight::start(builder)?;
        flight.attitude(at(0));
        let mut expected = Vec::new();
        for step in 1..=1600 {
            let time = at(5 * step);
            // Stable, then spoofed from 3 s to 4 s, and stable again. No anchor lets the receiver in.
            if step % 40 == 0 {
                flight.gps(time, if (600..800).contains(&step) { GpsHealth::Spoofed } else { GpsHealth::Stable });
                // One is far off.
                flight.fix(time, [if step == 400 { 500.0 } else { -0.4 }, -1.5, 1.0], 1.0);
            }
            // The IMU breaks at 7 s, and leads the estimate away: 9 km/s within a second.
            let broken = Imu::new(Vector3::zeros(), Vector3::new(0.0, 0.0, 900.0));
            flight.imu(time, if step <= 1400 { at_rest() } else { broken });
            expected.extend(flight.events());
            recorder.drain()?;
        }
        // Samples of the broken sensor go on at five times the rate, until the estimate is lost.
        for step in 8001..=24_000 {
            let broken = Imu::new(Vector3::zeros(), Vector3::new(0.0, 0.0, 900.0));
            flight.imu(at(step), broken);
            expected.extend(flight.events());
            recorder.drain()?;
        }
        flight.simulation.stop().ok()?;
        expected.extend(flight.events.drain().flat_map(|events| events.payload.events));
        recorder.finish()?;
        let events = recorded_events(&file)?;
        std::fs::remove_file(&file)?;
        assert_eq!(events, expected, "{strategy}: all that was published, in order");
        let of = |kind: &str| events.iter().filter(|event| event.kind == kind).collect::<Vec<_>>();
        let changes = |kind: &str| of(kind).into_iter().filter_map(|event| event.to.clone()).collect::<Vec<_>>();
        assert_eq!(changes("label")[..2], ["satellite_anchored", "dead_reckoned"], "{strategy}");
        assert_eq!(changes("gate")[..2], ["blocked", "dwelling"], "{strategy}");
        assert_eq!(of("gate")[0].level, Level::Warn, "{strategy}");
        let reasons: Vec<_> = of("rejected").into_iter().filter_map(|event| event.reason.as_deref()).collect();
        assert_eq!(reasons.iter().filter(|reason| **reason == "the receiver was spoofed").count(), 5, "{strategy}");
        assert!(reasons.iter().any(|reason| reason.starts_with("the receiver has been stable for")), "{reasons:?}");
        let refused: Vec<_> = of("degraded").into_iter().filter(|event| event.time == at(2000)).collect();
        let [refused] = refused[..] else { panic!("{strategy}: {refused:?}") };
        assert_eq!((refused.input.as_deref(), refused.level), (Some("gnss"), Level::Warn));
        assert!(refused.reason.as_deref().is_some_and(|reason| reason.contains("beyond the gate")), "{refused:?}");
        let [fatal] = of("fatal")[..] else { panic!("{strategy}: {:?}", of("fatal")) };
        assert_eq!((fatal.input.as_deref(), fatal.level), (Some("imu"), Level::Error));
        assert_eq!(of("fallback_engaged").len(), 1, "{strategy}");
        for event in &events {
            let length = event.status_text.as_ref().map_or(0, |text| text.chars().count());
            assert!(length <= 50, "{strategy}: {event:?}");
            let is_for_ground = ["rejected", "gate", "label", "fatal", "fallback_engaged"].contains(&&*event.kind);
            assert!(event.status_text.is_some() || !is_for_ground, "{strategy}: {event:?}");
        }
    }
    Ok(())
}

/// A report of spoofing between two samples of the IMU, or while the IMU is silent, is not hidden by those that follow it.
#[test]
fn a_report_of_spoofing_blocks_the_gate_however_soon_the_next_one_follows() -> Result<(), StartError> {
    // What is published after the IMU's sample at 3 s: how many reports that the receiver is stable follow, and over which time.
    let cases = [(1, 4), (20, 1000), (20, 5000), (2000, 4), (2000, 1900)];
    for (strategy, (stable, millis)) in STRATEGIES.into_iter().flat_map(|name| cases.map(|case| (name, case))) {
        let mut flight = Flight::at_origin(strategy)?;
        (1..=600).for_each(|step| flight.imu(at(5 * step), at_rest()));
        flight.gps(at(3000), GpsHealth::Spoofed);
        for number in 1..=stable {
            flight.gps(at(3000).plus_nanos(number * millis * 1_000_000 / stable), GpsHealth::Stable);
        }
        flight.imu(at(3001 + millis), at_rest());
        let events = flight.events().into_iter();
        let gate: Vec<_> = events.filter(|event| event.kind == "gate").filter_map(|event| event.to).collect();
        // One that is more than 2 s old is refused, but blocks the gate up to the newest sample.
        let expected = if millis > 2000 { &["blocked"][..] } else { &["blocked", "dwelling"] };
        assert_eq!(gate, expected, "{strategy}: {stable} in {millis} ms");
        let counts = flight.simulation.report();
        let displaced: u64 =
            counts.estimators[0].inputs.iter().map(|input| input.dropped(DropReason::Displaced)).sum();
        assert_eq!(displaced, (stable as u64 + 1).saturating_sub(1024));
    }
    Ok(())
}
