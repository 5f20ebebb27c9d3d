//! Disarm callbacks and hardware errors of estimators and commands, in a run and in its replay.

use crate::kit::*;
use bb_core::event::Quantity;

/// Number of times that brakes were applied: by the estimator, and by the command.
static BRAKED: [AtomicU32; 2] = [AtomicU32::new(0), AtomicU32::new(0)];

fn braked() -> [u32; 2] {
    [0, 1].map(|number| BRAKED[number].swap(0, Ordering::SeqCst))
}

const TOO_MUCH: f64 = 100.0;
const WRONG: f64 = -1.0;

static LINK: Mutex<Option<SafetyLink>> = Mutex::new(None);

/// Gives an estimator a brake.
fn guard(context: &Context) -> Done {
    context.on_disarm(|| {
        BRAKED[0].fetch_add(1, Ordering::SeqCst);
        Ok(())
    });
    *lock(&LINK) = Some(context.safety());
    Ok(())
}

/// Reports a load that is too heavy as a hardware error.
fn check(_: &mut f64, load: f64) -> Replied {
    if load == WRONG {
        return Err(Fault::new("no such load"));
    }
    if load > TOO_MUCH {
        let error = HardwareError::new(HardwareErrorKind::Overload, "the load");
        lock(&LINK).as_ref().ok_or("it was not made")?.hardware_error(error.with_quantity(load, "kg"));
    }
    Ok(Reply::emit(Number(load)))
}

/// Command that takes 10 ms and has a brake of its own, whose code holds the context of the command.
fn lift(context: CommandContext) -> Doing {
    Box::pin(async move {
        let kept = context.clone();
        context.on_disarm(move || {
            let _ = kept.state();
            BRAKED[1].fetch_add(1, Ordering::SeqCst);
            Ok(())
        });
        context.sleep(Duration::from_millis(10)).await;
        Ok(Outcome::done(()))
    })
}

/// Reports a hardware error in `init`.
fn burn(context: &SensorContext) -> Done {
    context.hardware_error("it is burnt");
    Ok(())
}

robot! {
    robot Hoist;
    commands { lift: Task(run = lift); }
    link base {
        sensor load: External<Number>() { estimator guard: Echo(init = guard, input = check); }
        sensor burnt: Source(init = burn, read = |_, _| Ok(Reading::finished())) { rate: 1 Hz; }
    }
}

/// Locks and resets the counts of brakes, which all tests of this file share.
fn alone() -> MutexGuard<'static, ()> {
    let guard = one_at_a_time();
    braked();
    guard
}

/// Runs `script` on a robot, then replays its journal: the replay is the same, and applies no brake.
fn again(script: impl FnOnce(&mut Simulation<Hoist>) -> Result<(), Failure>) -> Result<(), Failure> {
    let _alone = alone();
    same_again(Hoist::builder, |builder| {
        let mut simulation = builder.simulate()?;
        script(&mut simulation)?;
        let report = simulation.stop();
        braked();
        Ok(report)
    })?;
    assert_eq!(braked(), [0, 0], "a replay has no hardware");
    Ok(())
}

#[test]
fn an_estimator_brakes_and_reports_a_hardware_error() -> Result<(), Failure> {
    again(|simulation| {
        // What a sensor said as it was made.
        assert_eq!(simulation.safety(), Safety::Error);
        assert_eq!((simulation.force_disarm(), simulation.arm()), (Ok(()), Ok(())));
        braked();
        // After a restart there is one brake, not two.
        simulation.publish(hoist::sensor::base::load, at(1), Number(WRONG));
        simulation.publish(hoist::sensor::base::load, at(50), Number(TOO_MUCH));
        assert_eq!((simulation.safety(), braked()), (Safety::Armed, [0, 0]));
        let errors = simulation.subscribe(system::SafetyErrors);
        simulation.publish(hoist::sensor::base::load, at(51), Number(TOO_MUCH + 1.0));
        assert_eq!((simulation.safety(), braked()), (Safety::Error, [1, 0]));
        let report = simulation.report();
        assert_eq!(report.estimator("sensor/base/load/guard").map(|guard| guard.restarts), Some(1));
        // For programs, by its kind and its value.
        let error = errors.try_recv().expect("it is published").payload;
        assert_eq!((error.path, error.error.kind), ("sensor/base/load/guard", HardwareErrorKind::Overload));
        assert_eq!(error.error.quantity, Some(Quantity { value: TOO_MUCH + 1.0, unit: "kg" }));
        // For people, with what a sensor said as it was made.
        let lines: Vec<_> = report.safety_errors.iter().map(ToString::to_string).collect();
        let load = "sensor/base/load/guard was unsafe: the load (overload: 101 kg)";
        assert_eq!(lines, ["sensor/base/burnt was unsafe: it is burnt", load]);
        Ok(())
    })
}

#[test]
fn a_command_brakes_while_it_runs() -> Result<(), Failure> {
    again(|simulation| {
        assert_eq!((simulation.force_disarm(), simulation.arm()), (Ok(()), Ok(())));
        braked();
        simulation.command(hoist::command::lift, NoArguments)?;
        simulation.run_until(at(5));
        assert_eq!(simulation.disarm(), Ok(()));
        assert_eq!(braked(), [1, 1], "it was running");
        simulation.run_until(at(6));
        assert_eq!(braked(), [0, 0], "it is forgotten with its future");
        assert_eq!(simulation.arm(), Ok(()));
        simulation.command(hoist::command::lift, NoArguments)?;
        simulation.run_until(at(30));
        assert_eq!(simulation.disarm(), Ok(()));
        assert_eq!(braked(), [1, 0], "it has ended");
        Ok(())
    })
}
