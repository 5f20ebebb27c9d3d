//! Model-checks the orders in which calls and the end of their tenure can meet, with up to three preemptions:
//! `RUSTFLAGS="--cfg loom"`.

use super::Tenure;
use loom::sync::atomic::AtomicBool;
use loom::thread;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// The model has no time: it finds a wait that never ends as a deadlock.
const EVER: Duration = Duration::MAX;

/// A tenure with a flag that is set once nothing may act any more.
#[derive(Default)]
struct Watched {
    tenure: Arc<Tenure>,
    is_silent: AtomicBool,
}

impl Watched {
    fn of(tenure: &Arc<Tenure>) -> Arc<Self> {
        Arc::new(Self { tenure: Arc::clone(tenure), is_silent: AtomicBool::new(false) })
    }

    /// Returns whether it may.
    fn act(&self, within: &Tenure) -> bool {
        let Ok(_permit) = within.permit() else { return false };
        assert!(!self.is_silent.load(Ordering::SeqCst), "it acts after the end");
        // The rest of the act.
        thread::yield_now();
        assert!(!self.is_silent.load(Ordering::SeqCst), "the end did not wait for it");
        true
    }

    fn end(&self) {
        self.tenure.end();
        assert!(self.tenure.wait(EVER));
        self.is_silent.store(true, Ordering::SeqCst);
    }
}

fn check(threads: impl Fn() + Send + Sync + 'static) {
    let mut checker = loom::model::Builder::new();
    checker.preemption_bound = Some(3);
    checker.check(threads);
}

#[test]
fn no_call_outlives_the_end() {
    check(|| {
        let watched = Watched::of(&Arc::default());
        let calls = [(); 2].map(|()| {
            let watched = Arc::clone(&watched);
            thread::spawn(move || watched.act(&watched.tenure))
        });
        watched.end();
        assert!(!watched.act(&watched.tenure));
        for call in calls {
            call.join().expect("it does not panic");
        }
        assert_eq!(watched.tenure.state.load(Ordering::SeqCst), super::OVER, "all permits were given back");
    });
}

#[test]
fn a_call_in_a_session_does_not_outlive_the_command_that_began_it() {
    check(|| {
        let execution = Watched::of(&Arc::default());
        let session = Arc::new(Tenure::session("page".into(), Some(Arc::clone(&execution.tenure))));
        let (calling, within) = (Arc::clone(&execution), Arc::clone(&session));
        let calls = thread::spawn(move || calling.act(&within));
        let ending = Arc::clone(&session);
        let ends = thread::spawn(move || {
            ending.end();
            assert!(ending.wait(EVER));
        });
        execution.end();
        assert!(session.permit().is_err());
        calls.join().expect("it does not panic");
        ends.join().expect("it does not panic");
        for tenure in [&execution.tenure, &session] {
            assert_eq!(tenure.state.load(Ordering::SeqCst), super::OVER, "all permits were given back");
        }
    });
}

#[test]
fn a_call_that_ends_its_own_tenure_waits_for_others_alone() {
    check(|| {
        let watched = Watched::of(&Arc::default());
        let other = Arc::clone(&watched);
        let calls = thread::spawn(move || other.act(&other.tenure));
        {
            let _outer = watched.tenure.permit().expect("it lasts");
            let _inner = watched.tenure.permit().expect("it lasts");
            watched.end();
        }
        calls.join().expect("it does not panic");
    });
}
