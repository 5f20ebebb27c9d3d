//! Information on two poses.

use super::{Coupling, POSE};

impl<const N: usize> Coupling<N> {
    /// Adds rows on two poses to Λ and λ: `sign · rowsᵀ rows` and `sign · rowsᵀ residual`. The columns are those of the earlier pose,
    /// then those of the later.
    pub(in crate::navigation::smoother) fn add_pair(
        &mut self,
        (from, to): (usize, usize),
        (rows, residual): (&[[f64; 2 * POSE]], &[f64]),
        sign: f64,
    ) {
        self.touch(from, to + 1);
        let column = |i: usize| if i < POSE { POSE * from + i } else { POSE * to + i - POSE };
        for (row, residual) in rows.iter().zip(residual) {
            for (i, value) in row.iter().enumerate() {
                let (at, factor) = (column(i), sign * value);
                let add = |target: &mut [f64]| {
                    for (j, value) in row.iter().enumerate().skip(i) {
                        target[column(j) - at] += factor * value;
                    }
                };
                self.vector[at] += factor * residual;
                add(&mut self.matrix[at * self.stride + at..(at + 1) * self.stride]);
            }
        }
    }
}
