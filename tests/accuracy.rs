//! Accuracy on recordings of real sensors, which are not part of the repository: `BB_DATA=FOLDER cargo test --release -p bb-long-tests
//! --test long accuracy`. Without all of the recordings that they expect they fail.
//!
//! The attitude filters are those of the list in `bb-estimators`; what each reaches is in its folder, and the test fails if
//! that changes by 2 %.

mod attitude;
mod bags;
mod command;
mod families;
mod features;
mod harder;
mod known;
mod known_families;
mod navigation;
mod single;
mod unknown_headings;
mod variants;
