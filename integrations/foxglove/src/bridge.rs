//! The bridge as a line of the robot that declares it.

use crate::options::FoxgloveOptions;
use crate::server::Foxglove;
use crate::state::FoxgloveState;
use bb_core::{Fault, MonotonicTime, Reading, Service, ServiceContext};
use std::time::{Duration, Instant};

/// Time for which an update without a rate waits.
const WAIT: Duration = Duration::from_millis(100);
/// Time between two messages of its state, of a bridge without a rate.
const STATE: Duration = Duration::from_secs(1);

impl Service for Foxglove {
    type Options = FoxgloveOptions;
    type Output = FoxgloveState;

    fn init(options: FoxgloveOptions, context: &ServiceContext) -> Result<Self, Fault> {
        let mut foxglove = Self::serve(&context.bus(), options).map_err(|error| Fault::new(error.to_string()))?;
        foxglove.bridged.is_paced = context.period_s().is_some() || context.clock().is_virtual();
        Ok(foxglove)
    }

    fn update(&mut self, _: MonotonicTime) -> Result<Reading<FoxgloveState>, Fault> {
        if !self.bridged.is_paced {
            std::thread::sleep(WAIT);
            let now = Instant::now();
            if self.bridged.next.is_some_and(|next| now < next) {
                return Ok(Reading::nothing());
            }
            self.bridged.next = Some(now + STATE);
        }
        let state = FoxgloveState {
            port: self.address().port(),
            clients: u32::try_from(self.clients()).unwrap_or(u32::MAX),
            encoded: self.encoded(),
            lost: self.lost(),
        };
        match self.bridged.reported.replace(state) == Some(state) {
            true => Ok(Reading::nothing()),
            false => Ok(Reading::now(state)),
        }
    }
}
