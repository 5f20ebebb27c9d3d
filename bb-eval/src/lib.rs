//! Filters by name, run on recordings and scored against the truth.
//!
//! Without features this is [`Chosen`], a filter of `bb-estimators` by its name and settings, and [`Score`] and [`Averages`],
//! which define the errors. With the feature `recordings`, `evaluate_variant` runs attitude filters on a
//! `Recording`, and `play_navigation` navigation filters, each declared in a robot, on a `Drive`, of CSV files or of a
//! `NavigationBag`; with `plot`, `plot_errors` and `plot_navigation` draw the errors. `bb eval` is this library on the command line; its
//! guide is `book/src/how-to/evaluate.md`.
//!
//! ```
//! use bb_core::nalgebra::UnitQuaternion;
//! use bb_eval::Score;
//!
//! let truth = UnitQuaternion::identity();
//! let mut score = Score::default();
//! score.add(&UnitQuaternion::from_euler_angles(0.0, 0.0, 0.02), Some(&truth), true);
//! let rms = score.rms().ok_or("no sample has counted")?;
//! assert!((rms.heading - 0.02_f64.to_degrees()).abs() < 1e-9 && rms.inclination < 1e-9);
//! # Ok::<(), &str>(())
//! ```

// A robot must not stop because of an unexpected value.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod averages;
#[cfg(feature = "recordings")]
mod declination;
#[cfg(feature = "recordings")]
mod disturb;
#[cfg(feature = "plot")]
mod error_plot;
#[cfg(feature = "recordings")]
mod evaluate;
#[cfg(feature = "plot")]
mod export;
#[cfg(feature = "recordings")]
mod families;
#[cfg(feature = "recordings")]
pub mod files;
pub mod filters;
#[cfg(feature = "recordings")]
mod frames;
#[cfg(feature = "recordings")]
pub mod motion;
#[cfg(feature = "recordings")]
mod navigation;
#[cfg(feature = "recordings")]
mod periods;
mod progress;
#[cfg(feature = "recordings")]
mod recording;
#[cfg(feature = "recordings")]
pub mod report;
#[cfg(feature = "recordings")]
mod robot_file;
mod score;
mod suggestion;
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
#[cfg(feature = "recordings")]
pub use declination::Declination;
#[cfg(feature = "recordings")]
pub use disturb::{Delay, Disturbances, Dropped, Spell};
#[cfg(feature = "plot")]
pub use error_plot::plot_errors;
#[cfg(feature = "recordings")]
pub use evaluate::{Detail, Estimate, Evaluation, Evaluator, Run, evaluate_all, evaluate_variant};
#[cfg(feature = "plot")]
pub use export::{export_attitude, export_navigation, exportable};
#[cfg(feature = "recordings")]
pub use families::{
    FAMILIES, Family, FamilyScore, Half, Measure, Share, families_json, families_list, families_table,
    score_families,
};
pub use filters::{Axes, Chosen, Deviations, Refused, Running, Setting, Without};
#[cfg(feature = "recordings")]
pub use frames::{Mount, Place};
#[cfg(feature = "recordings")]
pub use navigation::{
    BagOptions, DataSet, Drive, Fate, InState, Inertial, Keyframe, NAVIGATION_FILTERS, NavigationBag,
    NavigationFilter, NavigationRun, NavigationScore, NavigationSetting, Noise, OfAge, Origin, Played,
    RelativeDeviation, RobotSettings, Sample, ScoredNavigation, Spread, StartFrom, Trace, Truth, Within, Wrong,
    inertial, navigation_json, navigation_table, play_navigation,
};
#[cfg(feature = "plot")]
pub use navigation::{Drawn, plot_navigation};
#[cfg(feature = "recordings")]
pub use periods::{Gap, Jitter, Periods};
pub use progress::Progress;
#[cfg(feature = "recordings")]
pub use recording::{End, MovingTopic, Recording, Topics};
#[cfg(feature = "recordings")]
pub use robot_file::RobotFile;
pub use score::{Degrees, Score};
#[cfg(feature = "recordings")]
pub use turns::{Align, Turn, Turns};
#[cfg(feature = "recordings")]
pub use variants::{Field, Offset, Starts, Variants};
