//! A report of spoofing blocks the gate even if its stamp is bad or the queue is full.

use super::flight::{SECOND, STEP};
use super::*;
use crate::navigation::Refusal;

/// Returns an estimator in flight for four seconds with a stable receiver, whose gate is open.
fn flown(flight: &Flight, strategy: StrategyKind) -> Estimator {
    let mut estimator = started(flight, strategy);
    let sent = flight.sent(true, true, true);
    sent.iter().filter(|sent| sent.time_ns() <= 4 * SECOND).for_each(|sent| ignore(sent.to(&mut estimator)));
    assert_eq!(estimator.health().gate, GateState::Open);
    estimator
}

fn report(time_ns: i64, health: GpsHealth) -> GpsHealthReading {
    GpsHealthReading { time_ns, health }
}

/// Later stable reports start a dwell and let no fix in.
fn stays_out(flight: &Flight, mut estimator: Estimator) {
    assert!(!estimator.health().gate.is_open());
    let before = count(estimator.sink(), "rejected");
    let rest: Vec<Sent> =
        flight.sent(true, true, true).into_iter().filter(|sent| sent.time_ns() > 4 * SECOND).collect();
    rest.iter().for_each(|sent| ignore(sent.to(&mut estimator)));
    let fixes = rest.iter().filter(|sent| matches!(sent, Sent::Fix(_))).count();
    assert_eq!((fixes, count(estimator.sink(), "rejected") - before), (10, 10));
    assert!(matches!(estimator.health().gate, GateState::Dwelling { .. }), "{:?}", estimator.health().gate);
}

#[test]
fn of_two_reports_at_one_time_the_worse_counts() {
    let flight = Flight::new(6, 1);
    let all = [GpsHealth::Stable, GpsHealth::Unstable, GpsHealth::NoFix, GpsHealth::Spoofed];
    for strategy in StrategyKind::ALL {
        for is_reversed in [false, true] {
            let mut estimator = flown(&flight, *strategy);
            let mut order = all;
            if is_reversed {
                order.reverse();
            }
            for health in order {
                assert!(estimator.add_gps_health(report(4 * SECOND - STEP, health)).is_ok(), "{health:?}");
                let again = estimator.add_gps_health(report(4 * SECOND - STEP, health));
                assert_eq!(again, Err(EstimatorError::Degraded(Reason::Duplicate)));
            }
            stays_out(&flight, estimator);
        }
    }
}

#[test]
fn a_refused_report_blocks_all_the_same() {
    let flight = Flight::new(6, 1);
    for strategy in StrategyKind::ALL {
        let too_old = |time_ns| Reason::Refused(Refusal::TooOld { time_ns });
        let ahead = |time_ns| Reason::Refused(Refusal::InTheFuture { time_ns });
        for (time_ns, reason) in [
            (SECOND, too_old(SECOND)),
            (i64::MIN, too_old(i64::MIN)),
            (5 * SECOND, ahead(5 * SECOND)),
            (i64::MAX, ahead(i64::MAX)),
        ] {
            let mut estimator = flown(&flight, *strategy);
            let refused = estimator.add_gps_health(report(time_ns, GpsHealth::Spoofed));
            assert_eq!(refused, Err(EstimatorError::Degraded(reason)));
            stays_out(&flight, estimator);
        }
    }
}

#[test]
fn a_report_for_which_there_is_no_room_blocks_all_the_same() {
    let flight = Flight::new(6, 1);
    for strategy in StrategyKind::ALL {
        let mut estimator = flown(&flight, *strategy);
        let attitude = flight.warm_start(0).attitude;
        let mut time_ns = 4 * SECOND - STEP;
        while estimator.add_attitude(AttitudeReading { time_ns, ..attitude }).is_ok() {
            time_ns += 1;
        }
        let refused = estimator.add_gps_health(report(time_ns, GpsHealth::Spoofed));
        assert_eq!(refused, Err(EstimatorError::Degraded(Reason::Overflow)));
        assert_eq!(estimator.health().gate, GateState::Blocked);
        // A late anchor has the queue run again.
        let anchor = PoseAnchor { provider: 1, ..flight.anchors[2] };
        assert!(estimator.add_pose_anchor(anchor).is_ok());
        assert_eq!(estimator.health().gate, GateState::Blocked);
    }
}

