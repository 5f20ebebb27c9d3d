//! Filters by name, run on recordings and scored against the truth.
//!
//! Without features this is [`Chosen`], a filter of `bb-estimators` by its name and settings, and [`Score`] and [`Averages`],
//! which define the errors. With the feature `recordings`, `evaluate` runs attitude filters on a
//! `Recording`, and `play_navigation` navigation filters, each declared in a robot, on a `Drive`, of CSV files or of a
//! `NavigationBag`; with `plot`, `plot_errors` and `plot_navigation` draw the errors. `bb eval` is this library on the command line; its
//! guide is `book/src/how-to/evaluate.md`.

// A robot must not stop because of an unexpected value.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod averages;
#[cfg(feature = "plot")]
mod error_plot;
#[cfg(feature = "recordings")]
mod evaluate;
#[cfg(feature = "recordings")]
mod families;
#[cfg(feature = "recordings")]
pub mod files;
pub mod filters;
#[cfg(feature = "recordings")]
mod frames;
#[cfg(feature = "recordings")]
mod navigation;
mod progress;
#[cfg(feature = "recordings")]
mod recording;
#[cfg(feature = "recordings")]
pub mod report;
mod score;
#[cfg(feature = "recordings")]
pub mod table;
#[cfg(feature = "recordings")]
mod truths;
#[cfg(feature = "recordings")]
mod turns;
#[cfg(feature = "recordings")]
pub mod units;
#[cfg(feature = "recordings")]
mod variants;

pub use averages::Averages;
#[cfg(feature = "plot")]
pub use error_plot::plot_errors;
#[cfg(feature = "recordings")]
pub use evaluate::{Detail, Evaluation, Evaluator, Run, evaluate, evaluate_all, evaluate_variant};
#[cfg(feature = "recordings")]
pub use families::{
    FAMILIES, Family, FamilyScore, Half, Measure, Share, families_json, families_list, families_table,
    score_families,
};
pub use filters::{Axes, Chosen, Deviations, Refused, Running, Setting};
#[cfg(feature = "recordings")]
pub use frames::{Mount, Place};
#[cfg(feature = "recordings")]
pub use navigation::{
    BagOptions, DataSet, Delay, Disturbances, Drive, Dropped, Fate, InState, Inertial, Keyframe,
    NAVIGATION_FILTERS, NavigationBag, NavigationFilter, NavigationRun, NavigationScore, NavigationSetting, Noise,
    OfAge, Origin, Played, RelativeDeviation, RobotFile, RobotSettings, Sample, ScoredNavigation, Spell, Spread,
    StartFrom, Trace, Truth, Within, Wrong, inertial, navigation_json, navigation_table, play_navigation,
};
#[cfg(feature = "plot")]
pub use navigation::{Drawn, export_navigation, plot_navigation};
pub use progress::Progress;
#[cfg(feature = "recordings")]
pub use recording::{End, MovingTopic, Recording, Topics};
pub use score::{Degrees, Score};
#[cfg(feature = "recordings")]
pub use turns::{Align, Turn, Turns};
#[cfg(feature = "recordings")]
pub use variants::{Field, Offset, Starts, Variants};
