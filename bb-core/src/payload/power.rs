//! Batteries and supplies.

use crate::message::Payload;

/// The state of a battery (`sensor_msgs/BatteryState`).
///
/// ROS uses degrees Celsius and ampere hours in four-byte floats; this payload uses kelvin and coulomb.
#[derive(Clone, Debug, Default, PartialEq, Payload)]
#[payload(ros, no_frame)]
pub struct BatteryState {
    /// V
    #[payload(unit = "V")]
    pub voltage: f64,
    /// K
    #[payload(unit = "K")]
    pub temperature: Option<f64>,
    /// A; negative while discharging.
    #[payload(unit = "A")]
    pub current: Option<f64>,
    /// Remaining charge, coulomb.
    #[payload(unit = "A*s")]
    pub charge: Option<f64>,
    /// Its charge when it was last full, coulomb.
    #[payload(unit = "A*s")]
    pub capacity: Option<f64>,
    /// Its charge when full, as designed, coulomb.
    #[payload(unit = "A*s")]
    pub design_capacity: Option<f64>,
    /// Remaining charge as a fraction of the capacity, from 0 to 1.
    pub percentage: Option<f64>,
    /// Whether it is being charged.
    pub status: BatteryStatus,
    /// Its condition.
    pub health: BatteryHealth,
    /// Its chemistry.
    pub technology: BatteryTechnology,
    /// Whether it is present.
    pub is_present: bool,
    /// V, by cell; empty if the number of cells is unknown.
    pub cell_voltages: Vec<Option<f64>>,
    /// K, by cell; empty if the number of cells is unknown.
    pub cell_temperatures: Vec<Option<f64>>,
    /// Its location in the robot.
    pub location: String,
    /// Its serial number.
    pub serial_number: String,
}

/// Whether a battery is being charged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Payload)]
pub enum BatteryStatus {
    /// Unknown.
    #[default]
    Unknown,
    /// It is being charged.
    Charging,
    /// It supplies the robot.
    Discharging,
    /// Neither.
    NotCharging,
    /// It is full.
    Full,
}

/// The condition of a battery.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Payload)]
pub enum BatteryHealth {
    /// Unknown.
    #[default]
    Unknown,
    /// No fault.
    Good,
    /// Too hot.
    Overheat,
    /// Dead.
    Dead,
    /// Too high a voltage.
    Overvoltage,
    /// Another fault.
    UnspecifiedFailure,
    /// Too cold.
    Cold,
    /// Its watchdog expired.
    WatchdogTimerExpired,
    /// It was charged for too long.
    SafetyTimerExpired,
}

/// The chemistry of a battery.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Payload)]
pub enum BatteryTechnology {
    /// Unknown.
    #[default]
    Unknown,
    /// Nickel–metal hydride.
    NickelMetalHydride,
    /// Lithium ion.
    LithiumIon,
    /// Lithium polymer.
    LithiumPolymer,
    /// Lithium iron phosphate.
    LithiumIronPhosphate,
    /// Nickel–cadmium.
    NickelCadmium,
    /// Lithium manganese dioxide.
    LithiumManganeseDioxide,
    /// Ternary lithium.
    TernaryLithium,
    /// Lead–acid, valve-regulated.
    LeadAcid,
}

/// The state of a supply or of a rail that it feeds. ROS has no message for it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Payload)]
#[payload(no_frame)]
pub struct PowerState {
    /// Whether it is switched on.
    pub is_on: bool,
    /// V
    #[payload(unit = "V")]
    pub voltage: Option<f64>,
    /// A; positive to the load.
    #[payload(unit = "A")]
    pub current: Option<f64>,
    /// W; positive to the load.
    #[payload(unit = "W")]
    pub power: Option<f64>,
    /// J to the load since it was switched on.
    #[payload(unit = "J")]
    pub energy: Option<f64>,
}
