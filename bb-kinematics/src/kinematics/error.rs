//! Errors of the kinematics.

use std::fmt;

/// Reason for which a robot has no kinematics, or a state does not fit it.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum KinematicsError {
    /// No path of joints leads from the root to that link.
    Unreachable {
        /// The link.
        link: &'static str,
    },
    /// Two joints carry that link, or a joint carries the root.
    TwoParents {
        /// The link.
        link: &'static str,
    },
    /// The axis of that moving joint is absent, zero or not finite.
    NoAxis {
        /// The joint.
        joint: &'static str,
    },
    /// The lower limit of that joint is above the upper one, or a limit is NaN.
    Limit {
        /// The joint.
        joint: &'static str,
    },
    /// The joint mimics a joint that it cannot follow: itself, directly or through others, or one that has not exactly one degree of
    /// freedom.
    Mimic {
        /// The joint.
        joint: &'static str,
    },
    /// There is no link of that name or number.
    NoLink(String),
    /// A number is NaN or infinite.
    NotFinite {
        /// The argument that contains it.
        what: &'static str,
    },
    /// No position was found that reaches a target; it may still be within reach.
    NotConverged {
        /// Position error of the best attempt, m.
        position_error: f64,
        /// Rotation error of the best attempt, rad; 0 if only a position was asked for.
        rotation_error: f64,
        /// The number of iterations, restarts included.
        iterations: u32,
    },
    /// The length of a slice differs from the robot's number of coordinates.
    Coordinates {
        /// Positions, velocities or accelerations.
        what: &'static str,
        /// Number of the robot.
        expected: usize,
        /// Number that was given.
        given: usize,
    },
}

impl fmt::Display for KinematicsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unreachable { link } => write!(f, "no joints lead from the root to the link `{link}`"),
            Self::TwoParents { link } => {
                write!(f, "the link `{link}` is carried by more than one joint, or is the root")
            }
            Self::NoAxis { joint } => write!(f, "the joint `{joint}` moves, and has no axis of finite length"),
            Self::Limit { joint } => {
                write!(f, "the lower limit of the joint `{joint}` is above the upper one, or a limit is NaN")
            }
            Self::Mimic { joint } => {
                write!(f, "the joint `{joint}` mimics itself, or a joint without exactly one degree of freedom")
            }
            Self::NoLink(name) => write!(f, "there is no link `{name}`"),
            Self::NotFinite { what } => write!(f, "the {what} has a number that is not finite"),
            Self::NotConverged { position_error, rotation_error, iterations } => write!(
                f,
                "no position found that reaches the target: {position_error:.3e} m and {rotation_error:.3e} rad off after \
                 {iterations} iterations"
            ),
            Self::Coordinates { what, expected, given } => write!(f, "{given} {what} for a robot of {expected}"),
        }
    }
}

impl std::error::Error for KinematicsError {}
