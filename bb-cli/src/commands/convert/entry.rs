//! Entries of a recording, in SI.

use bb_core::message::Schema;
use bb_core::payload::GnssFix;
use std::sync::Arc;

/// A measurement, the truth, or a message that another program wrote.
#[derive(Clone, Debug)]
pub(super) struct Entry {
    /// Nanoseconds since 1970, or since the start of a clock of its own.
    pub(super) time_ns: i64,
    pub(super) what: What,
}

#[derive(Clone, Debug)]
pub(super) enum What {
    /// rad/s and m/s².
    Imu {
        angular_velocity: [f64; 3],
        specific_force: [f64; 3],
    },
    /// rad/s; from a file without the specific force.
    AngularVelocity([f64; 3]),
    /// m/s²; from a file without the angular velocity.
    SpecificForce([f64; 3]),
    /// T
    MagneticField([f64; 3]),
    /// The orientation, w, x, y, z, and the position, m; NaN if unknown.
    Truth {
        orientation: [f64; 4],
        position: [f64; 3],
    },
    Moving(bool),
    Fix {
        topic: Arc<str>,
        fix: GnssFix,
    },
    /// Message of ROS 2 in CDR.
    Encoded {
        topic: Arc<str>,
        schema: Arc<Schema>,
        data: Vec<u8>,
    },
}

/// The topic of fixes, if none is named.
pub(super) const FIX: &str = "/fix";
