//! Hardware that a restart, or a change of options, starts while the robot is being disarmed.

use crate::kit::*;

static GATE: Gate = Gate::new();
static TURNS: AtomicBool = AtomicBool::new(false);
static MADE: AtomicU32 = AtomicU32::new(0);
static CHANGED: AtomicU32 = AtomicU32::new(0);

fn alone() -> MutexGuard<'static, ()> {
    let alone = one_at_a_time();
    [&MADE, &CHANGED].into_iter().for_each(|number| number.store(0, Ordering::SeqCst));
    TURNS.store(false, Ordering::SeqCst);
    alone
}

/// Starts a motor, and registers what stops it once; it is set to its speed whenever that changes.
fn fan(context: &SensorContext) -> Done {
    context.on_disarm(|| {
        TURNS.store(false, Ordering::SeqCst);
        Ok(())
    });
    TURNS.store(true, Ordering::SeqCst);
    Ok(())
}

fn set_speed(_: f64) -> Done {
    GATE.pass("options");
    TURNS.store(true, Ordering::SeqCst);
    CHANGED.fetch_add(1, Ordering::SeqCst);
    Ok(())
}

/// A disarm callback takes as long as the gate is closed.
fn brake(context: &SensorContext) -> Done {
    context.on_disarm(|| GATE.done("brake"));
    Ok(())
}

/// Turns the torque on from here on.
fn torque_on(_: &ActuatorContext) -> Done {
    TURNS.store(true, Ordering::SeqCst);
    MADE.fetch_add(1, Ordering::SeqCst);
    Ok(())
}

fn torque_off(_: f64) -> Done {
    TURNS.store(false, Ordering::SeqCst);
    Ok(())
}

robot! {
    robot Windy;
    parameters { speed: f64 = 1.0, range: 0.0..=10.0; }
    link base {
        sensor brake: Source(init = brake) { rate: 10 Hz; }
        sensor fan: Source(init = fan, gain = param::speed, tune = Some(set_speed)) { rate: 100 Hz; }
    }
}

#[test]
fn an_actuator_that_restarts_while_the_robot_is_disarmed_is_disarmed_once_more() {
    let _alone = alone();
    within(60, || {
        let mut builder = Plain::builder();
        builder.options(SOURCE).init = brake;
        let servo = builder.options(SERVO);
        (servo.init, servo.disarm) = (torque_on, torque_off);
        servo.command = |_| Err(Fault::new("the cable is loose"));
        let robot = armed(builder);
        GATE.close("brake");
        assert!(robot.actuate(SERVO, Number(1.0)).is_err());
        let live = robot.live();
        let disarms = std::thread::spawn(move || live.disarm());
        GATE.wait_for(1);
        // Its backoff is over: it is made again.
        wait_until("it is made again", || MADE.load(Ordering::SeqCst) == 2);
        GATE.open();
        assert_eq!(disarms.join().expect("it does not panic"), Ok(()));
        assert!(!TURNS.load(Ordering::SeqCst), "its torque is off");
    });
}

#[test]
fn what_a_change_of_options_starts_while_the_robot_is_disarmed_is_stopped() {
    let _alone = alone();
    within(60, || {
        let robot = armed(Windy::builder());
        GATE.close("options");
        robot.set_parameter(windy::param::speed, 2.0).expect("it may be set");
        GATE.wait_for(1);
        // The callback runs while the options are changed, which is over after the disarming.
        assert_eq!(robot.disarm(), Ok(()));
        GATE.open();
        wait_until("its options are changed", || CHANGED.load(Ordering::SeqCst) == 1);
        wait_until("it is stopped", || !TURNS.load(Ordering::SeqCst));
        assert_eq!(robot.stop().safety, Safety::Disarmed);
    });
}
