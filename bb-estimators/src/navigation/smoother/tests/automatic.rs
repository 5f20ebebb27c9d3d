//! Automatic differentiation against hand-written Jacobians, and in a window.

use bb_tests::laws;
use nalgebra::{Matrix1, Matrix3, SMatrix, UnitQuaternion, Vector3};
use num_dual::DualNum;
use proptest::prelude::*;

use super::super::automatic::{Automatic, Differentiable, Expectation};
use super::flight::{Drone, N, open};
use crate::navigation::factor::Rows;
use crate::navigation::factor::{Factor, NavigationFactor};
use crate::navigation::{
    Estimate, FixedLagSmoother, GnssPosition, ImuMean, NAVIGATION, Navigation, Optional, Refusal, SmootherParams,
    Start, offset,
};

/// A position fix of an antenna whose lever arm is estimated.
#[derive(Clone, Copy, Debug)]
struct Fix {
    position: Vector3<f64>,
    lever_arm: Vector3<f64>,
}

impl<const M: usize> Expectation<3, M> for Fix {
    fn expected<T: DualNum<Primitive = f64> + Copy>(
        &self,
        _: Option<&Differentiable<T, M>>,
        at: &Differentiable<T, M>,
    ) -> [T; 3] {
        let first = offset::<Drone>(Optional::GnssLeverArm).unwrap();
        let arm: [T; 3] = core::array::from_fn(|i| at.optional[first + i] + self.lever_arm[i]);
        core::array::from_fn(|i| {
            let [x, y, z] = at.world_from_body[i];
            at.position[i] + x * arm[0] + y * arm[1] + z * arm[2]
        })
    }

    fn measured(&self) -> [f64; 3] {
        self.position.into()
    }

    fn noise(&self) -> SMatrix<f64, 3, 3> {
        Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 4.0))
    }
}

/// Displacement of the body, in its axes at the previous keyframe.
#[derive(Clone, Copy, Debug)]
struct Way([f64; 3]);

impl<const M: usize> Expectation<3, M> for Way {
    fn previous(&self) -> Option<u64> {
        Some(0)
    }

    fn expected<T: DualNum<Primitive = f64> + Copy>(
        &self,
        previous: Option<&Differentiable<T, M>>,
        at: &Differentiable<T, M>,
    ) -> [T; 3] {
        let Some(from) = previous else { return [T::from(0.0); 3] };
        let moved: [T; 3] = core::array::from_fn(|i| at.position[i] - from.position[i]);
        core::array::from_fn(|j| {
            let [x, y, z] = core::array::from_fn(|i| from.world_from_body[i][j] * moved[i]);
            x + y + z
        })
    }

    fn measured(&self) -> [f64; 3] {
        self.0
    }

    fn noise(&self) -> SMatrix<f64, 3, 3> {
        Matrix3::identity() * 0.01
    }
}

