//! Entries of a converted recording, in SI.

use bb_core::message::Schema;
use bb_core::payload::GnssFix;
use std::sync::Arc;

/// A measurement, a true state, or a message that another program wrote, with its time.
#[derive(Clone, Debug)]
pub(super) struct Entry {
    /// Nanoseconds since 1970, or since the start of the recording's own clock.
    pub(super) time_ns: i64,
    pub(super) what: What,
}

#[derive(Clone, Debug)]
pub(super) enum What {
    /// Angular velocity, rad/s, and specific force, m/s².
    Imu {
        angular_velocity: [f64; 3],
        specific_force: [f64; 3],
    },
    /// Angular velocity, rad/s, from a file without the specific force.
    AngularVelocity([f64; 3]),
    /// Specific force, m/s², from a file without the angular velocity.
    SpecificForce([f64; 3]),
    /// Magnetic field, T.
    MagneticField([f64; 3]),
    /// True orientation, w, x, y, z, and position, m; NaN if unknown.
    Truth {
        orientation: [f64; 4],
        position: [f64; 3],
    },
    /// `true` while the body moves.
    Moving(bool),
    Fix {
        topic: Arc<str>,
        fix: GnssFix,
    },
    /// A ROS 2 message in CDR.
    Encoded {
        topic: Arc<str>,
        schema: Arc<Schema>,
        data: Vec<u8>,
    },
}

/// The topic of fixes, if none is named.
pub(super) const FIX: &str = "/fix";
