//! Actuators whose code sends to other actuators, and robots whose disarm callbacks disarm other robots: where they would wait for
//! each other, one of them is told.

use crate::components::{Number, within};
use bb_core::prelude::*;
use bb_core::run::ActuatorError;
use bb_core::{DisarmError, Live};
use std::sync::{Barrier, Mutex};
use std::time::Instant;

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

/// Robots each of which disarms the next one as it is disarmed, and what the callbacks were told, in the order of their return.
static RING: Mutex<Vec<Live<Linked>>> = Mutex::new(Vec::new());
static DISARMS: Mutex<Vec<Result<(), DisarmError>>> = Mutex::new(Vec::new());

/// Options of [`Tie`].
#[derive(Clone, Debug, Options)]
pub(crate) struct TieOptions {
    #[option(default = 0)]
    number: u32,
}

#[derive(Debug)]
pub(crate) struct Tie;

impl Sensor for Tie {
    type Options = TieOptions;
    type Output = Number;

    fn init(TieOptions { number }: TieOptions, context: &SensorContext) -> Result<Self, Fault> {
        context.on_disarm(move || {
            let ring = RING.lock().map_err(|_| "it panicked")?.clone();
            if ring.is_empty() {
                return Ok(());
            }
            let told = ring[(number as usize + 1) % ring.len()].disarm();
            DISARMS.lock().map_err(|_| "it panicked")?.push(told);
            Ok(())
        });
        Ok(Self)
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Number>, Fault> {
        Ok(Reading::nothing())
    }
}

robot! {
    robot Linked;
    link base { sensor tie: Tie() { rate: 1 Hz; } }
}

#[test]
fn robots_that_disarm_each_other_in_a_circle_do_not_wait_for_each_other() {
    within(120, || {
        for count in 2..=4 {
            let mut robots = Vec::new();
            for number in 0..count {
                let mut builder = Linked::builder();
                builder.options(linked::sensor::base::tie).number = number;
                robots.push(builder.start().expect("it starts"));
            }
            *RING.lock().expect("it does not panic") = robots.iter().map(|robot| robot.live()).collect();
            for round in 0..20 {
                robots.iter().for_each(|robot| robot.arm().expect("it may be armed"));
                DISARMS.lock().expect("it does not panic").clear();
                let start = Instant::now();
                // One of them, or all at once.
                let told: Vec<_> = if round % 2 == 0 {
                    vec![robots[round % robots.len()].disarm()]
                } else {
                    std::thread::scope(|scope| {
                        let disarms: Vec<_> = robots.iter().map(|robot| scope.spawn(|| robot.disarm())).collect();
                        disarms.into_iter().map(|disarm| disarm.join().expect("it does not panic")).collect()
                    })
                };
                // Shorter than any time that a robot gives code that hangs.
                assert!(start.elapsed() < Duration::from_secs(2), "{:?}", start.elapsed());
                assert!(told.iter().all(Result::is_ok), "{told:?}");
                assert!(robots.iter().all(|robot| robot.safety() == Safety::Disarmed));
                let disarms = DISARMS.lock().expect("it does not panic").clone();
                assert_eq!(disarms.len(), robots.len());
                if round % 2 == 0 {
                    let told = disarms.iter().filter(|told| **told == Err(DisarmError::Callback)).count();
                    assert_eq!((told, disarms.iter().filter(|told| told.is_ok()).count()), (1, robots.len() - 1));
                }
            }
            RING.lock().expect("it does not panic").clear();
        }
    });
}
