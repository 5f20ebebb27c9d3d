//! The filter that the command line chooses, as one declarable estimator: how a user adds a filter of his own.

use bb_core::nalgebra::UnitQuaternion;
use bb_core::prelude::*;
use bb_estimators::attitude::{
    Attitude, AttitudeFilter, ComplementaryFilter, ComplementaryParams, ImuSample, MadgwickFilter, MadgwickParams,
    MekfFilter, MekfParams, ParamsError, SampleError,
};
use clap::ValueEnum;

/// Declares the chosen filter in a robot.
pub(crate) type Chosen = Attitude<ChosenFilter, Marg>;

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Kind {
    Madgwick,
    Complementary,
    Mekf,
}

impl Kind {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Madgwick => "madgwick",
            Self::Complementary => "complementary",
            Self::Mekf => "mekf",
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
    Complementary(ComplementaryFilter),
    Mekf(Box<MekfFilter>),
}

/// One of the filters, and what it was made with.
#[derive(Clone, Debug)]
pub(crate) struct ChosenFilter {
    params: ChosenParams,
    running: Running,
}

impl AttitudeFilter for ChosenFilter {
    type Params = ChosenParams;

    fn new(params: ChosenParams) -> Result<Self, ParamsError> {
        let ChosenParams { kind, magnetometer, beta } = params;
        let running = match kind {
            Kind::Madgwick => Running::Madgwick(MadgwickFilter::new(MadgwickParams { beta, magnetometer })?),
            Kind::Complementary => {
                let params = ComplementaryParams { magnetometer, ..ComplementaryParams::default() };
                Running::Complementary(ComplementaryFilter::new(params)?)
            }
            Kind::Mekf => {
                let params = MekfParams { magnetometer, ..MekfParams::default() };
                Running::Mekf(Box::new(MekfFilter::new(params)?))
            }
        };
        Ok(Self { params, running })
    }

    fn params(&self) -> &ChosenParams {
        &self.params
    }

    fn update(&mut self, sample: &ImuSample) -> Result<(), SampleError> {
        match &mut self.running {
            Running::Madgwick(filter) => filter.update(sample),
            Running::Complementary(filter) => filter.update(sample),
            Running::Mekf(filter) => filter.update(sample),
        }
    }

    fn start_at(&mut self, time_ns: i64, world_from_body: UnitQuaternion<f64>) -> Result<(), SampleError> {
        match &mut self.running {
            Running::Madgwick(filter) => filter.start_at(time_ns, world_from_body),
            Running::Complementary(filter) => filter.start_at(time_ns, world_from_body),
            Running::Mekf(filter) => filter.start_at(time_ns, world_from_body),
        }
    }

    fn world_from_body(&self) -> Option<UnitQuaternion<f64>> {
        match &self.running {
            Running::Madgwick(filter) => filter.world_from_body(),
            Running::Complementary(filter) => filter.world_from_body(),
            Running::Mekf(filter) => filter.world_from_body(),
        }
    }

    fn reset(&mut self) {
        match &mut self.running {
            Running::Madgwick(filter) => filter.reset(),
            Running::Complementary(filter) => filter.reset(),
            Running::Mekf(filter) => filter.reset(),
        }
    }
}
