//! The filters of `bb-estimators`, by name.

mod list;
mod settings;

pub use crate::suggestion::near;
pub use list::{described, listed, parameters};
pub use settings::{Setting, Without};

use bb_core::nalgebra::{Matrix3, UnitQuaternion};
use bb_estimators::attitude::{self, AttitudeFilter, FilterParams, ImuSample, SampleError};
use bb_estimators::attitude_filters;
use bb_estimators::params::{Params, Value};
use std::str::FromStr;

/// The parameter that every nine-axis filter has.
const MAGNETOMETER: &str = "magnetometer";

/// Gyroscope and accelerometer, or the magnetometer as well.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Axes {
    /// Gyroscope and accelerometer: the initial heading is arbitrary, and heading is not scored.
    #[cfg_attr(feature = "clap", value(name = "6", alias = "six"))]
    Six,
    /// The magnetometer as well.
    #[cfg_attr(feature = "clap", value(name = "9", alias = "nine"))]
    Nine,
}

impl Axes {
    /// Returns the number of axes in words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Six => "six",
            Self::Nine => "nine",
        }
    }

    /// Returns whether a filter can use this many axes.
    pub fn suit(self, filter: &FilterParams) -> bool {
        self == Self::Six || filter.get(MAGNETOMETER).is_some()
    }
}

impl FromStr for Axes {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "6" | "six" => Ok(Self::Six),
            "9" | "nine" => Ok(Self::Nine),
            _ => Err(format!("`{text}` is no number of axes; choose 6 or 9")),
        }
    }
}

/// A filter with the values of its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chosen {
    params: FilterParams,
}

impl Chosen {
    /// The filter's name.
    pub fn name(&self) -> &'static str {
        self.params.name()
    }

    /// Returns the parameters of the filter.
    pub fn params(&self) -> &FilterParams {
        &self.params
    }

    /// Returns the filter without its magnetometer if there are six axes, else the same filter.
    /// # Errors
    /// The value is refused.
    pub fn on(&self, axes: Axes) -> Result<Self, String> {
        let mut params = self.params;
        if axes == Axes::Six && params.get(MAGNETOMETER).is_some() {
            params.set(MAGNETOMETER, without(&params)).map_err(|error| format!("{}: {error}", self.name()))?;
        }
        Ok(Self { params })
    }

    /// Creates the filter, before its first sample.
    ///
    /// # Errors
    /// A value is refused, which cannot happen after [`all`](Self::all).
    pub fn start(&self) -> Result<Box<dyn Running>, String> {
        /// Boxes the concrete type, so that the filter is dispatched once per block.
        macro_rules! started {
            ($params:ident, $($module:ident $estimator:ident $filter:ident $_params:ident;)*) => {
                match $params {
                    $(FilterParams::$estimator(params) => {
                        attitude::$filter::<f64>::new(params).map(|filter| Box::new(filter) as Box<dyn Running>)
                    })*
                }
            };
        }
        let params = self.params;
        attitude_filters!(started!(params,)).map_err(|error| error.to_string())
    }
}

/// The value of `magnetometer` with which a filter uses none.
fn without(filter: &FilterParams) -> &'static str {
    match filter.get(MAGNETOMETER) {
        Some(Value::Choice(_)) => "none",
        _ => "false",
    }
}

/// A running filter of any type.
pub trait Running {
    /// Processes samples, and appends the orientation after each: `None` if there is none yet, or the sample was refused.
    fn run(&mut self, samples: &[ImuSample], estimates: &mut Vec<Option<UnitQuaternion<f64>>>) -> Refused;

    /// The standard deviations, if the filter reports them.
    fn deviations(&self) -> Option<Deviations> {
        None
    }

    /// Returns whether the heading is known well enough to be used, if the filter reports it.
    fn trusts_heading(&self) -> Option<bool> {
        None
    }
}

/// Standard deviations of an orientation, rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviations {
    /// The covariance of the error as a small rotation about the axes of the world, rad².
    pub covariance: Matrix3<f64>,
    /// The deviation of the heading.
    pub heading: f64,
    /// The deviation of the inclination: the root of the sum of the variances about the two horizontal axes, which is
    /// the expected root mean square of the angle.
    pub inclination: f64,
}

/// The samples that a filter refused.
#[derive(Clone, Copy, Debug, Default)]
pub struct Refused {
    /// The number of refused samples.
    pub count: u64,
    /// The reason for the first one.
    pub first: Option<SampleError>,
}

impl<F: AttitudeFilter> Running for F {
    fn run(&mut self, samples: &[ImuSample], estimates: &mut Vec<Option<UnitQuaternion<f64>>>) -> Refused {
        let mut refused = Refused::default();
        for sample in samples {
            estimates.push(match self.update(sample) {
                Ok(()) => self.world_from_body(),
                Err(error) => {
                    refused.count += 1;
                    refused.first.get_or_insert(error);
                    None
                }
            });
        }
        refused
    }

    fn trusts_heading(&self) -> Option<bool> {
        self.is_heading_trusted()
    }

    fn deviations(&self) -> Option<Deviations> {
        let world_from_body = self.world_from_body()?.to_rotation_matrix();
        let variance = world_from_body * self.orientation_uncertainty()? * world_from_body.transpose();
        Some(Deviations {
            covariance: variance,
            heading: variance[(2, 2)].max(0.0).sqrt(),
            inclination: (variance[(0, 0)] + variance[(1, 1)]).max(0.0).sqrt(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_make_every_filter() {
        for params in FilterParams::ALL.iter().map(|default| default()) {
            assert!(Chosen { params }.start().is_ok(), "{}", params.name());
        }
    }
}
