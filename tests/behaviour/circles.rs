//! Actuators whose code sends to other actuators: where they would wait for each other, one of them is told.

use crate::components::{Number, within};
use bb_core::Live;
use bb_core::prelude::*;
use bb_core::run::ActuatorError;
use std::sync::{Barrier, Mutex};

/// Both are inside their code here.
static BOTH: Barrier = Barrier::new(2);

/// What they were told.
static TOLD: Mutex<Vec<Result<(), ActuatorError>>> = Mutex::new(Vec::new());

static LIVE: Mutex<Option<Live<Mirrored>>> = Mutex::new(None);

/// At 1 it sends to the other one, once that one is inside its code as well.
#[derive(Debug)]
pub(crate) struct Mirror<const IS_LEFT: bool>;

impl<const IS_LEFT: bool> Actuator for Mirror<IS_LEFT> {
    type Options = NoOptions;
    type Command = Number;

    fn init(_: NoOptions, _: &ActuatorContext) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_command(&mut self, number: &Stamped<Number>) -> Result<(), Fault> {
        if number.0 == 1.0 {
            let live = LIVE.lock().ok().and_then(|live| live.clone()).ok_or("it does not run")?;
            BOTH.wait();
            let told = if IS_LEFT {
                live.actuate(mirrored::actuator::base::tilt::right, Number(0.0))
            } else {
                live.actuate(mirrored::actuator::base::pan::left, Number(0.0))
            };
            TOLD.lock().map_err(|_| "it panicked")?.push(told);
        }
        Ok(())
    }

    fn disarm(&mut self) -> Result<(), Fault> {
        Ok(())
    }
}

robot! {
    robot Mirrored;
    link base {
        joint pan: continuous {
            axis: z;
            actuator left: Mirror<true>();
            sensor a: External<Number>();
            link head {}
        }
        joint tilt: continuous {
            axis: y;
            actuator right: Mirror<false>();
            sensor b: External<Number>();
            link eye {}
        }
    }
}

#[test]
fn two_actuators_that_send_to_each_other_do_not_wait_for_ever() {
    within(60, || {
        let running = Mirrored::builder().start().expect("it starts");
        *LIVE.lock().expect("it does not panic") = Some(running.live());
        running.arm().expect("it may be armed");
        for _ in 0..100 {
            let (left, right) = (running.live(), running.live());
            let left = std::thread::spawn(move || left.actuate(mirrored::actuator::base::pan::left, Number(1.0)));
            let right =
                std::thread::spawn(move || right.actuate(mirrored::actuator::base::tilt::right, Number(1.0)));
            assert_eq!([left, right].map(|sends| sends.join().expect("it does not panic")), [Ok(()), Ok(())]);
            let told = std::mem::take(&mut *TOLD.lock().expect("it does not panic"));
            let refused = told.iter().filter(|told| **told == Err(ActuatorError::Inside)).count();
            assert_eq!((told.len(), refused), (2, 1), "{told:?}");
        }
        *LIVE.lock().expect("it does not panic") = None;
        running.stop().ok().expect("nothing has failed");
    });
}
