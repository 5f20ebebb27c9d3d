//! The list of filters. Each is one folder, and one line here. Everything that names all filters is generated from
//! it: the modules of [`attitude`](super), the estimators at the top of the crate, [`AnyFilter`](super::AnyFilter),
//! and with it the command, the examples, the tests of accuracy and the tables in the guides.

/// Calls the macro `$with` with the list of attitude filters, `$($head)*` before it:
/// `folder Estimator Filter Params;`, one line each. Its items are in `bb_estimators::attitude`.
///
/// ```
/// macro_rules! count {
///     ($($module:ident $estimator:ident $filter:ident $params:ident;)*) => {
///         [$(stringify!($module)),*].len()
///     };
/// }
/// assert_eq!(bb_estimators::attitude_filters!(count!()), bb_estimators::attitude::FilterParams::ALL.len());
/// ```
#[macro_export]
macro_rules! attitude_filters {
    ($($with:ident)::+ !($($head:tt)*)) => {
        $($with)::+! {
            $($head)*
            mekf Mekf MekfFilter MekfParams;
            madgwick Madgwick MadgwickFilter MadgwickParams;
            vqf Vqf VqfFilter VqfParams;
            complementary Complementary ComplementaryFilter ComplementaryParams;
            mahony Mahony MahonyFilter MahonyParams;
            fusion Fusion FusionFilter FusionParams;
            tilt Tilt TiltFilter TiltParams;
        }
    };
}
