//! A late input may change what earlier ones became. The events say so as they would have at once, and nothing twice.

use super::entry::{Entry, Payload};
use super::*;

/// An anchor at the truth, moved by `off` metres along x, with this standard deviation of the position.
fn anchor(flight: &Flight, time_ns: i64, off: f64, deviation: f64) -> PoseAnchor {
    let truth = Flight::truth(time_ns);
    let covariance = Matrix6::from_fn(|i, j| match (i == j, i < 3) {
        (false, _) => 0.0,
        (true, true) => deviation * deviation,
        (true, false) => 1e-3,
    });
    let position = flight.frame.geodetic(&(truth.position + Vector3::x() * off));
    PoseAnchor { time_ns, position, covariance, world_from_body: truth.world_from_body, ..flight.anchors[0] }
}

/// Returns the events of an input: the name of the event, its level and its reason.
fn told(events: &[Event], input: InputKind, time_ns: i64) -> Vec<(&'static str, Level, Option<Reason>)> {
    let of_it = |event: &&Event| {
        let is_input = match event.kind {
            EventKind::Added { input: this, .. }
            | EventKind::Degraded { input: this, .. }
            | EventKind::Fatal { input: this, .. }
            | EventKind::Revised { input: this, .. } => this == input,
            EventKind::Rejected { .. } => input == InputKind::Gnss,
            _ => false,
        };
        is_input && event.time_ns == time_ns
    };
    let reason = |event: &Event| match event.kind {
        EventKind::Degraded { reason, .. } | EventKind::Fatal { reason, .. } => Some(reason),
        EventKind::Rejected { rejection } => Some(Reason::Gate(rejection)),
        _ => None,
    };
    events.iter().filter(of_it).map(|event| (event.kind.name(), event.level(), reason(event))).collect()
}

/// Checks that an anchor is told to be refused, once.
fn is_told_to_be_gated(events: &[Event], time_ns: i64) {
    let told = told(events, InputKind::Anchor, time_ns);
    let [("degraded", Level::Warn, Some(Reason::Refused(Refusal::Gate { .. })))] = told[..] else {
        panic!("{told:?}")
    };
}

#[test]
fn an_anchor_that_no_longer_fits_is_degraded_and_warned_of() {
    for (_, flight, mut estimator) in flights_by_imu::<Provided>(3, 1) {
        let wrong_ns = 3 * SECOND - STEP;
        assert!(matches!(estimator.add_pose_anchor(anchor(&flight, wrong_ns, 20.0, 1.5)), Ok(Added::Taken { .. })));
        let before = estimator.sink().len();
        // A precise one, and earlier: with it, the other is far off.
        assert!(estimator.add_pose_anchor(anchor(&flight, wrong_ns - FRAME, 0.0, 0.1)).is_ok());
        is_told_to_be_gated(&estimator.sink()[before..], wrong_ns);
        // Run again without a change: nothing is new.
        let before = estimator.sink().len();
        ignore(estimator.add_gps_health(GpsHealthReading { time_ns: wrong_ns - FRAME, health: GpsHealth::NoFix }));
        assert_eq!(told(&estimator.sink()[before..], InputKind::Anchor, wrong_ns), []);
        assert!(estimator.counts().reruns >= 2);
    }
}

#[test]
fn an_anchor_that_does_not_overrule_the_estimate_after_all_says_so() {
    let flight = Flight::new(7, 1);
    for strategy in StrategyKind::ALL {
        let mut estimator: Providing = FlightNavigator::new(config(*strategy), Events::new()).unwrap();
        estimator.warm_start(flight.warm_start(0)).unwrap();
        let (mut overruled_ns, mut last_ns) = (None, 0);
        for sample in &flight.samples {
            estimator.add_imu(sample).unwrap();
            let time_ns = sample.time_ns;
            if time_ns % FRAME != 0 || time_ns < 3 * SECOND || overruled_ns.is_some() {
                continue;
            }
            let reason = estimator.add_pose_anchor(anchor(&flight, time_ns, 40.0, 1.0)).unwrap_err().reason();
            match reason {
                Reason::Overruled { .. } => overruled_ns = Some(time_ns),
                Reason::Refused(Refusal::Gate { .. }) => last_ns = time_ns,
                _ => panic!("{strategy:?}: {reason:?}"),
            }
        }
        let (before, overruled_ns) = (estimator.sink().len(), overruled_ns.unwrap());
        // One that fits the estimate comes late: those before it do not count.
        let late = anchor(&flight, overruled_ns - FRAME / 2, 0.0, 1.0);
        ignore(estimator.add_pose_anchor(PoseAnchor { provider: 1, ..late }));
        is_told_to_be_gated(&estimator.sink()[before..], overruled_ns);
        assert_eq!(told(&estimator.sink()[before..], InputKind::Anchor, last_ns), [], "still refused");
    }
}

