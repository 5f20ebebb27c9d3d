//! Requirements on every source of real time, and the behaviour of wall time when the date is set.

use super::*;
use std::sync::atomic::AtomicBool;
use std::sync::{Condvar, Mutex};
use std::time::Duration;

/// The clock's time minus that of `Instant` since `zero`, in nanoseconds. Uses the attempt whose two reads of
/// `Instant`, before and after that of the clock, are closest together.
fn offset_to_instant(clock: &Clock, zero: Instant) -> i64 {
    let tries = (0..1000).map(|_| {
        let before = nanos_of(zero.elapsed());
        let read = clock.now().as_nanos();
        let after = nanos_of(zero.elapsed());
        (after - before, read - before / 2 - after / 2)
    });
    tries.min().map_or(0, |(_, offset)| offset)
}

#[test]
fn real_clocks_share_one_zero() {
    let first = Clock::real().now();
    let second = std::thread::spawn(|| Clock::real().now()).join().expect("it does not panic");
    assert!(second >= first);
    assert!(second.seconds_since(first) < 10.0);
}

#[test]
fn a_read_is_never_before_one_that_happened_before_it() {
    let clock = Clock::real();
    let (last, is_over) = (AtomicI64::new(i64::MIN), AtomicBool::new(false));
    let worst = std::thread::scope(|scope| {
        let read = || {
            let mut worst = 0;
            while !is_over.load(Ordering::Relaxed) {
                let before = last.load(Ordering::Acquire);
                let now = clock.now().as_nanos();
                worst = worst.max(before.saturating_sub(now));
                last.fetch_max(now, Ordering::AcqRel);
            }
            worst
        };
        let threads = [(); 4].map(|()| scope.spawn(read));
        std::thread::sleep(Duration::from_millis(500));
        is_over.store(true, Ordering::Relaxed);
        threads.into_iter().map(|thread| thread.join().expect("it does not panic")).max()
    });
    assert_eq!(worst, Some(0), "nanoseconds back");
}

#[test]
fn time_does_not_drift_from_the_clock_that_threads_wait_on() {
    let (clock, zero) = (Clock::real(), Instant::now());
    let first = offset_to_instant(&clock, zero);
    std::thread::sleep(Duration::from_secs(3));
    // A processor's counter calibrated at the start was off by one part in a million: 3 microseconds.
    let drift = offset_to_instant(&clock, zero) - first;
    assert!(drift.abs() < 1_000, "{drift} ns in 3 s");
}

#[test]
fn a_thread_that_waits_until_a_deadline_finds_that_it_has_come() {
    let clock = Clock::real();
    let (nothing, never) = (Mutex::new(()), Condvar::new());
    for millis in [1, 10, 50] {
        let deadline = clock.now() + Duration::from_millis(millis);
        let mut held = nothing.lock().expect("nobody panics with it");
        // Condition variables may wake spuriously.
        loop {
            let (back, result) =
                never.wait_timeout(held, deadline.duration_since(clock.now())).expect("nobody panics with it");
            held = back;
            if result.timed_out() {
                break;
            }
        }
        assert!(clock.now() >= deadline, "{millis} ms");
    }
}

#[test]
fn virtual_time_moves_only_forward_and_only_on_request() {
    let clock = Clock::virtual_at(MonotonicTime::from_nanos(5));
    let reader = clock.clone();
    clock.advance_to(MonotonicTime::from_nanos(9));
    clock.advance_to(MonotonicTime::from_nanos(7));
    assert_eq!(reader.now(), MonotonicTime::from_nanos(9));
}

#[test]
fn virtual_time_begins_on_a_fixed_date_and_stamps_that_are_dates_keep_it() {
    let seconds = |count: i64| MonotonicTime::from_nanos(count * 1_000_000_000);
    let clock = Clock::virtual_at(MonotonicTime::ZERO);
    assert_eq!(clock.wall_at(seconds(5)).as_unix_nanos(), 978_307_205_000_000_000);
    clock.start_at(seconds(90));
    assert_eq!(clock.wall_at(seconds(90)).as_unix_nanos(), 978_307_290_000_000_000, "it counts from its start");
    clock.start_at(seconds(1_700_000_000));
    assert_eq!(clock.wall_at(clock.now()).as_unix_nanos(), 1_700_000_000_000_000_000);
}

#[test]
fn a_new_real_clock_has_the_date_of_the_machine() {
    let clock = Clock::real();
    let wall = clock.wall_at(clock.now()).as_unix_nanos();
    assert!(wall.abs_diff(unix_nanos(SystemTime::now())) < 1_000_000_000);
    assert_eq!(clock.refresh_wall(), None, "nobody has set the date");
}

#[test]
fn wall_time_follows_when_the_date_is_set() {
    let clock = Clock::real();
    let reader = clock.clone();
    let (measured, now) = (clock.wall_offset_nanos(), clock.now());
    // As if the machine had booted with a date five years back, and then got the right one.
    let wrong = measured - 5 * 365 * 86_400_000_000_000;
    clock.wall_offset_nanos.store(wrong, Ordering::Relaxed);
    assert_eq!(reader.wall_at(now).as_unix_nanos(), now.as_nanos() + wrong);
    let refreshed = clock.refresh_wall().expect("it differs");
    assert!(refreshed.abs_diff(measured) < WALL_STEP_NANOS);
    assert_eq!(reader.wall_offset_nanos(), refreshed);
    assert_eq!(reader.wall_at(now).as_unix_nanos(), now.as_nanos() + refreshed);
    assert!(clock.now() >= now, "monotonic time knows nothing of it");
    assert_eq!(reader.refresh_wall(), None, "one caller gets the change");
}

#[test]
fn a_millisecond_is_not_yet_a_new_date() {
    let clock = Clock::real();
    let offset = clock.wall_offset_nanos();
    for noise in [-1_000_000, -1, 0, 1, 1_000_000] {
        assert_eq!(clock.follow_wall(offset + noise), None);
        assert_eq!(clock.wall_offset_nanos(), offset);
    }
    assert_eq!(clock.follow_wall(offset - 1_000_001), Some(offset - 1_000_001));
    assert_eq!(clock.follow_wall(i64::MIN), Some(i64::MIN), "no overflow");
    assert_eq!(clock.wall_at(MonotonicTime::from_nanos(-1)).as_unix_nanos(), i64::MIN);
}

#[test]
fn one_spoiled_pair_of_reads_does_not_move_the_offset() {
    let mut pairs = [(0, 100), (10, 50_000_110), (20, 121), (30, -70_000_000), (40, 139)].into_iter();
    assert_eq!(median_wall_offset(|| pairs.next().expect("five are read")), 100);
}

#[test]
fn a_date_before_1970_is_negative() {
    assert_eq!(unix_nanos(UNIX_EPOCH - Duration::from_nanos(7)), -7);
}

#[test]
fn a_virtual_clock_has_the_offset_that_it_is_given() {
    let clock = Clock::virtual_at(MonotonicTime::from_nanos(5));
    let reader = clock.clone();
    assert_eq!(reader.wall_at(clock.now()).as_unix_nanos(), Clock::VIRTUAL_ZERO.as_unix_nanos() + 5);
    clock.set_wall_offset_nanos(1_000);
    assert_eq!(reader.wall_offset_nanos(), 1_000);
    assert_eq!(reader.wall_at(clock.now()).as_unix_nanos(), 1_005);
    assert_eq!(clock.refresh_wall(), None);
    let real = Clock::real();
    let measured = real.wall_offset_nanos();
    real.set_wall_offset_nanos(0);
    assert_eq!(real.wall_offset_nanos(), measured, "a real one measures its own");
}
