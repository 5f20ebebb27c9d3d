//! Invariants of every flight with a camera, and the handling of wrong observations.

use nalgebra::{SVector, UnitQuaternion, Vector2, Vector3};
use proptest::prelude::*;

use super::super::keyframe::Keyframe;
use super::super::landmark::Sight;
use super::flight::{Drone, Flight, N, Smoother, converged, linear, open, sensors};
use super::scenery::{PIXEL, Scenery, camera, exact};
use crate::navigation::{
    Estimate, LandmarkParams, NAVIGATION, NavigationFactor, Observation, Refusal, Sighted, SmootherParams, Stream,
    nees,
};

fn apart(a: &Estimate<N>, b: &Estimate<N>) -> f64 {
    a.error_to::<Drone>(b).amax()
}

/// Every landmark keeps its first linearisation point.
fn once() -> LandmarkParams {
    LandmarkParams { relinearise: 1.0, ..exact() }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// The Jacobians by pose and landmark match the numeric ones.
    #[test]
    fn derivatives_are_the_numeric_ones(
        seed in any::<u64>(), u in 20.0..730.0_f64, v in 20.0..460.0_f64, depth in 5.0..80.0_f64,
    ) {
        let flight = Flight::new(seed, 2, 1.0);
        let mut smoother = Smoother::new(linear(5)).unwrap();
        smoother.start(0, &flight.start).unwrap();
        let keyframe = &smoother.window[0];
        let camera = camera();
        let (camera_from_world, centre) = camera.placed(&keyframe.point.position, &keyframe.point.world_from_body);
        let undistorted = camera.undistorted(&Vector2::new(u, v)).unwrap();
        let point = centre + camera_from_world.transpose() * undistorted.direction.push(1.0) * depth;
        let mut sight = Sight {
            serial: 0, version: 0, seen: undistorted, precision: 1.0, weight: 1.0,
            jacobian: nalgebra::Matrix2x3::zeros(), residual: Vector2::zeros(), arm: Vector3::zeros(),
        };
        prop_assert!(sight.linearise(&camera, keyframe, &point));
        prop_assert!(sight.residual.norm() < 1e-9);
        let residual = |keyframe: &Keyframe<NavigationFactor, N>, point: &Vector3<f64>| {
            sight.estimated::<_, Drone, N>(&camera, keyframe, point).unwrap().1
        };
        let step = 1e-5;
        for error in 0..N {
            let expected = sight.jacobian * sight.moved(&SVector::<f64, N>::ith(error, 1.0).into());
            let [ahead, back] = [step, -step].map(|step| {
                let mut keyframe = keyframe.clone();
                keyframe.correction[error] = step;
                residual(&keyframe, &point)
            });
            // The residual falls by the part that an error explains.
            let numeric = (back - ahead) / (2.0 * step);
            prop_assert!((numeric - expected).norm() < 1e-5 * (1.0 + expected.norm()), "{error}: {numeric} {expected}");
        }
        for axis in 0..3 {
            let [ahead, back] = [step, -step].map(|step| residual(keyframe, &(point + Vector3::ith(axis, step))));
            let numeric = (back - ahead) / (2.0 * step);
            prop_assert!((numeric - sight.jacobian.column(axis)).norm() < 1e-5 * (1.0 + numeric.norm()));
        }
    }

    /// Tracks that end before their first keyframe leaves lose no information.
    #[test]
    fn a_window_is_the_batch(seed in any::<u64>(), window in 7_usize..12) {
        let flight = Flight::new(seed, 30, 1.0);
        let scenery = Scenery::new(&flight, seed, 6, 6, Some(5.0));
        let mut batch = scenery.flown(&flight, Smoother::new(linear(30)).unwrap(), once());
        let mut here = scenery.flown(&flight, Smoother::new(linear(window)).unwrap(), once());
        for id in here.keyframes().collect::<Vec<_>>() {
            let (all, some) = (batch.smoothed(id).unwrap(), here.smoothed(id).unwrap());
            prop_assert!(apart(&all, &some) < 1e-7, "{id}: {}", apart(&all, &some));
            let (all, some) = (batch.smoothed_covariance(id).unwrap(), here.smoothed_covariance(id).unwrap());
            for i in 0..N {
                prop_assert!((all[(i, i)] / some[(i, i)] - 1.0).abs() < 1e-6, "{id}, {i}");
            }
        }
    }

    /// Late observations, in any order, give the same estimate in the end.
    #[test]
    fn the_order_of_arrival_does_not_matter(
        seed in any::<u64>(),
        order in Just((0..10_usize).collect::<Vec<_>>()).prop_shuffle(),
    ) {
        let flight = Flight::new(seed, 10, 1.0);
        let scenery = Scenery::new(&flight, seed, 6, 8, Some(5.0));
        // The prior of a landmark is given with whichever observation comes first.
        let guessed = |id: u64| {
            let all = scenery.seen.iter().flatten();
            all.filter(|seen| seen.landmark == id).find_map(|seen| seen.guess)
        };
        let arrived = |order: &[usize]| {
            let mut smoother = Smoother::new(converged(10)).unwrap();
            smoother.set_camera(camera(), exact()).unwrap();
            smoother.start(0, &flight.start).unwrap();
            for k in 1..10 {
                flight.fly_to(&mut smoother, k);
                flight.measure(&mut smoother, k);
            }
            for k in order {
                for seen in &scenery.seen[*k] {
                    let seen = Observation { guess: guessed(seen.landmark), ..*seen };
                    smoother.observe(&mut open(), *k as u64, &seen).unwrap();
                }
                smoother.update().unwrap();
            }
            smoother
        };
        let mut in_order = arrived(&(0..10).collect::<Vec<_>>());
        let mut shuffled = arrived(&order);
        for id in 0..10 {
            let (a, b) = (in_order.smoothed(id).unwrap(), shuffled.smoothed(id).unwrap());
            prop_assert!(apart(&a, &b) < 1e-6, "{id}: {}", apart(&a, &b));
            let (a, b) = (in_order.smoothed_covariance(id).unwrap(), shuffled.smoothed_covariance(id).unwrap());
            for i in 0..N {
                prop_assert!((a[(i, i)] / b[(i, i)] - 1.0).abs() < 1e-5, "{id}, {i}");
            }
        }
    }

    /// Without a guess, landmarks give no information on the origin and heading of the world, however often they are
    /// relinearised or marginalised.
    #[test]
    fn what_is_unobservable_stays_unknown(seed in any::<u64>()) {
        let mut flight = Flight::new(seed, 60, 1.0);
        for measured in &mut flight.measured {
            measured.retain(|factor| matches!(factor, NavigationFactor::RelativePose(_)));
        }
        flight.start.velocity_covariance *= 1e6;
        let scenery = Scenery::new(&flight, seed, 8, 100, None);
        let params = SmootherParams { relinearise_rotation: 1e-3, iterations: 2, ..linear(8) };
        let mut smoother = Smoother::new(params).unwrap();
        smoother.set_camera(camera(), LandmarkParams::default()).unwrap();
        smoother.start(0, &flight.start).unwrap();
        for k in 1..60 {
            flight.fly_to(&mut smoother, k);
            flight.measure(&mut smoother, k);
            for seen in &scenery.seen[k] {
                let _ = smoother.observe(&mut open(), k as u64, seen);
            }
            smoother.update().unwrap();
            let covariance = smoother.covariance().unwrap();
            prop_assert!(covariance[(8, 8)] >= 0.05 * 0.05 * (1.0 - 1e-3), "{k}: {}", covariance[(8, 8)]);
            prop_assert!(covariance[(0, 0)] + covariance[(1, 1)] >= 2.0 * (1.0 - 1e-3), "{k}");
        }
        prop_assert!(smoother.landmarks().1 > 0);
    }

    /// Arbitrary numbers leave it with finite numbers.
    #[test]
    fn absurd_observations(
        seed in any::<u64>(),
        numbers in proptest::collection::vec(prop_oneof![
            any::<f64>(), Just(f64::NAN), Just(f64::INFINITY), Just(1e300), Just(-1e-300), 0.0..480.0
        ], 42),
    ) {
        let flight = Flight::new(seed, 8, 1.0);
        let scenery = Scenery::new(&flight, seed, 4, 5, None);
        let mut smoother = scenery.flown(&flight, Smoother::new(linear(6)).unwrap(), LandmarkParams::default());
        let mut stream = Stream::default();
        for part in numbers.chunks(7) {
            let guess = (part[6] > 100.0).then(|| (Vector3::new(part[2], part[3], part[4]), part[5]));
            let pixel = Vector2::new(part[0], part[1]);
            let id = scenery.places.len() as u64 + (part[0].to_bits() % 3);
            for k in [5, 7] {
                let seen = Observation { guess, ..Observation::new(id, pixel, part[5]) };
                let _ = smoother.observe(&mut stream, k, &seen);
            }
        }
        smoother.update().unwrap();
        prop_assert!(smoother.estimate().unwrap().is_finite());
        prop_assert!(smoother.covariance().is_some());
    }
}

