//! Estimators: of one input, of several, of several outputs, and one that spans moving joints.

use bb_core::prelude::*;

/// An estimator of a single input and output.
#[derive(Debug)]
pub struct Tilt;

/// Options of [`Tilt`].
#[derive(Clone, Debug, Options)]
pub struct TiltOptions {
    /// Weight of a sample in the estimate.
    #[option(default = 0.1, range = 0.0..=1.0)]
    pub gain: f64,
    /// Time constant of the estimate. Unit: s.
    #[option(default = 2.0, unit = "s")]
    pub time_constant: f64,
}

impl Estimator for Tilt {
    type Options = TiltOptions;
    type Input = Imu;
    type Output = Orientation;

    fn init(_: TiltOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, _: &Stamped<Imu>) -> Result<Reply<Orientation>, Fault> {
        Ok(Reply::none())
    }
}

/// An estimator of several inputs, one of which it can do without.
#[derive(Debug)]
pub struct Heading;

/// Inputs of [`Heading`].
#[derive(Debug, Inputs)]
pub struct HeadingInputs<'a> {
    /// The inertial sensor.
    pub imu: Input<'a, Imu>,
    /// The compass.
    pub field: Input<'a, MagneticField>,
    /// A first guess.
    pub guess: Option<Input<'a, Orientation>>,
}

impl Estimator for Heading {
    type Options = NoOptions;
    type Input = HeadingInputs<'static>;
    type Output = Orientation;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, _: HeadingInputs<'_>) -> Result<Reply<Orientation>, Fault> {
        Ok(Reply::none())
    }
}

/// An estimator of several outputs.
#[derive(Debug)]
pub struct Motion;

/// Outputs of [`Motion`].
#[derive(Debug, Default, Outputs)]
pub struct MotionOutputs {
    /// Orientation of the body.
    pub orientation: Option<Orientation>,
    /// Velocity of the body.
    pub velocity: Option<Twist>,
}

impl Estimator for Motion {
    type Options = NoOptions;
    type Input = Imu;
    type Output = MotionOutputs;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, _: &Stamped<Imu>) -> Result<Reply<MotionOutputs>, Fault> {
        Ok(Reply::none())
    }
}

/// An estimator whose inputs may span moving joints.
#[derive(Debug)]
pub struct Jointed;

impl Estimator for Jointed {
    type Options = NoOptions;
    type Input = Imu;
    type Output = Orientation;
    const HANDLES_MOVING_JOINTS: bool = true;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, _: &Stamped<Imu>) -> Result<Reply<Orientation>, Fault> {
        Ok(Reply::none())
    }
}
