//! Plays a drive to a robot.

use crate::arguments::Arguments;
use crate::drive::{Drive, Event};
use crate::outcome::Outcome;
use crate::robot::{Car, FILTER, Rover, car, rover};
use crate::{plot, recorded, simulated};
use bb_core::nalgebra::{UnitQuaternion, Vector3};
use bb_core::payload::Twist;
use bb_core::prelude::*;
use bb_plot::Picture;
use clap::Parser;
use std::error::Error;
use std::io::Write;
use std::process::ExitCode;

/// Story of the simulated drive, printed before it begins.
pub(crate) const STORY: &str = "\
A rover drives curves for three minutes, with an IMU, wheels and satellites. From 80 s to 140 s it has no satellites: the error grows, and
has to stay within the three standard deviations that the filter states. Then both shrink with the first fix. Times are in seconds.";

/// More than there are samples.
const ALL: Overflow = Overflow::DropOldest { capacity: 1 << 17 };

pub(crate) fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Runs the demonstration; returns whether all that is claimed happened.
fn run(arguments: &Arguments) -> Result<bool, Box<dyn Error>> {
    if let Some(file) = &arguments.plot {
        Picture::check(file, "--plot")?;
    }
    let outcome = match &arguments.data {
        Some(prefix) => of_record(&recorded::drive(prefix)?)?,
        None => simulated(&simulated::drive())?,
    };
    let text = if arguments.data.is_none() { format!("{STORY}\n\n{outcome}") } else { outcome.to_string() };
    match std::io::stdout().lock().write_all(text.as_bytes()) {
        // A reader that has read enough (`| head`) is no error.
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => return Err(error.into()),
        _ => {}
    }
    if let Some(file) = &arguments.plot {
        plot::picture(&outcome).write(file)?;
        eprintln!("plotted {}", file.display());
    }
    Ok(outcome.missing().is_empty())
}

/// Drives the rover.
pub(crate) fn simulated(drive: &Drive) -> Result<Outcome, StartError> {
    let builder = Rover::builder();
    let odometry = builder.subscribe_with(rover::estimator::base::navigation, ALL);
    let health = builder.subscribe_with(system::Health, ALL);
    let mut simulation = builder.simulate()?;
    for (time, event) in &drive.events {
        match *event {
            Event::Imu(imu) => simulation.publish(rover::sensor::base::bracket::board::imu, *time, imu),
            Event::Wheels(twist) => simulation.publish(rover::sensor::base::wheels, *time, counted(twist)),
            Event::Fix(fix) => simulation.publish(rover::sensor::base::mast::antenna::gnss, *time, fix),
        }
    }
    Ok(Outcome::new(FILTER, drive, &odometry.drain().collect::<Vec<_>>(), &health.drain().collect::<Vec<_>>()))
}

/// An odometry whose pose is not used.
fn counted(twist: Twist) -> Odometry {
    let pose = Pose { position: Vector3::zeros(), world_from_body: UnitQuaternion::identity(), covariance: None };
    Odometry { pose, twist }
}

/// Drives the car.
pub(crate) fn of_record(drive: &Drive) -> Result<Outcome, StartError> {
    let builder = Car::builder();
    let odometry = builder.subscribe_with(car::estimator::base::navigation, ALL);
    let health = builder.subscribe_with(system::Health, ALL);
    let mut simulation = builder.simulate()?;
    for (time, event) in &drive.events {
        match *event {
            Event::Imu(imu) => simulation.publish(car::sensor::base::imu, *time, imu),
            Event::Fix(fix) => simulation.publish(car::sensor::base::gnss, *time, fix),
            // It has none.
            Event::Wheels(_) => {}
        }
    }
    Ok(Outcome::new(FILTER, drive, &odometry.drain().collect::<Vec<_>>(), &health.drain().collect::<Vec<_>>()))
}
