//! Lines waiting for the sink, and their limits. Messages of publishers wait in a column of their payload, whose memory is used again:
//! the thread that hands lines over, and not the publisher, allocates what the sink may share.

use super::{Entry, Event, Recorded};
use crate::message::{Field as _, Payload, Stamped};
use crate::pubsub::DynamicMessage;
use crate::time::MonotonicTime;
use std::any::Any;
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// The load at which outside producers start to wait for the sink.
pub(super) const CAPACITY: Load = Load { lines: 1 << 16, bytes: 64 << 20 };

/// The load at which the journal ends. Estimators and the control state do not wait for the sink. One line beyond it
/// is accepted, however large.
pub(super) const MOST: Load = Load { lines: 4 * CAPACITY.lines, bytes: 4 * CAPACITY.bytes };

/// The load of one batch for the sink, which wakes its thread: a wake-up takes as long as some hundred lines.
pub(super) const BATCH: Load = Load { lines: 1 << 12, bytes: 1 << 20 };

/// The most empty batches that are kept to use their memory again.
const SPARES: usize = 3;

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
    size_of::<Line>().saturating_add(event.heap_bytes())
}

/// A line that waits.
struct Line {
    number: u64,
    time: MonotonicTime,
    content: Content,
}

enum Content {
    Event(Event),
    /// The next message of that column.
    Message {
        publisher: usize,
        column: usize,
    },
}

/// A message that waits, of a publisher at a path.
pub(crate) struct Waiting<T> {
    path: &'static str,
    message: Stamped<T>,
    bytes: usize,
}

impl<T: Payload> Waiting<T> {
    pub(crate) fn new(path: &'static str, message: Stamped<T>) -> Self {
        Self { path, bytes: DynamicMessage::bytes_of(&message), message }
    }
}

/// The waiting messages of one payload, in the order of their lines.
trait Column: Any + Send {
    fn next(&mut self) -> Option<DynamicMessage>;
}

impl<T: Payload> Column for VecDeque<Waiting<T>> {
    fn next(&mut self) -> Option<DynamicMessage> {
        let Waiting { path, message, bytes } = self.pop_front()?;
        Some(DynamicMessage::sized(path, message, bytes))
    }
}

/// Lines handed to the sink together.
#[derive(Default)]
pub(super) struct Batch {
    lines: Vec<Line>,
    /// One for each payload.
    columns: Vec<Box<dyn Column>>,
    load: Load,
}

impl Batch {
    /// Adds a message. Returns what its line says of it.
    fn keep<T: Payload>(&mut self, publisher: usize, waiting: &mut Option<Waiting<T>>) -> Content {
        for (column, messages) in self.columns.iter_mut().enumerate() {
            if let Some(messages) = (&mut **messages as &mut dyn Any).downcast_mut::<VecDeque<Waiting<T>>>() {
                messages.extend(waiting.take());
                return Content::Message { publisher, column };
            }
        }
        self.columns.push(Box::new(VecDeque::from_iter(waiting.take())));
        Content::Message { publisher, column: self.columns.len() - 1 }
    }

    /// Takes all lines, in order.
    pub(super) fn drain(&mut self) -> impl Iterator<Item = Entry> {
        let Self { lines, columns, .. } = self;
        lines.drain(..).filter_map(|Line { number, time, content }| {
            let event = match content {
                Content::Event(event) => event,
                Content::Message { publisher, column } => {
                    Event::Message { publisher, message: Recorded::Message(columns.get_mut(column)?.next()?) }
                }
            };
            Some(Entry { number, time, event })
        })
    }
}

/// Queue of lines, see the [module](self).
pub(super) struct Queue {
    batches: VecDeque<Batch>,
    /// The queued load, including the batch being handed to the sink.
    load: Load,
    /// Empty batches.
    spares: Vec<Batch>,
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
            spares: Vec::new(),
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
            first.lines.insert(0, Line { number: 1, time, content: Content::Event(event) });
            first.load.add(load);
            self.load.add(load);
        }
    }

    /// Adds a line. Returns its number.
    #[inline]
    pub(super) fn push(&mut self, time: MonotonicTime, event: Event, bytes: usize) -> u64 {
        self.add(time, bytes, |_| Content::Event(event))
    }

    /// Adds the line of a message, which is taken.
    pub(super) fn push_message<T: Payload>(
        &mut self,
        time: MonotonicTime,
        publisher: usize,
        waiting: &mut Option<Waiting<T>>,
    ) -> u64 {
        let bytes = waiting.as_ref().map_or(0, |waiting| waiting.bytes);
        self.add(time, size_of::<Line>().saturating_add(bytes), |batch| batch.keep(publisher, waiting))
    }

    #[inline]
    fn add(&mut self, time: MonotonicTime, bytes: usize, content: impl FnOnce(&mut Batch) -> Content) -> u64 {
        let number = self.next;
        self.next += 1;
        let load = Load { lines: 1, bytes };
        self.load.add(load);
        if self.batches.back().is_none_or(|last| last.load.fills(BATCH)) {
            self.batches.push_back(self.spares.pop().unwrap_or_default());
        }
        if let Some(last) = self.batches.back_mut() {
            let content = content(last);
            last.lines.push(Line { number, time, content });
            last.load.add(load);
        }
        number
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

    /// Returns whether the last line has filled a batch.
    pub(super) fn fills_batch(&self) -> bool {
        self.batches.back().is_some_and(|last| last.load.fills(BATCH))
    }

    /// The next batch for the sink.
    pub(super) fn take(&mut self) -> Option<Batch> {
        self.batches.pop_front()
    }

    /// The sink has taken it.
    pub(super) fn handed_over(&mut self, mut batch: Batch) {
        self.load.take(batch.load);
        batch.load = Load::default();
        if self.spares.len() < SPARES {
            self.spares.push(batch);
        }
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
