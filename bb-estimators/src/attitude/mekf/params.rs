//! Statements of a user about the sensors.

use crate::params::{Field, Kind, Value, params};

/// Knowledge about a magnetometer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Magnetometer {
    /// Nothing: the filter finds out whether it has an offset, and which.
    #[default]
    Auto,
    /// Magnetometer that is calibrated in its place: it has no offset.
    Calibrated,
    /// Magnetometer that is not calibrated: it has an offset, and the heading is unknown until that is found.
    Uncalibrated,
    /// No magnetometer, or one that is not to be used: the heading drifts with what is left of the gyroscope's bias.
    None,
}

impl Magnetometer {
    const ALL: [(&'static str, Self); 4] = [
        ("auto", Self::Auto),
        ("calibrated", Self::Calibrated),
        ("uncalibrated", Self::Uncalibrated),
        ("none", Self::None),
    ];

    /// Returns whether its samples are used.
    pub fn is_used(self) -> bool {
        self != Self::None
    }
}

impl Field for Magnetometer {
    const KIND: Kind = Kind::Choice(&["auto", "calibrated", "uncalibrated", "none"]);

    fn to_value(self) -> Value {
        let named = Self::ALL.iter().find(|(_, one)| *one == self);
        Value::Choice(named.map_or("auto", |(name, _)| name))
    }

    fn from_value(value: Value) -> Option<Self> {
        let Value::Choice(name) = value else { return None };
        Self::ALL.iter().find(|(known, _)| *known == name).map(|(_, one)| *one)
    }
}

params! {
    /// Parameters of [`MekfFilter`](super::MekfFilter). The motion of the body is not among them: the filter finds it from the samples.
    pub struct MekfParams {
        /// Calibration of the magnetometer.
        ///
        /// `auto`: whether it has an offset is found out by the motion. `calibrated`: it has none, which saves the time to
        /// find that out. `uncalibrated`: it has one, so the heading is unknown until the body has turned. `none`: six axes.
        ///
        /// Source: how the sensor is mounted.
        magnetometer: Magnetometer = Magnetometer::Auto;
        /// Declination of the magnetic field, positive to the east: with it north is the geographic one.
        ///
        /// 0: north is the magnetic one.
        ///
        /// Source: a model of the Earth's field, for the place.
        declination: f64 = 0.0, in -3.15..=3.15, unit "rad";
    }
}
