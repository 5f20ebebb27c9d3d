//! Navigation filters in their robots, scored on recorded drives and flights.

mod bag;
mod csv;
mod data;
mod doubt;
mod drive;
mod errors;
mod evaluate;
mod feed;
#[cfg(feature = "plot")]
mod picture;
mod record;
mod report;
mod robot;
mod score;
mod scoring;
mod trace;

pub(crate) use bag::FIX;
pub use bag::{BagOptions, NavigationBag, Origin, RelativeDeviation, StartFrom};
pub use csv::{Inertial, inertial};
pub use data::{DataSet, Keyframe, Noise, Sample, Truth};
pub use drive::Drive;
pub use evaluate::{NavigationRun, Played, play_navigation};
#[cfg(feature = "plot")]
pub use picture::{Drawn, plot_navigation};
pub use report::{ScoredNavigation, navigation_json, navigation_table};
pub use robot::{NAVIGATION_FILTERS, NavigationFilter, NavigationSetting, RobotSettings};
pub use score::{Fate, InState, NavigationScore, OfAge, Spread, Within, Wrong};
#[cfg(feature = "plot")]
pub(crate) use trace::Row;
pub use trace::Trace;
