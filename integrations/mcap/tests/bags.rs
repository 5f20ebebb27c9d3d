//! Bags, good ones and bad ones.

mod bad;
mod common;
mod compressed;
mod definitions;
mod good;
mod samples;
#[cfg(feature = "sqlite")]
mod sqlite;
