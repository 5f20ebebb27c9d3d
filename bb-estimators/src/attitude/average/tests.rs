//! Laws and known answers of averages.

use bb_tests::laws;
use nalgebra::{Quaternion, Unit, UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::{AverageError, average, average_pair};

fn orientation() -> impl Strategy<Value = UnitQuaternion<f64>> {
    (-1.0..1.0, -1.0..1.0, -1.0..1.0, -1.0..1.0_f64)
        .prop_map(|(w, x, y, z)| Quaternion::new(w, x, y, z))
        .prop_filter("a quaternion with a direction", |q| q.norm() > 0.1)
        .prop_map(Unit::new_normalize)
}

fn about_x(angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::x_axis(), angle)
}

fn negated(q: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    Unit::new_unchecked(-q.into_inner())
}

/// The paper's equation for two quaternions, as printed.
fn closed_form(q1: &UnitQuaternion<f64>, w1: f64, q2: &UnitQuaternion<f64>, w2: f64) -> UnitQuaternion<f64> {
    let product = q1.coords.dot(&q2.coords);
    let z = ((w1 - w2).powi(2) + 4.0 * w1 * w2 * product * product).sqrt();
    let first = (w1 * (w1 - w2 + z) / (z * (w1 + w2 + z))).max(0.0).sqrt();
    let second = (w2 * (w2 - w1 + z) / (z * (w1 + w2 + z))).max(0.0).sqrt();
    Unit::new_normalize(q1.into_inner() * first + q2.into_inner() * (second * product.signum()))
}

