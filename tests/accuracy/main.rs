//! Accuracy on real recordings, which stand beside the repository in `../shared/data` and are not part of it. Without
//! that folder these tests say so and pass; with another number of recordings in it than they expect they fail.
//!
//! The bounds fail if a filter gets worse by 2 %.

mod attitude;
mod command;
mod navigation;
mod recordings;
mod single;
mod variants;
