//! The common interface of all components, whatever trait they implement.

use crate::component::{
    Actuator, ActuatorContext, Context, Estimator, Options, Reading, Sensor, SensorContext, Service, ServiceContext,
};
use crate::declaration::SensorDeclaration;
use crate::fault::Fault;
use crate::message::Payload;
use crate::time::MonotonicTime;

/// A component as its `Slot` sees it.
pub trait Component: Sized + Send + 'static {
    /// Its options.
    type Options: Options;
    /// The context for its start.
    type Context: Send;

    /// Makes it.
    ///
    /// # Errors
    /// Why it cannot start.
    fn make(options: Self::Options, context: &Self::Context) -> Result<Self, Fault>;
    /// Takes new options.
    ///
    /// # Errors
    /// Why it cannot go on.
    fn change(&mut self, options: Self::Options, context: &Self::Context) -> Result<(), Fault>;
    /// Closes it.
    fn close(&mut self);
}

/// A component that is called at a rate and publishes its readings: a sensor or a service.
pub trait Periodic: Component {
    /// What it publishes.
    type Output: Payload;

    /// Its context.
    #[doc(hidden)]
    fn context(declaration: &'static SensorDeclaration, host: HostHandle) -> Self::Context;
    /// Takes one reading.
    ///
    /// # Errors
    /// Why it cannot be taken.
    fn read(&mut self, now: MonotonicTime) -> Result<Reading<Self::Output>, Fault>;
    /// When it wants to be read first.
    fn starts_at(&self) -> Option<MonotonicTime>;
}

/// The robot, for contexts.
#[derive(Clone, Debug)]
pub struct HostHandle(pub(crate) std::sync::Arc<dyn crate::component::Host>);

macro_rules! component {
    ($(#[$doc:meta])* $visibility:vis $wrapper:ident: $contract:ident, $context:ty) => {
        $(#[$doc])*
        #[derive(Debug)]
        $visibility struct $wrapper<C>(pub(crate) C);

        impl<C: $contract> Component for $wrapper<C> {
            type Options = C::Options;
            type Context = $context;

            fn make(options: C::Options, context: &$context) -> Result<Self, Fault> {
                C::init(options, context).map(Self)
            }

            fn change(&mut self, options: C::Options, context: &$context) -> Result<(), Fault> {
                self.0.handle_options(options, context)
            }

            fn close(&mut self) {
                self.0.terminate();
            }
        }
    };
}

component! {
    /// An estimator.
    pub(crate) AsEstimator: Estimator, Context
}

component! {
    /// A sensor.
    pub AsSensor: Sensor, SensorContext
}

component! {
    /// A controller or a bridge.
    pub AsService: Service, ServiceContext
}

component! {
    /// An actuator.
    pub(crate) AsActuator: Actuator, ActuatorContext
}

impl<S: Sensor> Periodic for AsSensor<S> {
    type Output = S::Output;

    fn context(declaration: &'static SensorDeclaration, host: HostHandle) -> SensorContext {
        SensorContext::new(declaration, host.0)
    }

    fn read(&mut self, now: MonotonicTime) -> Result<Reading<S::Output>, Fault> {
        self.0.read(now)
    }

    fn starts_at(&self) -> Option<MonotonicTime> {
        self.0.starts_at()
    }
}

impl<S: Service> Periodic for AsService<S> {
    type Output = S::Output;

    fn context(declaration: &'static SensorDeclaration, host: HostHandle) -> ServiceContext {
        ServiceContext::new(declaration, host.0)
    }

    fn read(&mut self, now: MonotonicTime) -> Result<Reading<S::Output>, Fault> {
        self.0.update(now)
    }

    fn starts_at(&self) -> Option<MonotonicTime> {
        None
    }
}
