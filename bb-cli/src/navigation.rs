//! Navigation filters, scored on recorded and simulated drives and flights.

mod data;
mod evaluate;
mod filters;
mod measured;
mod player;
mod report;

pub use data::DataSet;
pub use evaluate::{NavigationScore, evaluate_navigation};
pub use filters::{NAVIGATION_FILTERS, NavigationFilter, NavigationSetting};

pub(crate) use filters::listed;
pub(crate) use report::{json, table};
