//! The timekeeper's thread of a real run: it wakes what is due, watches what is overdue, and runs no user code.

use super::machine::Machine;
use crate::control::Hanging;
use crate::journal::Journal;
use crate::time::MonotonicTime;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// The longest sleep.
const LONGEST_WAIT: Duration = Duration::from_millis(200);

/// Period at which the wall clock is read again.
const WALL_PERIOD: Duration = Duration::from_secs(1);

/// Period at which islands are checked.
const CHECK_PERIOD: Duration = Duration::from_millis(100);

/// A callback that has not returned for this long hangs.
const HANGS_AFTER: Duration = Duration::from_secs(1);

/// Time after which a command hangs, which may block its thread, and a sensor or a service without a rate, which may wait for its
/// device. Equal to the time that a stopping robot waits for it.
const WAITS_TOO_LONG: Duration = Duration::from_secs(5);

/// An island's state at the last check.
#[derive(Clone, Copy, Default)]
struct Seen {
    turn: Option<u64>,
    since: MonotonicTime,
    is_reported: bool,
}

/// Keeps time until the robot has ended.
pub(super) fn keep_time(machine: &Machine) {
    let clock = machine.environment.clock();
    let mut seen = vec![Seen::default(); machine.wired.islands.len()];
    let mut reported = vec![None; machine.shared_sources().len()];
    let mut reported_actuators = vec![None; machine.robot.actuators.len()];
    let mut reported_commands = Vec::new();
    let mut wall_read = Instant::now();
    let mut checked = Instant::now();
    while !machine.has_ended.load(Ordering::Acquire) {
        let control = &machine.control;
        let now = clock.now();
        while control.check_watch(now) {}
        while let Some(number) = machine.environment.agenda().take(now) {
            if let Some(island) = machine.island(number) {
                island.wake(now);
            }
        }
        while control.wake_sleepers(now) {}
        while control.check_limits(now) {}
        if wall_read.elapsed() >= WALL_PERIOD {
            wall_read = Instant::now();
            clock.refresh_wall();
        }
        if checked.elapsed() >= CHECK_PERIOD {
            checked = Instant::now();
            check_islands(machine, &mut seen, now);
            check_sources(machine, &mut reported, now);
            check_actuators(machine, &mut reported_actuators, now);
            check_commands(machine, &mut reported_commands, now);
            check_queues(machine);
        }
        let relief = control.pool().relieve();
        let due = [
            machine.environment.agenda().next(),
            control.next_watch(),
            control.next_sleeper(),
            control.next_limit(),
            relief.map(|relief| clock.now() + relief),
        ];
        control.bell().wait_until(clock, due.into_iter().flatten().min(), LONGEST_WAIT.min(CHECK_PERIOD));
    }
}

/// Reports estimators that hang, each time once.
fn check_islands(machine: &Machine, seen: &mut [Seen], now: MonotonicTime) {
    for (island, seen) in machine.islands().zip(seen) {
        let turn = island.busy().map(|(turn, _)| turn);
        if turn.is_none() || turn != seen.turn {
            *seen = Seen { turn, since: now, is_reported: false };
            continue;
        }
        let hangs_for = now.duration_since(seen.since);
        if hangs_for >= HANGS_AFTER && !seen.is_reported {
            seen.is_reported = true;
            let path = machine.path_of_busy(island);
            let since = now.duration_since(island.entered_at());
            machine.fault(path, hangs(since));
        }
    }
}

/// Reports sensors and services that hang, each time once. `reported`: for each source already reported, the time at which its code
/// was entered.
fn check_sources(machine: &Machine, reported: &mut [Option<MonotonicTime>], now: MonotonicTime) {
    for (source, reported) in machine.shared_sources().iter().zip(reported) {
        let longest = if source.has_rate() { HANGS_AFTER } else { WAITS_TOO_LONG };
        report_hanging(machine, source.path(), source.entered_at(), longest, reported, now);
    }
}

/// Reports actuators that hang, each time once.
fn check_actuators(machine: &Machine, reported: &mut [Option<MonotonicTime>], now: MonotonicTime) {
    for (actuator, reported) in machine.actuators().into_iter().zip(reported) {
        report_hanging(machine, actuator.path(), actuator.entered_at(), HANGS_AFTER, reported, now);
    }
}

/// Reports commands that hang: the first hanging execution of each. `reported`: those already reported.
fn check_commands(machine: &Machine, reported: &mut Vec<u64>, now: MonotonicTime) {
    let hanging = machine.control.hanging(now, WAITS_TOO_LONG);
    for Hanging { path, first, duration } in &hanging {
        if !reported.contains(first) {
            machine.fault(path, hangs(*duration));
        }
    }
    *reported = hanging.iter().map(|hanging| hanging.first).collect();
}

/// Reports that the pool has no threads left for some jobs, and that the journal has ended.
fn check_queues(machine: &Machine) {
    while let Some(message) = machine.control.pool().report() {
        machine.fault("pool", message);
    }
    if let Some(message) = machine.environment.journal().and_then(Journal::check) {
        machine.fault("journal", message);
    }
}

fn report_hanging(
    machine: &Machine,
    path: &'static str,
    entered: Option<MonotonicTime>,
    longest: Duration,
    reported: &mut Option<MonotonicTime>,
    now: MonotonicTime,
) {
    let Some(duration) = entered.map(|entered| now.duration_since(entered)) else { return };
    if duration >= longest && *reported != entered {
        *reported = entered;
        machine.fault(path, hangs(duration));
    }
}

fn hangs(since: Duration) -> String {
    format!("hangs: its code was entered {since:.1?} ago and has not returned")
}
