//! Factors that outside providers add directly to the window.

use crate::navigation::factor::Factor;
use crate::navigation::state::{NAVIGATED, Navigated, Optional, States};
use core::fmt::Debug;

/// States of the smoother: those of navigation and the scale of relative poses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Smoothed;

impl States for Smoothed {
    const OPTIONAL: &'static [Optional] = &[Optional::RelativeScale];
}

/// The number of errors of [`Smoothed`].
pub const SMOOTHED: usize = Smoothed::DIMENSION;

/// A factor that an outside provider adds directly: the window is shared. Every type that implements [`Factor`] for any
/// states, such as [`NavigationFactor`](crate::navigation::NavigationFactor), is one.
///
/// Factors that are plain data, and those on two keyframes, are [`GivenFactor`](super::GivenFactor)s.
///
/// Its world is that of [`FlightNavigator::frame`](super::FlightNavigator::frame). The filter, which decides in either
/// strategy, accepts only factors on one keyframe, of at most nine rows: one that names a previous keyframe is refused as
/// [`NoKeyframe`](crate::navigation::Refusal::NoKeyframe), one with more rows as
/// [`NotObservable`](crate::navigation::Refusal::NotObservable).
pub trait ProvidedFactor: Clone + Debug + Factor<Smoothed, SMOOTHED> + Factor<Navigated, NAVIGATED> {}
impl<F: Clone + Debug + Factor<Smoothed, SMOOTHED> + Factor<Navigated, NAVIGATED>> ProvidedFactor for F {}
