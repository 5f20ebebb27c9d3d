//! A progress bar on the terminal, redrawn a few times a second; omitted if the error stream is not a terminal.

use indicatif::{ProgressBar, ProgressStyle};
use std::time::Duration;

/// How often a spinner moves; work that finishes sooner shows none.
const TICK: Duration = Duration::from_millis(200);

/// The progress of a run.
#[derive(Debug)]
pub struct Progress(ProgressBar);

impl Progress {
    /// A bar of this length, in any unit.
    pub fn new(what: &'static str, length: u64) -> Self {
        let bar = ProgressBar::new(length);
        if let Ok(style) = ProgressStyle::with_template("{msg} {wide_bar} {percent} %") {
            bar.set_style(style);
        }
        bar.set_message(what);
        Self(bar)
    }

    /// A spinner for work of unknown length.
    pub fn spinner(what: &'static str) -> Self {
        let bar = ProgressBar::new_spinner().with_message(what);
        bar.enable_steady_tick(TICK);
        Self(bar)
    }

    /// Sets the position.
    pub fn set(&self, position: u64) {
        self.0.set_position(position);
    }

    /// Advances the position.
    pub fn add(&self, more: u64) {
        self.0.inc(more);
    }

    /// Removes it.
    pub fn finish(&self) {
        self.0.finish_and_clear();
    }
}
