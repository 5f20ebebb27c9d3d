//! The demonstration is `main.rs`.
