//! Tests of what crosses zenoh.

mod wire;
