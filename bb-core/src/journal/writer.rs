//! Numbers lines, and hands them to the sink on a thread of its own.

use super::{Entry, Event};
use crate::fault::guarded;
use crate::time::MonotonicTime;
use std::fmt;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Where lines go. It is called on a thread that runs nothing else, in the order of the lines' numbers.
pub type Sink = Arc<dyn Fn(Entry) + Send + Sync>;

/// Lines that wait for the sink before outside producers have to wait for it.
const CAPACITY: usize = 1 << 16;

/// How many lines wake the thread before its time.
const BATCH: usize = 1 << 10;

/// How often the thread looks.
const PERIOD: Duration = Duration::from_millis(2);

/// The most lines that wait, from any writer. Estimators and the control state do not wait for the sink.
const MOST: usize = 4 * CAPACITY;

/// How long outside producers wait for a sink that is too slow. One that takes no line for so long while [`CAPACITY`] wait
/// hangs. Then the journal ends there: it never has a gap.
const LONGEST_WAIT: Duration = Duration::from_secs(2);

/// The writing end. Clones are the same journal.
#[derive(Clone)]
pub(crate) struct Journal(Arc<Inner>);

struct Inner {
    queue: Mutex<Queue>,
    /// How many lines wait: read without the lock.
    waiting: AtomicUsize,
    /// How many lines the sink has taken: whether it goes on is seen by it.
    taken: AtomicU64,
    arrived: Condvar,
    room: Condvar,
    sink: Sink,
}

struct Queue {
    lines: Vec<Entry>,
    /// Its room is used again.
    spare: Vec<Entry>,
    next: u64,
    wall_offset_nanos: i64,
    /// A thread hands lines to the sink.
    is_draining: bool,
    has_begun: bool,
    is_closed: bool,
    /// While too many lines wait: how many the sink had taken when that was last seen to change, and when.
    stalled: Option<(u64, Instant)>,
    /// Why no more lines are taken: the sink hung.
    ended: Option<Ended>,
}

/// How a journal ended before the run.
#[derive(Debug)]
struct Ended {
    message: String,
    is_reported: bool,
}

impl Journal {
    pub(crate) fn new(sink: Sink, wall_offset_nanos: i64) -> Self {
        let queue = Queue {
            lines: Vec::new(),
            spare: Vec::new(),
            // The first line is written last, by `begin`.
            next: 2,
            wall_offset_nanos,
            is_draining: false,
            has_begun: false,
            is_closed: false,
            stalled: None,
            ended: None,
        };
        Self(Arc::new(Inner {
            queue: Mutex::new(queue),
            waiting: AtomicUsize::new(0),
            taken: AtomicU64::new(0),
            arrived: Condvar::new(),
            room: Condvar::new(),
            sink,
        }))
    }

    /// Puts the first line in its place, before those of components that did something as they were made. Nothing is handed to
    /// the sink before.
    pub(crate) fn begin(&self, time: MonotonicTime, event: Event) {
        let mut queue = self.0.lock();
        queue.lines.insert(0, Entry { number: 1, time, event });
        queue.has_begun = true;
    }

    /// Writes a line of an entry that sees this offset of the wall clock; its number, or 0 if the journal has ended. Never
    /// waits for the sink.
    pub(crate) fn write(&self, time: MonotonicTime, wall_offset_nanos: i64, event: Event) -> u64 {
        let mut queue = self.0.lock();
        if queue.lines.len() >= CAPACITY {
            self.0.judge(&mut queue);
        }
        if queue.is_closed || queue.ended.is_some() {
            return 0;
        }
        if queue.wall_offset_nanos != wall_offset_nanos {
            queue.wall_offset_nanos = wall_offset_nanos;
            queue.push(time, Event::WallClock { offset_nanos: wall_offset_nanos });
        }
        let number = queue.push(time, event);
        let waiting = queue.lines.len();
        drop(queue);
        self.0.waiting.store(waiting, Ordering::Relaxed);
        if waiting == BATCH {
            self.0.arrived.notify_one();
        }
        number
    }

    /// Outside producers call this before they begin: it waits while the sink is too far behind.
    #[inline]
    pub(crate) fn wait_for_room(&self) {
        if self.0.waiting.load(Ordering::Relaxed) >= CAPACITY {
            self.0.wait_for_room();
        }
    }

    /// Hands what waits to the sink on the calling thread, unless another thread does so already.
    pub(crate) fn flush(&self) {
        self.0.flush();
    }

