//! Model-checks every order in which threads can enter the control state: `RUSTFLAGS="--cfg loom"`.
//!
//! In each order, a robot that was told to stop stays disarmed, hardware that could not be made safe leads to
//! `error`, and an actuator does not move after it was made safe.

use super::{Control, bare};
use crate::component::{Caller, Controls, Guardian, SafetyControls};
use crate::event::Safety;
use crate::fault::Fault;
use crate::node::Mode;
use loom::sync::{Arc, Mutex};
use loom::thread;

/// A robot without components.
fn control() -> Control {
    bare::control(Mode::Real, &[], [])
}

/// A motor as driven by the runtime: under one lock, it either checks that the robot is armed and moves, or is made
/// safe.
#[derive(Clone, Default)]
struct Motor(Arc<Mutex<Positions>>);

#[derive(Default)]
struct Positions {
    is_safe: bool,
    has_moved_though_safe: bool,
}

impl Motor {
    fn of(control: &Control) -> Self {
        let motor = Self::default();
        let disarmed = motor.clone();
        let disarm = move || {
            disarmed.0.lock().expect("nobody panicked").is_safe = true;
            Ok(())
        };
        control.on_disarm("motor", None, std::sync::Arc::new(disarm));
        motor
    }

    fn drive(&self, control: &Control) {
        let mut positions = self.0.lock().expect("nobody panicked");
        if control.safety_now() == Safety::Armed {
            positions.has_moved_though_safe |= positions.is_safe;
        }
    }

    fn check(&self) {
        assert!(!self.0.lock().expect("nobody panicked").has_moved_though_safe);
    }
}

/// The code of a thread.
type Thread = fn(&Control, &Motor);

/// Lets these threads enter an armed robot, in all orders with at most this many preemptions; `holds` is checked at
/// the end.
fn check<const THREADS: usize>(threads: [Thread; THREADS], prepare: fn(&Control) -> Motor, holds: fn(&Control)) {
    let mut checker = loom::model::Builder::new();
    checker.preemption_bound = Some(2);
    checker.check(move || {
        let control = control();
        let motor = prepare(&control);
        assert_eq!(control.arm(&Caller::PROGRAM), Ok(()));
        let spawned: Vec<_> = threads
            .iter()
            .map(|&run| {
                let (control, motor) = (control.clone(), motor.clone());
                thread::spawn(move || run(&control, &motor))
            })
            .collect();
        spawned.into_iter().for_each(|thread| thread.join().expect("it does not panic"));
        // Disarm callbacks have threads of their own.
        while control.is_disarming() {
            thread::yield_now();
        }
        holds(&control);
        assert_eq!(control.safety(), control.safety_now());
        motor.check();
    });
}

const DRIVES: Thread = |control, motor| motor.drive(control);
const DISARMS: Thread = |control, _| {
    let _ = control.disarm(false, &Caller::PROGRAM);
};
const STOPS: Thread = |control, _| control.begin_stop(&Caller::PROGRAM);
const ARMS: Thread = |control, _| {
    let _ = control.arm(&Caller::PROGRAM);
};
const BURNS: Thread = |control, _| control.hardware_error("motor", "it burns".into());
/// The first time that the robot is disarmed.
const TIME_IS_OVER: Thread = |control, _| control.disarm_timeout(1);

/// A brake that fails. There is no motor: a model has room for five threads.
fn brake(control: &Control) -> Motor {
    control.on_disarm("brake", None, std::sync::Arc::new(|| Err(Fault::new("no air"))));
    Motor::default()
}

#[test]
fn a_motor_that_is_driven_while_the_robot_is_disarmed() {
    check([DRIVES, DISARMS], Motor::of, |control| assert_eq!(control.safety(), Safety::Disarmed));
}

#[test]
fn a_robot_that_is_armed_while_it_stops() {
    check([STOPS, ARMS], Motor::of, |control| {
        assert_eq!(control.safety(), Safety::Disarmed);
        assert!(control.stop_signal().is_set(), "sensors are told");
    });
}

#[test]
fn a_hardware_error_while_the_robot_is_disarmed() {
    check([BURNS, DISARMS], Motor::of, |control| assert_eq!(control.safety(), Safety::Error));
}

#[test]
fn a_callback_that_fails_as_its_time_is_over() {
    check([DISARMS, TIME_IS_OVER], brake, |control| assert_eq!(control.safety(), Safety::Error));
}

#[test]
fn a_callback_that_fails_while_the_robot_stops() {
    check([DISARMS, STOPS], brake, |control| {
        assert_eq!(control.safety(), Safety::Error);
        assert!(control.stop_signal().is_set());
    });
}

#[test]
fn an_init_that_fails_while_the_robot_is_disarmed() {
    let mut checker = loom::model::Builder::new();
    checker.preemption_bound = Some(2);
    checker.check(|| {
        let control = control();
        assert_eq!(control.arm(&Caller::PROGRAM), Ok(()));
        let motor = Motor::default();
        let (starting, started) = (control.clone(), motor.clone());
        let starts = thread::spawn(move || {
            let failed = starting.replacing_hooks("motor", true, || {
                let stopped = started.clone();
                let disarm = move || {
                    stopped.0.lock().expect("nobody panicked").is_safe = true;
                    Ok(())
                };
                starting.on_disarm("motor", None, std::sync::Arc::new(disarm));
                started.0.lock().expect("nobody panicked").is_safe = false;
                Err::<(), _>(Fault::new("no handshake").into())
            });
            assert!(failed.is_err());
        });
        let _ = control.disarm(false, &Caller::PROGRAM);
        starts.join().expect("it does not panic");
        while control.is_disarming() {
            thread::yield_now();
        }
        // If the disarming runs the callback at that moment, it runs it once more, on its own thread.
        while control.makes_safe() {
            thread::yield_now();
        }
        assert!(motor.0.lock().expect("nobody panicked").is_safe, "its callback ran after it was started");
    });
}

#[test]
fn a_callback_that_is_registered_while_the_robot_stops() {
    let mut checker = loom::model::Builder::new();
    checker.preemption_bound = Some(2);
    checker.check(|| {
        let control = control();
        assert_eq!(control.arm(&Caller::PROGRAM), Ok(()));
        let motor = Motor::default();
        let (stopped, started) = (control.clone(), motor.clone());
        let (starting, stops) = (control.clone(), thread::spawn(move || stopped.begin_stop(&Caller::PROGRAM)));
        let starts = thread::spawn(move || {
            let disarm = move || {
                started.0.lock().expect("nobody panicked").is_safe = true;
                Ok(())
            };
            starting.on_disarm("motor", None, std::sync::Arc::new(disarm));
        });
        [stops, starts].into_iter().for_each(|thread| thread.join().expect("it does not panic"));
        while control.is_disarming() {
            thread::yield_now();
        }
        assert!(motor.0.lock().expect("nobody panicked").is_safe, "it came before, during or after");
    });
}
