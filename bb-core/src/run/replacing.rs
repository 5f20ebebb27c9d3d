//! Replacing declared components by path.

use super::{Builder, Robot};
use crate::component::{Actuator, Estimator, Fault, Sensor, Service};
use crate::lifecycle::{
    replacement_of_actuator, replacement_of_estimator, replacement_of_sensor, replacement_of_service,
};
use crate::message::nearest::nearest_path;

impl<R: Robot> Builder<R> {
    /// Replaces the sensor at `path` with one of type `S`: a driver with a simulated sensor, or with one that plays
    /// back a recording. The path, frame, rate and supervision stay, and components downstream do not notice. Options
    /// that are declared, set or bound to parameters belong to the replaced driver and are not used. If the
    /// replacement publishes another payload than the declared one, the robot does not start.
    ///
    /// # Errors
    /// No sensor is at `path`; the error names the nearest one.
    pub fn replace_sensor<S: Sensor>(&mut self, path: &str, options: S::Options) -> Result<(), Fault>
    where
        S::Options: Sync,
    {
        let sensors = R::SENSORS.iter().map(|declared| declared.path).filter(|path| path.starts_with("sensor/"));
        let path = declared_path("sensor", path, sensors)?;
        self.replacements.insert(path, replacement_of_sensor::<S>(options));
        Ok(())
    }

    /// Replaces the actuator at `path`; `A` takes the same type of commands.
    ///
    /// # Errors
    /// No actuator is at `path`; the error names the nearest one.
    pub fn replace_actuator<A: Actuator>(&mut self, path: &str, options: A::Options) -> Result<(), Fault>
    where
        A::Options: Sync,
    {
        let path = declared_path("actuator", path, R::ACTUATORS.iter().map(|declared| declared.path))?;
        self.replacements.insert(path, replacement_of_actuator::<A>(options));
        Ok(())
    }

    /// Replaces the controller or the bridge at `path`; `S` publishes the same payload.
    ///
    /// # Errors
    /// No controller or bridge is at `path`; the error names the nearest one.
    pub fn replace_service<S: Service>(&mut self, path: &str, options: S::Options) -> Result<(), Fault>
    where
        S::Options: Sync,
    {
        let path = declared_path("controller or bridge", path, R::SERVICES.iter().map(|declared| declared.path))?;
        self.replacements.insert(path, replacement_of_service::<S>(options));
        Ok(())
    }

    /// Replaces the estimator at `path` with one of type `E`: another algorithm, a model of it, or one that plays back
    /// a recording. The path, frame, inputs, health and supervision stay. Options that are declared, set or bound to
    /// parameters belong to the replaced algorithm and are not used, and requests to it
    /// ([`call`](crate::Live::call), [`cast`](crate::Live::cast)) are refused. If the types of input and output are
    /// not those of the declared algorithm, or if an input spans a moving joint and `E` does not handle that, the
    /// robot does not start.
    ///
    /// # Errors
    /// No estimator is at `path`; the error names the nearest one.
    pub fn replace_estimator<E: Estimator>(&mut self, path: &str, options: E::Options) -> Result<(), Fault>
    where
        E::Options: Sync,
    {
        let path = declared_path("estimator", path, R::ESTIMATORS.iter().map(|declared| declared.path))?;
        self.replacements.insert(path, replacement_of_estimator::<E>(options));
        Ok(())
    }
}

/// The declared path that `path` names.
fn declared_path(
    kind: &str,
    path: &str,
    declared: impl Iterator<Item = &'static str> + Clone,
) -> Result<&'static str, Fault> {
    declared.clone().find(|other| *other == path).ok_or_else(|| {
        let near = nearest_path(path, declared);
        let hint = near.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
        Fault::new(format!("no {kind} is at `{path}`{hint}"))
    })
}
