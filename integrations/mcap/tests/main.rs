//! Bags of other programs.

mod bags;
