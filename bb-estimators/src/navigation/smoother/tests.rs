//! Preintegration, factors and elimination, each against another way to the same, and the laws of the smoother.

mod preintegration;
