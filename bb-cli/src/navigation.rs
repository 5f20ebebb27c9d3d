//! Navigation filters, scored on recorded and simulated drives and flights.

mod bag;
mod command;
mod csv;
mod data;
mod doubt;
mod errors;
mod evaluate;
mod filters;
mod flown;
mod measured;
mod picture;
mod player;
mod report;
mod step;
mod trace;
mod verdicts;

pub use bag::{
    BagOptions, BiasDeviation, FromBag, Mount, NavigationBag, Origin, Place, RelativeDeviation, StartFrom,
};
pub use data::DataSet;
pub use evaluate::{NavigationScore, evaluate_navigation};
pub use filters::{NAVIGATION_FILTERS, NavigationFilter, NavigationSetting};

pub(crate) use command::{EXAMPLES, NavigationArguments};
pub(crate) use csv::inertial;
