//! Code that hangs, or calls back where it would wait for itself, harms itself alone, and is reported while the robot runs.

use crate::components::Number;
use crate::gate::{Gate, Place, Stuck};
use bb_core::prelude::*;
use bb_core::run::ActuatorError;
use bb_core::{ComponentFault, DisarmError, Live, TelemetryEvent};
use std::future::Future;
use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};
use std::sync::{Arc, Mutex, OnceLock, mpsc};
use std::task::{Context as Polled, Wake, Waker};

/// Longer than anything takes that does not hang, however busy the machine.
const PATIENCE: Duration = Duration::from_secs(20);

/// A place at which the code of each test hangs.
struct Hangs(Gate);

impl Hangs {
    const fn new() -> Self {
        Self(Gate::new())
    }

    fn close(&self) -> Open<'_> {
        self.0.close("here");
        Open(&self.0)
    }
}

/// Opened in the end, whatever becomes of the test.
struct Open<'a>(&'a Gate);

impl Drop for Open<'_> {
    fn drop(&mut self) {
        self.0.open();
    }
}

/// Waits for a fault of that path; the message.
fn fault_of(faults: &Subscription<ComponentFault>, path: &str) -> String {
    let start = std::time::Instant::now();
    while let Some(fault) = faults.recv_timeout(PATIENCE.saturating_sub(start.elapsed())) {
        if fault.path == path {
            return fault.message.clone();
        }
    }
    panic!("no fault of {path}")
}

mod reports {
    use super::*;

    static HANG: Hangs = Hangs::new();

    /// Hangs in its command.
    #[derive(Debug)]
    pub(crate) struct Servo;

    impl Actuator for Servo {
        type Options = NoOptions;
        type Command = Number;

        fn init(_: NoOptions, _: &ActuatorContext) -> Result<Self, Fault> {
            Ok(Self)
        }

        fn handle_command(&mut self, _: &Stamped<Number>) -> Result<(), Fault> {
            HANG.0.pass("here");
            Ok(())
        }

        fn disarm(&mut self) -> Result<(), Fault> {
            Ok(())
        }
    }

    /// Hangs.
    pub(crate) struct Wait;

    impl Command for Wait {
        type Options = NoOptions;
        type Arguments = NoArguments;
        type Output = ();

        async fn run(_: NoOptions, _: NoArguments, _: CommandContext) -> Result<Outcome<()>, Fault> {
            HANG.0.pass("here");
            Ok(Outcome::done(()))
        }
    }

    robot! {
        robot Reporting;
        commands { wait: Wait { allowed_states: [idle]; } }
        link base {
            joint pan: continuous { axis: z; actuator servo: Servo(); sensor encoder: External<Number>(); link head {} }
        }
    }

    #[test]
    fn an_actuator_and_a_command_that_hang_are_reported_while_the_robot_runs()
    -> Result<(), Box<dyn std::error::Error>> {
        let open = HANG.close();
        let builder = Reporting::builder();
        let faults = builder.subscribe(system::Faults);
        let running = builder.start()?;
        running.arm()?;
        let live = running.live();
        let sender = std::thread::spawn(move || live.actuate(reporting::actuator::base::pan::servo, Number(1.0)));
        let waiting = running.command(reporting::command::wait, NoArguments)?;
        for path in ["actuator/base/pan/servo", "command/wait"] {
            let message = fault_of(&faults, path);
            assert!(message.starts_with("hangs: its code was entered"), "{path}: {message}");
        }
        drop(open);
        sender.join().expect("it does not panic")?;
        waiting.wait()?;
        assert_eq!(running.stop().safety, Safety::Disarmed);
        Ok(())
    }
}

mod sinks {
    use super::*;

    static HANG: Hangs = Hangs::new();

    robot! {
        robot Written;
        parameters { p: f64 = 1.0, range: 0.0..=2.0; }
        link base { sensor number: External<Number>(); }
    }

    #[test]
    fn a_journal_whose_sink_hangs_ends_and_is_reported_while_the_robot_runs()
    -> Result<(), Box<dyn std::error::Error>> {
        let open = HANG.close();
        let mut builder = Written::builder();
        builder.journal(|_| HANG.0.pass("here"));
        let faults = builder.subscribe(system::Faults);
        let running = builder.start()?;
        let live = running.live();
        let (ended, stop) = mpsc::channel::<()>();
        let writer = std::thread::spawn(move || {
            while stop.try_recv() == Err(mpsc::TryRecvError::Empty) {
                live.set_parameter(written::param::p, 0.5).expect("it is in range");
            }
        });
        let message = fault_of(&faults, "journal");
        assert!(message.starts_with("its sink hangs, and it ends before line "), "{message}");
        drop(ended);
        writer.join().expect("it does not panic");
        drop(open);
        let report = running.stop();
        assert_eq!(report.faults.iter().filter(|fault| fault.path == "journal").count(), 1, "{:?}", report.faults);
        Ok(())
    }
}

