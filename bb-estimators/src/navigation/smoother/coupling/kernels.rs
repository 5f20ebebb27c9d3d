//! Sums of multiples of rows.

/// `target += factor · row`.
#[inline]
pub(super) fn add_one(target: &mut [f64], factor: f64, row: &[f64]) {
    for (target, value) in target.iter_mut().zip(row) {
        *target += factor * value;
    }
}

/// `target += Σ factorᵢ rowᵢ`, with few rows, each as long as the target.
#[inline]
pub(super) fn add_all<const R: usize>(target: &mut [f64], factors: &[f64; R], rows: &[&[f64]; R]) {
    let len = target.len();
    let rows: [&[f64]; R] = core::array::from_fn(|i| &rows[i][..len]);
    for j in 0..len {
        target[j] += (1..R).fold(factors[0] * rows[0][j], |sum, i| sum + factors[i] * rows[i][j]);
    }
}

/// `target -= Σ rowᵢ xᵢ`, with the rows `stride` apart.
pub(super) fn subtract_at<const N: usize>(target: &mut [f64], rows: &[f64], stride: usize, x: &[f64; N]) {
    let negative: [f64; N] = core::array::from_fn(|i| -x[i]);
    combine(target, &negative, rows, stride);
}

/// `target -= Σ rowᵢ[column] rowᵢ[column..]`, with the rows `stride` apart.
pub(super) fn subtract_column<const N: usize>(target: &mut [f64], rows: &[f64], stride: usize, column: usize) {
    let factors: [f64; N] = core::array::from_fn(|i| -rows[i * stride + column]);
    combine(target, &factors, &rows[column..], stride);
}

/// `target += Σ factorᵢ rowᵢ`, with the rows `stride` apart. Eight rows at a time, since each pass loads and stores the target.
#[inline]
pub(super) fn combine(target: &mut [f64], factors: &[f64], rows: &[f64], stride: usize) {
    let mut chunks = factors.chunks_exact(8);
    let mut rest = rows;
    for factors in &mut chunks {
        eight::<true>(target, factors, core::array::from_fn(|i| &rest[i * stride..]));
        rest = rest.get(8 * stride..).unwrap_or_default();
    }
    let mut chunks = chunks.remainder().chunks_exact(4);
    for factors in &mut chunks {
        let &[a, b, c, d] = factors else { return };
        add_all(target, &[a, b, c, d], &core::array::from_fn(|i| &rest[i * stride..]));
        rest = rest.get(4 * stride..).unwrap_or_default();
    }
    for (k, factor) in chunks.remainder().iter().enumerate() {
        add_one(target, *factor, &rest[k * stride..]);
    }
}

/// `target = Σ factorᵢ rowᵢ`, with the rows `stride` apart.
pub(super) fn set(target: &mut [f64], factors: &[f64], rows: &[f64], stride: usize) {
    let Some((first, others)) = factors.split_at_checked(8) else {
        target.fill(0.0);
        return combine(target, factors, rows, stride);
    };
    eight::<false>(target, first, core::array::from_fn(|i| &rows[i * stride..]));
    combine(target, others, rows.get(8 * stride..).unwrap_or_default(), stride);
}

// Not unrolled further: with four columns at a time it takes 8 % more instructions.
#[inline]
fn eight<const ADDS: bool>(target: &mut [f64], f: &[f64], rows: [&[f64]; 8]) {
    let len = target.len();
    let [a, b, c, d, e, g, h, l] = rows.map(|row| &row[..len]);
    let &[fa, fb, fc, fd, fe, fg, fh, fl] = f else { return };
    for j in 0..len {
        let first = (fa * a[j] + fb * b[j]) + (fc * c[j] + fd * d[j]);
        let second = (fe * e[j] + fg * g[j]) + (fh * h[j] + fl * l[j]);
        target[j] = if ADDS { target[j] + (first + second) } else { first + second };
    }
}
