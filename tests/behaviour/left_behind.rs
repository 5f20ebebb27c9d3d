//! What hangs when the robot stops is left behind and reported; nobody waits for it for longer than the robot says.

use crate::components::{Number, within};
use crate::gate::Gate;
use bb_core::journal::Event;
use bb_core::prelude::*;
use std::future::Future;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, mpsc};
use std::task::{Context as Polled, Wake, Waker};

/// Where all of it hangs.
static HERE: Gate = Gate::new();

/// How often something was made safe.
static DISARMED: AtomicU32 = AtomicU32::new(0);

/// Hangs when it is closed.
#[derive(Debug)]
pub(crate) struct Clinging;

impl Actuator for Clinging {
    type Options = NoOptions;
    type Command = Number;

    fn init(_: NoOptions, _: &ActuatorContext) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_command(&mut self, _: &Stamped<Number>) -> Result<(), Fault> {
        Ok(())
    }

    fn disarm(&mut self) -> Result<(), Fault> {
        DISARMED.fetch_add(1, Ordering::SeqCst);
        Ok(())
    }

    fn terminate(&mut self) {
        HERE.pass("here");
    }
}

/// Hangs when it is dropped.
#[derive(Debug)]
pub(crate) struct Heavy(Dropping);

/// What hangs when it is dropped.
#[derive(Debug)]
struct Dropping;

impl Drop for Dropping {
    fn drop(&mut self) {
        HERE.pass("here");
    }
}

impl Actuator for Heavy {
    type Options = NoOptions;
    type Command = Number;

    fn init(_: NoOptions, _: &ActuatorContext) -> Result<Self, Fault> {
        Ok(Self(Dropping))
    }

    fn handle_command(&mut self, _: &Stamped<Number>) -> Result<(), Fault> {
        let _ = &self.0;
        Ok(())
    }

    fn disarm(&mut self) -> Result<(), Fault> {
        DISARMED.fetch_add(1, Ordering::SeqCst);
        Ok(())
    }
}

/// Measures nothing; its disarm callback owns what hangs when it is dropped.
#[derive(Debug)]
pub(crate) struct Owner;

impl Sensor for Owner {
    type Options = NoOptions;
    type Output = Number;

    fn init(_: NoOptions, context: &SensorContext) -> Result<Self, Fault> {
        let owned = Dropping;
        context.on_disarm(move || {
            let _ = &owned;
            DISARMED.fetch_add(1, Ordering::SeqCst);
            Ok(())
        });
        Ok(Self)
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Number>, Fault> {
        Ok(Reading::nothing())
    }
}

/// Hangs, unlike what it is woken with.
struct Hanging;

impl Wake for Hanging {
    fn wake(self: Arc<Self>) {
        HERE.pass("here");
    }
}

struct Tell(mpsc::Sender<()>);

impl Wake for Tell {
    fn wake(self: Arc<Self>) {
        let _ = self.0.send(());
    }
}

robot! {
    robot Sticky;
    link base {
        sensor owner: Owner() { rate: 10 Hz; }
        joint pan: continuous { axis: z; actuator clinging: Clinging(); sensor a: External<Number>(); link head {} }
        joint tilt: continuous { axis: y; actuator heavy: Heavy(); sensor b: External<Number>(); link eye {} }
    }
}

/// Where options, and what a handler of telemetry owns, hang when they are dropped.
static GONE: Gate = Gate::new();

struct Slow(mpsc::Sender<Option<String>>);

impl Drop for Slow {
    fn drop(&mut self) {
        let _ = self.0.send(std::thread::current().name().map(str::to_owned));
        GONE.pass("gone");
    }
}

/// Where the options of an estimator were dropped while [`GONE`] was closed.
static TUNINGS: Mutex<Vec<Option<String>>> = Mutex::new(Vec::new());

/// Options that hang when they are dropped.
#[derive(Clone, Debug, Options)]
pub(crate) struct Tuning {
    #[option(default = 1.0)]
    gain: f64,
}

impl Drop for Tuning {
    fn drop(&mut self) {
        if GONE.is_closed() {
            let thread = std::thread::current().name().map(str::to_owned);
            TUNINGS.lock().expect("it does not panic").push(thread);
        }
        GONE.pass("gone");
    }
}

/// Has these options.
#[derive(Debug)]
pub(crate) struct Tuned {
    gain: f64,
}

impl Estimator for Tuned {
    type Options = Tuning;
    type Input = Number;
    type Output = Number;