/// A refused report with each sample, for longer than the queue has room, costs neither a relative pose nor an anchor.
#[test]
fn refused_reports_without_end_leave_room_for_the_window() {
    let flight = Flight::new(8, 1);
    for strategy in StrategyKind::ALL {
        let mut estimator = started(&flight, *strategy);
        let room = estimator.config().params.room()[1];
        let mut alarms = 0;
        for sent in flight.sent(true, true, true) {
            let result = sent.to(&mut estimator);
            if matches!(sent, Sent::Vio(_) | Sent::Anchor(_)) {
                assert!(result.is_ok(), "{strategy:?}: {result:?} after {alarms}");
            }
            if matches!(sent, Sent::Imu(_)) {
                assert!(estimator.add_gps_health(report(i64::MAX, GpsHealth::Spoofed)).is_err());
                assert_eq!(estimator.health().gate, GateState::Blocked);
                alarms += 1;
            }
            assert!(estimator.held()[1] < room - room / 16, "{}", estimator.held()[1]);
        }
        assert!(alarms > 2 * room, "{alarms}");
        assert_eq!((count(estimator.sink(), "fatal"), estimator.counts().too_old), (0, 0));
    }
}

/// Also where the window has taken all the room, and waits for a sample.
#[test]
fn a_refused_report_blocks_a_queue_that_is_full() {
    let flight = Flight::new(6, 1);
    for strategy in StrategyKind::ALL {
        let mut estimator = flown(&flight, *strategy);
        let mut provider = 1;
        let anchor = |provider| PoseAnchor { provider, time_ns: 4 * SECOND + STEP, ..flight.anchors[3] };
        while estimator.add_pose_anchor(anchor(provider)).is_ok() {
            provider += 1;
        }
        assert_eq!(estimator.held()[1], estimator.config().params.room()[1]);
        assert!(estimator.add_gps_health(report(i64::MAX, GpsHealth::Spoofed)).is_err());
        assert_eq!(estimator.health().gate, GateState::Blocked);
        let rest = flight.sent(true, true, true).into_iter().filter(|sent| sent.time_ns() > 4 * SECOND);
        rest.for_each(|sent| ignore(sent.to(&mut estimator)));
        assert!(!estimator.health().gate.is_open());
    }
}

/// A report of another clock blocks the gate all the same. It waits for the IMU, whose clock is then another one:
/// before the first sample, and after the clock was set back.
#[test]
fn a_report_of_another_clock_blocks_all_the_same() {
    let flight = Flight::new(8, 1);
    for strategy in StrategyKind::ALL {
        let mut estimator = estimator(*strategy);
        estimator.add_gps_health(report(5000 * SECOND, GpsHealth::Spoofed)).unwrap();
        flight.samples.iter().take(200).for_each(|sample| ignore(estimator.add_imu(sample)));
        assert_eq!(estimator.health().gate, GateState::Blocked);

        let mut estimator = flown(&flight, *strategy);
        estimator.add_gps_health(report(4 * SECOND + 40 * STEP, GpsHealth::Spoofed)).unwrap();
        let behind = |sample: &crate::navigation::ImuMean| Sent::Imu(*sample).behind(1000 * SECOND);
        flight.samples.iter().skip(801).take(200).for_each(|sample| ignore(behind(sample).to(&mut estimator)));
        assert_eq!((estimator.counts().set_back, estimator.health().gate), (1, GateState::Blocked));
        // Nor is a fix from before the jump was believed let in by a late report.
        let late_ns = 4 * SECOND + 20 * STEP - 1000 * SECOND;
        ignore(estimator.add_gps_health(report(late_ns, GpsHealth::Stable)));
        let refused = estimator.add_gnss(GnssReading { time_ns: late_ns + STEP, ..flight.fixes[19] });
        assert!(matches!(refused, Err(EstimatorError::Degraded(Reason::Gate(_)))), "{strategy:?}: {refused:?}");
    }
}