mod wakers {
    use super::*;

    static HANG: Hangs = Hangs::new();

    /// Ends when it is told to.
    pub(crate) struct Go;

    impl Command for Go {
        type Options = NoOptions;
        type Arguments = NoArguments;
        type Output = ();

        async fn run(_: NoOptions, _: NoArguments, context: CommandContext) -> Result<Outcome<()>, Fault> {
            context.sleep(Duration::from_millis(100)).await;
            Ok(Outcome::done(()))
        }
    }

    struct Hanging;

    impl Wake for Hanging {
        fn wake(self: Arc<Self>) {
            HANG.0.pass("here");
        }
    }

    struct Tell(mpsc::Sender<()>);

    impl Wake for Tell {
        fn wake(self: Arc<Self>) {
            let _ = self.0.send(());
        }
    }

    robot! {
        robot Waking;
        commands { go: Go { allowed_states: [idle]; } }
        link base { sensor number: External<Number>(); }
    }

    #[test]
    fn a_waker_that_hangs_keeps_no_other_from_being_woken() -> Result<(), Box<dyn std::error::Error>> {
        let open = HANG.close();
        let running = Waking::builder().start()?;
        running.arm()?;
        let execution = running.command(waking::command::go, NoArguments)?;
        // Both are woken by the entry that ends the command.
        let (hangs, (tell, told)) = (Waker::from(Arc::new(Hanging)), mpsc::channel());
        let mut states = running.subscribe(system::StateMachine);
        while running.state() != "executing" {
            std::thread::yield_now();
        }
        states.drain().count();
        let mut state = Box::pin(async move { states.recv_async().await.map(|state| state.to) });
        assert!(state.as_mut().poll(&mut Polled::from_waker(&hangs)).is_pending());
        let mut execution = Box::pin(execution);
        let tell = Waker::from(Arc::new(Tell(tell)));
        if execution.as_mut().poll(&mut Polled::from_waker(&tell)).is_pending() {
            told.recv_timeout(PATIENCE)?;
        }
        drop(open);
        running.stop().ok()?;
        Ok(())
    }
}

mod pools {
    use super::*;

    static HANG: Hangs = Hangs::new();

    /// Where commands hang until all are let go.
    pub(crate) struct InPool;

    impl Place for InPool {
        const GATE: &'static Gate = &HANG.0;
        const NAME: &'static str = "here";
    }

    /// Does what is to be done when an estimator is degraded.
    pub(crate) struct Halt;

    impl Command for Halt {
        type Options = NoOptions;
        type Arguments = NoArguments;
        type Output = ();

        async fn run(_: NoOptions, _: NoArguments, context: CommandContext) -> Result<Outcome<()>, Fault> {
            context.sleep(Duration::from_millis(1)).await;
            Ok(Outcome::done(()))
        }
    }

    /// Ticks, and diverges at a number.
    #[derive(Debug)]
    pub(crate) struct Ticker;

    impl Estimator for Ticker {
        type Options = NoOptions;
        type Input = Number;
        type Output = Number;

        fn init(_: NoOptions, context: &Context) -> Result<Self, Fault> {
            context.request(Request::Tick(Duration::from_millis(10)));
            Ok(Self)
        }

        fn handle_input(&mut self, _: &Stamped<Number>) -> Result<Reply<Number>, Fault> {
            Ok(Reply::none().diverged("a number came"))
        }

        fn handle_info(&mut self, _: Info) -> Result<Reply<Number>, Fault> {
            Ok(Reply::emit(Number(0.0)))
        }
    }

    robot! {
        robot Crowded;
        commands {
            category many { concurrency: 1000; }
            stuck: Stuck<InPool> { category: many; allowed_states: [idle, executing]; }
            halt: Halt { allowed_states: [idle, executing]; }
        }
        link base {
            sensor number: External<Number>() {
                estimator ticker: Ticker() { recover_after: 1; on_degraded: halt; }
            }
        }
    }

