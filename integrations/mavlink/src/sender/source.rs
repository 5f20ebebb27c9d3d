//! The source of estimates.

use bb_core::message::Stamped;
use bb_core::payload::Odometry;
use bb_core::run::Bus;
use bb_core::{Fault, MonotonicTime, Overflow, Subscription};
use bb_estimators::navigation::state_estimator::FlightEstimate;
use std::time::Duration;

/// Estimates of one of the kinds that can be sent; only the newest is kept.
#[derive(Debug)]
pub(super) enum Source {
    Flight(Subscription<FlightEstimate>),
    Odometry(Subscription<Odometry>),
}

#[derive(Clone, Debug)]
pub(super) enum Estimate {
    Flight(Box<FlightEstimate>),
    Odometry(Box<Stamped<Odometry>>),
}

impl Source {
    /// Subscribes to flight estimates, or otherwise to odometry if that is sufficient.
    pub(super) fn subscribe(bus: &Bus, path: &str, takes_odometry: bool) -> Result<Self, Fault> {
        let flight = bus.subscribe(path, Overflow::KeepLatest).map(|flight| flight.matched().map(Self::Flight));
        if flight.is_ok() || !takes_odometry {
            return Ok(flight??);
        }
        // Its message names the payload that is needed.
        Ok(Self::Odometry(bus.subscribe(path, Overflow::KeepLatest)?.matched()?))
    }

    /// The newest estimate since the last call.
    pub(super) fn newest(&self) -> Option<Estimate> {
        match self {
            Self::Flight(estimates) => {
                estimates.drain().last().map(|estimate| Estimate::Flight(Box::new(estimate.payload)))
            }
            Self::Odometry(estimates) => {
                estimates.drain().last().map(|estimate| Estimate::Odometry(Box::new(estimate)))
            }
        }
    }

    /// Returns the newest estimate; without one, waits until `timeout`.
    pub(super) fn wait(&self, timeout: Duration) -> Option<Estimate> {
        match self {
            Self::Flight(estimates) => {
                estimates.recv_timeout(timeout).map(|estimate| Estimate::Flight(Box::new(estimate.payload)))
            }
            Self::Odometry(estimates) => {
                estimates.recv_timeout(timeout).map(|estimate| Estimate::Odometry(Box::new(estimate)))
            }
        }
    }
}

impl Estimate {
    /// The time of the estimate.
    pub(super) fn time(&self) -> MonotonicTime {
        match self {
            Self::Flight(estimate) => estimate.time,
            Self::Odometry(estimate) => estimate.monotonic_time,
        }
    }
}
