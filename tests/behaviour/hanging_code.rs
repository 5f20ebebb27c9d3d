//! Code that hangs, or that calls where it would wait for itself: it is reported while the robot runs, and stops nothing else.

use crate::components::{Doing, Done, Number, Servo, Task, at_once};
use crate::gate::{Gate, Place, Stuck};
use bb_core::prelude::*;
use bb_core::run::{ActuatorError, Report};
use bb_core::{ComponentFault, DisarmError, Live, Running, TelemetryEvent};
use std::sync::{Arc, Mutex, OnceLock, mpsc};

/// Time after which code counts as hanging, even on a busy machine.
const PATIENCE: Duration = Duration::from_secs(20);

/// Gate at which the code of one test hangs.
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

/// Guard that opens the gate when the test ends, also by a panic.
struct Open<'a>(&'a Gate);

impl Drop for Open<'_> {
    fn drop(&mut self) {
        self.0.open();
    }
}

/// Waits for a fault at `path`, and returns its message.
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

    fn hang(_: f64) -> Done {
        HANG.0.pass("here");
        Ok(())
    }

    fn wait(_: CommandContext) -> Doing {
        Box::pin(async { hang(0.0).map(Outcome::done) })
    }

    robot! {
        robot Reporting;
        commands { wait: Task(run = wait) { allowed_states: [idle]; } }
        link base {
            joint pan: continuous { axis: z; actuator servo: Servo(command = hang); sensor encoder: External<Number>(); link head {} }
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

mod pools {
    use super::*;

    static HANG: Hangs = Hangs::new();

    /// Place at which commands hang until all are let go.
    pub(crate) struct InPool;

    impl Place for InPool {
        const GATE: &'static Gate = &HANG.0;
        const NAME: &'static str = "here";
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
            halt: Task(run = at_once) { allowed_states: [idle, executing]; }
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

    /// Robot that its own actuator stops.
    static RUNNING: Mutex<Option<Running<Own>>> = Mutex::new(None);

    static LIVE: OnceLock<Mutex<Option<Live<Own>>>> = OnceLock::new();

    fn live() -> Option<Live<Own>> {
        LIVE.get_or_init(Mutex::default).lock().ok()?.clone()
    }

    fn set_live(live: Option<Live<Own>>) {
        if let Ok(mut set) = LIVE.get_or_init(Mutex::default).lock() {
            *set = live;
        }
    }

    /// Sends at 1 to its actuator itself, at 2 disarms the robot, at 3 fails, and at 4 stops the robot.
    fn turn(number: f64) -> Done {
        let Some(live) = live() else { return Ok(()) };
        if number == 1.0 {
            let sent = live.actuate(own::actuator::base::pan::servo, Number(0.0));
            assert_eq!(sent, Err(ActuatorError::Inside));
        } else if number == 2.0 {
            assert_eq!(live.disarm(), Err(DisarmError::Callback));
        } else if number == 3.0 {
            return Err(Fault::new("stalls"));
        } else if number == 4.0 {
            let running = RUNNING.lock().map_err(|_| "it panicked")?.take().ok_or("it does not run")?;
            let start = std::time::Instant::now();
            let report = running.stop();
            assert!(start.elapsed() < Duration::from_millis(6500), "{:?}", start.elapsed());
            assert_eq!(report.safety, Safety::Error, "nobody knows whether it is safe");
            let paths: Vec<_> = report.faults.iter().map(|fault| fault.path).collect();
            assert!(paths.contains(&"actuator/base/pan/servo"), "{paths:?}");
        }
        Ok(())
    }

    /// Stops the robot, which knows that it cannot wait for this.
    fn stop(_: CommandContext) -> Doing {
        Box::pin(async {
            let running = RUNNING.lock().map_err(|_| "it panicked")?.take().ok_or("it does not run")?;
            let start = std::time::Instant::now();
            let report = running.stop();
            STOPPED.set((start.elapsed(), report)).map_err(|_| "it has stopped twice")?;
            Ok(Outcome::done(()))
        })
    }

    static STOPPED: OnceLock<(Duration, Report)> = OnceLock::new();

    robot! {
        robot Own;
        commands { stop: Task(run = stop) { allowed_states: [disarmed]; } }
        link base {
            joint pan: continuous { axis: z; actuator servo: Servo(command = turn); sensor encoder: External<Number>(); link head {} }
        }
    }

    /// One test at a time has the robot.
    static TURN: Mutex<()> = Mutex::new(());

    /// Runs a test on a thread of its own: code that hangs, hangs on that thread alone.
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
    fn an_actuators_own_code_that_stops_the_robot_is_not_waited_for_beyond_the_limit() {
        in_time(|| {
            let running = Own::builder().start()?;
            let live = running.live();
            set_live(Some(live.clone()));
            live.arm()?;
            *RUNNING.lock().map_err(|_| "it panicked")? = Some(running);
            live.actuate(own::actuator::base::pan::servo, Number(4.0))?;
            Ok(())
        });
    }

    #[test]
    fn a_command_that_stops_the_robot_is_not_waited_for() {
        in_time(|| {
            let running = Own::builder().start()?;
            let live = running.live();
            *RUNNING.lock().map_err(|_| "it panicked")? = Some(running);
            live.command(own::command::stop, NoArguments)?;
            let start = std::time::Instant::now();
            while STOPPED.get().is_none() {
                assert!(start.elapsed() < PATIENCE, "it does not return");
                std::thread::sleep(Duration::from_millis(1));
            }
            let Some((after, report)) = STOPPED.get() else { return Err("it has not stopped".into()) };
            assert!(*after < Duration::from_secs(3), "it has waited for itself: {after:?}");
            assert_eq!(report.safety, Safety::Disarmed);
            let said: Vec<_> = report.faults.iter().map(|fault| fault.to_string()).collect();
            assert_eq!(said, ["command/stop failed: did not come back when the robot stopped"]);
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

mod calls {
    use super::*;
    use crate::components::{Ask, Echo, Replied};

    static HANG: Hangs = Hangs::new();

    fn hang(_: &mut f64, number: f64) -> Replied {
        HANG.0.pass("here");
        Ok(Reply::emit(Number(number)))
    }

    robot! {
        robot Absent;
        link base { sensor number: External<Number>() { estimator absent: Echo(input = hang); } }
    }

    /// The caller waits for 5 s, which real time takes: there is no other thread on virtual time.
    #[test]
    fn a_call_of_an_estimator_that_hangs_ends_in_time() -> Result<(), Box<dyn std::error::Error>> {
        let running = Absent::builder().start()?;
        let open = HANG.close();
        let live = running.live();
        let publishing =
            std::thread::spawn(move || live.publish(absent::sensor::base::number, live.clock().now(), Number(1.0)));
        HANG.0.wait_for(1);
        let start = std::time::Instant::now();
        let error = running.call(absent::sensor::base::number::absent, Ask).expect_err("it hangs").to_string();
        let waited = start.elapsed();
        assert_eq!(error, "sensor/base/number/absent has been busy for 5 s and has not answered");
        assert!(waited >= Duration::from_secs(5) && waited < Duration::from_secs(5) + PATIENCE, "{waited:?}");
        drop(open);
        publishing.join().expect("it publishes");
        assert_eq!(running.call(absent::sensor::base::number::absent, Ask)?, 0.0, "it goes on");
        running.stop();
        Ok(())
    }
}