    #[test]
    fn commands_that_hang_keep_neither_ticks_nor_health_commands_from_running_and_are_reported()
    -> Result<(), Box<dyn std::error::Error>> {
        let open = HANG.close();
        let builder = Crowded::builder();
        let faults = builder.subscribe(system::Faults);
        let running = builder.start()?;
        running.arm()?;
        for _ in 0..520 {
            drop(running.command(crowded::command::stuck, NoArguments)?);
        }
        let message = fault_of(&faults, "pool");
        assert!(message.starts_with("512 commands have not returned"), "{message}");
        let ticks = running.subscribe(crowded::sensor::base::number::ticker);
        (0..3).for_each(|_| assert!(ticks.recv_timeout(PATIENCE).is_some(), "it ticks"));
        running.publish(crowded::sensor::base::number, running.clock().now(), Number(0.0));
        let start = std::time::Instant::now();
        while running.report().commands.iter().all(|command| command.name != "halt" || command.succeeded == 0) {
            assert!(start.elapsed() < PATIENCE, "`on_degraded` has not run");
            std::thread::sleep(Duration::from_millis(10));
        }
        drop(open);
        assert_eq!(running.stop().safety, Safety::Disarmed);
        Ok(())
    }
}

mod reentrance {
    use super::*;

    static LIVE: OnceLock<Mutex<Option<Live<Own>>>> = OnceLock::new();

    fn live() -> Option<Live<Own>> {
        LIVE.get_or_init(Mutex::default).lock().ok()?.clone()
    }

    fn set_live(live: Option<Live<Own>>) {
        if let Ok(mut set) = LIVE.get_or_init(Mutex::default).lock() {
            *set = live;
        }
    }

    /// Sends to itself at 1, disarms the robot at 2, fails at 3.
    #[derive(Debug)]
    pub(crate) struct Servo;

    impl Actuator for Servo {
        type Options = NoOptions;
        type Command = Number;

        fn init(_: NoOptions, _: &ActuatorContext) -> Result<Self, Fault> {
            Ok(Self)
        }

        fn handle_command(&mut self, number: &Stamped<Number>) -> Result<(), Fault> {
            let Some(live) = live() else { return Ok(()) };
            if number.0 == 1.0 {
                let sent = live.actuate(own::actuator::base::pan::servo, Number(0.0));
                assert_eq!(sent, Err(ActuatorError::Inside));
            } else if number.0 == 2.0 {
                assert_eq!(live.disarm(), Err(DisarmError::Callback));
            } else if number.0 == 3.0 {
                return Err(Fault::new("stalls"));
            }
            Ok(())
        }

        fn disarm(&mut self) -> Result<(), Fault> {
            Ok(())
        }
    }

    robot! {
        robot Own;
        link base {
            joint pan: continuous { axis: z; actuator servo: Servo(); sensor encoder: External<Number>(); link head {} }
        }
    }

    /// One test at a time has the robot.
    static TURN: Mutex<()> = Mutex::new(());

    /// What hangs, hangs on that thread alone.
    fn in_time(test: impl FnOnce() -> Result<(), Box<dyn std::error::Error>> + Send + 'static) {
        let _turn = TURN.lock();
        let (done, ended) = mpsc::channel();
        std::thread::spawn(move || done.send(test().map_err(|error| error.to_string())));
        assert_eq!(ended.recv_timeout(PATIENCE), Ok(Ok(())));
        set_live(None);
    }

    #[test]
    fn an_actuators_own_code_gets_an_error_at_once_where_it_would_wait_for_itself() {
        in_time(|| {
            let running = Own::builder().start()?;
            set_live(Some(running.live()));
            running.arm()?;
            let servo = own::actuator::base::pan::servo;
            let start = std::time::Instant::now();
            running.actuate(servo, Number(1.0))?;
            running.actuate(servo, Number(2.0))?;
            assert!(start.elapsed() < Duration::from_secs(4), "no time limit ended it");
            while running.safety() != Safety::Disarmed {
                std::thread::yield_now();
            }
            running.stop().ok()?;
            Ok(())
        });
    }

    #[test]
    fn the_same_on_virtual_time() {
        in_time(|| {
            let simulation = Own::builder().simulate()?;
            set_live(Some(simulation.live()));
            simulation.arm()?;
            let servo = own::actuator::base::pan::servo;
            simulation.actuate(servo, Number(1.0))?;
            simulation.actuate(servo, Number(2.0))?;
            assert_eq!(simulation.safety(), Safety::Disarmed);
            simulation.stop().ok()?;
            Ok(())
        });
    }

