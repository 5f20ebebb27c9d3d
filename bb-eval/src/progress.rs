//! A progress bar on the terminal, redrawn a few times a second; omitted if the error stream is not a terminal.

use std::io::{IsTerminal, Write};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, TryLockError};
use std::time::{Duration, Instant};

/// The least time between two drawings; work that finishes sooner shows none.
const TICK: Duration = Duration::from_millis(200);

/// The width of a full bar, in characters.
const WIDTH: u64 = 40;

/// The progress of a run.
#[derive(Debug)]
pub struct Progress {
    what: &'static str,
    /// None if it is unknown.
    length: Option<u64>,
    position: AtomicU64,
    /// Time at which the line was last drawn; none if the error stream is not a terminal.
    drawn: Option<Mutex<Instant>>,
}

impl Progress {
    /// A bar of this length, in any unit.
    pub fn new(what: &'static str, length: u64) -> Self {
        Self::of(what, Some(length))
    }

    /// A line for work of unknown length.
    pub fn spinner(what: &'static str) -> Self {
        let spinner = Self::of(what, None);
        spinner.draw();
        spinner
    }

    fn of(what: &'static str, length: Option<u64>) -> Self {
        let drawn = std::io::stderr().is_terminal().then(|| Mutex::new(Instant::now()));
        Self { what, length, position: AtomicU64::new(0), drawn }
    }

    /// Sets the position.
    pub fn set(&self, position: u64) {
        self.position.store(position, Ordering::Relaxed);
        self.tick();
    }

    /// Advances the position.
    pub fn add(&self, more: u64) {
        self.position.fetch_add(more, Ordering::Relaxed);
        self.tick();
    }

    /// Removes it.
    pub fn finish(&self) {
        if self.drawn.is_some() {
            print("\r\x1b[2K");
        }
    }

    fn tick(&self) {
        let Some(drawn) = &self.drawn else { return };
        let mut drawn = match drawn.try_lock() {
            Ok(drawn) => drawn,
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
            // Another thread draws.
            Err(TryLockError::WouldBlock) => return,
        };
        if drawn.elapsed() >= TICK {
            *drawn = Instant::now();
            self.draw();
        }
    }

    fn draw(&self) {
        if self.drawn.is_some() {
            print(&format!("\r\x1b[2K{}", self.line()));
        }
    }

    fn line(&self) -> String {
        let Some(length) = self.length else { return format!("{} …", self.what) };
        let position = self.position.load(Ordering::Relaxed).min(length);
        let part = |whole: u64| whole * position / length.max(1);
        let full = part(WIDTH) as usize;
        format!("{} {}{} {} %", self.what, "█".repeat(full), "░".repeat(WIDTH as usize - full), part(100))
    }
}

/// The terminal may be gone.
fn print(text: &str) {
    let mut stream = std::io::stderr().lock();
    let _ = stream.write_all(text.as_bytes()).and_then(|()| stream.flush());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bar_is_as_full_as_its_position() {
        let progress = Progress::new("playing", 200);
        progress.add(50);
        assert_eq!(progress.line(), format!("playing {}{} 25 %", "█".repeat(10), "░".repeat(30)));
        progress.set(300);
        assert_eq!(progress.line(), format!("playing {} 100 %", "█".repeat(40)));
        assert!(Progress::new("nothing", 0).line().ends_with(" 0 %"));
    }
}
