//! Settings other than the defaults are obeyed, for slow cameras and fast IMUs too.

use super::*;
use nalgebra::Isometry3;

/// Flies with these settings, with the camera and the anchors up to a time. Returns the outputs of 200 ticks a second.
fn flown(
    strategy: StrategyKind,
    seen_until_ns: [i64; 2],
    set: impl FnOnce(&mut StateEstimatorParams),
) -> (Estimator, Vec<EstimatorOutput>) {
    let flight = Flight::new(12, 3);
    let mut estimator = started_with(&flight, strategy, set);
    let flown = fly(&mut estimator, &flight.sent(true, true, false), |sent| match sent {
        Sent::Vio(vio) if vio.to_ns > seen_until_ns[0] => None,
        Sent::Anchor(anchor) if anchor.time_ns > seen_until_ns[1] => None,
        sent => Some(*sent),
    });
    assert!(flown.iter().all(|flown| flown.result.is_ok()), "{strategy:?}");
    (estimator, flown.into_iter().filter_map(|flown| flown.output).collect())
}

/// Times of the changes to a label.
fn changes_to(estimator: &Estimator, label: SourceLabel) -> Vec<i64> {
    let is_it = |event: &&Event| matches!(event.kind, EventKind::Label { to, .. } if to == label);
    kinds(estimator.sink(), "label").filter(is_it).map(|event| event.time_ns).collect()
}

#[test]
fn the_rate_of_the_output() {
    for (strategy, (output_rate, apart_ns)) in
        each([(1.0, SECOND), (2.5, 2 * SECOND / 5), (20.0, SECOND / 20), (200.0, STEP)])
    {
        let (_, outputs) = flown(strategy, [i64::MAX; 2], |params| params.output_rate = output_rate);
        let is_regular = outputs.windows(2).all(|two| two[1].emitted_ns - two[0].emitted_ns == apart_ns);
        assert!(is_regular, "{output_rate} Hz");
        let first_ns = outputs[0].emitted_ns;
        assert_eq!(outputs.len() as i64, (12 * SECOND - first_ns) / apart_ns + 1, "{output_rate} Hz");
    }
}

#[test]
fn the_age_of_an_anchor() {
    for (strategy, (anchor_age, age_ns)) in each([(0.7, 7 * FRAME), (3.0, 30 * FRAME), (6.0, 60 * FRAME)]) {
        // The last anchor is at 4.015 s.
        let (estimator, outputs) = flown(strategy, [i64::MAX, 5 * SECOND], |params| params.anchor_age = anchor_age);
        let last_ns = 4 * SECOND + 3 * STEP;
        let demoted = changes_to(&estimator, SourceLabel::VisualPropagated);
        assert_eq!(demoted.last(), Some(&(last_ns + age_ns + STEP)), "{strategy:?}, {anchor_age} s");
        for output in outputs.iter().filter(|output| output.anchor_age_ms.is_some()) {
            let is_anchored = output.anchor_age_ms.is_some_and(|age_ms| age_ms as i64 * 1_000_000 <= age_ns);
            assert_eq!(output.label == SourceLabel::SatelliteAnchored, is_anchored, "{anchor_age} s: {output:?}");
        }
    }
}

#[test]
fn the_time_after_which_the_camera_is_lost() {
    for (strategy, (visual_loss, loss_ns)) in each([(0.3, 3 * FRAME), (2.5, 25 * FRAME)]) {
        let (estimator, outputs) =
            flown(strategy, [5 * SECOND, 5 * SECOND], |params| params.visual_loss = visual_loss);
        // The last frame is at 5.0 s, and the label as of a sample.
        let lost_ns = 5 * SECOND + loss_ns + STEP;
        assert_eq!(changes_to(&estimator, SourceLabel::DeadReckoned), [lost_ns], "{visual_loss} s");
        for output in outputs.iter().filter(|output| output.time_ns > 2 * SECOND) {
            assert_eq!(output.label == SourceLabel::DeadReckoned, output.time_ns >= lost_ns, "{output:?}");
        }
    }
}

