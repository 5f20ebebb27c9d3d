//! One disarm callback: user code, on its own thread, and never on two at once.

use super::inside::{self, Awaited};
use super::{Control, Key};
use crate::component::DisarmHook;
use crate::event::SafetyError;
use crate::fault::{caught, discard};
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// See the [module](self).
pub(super) struct Callback {
    /// Its number among all of the robot.
    pub(super) number: u64,
    /// The path of the component that registered it.
    pub(super) path: &'static str,
    code: DisarmHook,
    runs: Mutex<Runs>,
}

#[derive(Default)]
struct Runs {
    is_running: bool,
    /// Reasons to run once more, collected while it runs.
    waiting: Vec<Reason>,
}

/// Why a callback runs, and who waits for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reason {
    /// The disarming with that number.
    Disarming(u64),
    /// See [`super::apart`].
    Apart(Key),
}

impl Callback {
    pub(super) fn new(number: u64, path: &'static str, code: DisarmHook) -> Self {
        Self { number, path, code, runs: Mutex::default() }
    }

    /// Whether a thread runs it.
    pub(super) fn is_running(&self) -> bool {
        self.runs().is_running
    }

    /// Runs it on its own thread; returns false if no thread can be started.
    pub(super) fn start(self: &Arc<Self>, control: &Control, reason: Reason) -> bool {
        if !self.begin(control, reason) {
            return true;
        }
        let (callback, robot) = (Arc::clone(self), control.clone());
        let is_started = spawn(format!("disarm {}", self.path), move || {
            callback.work(&robot, reason);
            // It may be the last owner of the values that the code captured.
            discard(callback);
        });
        if is_started.is_err() {
            self.runs().is_running = false;
        }
        is_started.is_ok()
    }

    /// Runs it on the calling thread.
    pub(super) fn run(&self, control: &Control, reason: Reason) {
        if self.begin(control, reason) {
            self.work(control, reason);
        }
    }

    /// Returns true if the caller is to run it. If it runs already, that thread runs it once more.
    fn begin(&self, control: &Control, reason: Reason) -> bool {
        let mut runs = self.runs();
        if !std::mem::replace(&mut runs.is_running, true) {
            return true;
        }
        runs.waiting.push(reason);
        if runs.waiting.len() > 1 {
            // It hangs: reasons that no caller waits for any more must not pile up. They stay in the list while the
            // control state is queried, since the run may end in the meantime.
            let waiting = runs.waiting.clone();
            drop(runs);
            let is_over = |reason: &Reason| !control.is_wanted(*reason, self.number);
            let over: Vec<Reason> = waiting.into_iter().filter(is_over).collect();
            self.runs().waiting.retain(|reason| !over.contains(reason));
        }
        false
    }

    fn work(&self, control: &Control, reason: Reason) {
        let mut reasons = vec![reason];
        loop {
            let error = self.call(control.id());
            let next = self.wanted(control);
            for reason in std::mem::replace(&mut reasons, next) {
                control.callback_returned(reason, self.number, error.clone());
            }
            if reasons.is_empty() {
                return;
            }
        }
    }

    /// The reasons to run once more; if there are none, it is no longer running.
    fn wanted(&self, control: &Control) -> Vec<Reason> {
        loop {
            let mut runs = self.runs();
            let mut waiting = std::mem::take(&mut runs.waiting);
            if waiting.is_empty() {
                runs.is_running = false;
                return waiting;
            }
            drop(runs);
            waiting.retain(|reason| control.is_wanted(*reason, self.number));
            if !waiting.is_empty() {
                return waiting;
            }
        }
    }

    fn call(&self, robot: Awaited) -> Option<SafetyError> {
        let failed = inside::callback(robot, self.number, || caught(|| (self.code)()).err())?;
        Some(SafetyError { path: self.path, message: format!("disarming failed: {}", failed.fault) })
    }

    fn runs(&self) -> MutexGuard<'_, Runs> {
        self.runs.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(not(loom))]
fn spawn(name: String, run: impl FnOnce() + Send + 'static) -> std::io::Result<()> {
    std::thread::Builder::new().name(name).spawn(run).map(drop)
}

#[cfg(loom)]
fn spawn(_: String, run: impl FnOnce() + Send + 'static) -> std::io::Result<()> {
    loom::thread::spawn(run);
    Ok(())
}

impl fmt::Debug for Callback {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Callback").field("number", &self.number).field("path", &self.path).finish_non_exhaustive()
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use crate::control::{Disarming, bare};
    use crate::node::Mode;
    use std::sync::mpsc;
    use std::time::{Duration, Instant};

    #[test]
    fn a_run_that_ends_while_others_ask_for_it_answers_them_all() {
        let control = bare::control(Mode::Virtual, &[], []);
        let (enter, entered) = mpsc::channel();
        let (release, released) = mpsc::channel::<()>();
        let released = Mutex::new(released);
        let code = move || {
            let _ = enter.send(());
            // The first run hangs; the sender is gone in later ones.
            let _ = released.lock().map(|released| released.recv());
            Ok(())
        };
        let callback = Arc::new(Callback::new(0, "motor", Arc::new(code)));
        let reason = Reason::Disarming(7);
        control.lock().disarming = Some(Disarming {
            generation: 7,
            force: false,
            to_error: false,
            by: None,
            left: vec![(0, "motor"); 3],
            outcome: Arc::default(),
            errors: Vec::new(),
        });
        let ask = || {
            let (callback, control) = (Arc::clone(&callback), control.clone());
            std::thread::spawn(move || callback.run(&control, reason))
        };
        let runs = ask();
        entered.recv().expect("it is entered");
        ask().join().expect("it does not panic");
        // The third one asks the control state while the run ends.
        let state = control.lock();
        let asks = ask();
        while callback.runs().waiting.len() == 1 {
            std::thread::yield_now();
        }
        std::thread::sleep(Duration::from_millis(20));
        drop(release);
        std::thread::sleep(Duration::from_millis(20));
        drop(state);
        [runs, asks].into_iter().for_each(|thread| thread.join().expect("it does not panic"));
        let start = Instant::now();
        while control.is_disarming() && start.elapsed() < Duration::from_secs(5) {
            std::thread::yield_now();
        }
        assert!(!control.is_disarming(), "three have asked, and some wait for ever");
    }
}
