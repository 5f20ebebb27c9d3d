//! Navigation filters, scored on recorded and simulated drives and flights.

mod allocations;
mod bag;
mod csv;
mod data;
mod doubt;
mod errors;
mod evaluate;
mod filters;
mod flown;
mod measured;
#[cfg(feature = "plot")]
mod picture;
mod player;
mod report;
mod step;
mod trace;
mod verdicts;

pub use bag::{
    BagOptions, BiasDeviation, FromBag, Mount, NavigationBag, Origin, Place, RelativeDeviation, StartFrom,
};
pub use csv::{Inertial, inertial};
pub use data::DataSet;
pub use evaluate::{NavigationScore, Played, evaluate_navigation, play_navigation};
pub use filters::{NAVIGATION_FILTERS, NavigationFilter, NavigationSetting, navigation_parameters};
#[cfg(feature = "plot")]
pub use picture::{Drawn, plot_navigation};
pub use report::{ScoredNavigation, navigation_json, navigation_table};
pub use trace::Trace;
