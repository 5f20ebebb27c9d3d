//! Tests with real threads.

use super::Tenure;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Barrier, mpsc};
use std::thread;
use std::time::Duration;

const LONG: Duration = Duration::from_secs(60);

/// Eight threads that call, in 200 tenures: none acts once the end has been waited for.
#[test]
fn no_call_of_eight_threads_outlives_the_end() {
    for _ in 0..200 {
        let acted = AtomicUsize::new(0);
        let tenure = Tenure::default();
        let is_silent = AtomicBool::new(false);
        let begin = Barrier::new(9);
        thread::scope(|scope| {
            for _ in 0..8 {
                scope.spawn(|| {
                    begin.wait();
                    while let Ok(_permit) = tenure.permit() {
                        acted.fetch_add(1, Ordering::Relaxed);
                        thread::yield_now();
                        assert!(!is_silent.load(Ordering::SeqCst), "it acts after the end");
                    }
                });
            }
            begin.wait();
            while acted.load(Ordering::Relaxed) == 0 {
                thread::yield_now();
            }
            tenure.end();
            assert!(tenure.wait(LONG));
            is_silent.store(true, Ordering::SeqCst);
        });
    }
}

/// Ending never waits, and waiting ends in time, whatever a call does.
#[test]
fn a_call_that_hangs_holds_up_nobody() {
    let tenure = Arc::new(Tenure::default());
    let (entered, has_entered) = mpsc::channel();
    let (release, released) = mpsc::channel::<()>();
    let hanging = Arc::clone(&tenure);
    let hangs = thread::spawn(move || {
        let _permit = hanging.permit().expect("it lasts");
        entered.send(()).expect("the test waits");
        // An error if the test has failed.
        let _ = released.recv();
    });
    has_entered.recv().expect("it enters");
    tenure.end();
    assert!(tenure.permit().is_err());
    assert!(!tenure.wait(Duration::from_millis(20)), "it hangs");
    assert!(!tenure.wait(Duration::ZERO));
    drop(release);
    assert!(tenure.wait(LONG));
    hangs.join().expect("it does not panic");
}

#[test]
fn permits_are_given_back_in_any_order() {
    let outer = Arc::new(Tenure::default());
    let session = Tenure::session("page".into(), Some(Arc::clone(&outer)));
    let first = session.permit().expect("it lasts");
    let second = outer.permit().expect("it lasts");
    drop(first);
    outer.end();
    // Its own thread's.
    assert!(outer.wait(Duration::ZERO));
    let over = session.permit().expect_err("the outer one is over");
    assert_eq!(over.session, None);
    session.end();
    assert_eq!(session.permit().expect_err("it is over").session, Some("page"));
    drop(second);
    thread::scope(|scope| {
        let others = scope.spawn(|| outer.wait(Duration::ZERO) && session.wait(Duration::ZERO));
        assert!(others.join().expect("it does not panic"), "all were given back");
    });
}
