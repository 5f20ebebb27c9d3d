//! Gaps of the IMU, whole and divided by other inputs.

use super::flight::SECOND;
use super::*;
use nalgebra::Matrix6;

#[test]
fn degraded_a_gap_of_the_imu_is_bridged() {
    let flight = Flight::new(4, 2);
    for strategy in StrategyKind::ALL {
        let mut estimator = started(&flight, *strategy);
        for sample in
            flight.samples[1..].iter().filter(|sample| !(2 * SECOND..5 * SECOND / 2).contains(&sample.time_ns))
        {
            let result = estimator.add_imu(sample);
            let is_after = sample.time_ns == 5 * SECOND / 2;
            assert_eq!(result, if is_after { Err(EstimatorError::Degraded(Reason::Bridged)) } else { Ok(()) });
        }
        assert!(estimator.predicted(4 * SECOND).unwrap().covariance[(0, 0)] > 0.1);
        // The camera divides the gap and measures the motion in it. The motion that the IMU missed is still unknown.
        let mut estimator = started(&flight, *strategy);
        for sent in &flight.sent(true, false, false) {
            let is_missing = (2 * SECOND..5 * SECOND / 2).contains(&sent.time_ns());
            if is_missing && matches!(sent, Sent::Imu(_)) {
                continue;
            }
            ignore(sent.to(&mut estimator));
            if let (Sent::Imu(sample), Some(output)) = (sent, estimator.predicted(sent.time_ns())) {
                let is_before = sample.time_ns < 2 * SECOND;
                let is_after = (5 * SECOND / 2..3 * SECOND).contains(&sample.time_ns);
                assert!(if output.degraded { !is_before } else { !is_after }, "{}", sample.time_ns);
            }
        }
        assert!(kinds(estimator.sink(), "degraded").all(|event| event.level() == Level::Warn));
    }
}

/// Frames of the camera that say nothing do not make a gap of the IMU shorter: its noise is no smaller if they divide it.
#[test]
fn a_gap_that_the_camera_divides_is_as_uncertain() {
    let flight = Flight::new(4, 2);
    for strategy in StrategyKind::ALL {
        let [whole, divided] = [false, true].map(|with_frames| {
            let mut estimator = started(&flight, *strategy);
            for sent in &flight.sent(true, false, false) {
                let is_missing = (2 * SECOND..5 * SECOND / 2).contains(&sent.time_ns());
                match sent {
                    Sent::Imu(_) if is_missing => {}
                    // Once the camera is known, the smoother waits for its frames.
                    Sent::Vio(vio) if vio.to_ns > 2 * SECOND => {
                        if with_frames {
                            let covariance = Matrix6::identity() * 1e8;
                            ignore(estimator.add_vio(VioOutput { covariance, ..*vio }));
                        }
                    }
                    sent => ignore(sent.to(&mut estimator)),
                }
            }
            estimator.predicted(4 * SECOND).unwrap().covariance
        });
        for i in 0..6 {
            let ratio = divided[(i, i)] / whole[(i, i)];
            // Undivided, it is one step, in which the tilt does not turn gravity yet.
            assert!((0.8..2.0).contains(&ratio), "{strategy:?}, {i}: {} and {}", whole[(i, i)], divided[(i, i)]);
        }
    }
}

/// The gap that a clock set back leaves is one even if frames on the new clock divide it into parts shorter than a sample may be.
#[test]
fn the_gap_of_a_clock_that_is_set_back_is_as_uncertain_if_it_is_divided() {
    let flight = Flight::new(8, 2);
    let (jump_ns, by_ns) = (4 * SECOND, 3600 * SECOND);
    for strategy in StrategyKind::ALL {
        let [whole, divided] = [false, true].map(|with_frames| {
            let mut estimator = started(&flight, *strategy);
            let mut frames = 0;
            for sent in flight.sent(true, false, false) {
                let is_after = sent.time_ns() > jump_ns;
                match sent.behind(if is_after { by_ns } else { 0 }) {
                    Sent::Vio(_) if is_after => {}
                    sent => {
                        let is_bridged = sent.to(&mut estimator) == Err(EstimatorError::Degraded(Reason::Bridged));
                        if !(is_bridged && with_frames) {
                            continue;
                        }
                        // It continues from half a second before the jump.
                        let in_gap =
                            |vio: &&VioOutput| (jump_ns - SECOND / 2..jump_ns + SECOND / 2).contains(&vio.to_ns);
                        for vio in flight.vio.iter().filter(in_gap) {
                            let said = VioOutput { covariance: Matrix6::identity() * 1e8, ..*vio };
                            ignore(Sent::Vio(said).behind(by_ns).to(&mut estimator));
                            frames += 1;
                        }
                    }
                }
            }
            assert_eq!((estimator.counts().set_back, frames), (1, if with_frames { 10 } else { 0 }));
            estimator.predicted(8 * SECOND - by_ns).unwrap().covariance
        });
        for i in 0..6 {
            let ratio = divided[(i, i)] / whole[(i, i)];
            assert!((0.8..2.0).contains(&ratio), "{strategy:?}, {i}: {} and {}", whole[(i, i)], divided[(i, i)]);
        }
    }
}

/// The gap before the first sample is as uncertain if it is divided, for a warm start some time before it.
#[test]
fn the_gap_before_the_first_sample_is_as_uncertain_if_it_is_divided() {
    let flight = Flight::new(4, 2);
    for strategy in StrategyKind::ALL {
        let [whole, divided] = [false, true].map(|with_frames| {
            let mut estimator = estimator(*strategy);
            estimator.warm_start(flight.warm_start(0)).unwrap();
            if with_frames {
                for vio in flight.vio.iter().filter(|vio| vio.to_ns < SECOND / 2) {
                    let said = VioOutput { covariance: Matrix6::identity() * 1e8, ..*vio };
                    ignore(estimator.add_vio(said));
                }
            }
            for sample in flight.samples.iter().filter(|sample| sample.time_ns >= SECOND / 2) {
                ignore(estimator.add_imu(sample));
            }
            estimator.predicted(4 * SECOND).unwrap().covariance
        });
        for i in 0..6 {
            let ratio = divided[(i, i)] / whole[(i, i)];
            assert!((0.8..2.0).contains(&ratio), "{strategy:?}, {i}: {} and {}", whole[(i, i)], divided[(i, i)]);
        }
    }
}
