//! Checks of type facts at compile time: names, dimensions, ranges.
//!
//! The macro cannot see types. It emits constants that call these functions at the user's token. A fault is a panic
//! during evaluation of the constant; rustc reports it at that token with the message built here.

mod estimator;
mod find;
mod names;
mod options;
mod positions;
mod roles;
mod text;

pub use estimator::{check_estimator, check_nested};
pub use find::{find_input, find_output};
pub use names::{check_dynamic, check_input, check_optional, check_output};
pub use options::{check_compared, check_number, check_quantity, check_required};
pub use positions::check_position;
pub use roles::{check_reachable, check_role};
