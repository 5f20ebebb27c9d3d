//! Nothing.

use bb_core::prelude::*;

robot! {}

fn main() {}