    fn init(options: Tuning, _: &bb_core::Context) -> Result<Self, Fault> {
        Ok(Self { gain: options.gain })
    }

    fn handle_input(&mut self, number: &Stamped<Number>) -> Result<Reply<Number>, Fault> {
        Ok(Reply::emit(Number(self.gain * number.0)))
    }
}

robot! {
    robot Heavily;
    link base { sensor number: External<Number>() { estimator tuned: Tuned(); } }
}

robot! {
    robot Told;
    link base { sensor number: External<Number>(); }
}

/// What hangs there is one for all.
static ALONE: Mutex<()> = Mutex::new(());

#[test]
fn a_robot_whose_options_hang_when_they_are_dropped_is_back() {
    within(60, || {
        let _alone = ALONE.lock();
        let running = Heavily::builder().start().expect("it starts");
        TUNINGS.lock().expect("it does not panic").clear();
        GONE.close("gone");
        let start = std::time::Instant::now();
        running.stop().ok().expect("nothing is wrong");
        assert!(start.elapsed() < Duration::from_secs(3), "{:?}", start.elapsed());
        GONE.wait_for(1);
        GONE.open();
        assert_eq!(
            *TUNINGS.lock().expect("it does not panic"),
            [Some("drop".to_owned())],
            "on a thread of its own"
        );
    });
}

#[test]
fn a_robot_whose_handler_of_telemetry_hangs_when_it_is_dropped_is_back() {
    within(60, || {
        let _alone = ALONE.lock();
        for is_kept in [false, true] {
            let (tell, told) = mpsc::channel();
            let slow = Slow(tell);
            let mut builder = Told::builder();
            builder.telemetry(move |_, _| {
                let _ = &slow;
            });
            let running = builder.start().expect("it starts");
            // Another handle may be the last.
            let live = is_kept.then(|| running.live());
            GONE.close("gone");
            let start = std::time::Instant::now();
            running.stop().ok().expect("nothing is wrong");
            drop(live);
            assert!(start.elapsed() < Duration::from_secs(3), "{:?}", start.elapsed());
            let dropped = told.recv_timeout(Duration::from_secs(20)).expect("it is dropped");
            assert_eq!(dropped.as_deref(), Some("drop"), "on a thread of its own");
            GONE.open();
        }
    });
}

#[test]
fn a_robot_of_which_everything_hangs_as_it_closes_is_back_and_says_what_it_left() {
    within(60, || {
        let mut builder = Sticky::builder();
        builder.journal(|line| {
            if matches!(line.event, Event::Stop) {
                HERE.pass("here");
            }
        });
        let running = builder.start().expect("it starts");
        running.arm().expect("it may be armed");
        // Both are woken by the end.
        let (tell, told) = mpsc::channel();
        let wakers = [Waker::from(Arc::new(Hanging)), Waker::from(Arc::new(Tell(tell)))];
        let mut first = running.subscribe(sticky::sensor::base::pan::a);
        let mut second = running.subscribe(sticky::sensor::base::tilt::b);
        let mut first = Box::pin(async move { first.recv_async().await.is_none() });
        let mut second = Box::pin(async move { second.recv_async().await.is_none() });
        assert!(first.as_mut().poll(&mut Polled::from_waker(&wakers[0])).is_pending());
        assert!(second.as_mut().poll(&mut Polled::from_waker(&wakers[1])).is_pending());
        HERE.close("here");
        let start = std::time::Instant::now();
        let report = running.stop();
        assert!(start.elapsed() < Duration::from_secs(8), "{:?}", start.elapsed());
        assert_eq!(told.recv_timeout(Duration::from_secs(20)), Ok(()), "the other one's waker hangs");
        HERE.open();
        assert_eq!((DISARMED.load(Ordering::SeqCst), report.safety), (3, Safety::Disarmed));
        // While it stops, the thread that keeps time reports what hangs as it does while the robot runs.
        let faults = report.faults.iter().filter(|fault| !fault.message.starts_with("hangs: "));
        let faults: Vec<_> = faults.map(ToString::to_string).collect();
        let starts = [
            "actuator/base/pan/clinging failed: did not return when the robot stopped; its code was entered ",
            "actuator/base/tilt/heavy failed: did not return when the robot stopped; its code was entered ",
            "journal failed: its sink did not take the last lines in time: it ends before the run",
            "sensor/base/owner failed: what its disarm callback owns was not dropped in time",
            "pool failed: wakers that have not returned: 1",
        ];
        assert_eq!(faults.len(), starts.len(), "{faults:?}");
        for (fault, start) in faults.iter().zip(starts) {
            assert!(fault.starts_with(start), "{faults:?}");
        }
    });
}

/// Panics when it is dropped, unless something panics already.
struct Bomb;

impl Drop for Bomb {
    fn drop(&mut self) {
        assert!(std::thread::panicking(), "the bomb goes off");
    }
}

/// Whether [`Fused`] panics when it is dropped.
static IS_LIT: std::sync::atomic::AtomicBool = std::sync::atomic::AtomicBool::new(false);

/// Options that panic when they are dropped.
#[derive(Clone, Debug, Options)]
pub(crate) struct Fused {
    #[option(default = 1.0, range = 0.0..=2.0)]
    gain: f64,
}

impl Drop for Fused {
    fn drop(&mut self) {
        assert!(!IS_LIT.load(Ordering::SeqCst) || std::thread::panicking(), "the fuse burns down");
    }
}

/// Has these options.
#[derive(Debug)]
pub(crate) struct Cannon;

impl Estimator for Cannon {
    type Options = Fused;
    type Input = Number;
    type Output = Number;

