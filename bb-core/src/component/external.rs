//! A sensor fed by other code.

use super::{Fault, NoOptions, Reading, Sensor, SensorContext};
use crate::message::Payload;
use crate::time::MonotonicTime;
use std::marker::PhantomData;

/// A sensor whose messages come from elsewhere: a driver's callback, a network, a test.
///
/// Declare `sensor imu: External<Imu>();` and publish its readings with
/// [`Live::publish`](crate::Live::publish) or [`Simulation::publish`](crate::Simulation::publish). Code that knows only its path gets a
/// publisher from [`Bus::publisher`](crate::Bus::publisher).
///
/// An `external` input of an estimator needs no such declaration: it takes any path.
#[derive(Debug)]
pub struct External<T>(PhantomData<fn() -> T>);

impl<T: Payload> Sensor for External<T> {
    type Options = NoOptions;
    type Output = T;
    const IS_EXTERNAL: bool = true;

    fn init(_: NoOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self(PhantomData))
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<T>, Fault> {
        Ok(Reading::finished())
    }
}
