//! Observations that are refused, wrong, or say too little.

use nalgebra::{Vector2, Vector3};

use super::flight::{Drone, Flight, Smoother, apart, linear, open, sensors};
use super::scenery::{PIXEL, Scenery, camera, seeing};
use crate::navigation::{LandmarkParams, Observation, Refusal, Sighted, SmootherParams, Stream};

/// A smoother in flight with its last keyframe in the window, and landmarks in use.
fn flown() -> (Scenery, Smoother) {
    let flight = Flight::new(11, 12, 0.0);
    let scenery = Scenery::new(&flight, 11, 8, 100, Some(5.0));
    let params = LandmarkParams { landmarks: 40, ..LandmarkParams::default() };
    let mut smoother = seeing(&flight, linear(20), params);
    scenery.fly(&flight, &mut smoother, 1..11);
    flight.advance(&mut smoother, 11);
    smoother.update().unwrap();
    (scenery, smoother)
}

#[test]
fn refusals_are_named_and_counted() {
    let (scenery, mut smoother) = flown();
    let mut stream = Stream::default();
    let good = scenery.seen[11][0];
    let before = smoother.estimate().unwrap();
    let with = |pixel: (f64, f64), deviation_px: f64| Observation {
        pixel: Vector2::new(pixel.0, pixel.1),
        deviation_px,
        ..good
    };
    let new = Observation::new(9999, Vector2::new(5.0, 5.0), 1.0);
    let guessed = |scale: f64, deviation: f64| Observation {
        guess: Some((Vector3::new(0.0, 0.0, 1e4) * scale, deviation)),
        ..new
    };
    for (seen, refusal) in [
        (with((f64::NAN, 1.0), 1.0), Refusal::NonFinite),
        (with((1.0, 1e9), 1.0), Refusal::OutOfRange),
        (with((-3.0, 1.0), 1.0), Refusal::OutOfRange),
        (with((1.0, 1.0), 0.0), Refusal::Noise),
        (with((1.0, 1.0), 9e-4), Refusal::Noise),
        (with((1.0, 1.0), f64::NAN), Refusal::NonFinite),
        (guessed(1.0, 1.0), Refusal::NotObservable),
        (guessed(1.0, 0.0), Refusal::Noise),
        (guessed(1.0, 9e-4), Refusal::Noise),
        (guessed(f64::NAN, 1.0), Refusal::NonFinite),
        (guessed(1e6, 1.0), Refusal::OutOfRange),
    ] {
        assert_eq!(smoother.observe(&mut stream, 11, &seen), Err(refusal), "{seen:?}");
    }
    let mut refused = |seen: Observation| smoother.observe(&mut stream, 11, &seen);
    assert!(matches!(refused(with((5.0, 5.0), 1.0)), Err(Refusal::Gate { .. })), "a wrong match");
    assert!(matches!(refused(good), Ok(Sighted::Used(_))));
    assert_eq!(refused(good), Err(Refusal::Repeated { landmark: good.landmark }));
    assert_eq!(smoother.observe(&mut stream, 500, &good), Err(Refusal::NoKeyframe { id: 500 }));
    let counts = stream.counts();
    assert_eq!((counts.invalid, counts.gate, counts.not_applicable, counts.fused), (10, 1, 3, 1));
    smoother.update().unwrap();
    assert!(apart(&before, &smoother.estimate().unwrap()) < 0.01);
    // Fill it with new ids that are never seen again.
    let (mut full, mut more) = (0, Stream::default());
    for id in 0..40 {
        let seen = Observation::new(20_000 + id, Vector2::new(100.0, 100.0), 1.0);
        full += u64::from(smoother.observe(&mut more, 11, &seen) == Err(Refusal::Full { id: 11 }));
    }
    assert_eq!((smoother.landmarks().0, more.counts().not_applicable), (40, full));
    assert!(full > 0);
    let mut blind = Smoother::new(linear(5)).unwrap();
    assert_eq!(blind.observe(&mut stream, 0, &good), Err(Refusal::NotStarted));
}

/// A landmark with a wrong guess, above the camera, is restarted instead of kept until it leaves the window.
#[test]
fn a_landmark_behind_the_camera_begins_again() {
    let (scenery, mut smoother) = flown();
    let good = scenery.seen[11][0];
    let landmarks = smoother.landmarks.as_mut().unwrap();
    landmarks.begin(9999, Some((Vector3::new(0.0, 0.0, 1e4), 1.0))).unwrap();
    let patience = landmarks.params.patience;
    let mut stream = Stream::default();
    for _ in 1..patience {
        let seen = Observation { landmark: 9999, ..good };
        assert_eq!(smoother.observe(&mut stream, 11, &seen), Err(Refusal::NotObservable));
    }
    assert_eq!(smoother.observe(&mut stream, 11, &Observation { landmark: 9999, ..good }), Ok(Sighted::Waiting));
    assert_eq!(smoother.landmark(9999), None);
}

