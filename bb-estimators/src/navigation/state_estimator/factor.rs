//! Factors that outside providers add directly to the window.

use crate::navigation::smoother::Factor;
use crate::navigation::state::{NAVIGATED, Navigated};
use core::fmt::Debug;

#[cfg(feature = "smoother")]
use crate::navigation::state::{Optional, States};

/// States of the smoother: those of navigation and the scale of relative poses.
#[cfg(feature = "smoother")]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Smoothed;

#[cfg(feature = "smoother")]
impl States for Smoothed {
    const OPTIONAL: &'static [Optional] = &[Optional::RelativeScale];
}

/// The number of errors of [`Smoothed`].
#[cfg(feature = "smoother")]
pub const SMOOTHED: usize = Smoothed::DIMENSION;

macro_rules! provided {
    ($($factor:path),*) => {
        /// A factor that an outside provider adds directly: the window is shared. Every type that implements [`Factor`] for any
        /// states, such as [`NavigationFactor`](crate::navigation::NavigationFactor), is one.
        ///
        /// Its world is that of [`StateEstimator::frame`](super::StateEstimator::frame). The filter, which decides in either
        /// strategy, accepts only factors on one keyframe, of at most nine rows: one that names a previous keyframe is refused as
        /// [`NoKeyframe`](crate::navigation::Refusal::NoKeyframe), one with more rows as
        /// [`NotObservable`](crate::navigation::Refusal::NotObservable).
        pub trait ProvidedFactor: Clone + Debug $(+ $factor)* {}
        impl<F: Clone + Debug $(+ $factor)*> ProvidedFactor for F {}
    };
}

#[cfg(feature = "smoother")]
provided!(Factor<Smoothed, SMOOTHED>, Factor<Navigated, NAVIGATED>);
#[cfg(not(feature = "smoother"))]
provided!(Factor<Navigated, NAVIGATED>);
