//! Controllers and bridges, which run as sensors do.

use crate::component::{Reading, Sensor, SensorContext, Service, ServiceContext};
use crate::fault::{Fault, Termination};
use crate::time::MonotonicTime;

/// A controller or a bridge as a sensor.
#[doc(hidden)]
#[derive(Debug)]
pub struct Serving<S: Service>(S);

impl<S: Service> Sensor for Serving<S> {
    type Options = S::Options;
    type Output = S::Output;

    fn init(options: S::Options, context: &SensorContext) -> Result<Self, Fault> {
        S::init(options, &ServiceContext::of(context)).map(Self)
    }

    fn read(&mut self, now: MonotonicTime) -> Result<Reading<S::Output>, Fault> {
        self.0.update(now)
    }

    fn handle_options(&mut self, options: S::Options, context: &SensorContext) -> Result<(), Fault> {
        self.0.handle_options(options, &ServiceContext::of(context))
    }

    fn terminate(&mut self, reason: Termination<'_>) {
        self.0.terminate(reason);
    }
}
