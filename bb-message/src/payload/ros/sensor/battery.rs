//! `sensor_msgs/BatteryState`: NaN means not measured; degrees Celsius, ampere hours.

use super::super::number::{code, of_code, or_nan, unless_nan};
use super::super::ros_message;
use crate::payload::{BatteryHealth, BatteryState, BatteryStatus, BatteryTechnology};

const STATUSES: [BatteryStatus; 5] = [
    BatteryStatus::Unknown,
    BatteryStatus::Charging,
    BatteryStatus::Discharging,
    BatteryStatus::NotCharging,
    BatteryStatus::Full,
];

const HEALTHS: [BatteryHealth; 9] = [
    BatteryHealth::Unknown,
    BatteryHealth::Good,
    BatteryHealth::Overheat,
    BatteryHealth::Dead,
    BatteryHealth::Overvoltage,
    BatteryHealth::UnspecifiedFailure,
    BatteryHealth::Cold,
    BatteryHealth::WatchdogTimerExpired,
    BatteryHealth::SafetyTimerExpired,
];

const TECHNOLOGIES: [BatteryTechnology; 9] = [
    BatteryTechnology::Unknown,
    BatteryTechnology::NickelMetalHydride,
    BatteryTechnology::LithiumIon,
    BatteryTechnology::LithiumPolymer,
    BatteryTechnology::LithiumIronPhosphate,
    BatteryTechnology::NickelCadmium,
    BatteryTechnology::LithiumManganeseDioxide,
    BatteryTechnology::TernaryLithium,
    BatteryTechnology::LeadAcid,
];

const CELSIUS_ZERO_K: f64 = 273.15;
const AMPERE_HOUR_C: f64 = 3600.0;

fn celsius(kelvin: Option<f64>) -> f32 {
    or_nan(kelvin.map(|kelvin| kelvin - CELSIUS_ZERO_K))
}

fn kelvin(celsius: f32) -> Option<f64> {
    unless_nan(celsius.into()).map(|celsius| celsius + CELSIUS_ZERO_K)
}

fn ampere_hours(coulombs: Option<f64>) -> f32 {
    or_nan(coulombs.map(|coulombs| coulombs / AMPERE_HOUR_C))
}

fn coulombs(ampere_hours: f32) -> Option<f64> {
    unless_nan(ampere_hours.into()).map(|hours| hours * AMPERE_HOUR_C)
}

ros_message! {
    BatteryState => BatteryStateMessage "sensor_msgs/BatteryState";
    write(battery) {
        voltage: f32 = battery.voltage as f32,
        temperature: f32 = celsius(battery.temperature),
        current: f32 = or_nan(battery.current),
        charge: f32 = ampere_hours(battery.charge),
        capacity: f32 = ampere_hours(battery.capacity),
        design_capacity: f32 = ampere_hours(battery.design_capacity),
        percentage: f32 = or_nan(battery.percentage),
        power_supply_status: u8 = code(&STATUSES, battery.status),
        power_supply_health: u8 = code(&HEALTHS, battery.health),
        power_supply_technology: u8 = code(&TECHNOLOGIES, battery.technology),
        present: bool = battery.is_present,
        cell_voltage: Vec<f32> = battery.cell_voltages.iter().copied().map(or_nan).collect(),
        cell_temperature: Vec<f32> = battery.cell_temperatures.iter().copied().map(celsius).collect(),
        location: String = battery.location.clone(),
        serial_number: String = battery.serial_number.clone(),
    }
    read {
        Self {
            voltage: voltage.into(),
            temperature: kelvin(temperature),
            current: unless_nan(current.into()),
            charge: coulombs(charge),
            capacity: coulombs(capacity),
            design_capacity: coulombs(design_capacity),
            percentage: unless_nan(percentage.into()),
            status: of_code(&STATUSES, power_supply_status),
            health: of_code(&HEALTHS, power_supply_health),
            technology: of_code(&TECHNOLOGIES, power_supply_technology),
            is_present: present,
            cell_voltages: cell_voltage.into_iter().map(|voltage| unless_nan(voltage.into())).collect(),
            cell_temperatures: cell_temperature.into_iter().map(kelvin).collect(),
            location,
            serial_number,
        }
    }
}
