//! Stopping the robot: it is disarmed first, even if code hangs.

use super::arming::DISARM_WITHIN;
use super::inside;
use super::{Control, Limit};
use crate::event::Safety;
use crate::journal::Event;
use crate::node::Mode;
use crate::time::MonotonicTime;
use std::time::{Duration, Instant};

impl Control {
    /// Disarms the robot and cancels its commands, without waiting. Nothing is started from now on. Sensors and services are
    /// told to stop once the robot is safe or the time limit has passed.
    pub(crate) fn begin_stop(&self) {
        let mut step = self.step();
        if step.state.is_stopping {
            return;
        }
        step.line(Event::Stop);
        step.begin_stop();
        step.finish();
        if self.0.mode == Mode::Virtual {
            while self.run_pending_hooks() {}
            self.drop_cancelled();
        }
    }

    /// In a replay: the robot was stopped.
    pub(crate) fn replay_stop(&self) {
        let mut step = self.step();
        if step.state.is_stopping {
            return;
        }
        step.begin_stop();
        step.finish();
    }

    /// Whether the calling thread runs code that the disarming of this robot waits for.
    pub(crate) fn is_waiting_for_caller(&self) -> bool {
        inside::is_waited_for(self.id())
    }

    pub(crate) fn is_stopping(&self) -> bool {
        self.lock().is_stopping
    }

    /// Waits until the disarm callbacks have returned or have timed out. Does not wait for those that wait
    /// directly for the calling thread, that is for their own code or for the actuator that it is inside of: they cannot make their
    /// hardware safe before that thread continues.
    pub(crate) fn wait_until_disarmed(&self) {
        if self.0.mode == Mode::Real {
            let generation = self.lock().generation;
            // If another robot's callback stops this one, the callbacks of this robot do not wait for that one.
            let _waits = inside::waits_for(self.id());
            self.wait_until(DISARM_WITHIN + Duration::from_millis(500), |state| {
                self.is_disarmed_but_for_caller(state, generation)
            });
            // For those, and in case the timekeeper's thread is gone.
            self.disarm_timeout(generation);
            self.0.stop.set();
        }
    }

    /// The paths of commands whose code has not returned at `deadline`, and of components whose disarm callbacks have not.
    pub(crate) fn lingering(&self, deadline: Instant) -> Vec<&'static str> {
        loop {
            let lingering = self.polled();
            if lingering.is_empty() || Instant::now() >= deadline {
                return lingering;
            }
            std::thread::sleep(Duration::from_micros(100));
        }
    }

    fn polled(&self) -> Vec<&'static str> {
        let state = self.lock();
        let inside =
            state.executions.iter().filter(|execution| execution.task.as_ref().is_some_and(|task| task.may_act()));
        inside
            .filter_map(|execution| self.0.declared.commands.get(execution.command))
            .map(|declared| declared.path)
            .chain(state.apart_paths())
            .collect()
    }

    /// Enforces the time limits that have passed; returns true if there were any.
    pub(crate) fn check_limits(&self, now: MonotonicTime) -> bool {
        let Some((_, limit)) = self.0.limits.take(now) else { return false };
        match limit {
            Limit::Execution(id) => self.timed_out(id),
            Limit::Arming => self.arm_timeout(),
            Limit::Disarming(generation) => self.disarm_timeout(generation),
            Limit::Apart(key) => self.apart_timeout(key),
            Limit::Gone(id) => self.gone(id),
        }
        true
    }

    /// Wakes a sleeper that is due: on the pool, or on virtual time on this thread. Returns true if there was one.
    pub(crate) fn wake_sleepers(&self, now: MonotonicTime) -> bool {
        let Some((lane, waker)) = self.0.sleeper.take(now) else { return false };
        match self.0.mode {
            Mode::Real => self.0.pool.submit(lane, move || crate::fault::wake(waker)),
            Mode::Virtual | Mode::Replay => crate::fault::wake(waker),
        }
        true
    }

    /// Wakes `waker` at that time.
    pub(crate) fn wake_at(&self, time: MonotonicTime, waker: std::task::Waker) {
        self.0.sleeper.wake_at(time, None, waker);
    }

    /// When the watchdog checks next.
    pub(crate) fn next_watch(&self) -> Option<MonotonicTime> {
        self.0.watch.next()
    }

    /// When a command is to be woken next.
    pub(crate) fn next_sleeper(&self) -> Option<MonotonicTime> {
        self.0.sleeper.next()
    }

    /// When the next time limit passes.
    pub(crate) fn next_limit(&self) -> Option<MonotonicTime> {
        self.0.limits.next()
    }
}

impl super::step::Step<'_> {
    /// Disarms in any safety state: hardware started while the robot was disarmed may move as well.
    fn begin_stop(&mut self) {
        let was_in_error = self.state.machine.safety == Safety::Error;
        if self.state.disarming.is_none() {
            self.begin_disarming(None, None, false);
        }
        if let Some(disarming) = self.state.disarming.as_mut().filter(|_| was_in_error) {
            disarming.to_error = true;
        }
        self.state.is_stopping = true;
        self.cancel_all(None);
        self.publish_machine(None);
    }
}