    /// Starts the thread that hands lines to the sink until the journal is closed.
    pub(crate) fn start(&self) -> std::io::Result<()> {
        let inner = Arc::clone(&self.0);
        std::thread::Builder::new().name("journal".into()).spawn(move || inner.work()).map(drop)
    }

    /// Takes no more lines.
    pub(crate) fn close(&self) {
        self.0.lock().is_closed = true;
        self.0.arrived.notify_all();
        self.0.room.notify_all();
    }

    /// Whether its sink hung, so that it ends before the run.
    pub(crate) fn has_ended(&self) -> bool {
        self.0.lock().ended.is_some()
    }

    /// Looks whether the sink hangs while nobody writes. What is wrong, once; then the journal has ended.
    pub(crate) fn look(&self) -> Option<String> {
        let mut queue = self.0.lock();
        self.0.judge(&mut queue);
        let ended = queue.ended.as_mut().filter(|ended| !ended.is_reported)?;
        ended.is_reported = true;
        Some(ended.message.clone())
    }

    /// Waits until the sink has what was written, `longest` at most; false if it does not.
    pub(crate) fn hand_over(&self, longest: Duration) -> bool {
        let deadline = Instant::now() + longest;
        loop {
            self.0.flush();
            let queue = self.0.lock();
            if queue.ended.is_some() || (queue.lines.is_empty() && !queue.is_draining) {
                return queue.ended.is_none();
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return false;
            }
            drop(self.0.room.wait_timeout(queue, left));
        }
    }
}

impl Queue {
    fn push(&mut self, time: MonotonicTime, event: Event) -> u64 {
        let number = self.next;
        self.next += 1;
        self.lines.push(Entry { number, time, event });
        number
    }
}

impl Inner {
    fn work(&self) {
        loop {
            let queue = self.lock();
            if queue.is_closed {
                return;
            }
            if queue.lines.len() < BATCH {
                drop(self.arrived.wait_timeout(queue, PERIOD));
            } else {
                drop(queue);
            }
            self.flush();
        }
    }