laws! {
    #[test]
    fn agrees_with_the_papers_closed_form(
        q1 in orientation(), q2 in orientation(), w1 in 0.01..10.0_f64, w2 in 0.01..10.0,
    ) {
        prop_assume!(q1.angle_to(&q2) < 3.1 || w1.max(w2) - w1.min(w2) > 0.01);
        let pair = average_pair(&q1, w1, &q2, w2).unwrap();
        prop_assert!(pair.angle_to(&closed_form(&q1, w1, &q2, w2)) < 1e-6);
        let slice = average(&[(q1, w1), (q2, w2)]).unwrap();
        prop_assert!(pair.angle_to(&slice) < 1e-9);
        prop_assert!((pair.norm() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn is_symmetric(q1 in orientation(), q2 in orientation(), w1 in 0.01..10.0, w2 in 0.01..10.0) {
        prop_assume!(q1.angle_to(&q2) < 3.1);
        let average = average_pair(&q1, w1, &q2, w2).unwrap();
        prop_assert!(average.angle_to(&average_pair(&q2, w2, &q1, w1).unwrap()) < 1e-12);
    }

    #[test]
    fn signs_do_not_matter(q1 in orientation(), q2 in orientation(), w1 in 0.01..10.0, w2 in 0.01..10.0) {
        prop_assume!(q1.angle_to(&q2) < 3.1);
        let average = average_pair(&q1, w1, &q2, w2).unwrap();
        for (a, b) in [(q1, negated(&q2)), (negated(&q1), q2), (negated(&q1), negated(&q2))] {
            prop_assert!(average.angle_to(&average_pair(&a, w1, &b, w2).unwrap()) < 1e-12);
        }
    }

    #[test]
    fn turns_with_its_inputs(
        q1 in orientation(), q2 in orientation(), q3 in orientation(), turn in orientation(),
        w1 in 0.01..10.0, w2 in 0.01..10.0, w3 in 0.01..10.0,
    ) {
        let inputs = [(q1, w1), (q2, w2), (q3, w3)];
        let Ok(expected) = average(&inputs) else { return Ok(()) };
        for turned in [inputs.map(|(q, w)| (turn * q, w)), inputs.map(|(q, w)| (q * turn, w))] {
            let Ok(turned) = average(&turned) else { return Ok(()) };
            let near = turned.angle_to(&(turn * expected)).min(turned.angle_to(&(expected * turn)));
            prop_assert!(near < 1e-6);
        }
    }

    #[test]
    fn of_equals_is_the_same(q in orientation(), w1 in 0.01..10.0, w2 in 0.0..10.0) {
        prop_assert!(average_pair(&q, w1, &q, w2).unwrap().angle_to(&q) < 1e-15);
        prop_assert!(average_pair(&q, w1, &negated(&q), w2).unwrap().angle_to(&q) < 1e-15);
        prop_assert!(average(&[(q, w1), (q, w2), (negated(&q), 1.0)]).unwrap().angle_to(&q) < 1e-12);
    }

    #[test]
    fn weight_0_picks_the_other(q1 in orientation(), q2 in orientation(), w in 0.01..10.0) {
        prop_assert!(average_pair(&q1, w, &q2, 0.0).unwrap().angle_to(&q1) < 1e-14);
        prop_assert!(average_pair(&q1, 0.0, &q2, w).unwrap().angle_to(&q2) < 1e-14);
        prop_assert!(average(&[(q1, 0.0), (q2, w)]).unwrap().angle_to(&q2) < 1e-12);
    }

    #[test]
    fn equal_weights_are_slerp_halfway(q1 in orientation(), q2 in orientation(), w in 0.01..10.0) {
        prop_assume!(q1.angle_to(&q2) < 3.1);
        let average = average_pair(&q1, w, &q2, w).unwrap();
        prop_assert!(average.angle_to(&q1.slerp(&q2, 0.5)) < 1e-12);
    }
}

#[test]
fn small_angles_are_weighted_like_numbers() {
    for angle in [1e-15, 1e-12, 1e-9, 1e-6, 1e-3] {
        let average = average_pair(&about_x(0.0), 1.0, &about_x(angle), 3.0).unwrap();
        assert!((2.0 * average.i.atan2(average.w) - 0.75 * angle).abs() < 1e-6 * angle, "{angle}");
    }
}

#[test]
fn large_angles_are_closer_to_the_heavier_than_slerp() {
    let average = average_pair(&about_x(0.0), 1.0, &about_x(2.0), 3.0).unwrap();
    assert!(average.angle() > 1.5 && average.angle() < 2.0);
}

#[test]
fn half_a_turn_apart_the_heavier_one_wins_and_equals_have_no_average() {
    let (q1, q2) = (about_x(0.3), about_x(0.3 + core::f64::consts::PI));
    assert!(average_pair(&q1, 1.0, &q2, 1.1).unwrap().angle_to(&q2) < 1e-12);
    assert_eq!(average_pair(&q1, 2.0, &q2, 2.0), Err(AverageError::Ambiguous));
    assert_eq!(average(&[(q1, 2.0), (q2, 2.0)]), Err(AverageError::Ambiguous));
}

#[test]
fn any_size_of_weights_will_do() {
    let expected = average_pair(&about_x(0.0), 1.0, &about_x(0.5), 2.0).unwrap();
    for scale in [1e-300, 1e300] {
        let pair = average_pair(&about_x(0.0), scale, &about_x(0.5), 2.0 * scale).unwrap();
        let slice = average(&[(about_x(0.0), scale), (about_x(0.5), 2.0 * scale)]).unwrap();
        assert!(pair.angle_to(&expected) < 1e-14 && slice.angle_to(&expected) < 1e-12);
    }
}

#[test]
fn invalid_input_is_an_error() {
    let q = about_x(0.1);
    let nan = Unit::new_unchecked(Quaternion::new(f64::NAN, 0.0, 0.0, 0.0));
    for weight in [-1.0, f64::INFINITY] {
        let error = Err(AverageError::InvalidWeight { index: 1, weight });
        assert_eq!(average_pair(&q, 1.0, &q, weight), error);
        assert_eq!(average(&[(q, 1.0), (q, weight)]), error);
    }
    assert!(average_pair(&q, f64::NAN, &q, 1.0).is_err());
    assert_eq!(average_pair(&q, 0.0, &q, 0.0), Err(AverageError::NoWeight));
    assert_eq!(average::<f64>(&[]), Err(AverageError::NoWeight));
    assert_eq!(average(&[(q, 0.0)]), Err(AverageError::NoWeight));
    assert_eq!(average_pair(&nan, 1.0, &q, 1.0), Err(AverageError::NonFinite { index: 0 }));
    assert_eq!(average(&[(q, 1.0), (nan, 1.0)]), Err(AverageError::NonFinite { index: 1 }));
}

#[test]
fn single_precision_gives_the_same_and_knows_its_own_rounding() {
    let single = |angle: f64| about_x(angle).cast::<f32>();
    let pair = average_pair(&single(0.3), 1.0, &single(1.5), 3.0).unwrap();
    let expected = average_pair(&about_x(0.3), 1.0, &about_x(1.5), 3.0).unwrap();
    assert!(pair.cast::<f64>().angle_to(&expected) < 1e-6);
    assert!(average(&[(single(0.3), 1.0), (single(1.5), 3.0)]).unwrap().angle_to(&pair) < 1e-6);
    for angle in [0.3, 1.0, -2.0] {
        let (q1, q2) = (single(angle), single(angle + core::f64::consts::PI));
        assert_eq!(average_pair(&q1, 2.0, &q2, 2.0), Err(AverageError::Ambiguous));
        assert_eq!(average(&[(q1, 2.0), (q2, 2.0)]), Err(AverageError::Ambiguous));
    }
}
