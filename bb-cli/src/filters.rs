//! The filters to choose from.

mod settings;

pub use settings::Setting;
pub(crate) use settings::near;

use bb_core::nalgebra::UnitQuaternion;
use bb_estimators::attitude::{
    AttitudeFilter, ComplementaryFilter, FusionFilter, ImuSample, MadgwickFilter, MahonyFilter, MekfFilter,
    SampleError, TiltFilter, VqfFilter,
};

/// Makes the table: the name on the command line, the filter, and its parameters for `--set`.
macro_rules! filters {
    ($($name:ident: $filter:ident { $($parameter:ident),* $(,)? }),* $(,)?) => {
        /// Every filter, in the order in which `--filter all` takes them.
        pub const FILTERS: &[Filter] = &[$(Filter {
            name: stringify!($name),
            parameters: &[$(stringify!($parameter)),*],
            #[cfg(test)]
            declared: || {
                let fields = <<$filter as AttitudeFilter>::Params as bb_core::Options>::FIELDS;
                fields.iter().map(|field| field.name).collect()
            },
            make: |values| {
                make::<$filter>(values, |params, name, value| match name {
                    $(stringify!($parameter) => settings::set(&mut params.$parameter, value),)*
                    _ => Err("not a parameter of this filter".into()),
                })
            },
        }),*];
    };
}

filters! {
    mekf: MekfFilter {
        gyroscope_noise, gyroscope_rate_noise, initial_bias, bias_drift, calibration_error, velocity,
        acceleration_time, accelerometer_latency, force_is_mean, magnetometer_latency, field_disturbance,
        magnetometer,
    },
    madgwick: MadgwickFilter { beta, magnetometer },
    vqf: VqfFilter {
        tilt_time_constant, heading_time_constant, rest_bias, motion_bias, initial_bias, bias_forgetting_time,
        largest_bias, motion_bias_deviation, vertical_forgetting_factor, rest_bias_deviation, rest_time,
        rest_time_constant, rest_angular_velocity, rest_specific_force, disturbance_rejection, field_time_constant,
        reference_time_constant, field_norm_tolerance, field_dip_tolerance, new_field_time, first_field_time,
        new_field_angular_velocity, undisturbed_time, rejection_time, rejection_factor, magnetometer,
    },
    complementary: ComplementaryFilter { tilt_time_constant, heading_time_constant, magnetometer },
    mahony: MahonyFilter { proportional_gain, integral_gain, magnetometer },
    fusion: FusionFilter {
        gain, gyroscope_range, acceleration_rejection, magnetic_rejection, recovery_time, offset_correction,
        rest_angular_velocity, rest_time, magnetometer,
    },
    tilt: TiltFilter { time_constant, magnetometer },
}

/// The parameter that every filter of nine axes has: whether it uses the ninth.
const MAGNETOMETER: &str = "magnetometer";

/// An attitude filter that can be chosen by name.
#[derive(Clone, Copy, Debug)]
pub struct Filter {
    /// Its name on the command line.
    pub name: &'static str,
    /// Its parameters.
    pub parameters: &'static [&'static str],
    #[cfg(test)]
    declared: fn() -> Vec<&'static str>,
    make: fn(&[(&str, &str)]) -> Made,
}

/// Gyroscope and accelerometer, or the magnetometer as well.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Axes {
    /// Gyroscope and accelerometer: heading starts anywhere and is no result.
    #[value(name = "6", alias = "six")]
    Six,
    /// The magnetometer as well.
    #[value(name = "9", alias = "nine")]
    Nine,
}

/// A filter with the values of its parameters.
#[derive(Clone, Debug)]
pub struct Chosen {
    filter: &'static Filter,
    /// Name and value.
    values: Vec<(String, String)>,
}

impl Filter {
    /// Whether it can use so many axes.
    pub fn takes(&self, axes: Axes) -> bool {
        axes == Axes::Six || self.has(MAGNETOMETER)
    }

    fn has(&self, parameter: &str) -> bool {
        self.parameters.contains(&parameter)
    }
}

impl Axes {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Six => "six",
            Self::Nine => "nine",
        }
    }
}

impl Chosen {
    /// The filter's name.
    pub fn name(&self) -> &'static str {
        self.filter.name
    }

    /// A filter that has seen no sample yet.
    ///
    /// # Errors
    /// A value that is refused; there is none after [`all`](Self::all).
    pub fn start(&self) -> Result<Box<dyn Running>, String> {
        let values: Vec<_> = self.values.iter().map(|(name, value)| (&**name, &**value)).collect();
        (self.filter.make)(&values)
    }
}

/// A filter that runs, whichever it is.
pub trait Running {
    /// Takes samples, and gives the orientation after each: none where there is none yet, or the sample was refused.
    fn run(&mut self, samples: &[ImuSample], estimates: &mut Vec<Option<UnitQuaternion<f64>>>) -> Refused;

    /// Standard deviation of the heading, rad, if the filter tells.
    fn heading_deviation(&self) -> Option<f64> {
        None
    }
}

/// The samples that a filter refused.
#[derive(Clone, Copy, Debug, Default)]
pub struct Refused {
    /// How many.
    pub count: u64,
    /// Why the first was.
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

    fn heading_deviation(&self) -> Option<f64> {
        let world_from_body = self.world_from_body()?.to_rotation_matrix();
        let variance = world_from_body * self.orientation_uncertainty()? * world_from_body.transpose();
        Some(variance[(2, 2)].max(0.0).sqrt())
    }
}

/// A filter, or which value it refuses.
type Made = Result<Box<dyn Running>, String>;

/// Sets a parameter of a name to what a text says.
type Set<P> = fn(&mut P, &str, &str) -> Result<(), String>;

fn make<F: AttitudeFilter + 'static>(values: &[(&str, &str)], set: Set<F::Params>) -> Made {
    let mut params = F::Params::default();
    for (name, value) in values {
        set(&mut params, name, value).map_err(|fault| format!("`{name}` is `{value}`, {fault}"))?;
    }
    Ok(Box::new(F::new(params).map_err(|error| error.to_string())?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_names_every_parameter() {
        for filter in FILTERS {
            assert_eq!(filter.parameters, (filter.declared)(), "the parameters of {}, for `--set`", filter.name);
        }
    }

    #[test]
    fn defaults_make_every_filter() {
        for filter in FILTERS {
            assert!((filter.make)(&[]).is_ok(), "{}", filter.name);
        }
    }
}