    fn flush(&self) {
        let mut queue = self.lock();
        if queue.is_draining || !queue.has_begun {
            return;
        }
        while !queue.lines.is_empty() {
            queue.is_draining = true;
            let spare = std::mem::take(&mut queue.spare);
            let mut lines = std::mem::replace(&mut queue.lines, spare);
            self.waiting.store(0, Ordering::Relaxed);
            drop(queue);
            for line in lines.drain(..) {
                if let Err(fault) = guarded(|| (self.sink)(line)) {
                    tracing::error!(%fault, "the journal's sink failed");
                }
                // One thread at a time is here: a plain store instead of an atomic addition.
                self.taken.store(self.taken.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
            }
            queue = self.lock();
            queue.spare = lines;
        }
        queue.is_draining = false;
        drop(queue);
        self.room.notify_all();
    }

    #[cold]
    fn wait_for_room(&self) {
        let deadline = Instant::now() + LONGEST_WAIT;
        let mut queue = self.lock();
        loop {
            self.judge(&mut queue);
            let left = deadline.saturating_duration_since(Instant::now());
            if queue.lines.len() < CAPACITY || queue.ended.is_some() || queue.is_closed || left.is_zero() {
                return;
            }
            queue = self.room.wait_timeout(queue, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Ends the journal if its sink hangs, or is so slow that too many lines wait. It is reported by [`Journal::look`]: a
    /// logger may block for as long as the sink does.
    #[cold]
    fn judge(&self, queue: &mut Queue) {
        if queue.ended.is_some() {
            return;
        }
        if queue.lines.len() < CAPACITY {
            queue.stalled = None;
            return;
        }
        let (taken, now) = (self.taken.load(Ordering::Relaxed), Instant::now());
        let (_, since) = *queue.stalled.get_or_insert((taken, now));
        let why = if queue.stalled.is_some_and(|(seen, _)| seen != taken) {
            queue.stalled = Some((taken, now));
            None
        } else if now.duration_since(since) >= LONGEST_WAIT {
            Some("hangs")
        } else {
            None
        };
        let why = why.or((queue.lines.len() >= MOST).then_some("is too slow"));
        if let Some(why) = why {
            let line = queue.next;
            let message = format!("its sink {why}, and it ends before line {line}");
            queue.ended = Some(Ended { message, is_reported: false });
            self.room.notify_all();
        }
    }

    fn lock(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl fmt::Debug for Journal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Journal").field("waiting", &self.0.waiting).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_arrive_in_order_from_many_threads_and_a_changed_wall_clock_is_a_line() {
        let lines: Arc<Mutex<Vec<Entry>>> = Arc::default();
        let sink = Arc::clone(&lines);
        let journal = Journal::new(Arc::new(move |line| sink.lock().expect("no panic").push(line)), 5);
        journal.write(MonotonicTime::ZERO, 5, Event::Disarm { force: false });
        journal.flush();
        journal.begin(MonotonicTime::ZERO, Event::Arm);
        journal.start().expect("a thread");
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    (0..10_000).for_each(|_| {
                        journal.write(MonotonicTime::ZERO, 5, Event::Arm);
                    })
                });
            }
        });
        journal.write(MonotonicTime::ZERO, 6, Event::Stop);
        journal.close();
        assert!(journal.hand_over(Duration::from_secs(10)));
        assert_eq!(journal.write(MonotonicTime::ZERO, 6, Event::Stop), 0, "closed");
        let lines = lines.lock().expect("no panic");
        assert_eq!(lines.len(), 40_004);
        assert!(
            matches!((&lines[0].event, &lines[1].event), (Event::Arm, Event::Disarm { .. })),
            "it begins first"
        );
        assert!(lines.iter().zip(1..).all(|(line, number)| line.number == number));
        assert!(matches!(lines[40_002].event, Event::WallClock { offset_nanos: 6 }));
    }

    /// A journal whose sink hangs at the first line, until what is returned beside it is dropped.
    fn hanging() -> (Journal, std::sync::mpsc::Sender<()>) {
        let (release, hang) = std::sync::mpsc::channel::<()>();
        let hang = Mutex::new(hang);
        let count = Arc::new(AtomicUsize::new(0));
        let counted = Arc::clone(&count);
        let sink = move |_| {
            counted.fetch_add(1, Ordering::SeqCst);
            let _ = hang.lock().map(|hang| hang.recv());
        };
        let journal = Journal::new(Arc::new(sink), 0);
        journal.begin(MonotonicTime::ZERO, Event::Arm);
        journal.start().expect("a thread");
        journal.write(MonotonicTime::ZERO, 0, Event::Arm);
        while count.load(Ordering::SeqCst) == 0 {
            std::thread::yield_now();
        }
        (journal, release)
    }

    /// Writes so many lines; how many were taken.
    fn fill(journal: &Journal, lines: usize) -> usize {
        (0..lines).filter(|_| journal.write(MonotonicTime::ZERO, 0, Event::Arm) > 0).count()
    }

    #[test]
    fn a_sink_that_hangs_ends_the_journal_without_a_gap() {
        let (journal, _release) = hanging();
        for _ in 0..=CAPACITY {
            journal.wait_for_room();
            journal.write(MonotonicTime::ZERO, 0, Event::Arm);
        }
        assert!(journal.look().is_some_and(|message| message.starts_with("its sink hangs")));
        assert_eq!(journal.look(), None, "it is said once");
        assert_eq!(journal.write(MonotonicTime::ZERO, 0, Event::Stop), 0);
    }

    #[test]
    fn whoever_writes_the_journal_of_a_sink_that_hangs_ends_and_its_memory_is_bounded() {
        let (journal, _release) = hanging();
        // Nobody here waits for room.
        let written = fill(&journal, 2 * MOST);
        assert!(written <= MOST, "{written}");
        assert!(journal.look().is_some_and(|message| message.contains("it ends before line")));
    }

    #[test]
    fn a_sink_that_hangs_is_noticed_when_nobody_writes() {
        let (journal, _release) = hanging();
        fill(&journal, CAPACITY + 2);
        let start = Instant::now();
        while journal.look().is_none() {
            assert!(start.elapsed() < Duration::from_secs(20));
            std::thread::sleep(Duration::from_millis(10));
        }
        assert!(start.elapsed() + Duration::from_millis(100) > LONGEST_WAIT);
    }

    #[test]
    fn a_sink_that_is_slow_does_not_end_the_journal_as_long_as_it_goes_on() {
        let (journal, release) = hanging();
        fill(&journal, CAPACITY + BATCH);
        assert!(journal.0.lock().lines.len() >= CAPACITY);
        let start = Instant::now();
        while start.elapsed() < LONGEST_WAIT + Duration::from_secs(1) {
            release.send(()).expect("the sink is there");
            std::thread::sleep(Duration::from_millis(100));
            assert_eq!(journal.look(), None);
        }
    }
}