/// Just above where nothing flies, and falling.
#[test]
fn an_input_that_breaks_the_estimate_after_all_is_fatal() {
    let flight = Flight::new(5, 1);
    let (early_ns, late_ns) = (4 * SECOND, 5 * SECOND - FRAME);
    let lowered = flight.frame.geodetic(&Flight::truth(early_ns).position).height + 9999.8;
    let low = |position: Geodetic, by: f64| Geodetic { height: position.height - by, ..position };
    for strategy in StrategyKind::ALL {
        let mut estimator: Providing = FlightNavigator::new(config(*strategy), Events::new()).unwrap();
        let start = flight.warm_start(0);
        let position_covariance = nalgebra::Matrix3::identity() * 25.0;
        let position = low(start.position, lowered - 6.0);
        estimator.warm_start(FlightControllerState { position, position_covariance, ..start }).unwrap();
        add_all(&mut estimator, &flight.samples);
        let position = estimator.predicted(late_ns).unwrap().position;
        let (height, place) = (position.height, estimator.frame().unwrap().position(&position));
        let vague = Provided::Place(GnssPosition::new(place, 5.0, 5.0).into());
        assert!(matches!(estimator.add_factor(late_ns, 0, vague), Ok(Added::Taken { .. })), "{strategy:?}");
        assert!(estimator.tick(5 * SECOND).is_some());
        let before = estimator.sink().len();
        let precise = anchor(&flight, early_ns, 0.0, 0.1);
        ignore(estimator.add_pose_anchor(PoseAnchor { position: low(precise.position, lowered), ..precise }));
        let told_of = told(&estimator.sink()[before..], InputKind::Factor, late_ns);
        let fatal = ("fatal", Level::Error, Some(Reason::Refused(Refusal::OutOfRange)));
        assert_eq!(told_of, [fatal], "{strategy:?}, from {height} m");
        assert!(estimator.tick(5 * SECOND + SECOND / 5).is_none(), "none for this tick");
    }
}

/// A frame that succeeds is told by its relative pose. Its failure would be told by nothing else. No input is known that makes one
/// fail: what a factor says is bounded, and so is the state.
#[test]
fn a_frame_is_told_if_it_fails() {
    let payload = Payload::<Provided>::Frame;
    let mut frame = Entry { payload, outcome: None, rejection: None };
    assert_eq!(frame.payload.kind(), InputKind::Frame);
    let (added, reason) = (Ok(None), Reason::Refused(Refusal::NonFinite));
    let (fatal, degraded) = (Err(EstimatorError::Fatal(reason)), Err(EstimatorError::Degraded(reason)));
    let input = InputKind::Frame;
    assert_eq!(frame.became(added, None), [None, None]);
    assert_eq!(frame.became(degraded, None), [Some(EventKind::Degraded { input, reason }), None]);
    assert_eq!(frame.became(degraded, None), [None, None]);
    assert_eq!(frame.became(added, None), [Some(EventKind::Revised { input }), None]);
    assert_eq!(frame.became(fatal, None), [Some(EventKind::Fatal { input, reason }), None]);
}

/// A rejection by another condition is another rejection.
#[test]
fn a_fix_that_is_rejected_for_another_reason_says_so() {
    for (strategy, flight, mut estimator) in flights_by_imu::<Provided>(4, 1) {
        let fix = flight.fixes[14];
        let unhealthy = Reason::Gate(Rejection::Unhealthy);
        assert_eq!(estimator.add_gnss(fix), degraded(unhealthy));
        let spoofed = GpsHealthReading { time_ns: fix.time_ns - STEP, health: GpsHealth::Spoofed };
        estimator.add_gps_health(spoofed).unwrap();
        let expected = [unhealthy, Reason::Gate(Rejection::Spoofed)];
        let told_of = told(estimator.sink(), InputKind::Gnss, fix.time_ns);
        assert_eq!(told_of, expected.map(|reason| ("rejected", Level::Warn, Some(reason))), "{strategy:?}");
    }
}

/// Warnings that are revised go to the recorder as well.
#[test]
fn fixes_that_are_taken_after_all_are_told_once() {
    for (strategy, flight, mut estimator) in flights_by_imu::<Provided>(4, 1) {
        // Fixes first, and only then the health at their times.
        let late = &flight.fixes[14..];
        let unhealthy = Reason::Gate(Rejection::Unhealthy);
        late.iter().for_each(|fix| assert_eq!(estimator.add_gnss(*fix), degraded(unhealthy)));
        let before = estimator.sink().len();
        flight.health[10..].iter().for_each(|reading| ignore(estimator.add_gps_health(*reading)));
        for fix in late {
            let told_of = told(&estimator.sink()[before..], InputKind::Gnss, fix.time_ns);
            assert_eq!(told_of, [("revised", Level::Info, None)], "{strategy:?}");
        }
    }
}

/// Several starts in a time that is run again.
#[test]
fn each_start_is_told_once() {
    let flight = Flight::new(3, 1);
    for strategy in StrategyKind::ALL {
        let mut estimator: Providing = FlightNavigator::new(config(*strategy), Events::new()).unwrap();
        add_all(&mut estimator, &flight.samples);
        let at = |i: i64| 2 * SECOND + i * FRAME;
        estimator.add_pose_anchor(anchor(&flight, at(0), 0.0, 1.0)).unwrap();
        // The first that agrees with another for as long as the first had been right moves it.
        (1..=4).for_each(|i| ignore(estimator.add_pose_anchor(anchor(&flight, at(i), 4000.0, 1.0))));
        assert_eq!(times_of(estimator.sink(), "started"), [at(0), at(2)]);
        let reading = GpsHealthReading { time_ns: at(0) - STEP, health: GpsHealth::Unstable };
        estimator.add_gps_health(reading).unwrap();
        assert_eq!(
            (estimator.counts().reruns > 0, times_of(estimator.sink(), "started")),
            (true, vec![at(0), at(2)])
        );
    }
}