/// A landmark without any information is not treated as exactly known: it waits until it is determined.
#[test]
fn an_indeterminate_landmark_waits() {
    let (scenery, mut smoother) = flown();
    let good = scenery.seen[11][0];
    let place = scenery.places[good.landmark as usize];
    let landmarks = smoother.landmarks.as_mut().unwrap();
    let index = landmarks.begin(9999, Some((place, 1.0))).unwrap();
    landmarks.all[index].prior = None;
    landmarks.all[index].sum();
    let mut stream = Stream::default();
    assert_eq!(smoother.landmark(9999), None);
    assert_eq!(smoother.observe(&mut stream, 11, &Observation { landmark: 9999, ..good }), Ok(Sighted::Waiting));
}

/// An id may be reused for another landmark: the landmark restarts, and the old information stays in use.
#[test]
fn an_id_is_reused() {
    let flight = Flight::new(5, 30, 1.0);
    let mut scenery = Scenery::new(&flight, 5, 8, 100, None);
    // From keyframe 12 on, two landmarks have swapped ids.
    let ids: Vec<u64> = scenery.seen[12].iter().map(|seen| seen.landmark).take(2).collect();
    for seen in scenery.seen.iter_mut().skip(12).flatten() {
        if let Some(which) = ids.iter().position(|id| *id == seen.landmark) {
            seen.landmark = ids[1 - which];
        }
    }
    let mut smoother = seeing(
        &flight,
        SmootherParams { sensors: sensors(), ..SmootherParams::default() },
        LandmarkParams::default(),
    );
    let mut stream = Stream::default();
    for k in 1..30 {
        flight.advance(&mut smoother, k);
        scenery.observe_in(&mut stream, &mut smoother, k);
        smoother.update().unwrap();
    }
    assert!((4..=12).contains(&stream.counts().gate), "{:?}", stream.counts());
    let error = flight.error(29, &smoother.estimate().unwrap());
    assert!(error.fixed_rows::<3>(0).norm() < 3.0, "{error}");
    for which in 0..2 {
        if let Some(place) = smoother.landmark(ids[which]) {
            let distance = (place - scenery.places[ids[1 - which] as usize]).norm();
            assert!(distance < 8.0, "{distance} m off");
        }
    }
}

/// Without parallax, no landmark is triangulated. This is not an error, and nothing is used.
#[test]
fn without_parallax_landmarks_wait() {
    let (_, mut smoother) = flown();
    let mut stream = open();
    let mut waiting = 0;
    for k in 5..12 {
        // As distant as a star: it appears at the same place in each image except for the turn of the body.
        let keyframe = smoother.window[k].estimate::<Drone>();
        let (camera_from_world, _) = camera().placed(&keyframe.position, &keyframe.world_from_body);
        let Ok(seen) = camera().seen(&(camera_from_world * Vector3::new(10.0, 20.0, -1000.0))) else { continue };
        let seen = Observation::new(77_777, seen.pixel, PIXEL);
        assert_eq!(smoother.observe(&mut stream, k as u64, &seen), Ok(Sighted::Waiting), "{k}");
        waiting += 1;
    }
    assert!(waiting >= 4, "{waiting}");
    let before = smoother.covariance().unwrap();
    assert_eq!(smoother.landmark(77_777), None);
    smoother.update().unwrap();
    assert!((smoother.covariance().unwrap() - before).amax() < 1e-12);
}

/// A landmark may be seen again after a while: motion since its last observation counts, however long ago that is.
/// After more than a second without any measurement, its next observation passes the gate, and is as far off as
/// expected.
#[test]
fn a_landmark_may_be_seen_again_after_a_while() {
    const LAST: usize = 14;
    let (mut sum, mut count) = (0.0, 0.0);
    for seed in 1..=40 {
        let mut flight = Flight::new(seed, LAST + 1, 1.0);
        flight.measured.iter_mut().for_each(Vec::clear);
        let scenery = Scenery::new(&flight, seed, 10, 100, Some(5.0));
        let mut smoother = seeing(&flight, linear(20), LandmarkParams::default());
        scenery.observe(&mut smoother, 0);
        for k in 1..=LAST {
            flight.fly_to(&mut smoother, k);
            if k == 1 {
                scenery.observe(&mut smoother, k);
            }
            smoother.update().unwrap();
        }
        let known = |id: u64| scenery.seen[1].iter().any(|seen| seen.landmark == id);
        // One each: those of a keyframe share the error of its pose.
        let Some(again) = scenery.seen[LAST].iter().find(|seen| known(seen.landmark)) else { continue };
        let Ok(Sighted::Used(fused)) = smoother.observe(&mut Stream::default(), LAST as u64, again) else {
            panic!("{seed}: {:?}", smoother.observe(&mut Stream::default(), LAST as u64, again));
        };
        sum += fused.nis;
        count += 1.0;
    }
    assert!(count > 30.0);
    // A χ² variable with two degrees of freedom has a mean of 2 and a standard deviation of 2.
    let tolerance = 3.0 * 2.0 / f64::sqrt(count);
    assert!((sum / count - 2.0).abs() < tolerance, "NIS {}, not 2 ± {tolerance}", sum / count);
}
