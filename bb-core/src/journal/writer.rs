//! Numbers lines, and hands them to the sink on a separate thread.

use super::queue::{Ended, LONGEST_WAIT, Queue, Waiting, bytes_of};
use super::{Entry, Event};
use crate::fault::{discard, guarded, log_panic};
use crate::message::Payload;
use crate::time::MonotonicTime;
use std::fmt;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// The destination of lines. It is called on a thread that runs nothing else, in the order of the lines' numbers, and
/// dropped there after the last one.
pub type Sink = Arc<dyn Fn(Entry) + Send + Sync>;

/// Time between two checks by the thread, unless a full batch wakes it before.
const PERIOD: Duration = Duration::from_millis(2);

/// The writing end. Clones share the journal.
#[derive(Clone)]
pub(crate) struct Journal(Arc<Inner>);

struct Inner {
    state: Mutex<State>,
    /// `true` if outside producers have to wait: read without the lock.
    is_full: AtomicBool,
    /// Number of lines that the sink has accepted, to see whether it makes progress.
    accepted: AtomicU64,
    /// Number of panics of the sink.
    panics: AtomicU64,
    arrived: Condvar,
    room: Condvar,
}

struct State {
    queue: Queue,
    /// `None` once it has taken the last line.
    sink: Option<Sink>,
    /// A dedicated thread hands lines to the sink; otherwise the thread that flushes does.
    has_thread: bool,
    /// A thread hands lines to the sink.
    is_draining: bool,
    has_begun: bool,
    is_closed: bool,
    /// The sink has got the last line, and is gone.
    is_done: bool,
}

impl Journal {
    pub(crate) fn new(sink: Sink, wall_offset_nanos: i64) -> Self {
        let state = State {
            queue: Queue::new(wall_offset_nanos),
            sink: Some(sink),
            has_thread: false,
            is_draining: false,
            has_begun: false,
            is_closed: false,
            is_done: false,
        };
        Self(Arc::new(Inner {
            state: Mutex::new(state),
            is_full: AtomicBool::new(false),
            accepted: AtomicU64::new(0),
            panics: AtomicU64::new(0),
            arrived: Condvar::new(),
            room: Condvar::new(),
        }))
    }

    /// Puts the first line in its place, before those of components that acted during their creation. Nothing is
    /// handed to the sink before.
    pub(crate) fn begin(&self, time: MonotonicTime, event: Event) {
        let bytes = bytes_of(&event);
        let mut state = self.0.lock();
        state.queue.begin(time, event, bytes);
        state.has_begun = true;
    }

    /// Writes a line of an entry that sees this offset of the wall clock. Returns its number, or 0 if the journal has
    /// ended. Never waits for the sink.
    pub(crate) fn write(&self, time: MonotonicTime, wall_offset_nanos: i64, event: Event) -> u64 {
        let bytes = bytes_of(&event);
        let Some(mut state) = self.0.enter(time, wall_offset_nanos) else { return 0 };
        let number = state.queue.push(time, event, bytes);
        self.0.leave(state);
        number
    }

    /// Writes the line of a message of a publisher, as [`write`](Self::write) does, and takes the message unless the journal has
    /// ended. It does not allocate once as many messages have waited before.
    pub(crate) fn write_message<T: Payload>(
        &self,
        time: MonotonicTime,
        wall_offset_nanos: i64,
        publisher: usize,
        message: &mut Option<Waiting<T>>,
    ) -> u64 {
        let Some(mut state) = self.0.enter(time, wall_offset_nanos) else { return 0 };
        let number = state.queue.push_message(time, publisher, message);
        self.0.leave(state);
        number
    }

    /// Outside producers call this first. It waits while too many lines are queued for the sink.
    #[inline]
    pub(crate) fn wait_for_room(&self) {
        if self.0.is_full.load(Ordering::Relaxed) {
            self.0.wait_for_room();
        }
    }

    /// Hands queued lines to the sink on the calling thread, unless another thread does so already.
    pub(crate) fn flush(&self) {
        self.0.flush();
    }

    /// Starts the thread that hands lines to the sink until the journal is closed.
    pub(crate) fn start(&self) -> std::io::Result<()> {
        let inner = Arc::clone(&self.0);
        std::thread::Builder::new().name("journal".into()).spawn(move || inner.work())?;
        self.0.lock().has_thread = true;
        Ok(())
    }

    /// Takes no more lines.
    pub(crate) fn close(&self) {
        self.0.lock().is_closed = true;
        self.0.arrived.notify_all();
        self.0.room.notify_all();
    }

    /// Returns whether the journal ended before the run, because of its sink.
    pub(crate) fn has_ended(&self) -> bool {
        self.0.lock().queue.ended.is_some()
    }