/// If the sensors err exactly as the smoother is told, its errors match its covariance, also with tracks that outlive
/// the window.
#[test]
fn errors_are_as_large_as_the_smoother_says() {
    const FLIGHTS: u32 = 100;
    const KEYFRAMES: usize = 60;
    for guess in [None, Some(5.0)] {
        let params = SmootherParams { sensors: sensors(), window: 8, ..SmootherParams::default() };
        let mut sum = 0.0;
        for seed in 1..=u64::from(FLIGHTS) {
            let flight = Flight::new(seed, KEYFRAMES, 1.0);
            let scenery = Scenery::new(&flight, seed, 10, 100, guess);
            let smoother = scenery.flown(&flight, Smoother::new(params).unwrap(), exact());
            let covariance = smoother.covariance().unwrap();
            let of_navigation = covariance.fixed_view::<NAVIGATION, NAVIGATION>(0, 0).into_owned();
            let error = flight.error(KEYFRAMES - 1, &smoother.estimate().unwrap());
            sum += nees(&error, &of_navigation).unwrap() / f64::from(FLIGHTS);
        }
        let dimension = NAVIGATION as f64;
        let spread = 3.0 * (2.0 * dimension / f64::from(FLIGHTS)).sqrt();
        assert!((sum - dimension).abs() < spread, "{guess:?}: NEES {sum}, not {dimension} ± {spread}");
    }
}