    #[test]
    fn on_virtual_time_a_handler_of_telemetry_may_disarm_when_an_actuator_has_failed() {
        in_time(|| {
            let mut builder = Own::builder();
            let disarmed = Arc::new(Mutex::new(None));
            let result = Arc::clone(&disarmed);
            builder.telemetry(move |_, event| {
                if let (TelemetryEvent::Fault(_), Some(live)) = (event, live()) {
                    *result.lock().expect("it does not panic") = Some(live.disarm());
                }
            });
            let simulation = builder.simulate()?;
            set_live(Some(simulation.live()));
            simulation.arm()?;
            let sent = simulation.actuate(own::actuator::base::pan::servo, Number(3.0));
            assert_eq!(sent, Err(ActuatorError::Failed("stalls".into())));
            assert_eq!(*disarmed.lock().expect("it does not panic"), Some(Ok(())));
            assert_eq!(simulation.safety(), Safety::Disarmed);
            Ok(())
        });
    }
}

mod options {
    use super::*;

    static HANG: Hangs = Hangs::new();
    static ARMED: AtomicBool = AtomicBool::new(false);

    /// Options whose `clone` hangs once.
    #[derive(Debug, Options)]
    pub(crate) struct HangingOptions {
        /// A number.
        #[option(default = 1.0)]
        x: f64,
    }

    impl Clone for HangingOptions {
        fn clone(&self) -> Self {
            if ARMED.swap(false, Ordering::SeqCst) {
                HANG.0.pass("here");
            }
            Self { x: self.x }
        }
    }

    /// Has them.
    #[derive(Debug)]
    pub(crate) struct Bound;

    impl Estimator for Bound {
        type Options = HangingOptions;
        type Input = Number;
        type Output = Number;

        fn init(_: HangingOptions, _: &Context) -> Result<Self, Fault> {
            Ok(Self)
        }

        fn handle_input(&mut self, number: &Stamped<Number>) -> Result<Reply<Number>, Fault> {
            Ok(Reply::emit(number.payload))
        }
    }

    robot! {
        robot Cloning;
        parameters { p: f64 = 1.0, range: 0.0..=2.0; }
        link base { sensor number: External<Number>() { estimator bound: Bound(x = param::p); } }
    }

    #[test]
    fn options_whose_clone_hangs_keep_nobody_else_who_sets_a_parameter() -> Result<(), Box<dyn std::error::Error>> {
        let open = HANG.close();
        let running = Cloning::builder().start()?;
        ARMED.store(true, Ordering::SeqCst);
        let (first, second) = (running.live(), running.live());
        let first = std::thread::spawn(move || first.set_parameter(cloning::param::p, 0.5));
        HANG.0.wait_for(1);
        let (done, ended) = mpsc::channel();
        let set = move || second.set_parameter(cloning::param::p, 0.7).map_err(|error| error.to_string());
        std::thread::spawn(move || done.send(set()));
        let message = ended.recv_timeout(PATIENCE)?.expect_err("nobody can say whether it fits");
        assert!(message.contains("the code of its options has not returned"), "{message}");
        drop(open);
        first.join().expect("it does not panic")?;
        running.set_parameter(cloning::param::p, 0.7)?;
        running.stop().ok()?;
        Ok(())
    }
}

mod payloads {
    use super::*;

    static HANG: Hangs = Hangs::new();
    static LEFT: AtomicI32 = AtomicI32::new(0);

    /// The second copy of a 1 hangs: the first is the journal's.
    #[derive(Debug, Payload)]
    pub(crate) struct Slow {
        /// A number.
        x: f64,
    }

    impl Clone for Slow {
        fn clone(&self) -> Self {
            if self.x == 1.0 && LEFT.fetch_sub(1, Ordering::SeqCst) == 1 {
                HANG.0.pass("here");
            }
            Self { x: self.x }
        }
    }

    robot! {
        robot Copying;
        link base { sensor slow: External<Slow>(); }
    }

    #[test]
    fn with_a_journal_a_payload_whose_clone_hangs_keeps_no_other_publisher()
    -> Result<(), Box<dyn std::error::Error>> {
        let open = HANG.close();
        let mut builder = Copying::builder();
        builder.journal(|_| {});
        let numbers = builder.subscribe(copying::sensor::base::slow);
        let running = builder.start()?;
        LEFT.store(2, Ordering::SeqCst);
        let (first, second) = (running.live(), running.live());
        let publish = |live: Live<Copying>, x| {
            move || live.publish(copying::sensor::base::slow, MonotonicTime::ZERO, Slow { x })
        };
        let first = std::thread::spawn(publish(first, 1.0));
        HANG.0.wait_for(1);
        let second = std::thread::spawn(publish(second, 2.0));
        assert_eq!(numbers.recv_timeout(PATIENCE).map(|number| number.x), Some(2.0));
        drop(open);
        first.join().expect("it does not panic");
        second.join().expect("it does not panic");
        assert_eq!(numbers.recv_timeout(PATIENCE).map(|number| number.x), Some(1.0));
        running.stop().ok()?;
        Ok(())
    }
}
