//! A report of spoofing blocks the gate even if its stamp is bad or the queue is full.

use super::*;

/// Time at which the receiver has been stable for four seconds.
const NOW_NS: i64 = 4 * SECOND;

/// Returns an estimator in flight until [`NOW_NS`] with a stable receiver, whose gate is open, and the inputs after
/// that.
fn flown(flight: &Flight, strategy: StrategyKind) -> (Estimator, Vec<Sent>) {
    let mut estimator = started(flight, strategy);
    let (before, after): (Vec<Sent>, Vec<Sent>) =
        flight.sent(true, true, true).iter().partition(|sent| sent.time_ns() <= NOW_NS);
    send(&mut estimator, &before);
    assert_eq!(estimator.health().gate, GateState::Open);
    (estimator, after)
}

fn report(time_ns: i64, health: GpsHealth) -> GpsHealthReading {
    GpsHealthReading { time_ns, health }
}

/// Later stable reports start a dwell and let no fix in.
fn stays_out(mut estimator: Estimator, rest: &[Sent]) {
    assert!(!estimator.health().gate.is_open());
    let before = count(estimator.sink(), "rejected");
    send(&mut estimator, rest);
    let fixes = rest.iter().filter(|sent| matches!(sent, Sent::Fix(_))).count();
    assert_eq!((fixes, count(estimator.sink(), "rejected") - before), (10, 10));
    assert!(matches!(estimator.health().gate, GateState::Dwelling { .. }), "{:?}", estimator.health().gate);
}

#[test]
fn of_two_reports_at_one_time_the_worse_counts() {
    let flight = Flight::new(6, 1);
    let rising = [GpsHealth::Stable, GpsHealth::Unstable, GpsHealth::NoFix, GpsHealth::Spoofed];
    let mut falling = rising;
    falling.reverse();
    for (strategy, order) in each([rising, falling]) {
        let (mut estimator, rest) = flown(&flight, strategy);
        for health in order {
            assert!(estimator.add_gps_health(report(NOW_NS - STEP, health)).is_ok(), "{health:?}");
            let again = estimator.add_gps_health(report(NOW_NS - STEP, health));
            assert_eq!(again, degraded(Reason::Duplicate));
        }
        stays_out(estimator, &rest);
    }
}

#[test]
fn a_refused_report_blocks_all_the_same() {
    let flight = Flight::new(6, 1);
    for (strategy, (time_ns, refusal)) in each([
        (SECOND, Refusal::TooOld { time_ns: SECOND }),
        (i64::MIN, Refusal::TooOld { time_ns: i64::MIN }),
        (5 * SECOND, Refusal::InTheFuture { time_ns: 5 * SECOND }),
        (i64::MAX, Refusal::InTheFuture { time_ns: i64::MAX }),
    ]) {
        let (mut estimator, rest) = flown(&flight, strategy);
        assert_eq!(estimator.add_gps_health(report(time_ns, GpsHealth::Spoofed)), degraded(refusal));
        stays_out(estimator, &rest);
    }
}

/// The flight controller has taken its share of the room, or the window has taken all of it and waits for a sample.
#[test]
fn a_report_for_which_there_is_no_room_blocks_all_the_same() {
    let flight = Flight::new(6, 1);
    let attitude = flight.warm_start(0).attitude;
    for strategy in StrategyKind::ALL {
        let (mut estimator, _) = flown(&flight, *strategy);
        let mut time_ns = NOW_NS - STEP;
        while estimator.add_attitude(AttitudeReading { time_ns, ..attitude }).is_ok() {
            time_ns += 1;
        }
        let refused = estimator.add_gps_health(report(time_ns, GpsHealth::Spoofed));
        assert_eq!(refused, degraded(Reason::Overflow));
        assert_eq!(estimator.health().gate, GateState::Blocked);
        // A late anchor has the queue run again.
        assert!(estimator.add_pose_anchor(PoseAnchor { provider: 1, ..flight.anchors[2] }).is_ok());
        assert_eq!(estimator.health().gate, GateState::Blocked);

        let (mut estimator, rest) = flown(&flight, *strategy);
        let anchor = |provider| PoseAnchor { provider, time_ns: NOW_NS + STEP, ..flight.anchors[3] };
        assert!((1..).any(|provider| estimator.add_pose_anchor(anchor(provider)).is_err()));
        assert_eq!(estimator.held()[1], estimator.config().params.room()[1]);
        assert!(estimator.add_gps_health(report(i64::MAX, GpsHealth::Spoofed)).is_err());
        assert_eq!(estimator.health().gate, GateState::Blocked);
        send(&mut estimator, &rest);
        assert!(!estimator.health().gate.is_open());
    }
}

/// A refused report with each sample, for longer than the queue has room, costs neither a relative pose nor an anchor.
#[test]
fn refused_reports_without_end_leave_room_for_the_window() {
    for (strategy, flight, mut estimator) in flights(8, 1) {
        let room = estimator.config().params.room()[1];
        let mut alarms = 0;
        for sent in flight.sent(true, true, true) {
            let result = sent.to(&mut estimator);
            match sent {
                Sent::Vio(_) | Sent::Anchor(_) => assert_eq!(result, Ok(()), "{strategy:?}, after {alarms}"),
                Sent::Imu(_) => {
                    assert!(estimator.add_gps_health(report(i64::MAX, GpsHealth::Spoofed)).is_err());
                    assert_eq!(estimator.health().gate, GateState::Blocked);
                    alarms += 1;
                }
                _ => {}
            }
            assert!(estimator.held()[1] < room - room / 16, "{}", estimator.held()[1]);
        }
        assert!(alarms > 2 * room, "{alarms}");
        assert_eq!((count(estimator.sink(), "fatal"), estimator.counts().too_old), (0, 0));
    }
}

/// A report of another clock blocks the gate all the same. It waits for the IMU, whose clock is then another one:
/// before the first sample, and after the clock was set back.
#[test]
fn a_report_of_another_clock_blocks_all_the_same() {
    let flight = Flight::new(8, 1);
    let behind_ns = 1000 * SECOND;
    for strategy in StrategyKind::ALL {
        let mut estimator = estimator(*strategy);
        estimator.add_gps_health(report(5000 * SECOND, GpsHealth::Spoofed)).unwrap();
        flight.samples[..200].iter().for_each(|sample| ignore(estimator.add_imu(sample)));
        assert_eq!(estimator.health().gate, GateState::Blocked);

        let (mut estimator, _) = flown(&flight, *strategy);
        estimator.add_gps_health(report(NOW_NS + 40 * STEP, GpsHealth::Spoofed)).unwrap();
        for sample in &flight.samples[801..1001] {
            ignore(Sent::Imu(*sample).behind(behind_ns).to(&mut estimator));
        }
        assert_eq!((estimator.counts().set_back, estimator.health().gate), (1, GateState::Blocked));
        // Nor is a fix from before the jump was believed let in by a late report.
        let late_ns = NOW_NS + 20 * STEP - behind_ns;
        ignore(estimator.add_gps_health(report(late_ns, GpsHealth::Stable)));
        let refused = estimator.add_gnss(GnssReading { time_ns: late_ns + STEP, ..flight.fixes[19] });
        assert!(matches!(refused, Err(EstimatorError::Degraded(Reason::Gate(_)))), "{strategy:?}: {refused:?}");
    }
}
