//! Checks of type facts at compile time: names, dimensions, ranges.
//!
//! The macro cannot see types. It emits constants that call these functions at the user's token; a fault is a panic
//! while the constant is evaluated, which rustc reports there with the message made here.

mod names;
mod options;
mod text;

pub use names::{Declared, check_dynamic, check_inputs, check_outputs, input_index, nested_index, output_index};
pub use options::{Given, check_option, check_required};
