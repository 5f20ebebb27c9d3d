//! Tests of whole robots; see the test targets of this crate.
