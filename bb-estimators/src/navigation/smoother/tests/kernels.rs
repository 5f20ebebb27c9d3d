//! Robust kernels: the weight is half the derivative of the cost, divided by the distance.

use bb_tests::laws;
use proptest::prelude::*;

use super::super::kernel::Kernel;

/// The cost of each kernel at a distance `x`.
fn cost(kernel: Kernel, x: f64) -> f64 {
    match kernel {
        Kernel::Squares => 0.5 * x * x,
        Kernel::Huber(k) if x > k => k * (x - 0.5 * k),
        Kernel::Huber(_) => 0.5 * x * x,
        Kernel::Cauchy(c) => 0.5 * c * c * (1.0 + (x / c).powi(2)).ln(),
        Kernel::GemanMcClure(c) => 0.5 * x * x / (1.0 + (x / c).powi(2)),
    }
}

laws! {
    #[test]
    fn weights_are_those_of_the_cost(x in 0.01..50.0_f64, parameter in 0.5..5.0_f64) {
        let all = [Kernel::Huber(parameter), Kernel::Cauchy(parameter), Kernel::GemanMcClure(parameter)];
        for kernel in all.into_iter().chain([Kernel::Squares]) {
            let step = 1e-6;
            let slope: f64 = (cost(kernel, x + step) - cost(kernel, x - step)) / (2.0 * step);
            let weight = kernel.weight(x * x);
            prop_assert!((weight - slope / x).abs() < 1e-6, "{kernel:?} at {x}: {weight}, not {}", slope / x);
            prop_assert!(weight <= 1.0 && weight > 0.0);
        }
    }
}

#[test]
fn what_fits_weighs_one_and_no_parameter_is_no_kernel() {
    for kernel in [Kernel::Huber(1.0), Kernel::Cauchy(1.0), Kernel::GemanMcClure(1.0), Kernel::Squares] {
        assert_eq!(kernel.weight(0.0), 1.0);
    }
    assert_eq!(Kernel::Huber(0.0).weight(100.0), 1.0);
    assert_eq!(Kernel::Cauchy(-1.0).weight(100.0), 1.0);
}
