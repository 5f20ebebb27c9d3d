//! The bridge as a line of the robot that declares it.

use crate::options::FoxgloveOptions;
use crate::server::{Foxglove, FoxgloveState};
use bb_core::component::StateReport;
use bb_core::{Fault, MonotonicTime, Reading, Service, ServiceContext};

impl Service for Foxglove {
    type Options = FoxgloveOptions;
    type Output = FoxgloveState;

    fn init(options: FoxgloveOptions, context: &ServiceContext) -> Result<Self, Fault> {
        let mut foxglove = Self::serve(&context.bus(), options).map_err(|error| Fault::new(error.to_string()))?;
        foxglove.report = StateReport::new(context);
        Ok(foxglove)
    }

    fn update(&mut self, _: MonotonicTime) -> Result<Reading<FoxgloveState>, Fault> {
        let state = self.state();
        Ok(self.report.update(state))
    }
}
