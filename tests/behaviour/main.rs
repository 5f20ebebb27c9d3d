//! Whole robots.
