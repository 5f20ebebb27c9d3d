//! Outages of the IMU after which the attitude is unknown: no estimate is trusted that is wrong, and each is trusted again.

use super::*;
use crate::navigation::math::rotation;

/// Results of flights.
#[derive(Debug, Default)]
struct Seen {
    /// Outputs after the outage that are not marked `degraded`, and how many of them are off by more than four deviations on an axis of the
    /// position.
    trusted: usize,
    wrong: usize,
    /// Times from the end of the outage to the first trusted output, s.
    again_s: Vec<f64>,
    /// Starts of outages that no trusted output follows.
    never: Vec<i64>,
    /// Rotation error of the last output, rad.
    turned: f64,
    resets: u32,
}

impl Seen {
    fn median_s(&self) -> f64 {
        let mut sorted = self.again_s.clone();
        sorted.sort_by(f64::total_cmp);
        sorted[sorted.len() / 2]
    }

    /// Checks that at most one trusted estimate in thirty is off by more than its deviations allow.
    fn is_honest(&self) -> bool {
        self.wrong * 30 <= self.trusted
    }

    fn longest_s(&self) -> f64 {
        self.again_s.iter().copied().fold(0.0, f64::max)
    }

    /// Flies with these inputs, as `change` leaves them, without the IMU for a time.
    fn fly<T: Into<Option<Sent>>>(
        &mut self,
        flight: &Flight,
        sent: &[Sent],
        (from_ns, for_ns): (i64, i64),
        until_ns: i64,
        change: impl Fn(&Sent) -> T,
    ) {
        let mut estimator = started(flight, StrategyKind::Eskf);
        let is_silent = |time_ns: i64| (from_ns..from_ns + for_ns).contains(&time_ns);
        let mut again_ns = None;
        for sent in sent.iter().take_while(|sent| sent.time_ns() <= until_ns) {
            if matches!(sent, Sent::Imu(_)) && is_silent(sent.time_ns()) {
                continue;
            }
            let Some(sent) = change(sent).into() else { continue };
            ignore(sent.to(&mut estimator));
            let Sent::Imu(sample) = sent else { continue };
            let Some(output) = estimator.tick(sample.time_ns) else { continue };
            self.resets = output.resets;
            if sample.time_ns < from_ns + for_ns {
                continue;
            }
            self.turned = flight.error(&output).1;
            if output.degraded {
                continue;
            }
            self.trusted += 1;
            again_ns = again_ns.or(Some(sample.time_ns - from_ns - for_ns));
            let off = flight.off(&output);
            let is_wrong = |i: usize| off[i].abs() > 4.0 * output.covariance[(i, i)].sqrt();
            self.wrong += usize::from((0..3).any(is_wrong));
        }
        match again_ns {
            Some(again_ns) => self.again_s.push(again_ns as f64 * 1e-9),
            None => self.never.push(from_ns),
        }
    }
}

/// Moves and turns the first anchor after a time.
fn misplacing(
    flight: &Flight,
    after_ns: i64,
    by: Vector3<f64>,
    turn: Vector3<f64>,
) -> impl Fn(&Sent) -> Option<Sent> {
    move |sent| match flight.moving(sent, by) {
        Sent::Anchor(anchor) if (after_ns..after_ns + SECOND).contains(&anchor.time_ns) => {
            let world_from_body = rotation(&turn) * anchor.world_from_body;
            Some(Sent::Anchor(PoseAnchor { world_from_body, ..anchor }))
        }
        _ => Some(*sent),
    }
}

/// Seeds of flights, outages in each of them with their starts and lengths, s, and the time that is looked at after
/// each, s.
type Outages = (&'static [u64], &'static [(i64, i64)], i64);

const MANY: Outages = (&[3, 11], &[(3, 2), (10, 2), (23, 2), (27, 2), (2, 10), (9, 10), (17, 10), (27, 10)], 12);
const LONG: Outages = (&[5], &[(3, 10), (6, 10), (9, 10), (12, 10), (15, 10)], 25);

