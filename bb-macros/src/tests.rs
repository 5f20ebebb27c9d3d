//! Floor one: diagnostics as data.
