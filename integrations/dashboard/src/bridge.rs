//! The dashboard as a bridge of the robot that declares it.

use crate::options::DashboardOptions;
use crate::server::{Dashboard, DashboardState};
use bb_core::component::StateReport;
use bb_core::{Fault, MonotonicTime, Reading, Service, ServiceContext};

impl Service for Dashboard {
    type Options = DashboardOptions;
    type Output = DashboardState;

    fn init(options: DashboardOptions, context: &ServiceContext) -> Result<Self, Fault> {
        let is_printed = options.print;
        let mut dashboard = Self::serve(&context.bus(), options).map_err(|error| Fault::new(error.to_string()))?;
        dashboard.report = StateReport::new(context);
        if is_printed {
            eprintln!("dashboard: {}", dashboard.url());
        }
        Ok(dashboard)
    }

    fn update(&mut self, _: MonotonicTime) -> Result<Reading<DashboardState>, Fault> {
        let viewers = u32::try_from(self.viewers()).unwrap_or(u32::MAX);
        Ok(self.report.update(DashboardState { port: self.address().port(), viewers }))
    }
}
