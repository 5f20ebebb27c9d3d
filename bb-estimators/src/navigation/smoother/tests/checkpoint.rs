//! An elimination that resumes after the keyframes before all current tracks, against one of the whole window.

use proptest::prelude::*;

use super::flight::{Flight, N, Smoother, linear, open, sensors};
use super::scenery::{Scenery, camera, exact};
use crate::navigation::{GnssPosition, LandmarkParams, Refusal, SmootherParams};

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
        prop_assert!((here - all).abs() <= 1e-7 * (1.0 + all.abs()), "{here} {all}");
    }
    for (here, all) in covariances.iter().zip(&all_covariances) {
        for i in 0..N {
            prop_assert!((here[i][i] / all[i][i] - 1.0).abs() < 1e-6, "{i}: {} {}", here[i][i], all[i][i]);
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Whatever changes in the window: observations and positions that come late, at any keyframe, tracks that begin and
    /// end, and relinearised keyframes and landmarks.
    #[test]
    fn it_is_the_elimination_of_all(
        seed in any::<u64>(),
        window in 4_usize..24,
        longest in 2_usize..9,
        late in prop::collection::vec((0_usize..40, 0_usize..12), 0..40),
        positions in prop::collection::vec((0_usize..40, 0_usize..24), 0..6),
        is_linear in any::<bool>(),
    ) {
        let flight = Flight::new(seed, 40, 1.0);
        let scenery = Scenery::new(&flight, seed, 6, longest, Some(5.0));
        let params = SmootherParams { sensors: sensors(), window, ..SmootherParams::default() };
        let params = if is_linear { linear(window) } else { params };
        let mut smoother = Smoother::new(params).unwrap();
        let landmarks = if is_linear { LandmarkParams { relinearise: 1.0, ..exact() } } else { exact() };
        smoother.set_camera(camera(), landmarks).unwrap();
        smoother.start(0, &flight.start).unwrap();
        let mut waiting = Vec::new();
        let mut least = usize::MAX;
        for k in 1..40 {
            flight.fly_to(&mut smoother, k);
            flight.measure(&mut smoother, k);
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
            least = least.min(smoother.update().unwrap().eliminated);
            // Until landmarks tie keyframes, small corrections are not propagated back.
            if smoother.is_tied() {
                both(&mut smoother)?;
            }
        }
        // It is not only ever compared with itself.
        prop_assert!(!is_linear || !late.is_empty() || window < 2 * longest + 4 || least <= longest + 2, "{least}");
    }
}

/// A long window costs no more than a short one if only its end changes.
#[test]
fn an_update_eliminates_no_more_than_the_current_tracks() {
    let longest = 6;
    for window in [12, 24, 48] {
        let flight = Flight::new(3, 100, 1.0);
        let scenery = Scenery::new(&flight, 3, 8, longest, Some(5.0));
        let mut smoother = Smoother::new(linear(window)).unwrap();
        smoother.set_camera(camera(), LandmarkParams { relinearise: 1.0, ..exact() }).unwrap();
        smoother.start(0, &flight.start).unwrap();
        for k in 1..100 {
            flight.fly_to(&mut smoother, k);
            flight.measure(&mut smoother, k);
            scenery.observe(&mut smoother, k);
            let eliminated = smoother.update().unwrap().eliminated;
            // The newest keyframe, those of its tracks, and one before.
            assert!(eliminated <= longest + 2, "window {window}, keyframe {k}: {eliminated}");
        }
    }
}
