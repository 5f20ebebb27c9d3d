//! Preintegration, factors and elimination, each against another way to the same, and the laws of the smoother.

#[cfg(feature = "autodiff")]
mod automatic;
// Matrices of any size need the allocator's part of nalgebra.
#[cfg(feature = "std")]
mod batch;
mod cases;
mod consistency;
mod factors;
mod flight;
mod kernels;
#[cfg(feature = "std")]
mod landmarks;
mod laws;
mod preintegration;
mod scenery;
mod sights;
