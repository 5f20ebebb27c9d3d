//! Any of the filters, chosen by name at run time.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::{About, AttitudeFilter, ImuSample, ParamsError, Real, SampleError};
use crate::params::{Parameter, Params, Value};

/// Generates the enums with one variant for each filter.
macro_rules! any {
    ($($module:ident $estimator:ident $filter:ident $params:ident;)*) => {
        /// The parameters of one of the filters.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum FilterParams {
            $(
                #[doc = concat!("Parameters of [`", stringify!($filter), "`](super::", stringify!($filter), ").")]
                $estimator(super::$params),
            )*
        }

        impl FilterParams {
            /// Every filter with its defaults.
            pub const ALL: &'static [fn() -> Self] = &[$(|| Self::$estimator(super::$params::default())),*];

            /// The filter's name, which is that of its folder.
            pub fn name(&self) -> &'static str {
                match self {
                    $(Self::$estimator(_) => stringify!($module),)*
                }
            }

            /// The name of its estimator in `robot!`.
            pub fn estimator(&self) -> &'static str {
                match self {
                    $(Self::$estimator(_) => stringify!($estimator),)*
                }
            }

            /// Purpose of the filter.
            pub fn about(&self) -> &'static About {
                match self {
                    $(Self::$estimator(_) => &super::$module::ABOUT,)*
                }
            }

            fn params(&self) -> &dyn Params {
                match self {
                    $(Self::$estimator(params) => params,)*
                }
            }

            fn params_mut(&mut self) -> &mut dyn Params {
                match self {
                    $(Self::$estimator(params) => params,)*
                }
            }
        }

        #[derive(Clone, Debug, PartialEq)]
        enum Running<T: Real> {
            $($estimator(super::$filter<T>),)*
        }

        impl<T: Real> Running<T> {
            fn new(params: &FilterParams) -> Result<Self, ParamsError> {
                match *params {
                    $(FilterParams::$estimator(params) => super::$filter::new(params).map(Self::$estimator),)*
                }
            }
        }

        /// Calls a method of the filter in it.
        macro_rules! running {
            ($any:expr, $one:ident => $call:expr) => {
                match $any {
                    $(Running::$estimator($one) => $call,)*
                }
            };
        }
    };
}

crate::attitude_filters!(any!());

impl FilterParams {
    /// The filter of this name with its defaults.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().map(|default| default()).find(|params| params.name() == name)
    }
}

impl Default for FilterParams {
    /// The most accurate one.
    fn default() -> Self {
        Self::Mekf(super::MekfParams::default())
    }
}

impl Params for FilterParams {
    fn parameters(&self) -> &'static [Parameter] {
        self.params().parameters()
    }

    fn value(&self, index: usize) -> Option<Value> {
        self.params().value(index)
    }

    fn replace(&mut self, index: usize, value: Value) -> bool {
        self.params_mut().replace(index, value)
    }
}

/// One of the filters with its parameters, from which [`AnyFilter`] is created.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "runtime", derive(bb_core::Options))]
pub struct AnyParams {
    /// The filter's parameters.
    #[cfg_attr(feature = "runtime", option(default = FilterParams::default()))]
    pub filter: FilterParams,
}

/// One of the filters, chosen at run time. If the choice is fixed in the program, using that filter directly is
/// cheaper.
///
/// ```
/// use bb_estimators::attitude::{AnyFilter, AnyParams, AttitudeFilter, FilterParams};
/// use bb_estimators::params::Params;
///
/// let mut vqf = FilterParams::named("vqf").ok_or("no such filter")?;
/// vqf.set("tilt_time_constant", "2 s")?;
/// let filter = AnyFilter::<f64>::new(AnyParams { filter: vqf })?;
/// assert_eq!(filter.world_from_body(), None);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct AnyFilter<T: Real = f64> {
    params: AnyParams,
    running: Running<T>,
}

impl<T: Real> AttitudeFilter<T> for AnyFilter<T> {
    type Params = AnyParams;

    fn new(params: AnyParams) -> Result<Self, ParamsError> {
        Ok(Self { params, running: Running::new(&params.filter)? })
    }

    fn params(&self) -> &AnyParams {
        &self.params
    }

    fn update(&mut self, sample: &ImuSample<T>) -> Result<(), SampleError> {
        running!(&mut self.running, filter => filter.update(sample))
    }

    fn start_at(&mut self, time_ns: i64, world_from_body: UnitQuaternion<T>) -> Result<(), SampleError> {
        running!(&mut self.running, filter => filter.start_at(time_ns, world_from_body))
    }

    fn world_from_body(&self) -> Option<UnitQuaternion<T>> {
        running!(&self.running, filter => filter.world_from_body())
    }

    fn gyroscope_bias(&self) -> Option<Vector3<T>> {
        running!(&self.running, filter => filter.gyroscope_bias())
    }

    fn orientation_uncertainty(&self) -> Option<Matrix3<T>> {
        running!(&self.running, filter => filter.orientation_uncertainty())
    }

    fn is_at_rest(&self) -> Option<bool> {
        running!(&self.running, filter => filter.is_at_rest())
    }

    fn is_magnetically_disturbed(&self) -> Option<bool> {
        running!(&self.running, filter => filter.is_magnetically_disturbed())
    }

    fn is_heading_trusted(&self) -> Option<bool> {
        running!(&self.running, filter => filter.is_heading_trusted())
    }

    fn reset(&mut self) {
        running!(&mut self.running, filter => filter.reset())
    }
}
