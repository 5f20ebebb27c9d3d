//! Preintegration, factors and elimination, each against an independent computation, and the invariants of the smoother.

#[cfg(feature = "autodiff")]
mod automatic;
// Dynamically sized matrices need nalgebra's allocating types.
#[cfg(feature = "std")]
mod batch;
mod cases;
#[cfg(feature = "std")]
mod dense;
mod factors;
mod flight;
mod kernels;
#[cfg(feature = "std")]
mod landmarks;
mod laws;
mod newest;
mod preintegration;
mod scenery;
mod sights;
mod tracks;
mod unfit_sights;
#[cfg(feature = "std")]
mod whole_flights;
