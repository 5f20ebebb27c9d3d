//! A fixed-lag smoother for position, velocity and attitude.
//!
//! It holds the last keyframes, with the measurements at and between them, as a least-squares problem. Measurements of the last
//! seconds can be relinearised, may arrive late, and also correct earlier keyframes.
//!
//! # Window
//!
//! Errors and states are those of the [filter](super::eskf), so every [`Measurement`](super::Measurement) is a [`Factor`](super::Factor) here.
//! Optional states change from one keyframe to the next according to the parameters. The IMU between two keyframes is one factor
//! ([`Preintegration`]). A factor concerns one keyframe, or a keyframe and the one before it; if it concerns nothing but poses, a
//! keyframe and any earlier one of the window. Your own types can implement the trait.
//!
//! # Solution
//!
//! The Gauss–Newton method. The window is a chain and is eliminated in time order. A new keyframe therefore costs the elimination
//! of the last two, regardless of the window's length, and the covariance of the newest is its own pivot; see `elimination.rs`. A
//! late measurement restarts the elimination at its keyframe. A factor on two keyframes that are not neighbours couples their poses as a
//! landmark does, see below and `pairs.rs`. A keyframe is relinearised when its correction exceeds
//! [`SmootherParams::relinearise_rotation`]. The oldest keyframe is marginalised to a prior on the next one, whose linearisation
//! point is then fixed. An unobservable direction, such as heading without a compass, thus stays unobservable.
//!
//! # Landmarks
//!
//! [`FixedLagSmoother::set_camera`] sets a camera, and [`FixedLagSmoother::observe`] adds points that it observes. Each landmark
//! is eliminated when it is added, which couples all keyframes that observed it. These couplings are carried along the
//! elimination of the chain; see `coupling.rs` and `landmark.rs`. A landmark that is still tracked when its first keyframe is
//! marginalised becomes an unknown of its own and keeps its linearisation point; see `coupling/points.rs`. The information of a lost
//! one remains as a prior on the other keyframes, which keep their linearisation points.
//!
//! # Robustness
//!
//! No possibly singular matrix is inverted, and no system is rejected as indeterminate: an unknown state has a correspondingly
//! large variance.

#[cfg(feature = "autodiff")]
mod automatic;
mod coupling;
mod elimination;
mod estimates;
mod filter;
mod fusion;
mod judging;
mod kernel;
mod keyframe;
mod landmark;
mod landmarks;
mod link;
mod matrix;
mod pair;
mod pairs;
mod params;
mod preintegration;
mod scratch;
mod sight;
mod solution;
#[cfg(test)]
mod tests;

#[cfg(feature = "autodiff")]
pub use automatic::{Automatic, Differentiable, Expectation};
pub use filter::FixedLagSmoother;
pub use kernel::Kernel;
pub use params::{LandmarkParams, SmootherParams};
pub use preintegration::Preintegration;
pub use sight::{Observation, Sighted};
pub use solution::Updated;
