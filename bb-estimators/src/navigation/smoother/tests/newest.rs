//! An elimination of the newest keyframe alone, where nothing else has changed, against one of the whole window.

use bb_tests::laws;
use proptest::prelude::*;

use super::flight::{Flight, N, Smoother, linear, open, usual};
use super::scenery::{Scenery, exact, seeing};
use crate::navigation::{
    GnssPosition, Kernel, LandmarkParams, NavigationFactor, Refusal, RelativePose, SmootherParams,
};
use nalgebra::Vector3;

/// The solution as it is, and after everything is eliminated again.
fn both(smoother: &mut Smoother) -> Result<(), TestCaseError> {
    let mut whole = smoother.clone();
    whole.eliminate_all();
    let numbers = |of: &mut Smoother| {
        let last = of.window.len() - 1;
        let means: Vec<_> = of.window.iter().map(|keyframe| keyframe.correction).collect();
        let covariances = [0, last / 2, last].map(|index| of.covariance_now(index).unwrap());
        (means, covariances)
    };
    let (means, covariances) = numbers(smoother);
    let (all_means, all_covariances) = numbers(&mut whole);
    for (here, all) in means.iter().flatten().zip(all_means.iter().flatten()) {
        // Rounding: 4e-7 was seen, with weights that change.
        prop_assert!((here - all).abs() <= 1e-5 * (1.0 + all.abs()), "{here} {all}");
    }
    for (here, all) in covariances.iter().zip(&all_covariances) {
        for i in 0..N {
            prop_assert!((here[i][i] / all[i][i] - 1.0).abs() < 1e-6, "{i}: {} {}", here[i][i], all[i][i]);
        }
    }
    Ok(())
}

/// Adds a relative pose at keyframe `id` that is more precise than the one of the flight, and some of its deviations off. The weight of
/// a robust one changes with each update.
fn add_pose(smoother: &mut Smoother, flight: &Flight, id: usize, is_robust: bool) {
    let Some(NavigationFactor::RelativePose(pose)) = flight.measured[id].first().copied() else { panic!() };
    let off = if is_robust { 0.3 } else { 0.01 };
    let pose = RelativePose {
        translation: pose.translation + Vector3::new(off, -off, off),
        translation_covariance: pose.translation_covariance * 0.04,
        ..pose
    };
    let kernel = if is_robust { Kernel::Huber(1.345) } else { Kernel::Squares };
    let result = smoother.add_robust(&mut open(), id as u64, pose, kernel);
    assert!(matches!(result, Ok(_) | Err(Refusal::Gate { .. } | Refusal::Full { .. })), "{id}: {result:?}");
}

/// Keyframes stay where they were linearised first, but weights of kernels change.
fn weighing(window: usize) -> SmootherParams {
    SmootherParams { relinearise_rotation: 1.0, relinearise_position: 1e6, iterations: 10, ..linear(window) }
}

/// The length of the tracks.
const LONGEST: usize = 6;

/// Changes by a relative pose before its keyframe has seen anything pass over no link.
#[test]
fn in_the_usual_order_only_the_newest_is_eliminated() {
    for window in [12, 2 * LONGEST + 12] {
        let flight = Flight::new(5, 60, 1.0);
        let scenery = Scenery::new(&flight, 5, 8, LONGEST, Some(5.0));
        let landmarks = LandmarkParams { relinearise: 1.0, ..exact() };
        let mut smoother = seeing(&flight, weighing(window), landmarks);
        for k in 1..60 {
            flight.advance(&mut smoother, k);
            assert_eq!(smoother.eliminate(usize::MAX), 1, "{k}");
            scenery.observe(&mut smoother, k);
            smoother.update().unwrap();
            if smoother.is_tied() {
                both(&mut smoother).unwrap();
            }
        }
    }
}

laws! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// Whatever changes in the window: observations, positions and relative poses that come late, at any keyframe, before or
    /// after the others or the update; weights; tracks that begin and end, and relinearised
    /// keyframes and landmarks.
    #[test]
    fn it_is_the_elimination_of_all(
        seed in any::<u64>(),
        window in 4_usize..24,
        longest in 2_usize..9,
        late in prop::collection::vec((0_usize..40, 0_usize..12), 0..40),
        positions in prop::collection::vec((0_usize..40, 0_usize..24), 0..6),
        poses in prop::collection::vec((0_usize..40, 0_usize..24, 0_usize..4, 0_usize..2), 0..24),
        observed_first in prop::collection::vec(0_usize..40, 0..20),
        is_linear in any::<bool>(),
    ) {
        let flight = Flight::new(seed, 40, 1.0);
        let scenery = Scenery::new(&flight, seed, 6, longest, Some(5.0));
        let params = if is_linear { weighing(window) } else { usual(window) };
        let landmarks = if is_linear { LandmarkParams { relinearise: 1.0, ..exact() } } else { exact() };
        let mut smoother = seeing(&flight, params, landmarks);
        let mut waiting = Vec::new();
        for k in 1..40 {
            flight.fly_to(&mut smoother, k);
            // At most the oldest keyframe but one: a relative pose needs the previous one.
            let pose = |smoother: &mut Smoother, now: usize| {
                for (_, back, _, way) in poses.iter().filter(|(at, _, moment, _)| (*at, *moment) == (k, now)) {
                    if *back < (window - 1).min(k) {
                        add_pose(smoother, &flight, k - back, *way == 1);
                    }
                }
            };
            pose(&mut smoother, 0);
            if !observed_first.contains(&k) {
                flight.measure(&mut smoother, k);
            }
            pose(&mut smoother, 1);
            for (index, seen) in scenery.seen[k].iter().enumerate() {
                let delay = late.iter().find(|(at, _)| *at == (k + 7 * index) % 40).map_or(0, |(_, delay)| *delay);
                waiting.push((k + delay, k as u64, *seen));
            }
            waiting.retain(|(due, id, seen)| {
                if *due <= k {
                    match smoother.observe(&mut open(), *id, seen) {
                        Ok(_) | Err(Refusal::NotObservable | Refusal::NoKeyframe { .. }) => {}
                        Err(refusal) => panic!("{id}: {refusal}"),
                    }
                }
                *due > k
            });
            for (_, back) in positions.iter().filter(|(at, back)| *at == k && *back < window.min(k)) {
                let id = k - back;
                let fix = GnssPosition::new(flight.truth[id].position, 1.0, 2.0);
                smoother.add(&mut open(), id as u64, fix).unwrap();
            }
            if observed_first.contains(&k) {
                flight.measure(&mut smoother, k);
            }
            pose(&mut smoother, 2);
            smoother.update().unwrap();
            if poses.iter().any(|(at, _, moment, _)| *at == k && *moment == 3) {
                pose(&mut smoother, 3);
                smoother.update().unwrap();
            }
            // Until landmarks tie keyframes, small corrections are not propagated back.
            if smoother.is_tied() {
                both(&mut smoother)?;
            }
        }
    }
}