    /// Number of panics of the sink.
    pub(crate) fn panics(&self) -> u64 {
        self.0.panics.load(Ordering::Relaxed)
    }

    /// Checks whether the sink hangs while no lines are written. Returns the error once; the journal has then ended.
    pub(crate) fn check(&self) -> Option<String> {
        let mut state = self.0.lock();
        self.0.judge(&mut state);
        let Ended { message, is_reported } = state.queue.ended.as_mut().filter(|ended| !ended.is_reported)?;
        *is_reported = true;
        Some(message.clone())
    }

    /// Waits, `longest` at most, until the sink of a closed journal has the last line and is gone. Returns false if
    /// it does not have the last line. A journal without its own thread hands it over here.
    pub(crate) fn hand_over(&self, longest: Duration) -> bool {
        if !self.0.lock().has_thread {
            self.0.flush();
            self.0.finish();
        }
        let deadline = Instant::now() + longest;
        let mut state = self.0.lock();
        loop {
            if state.is_done || state.queue.ended.is_some() {
                return state.queue.ended.is_none();
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return false;
            }
            state = self.0.room.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

impl Inner {
    /// Takes the lock for one more line, unless the journal has ended.
    #[inline]
    fn enter(&self, time: MonotonicTime, wall_offset_nanos: i64) -> Option<MutexGuard<'_, State>> {
        let mut state = self.lock();
        if state.queue.is_full() {
            self.judge(&mut state);
        }
        if state.is_closed || state.queue.ended.is_some() {
            return None;
        }
        if state.queue.wall_offset_nanos != wall_offset_nanos {
            state.queue.wall_offset_nanos = wall_offset_nanos;
            let line = Event::WallClock { offset_nanos: wall_offset_nanos };
            let bytes = bytes_of(&line);
            state.queue.push(time, line, bytes);
        }
        Some(state)
    }

    /// Releases the lock after a line.
    #[inline]
    fn leave(&self, state: MutexGuard<'_, State>) {
        if state.queue.is_full() {
            self.is_full.store(true, Ordering::Relaxed);
        }
        let fills_batch = state.queue.fills_batch();
        drop(state);
        if fills_batch {
            self.arrived.notify_one();
        }
    }

    fn work(&self) {
        loop {
            let state = self.lock();
            if state.is_closed && state.queue.is_empty() {
                break;
            }
            if state.is_closed || state.queue.has_batch() {
                drop(state);
            } else {
                drop(self.arrived.wait_timeout(state, PERIOD));
            }
            self.flush();
        }
        self.finish();
    }

    /// Hands over waiting lines. The sink is user code; only its own thread waits for it.
    fn flush(&self) {
        let mut state = self.lock();
        if state.is_draining || !state.has_begun {
            return;
        }
        let Some(sink) = state.sink.clone() else { return };
        state.is_draining = true;
        while let Some(mut batch) = state.queue.take() {
            drop(state);
            for line in batch.drain() {
                if let Err(fault) = guarded(|| sink(line)) {
                    self.panics.fetch_add(1, Ordering::Relaxed);
                    log_panic("the journal's sink failed", &fault);
                }
                // Only one thread at a time gets here: a plain store instead of an atomic addition.
                self.accepted.store(self.accepted.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
            }
            state = self.lock();
            state.queue.handed_over(batch);
            self.is_full.store(state.queue.is_full(), Ordering::Relaxed);
            self.room.notify_all();
        }
        state.is_draining = false;
    }

    /// Drops the sink after the last line: resources that it owns, such as a file, are closed here.
    fn finish(&self) {
        let sink = self.lock().sink.take();
        discard(sink);
        self.lock().is_done = true;
        self.room.notify_all();
    }

    #[cold]
    fn wait_for_room(&self) {
        let deadline = Instant::now() + LONGEST_WAIT;
        let mut state = self.lock();
        loop {
            self.judge(&mut state);
            let left = deadline.saturating_duration_since(Instant::now());
            if !state.queue.is_full() || state.queue.ended.is_some() || state.is_closed || left.is_zero() {
                return;
            }
            state = self.room.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    fn judge(&self, state: &mut State) {
        if state.queue.judge(self.accepted.load(Ordering::Relaxed)) {
            self.is_full.store(false, Ordering::Relaxed);
            self.room.notify_all();
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl fmt::Debug for Journal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Journal").field("is_full", &self.0.is_full).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::super::Recorded;
    use super::super::queue::{BATCH, CAPACITY, MOST};
    use super::*;
    use crate::message::Stamped;
    use std::sync::atomic::AtomicUsize;

    #[test]
    fn lines_arrive_in_order_from_many_threads_and_a_changed_wall_clock_is_a_line() {
        let lines: Arc<Mutex<Vec<Entry>>> = Arc::default();
        let sink = Arc::clone(&lines);
        let journal = Journal::new(Arc::new(move |line| sink.lock().expect("no panic").push(line)), 5);
        journal.write(MonotonicTime::ZERO, 5, Event::Start { island: 0 });
        journal.flush();
        journal.begin(MonotonicTime::ZERO, Event::ArmTimeout);
        journal.start().expect("a thread");
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    (0..10_000).for_each(|_| {
                        journal.write(MonotonicTime::ZERO, 5, Event::ArmTimeout);
                    })
                });
            }
        });
        journal.write(MonotonicTime::ZERO, 6, Event::Retire { island: 0 });
        journal.close();
        assert!(journal.hand_over(Duration::from_secs(10)));
        assert_eq!(journal.write(MonotonicTime::ZERO, 6, Event::Retire { island: 0 }), 0, "closed");
        let lines = lines.lock().expect("no panic");
        assert_eq!(lines.len(), 40_004);
        assert!(
            matches!((&lines[0].event, &lines[1].event), (Event::ArmTimeout, Event::Start { .. })),
            "it begins first"
        );
        assert!(lines.iter().zip(1..).all(|(line, number)| line.number == number));
        assert!(matches!(lines[40_002].event, Event::WallClock { offset_nanos: 6 }));
    }

    #[derive(Clone, Debug, Payload)]
    struct Number(u64);

    #[derive(Clone, Debug, Payload)]
    struct Text(String);

    #[test]
    fn messages_of_several_payloads_keep_their_order_and_their_batches_are_used_again() {
        let lines: Arc<Mutex<Vec<Entry>>> = Arc::default();
        let sink = Arc::clone(&lines);
        let journal = Journal::new(Arc::new(move |line| sink.lock().expect("no panic").push(line)), 0);
        journal.begin(MonotonicTime::ZERO, Event::ArmTimeout);
        fn write<T: Payload>(journal: &Journal, path: &'static str, payload: T) -> u64 {
            let message = Stamped::new(MonotonicTime::ZERO, payload);
            let mut waiting = Some(Waiting::new(path, message));
            let line = journal.write_message(MonotonicTime::ZERO, 0, 7, &mut waiting);
            assert_eq!(waiting.is_some(), line == 0, "it is taken if it is written");
            line
        }
        let count = 3 * BATCH.lines as u64;
        for value in 0..count {
            match value % 3 {
                0 => write(&journal, "a", Number(value)),
                1 => write(&journal, "b", Text(value.to_string())),
                _ => journal.write(MonotonicTime::ZERO, 0, Event::Retire { island: value as usize }),
            };
            if value % 1_000 == 0 {
                journal.flush();
            }
        }
        journal.close();
        assert_eq!(write(&journal, "a", Number(0)), 0, "closed");
        assert!(journal.hand_over(Duration::from_secs(10)));
        let lines = lines.lock().expect("no panic");
        assert!(lines.iter().zip(1..).all(|(line, number)| line.number == number));
        let values = lines.iter().skip(1).map(|line| match &line.event {
            Event::Message { publisher: 7, message: Recorded::Message(message) } => match message.path() {
                "a" => message.downcast::<Number>().expect("a number").0,
                _ => message.downcast::<Text>().expect("text").0.parse().expect("a number"),
            },
            Event::Retire { island } => *island as u64,
            other => panic!("{other:?}"),
        });
        assert!(values.eq(0..count));
    }

    /// A journal whose sink hangs at the first line, until the returned sender is dropped.
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
        journal.begin(MonotonicTime::ZERO, Event::ArmTimeout);
        journal.start().expect("a thread");
        journal.write(MonotonicTime::ZERO, 0, Event::ArmTimeout);
        while count.load(Ordering::SeqCst) == 0 {
            std::thread::yield_now();
        }
        (journal, release)
    }

    /// Writes this many lines. Returns how many were accepted.
    fn fill(journal: &Journal, lines: usize) -> usize {
        (0..lines).filter(|_| journal.write(MonotonicTime::ZERO, 0, Event::ArmTimeout) > 0).count()
    }

    #[test]
    fn a_sink_that_hangs_ends_the_journal_without_a_gap() {
        let (journal, _release) = hanging();
        for _ in 0..=CAPACITY.lines {
            journal.wait_for_room();
            journal.write(MonotonicTime::ZERO, 0, Event::ArmTimeout);
        }
        assert!(journal.check().is_some_and(|message| message.starts_with("its sink hangs")));
        assert_eq!(journal.check(), None, "it is said once");
        assert_eq!(journal.write(MonotonicTime::ZERO, 0, Event::Retire { island: 0 }), 0);
    }

    #[test]
    fn the_journal_of_a_sink_that_hangs_ends_and_its_memory_is_bounded() {
        let (journal, _release) = hanging();
        // Nobody here waits for room.
        let written = fill(&journal, 2 * MOST.lines);
        assert!(written <= MOST.lines, "{written}");
        assert!(journal.check().is_some_and(|message| message.contains("it ends before line")));
    }

    #[test]
    fn a_sink_that_hangs_is_noticed_when_nobody_writes() {
        let (journal, _release) = hanging();
        fill(&journal, CAPACITY.lines + 2);
        let start = Instant::now();
        while journal.check().is_none() {
            assert!(start.elapsed() < Duration::from_secs(20));
            std::thread::sleep(Duration::from_millis(10));
        }
        assert!(start.elapsed() + Duration::from_millis(100) > LONGEST_WAIT);
    }

    #[test]
    fn a_sink_that_is_slow_does_not_end_the_journal_as_long_as_it_goes_on() {
        let (journal, release) = hanging();
        fill(&journal, CAPACITY.lines + BATCH.lines);
        assert!(journal.0.lock().queue.load().lines >= CAPACITY.lines);
        let start = Instant::now();
        while start.elapsed() < LONGEST_WAIT + Duration::from_secs(1) {
            release.send(()).expect("the sink is there");
            std::thread::sleep(Duration::from_millis(100));
            assert_eq!(journal.check(), None);
        }
    }

    /// A line of this many bytes.
    fn large(bytes: usize) -> Event {
        Event::Noted { path: "large", message: "x".repeat(bytes) }
    }

    #[test]
    fn large_lines_are_bounded_by_their_bytes() {
        const LARGE: usize = 4 << 20;
        let (journal, release) = hanging();
        // None of these writes waits for room. The text is not copied.
        let written = (0..1000).filter(|_| journal.write(MonotonicTime::ZERO, 0, large(LARGE)) > 0).count();
        assert_eq!(written, MOST.bytes / LARGE, "the line beyond is refused");
        assert!(journal.check().is_some_and(|message| message.starts_with("its sink is too slow")));
        drop(release);
    }

    #[test]
    fn an_outside_producer_waits_while_large_lines_wait_and_one_that_is_larger_than_all_is_accepted() {
        let (journal, release) = hanging();
        journal.write(MonotonicTime::ZERO, 0, large(CAPACITY.bytes));
        let start = Instant::now();
        std::thread::scope(|scope| {
            scope.spawn(|| {
                std::thread::sleep(Duration::from_millis(300));
                // The sink takes the queued lines and stops hanging.
                drop(release);
            });
            journal.wait_for_room();
        });
        assert!(start.elapsed() >= Duration::from_millis(300), "it has waited for the sink");
        assert!(journal.write(MonotonicTime::ZERO, 0, large(2 * MOST.bytes)) > 0);
        journal.close();
        assert!(journal.hand_over(Duration::from_secs(20)));
    }

    /// The last line written is the first at which the sink hangs.
    #[test]
    fn a_sink_that_hangs_at_the_last_line_keeps_nobody_who_hands_it_over() {
        let (release, hang) = std::sync::mpsc::channel::<()>();
        let hang = Mutex::new(hang);
        let sink = move |line: Entry| {
            if matches!(line.event, Event::Retire { .. }) {
                let _ = hang.lock().map(|hang| hang.recv());
            }
        };
        let journal = Journal::new(Arc::new(sink), 0);
        journal.begin(MonotonicTime::ZERO, Event::ArmTimeout);
        journal.start().expect("a thread");
        journal.write(MonotonicTime::ZERO, 0, Event::Retire { island: 0 });
        journal.close();
        let (done, ended) = std::sync::mpsc::channel();
        let handed = journal.clone();
        std::thread::spawn(move || done.send(handed.hand_over(Duration::from_millis(100))));
        assert_eq!(ended.recv_timeout(Duration::from_secs(20)), Ok(false));
        drop(release);
        assert!(journal.hand_over(Duration::from_secs(20)), "it went on");
    }

    #[test]
    fn what_a_sink_owns_is_closed_after_the_last_line_though_the_journal_is_still_held() {
        struct File(Arc<AtomicUsize>);
        impl Drop for File {
            fn drop(&mut self) {
                self.0.fetch_add(1, Ordering::SeqCst);
            }
        }
        for has_thread in [false, true] {
            let closed = Arc::new(AtomicUsize::new(0));
            let file = File(Arc::clone(&closed));
            let journal = Journal::new(
                Arc::new(move |_| {
                    let _ = &file;
                }),
                0,
            );
            journal.begin(MonotonicTime::ZERO, Event::ArmTimeout);
            if has_thread {
                journal.start().expect("a thread");
            }
            journal.close();
            assert!(journal.hand_over(Duration::from_secs(20)));
            assert_eq!(closed.load(Ordering::SeqCst), 1);
        }
    }
}
