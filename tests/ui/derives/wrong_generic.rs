//! Payloads with type parameters.

use bb_core::prelude::*;

/// Nothing says that `T` can be recorded.
#[derive(Clone, Debug, Payload)]
pub struct Pair<T> {
    pub first: T,
    pub second: T,
}

/// Payload whose parameter can be recorded.
#[derive(Clone, Debug, Payload)]
pub struct Timed<T: Payload> {
    pub value: T,
}

fn main() {}
