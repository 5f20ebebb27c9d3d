//! Actuators whose code sends to other actuators, disarms other robots or stops its own, and robots whose disarm callbacks disarm
//! other robots: where they would wait for each other, one of them is told.

use crate::components::{Number, within};
use bb_core::prelude::*;
use bb_core::run::ActuatorError;
use bb_core::{DisarmError, Live, Running};
use std::sync::mpsc::{Receiver, Sender, channel};
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

/// Two robots: the callback of one sends to the actuator of the other one, whose code disarms the first one.
static LEVER: Mutex<Option<Live<Levered>>> = Mutex::new(None);
static PULLER: Mutex<Option<Live<Pulling>>> = Mutex::new(None);

/// Tells that the callback is about to send.
static IS_SENDING: Mutex<Option<Sender<()>>> = Mutex::new(None);
/// What is awaited before the actuator's code disarms.
static BEFORE_DISARMING: Mutex<Option<Receiver<()>>> = Mutex::new(None);

/// What the callback was told, and what the actuator's code was told.
static SENT: Mutex<Vec<Result<(), ActuatorError>>> = Mutex::new(Vec::new());
static DISARMED: Mutex<Vec<Result<(), DisarmError>>> = Mutex::new(Vec::new());

/// Tells that the actuator's code has begun.
static HAS_BEGUN: Mutex<Option<Sender<()>>> = Mutex::new(None);

fn await_once(receiver: &Mutex<Option<Receiver<()>>>) {
    if let Some(receiver) = receiver.lock().ok().and_then(|mut receiver| receiver.take()) {
        let _ = receiver.recv();
    }
}

/// At 1 it disarms the robot whose callback sends to it.
#[derive(Debug)]
pub(crate) struct Lever;

impl Actuator for Lever {
    type Options = NoOptions;
    type Command = Number;

    fn init(_: NoOptions, _: &ActuatorContext) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_command(&mut self, number: &Stamped<Number>) -> Result<(), Fault> {
        if number.0 == 1.0 {
            if let Some(has_begun) = HAS_BEGUN.lock().map_err(|_| "it panicked")?.take() {
                has_begun.send(())?;
            }
            await_once(&BEFORE_DISARMING);
            let live = PULLER.lock().map_err(|_| "it panicked")?.clone().ok_or("it does not run")?;
            DISARMED.lock().map_err(|_| "it panicked")?.push(live.disarm());
        }
        Ok(())
    }

    fn disarm(&mut self) -> Result<(), Fault> {
        Ok(())
    }
}

/// Sends to the lever as its robot is disarmed.
#[derive(Debug)]
pub(crate) struct Puller;

impl Sensor for Puller {
    type Options = NoOptions;
    type Output = Number;