/// A provider that is too hot says that its covariance is a cheaper one. It is used as it is, to the last bit, and nothing else
/// changes.
#[test]
fn a_degraded_covariance_is_used_as_given() {
    let flight = Flight::new(6, 1);
    for strategy in StrategyKind::ALL {
        let flown = |factor: f64, is_marked: bool| {
            let mut estimator = started(&flight, *strategy);
            let flown = fly(&mut estimator, &flight.sent(true, true, false), |sent| {
                let Sent::Anchor(anchor) = sent else { return Some(*sent) };
                let is_covariance_degraded = is_marked && anchor.time_ns > 3 * SECOND;
                let covariance = anchor.covariance * factor;
                Some(Sent::Anchor(PoseAnchor { covariance, is_covariance_degraded, ..*anchor }))
            });
            assert!(flown.iter().all(|flown| flown.result.is_ok()), "{strategy:?}");
            flown.into_iter().filter_map(|flown| flown.output).collect::<Vec<_>>()
        };
        let (usual, mut degraded, given) = (flown(1.0, false), flown(9.0, true), flown(9.0, false));
        for output in &mut degraded {
            let quality = &mut output.quality;
            let is_anchor_degraded = core::mem::take(&mut quality.is_anchor_degraded);
            assert_eq!(is_anchor_degraded, output.time_ns > 3 * SECOND + 3 * STEP, "{strategy:?}");
            assert!(!output.degraded);
        }
        assert_eq!(degraded, given, "{strategy:?}");
        // Three times the deviation is in the covariance of the estimate, which the camera hardly improves.
        let [usual, degraded] =
            [usual, degraded].map(|outputs| outputs[outputs.len() - 1].covariance[(0, 0)].sqrt());
        assert!(degraded > 1.5 * usual, "{strategy:?}: {degraded} m, {usual} m");
    }
}

/// The camera with every n-th frame only, as if the others had not been captured.
fn every(flight: &Flight, n: usize) -> impl Iterator<Item = VioOutput> {
    flight.vio.chunks_exact(n).map(move |parts| {
        let way = parts.iter().fold(Isometry3::identity(), |way, part| {
            way * Isometry3::from_parts(part.translation.into(), part.from_to)
        });
        VioOutput {
            from_ns: parts[0].from_ns,
            to_ns: parts[n - 1].to_ns,
            translation: way.translation.vector,
            from_to: way.rotation,
            // Orientation errors displace the next pose, by 15 m/s times the time since then.
            covariance: parts[0].covariance * (2 * n) as f64,
            bias: None,
        }
    })
}

#[test]
fn a_slow_camera_is_waited_for() {
    let flight = Flight::new(30, 3);
    for (strategy, (n, keyframe_interval)) in each([(1, 0.05), (5, 0.2), (5, 1.0), (10, 0.8), (10, 1.0), (12, 1.0)])
    {
        let mut estimator = started_with(&flight, strategy, |params| {
            (params.keyframe_interval, params.visual_loss) = (keyframe_interval, 3.0);
        });
        let mut camera = every(&flight, n).peekable();
        let mut refused = 0;
        for sent in &flight.sent(false, true, false) {
            ignore(sent.to(&mut estimator));
            if let Some(vio) = camera.next_if(|vio| vio.to_ns <= sent.time_ns()) {
                refused += usize::from(estimator.add_vio(vio).is_err());
            }
        }
        // The frame period is known from the second frame on.
        assert!(refused <= 1, "{strategy:?}, {n}, {keyframe_interval} s: {refused}");
        assert_eq!(estimator.counts().dropped, 0);
        assert!(flight.error(&estimator.predicted(30 * SECOND).unwrap()).0 < 3.0, "{strategy:?}");
    }
}

