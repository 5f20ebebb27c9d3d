//! Macro that declares the parameters of an algorithm.

/// Writes a struct of parameters: one field a parameter, with its documentation, default, range and unit.
///
/// ```text
/// params! {
///     /// The tuning of some filter.
///     pub struct SomeParams {
///         /// Time constant with which the tilt follows the accelerometer.
///         ///
///         /// Small: …. Large: …. Source: ….
///         tilt_time_constant: f64 = 3.0, in 0.0..=1e6, unit "s";
///         /// White noise of the gyroscope.
///         gyroscope_noise: f64 = 0.5 * DEGREE, in 0.0..=1.0, shown "0.5°/s/√Hz", plain "rad/s/√Hz";
///         /// Correction of the heading by the magnetic field.
///         magnetometer: bool = true;
///         /// How far the scale of the wheel speed is from 1.
///         wheel_scale: GaussMarkov = GaussMarkov::new(0.03, 1000.0), deviation 0.0..=1.0, shown "0.03 for 1000 s";
///     }
/// }
/// ```
///
/// `unit` is a unit of the language: a literal in `robot!` must carry one of that dimension. `plain` is for units that the
/// language does not have: there a literal is a plain number. `shown` is how the documentation writes a default that is an
/// expression. A process has the range of its `deviation`, and a unit, `of` the state. A default outside its range does not
/// compile.
macro_rules! params {
    (
        $(#[$meta:meta])*
        pub struct $name:ident {
            $(
                $(#[doc = $doc:literal])*
                $field:ident: $type:ty = $default:expr
                $(, in $range:expr $(, shown $shown:literal)? $(, unit $unit:literal)? $(, plain $plain:literal)?)?
                $(, deviation $deviation:expr $(, shown $process:literal)? $(, of $of:literal)?)?;
            )*
        }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[cfg_attr(feature = "runtime", derive(bb_core::Options))]
        pub struct $name {
            $(
                $(#[doc = $doc])*
                #[doc = ""]
                #[doc = concat!(
                    "Default: `", stringify!($default), "`"
                    $($(, ", that is ", $shown)?)? $($(, ", that is ", $process)?)?, "."
                    $(, " Range: `", stringify!($range), "`." $(, " Unit: ", $unit, ".")? $(, " Unit: ", $plain, ".")?)?
                    $(, " Range of the deviation: `", stringify!($deviation), "`." $(, " Unit: ", $of, ".")?)?
                )]
                #[cfg_attr(
                    feature = "runtime",
                    option(default = $default $(, range = $range $(, unit = $unit)?)?)
                )]
                pub $field: $type,
            )*
        }

        $($(const _: () = assert!(
            $crate::params::Range::stated(&[$range]).has($default),
            concat!("the default of `", stringify!($field), "` is outside its range")
        );)?)*

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $default),* }
            }
        }

        impl $name {
            /// Descriptions of all parameters.
            pub const PARAMETERS: &'static [$crate::params::Parameter] = &[$(
                $crate::params::Parameter {
                    name: stringify!($field),
                    doc: concat!($($doc, "\n"),*),
                    kind: <$type as $crate::params::Field>::KIND,
                    range: $crate::params::Range::stated(&[$($range)? $($deviation)?]),
                    unit: concat!($($($unit)? $($plain)?)? $($($of)?)?),
                }
            ),*];
        }

        impl $crate::params::Params for $name {
            fn parameters(&self) -> &'static [$crate::params::Parameter] {
                Self::PARAMETERS
            }

            fn value(&self, index: usize) -> Option<$crate::params::Value> {
                [$($crate::params::Field::to_value(self.$field)),*].get(index).copied()
            }

            fn replace(&mut self, index: usize, value: $crate::params::Value) -> bool {
                let mut place = 0..;
                $(
                    if place.next() == Some(index) {
                        let field = $crate::params::Field::from_value(value);
                        self.$field = field.unwrap_or(self.$field);
                        return field.is_some();
                    }
                )*
                false
            }
        }
    };
}

pub(crate) use params;
