//! The errors that a filter estimates, and their indices in the error vector.

use core::fmt::Debug;

/// Error of the position in the world, m.
pub const POSITION: usize = 0;
/// Error of the velocity in the world, m/s.
pub const VELOCITY: usize = 3;
/// Rotation error in the world, rad: `R_true = exp(θ) R`.
pub const ROTATION: usize = 6;
/// Error of the accelerometer's bias, body axes, m/s².
pub const ACCELEROMETER_BIAS: usize = 9;
/// Error of the gyroscope's bias, body axes, rad/s.
pub const GYROSCOPE_BIAS: usize = 12;
/// The number of states in every filter; optional states follow.
pub const NAVIGATION: usize = 15;

/// The number of errors of a filter that estimates every optional state.
pub(in crate::navigation) const MOST_ERRORS: usize = NAVIGATION + dimension(&Optional::ALL);

/// An optional state, or a group of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Optional {
    /// Pose of the last keyframe, for relative poses: position error, then rotation error, both in the world; see
    /// [`RelativePose`](crate::navigation::RelativePose). It is a stochastic clone: S. I. Roumeliotis,
    /// J. W. Burdick, "Stochastic cloning", ICRA 2002.
    Keyframe,
    /// Scale of relative translations, less 1: `measured = (1 + s) true`.
    RelativeScale,
    /// Position of the GNSS antenna in the body, m.
    GnssLeverArm,
    /// Time before its stamp at which a GNSS measurement was taken, s.
    GnssDelay,
    /// Scale of the wheel speed, less 1: `measured = (1 + s) true`.
    WheelScale,
    /// Mounting of the IMU in the vehicle beyond the declared one: yaw, then pitch, of the vehicle's axes from the declared
    /// ones, rad.
    WheelMounting,
    /// Magnetic field of the body itself, in the body, T.
    HardIron,
    /// Bias of the barometric height: its reading minus the height in the world, m.
    BarometerBias,
}

impl Optional {
    const ALL: [Self; 8] = [
        Self::Keyframe,
        Self::RelativeScale,
        Self::GnssLeverArm,
        Self::GnssDelay,
        Self::WheelScale,
        Self::WheelMounting,
        Self::HardIron,
        Self::BarometerBias,
    ];

    /// The dimension of the state.
    pub const fn dimension(self) -> usize {
        match self {
            Self::Keyframe => 6,
            Self::GnssLeverArm | Self::HardIron => 3,
            Self::WheelMounting => 2,
            Self::RelativeScale | Self::GnssDelay | Self::WheelScale | Self::BarometerBias => 1,
        }
    }

    const fn code(self) -> u8 {
        self as u8
    }
}

/// The optional states of a filter, as a type. The compiler thus knows the size of every matrix and omits states that a filter
/// lacks.
///
/// ```
/// use bb_estimators::navigation::{EskfFilter, Optional, States};
///
/// /// A rover whose wheels wear, with an antenna on a mast.
/// #[derive(Clone, Copy, Debug, PartialEq)]
/// struct Rover;
///
/// impl States for Rover {
///     const OPTIONAL: &'static [Optional] = &[Optional::WheelScale, Optional::GnssLeverArm];
/// }
///
/// type RoverFilter = EskfFilter<Rover, { Rover::DIMENSION }>;
/// assert_eq!(Rover::DIMENSION, 19);
/// ```
pub trait States: Copy + Debug + PartialEq {
    /// The optional states in the order of the error vector, each at most once.
    const OPTIONAL: &'static [Optional];

    /// The number of estimated errors: the second parameter of [`EskfFilter`](crate::navigation::EskfFilter).
    const DIMENSION: usize = NAVIGATION + dimension(Self::OPTIONAL);
}

/// Navigation states only.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Navigation;

impl States for Navigation {
    const OPTIONAL: &'static [Optional] = &[];
}

/// Navigation states, a keyframe for relative poses, and their scale.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Navigated;

impl States for Navigated {
    const OPTIONAL: &'static [Optional] = &[Optional::Keyframe, Optional::RelativeScale];
}

/// The number of errors of [`Navigated`].
pub const NAVIGATED: usize = Navigated::DIMENSION;

/// Navigation states, the delay of fixes, and the bias of a barometer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Aided;

impl States for Aided {
    const OPTIONAL: &'static [Optional] = &[Optional::GnssDelay, Optional::BarometerBias];
}

/// The states of [`Aided`], and the scale and mounting of wheels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Vehicle;

impl States for Vehicle {
    const OPTIONAL: &'static [Optional] =
        &[Optional::GnssDelay, Optional::BarometerBias, Optional::WheelScale, Optional::WheelMounting];
}

/// The states of [`Vehicle`] and of [`Navigated`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Complete;

impl States for Complete {
    const OPTIONAL: &'static [Optional] = &[
        Optional::GnssDelay,
        Optional::BarometerBias,
        Optional::WheelScale,
        Optional::WheelMounting,
        Optional::Keyframe,
        Optional::RelativeScale,
    ];
}

/// The index of an optional state's first error, if the filter estimates the state.
pub const fn offset<S: States>(state: Optional) -> Option<usize> {
    let mut index = NAVIGATION;
    let mut i = 0;
    while i < S::OPTIONAL.len() {
        if S::OPTIONAL[i].code() == state.code() {
            return Some(index);
        }
        index += S::OPTIONAL[i].dimension();
        i += 1;
    }
    None
}

/// The indices of a pose's errors: the rotation, and the positions and velocities that turn with it.
pub(in crate::navigation) struct PoseErrors {
    pub(in crate::navigation) rotation: usize,
    pub(in crate::navigation) turned: [Option<usize>; 2],
}

/// The errors of the poses of the body and of the keyframe.
pub(in crate::navigation) fn pose_errors<S: States>() -> [Option<PoseErrors>; 2] {
    let body = PoseErrors { rotation: ROTATION, turned: [Some(POSITION), Some(VELOCITY)] };
    let keyframe = offset::<S>(Optional::Keyframe)
        .map(|first| PoseErrors { rotation: first + 3, turned: [Some(first), None] });
    [Some(body), keyframe]
}

const fn dimension(states: &[Optional]) -> usize {
    let mut sum = 0;
    let mut i = 0;
    while i < states.len() {
        sum += states[i].dimension();
        i += 1;
    }
    sum
}

/// Returns whether no state is listed twice.
pub(in crate::navigation) const fn distinct(states: &[Optional]) -> bool {
    let mut i = 0;
    while i < states.len() {
        let mut j = 0;
        while j < i {
            if states[i].code() == states[j].code() {
                return false;
            }
            j += 1;
        }
        i += 1;
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offsets_follow_the_order_of_the_list() {
        #[derive(Clone, Copy, Debug, PartialEq)]
        struct Some3;
        impl States for Some3 {
            const OPTIONAL: &'static [Optional] =
                &[Optional::GnssLeverArm, Optional::RelativeScale, Optional::Keyframe];
        }
        assert_eq!(Some3::DIMENSION, 25);
        assert_eq!(offset::<Some3>(Optional::GnssLeverArm), Some(15));
        assert_eq!(offset::<Some3>(Optional::RelativeScale), Some(18));
        assert_eq!(offset::<Some3>(Optional::Keyframe), Some(19));
        assert_eq!(offset::<Some3>(Optional::WheelScale), None);
        assert_eq!(offset::<Navigation>(Optional::Keyframe), None);
        assert!(distinct(Some3::OPTIONAL));
        assert!(!distinct(&[Optional::Keyframe, Optional::Keyframe]));
    }
}
