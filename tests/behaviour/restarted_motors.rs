//! Hardware that a restart, or a change of options, starts while the robot is being disarmed.

use crate::components::{Number, within};
use crate::gate::{Brake, Brakes, Gate};
use bb_core::prelude::*;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The devices of these tests are there once.
static ALONE: Mutex<()> = Mutex::new(());

static GATE: Gate = Gate::new();
static TURNS: AtomicBool = AtomicBool::new(false);
static MADE: AtomicU32 = AtomicU32::new(0);
static CHANGED: AtomicU32 = AtomicU32::new(0);

fn alone() -> MutexGuard<'static, ()> {
    let alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    MADE.store(0, Ordering::SeqCst);
    CHANGED.store(0, Ordering::SeqCst);
    TURNS.store(false, Ordering::SeqCst);
    alone
}

/// Has its torque on from `init` on.
#[derive(Debug)]
pub(crate) struct Servo;

impl Actuator for Servo {
    type Options = NoOptions;
    type Command = Number;

    fn init(_: NoOptions, _: &ActuatorContext) -> Result<Self, Fault> {
        TURNS.store(true, Ordering::SeqCst);
        MADE.fetch_add(1, Ordering::SeqCst);
        Ok(Self)
    }

    fn handle_command(&mut self, _: &Stamped<Number>) -> Result<(), Fault> {
        Err(Fault::new("the cable is loose"))
    }

    fn disarm(&mut self) -> Result<(), Fault> {
        TURNS.store(false, Ordering::SeqCst);
        Ok(())
    }
}

#[derive(Clone, Debug, Options)]
pub(crate) struct FanOptions {
    #[option(default = 1.0, range = 0.0..=10.0)]
    pub(crate) speed: f64,
}

/// Is set to its speed whenever that changes, and registers what stops it once.
#[derive(Debug)]
pub(crate) struct Fan;

impl Sensor for Fan {
    type Options = FanOptions;
    type Output = Number;

    fn init(_: FanOptions, context: &SensorContext) -> Result<Self, Fault> {
        context.on_disarm(|| {
            TURNS.store(false, Ordering::SeqCst);
            Ok(())
        });
        TURNS.store(true, Ordering::SeqCst);
        Ok(Self)
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Number>, Fault> {
        Ok(Reading::nothing())
    }

    fn handle_options(&mut self, _: FanOptions, _: &SensorContext) -> Result<(), Fault> {
        GATE.pass("options");
        TURNS.store(true, Ordering::SeqCst);
        CHANGED.fetch_add(1, Ordering::SeqCst);
        Ok(())
    }
}

/// Takes as long as the gate is closed.
#[derive(Debug)]
pub(crate) struct AtGate;

impl Brakes for AtGate {
    fn brake() -> Result<(), Fault> {
        GATE.pass("brake");
        Ok(())
    }
}

robot! {
    robot Stiff;
    link base {
        sensor brake: Brake<AtGate>() { rate: 10 Hz; }
        joint pan: continuous { axis: z; actuator servo: Servo(); sensor encoder: External<Number>(); link head {} }
    }
}

robot! {
    robot Windy;
    parameters { speed: f64 = 1.0, range: 0.0..=10.0; }
    link base {
        sensor brake: Brake<AtGate>() { rate: 10 Hz; }
        sensor fan: Fan(speed = param::speed) { rate: 100 Hz; }
    }
}

#[test]
fn an_actuator_that_restarts_while_the_robot_is_disarmed_is_disarmed_once_more() {
    let _alone = alone();
    within(60, || {
        let robot = Stiff::builder().start().expect("it starts");
        assert_eq!(robot.arm(), Ok(()));
        GATE.close("brake");
        assert!(robot.actuate(stiff::actuator::base::pan::servo, Number(1.0)).is_err());
        let live = robot.live();
        let disarms = std::thread::spawn(move || live.disarm());
        GATE.wait_for(1);
        // Its backoff is over: it is made again.
        while MADE.load(Ordering::SeqCst) < 2 {
            std::thread::sleep(Duration::from_millis(1));
        }
        GATE.open();
        assert_eq!(disarms.join().expect("it does not panic"), Ok(()));
        assert!(!TURNS.load(Ordering::SeqCst), "its torque is off");
    });
}

#[test]
fn what_a_change_of_options_starts_while_the_robot_is_disarmed_is_stopped() {
    let _alone = alone();
    within(60, || {
        let robot = Windy::builder().start().expect("it starts");
        assert_eq!(robot.arm(), Ok(()));
        GATE.close("options");
        robot.set_parameter(windy::param::speed, 2.0).expect("it may be set");
        GATE.wait_for(1);
        // The callback runs while the options are changed, which is over after the disarming.
        assert_eq!(robot.disarm(), Ok(()));
        GATE.open();
        while CHANGED.load(Ordering::SeqCst) == 0 {
            std::thread::yield_now();
        }
        while TURNS.load(Ordering::SeqCst) {
            std::thread::yield_now();
        }
        assert_eq!(robot.stop().safety, Safety::Disarmed);
    });
}
