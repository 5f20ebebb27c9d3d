//! The components that the robots of these tests declare: the least that has the shape a rule speaks of.

mod acting;
mod estimators;
mod sensors;

pub use acting::{MoveTo, Resume, RosBridge, Servo, SlowDown, Stability, Stop};
pub use estimators::{Heading, HeadingInputs, Jointed, Motion, MotionOutputs, Tilt, TiltOptions};
pub use sensors::{Bmi270, Bmi270Options, Encoder, Magnetometer};

/// A type that is neither a sensor nor an estimator.
#[derive(Debug)]
pub struct Wheel;
