//! The filter that the command line chooses, as one declarable estimator: how a user adds a filter of his own.

use bb_core::nalgebra::{Matrix3, UnitQuaternion, Vector3};
use bb_core::prelude::*;
use bb_estimators::attitude::{
    Attitude, AttitudeFilter, ComplementaryFilter, ComplementaryParams, FusionFilter, FusionParams, ImuSample,
    MadgwickFilter, MadgwickParams, MahonyFilter, MahonyParams, MekfFilter, MekfParams, ParamsError, SampleError,
    TiltFilter, TiltParams, VqfFilter, VqfParams,
};
use clap::ValueEnum;

/// Declares the chosen filter in a robot.
pub(crate) type Chosen = Attitude<ChosenFilter, Marg>;

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Kind {
    Madgwick,
    Mahony,
    Complementary,
    Fusion,
    Vqf,
    Mekf,
    Tilt,
}

impl Kind {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Madgwick => "madgwick",
            Self::Mahony => "mahony",
            Self::Complementary => "complementary",
            Self::Fusion => "fusion",
            Self::Vqf => "vqf",
            Self::Mekf => "mekf",
            Self::Tilt => "tilt",
        }
    }
}

/// Which filter, and its parameters.
#[derive(Clone, Debug, PartialEq, Options)]
pub(crate) struct ChosenParams {
    #[option(default = Kind::Madgwick)]
    pub(crate) kind: Kind,
    #[option(default = true)]
    pub(crate) magnetometer: bool,
    /// Madgwick's step, rad/s.
    #[option(default = 0.12, range = 0.0..=1e3)]
    pub(crate) beta: f64,
}

impl Default for ChosenParams {
    fn default() -> Self {
        Self::defaults()
    }
}

#[derive(Clone, Debug)]
pub(crate) enum Running {
    Madgwick(MadgwickFilter),
    Mahony(MahonyFilter),
    Complementary(ComplementaryFilter),
    Fusion(FusionFilter),
    Vqf(Box<VqfFilter>),
    Mekf(Box<MekfFilter>),
    Tilt(TiltFilter),
}

/// One of the filters, and what it was made with.
#[derive(Clone, Debug)]
pub(crate) struct ChosenFilter {
    params: ChosenParams,
    running: Running,
}

/// Calls a method of whichever filter runs.
macro_rules! running {
    ($running:expr, $filter:ident => $call:expr) => {
        match $running {
            Running::Madgwick($filter) => $call,
            Running::Mahony($filter) => $call,
            Running::Complementary($filter) => $call,
            Running::Fusion($filter) => $call,
            Running::Vqf($filter) => $call,
            Running::Mekf($filter) => $call,
            Running::Tilt($filter) => $call,
        }
    };
}

impl AttitudeFilter for ChosenFilter {
    type Params = ChosenParams;

    fn new(params: ChosenParams) -> Result<Self, ParamsError> {
        let ChosenParams { kind, magnetometer, beta } = params;
        let running = match kind {
            Kind::Madgwick => Running::Madgwick(MadgwickFilter::new(MadgwickParams { beta, magnetometer })?),
            Kind::Mahony => {
                Running::Mahony(MahonyFilter::new(MahonyParams { magnetometer, ..MahonyParams::default() })?)
            }
            Kind::Complementary => {
                let params = ComplementaryParams { magnetometer, ..ComplementaryParams::default() };
                Running::Complementary(ComplementaryFilter::new(params)?)
            }
            Kind::Fusion => {
                Running::Fusion(FusionFilter::new(FusionParams { magnetometer, ..FusionParams::default() })?)
            }
            Kind::Vqf => {
                Running::Vqf(Box::new(VqfFilter::new(VqfParams { magnetometer, ..VqfParams::default() })?))
            }
            Kind::Mekf => {
                let params = MekfParams { magnetometer, ..MekfParams::default() };
                Running::Mekf(Box::new(MekfFilter::new(params)?))
            }
            Kind::Tilt => Running::Tilt(TiltFilter::new(TiltParams { magnetometer, ..TiltParams::default() })?),
        };
        Ok(Self { params, running })
    }

    fn params(&self) -> &ChosenParams {
        &self.params
    }

    fn update(&mut self, sample: &ImuSample) -> Result<(), SampleError> {
        running!(&mut self.running, filter => filter.update(sample))
    }

    fn start_at(&mut self, time_ns: i64, world_from_body: UnitQuaternion<f64>) -> Result<(), SampleError> {
        running!(&mut self.running, filter => filter.start_at(time_ns, world_from_body))
    }

    fn world_from_body(&self) -> Option<UnitQuaternion<f64>> {
        running!(&self.running, filter => filter.world_from_body())
    }

    fn gyroscope_bias(&self) -> Option<Vector3<f64>> {
        running!(&self.running, filter => filter.gyroscope_bias())
    }

    fn orientation_uncertainty(&self) -> Option<Matrix3<f64>> {
        running!(&self.running, filter => filter.orientation_uncertainty())
    }

    fn is_at_rest(&self) -> Option<bool> {
        running!(&self.running, filter => filter.is_at_rest())
    }

    fn is_heading_trusted(&self) -> Option<bool> {
        running!(&self.running, filter => filter.is_heading_trusted())
    }

    fn is_magnetically_disturbed(&self) -> Option<bool> {
        running!(&self.running, filter => filter.is_magnetically_disturbed())
    }

    fn reset(&mut self) {
        running!(&mut self.running, filter => filter.reset())
    }
}