    fn init(_: NoOptions, context: &SensorContext) -> Result<Self, Fault> {
        context.on_disarm(|| {
            let live = LEVER.lock().map_err(|_| "it panicked")?.clone();
            if let Some(is_sending) = IS_SENDING.lock().map_err(|_| "it panicked")?.take() {
                is_sending.send(())?;
            }
            if let Some(live) = live {
                let told = live.actuate(levered::actuator::base::pan::lever, Number(0.0));
                SENT.lock().map_err(|_| "it panicked")?.push(told);
            }
            Ok(())
        });
        Ok(Self)
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Number>, Fault> {
        Ok(Reading::nothing())
    }
}

robot! {
    robot Levered;
    link base {
        joint pan: continuous {
            axis: z;
            actuator lever: Lever();
            sensor a: External<Number>();
            link head {}
        }
    }
}

robot! {
    robot Pulling;
    link base { sensor puller: Puller() { rate: 1 Hz; } }
}

/// What the callback and the actuator's code were told.
type Told = (Vec<Result<(), ActuatorError>>, Vec<Result<(), DisarmError>>);

/// Makes the lever disarm the other robot, or disarms that one while the lever's code runs, and returns both robots' answers.
fn pull(is_disarmed_first: bool) -> Told {
    let levered = Levered::builder().start().expect("it starts");
    let pulling = Pulling::builder().start().expect("it starts");
    *LEVER.lock().expect("it does not panic") = Some(levered.live());
    *PULLER.lock().expect("it does not panic") = Some(pulling.live());
    levered.arm().expect("it may be armed");
    pulling.arm().expect("it may be armed");
    let (has_begun, begun) = channel();
    *HAS_BEGUN.lock().expect("it does not panic") = Some(has_begun);
    let (go, goes) = channel::<()>();
    *BEFORE_DISARMING.lock().expect("it does not panic") = is_disarmed_first.then_some(goes);
    let start = Instant::now();
    let live = levered.live();
    let lever = std::thread::spawn(move || live.actuate(levered::actuator::base::pan::lever, Number(1.0)));
    if is_disarmed_first {
        begun.recv().expect("its code begins");
        let (is_sending, sending) = channel();
        *IS_SENDING.lock().expect("it does not panic") = Some(is_sending);
        let live = pulling.live();
        let disarms = std::thread::spawn(move || live.disarm());
        sending.recv().expect("its callback runs");
        // The callback waits for the lever by now.
        std::thread::sleep(Duration::from_millis(300));
        drop(go);
        assert_eq!(disarms.join().expect("it does not panic"), Ok(()));
    }
    assert_eq!(lever.join().expect("it does not panic"), Ok(()));
    // Shorter than any time that a robot gives code that hangs.
    assert!(start.elapsed() < Duration::from_secs(3), "{:?}", start.elapsed());
    assert_eq!(pulling.safety(), Safety::Disarmed);
    LEVER.lock().expect("it does not panic").take();
    PULLER.lock().expect("it does not panic").take();
    pulling.stop().ok().expect("nothing has failed");
    levered.stop().ok().expect("nothing has failed");
    let sent = std::mem::take(&mut *SENT.lock().expect("it does not panic"));
    (sent, std::mem::take(&mut *DISARMED.lock().expect("it does not panic")))
}

#[test]
fn an_actuators_code_that_disarms_a_robot_whose_callback_sends_to_it_does_not_wait() {
    within(60, || {
        for _ in 0..5 {
            assert_eq!(pull(false), (vec![Err(ActuatorError::Inside)], vec![Ok(())]));
            // Whichever waits last closes the circle, and is told; the other one goes on.
            let told = pull(true);
            let by_lever = (vec![Ok(())], vec![Err(DisarmError::Callback)]);
            let by_callback = (vec![Err(ActuatorError::Inside)], vec![Ok(())]);
            assert!(told == by_lever || told == by_callback, "{told:?}");
        }
    });
}

/// Stopped by its own actuator, or by its own disarm callback.
static STOPS: Mutex<Option<Running<Halting>>> = Mutex::new(None);
static STOPPED: Mutex<Option<(Duration, bb_core::Report)>> = Mutex::new(None);
/// The actuators that were disarmed, in order.
static SAFE: Mutex<Vec<&'static str>> = Mutex::new(Vec::new());

fn stop_from_inside() -> Result<(), Fault> {
    let running = STOPS.lock().map_err(|_| "it panicked")?.take().ok_or("it does not run")?;
    let start = Instant::now();
    let report = running.stop();
    *STOPPED.lock().map_err(|_| "it panicked")? = Some((start.elapsed(), report));
    Ok(())
}

/// At 1 its code stops the robot; at 2 its disarming does, the next time.
#[derive(Debug)]
pub(crate) struct Halt {
    path: &'static str,
    number: f64,
}

impl Actuator for Halt {
    type Options = NoOptions;
    type Command = Number;

    fn init(_: NoOptions, context: &ActuatorContext) -> Result<Self, Fault> {
        Ok(Self { path: context.path(), number: 0.0 })
    }

    fn handle_command(&mut self, number: &Stamped<Number>) -> Result<(), Fault> {
        self.number = number.0;
        if number.0 == 1.0 { stop_from_inside() } else { Ok(()) }
    }

    fn disarm(&mut self) -> Result<(), Fault> {
        if self.path.ends_with("other") {
            // Slower than the one that stops the robot: it is waited for.
            std::thread::sleep(Duration::from_millis(700));
        } else if std::mem::take(&mut self.number) == 2.0 {
            stop_from_inside()?;
        }
        SAFE.lock().map_err(|_| "it panicked")?.push(self.path);
        Ok(())
    }
}

robot! {
    robot Halting;
    link base {
        joint pan: continuous {
            axis: z;
            actuator halt: Halt();
            sensor a: External<Number>();
            link head {}
        }
        joint tilt: continuous {
            axis: y;
            actuator other: Halt();
            sensor b: External<Number>();
            link eye {}
        }
    }
}

#[test]
fn a_stop_by_code_that_its_disarming_waits_for_waits_for_all_other_code() {
    within(60, || {
        for number in [1.0, 2.0] {
            SAFE.lock().expect("it does not panic").clear();
            let running = Halting::builder().start().expect("it starts");
            let live = running.live();
            live.arm().expect("it may be armed");
            *STOPS.lock().expect("it does not panic") = Some(running);
            let _ = live.actuate(halting::actuator::base::pan::halt, Number(number));
            let _ = live.disarm();
            let mut stopped = None;
            let start = Instant::now();
            while stopped.is_none() && start.elapsed() < Duration::from_secs(20) {
                std::thread::sleep(Duration::from_millis(5));
                stopped = STOPPED.lock().expect("it does not panic").take();
            }
            let (duration, report) = stopped.expect("it is stopped");
            // The other one takes 0.7 s; code that hangs would have 5 s.
            assert!(duration < Duration::from_secs(3), "{number}: {duration:?}");
            assert_eq!(report.safety, Safety::Error, "{number}");
            let start = Instant::now();
            while SAFE.lock().expect("it does not panic").len() < 2 && start.elapsed() < Duration::from_secs(10) {
                std::thread::sleep(Duration::from_millis(5));
            }
            let safe = SAFE.lock().expect("it does not panic").clone();
            assert_eq!(safe, ["actuator/base/tilt/other", "actuator/base/pan/halt"], "{number}");
        }
    });
}
