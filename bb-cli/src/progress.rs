//! A progress bar on the terminal, redrawn a few times a second; where the errors do not go to one, there is none.

use indicatif::{ProgressBar, ProgressStyle};
use std::time::Duration;

/// How often a spinner moves; what is faster shows none.
const TICK: Duration = Duration::from_millis(200);

/// How far a run has come.
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

    /// Something that moves as long as nobody knows how far it is.
    pub fn spinner(what: &'static str) -> Self {
        let bar = ProgressBar::new_spinner().with_message(what);
        bar.enable_steady_tick(TICK);
        Self(bar)
    }

    /// Moves it there.
    pub fn set(&self, position: u64) {
        self.0.set_position(position);
    }

    /// Moves it on.
    pub fn add(&self, more: u64) {
        self.0.inc(more);
    }

    /// Takes it away.
    pub fn finish(&self) {
        self.0.finish_and_clear();
    }
}
