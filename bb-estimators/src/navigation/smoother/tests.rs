//! Preintegration, factors and elimination, each against another way to the same, and the laws of the smoother.

mod batch;
mod cases;
mod consistency;
mod factors;
mod flight;
mod kernels;
mod laws;
mod preintegration;
