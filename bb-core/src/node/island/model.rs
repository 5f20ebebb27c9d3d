//! Checks every interleaving of threads at an island with a model checker: `RUSTFLAGS="--cfg loom"`.
//!
//! In each interleaving, every message is delivered or counted as dropped, the order of each publisher is kept, control entries
//! take effect, and nothing remains in the inbox. The lock's type ensures that only one thread at a time is inside. (The checker's
//! locks order more than real ones do: the comments at the fences explain their purpose.)

use super::{EstimatorDeclaration, Island, IslandDeclaration, IslandState, IslandWiring, Key};
use crate::component::{DisarmHook, Guardian};
use crate::declaration::ParameterValues;
use crate::event::HardwareError;
use crate::fault::Failed;
use crate::joints::{JointSettings, Joints};
use crate::journal::Event;
use crate::lifecycle::Supervision;
use crate::message::Origin;
use crate::node::act::Act;
use crate::node::{BindTarget, Check, Environment, EnvironmentParts, Mode, NodeEntry, Overseer, Report, Turn};
use crate::schedule::{Agenda, Bell, Pool};
use crate::time::{Clock, MonotonicTime};
use crate::topology::Topology;
use bb_message::__private::Sorted;
use loom::sync::Arc;
use loom::sync::atomic::{AtomicUsize, Ordering};
use loom::thread;

/// The messages delivered. Its inbox holds `CAPACITY` messages.
#[derive(Default)]
struct Seen<const CAPACITY: usize> {
    /// The last number received from each publisher.
    last: [usize; 2],
    messages: usize,
    wakes: usize,
    restarts: usize,
    has_retired: bool,
}

/// A publisher and the number of its message, starting from 1.
type Message = (usize, usize);

const NOW: MonotonicTime = MonotonicTime::ZERO;

impl<const CAPACITY: usize> Seen<CAPACITY> {
    fn see(&mut self, (publisher, number): Message) {
        assert!(self.last[publisher] < number, "out of order");
        self.last[publisher] = number;
        self.messages += 1;
    }
}

/// A robot with only the island.
struct Wiring {
    environment: Environment,
    dropped: AtomicUsize,
}

impl IslandWiring for Wiring {
    const ESTIMATORS: &'static [EstimatorDeclaration] = &[];

    fn environment(&self) -> &Environment {
        &self.environment
    }
}

/// An overseer that reports nothing and binds nothing.
struct Nobody;

