//! Tests of what crosses zenoh.

mod interfaces;
mod wire;
