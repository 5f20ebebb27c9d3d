//! The macros of bb-core.
