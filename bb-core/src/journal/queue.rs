//! Lines waiting for the sink, and their limits.

use super::{Entry, Event};
use crate::message::Field as _;
use crate::time::MonotonicTime;
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// The load at which outside producers start to wait for the sink.
pub(super) const CAPACITY: Load = Load { lines: 1 << 16, bytes: 64 << 20 };

/// The load at which the journal ends. Estimators and the control state do not wait for the sink. One line beyond it
/// is accepted, however large.
pub(super) const MOST: Load = Load { lines: 4 * CAPACITY.lines, bytes: 4 * CAPACITY.bytes };

/// The load of one batch for the sink.
pub(super) const BATCH: Load = Load { lines: 1 << 10, bytes: 1 << 20 };

/// Time for which outside producers wait for a sink that is too slow. A sink that takes no line for this long while [`CAPACITY`] is
/// queued hangs. The journal then ends there: it never has a gap.
pub(super) const LONGEST_WAIT: Duration = Duration::from_secs(2);

/// The amount of queued data.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Load {
    pub(super) lines: usize,
    /// The bytes of the lines, on the heap and inline.
    pub(super) bytes: usize,
}

impl Load {
    pub(super) fn fills(self, bound: Self) -> bool {
        self.lines >= bound.lines || self.bytes >= bound.bytes
    }

    fn add(&mut self, other: Self) {
        self.lines += other.lines;
        self.bytes = self.bytes.saturating_add(other.bytes);
    }

    fn take(&mut self, other: Self) {
        self.lines = self.lines.saturating_sub(other.lines);
        self.bytes = self.bytes.saturating_sub(other.bytes);
    }
}

/// The bytes that a line counts, computed before any lock is taken.
pub(super) fn bytes_of(event: &Event) -> usize {
    size_of::<Entry>().saturating_add(event.heap_bytes())
}

/// Lines handed to the sink together.
#[derive(Default)]
pub(super) struct Batch {
    pub(super) lines: Vec<Entry>,
    load: Load,
}

/// Queue of lines, see the [module](self).
pub(super) struct Queue {
    batches: VecDeque<Batch>,
    /// The queued load, including the batch being handed to the sink.
    load: Load,
    /// Empty batch, kept to reuse its allocation.
    spare: Vec<Entry>,
    next: u64,
    pub(super) wall_offset_nanos: i64,
    /// Number of lines that the sink had accepted when that number last changed, and the time of the change, while too much is queued.
    stalled: Option<(u64, Instant)>,
    /// Reason for which no more lines are accepted.
    pub(super) ended: Option<Ended>,
}

/// Reason for which a journal ended before the run.
#[derive(Debug)]
pub(super) struct Ended {
    pub(super) message: String,
    pub(super) is_reported: bool,
}

impl Queue {
    pub(super) fn new(wall_offset_nanos: i64) -> Self {
        Self {
            batches: VecDeque::new(),
            load: Load::default(),
            spare: Vec::new(),
            // The first line is written last, by `begin`.
            next: 2,
            wall_offset_nanos,
            stalled: None,
            ended: None,
        }
    }

    /// Puts the first line in its place.
    pub(super) fn begin(&mut self, time: MonotonicTime, event: Event, bytes: usize) {
        let load = Load { lines: 1, bytes };
        if self.batches.is_empty() {
            self.batches.push_back(Batch::default());
        }
        if let Some(first) = self.batches.front_mut() {
            first.lines.insert(0, Entry { number: 1, time, event });
            first.load.add(load);
            self.load.add(load);
        }
    }

    /// Adds a line. Returns its number, and whether that fills a batch.
    pub(super) fn push(&mut self, time: MonotonicTime, event: Event, bytes: usize) -> (u64, bool) {
        let number = self.next;
        self.next += 1;
        let load = Load { lines: 1, bytes };
        self.load.add(load);
        let entry = Entry { number, time, event };
        if let Some(last) = self.batches.back_mut().filter(|last| !last.load.fills(BATCH)) {
            last.lines.push(entry);
            last.load.add(load);
            return (number, last.load.fills(BATCH));
        }
        let mut lines = std::mem::take(&mut self.spare);
        lines.push(entry);
        self.batches.push_back(Batch { lines, load });
        (number, load.fills(BATCH))
    }

    pub(super) fn is_full(&self) -> bool {
        self.load.fills(CAPACITY)
    }

    pub(super) fn is_empty(&self) -> bool {
        self.load.lines == 0
    }

    pub(super) fn has_batch(&self) -> bool {
        self.batches.front().is_some_and(|first| first.load.fills(BATCH))
    }

    /// The next batch for the sink.
    pub(super) fn take(&mut self) -> Option<Batch> {
        self.batches.pop_front()
    }

    /// The sink has taken it.
    pub(super) fn handed_over(&mut self, batch: Batch) {
        self.load.take(batch.load);
        self.spare = batch.lines;
    }

    /// Ends the journal if its sink, which has taken `taken` lines, hangs or is so slow that too much is queued.
    /// Returns whether it has ended now. It is reported later: a logger may block for as long as the sink does.
    #[cold]
    pub(super) fn judge(&mut self, accepted: u64) -> bool {
        if self.ended.is_some() {
            return false;
        }
        if !self.is_full() {
            self.stalled = None;
            return false;
        }
        let now = Instant::now();
        let (seen, since) = *self.stalled.get_or_insert((accepted, now));
        if seen != accepted {
            self.stalled = Some((accepted, now));
        }
        let why = match (seen == accepted && now.duration_since(since) >= LONGEST_WAIT, self.load.fills(MOST)) {
            (true, _) => "hangs",
            (false, true) => "is too slow",
            (false, false) => return false,
        };
        let message = format!("its sink {why}, and it ends before line {}", self.next);
        self.ended = Some(Ended { message, is_reported: false });
        true
    }

    #[cfg(test)]
    pub(super) fn load(&self) -> Load {
        self.load
    }
}