impl Guardian for Nobody {
    fn on_disarm(&self, _: &'static str, _: Option<u64>, _: DisarmHook) {}

    fn hardware_error(&self, _: &'static str, _: HardwareError) {}
}

impl Overseer for Nobody {
    fn replacing_hooks(
        &self,
        _: &'static str,
        _: bool,
        make: &mut dyn FnMut() -> Result<(), Failed>,
    ) -> Result<(), Failed> {
        make()
    }

    fn leave_out(&self, _: &'static str, _: &str) {}

    fn report(&self, _: usize, _: Report) {}

    fn bind(&self, _: &'static str, _: &'static [usize], _: Check, _: BindTarget) {}

    fn parameters(&self) -> ParameterValues {
        ParameterValues::new(vec![])
    }
}

/// The joints of a robot without links.
fn no_joints() -> Joints {
    const NONE: Topology = Topology { links: &[], joints: &[] };
    let clock = Clock::virtual_at(NOW);
    let joints = Joints::new(&NONE, JointSettings::default(), clock, Sorted::default(), &[]);
    joints.expect("nothing is wrong with no joints")
}

/// Virtual time: a control entry is only noted, and the thread that posts it drains the island as the pool would.
fn environment() -> Environment {
    let parts = EnvironmentParts {
        mode: Mode::Virtual,
        replacements: Default::default(),
        clock: Clock::virtual_at(NOW),
        origin: Origin::default(),
        overseer: std::sync::Arc::new(Nobody),
        supervision: Supervision::default(),
        agenda: Agenda::new(Bell::default()),
        pool: Pool::new(|| {}),
        journal: None,
        telemetry: None,
        joints: no_joints(),
        start: NOW,
    };
    Environment::new(parts, Box::default())
}

impl<const CAPACITY: usize> IslandState for Seen<CAPACITY> {
    type Wiring = Wiring;
    type Message = Message;
    const CAPACITY: usize = CAPACITY;
    const DECLARATION: IslandDeclaration = IslandDeclaration {
        number: 0,
        name: "model",
        worker: None,
        is_measured: false,
        estimators: &[0],
        inlets: &[],
    };

    fn find(_: &Wiring) -> &Island<Self> {
        unreachable!("a model's island is not in its wiring")
    }

    fn deliver(&mut self, _: &Wiring, message: &Message, _: &Turn<'_>) {
        self.see(*message);
    }

    fn act(&mut self, _: &Wiring, _: usize, act: Act<'_, '_>) -> bool {
        match act {
            Act::Turn(_) => self.wakes += 1,
            Act::Handle(NodeEntry::Restart, _) => self.restarts += 1,
            Act::Handle(NodeEntry::Retire, _) => self.has_retired = true,
            Act::Handle(..) | Act::Visit(..) | Act::BeginReplay | Act::Emit(..) => {}
        }
        true
    }

    fn dropped(wiring: &Wiring, _: Key) {
        wiring.dropped.fetch_add(1, Ordering::Relaxed);
    }
}

const KEY: Key = Key { entry: 0, line: 0 };

/// The code of a thread.
type Thread<const CAPACITY: usize> = fn(&Island<Seen<CAPACITY>>, &Wiring);

fn publish<const CAPACITY: usize>(island: &Island<Seen<CAPACITY>>, wiring: &Wiring, message: Message) {
    island.enter(wiring, NOW, KEY, |seen, _| seen.see(message), || (message, 0));
}

fn publish_twice<const PUBLISHER: usize, const CAPACITY: usize>(island: &Island<Seen<CAPACITY>>, wiring: &Wiring) {
    publish(island, wiring, (PUBLISHER, 1));
    publish(island, wiring, (PUBLISHER, 2));
}

/// Runs the threads in all interleavings with at most that many preemptions.
fn check<const CAPACITY: usize, const THREADS: usize>(
    preemptions: usize,
    threads: [Thread<CAPACITY>; THREADS],
    holds: fn(&Seen<CAPACITY>, usize),
) {
    let mut checker = loom::model::Builder::new();
    checker.preemption_bound = Some(preemptions);
    checker.check(move || {
        let wiring = Wiring { environment: environment(), dropped: AtomicUsize::new(0) };
        let shared = Arc::new((Island::new(Seen::<CAPACITY>::default()), wiring));
        let spawned: Vec<_> = threads[1..]
            .iter()
            .map(|&run| {
                let shared = Arc::clone(&shared);
                thread::spawn(move || run(&shared.0, &shared.1))
            })
            .collect();
        threads[0](&shared.0, &shared.1);
        spawned.into_iter().for_each(|thread| thread.join().expect("it does not panic"));
        let (island, wiring) = &*shared;
        assert_eq!(island.pending.load(Ordering::Relaxed), 0, "an entry was left behind");
        assert_eq!(island.waiting.load(Ordering::Relaxed), 0);
        holds(&island.state.lock().expect("nobody panicked"), wiring.dropped.load(Ordering::Relaxed));
    });
}

/// Every message was delivered or counted.
fn all<const MESSAGES: usize, const CAPACITY: usize>(seen: &Seen<CAPACITY>, dropped: usize) {
    assert_eq!(seen.messages + dropped, MESSAGES, "something was lost uncounted");
}

/// Posts a control entry, drained as the pool would.
fn post<const CAPACITY: usize>(
    island: &Island<Seen<CAPACITY>>,
    wiring: &Wiring,
    add: impl FnOnce(&mut super::Inbox<super::Keyed<Message>>),
) {
    island.post_with(wiring, add);
    island.drain(wiring);
}

#[test]
fn two_publishers() {
    check::<4, 2>(3, [publish_twice::<0, 4>, publish_twice::<1, 4>], |seen, dropped| {
        all::<4, 4>(seen, dropped);
        assert_eq!(dropped, 0);
    });
}

#[test]
fn two_publishers_and_an_inbox_that_is_full() {
    check::<1, 2>(3, [publish_twice::<0, 1>, publish_twice::<1, 1>], all::<4, 1>);
}

#[test]
fn a_publisher_and_what_is_due() {
    let due: Thread<4> = |island, wiring| (0..2).for_each(|_| post(island, wiring, |inbox| inbox.wake(NOW)));
    check::<4, 2>(3, [publish_twice::<0, 4>, due], |seen, dropped| {
        all::<2, 4>(seen, dropped);
        assert_eq!(seen.wakes, 2);
    });
}

#[test]
fn a_publisher_and_a_caller() {
    let calls: Thread<1> = |island, wiring| {
        let line = Event::Wake { island: 0 };
        // In the model, a caller may stop waiting before the publisher is done.
        let _ = island.call(wiring, NOW, line, |_, _| ());
        publish(island, wiring, (1, 1));
    };
    check::<1, 2>(3, [publish_twice::<0, 1>, calls], all::<3, 1>);
}

/// Restarts are never lost, and never performed more often than requested.
#[test]
fn two_publishers_and_a_restart() {
    let restarts: Thread<4> = |island, wiring| post(island, wiring, |inbox| inbox.post(NOW, 0, NodeEntry::Restart));
    check::<4, 3>(2, [publish_twice::<0, 4>, publish_twice::<1, 4>, restarts], |seen, dropped| {
        all::<4, 4>(seen, dropped);
        assert_eq!(seen.restarts, 1);
    });
}

/// The stop is processed once, whatever else waits.
#[test]
fn a_publisher_and_the_end() {
    let ends: Thread<4> = |island, wiring| post(island, wiring, |inbox| inbox.retire(NOW));
    check::<4, 2>(3, [publish_twice::<0, 4>, ends], |seen, dropped| {
        all::<2, 4>(seen, dropped);
        assert!(seen.has_retired);
    });
}

/// A thread that checks whether the island is held, to report one that hangs, must not keep an entry in the inbox.
#[test]
fn a_publisher_what_is_due_and_a_check() {
    let checks: Thread<4> = |island, wiring| {
        if island.check().has_kept {
            island.drain(wiring);
        }
    };
    let due: Thread<4> = |island, wiring| post(island, wiring, |inbox| inbox.wake(NOW));
    check::<4, 2>(3, [checks, due], |seen, _| assert_eq!(seen.wakes, 1));
    check::<4, 3>(2, [publish_twice::<0, 4>, due, checks], |seen, dropped| {
        all::<2, 4>(seen, dropped);
        assert_eq!(seen.wakes, 1);
    });
}