fn vector(limit: f64) -> impl Strategy<Value = Vector3<f64>> {
    let number = move || -limit..limit;
    (number(), number(), number()).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

fn estimate() -> impl Strategy<Value = Estimate<N>> {
    (vector(100.0), vector(20.0), vector(3.0), vector(0.3)).prop_map(|(position, velocity, turn, arm)| {
        let mut estimate = Estimate::<N> { position, velocity, ..Estimate::unknown() };
        estimate.world_from_body = UnitQuaternion::from_scaled_axis(turn);
        estimate.optional.fixed_rows_mut::<3>(NAVIGATION + 1).copy_from(&arm);
        estimate
    })
}

fn rows(factor: &impl Factor<Drone, N>, previous: Option<&Estimate<N>>, at: &Estimate<N>) -> Rows<N> {
    let mut rows = Rows::new();
    factor.linearise(previous, at, &mut rows).unwrap();
    rows
}

laws! {
    #[test]
    fn it_is_the_jacobian_by_hand(at in estimate(), position in vector(100.0), lever_arm in vector(2.0)) {
        let hand = NavigationFactor::from(GnssPosition { lever_arm, ..GnssPosition::new(position, 1.0, 2.0) });
        let (hand, automatic) = (rows(&hand, None, &at), rows(&Automatic(Fix { position, lever_arm }), None, &at));
        prop_assert_eq!(hand.count, automatic.count);
        for row in 0..3 {
            prop_assert!((hand.residual[row] - automatic.residual[row]).abs() < 1e-12 * (1.0 + hand.residual[row].abs()));
            for column in 0..N {
                let (hand, automatic) = (hand.at[row][column], automatic.at[row][column]);
                prop_assert!((hand - automatic).abs() < 1e-12, "{row}, {column}: {hand}, {automatic}");
            }
        }
    }

    #[test]
    fn by_both_keyframes_it_is_the_numeric_one(from in estimate(), at in estimate()) {
        let way = Automatic(Way([1.0, 2.0, 3.0]));
        let rows = |from: &Estimate<N>, at: &Estimate<N>| rows(&way, Some(from), at);
        let here = rows(&from, &at);
        const STEP: f64 = 1e-5;
        for column in 0..N {
            let step = |sign: f64| nalgebra::SVector::<f64, N>::from_fn(|i, _| if i == column { sign * STEP } else { 0.0 });
            for row in 0..3 {
                let residual = |of_previous: bool, sign: f64| {
                    let [from, at] = if of_previous {
                        [from.corrected::<Drone>(&step(sign)), at]
                    } else {
                        [from, at.corrected::<Drone>(&step(sign))]
                    };
                    rows(&from, &at).residual[row]
                };
                for (of_previous, derivative) in [(true, here.previous[row][column]), (false, here.at[row][column])] {
                    let numeric = -(residual(of_previous, 1.0) - residual(of_previous, -1.0)) / (2.0 * STEP);
                    prop_assert!((numeric - derivative).abs() < 1e-4 * (1.0 + derivative.abs()), "{row}, {column}");
                }
            }
        }
    }
}

/// The distance to a beacon.
#[derive(Clone, Copy, Debug)]
struct Range {
    beacon: Vector3<f64>,
    distance_m: f64,
}

impl<const M: usize> Expectation<1, M> for Range {
    fn expected<T: DualNum<Primitive = f64> + Copy>(
        &self,
        _: Option<&Differentiable<T, M>>,
        at: &Differentiable<T, M>,
    ) -> [T; 1] {
        let [x, y, z] = at.in_body(&self.beacon);
        [(x * x + y * y + z * z).sqrt()]
    }

    fn measured(&self) -> [f64; 1] {
        [self.distance_m]
    }

    fn noise(&self) -> SMatrix<f64, 1, 1> {
        Matrix1::new(1e-4)
    }
}

#[test]
fn ranges_tell_where_it_is() {
    let mut smoother =
        FixedLagSmoother::<Navigation, NAVIGATION, Automatic<Range, 1>>::new(SmootherParams::default()).unwrap();
    let (rest, level) = (Vector3::zeros(), UnitQuaternion::identity());
    smoother.start(0, &Start::at(0, (rest, 5.0), (rest, 0.1), (level, 0.05))).unwrap();
    let truth = Vector3::new(3.0, -2.0, 1.0);
    let beacons = [(20.0, 0.0, 5.0), (-10.0, 15.0, 0.0), (0.0, -20.0, 10.0), (5.0, 5.0, -15.0)];
    for k in 1..=5 {
        for i in 1..=10 {
            let time_ns = (k * 10 + i - 10) * 10_000_000;
            let specific_force = Vector3::new(0.0, 0.0, 9.80665);
            smoother.propagate(&ImuMean { time_ns, angular_velocity: rest, specific_force }).unwrap();
        }
        smoother.add_keyframe(k as u64).unwrap();
        for (x, y, z) in beacons {
            let beacon = Vector3::new(x, y, z);
            let range = Range { beacon, distance_m: (truth - beacon).norm() };
            smoother.add(&mut open(), k as u64, Automatic(range)).unwrap();
        }
        smoother.update().unwrap();
    }
    let found = smoother.estimate().unwrap().position;
    assert!((found - truth).norm() < 0.01, "{found}");
    // At the beacon itself, the distance has no derivative.
    let at = Estimate::<NAVIGATION>::unknown();
    let beside = Automatic(Range { beacon: at.position, distance_m: 1.0 });
    let refused = Factor::<Navigation, NAVIGATION>::linearise(&beside, None, &at, &mut Rows::new());
    assert_eq!(refused, Err(Refusal::NonFinite));
}