/// A flight with its last keyframe in the window, and landmarks in use.
fn flown() -> (Flight, Scenery, Smoother) {
    let flight = Flight::new(11, 12, 0.0);
    let scenery = Scenery::new(&flight, 11, 8, 100, Some(5.0));
    let params = LandmarkParams { landmarks: 40, ..LandmarkParams::default() };
    let mut smoother = Smoother::new(linear(20)).unwrap();
    smoother.set_camera(camera(), params).unwrap();
    smoother.start(0, &flight.start).unwrap();
    for k in 1..12 {
        flight.fly_to(&mut smoother, k);
        flight.measure(&mut smoother, k);
        if k < 11 {
            scenery.observe(&mut smoother, k);
        }
        smoother.update().unwrap();
    }
    (flight, scenery, smoother)
}

#[test]
fn refusals_are_named_and_counted() {
    let (_, scenery, mut smoother) = flown();
    let mut stream = Stream::default();
    let good = scenery.seen[11][0];
    let before = smoother.estimate().unwrap();
    let with = |pixel: (f64, f64), deviation_px: f64| Observation {
        pixel: Vector2::new(pixel.0, pixel.1),
        deviation_px,
        ..good
    };
    let mut refused = |seen: Observation| smoother.observe(&mut stream, 11, &seen);
    assert_eq!(refused(with((f64::NAN, 1.0), 1.0)), Err(Refusal::NonFinite));
    assert_eq!(refused(with((1.0, 1e9), 1.0)), Err(Refusal::OutOfRange));
    assert_eq!(refused(with((-3.0, 1.0), 1.0)), Err(Refusal::OutOfRange));
    assert_eq!(refused(with((1.0, 1.0), 0.0)), Err(Refusal::Noise));
    assert_eq!(refused(with((1.0, 1.0), f64::NAN)), Err(Refusal::NonFinite));
    let (above, deviation) = (Vector3::new(0.0, 0.0, 1e4), 1.0);
    let new =
        Observation { guess: Some((above, deviation)), ..Observation::new(9999, Vector2::new(5.0, 5.0), 1.0) };
    assert_eq!(refused(new), Err(Refusal::NotObservable), "behind the camera");
    assert_eq!(refused(Observation { guess: Some((above, 0.0)), ..new }), Err(Refusal::Noise));
    assert_eq!(refused(Observation { guess: Some((above * f64::NAN, 1.0)), ..new }), Err(Refusal::NonFinite));
    assert_eq!(refused(Observation { guess: Some((above * 1e6, 1.0)), ..new }), Err(Refusal::OutOfRange));
    assert!(matches!(refused(with((5.0, 5.0), 1.0)), Err(Refusal::Gate { .. })), "a wrong match");
    assert!(matches!(refused(good), Ok(Sighted::Used(_))));
    assert_eq!(refused(good), Err(Refusal::Repeated { landmark: good.landmark }));
    assert_eq!(smoother.observe(&mut stream, 500, &good), Err(Refusal::NoKeyframe { id: 500 }));
    let counts = stream.counts();
    assert_eq!((counts.invalid, counts.gate, counts.not_applicable, counts.fused), (8, 1, 3, 1));
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
    let (_, scenery, mut smoother) = flown();
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
    let (_, scenery, mut smoother) = flown();
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

/// When an id is reused for another landmark, the landmark restarts, and the old information stays in use.
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
    let mut smoother = Smoother::new(SmootherParams { sensors: sensors(), ..SmootherParams::default() }).unwrap();
    smoother.set_camera(camera(), LandmarkParams::default()).unwrap();
    smoother.start(0, &flight.start).unwrap();
    let mut stream = Stream::default();
    for k in 1..30 {
        flight.fly_to(&mut smoother, k);
        flight.measure(&mut smoother, k);
        for seen in &scenery.seen[k] {
            let _ = smoother.observe(&mut stream, k as u64, seen);
        }
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
    let (_, _, mut smoother) = flown();
    let mut stream = open();
    for k in 5..12 {
        // As distant as a star: it appears at the same place in each image except for the turn of the body.
        let keyframe = smoother.window[k].estimate::<Drone>();
        let (camera_from_world, _) = camera().placed(&keyframe.position, &keyframe.world_from_body);
        let Ok(seen) = camera().seen(&(camera_from_world * Vector3::new(10.0, 20.0, -1000.0))) else { continue };
        let seen = Observation::new(77_777, seen.pixel, PIXEL);
        if let Ok(sighted) = smoother.observe(&mut stream, k as u64, &seen) {
            assert_eq!(sighted, Sighted::Waiting);
        }
    }
    let before = smoother.covariance().unwrap();
    assert_eq!(smoother.landmark(77_777), None);
    smoother.update().unwrap();
    assert!((smoother.covariance().unwrap() - before).amax() < 1e-12);
}

/// Lost landmarks are eventually removed, and landmarks that outlive the window continue.
#[test]
fn landmarks_come_and_go() {
    let flight = Flight::new(17, 150, 1.0);
    let scenery = Scenery::new(&flight, 17, 10, 25, None);
    let mut smoother =
        Smoother::new(SmootherParams { sensors: sensors(), window: 8, ..SmootherParams::default() }).unwrap();
    smoother.set_camera(camera(), LandmarkParams { landmarks: 60, ..LandmarkParams::default() }).unwrap();
    smoother.start(0, &flight.start).unwrap();
    let (mut stream, mut most) = (Stream::default(), 0);
    for k in 1..150 {
        flight.fly_to(&mut smoother, k);
        flight.measure(&mut smoother, k);
        for seen in &scenery.seen[k] {
            let _ = smoother.observe(&mut stream, k as u64, seen);
        }
        smoother.update().unwrap();
        most = most.max(smoother.landmarks().0);
    }
    assert!(scenery.places.len() > 100 && most < 50, "{} {most}", scenery.places.len());
    let counts = stream.counts();
    assert_eq!(counts.not_applicable, 0, "{counts:?}");
    assert!(counts.fused > 900, "{counts:?}");
    assert!(smoother.landmarks().1 > 5);
}

/// Turning the world and its landmarks gives the same result.
#[test]
fn heading_and_origin() {
    let flight = Flight::new(23, 25, 1.0);
    let scenery = Scenery::new(&flight, 23, 8, 15, Some(5.0));
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 2.0);
    let origin = Vector3::new(3000.0, -2000.0, 100.0);
    let place = |position: &Vector3<f64>| turn * position + origin;
    let mut other = Flight::new(23, 25, 1.0);
    other.start.position = place(&other.start.position);
    other.start.velocity = turn * other.start.velocity;
    other.start.world_from_body = turn * other.start.world_from_body;
    for factor in other.measured.iter_mut().flatten() {
        match factor {
            NavigationFactor::GnssPosition(fix) => fix.position = place(&fix.position),
            NavigationFactor::GnssVelocity(fix) => fix.velocity = turn * fix.velocity,
            NavigationFactor::AbsolutePose(pose) => {
                pose.position = place(&pose.position);
                pose.world_from_body = turn * pose.world_from_body;
            }
            _ => {}
        }
    }
    let mut there = Scenery::new(&flight, 23, 8, 15, Some(5.0));
    for seen in there.seen.iter_mut().flatten() {
        seen.guess = seen.guess.map(|(known, deviation)| (place(&known), deviation));
    }
    let params = SmootherParams { sensors: sensors(), window: 10, ..SmootherParams::default() };
    let here = scenery.flown(&flight, Smoother::new(params).unwrap(), LandmarkParams::default());
    let there = there.flown(&other, Smoother::new(params).unwrap(), LandmarkParams::default());
    let (here, there) = (here.estimate().unwrap(), there.estimate().unwrap());
    let apart = (place(&here.position) - there.position).norm();
    let turned = (turn * here.world_from_body).angle_to(&there.world_from_body);
    // Depths that are almost unknown lose digits.
    assert!(apart < 1e-4 && turned < 1e-6, "{apart} m, {turned} rad");
}
