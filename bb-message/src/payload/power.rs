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
    /// Charge of the battery when it was last full, coulomb.
    #[payload(unit = "A*s")]
    pub capacity: Option<f64>,
    /// Charge of the battery when full, as designed, coulomb.
    #[payload(unit = "A*s")]
    pub design_capacity: Option<f64>,
    /// Remaining charge as a fraction of the capacity, from 0 to 1.
    pub percentage: Option<f64>,
    /// State of charging.
    pub status: BatteryStatus,
    /// Condition of the battery.
    pub health: BatteryHealth,
    /// Chemistry of the battery.
    pub technology: BatteryTechnology,
    /// `true` if the battery is present.
    pub is_present: bool,
    /// V, by cell; empty if the number of cells is unknown.
    pub cell_voltages: Vec<Option<f64>>,
    /// K, by cell; empty if the number of cells is unknown.
    pub cell_temperatures: Vec<Option<f64>>,
    /// Location in the robot.
    pub location: String,
    /// Serial number.
    pub serial_number: String,
}

/// State of charging of a battery.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Payload)]
pub enum BatteryStatus {
    /// Unknown.
    #[default]
    Unknown,
    /// Charging.
    Charging,
    /// Discharging: it supplies the robot.
    Discharging,
    /// Neither.
    NotCharging,
    /// Full.
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
    /// The watchdog expired.
    WatchdogTimerExpired,
    /// The battery was charged for too long.
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
    /// `true` if the supply is switched on.
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