/// After 10 s, the attitude may be so wrong that it takes a newcomer.
#[test]
fn it_is_trusted_again_and_right() {
    let as_it_is: fn(&Sent) -> Sent = |sent| *sent;
    let without_velocity: fn(&Sent) -> Sent = |sent| match sent {
        Sent::Fix(fix) => Sent::Fix(GnssReading { velocity: None, ..*fix }),
        sent => *sent,
    };
    let spoofed: fn(&Sent) -> Sent = |sent| sent.reporting(GpsHealth::Spoofed);
    // At least so many trusted outputs, at most so many outages that none follows, and the median and the longest
    // time until one does, s.
    for (what, [with_vio, with_anchors], change, (seeds, outages, then_s), trusted, never, [median_s, longest_s]) in [
        ("a receiver alone", [false, false], as_it_is, MANY, 600, 0, [3.0, 8.0]),
        ("positions alone take longer", [false, false], without_velocity, LONG, 200, 0, [20.0, 20.0]),
        ("anchors and a camera, a spoofed receiver", [true, true], spoofed, MANY, 600, 2, [2.0, 2.7]),
        ("anchors alone beside it: from the second on", [false, true], spoofed, MANY, 600, 2, [2.0, 2.7]),
    ] {
        let mut seen = Seen::default();
        for seed in seeds {
            let flight = Flight::new(50, *seed);
            let sent = flight.sent(with_vio, with_anchors, true);
            for (from_s, for_s) in outages {
                let outage = (from_s * SECOND, for_s * SECOND);
                seen.fly(&flight, &sent, outage, (from_s + for_s + then_s) * SECOND, change);
            }
        }
        assert!(seen.is_honest() && seen.trusted > trusted && seen.never.len() <= never, "{what}: {seen:?}");
        assert!(seen.median_s() < median_s && seen.longest_s() < longest_s, "{what}: {seen:?}");
    }
}

/// The first anchor after the outage is 150 m off and turned by a radian.
#[test]
fn an_anchor_that_is_an_outlier_is_not_believed() {
    let flight = Flight::new(46, 4);
    let sent = flight.sent(true, true, false);
    for for_s in [2, 8] {
        let mut seen = Seen::default();
        let off = [Vector3::new(120.0, -90.0, 0.0), Vector3::new(0.3, -0.2, 1.0)];
        let change = misplacing(&flight, (6 + for_s) * SECOND, off[0], off[1]);
        seen.fly(&flight, &sent, (6 * SECOND, for_s * SECOND), 45 * SECOND, change);
        assert!(seen.wrong * 20 <= seen.trusted && seen.never.is_empty(), "{for_s}: {seen:?}");
        assert!(seen.longest_s() < 25.0, "{for_s}: {seen:?}");
    }
}

/// Fixes fit any attitude for a moment: the first anchor after the outage is turned, and only that.
#[test]
fn an_anchor_that_is_turned_is_not_believed_because_a_fix_fits() {
    let turns =
        [Vector3::x(), Vector3::y() * -1.5, Vector3::z() * 0.8, Vector3::z() * 3.0, Vector3::new(1.0, -1.0, 1.0)];
    let mut seen = Seen::default();
    for (seed, turn) in (1..).zip(turns) {
        let flight = Flight::new(32, seed);
        let sent = flight.sent(false, true, true);
        for from_s in [4, 9, 14] {
            let change = misplacing(&flight, (from_s + 3) * SECOND, Vector3::zeros(), turn);
            seen.fly(&flight, &sent, (from_s * SECOND, 3 * SECOND), (from_s + 18) * SECOND, change);
        }
    }
    assert!(seen.is_honest() && seen.trusted > 500, "{seen:?}");
    assert!(seen.never.is_empty() && seen.longest_s() < 8.0, "{seen:?}");
}

/// Frames of the camera and fixes are ahead of the IMU, and fused within the gap.
#[test]
fn what_is_fused_within_an_outage_does_not_hide_it() {
    for seed in 1..=3 {
        let flight = Flight::new(26, seed);
        let sent = flight.sent(true, false, true);
        for (from_s, for_ms) in [(4, 800), (7, 1000), (10, 1100)] {
            let mut seen = Seen::default();
            let outage = (from_s * SECOND, for_ms * SECOND / 1000);
            seen.fly(&flight, &sent, outage, (from_s + 14) * SECOND, |sent| *sent);
            assert!(seen.is_honest() && seen.never.is_empty() && seen.resets == 0, "{seen:?}");
        }
    }
}

