//! Accuracy on real recordings, which stand beside the repository in `../shared/data` and are not part of it. Without
//! that folder these tests say so and pass; with another number of recordings in it than they expect they fail.
//!
//! What takes minutes in a debug build is ignored there: `cargo test --release -p bb-tests --test accuracy -- --ignored`.
//!
//! The attitude filters are those of the list in `bb-estimators`; what each reaches is in its folder, and the test fails if
//! that changes by 2 %.

mod attitude;
mod command;
mod known;
mod navigation;
mod recordings;
mod single;
mod variants;
