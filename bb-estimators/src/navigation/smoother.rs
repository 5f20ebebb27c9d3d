//! A fixed-lag smoother for position, velocity and attitude.
//!
//! It holds the last keyframes, and what was measured at and between them, as a problem of least squares: measurements of the
//! last seconds can be linearised again, may arrive late, and correct earlier keyframes too.
//!
//! # Window
//!
//! Errors and states are those of the [filter](super::eskf), so that every [`Measurement`](super::Measurement) is a
//! [`Factor`] here; optional states change from one keyframe to the next as the parameters say. The IMU between two
//! keyframes is one factor ([`Preintegration`]). Factors concern one keyframe, or one and the one before; types of your
//! own implement the trait.
//!
//! # Solution
//!
//! The Gauss–Newton method. The window is a chain, and is eliminated in the order of time, so that a new keyframe costs
//! the elimination of the last two, whatever the window holds, and the covariance of the newest is its own pivot; see
//! `elimination.rs`. What arrives late is eliminated from its keyframe on. A keyframe is linearised again where it is off by
//! more than [`SmootherParams::relinearise_rotation`]. The oldest leaves nothing but what it had said of the next, which stays
//! linearised where it was from then on: a direction that nothing observes, heading without a compass for one, then stays
//! unobserved.
//!
//! # Landmarks
//!
//! [`FixedLagSmoother::set_camera`] gives it a camera, and [`FixedLagSmoother::observe`] points that it sees. Each is eliminated
//! when it is added, which ties all keyframes that saw it; these ties go along the elimination of the chain, see
//! `coupling.rs` and `landmark.rs`. When its first keyframe leaves, what it says of the others stays as a prior on them, and they
//! keep their linearisation points.
//!
//! # Robustness
//!
//! Nothing is inverted that may be singular, and no system is refused as indeterminate: what is not known has a variance that
//! says so.

#[cfg(feature = "autodiff")]
mod automatic;
#[cfg(feature = "smoother")]
mod coupling;
#[cfg(feature = "smoother")]
mod elimination;
#[cfg(feature = "smoother")]
mod estimates;
mod factor;
#[cfg(feature = "smoother")]
mod filter;
#[cfg(feature = "smoother")]
mod fusion;
mod kernel;
#[cfg(feature = "smoother")]
mod keyframe;
#[cfg(feature = "smoother")]
mod landmark;
#[cfg(feature = "smoother")]
mod landmarks;
#[cfg(feature = "smoother")]
mod link;
#[cfg_attr(not(feature = "smoother"), expect(dead_code, reason = "a filter needs none of it but the check"))]
mod matrix;
#[cfg(feature = "smoother")]
mod params;
#[cfg(feature = "smoother")]
mod preintegration;
mod relative;
mod rows;
#[cfg(feature = "smoother")]
mod scratch;
#[cfg(feature = "smoother")]
mod sight;
#[cfg(feature = "smoother")]
mod solution;
#[cfg(all(test, feature = "smoother"))]
mod tests;

#[cfg(feature = "autodiff")]
pub use automatic::{Automatic, Differentiable, Expectation};
pub use factor::{Factor, NavigationFactor};
#[cfg(feature = "smoother")]
pub use filter::FixedLagSmoother;
pub use kernel::Kernel;
#[cfg(feature = "smoother")]
pub use params::{LandmarkParams, SmootherParams};
#[cfg(feature = "smoother")]
pub use preintegration::Preintegration;
pub use rows::{MOST_ROWS, Rows};
#[cfg(feature = "smoother")]
pub use sight::{Observation, Sighted};
#[cfg(feature = "smoother")]
pub use solution::Updated;
