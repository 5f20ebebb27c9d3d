//! One sample of an inertial sensor, and why a filter may refuse it.

use core::error::Error;
use core::fmt;

use nalgebra::Vector3;

use super::Real;

/// Specific force, m/s², below which a sensor is in free fall and does not show which way is up.
pub const FREE_FALL: f64 = 0.5;

/// The largest component of the angular velocity that a filter accepts, rad/s. Gyroscopes end below 100 rad/s.
pub const MAX_ANGULAR_VELOCITY: f64 = 1e3;

/// The largest component of the specific force that a filter accepts, m/s². Shock sensors end below 10⁵ m/s².
pub const MAX_SPECIFIC_FORCE: f64 = 1e6;

/// The largest component of the magnetic field that a filter accepts, in any unit.
pub const MAX_MAGNETIC_FIELD: f64 = 1e15;

/// One sample of an inertial sensor, with the magnetic field if there is a new one.
///
/// All vectors are in the body frame, which is the sensor's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuSample<T = f64> {
    /// Time of the measurement, nanoseconds since any fixed time.
    pub time_ns: i64,
    /// Angular velocity of the body relative to the world, rad/s.
    pub angular_velocity: Vector3<T>,
    /// Specific force, m/s²: at rest one g upwards.
    pub specific_force: Vector3<T>,
    /// Magnetic field, tesla. Only its direction is used, so any other unit does as well.
    pub magnetic_field: Option<Vector3<T>>,
}

/// An input quantity of a filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Quantity {
    /// [`ImuSample::angular_velocity`].
    AngularVelocity,
    /// [`ImuSample::specific_force`].
    SpecificForce,
    /// [`ImuSample::magnetic_field`].
    MagneticField,
    /// An orientation to start from.
    Orientation,
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::AngularVelocity => "angular velocity",
            Self::SpecificForce => "specific force",
            Self::MagneticField => "magnetic field",
            Self::Orientation => "orientation",
        })
    }
}

/// Reason for which a filter refused a sample. The filter is unchanged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SampleError {
    /// A component is NaN or infinite.
    NonFinite {
        /// The quantity.
        quantity: Quantity,
    },
    /// A component is larger than any sensor's.
    OutOfRange {
        /// The quantity.
        quantity: Quantity,
        /// The greatest magnitude of a component, in the quantity's unit.
        value: f64,
        /// The largest accepted magnitude.
        limit: f64,
    },
    /// The time stamp does not increase.
    TimeNotIncreasing {
        /// The stamp of the last accepted sample.
        previous_ns: i64,
        /// The stamp of the refused sample.
        time_ns: i64,
    },
}

impl fmt::Display for SampleError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NonFinite { quantity } => write!(f, "{quantity} is not finite"),
            Self::OutOfRange { quantity, value, limit } => {
                write!(f, "{quantity} reaches {value:e}, beyond the limit of {limit:e}")
            }
            Self::TimeNotIncreasing { previous_ns, time_ns } => {
                write!(f, "time stamp {time_ns} ns does not follow {previous_ns} ns")
            }
        }
    }
}

impl Error for SampleError {}

/// The directions of a sample, as unit vectors in the body frame.
pub(super) struct Directions<T> {
    /// Direction of the specific force; `None` in free fall.
    pub(super) up: Option<Vector3<T>>,
    /// Direction of the magnetic field, if there is one to use.
    pub(super) field: Option<Vector3<T>>,
}

impl<T: Real> ImuSample<T> {
    /// Converts the sample to another scalar.
    pub fn cast<U: Real>(&self) -> ImuSample<U> {
        let cast = |vector: &Vector3<T>| vector.map(|component| U::of(component.as_f64()));
        ImuSample {
            time_ns: self.time_ns,
            angular_velocity: cast(&self.angular_velocity),
            specific_force: cast(&self.specific_force),
            magnetic_field: self.magnetic_field.as_ref().map(cast),
        }
    }

    /// The directions, if every value that a filter uses is finite and within the range of sensors.
    #[inline]
    pub(super) fn directions(&self, magnetometer: bool) -> Result<Directions<T>, SampleError> {
        // Most samples are within the spheres inscribed in these cubes, whose squared norms are needed anyway.
        let rate = self.angular_velocity.norm_squared();
        let force = self.specific_force.norm_squared();
        let field = match &self.magnetic_field {
            Some(field) if magnetometer => field.norm_squared(),
            _ => T::ZERO,
        };
        let usual = rate <= square(MAX_ANGULAR_VELOCITY)
            && force <= square(MAX_SPECIFIC_FORCE)
            && field <= square(MAX_MAGNETIC_FIELD);
        if !usual {
            self.check_components(magnetometer)?;
        }
        Ok(Directions {
            up: direction(&self.specific_force, force, square(FREE_FALL)),
            field: self.magnetic_field.as_ref().and_then(|vector| direction(vector, field, T::LEAST_SQUARE)),
        })
    }

    /// Returns whether angular velocity and specific force are within the range of sensors, and the force shows which
    /// way is up.
    #[inline(always)]
    pub(super) fn is_usual(&self) -> bool {
        let rate = self.angular_velocity.norm_squared();
        let force = self.specific_force.norm_squared();
        rate <= square(MAX_ANGULAR_VELOCITY) && force <= square(MAX_SPECIFIC_FORCE) && force > square(FREE_FALL)
    }

    #[cold]
    fn check_components(&self, magnetometer: bool) -> Result<(), SampleError> {
        check(Quantity::AngularVelocity, &self.angular_velocity, MAX_ANGULAR_VELOCITY)?;
        check(Quantity::SpecificForce, &self.specific_force, MAX_SPECIFIC_FORCE)?;
        match &self.magnetic_field {
            Some(field) if magnetometer => check(Quantity::MagneticField, field, MAX_MAGNETIC_FIELD),
            _ => Ok(()),
        }
    }
}

/// The direction of a field that is within the range of sensors, if it has one.
#[inline(always)]
pub(super) fn usual_field<T: Real>(field: &Vector3<T>) -> Option<Vector3<T>> {
    let squared = field.norm_squared();
    if squared <= square(MAX_MAGNETIC_FIELD) { direction(field, squared, T::LEAST_SQUARE) } else { None }
}

fn check<T: Real>(quantity: Quantity, value: &Vector3<T>, limit: f64) -> Result<(), SampleError> {
    if !value.iter().all(|component| component.is_finite()) {
        return Err(SampleError::NonFinite { quantity });
    }
    if value.amax() > T::of(limit) {
        return Err(SampleError::OutOfRange { quantity, value: value.amax().as_f64(), limit });
    }
    Ok(())
}

fn square<T: Real>(limit: f64) -> T {
    T::of(limit) * T::of(limit)
}

/// The unit vector along `vector`, or `None` if its squared norm is at most `least`.
#[inline]
fn direction<T: Real>(vector: &Vector3<T>, squared: T, least: T) -> Option<Vector3<T>> {
    (squared > least).then(|| vector * (T::ONE / squared.sqrt()))
}
