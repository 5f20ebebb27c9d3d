//! The end of a robot after its disarming: estimators and actuators stop, the journal and the last report are completed, and
//! components are closed. Every wait for user code here has a time limit.

use super::machine::Machine;
use super::threads::since;
use crate::fault::lock;
use crate::journal::Journal;
use crate::node::Replayed;
use crate::pubsub::AnyTopic as _;
use crate::schedule::Lane;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::task::Waker;
use std::time::{Duration, Instant};

/// Time that the journal's sink may take for the last lines.
const HAND_OVER_WITHIN: Duration = Duration::from_secs(1);

/// Least time that actuators have to stop and parameters to be stored, no matter how much has been used up before.
const LEAST_TO_STOP: Duration = Duration::from_millis(100);

/// Least time that the sink has for the last lines and components to drop their values.
const LEAST_TO_CLOSE: Duration = Duration::from_millis(200);

/// Least time that idle workers have to stop.
const LEAST_TO_RETIRE: Duration = Duration::from_millis(20);

impl Machine {
    /// Stops all estimators. Those that are busy until `deadline` are left running and reported.
    pub(super) fn retire_islands(&self, deadline: Instant) {
        // Workers that are idle need a moment, also if sensors have used up the time.
        let deadline = deadline.max(Instant::now() + LEAST_TO_RETIRE);
        let now = self.environment.clock().now();
        for island in self.islands() {
            island.retire(now);
        }
        self.environment.drain_posted();
        self.environment.wait_for_retired(self.wired.islands.len(), deadline);
        for island in self.islands().filter(|island| !island.has_retired()) {
            let path = self.path_of_busy(island);
            let since = self.environment.clock().now().duration_since(island.entered_at());
            self.fault(
                path,
                format!("did not return when the robot stopped; its code was entered {since:.1?} ago"),
            );
        }
    }

    /// Stops the estimators that still run, in order, at the end of a replay: its journal may be cut.
    pub(super) fn retire_quietly(&self) {
        let now = self.environment.clock().now();
        for island in self.islands().filter(|island| !island.has_retired()) {
            island.replay(now, Replayed::Retire);
        }
    }

    /// Closes all actuators concurrently. Those that are busy at `deadline`, or whose code has not returned, are left
    /// running and reported.
    pub(super) fn terminate_actuators(self: &Arc<Self>, deadline: Instant) {
        let deadline = deadline.max(Instant::now() + LEAST_TO_STOP);
        let numbers = 0..self.robot.actuators.len();
        let busy = Arc::new((Mutex::new(numbers.clone().collect::<Vec<_>>()), Condvar::new()));
        for number in numbers {
            let (machine, busy) = (Arc::clone(self), Arc::clone(&busy));
            self.control.run_on_pool(Lane::Robot, move || {
                let left = deadline.saturating_duration_since(Instant::now());
                if machine.wired.actuator(number).is_none_or(|actuator| actuator.terminate(left)) {
                    lock(&busy.0).retain(|other| *other != number);
                    busy.1.notify_all();
                }
            });
        }
        let left = lock(&busy.0);
        let longest = deadline.saturating_duration_since(Instant::now());
        let left = busy.1.wait_timeout_while(left, longest, |left| !left.is_empty());
        let left = left.unwrap_or_else(PoisonError::into_inner).0.clone();
        let now = self.environment.clock().now();
        for actuator in left.into_iter().filter_map(|number| self.wired.actuator(number)) {
            let message = match actuator.entered_at() {
                None => "did not come back from its command, or from disarming, in time".to_owned(),
                entered => format!("did not return when the robot stopped{}", since(entered, now)),
            };
            self.fault(actuator.path(), message);
        }
    }

    /// Takes no more messages. Until `deadline`, waits for messages on their way and for stopped estimators to count
    /// theirs.
    pub(super) fn close_door(&self, deadline: Instant) {
        if !self.environment.door().close(deadline) {
            let message = "a publisher did not come back: what followed from its message may be missing";
            self.fault("journal", message.to_owned());
        }
        for island in self.islands().filter(|island| island.has_retired()) {
            while !island.is_idle() && Instant::now() < deadline {
                std::thread::sleep(Duration::from_micros(100));
            }
        }
    }

    /// Stores the parameters, ends the journal after the last entry of the control state, ends the subscriptions, drops
    /// the values of disarm callbacks, and makes the last report. The journal's sink and these drops may take until
    /// `deadline`.
    pub(super) fn end(&self, deadline: Instant) {
        // What is accepted is stored.
        self.control.close_parameters();
        let keeper = lock(&self.keeper).take();
        if let Some(keeper) = keeper {
            let stored_by = deadline.checked_sub(LEAST_TO_CLOSE).unwrap_or(deadline);
            keeper.finish(&self.control, stored_by.max(Instant::now() + LEAST_TO_STOP));
        }
        let summary = self.control.end(|summary| {
            if let Some(journal) = self.environment.journal() {
                journal.close();
            }
            summary
        });
        for topic in self.topics() {
            if topic.path() != "journal" {
                self.wake_all(topic.close());
            }
        }
        let deadline = deadline.max(Instant::now() + LEAST_TO_CLOSE);
        self.control.drop_hooks();
        let mut report = self.report_of(summary);
        if let Some(message) = self.environment.journal().and_then(|journal| hand_over(journal, deadline)) {
            report.add_fault(self.fault("journal", message));
        }
        let deadline = Instant::now() + LEAST_TO_CLOSE;
        if let Some(message) = self.control.pool().left(Lane::User, deadline) {
            report.add_fault(self.fault("pool", message));
        }
        // Once the pool has run the wakers.
        report.panics = self.panics(&report.topics, &self.control.between_entries(|summary| summary));
        // It is set once.
        let _ = self.last_report.set(report);
        self.wake_all(self.control.topics().journal.close());
        self.wake_all(self.control.topics().registry.close());
        self.has_ended.store(true, Ordering::Release);
        self.control.bell().ring();
        self.control.pool().close();
    }

    fn wake_all(&self, wakers: Vec<Waker>) {
        if !wakers.is_empty() {
            let control = self.control.clone();
            self.control.run_on_pool(Lane::User, move || wakers.into_iter().for_each(|waker| control.wake(waker)));
        }
    }
}

/// Waits until the journal's sink has the last lines. Returns the problem if it does not take them, unless reported
/// before.
fn hand_over(journal: &Journal, deadline: Instant) -> Option<String> {
    let longest = HAND_OVER_WITHIN.min(deadline.saturating_duration_since(Instant::now()));
    let in_time = journal.hand_over(longest);
    let late = || "its sink did not take the last lines in time: it ends before the run".to_owned();
    journal.check().or_else(|| (!in_time && !journal.has_ended()).then(late))
}
