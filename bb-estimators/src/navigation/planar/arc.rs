//! The integral of a turn, on which a body with a constant velocity drives an arc.

use nalgebra::Matrix2;

use crate::navigation::math::{cos, sin};

/// Below this angle, rad, the integral over an arc is computed from a series.
const SERIES: f64 = 1e-2;

/// `V(φ) = ∫₀¹ R(s φ) ds` and its derivative with respect to φ.
pub(super) fn arc(turn: f64) -> (Matrix2<f64>, Matrix2<f64>) {
    let s = turn * turn;
    let [along, across, along_turn, across_turn] = if turn.abs() < SERIES {
        [
            1.0 - s / 6.0 * (1.0 - s / 20.0),
            turn / 2.0 * (1.0 - s / 12.0 * (1.0 - s / 30.0)),
            -turn / 3.0 * (1.0 - s / 10.0),
            0.5 - s / 8.0 * (1.0 - s / 18.0),
        ]
    } else {
        let (sin, cos) = (sin(turn), cos(turn));
        let (along, across) = (sin / turn, (1.0 - cos) / turn);
        [along, across, (cos - along) / turn, (sin - across) / turn]
    };
    let matrix = |along: f64, across: f64| Matrix2::new(along, -across, across, along);
    (matrix(along, across), matrix(along_turn, across_turn))
}
