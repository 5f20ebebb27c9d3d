//! Hardware is made safe whatever state the robot is in, and what guards it is neither lost nor kept for ever.

use crate::kit::*;
use std::sync::LazyLock;

static IS_ON: AtomicBool = AtomicBool::new(false);
static FAILS: AtomicBool = AtomicBool::new(false);
static IS_SKIPPED: AtomicBool = AtomicBool::new(false);
/// A port, which those have open that share it.
static PORT: LazyLock<Arc<()>> = LazyLock::new(Arc::default);

fn alone() -> MutexGuard<'static, ()> {
    let guard = one_at_a_time();
    [&IS_ON, &FAILS, &IS_SKIPPED].into_iter().for_each(|flag| flag.store(false, Ordering::SeqCst));
    guard
}

/// Starts its motor as it is made; the callback that stops it sets a parameter, and may fail then.
fn lidar(context: &ServiceContext) -> Result<Update, Fault> {
    let (bus, port) = (context.bus().clone(), Arc::clone(&PORT));
    context.on_disarm(move || {
        let _ = (&port, bus.set_parameter("param/speed", 0.0));
        if FAILS.load(Ordering::SeqCst) {
            return Err(Fault::new("it turns on"));
        }
        IS_ON.store(false, Ordering::SeqCst);
        Ok(())
    });
    IS_ON.store(true, Ordering::SeqCst);
    Ok(Box::new(|_| Ok(Reading::nothing())))
}

/// Initialises a spare device, which may be left out.
fn spare(context: &SensorContext) -> Done {
    if !IS_SKIPPED.load(Ordering::SeqCst) {
        return Ok(());
    }
    context.on_disarm(|| Err(Fault::new("there is no such device")));
    Err(Fault::skip("it is not plugged in"))
}

static HERE: Gate = Gate::new();

/// Arms the robot on another thread.
fn arm_later(context: CommandContext) -> Doing {
    Box::pin(async move {
        let bus = context.bus();
        std::thread::spawn(move || bus.arm());
        context.sleep(Duration::from_secs(60)).await;
        Ok(Outcome::done(()))
    })
}

robot! {
    robot Guarded;

    parameters { speed: f64 = 1.0; }

    commands {
        category many { concurrency: 4; }
        block: Task(run = |_| HERE.stuck("a command")) { category: many; allowed_states: [disarmed]; }
        later: Task(run = arm_later) { category: many; allowed_states: [disarmed]; }
    }

    bridges { bridge lidar: Pulse(init = lidar) { rate: 10 Hz; } }

    link base { sensor spare: Source(init = spare, read = |_, _| Ok(Reading::finished())) { rate: 1 Hz; } }
}

fn is_on() -> bool {
    IS_ON.load(Ordering::SeqCst)
}

#[test]
fn what_was_started_in_init_is_stopped_though_the_robot_was_never_armed() {
    let _alone = alone();
    let simulation = Guarded::builder().simulate().expect("it starts");
    assert!(is_on());
    assert_eq!(simulation.stop().safety, Safety::Disarmed);
    assert!(!is_on());
    let running = Guarded::builder().start().expect("it starts");
    assert!(is_on());
    running.stop();
    assert!(!is_on());
}

#[test]
fn a_callback_that_does_something_and_fails_does_so_in_a_replay() -> Result<(), Failure> {
    for (arms, stops) in [(true, false), (true, true), (false, true)] {
        let _alone = alone();
        FAILS.store(true, Ordering::SeqCst);
        let (_, report) = same_again(Guarded::builder, |builder| {
            let mut simulation = builder.simulate()?;
            if arms {
                assert_eq!(simulation.arm(), Ok(()));
            }
            simulation.run_until(at(50));
            if !stops {
                assert!(simulation.disarm().is_err());
            }
            Ok(simulation.stop())
        })?;
        assert_eq!(report.safety, Safety::Error);
    }
    Ok(())
}

#[test]
fn a_robot_that_has_ended_keeps_nothing_open() -> Result<(), Failure> {
    let _alone = alone();
    let kept = Arc::new(());
    for _ in 0..20 {
        let mut builder = Guarded::builder();
        let sink = Arc::clone(&kept);
        builder.journal(move |_| drop(Arc::clone(&sink)));
        let mut simulation = builder.simulate()?;
        simulation.run_until(at(5));
        simulation.stop();
        Guarded::builder().start()?.stop();
    }
    // Threads of a real run may still be on their way out.
    let is_closed = || Arc::strong_count(&PORT) == 1 && Arc::strong_count(&kept) == 1;
    wait_until("nothing is open", is_closed);
    Ok(())
}

#[test]
fn a_component_that_was_left_out_guards_nothing() {
    let _alone = alone();
    IS_SKIPPED.store(true, Ordering::SeqCst);
    let simulation = Guarded::builder().simulate().expect("it starts");
    assert_eq!((simulation.arm(), simulation.disarm()), (Ok(()), Ok(())));
}

#[test]
fn a_command_that_was_cancelled_while_it_waited_arms_nothing() {
    let _alone = alone();
    within(60, || {
        let running = Guarded::builder().start().expect("it starts");
        HERE.close("a command");
        let block = running.command(guarded::command::block, NoArguments).expect("it is allowed");
        HERE.wait_for(1);
        block.cancel();
        let later = running.command(guarded::command::later, NoArguments).expect("it is allowed");
        std::thread::sleep(Duration::from_millis(50));
        later.cancel();
        HERE.open();
        std::thread::sleep(Duration::from_millis(100));
        assert_eq!(running.safety(), Safety::Disarmed);
    });
}