/// A keyframe does not wait for a camera that has stopped.
#[test]
fn without_the_camera_keyframes_come_at_their_interval() {
    for (strategy, flight, mut estimator) in flights(12, 3) {
        let mut camera = every(&flight, 10).take_while(|vio| vio.to_ns <= 4 * SECOND).peekable();
        for sent in &flight.sent(false, false, false) {
            ignore(sent.to(&mut estimator));
            if let Some(vio) = camera.next_if(|vio| vio.to_ns <= sent.time_ns()) {
                ignore(estimator.add_vio(vio));
            }
        }
        let mut times: Vec<i64> = estimator.smoothed_history(20).iter().map(|past| past.time_ns).collect();
        times.reverse();
        let late: Vec<i64> =
            times.windows(2).filter(|two| two[0] > 4 * SECOND).map(|two| two[1] - two[0]).collect();
        assert!(late.len() >= 4 && late.iter().all(|apart| *apart == SECOND), "{strategy:?}: {late:?}");
        // One and a half frame periods after the last frame, plus one sample.
        let first = times.iter().find(|time_ns| **time_ns > 4 * SECOND).unwrap() - 4 * SECOND;
        assert!((first - 15 * FRAME - STEP).abs() <= STEP, "{strategy:?}: {first}");
    }
}

/// A fast IMU and a long lateness fit: with valid settings, nothing is dropped and the stated capacity is not exceeded.
#[test]
fn a_fast_imu_and_a_long_lateness_fit() {
    let flight = Flight::new(4, 3);
    for strategy in StrategyKind::ALL {
        let mut config = config(*strategy);
        let params = &mut config.params;
        (params.imu_rate, params.lateness, params.keyframe_interval) = (4000.0, 3.0, 2.0);
        let mut estimator: Estimator = FlightNavigator::new(config, Events::new()).unwrap();
        // Before the start as well: the position is unknown for twenty seconds.
        let most = config.params.room()[0];
        let mut held = 0;
        let mut add = |estimator: &mut Estimator, seconds: core::ops::Range<i64>| {
            for i in seconds.start * 4000 + 1..=seconds.end * 4000 {
                estimator.add_imu(&ImuMean { time_ns: i * SECOND / 4000, ..flight.samples[0] }).unwrap();
                held = held.max(estimator.held()[0]);
            }
        };
        add(&mut estimator, 0..20);
        estimator.add_pose_anchor(PoseAnchor { time_ns: 20 * SECOND, ..flight.anchors[0] }).unwrap();
        add(&mut estimator, 20..32);
        assert!(held <= most && held > 3 * 4000, "{held} of {most}");
        assert_eq!((estimator.counts().dropped, estimator.counts().overflows), (0, 0));
        assert_eq!(count(estimator.sink(), "samples_dropped"), 0);
        assert!(estimator.predicted(32 * SECOND).is_some());
    }
}

/// More than the configured rate: the oldest samples are dropped, which is counted and reported, and the estimate continues.
#[test]
fn an_imu_that_is_too_fast_drops_the_oldest_and_says_so() {
    let flight = Flight::new(12, 3);
    for (strategy, (imu_rate, keyframe_interval)) in each([(50.0, 1.0), (1.0, 10.0)]) {
        let mut estimator = started_with(&flight, strategy, |params| {
            (params.imu_rate, params.keyframe_interval) = (imu_rate, keyframe_interval);
        });
        let room = estimator.config().params.room()[0];
        for sent in &flight.sent(true, true, false) {
            ignore(sent.to(&mut estimator));
            assert!(estimator.held()[0] <= room);
            if let Some(output) = estimator.tick(sent.time_ns()) {
                assert!(flight.error(&output).0 < 5.0, "{strategy:?}");
            }
        }
        let dropped = estimator.counts().dropped;
        let told = kinds(estimator.sink(), "samples_dropped").map(|event| match event.kind {
            EventKind::SamplesDropped { count } => count,
            _ => 0,
        });
        assert!(dropped > 0, "{strategy:?}: {dropped}");
        assert_eq!(told.sum::<u64>(), dropped);
        assert!(count(estimator.sink(), "samples_dropped") < 1000, "not one event a sample");
        // Inputs that can no longer be placed are refused.
        let late = estimator.add_pose_anchor(PoseAnchor { provider: 3, ..flight.anchors[9] });
        let too_old = Refusal::TooOld { time_ns: flight.anchors[9].time_ns };
        assert_eq!(late, degraded(too_old), "{strategy:?}");
    }
}