    fn init(_: Fused, _: &bb_core::Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, number: &Stamped<Number>) -> Result<Reply<Number>, Fault> {
        Ok(Reply::emit(Number(number.0)))
    }
}

/// Has options that may be wrong.
#[derive(Debug)]
pub(crate) struct Fire;

impl Command for Fire {
    type Options = Fused;
    type Arguments = NoArguments;
    type Output = ();

    async fn run(_: Fused, _: NoArguments, _: CommandContext) -> Result<Outcome<()>, Fault> {
        Ok(Outcome::done(()))
    }
}

robot! {
    robot Armoury;
    commands { fire: Fire; }
    link base { sensor number: External<Number>() { estimator cannon: Cannon(); } }
}

/// Keeps its options for ever, so that only the robot drops any; and starts if it is told to.
#[derive(Debug)]
pub(crate) struct Keeping;

static MAY_START: std::sync::atomic::AtomicBool = std::sync::atomic::AtomicBool::new(true);

impl Keeping {
    fn with<O>(options: O) -> Result<Self, Fault> {
        std::mem::forget(options);
        if MAY_START.load(Ordering::SeqCst) { Ok(Self) } else { Err(Fault::new("not today")) }
    }
}

impl Sensor for Keeping {
    type Options = Fused;
    type Output = Number;

    fn init(options: Fused, _: &SensorContext) -> Result<Self, Fault> {
        Self::with(options)
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Number>, Fault> {
        Ok(Reading::nothing())
    }
}

impl Estimator for Keeping {
    type Options = Tuning;
    type Input = Number;
    type Output = Number;

    fn init(options: Tuning, _: &bb_core::Context) -> Result<Self, Fault> {
        Self::with(options)
    }

