//! The dashboard as a bridge of the robot that declares it.

use crate::options::DashboardOptions;
use crate::server::{Bridged, Dashboard};
use bb_core::{Fault, MonotonicTime, Payload, Reading, Service, ServiceContext};
use std::time::Duration;

/// Time for which an update without a rate waits.
const WAIT: Duration = Duration::from_millis(100);

/// The viewers of a [`Dashboard`], published when their number has changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Payload)]
pub struct DashboardState {
    /// The port that it listens on.
    pub port: u16,
    /// Number of connected viewers.
    pub viewers: u32,
}

impl Service for Dashboard {
    type Options = DashboardOptions;
    type Output = DashboardState;

    fn init(options: DashboardOptions, context: &ServiceContext) -> Result<Self, Fault> {
        let is_printed = options.print;
        let mut dashboard = Self::serve(&context.bus(), options).map_err(|error| Fault::new(error.to_string()))?;
        let is_paced = context.period_s().is_some() || context.clock().is_virtual();
        dashboard.bridged = Bridged { viewers: None, is_paced };
        if is_printed {
            eprintln!("dashboard: {}", dashboard.url());
        }
        Ok(dashboard)
    }

    fn update(&mut self, _: MonotonicTime) -> Result<Reading<DashboardState>, Fault> {
        if !self.bridged.is_paced {
            std::thread::sleep(WAIT);
        }
        let viewers = self.viewers();
        if self.bridged.viewers.replace(viewers) == Some(viewers) {
            return Ok(Reading::nothing());
        }
        let viewers = u32::try_from(viewers).unwrap_or(u32::MAX);
        Ok(Reading::now(DashboardState { port: self.address().port(), viewers }))
    }
}
