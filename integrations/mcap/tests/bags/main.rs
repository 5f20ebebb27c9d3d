//! Bags: good ones, bad ones, and real ones where they are at hand.

mod bad;
mod common;
mod compressed;
mod definitions;
mod good;
mod real;
mod samples;
#[cfg(feature = "sqlite")]
mod sqlite;
