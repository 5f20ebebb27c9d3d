//! Replacing declared components by path.

use super::draft::Draft;
use super::{Builder, Robot};
use crate::component::replacement::Replacement;
use crate::component::{Actuator, Estimator, Fault, Sensor, Service};
use crate::lifecycle::{Serving, replacement_of_actuator, replacement_of_estimator, replacement_of_sensor};
use bb_message::__private::{did_you_mean, nearest_path};

impl<R: Robot> Builder<R> {
    /// Replaces the sensor at `path`, or the other code at the path of an `external` input, with one of type `S`: a driver with a simulated sensor, or with one that plays
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
        let sensors = self.draft.robot.sensors.iter().map(|declared| declared.path).collect();
        self.draft.replace("sensor", sensors, path, replacement_of_sensor::<S>(options))
    }

    /// Replaces the actuator at `path`; `A` takes the same type of commands.
    ///
    /// # Errors
    /// No actuator is at `path`; the error names the nearest one.
    pub fn replace_actuator<A: Actuator>(&mut self, path: &str, options: A::Options) -> Result<(), Fault>
    where
        A::Options: Sync,
    {
        let declared = self.draft.robot.actuators.iter().map(|declared| declared.path).collect();
        self.draft.replace("actuator", declared, path, replacement_of_actuator::<A>(options))
    }

    /// Replaces the controller or the bridge at `path`; `S` publishes the same payload.
    ///
    /// # Errors
    /// No controller or bridge is at `path`; the error names the nearest one.
    pub fn replace_service<S: Service>(&mut self, path: &str, options: S::Options) -> Result<(), Fault>
    where
        S::Options: Sync,
    {
        let declared = self.draft.robot.services.iter().map(|declared| declared.path).collect();
        self.draft.replace("controller or bridge", declared, path, replacement_of_sensor::<Serving<S>>(options))
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
        let declared = self.draft.robot.estimators.iter().map(|declared| declared.path).collect();
        self.draft.replace("estimator", declared, path, replacement_of_estimator::<E>(options))
    }
}

impl Draft {
    /// Replaces the component whose path, one of `declared`, is `path`.
    fn replace(
        &mut self,
        kind: &str,
        declared: Vec<&'static str>,
        path: &str,
        replacement: Replacement,
    ) -> Result<(), Fault> {
        let Some(path) = declared.iter().find(|other| **other == path) else {
            let hint = did_you_mean(nearest_path(path, declared.iter().copied()));
            return Err(Fault::new(format!("no {kind} is at `{path}`{hint}")));
        };
        self.replacements.insert(path, replacement);
        Ok(())
    }
}