    fn handle_input(&mut self, number: &Stamped<Number>) -> Result<Reply<Number>, Fault> {
        Ok(Reply::emit(number.payload))
    }
}

robot! {
    robot Burning;
    link base { sensor keeping: Keeping() { rate: 10 Hz; } }
}

robot! {
    robot Clogged;
    link base { sensor number: External<Number>() { estimator keeping: Keeping(); } }
}

fn with_bomb() -> bb_core::Builder<Armoury> {
    let mut builder = Armoury::builder();
    let bomb = Bomb;
    builder.telemetry(move |_, _| {
        let _ = &bomb;
    });
    builder
}

#[test]
fn a_handler_or_options_that_panic_when_they_are_dropped_do_not_reach_whoever_stops_the_robot() {
    within(60, || {
        let _alone = ALONE.lock();
        let simulation = with_bomb().simulate().expect("it starts");
        let live = simulation.live();
        IS_LIT.store(true, Ordering::SeqCst);
        simulation.stop().ok().expect("nothing is wrong");
        // Another handle is the last.
        drop(live);
        IS_LIT.store(false, Ordering::SeqCst);

        let simulation = with_bomb().simulate().expect("it starts");
        IS_LIT.store(true, Ordering::SeqCst);
        drop(simulation);
        IS_LIT.store(false, Ordering::SeqCst);

        let replay = with_bomb().replay().expect("it starts");
        IS_LIT.store(true, Ordering::SeqCst);
        replay.stop().ok().expect("nothing is wrong");
        IS_LIT.store(false, Ordering::SeqCst);
    });
}

/// The options of the builder are dropped when the robot has started or has not; those of a sensor with it.
#[test]
fn options_that_panic_when_they_are_dropped_do_not_reach_whoever_starts_the_robot() {
    within(60, || {
        let _alone = ALONE.lock();
        for may_start in [true, false] {
            MAY_START.store(may_start, Ordering::SeqCst);
            let builders = || {
                let mut builder = Burning::builder();
                let fused = Fused { gain: 0.5 };
                builder.replace_sensor::<Keeping>("sensor/base/keeping", fused).expect("it is declared");
                [Burning::builder(), builder]
            };
            for builder in builders() {
                IS_LIT.store(true, Ordering::SeqCst);
                let simulated = builder.simulate().map(drop).map_err(|error| error.to_string());
                IS_LIT.store(false, Ordering::SeqCst);
                let refused = Err("sensor/base/keeping cannot start: not today".to_owned());
                assert_eq!(simulated, if may_start { Ok(()) } else { refused });
            }
            for builder in builders() {
                IS_LIT.store(true, Ordering::SeqCst);
                let started = builder.start().map(|running| running.stop().ok().map(drop)).is_ok();
                IS_LIT.store(false, Ordering::SeqCst);
                assert_eq!(started, may_start);
            }
        }
        MAY_START.store(true, Ordering::SeqCst);
    });
}

#[test]
fn options_that_hang_when_they_are_dropped_do_not_keep_whoever_starts_the_robot() {
    within(60, || {
        let _alone = ALONE.lock();
        for may_start in [true, false] {
            MAY_START.store(may_start, Ordering::SeqCst);
            let builder = Clogged::builder();
            TUNINGS.lock().expect("it does not panic").clear();
            GONE.close("gone");
            let start = std::time::Instant::now();
            let started = builder.start();
            assert!(start.elapsed() < Duration::from_secs(3), "{:?}", start.elapsed());
            GONE.wait_for(1);
            GONE.open();
            assert_eq!(started.is_ok(), may_start);
            let tunings = TUNINGS.lock().expect("it does not panic").clone();
            assert!(tunings.iter().all(|thread| thread.as_deref() == Some("drop")), "{tunings:?}");
        }
        MAY_START.store(true, Ordering::SeqCst);
    });
}

#[test]
fn a_handler_that_hangs_or_panics_when_it_is_dropped_does_not_keep_a_start_from_being_refused() {
    within(60, || {
        let _alone = ALONE.lock();
        let refused = |error: StartError| assert!(error.to_string().contains("command/fire"), "{error}");
        let mut builder = with_bomb();
        builder.options(armoury::command::fire).gain = 7.0;
        refused(builder.simulate().map(drop).expect_err("the gain is out of range"));

        let (tell, told) = mpsc::channel();
        let slow = Slow(tell);
        let mut builder = with_bomb();
        builder.telemetry(move |_, _| {
            let _ = &slow;
        });
        builder.options(armoury::command::fire).gain = 7.0;
        GONE.close("gone");
        let start = std::time::Instant::now();
        refused(builder.start().map(drop).expect_err("the gain is out of range"));
        assert!(start.elapsed() < Duration::from_secs(3), "{:?}", start.elapsed());
        let dropped = told.recv_timeout(Duration::from_secs(20)).expect("it is dropped");
        assert_eq!(dropped.as_deref(), Some("drop"), "on a thread of its own");
        GONE.open();
    });
}