/// The camera sees what the IMU does not: one relative pose spans the outage.
#[test]
fn a_relative_pose_across_the_outage_ends_it() {
    let flight = Flight::new(14, 6);
    let mut estimator = started(&flight, StrategyKind::Eskf);
    // Samples after a longer one have to wait until their clock is believed.
    let (from_ns, to_ns) = (6 * SECOND, 75 * SECOND / 10);
    let mut last = None;
    for sent in &flight.sent(true, false, false) {
        let now_ns = sent.time_ns();
        match sent {
            Sent::Imu(_) if (from_ns..to_ns).contains(&now_ns) => continue,
            Sent::Vio(_) if (from_ns..to_ns + FRAME).contains(&now_ns) => continue,
            Sent::Vio(VioOutput { covariance, .. }) if now_ns == to_ns + FRAME => {
                let spanning = Flight::relative(from_ns - FRAME, now_ns);
                ignore(estimator.add_vio(VioOutput { covariance: *covariance, ..spanning }));
            }
            sent => ignore(sent.to(&mut estimator)),
        }
        let Sent::Imu(sample) = sent else { continue };
        last = estimator.tick(sample.time_ns).or(last);
        if let Some(output) = estimator.predicted(sample.time_ns).filter(|_| sample.time_ns > 10 * SECOND) {
            let (position, turned) = flight.error(&output);
            assert!(!output.degraded && turned < 0.1 && position < 8.0, "{} {position} {turned}", sample.time_ns);
        }
    }
    assert!(last.is_some_and(|output| output.resets == 0), "{last:?}");
}

/// Two outages in a row, the second before the attitude is known again.
#[test]
fn a_second_outage_begins_it_again() {
    let flight = Flight::new(40, 9);
    let sent: Vec<Sent> = flight.sent(false, false, true);
    for pause_ns in [SECOND / 2, 2 * SECOND] {
        let mut seen = Seen::default();
        let second_ns = 12 * SECOND + pause_ns;
        let change = |sent: &Sent| {
            let is_silent =
                matches!(sent, Sent::Imu(_)) && (second_ns..second_ns + SECOND).contains(&sent.time_ns());
            (!is_silent).then_some(*sent)
        };
        seen.fly(&flight, &sent, (10 * SECOND, 2 * SECOND), 30 * SECOND, change);
        assert!(seen.is_honest() && seen.never.is_empty(), "{seen:?}");
        assert!(seen.longest_s() - pause_ns as f64 * 1e-9 < 9.0, "{seen:?}");
        assert!(seen.turned < 0.05 && seen.resets == 0, "{seen:?}");
    }
}

/// Fixes after the outage come up to a second late.
#[test]
fn late_fixes_give_the_same_result() {
    let flight = Flight::new(22, 7);
    let sent: Vec<Sent> = flight.sent(true, true, true);
    let sent = sent.iter().filter(|sent| {
        let time_ns = sent.time_ns();
        match sent {
            Sent::Imu(_) => !(6 * SECOND..9 * SECOND).contains(&time_ns),
            Sent::Vio(_) | Sent::Anchor(_) => !(6 * SECOND..=17 * SECOND).contains(&time_ns),
            // Without the IMU, they would be too new for it.
            _ => !(6 * SECOND..10 * SECOND).contains(&time_ns),
        }
    });
    let sent: Vec<Sent> = sent.copied().collect();
    let fly = |late_ns: &dyn Fn(usize, &Sent) -> i64| {
        let mut arriving: Vec<(i64, &Sent)> =
            sent.iter().enumerate().map(|(i, sent)| (sent.time_ns() + late_ns(i, sent), sent)).collect();
        arriving.sort_by_key(|(at_ns, _)| *at_ns);
        let mut estimator = started(&flight, StrategyKind::Eskf);
        send(&mut estimator, arriving.into_iter().map(|(_, sent)| sent));
        (estimator.predicted(22 * SECOND), estimator.current_estimate(), estimator.smoothed_history(20))
    };
    let in_time = fly(&|_, _| 0);
    let late = fly(&|i, sent| match sent {
        Sent::Fix(fix) if fix.time_ns < 20 * SECOND => (i as i64 * 7 % 10) * SECOND / 10,
        _ => 0,
    });
    assert_eq!(in_time, late);
    assert!(in_time.0.is_some_and(|output| !output.degraded && output.resets == 0), "{in_time:?}");
}
