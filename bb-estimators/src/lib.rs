//! Attitude filters and what they share, as plain algorithms: values in, values out, no runtime.
//!
//! Each algorithm has a folder of its own; every filter the same files: `params`, `filter`, `tests`.
//! All quantities are SI; the world frame is ENU (x east, y north, z up).

pub mod attitude;
