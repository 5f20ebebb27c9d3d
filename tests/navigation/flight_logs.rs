//! Logs of the state estimator in a subscriber that writes JSON: one object a line, by level, each with its fields.

use bb_core::nalgebra::{UnitQuaternion, Vector3};
use bb_estimators::navigation::state_estimator::{
    AttitudeReading, Event, EventSink, FlightControllerState, FlightNavigator, GpsHealth, GpsHealthReading, Level,
    PoseAnchor, StateEstimatorConfig, StrategyKind, TracingSink,
};
use bb_estimators::navigation::{Geodetic, ImuMean};
use serde_json::Value;
use std::io::Write;
use std::sync::{Arc, LazyLock, Mutex, PoisonError};
use tracing::Dispatch;
use tracing::subscriber::NoSubscriber;
use tracing_subscriber::filter::LevelFilter;
use tracing_subscriber::fmt::MakeWriter;

const SECOND: i64 = 1_000_000_000;

/// Lines in memory.
#[derive(Clone, Default)]
struct Lines(Arc<Mutex<Vec<u8>>>);

impl Write for Lines {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl<'a> MakeWriter<'a> for Lines {
    type Writer = Self;

    fn make_writer(&'a self) -> Self {
        self.clone()
    }
}

/// A log with a recorder beside it.
#[derive(Default)]
struct Recorded {
    log: TracingSink,
    events: Vec<Event>,
}

impl EventSink for Recorded {
    fn event(&mut self, event: &Event) {
        self.log.event(event);
        self.events.push(*event);
    }
}

/// A hover in which something of every level happens; its events.
fn hover(strategy: StrategyKind) -> Vec<Event> {
    let config = StateEstimatorConfig { strategy, ..StateEstimatorConfig::default() };
    let mut estimator: FlightNavigator<Recorded> =
        FlightNavigator::new(config, Recorded::default()).expect("the defaults are in range");
    let position = Geodetic::from_degrees(48.0, 11.0, 500.0);
    let level = UnitQuaternion::identity();
    let attitude =
        AttitudeReading { time_ns: 0, world_from_body: level, tilt_deviation: 0.01, heading_deviation: 0.02 };
    let state = FlightControllerState {
        attitude,
        position,
        position_covariance: bb_core::nalgebra::Matrix3::identity(),
        velocity: Vector3::zeros(),
        velocity_covariance: bb_core::nalgebra::Matrix3::identity() * 0.01,
    };
    estimator.warm_start(state).expect("it waits");
    for i in 1..=400 {
        let time_ns = i * SECOND / 200;
        let specific_force = Vector3::new(0.0, 0.0, 9.80665);
        estimator.add_imu(&ImuMean { time_ns, angular_velocity: Vector3::zeros(), specific_force }).expect("good");
        estimator.tick(time_ns);
    }
    let reading = GpsHealthReading { time_ns: 2 * SECOND, health: GpsHealth::Spoofed };
    estimator.add_gps_health(reading).expect("it is a report");
    let anchor = PoseAnchor {
        time_ns: 2 * SECOND,
        provider: 0,
        position,
        world_from_body: level,
        covariance: bb_core::nalgebra::Matrix6::identity(),
        is_covariance_degraded: false,
    };
    estimator.add_pose_anchor(anchor).expect("it fits");
    let off = PoseAnchor { provider: 1, position: Geodetic { height: 9000.0, ..position }, ..anchor };
    estimator.add_pose_anchor(off).expect_err("it does not");
    // No sample for five seconds.
    for tenth in 20..=70 {
        estimator.tick(tenth * SECOND / 10);
    }
    std::mem::take(&mut estimator.sink_mut().events)
}

fn logged(strategy: StrategyKind, most: LevelFilter) -> (Vec<Value>, Vec<Event>) {
    // As long as there is one subscriber, tracing asks that of the thread which comes first whether a line is of interest to
    // any: a test without one would decide for all.
    static ANOTHER: LazyLock<Dispatch> = LazyLock::new(|| Dispatch::new(NoSubscriber::new()));
    LazyLock::force(&ANOTHER);
    let lines = Lines::default();
    let subscriber = tracing_subscriber::fmt().json().with_max_level(most).with_writer(lines.clone()).finish();
    let events = tracing::subscriber::with_default(subscriber, || hover(strategy));
    let bytes = lines.0.lock().unwrap_or_else(PoisonError::into_inner);
    let text = std::str::from_utf8(&bytes).expect("JSON is UTF-8");
    (text.lines().map(|line| serde_json::from_str(line).expect("each line is JSON")).collect(), events)
}

#[test]
fn each_event_is_one_json_object_of_its_level_with_its_fields() {
    for strategy in StrategyKind::ALL {
        let (logged, events) = logged(*strategy, LevelFilter::DEBUG);
        assert_eq!(logged.len(), events.len());
        for (line, event) in logged.iter().zip(&events) {
            let fields = &line["fields"];
            assert_eq!(line["level"], event.level().name().to_uppercase());
            assert_eq!((&fields["event"], &fields["time_ns"]), (&event.kind.name().into(), &event.time_ns.into()));
            let text = event.status_text().map(|text| Value::from(text.as_str()));
            assert_eq!(fields.get("status_text"), text.as_ref());
        }
        let of = |name: &str| {
            let found = logged.iter().find(|line| line["fields"]["event"] == name);
            &found.unwrap_or_else(|| panic!("{}: no {name}", strategy.name()))["fields"]
        };
        assert_eq!(of("ready")["to"], strategy.name());
        assert_eq!(of("started")["from"], "flight_controller");
        assert_eq!(of("gate")["to"], "blocked");
        assert_eq!(of("label")["to"], "satellite_anchored");
        assert_eq!(of("degraded")["input"], "anchor");
        assert!(of("degraded")["reason"].as_str().is_some_and(|reason| reason.contains("gate of")));
        assert_eq!(of("fallback_engaged")["status_text"], "NAV no estimate: FALL BACK TO FC IMU");
        let measured = logged.iter().find(|line| line["fields"]["nis"].is_f64()).expect("the anchor");
        assert_eq!(measured["fields"]["input"], "anchor");
    }
}

/// A level holds what is as severe or more; a recorder beside the log has everything, whatever is logged.
#[test]
fn a_level_holds_what_is_as_severe_and_costs_the_recorder_nothing() {
    let filters = [
        (LevelFilter::OFF, None),
        (LevelFilter::ERROR, Some(Level::Error)),
        (LevelFilter::WARN, Some(Level::Warn)),
        (LevelFilter::INFO, Some(Level::Info)),
        (LevelFilter::DEBUG, Some(Level::Debug)),
    ];
    for strategy in StrategyKind::ALL {
        let (all, expected) = logged(*strategy, LevelFilter::TRACE);
        assert_eq!(all.len(), expected.len(), "{}", strategy.name());
        let mut before = 0;
        for (filter, level) in filters {
            let (logged, events) = logged(*strategy, filter);
            assert_eq!(events, expected, "{}: {filter}", strategy.name());
            let of_level = events.iter().filter(|event| level.is_some_and(|level| event.level() <= level));
            let of_level: Vec<_> = of_level.map(|event| event.kind.name()).collect();
            let names: Vec<_> = logged.iter().filter_map(|line| line["fields"]["event"].as_str()).collect();
            assert_eq!(names, of_level, "{}: {filter}", strategy.name());
            assert!(level.is_none() || names.len() > before, "something of each level happens");
            before = names.len();
        }
        let texts: Vec<_> = expected.iter().filter_map(Event::status_text).collect();
        assert!(texts.len() >= 5 && texts.iter().all(|text| text.as_str().len() <= 50), "{}", strategy.name());
    }
}
