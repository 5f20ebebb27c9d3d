//! What an `init` has started that fails then: how it is made safe, and what becomes of callbacks that fail or hang.

use crate::components::{Number, within};
use crate::gate::Gate;
use bb_core::prelude::*;
use bb_core::{DisarmError, Running};
use std::sync::atomic::{AtomicBool, AtomicI32, AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The devices of these tests are there once.
static ALONE: Mutex<()> = Mutex::new(());

static GATE: Gate = Gate::new();
/// How often the device was made.
static MADE: AtomicU32 = AtomicU32::new(0);
/// How many threads are in its callbacks, and how many have left them.
static INSIDE: AtomicI32 = AtomicI32::new(0);
static LEFT: AtomicI32 = AtomicI32::new(0);
/// Whether callbacks pass the gate, or fail.
static HANGS: AtomicBool = AtomicBool::new(false);

fn alone(hangs: bool) -> MutexGuard<'static, ()> {
    let alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    HANGS.store(hangs, Ordering::SeqCst);
    MADE.store(0, Ordering::SeqCst);
    INSIDE.store(0, Ordering::SeqCst);
    LEFT.store(0, Ordering::SeqCst);
    alone
}

fn entered() -> i32 {
    INSIDE.load(Ordering::SeqCst) + LEFT.load(Ordering::SeqCst)
}

fn stop() -> Result<(), Fault> {
    INSIDE.fetch_add(1, Ordering::SeqCst);
    if HANGS.load(Ordering::SeqCst) {
        GATE.pass("here");
    }
    INSIDE.fetch_sub(1, Ordering::SeqCst);
    LEFT.fetch_add(1, Ordering::SeqCst);
    if HANGS.load(Ordering::SeqCst) { Ok(()) } else { Err(Fault::new("no answer")) }
}

/// Works once, until it is read; never again.
#[derive(Debug)]
pub(crate) struct Device;

impl Device {
    fn make(mut register: impl FnMut()) -> Result<Self, Fault> {
        if MADE.fetch_add(1, Ordering::SeqCst) == 0 {
            return Ok(Self);
        }
        register();
        register();
        Err(Fault::new("no handshake"))
    }
}

impl Sensor for Device {
    type Options = NoOptions;
    type Output = Number;

    fn init(_: NoOptions, context: &SensorContext) -> Result<Self, Fault> {
        Self::make(|| context.on_disarm(stop))
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Number>, Fault> {
        Err(Fault::new("unplugged"))
    }
}

/// The same as an actuator.
#[derive(Debug)]
pub(crate) struct Servo;

impl Actuator for Servo {
    type Options = NoOptions;
    type Command = Number;

    fn init(_: NoOptions, context: &ActuatorContext) -> Result<Self, Fault> {
        Device::make(|| context.on_disarm(stop)).map(|_| Self)
    }

    fn handle_command(&mut self, _: &Stamped<Number>) -> Result<(), Fault> {
        Err(Fault::new("unplugged"))
    }

    fn disarm(&mut self) -> Result<(), Fault> {
        Ok(())
    }
}

robot! {
    robot Sensing;
    link base { sensor device: Device() { rate: 100 Hz; } }
}

robot! {
    robot Moving;
    link base {
        joint pan: continuous { axis: z; actuator servo: Servo(); sensor encoder: External<Number>(); link head {} }
    }
}

/// A robot whose backoff is so long that a second attempt of `attempts` is not followed by another.
fn sensing(backoff: Duration) -> bb_core::Builder<Sensing> {
    let mut builder = Sensing::builder();
    builder.supervision().first_backoff = backoff;
    builder.supervision().longest_backoff = backoff;
    builder
}

fn arm<R: bb_core::Robot>(robot: &Running<R>) {
    assert_eq!(robot.arm(), Ok(()));
}

#[test]
fn a_callback_that_fails_is_a_fault_and_stays_for_the_next_disarming() {
    let _alone = alone(false);
    within(60, || {
        let builder = sensing(Duration::from_millis(100));
        let faults = builder.subscribe(system::Faults);
        let robot = builder.start().expect("it starts");
        arm(&robot);
        let mut failed = 0;
        while failed < 2 {
            let fault = faults.recv_timeout(Duration::from_secs(20)).expect("it is reported");
            if fault.message == "disarming failed: no answer" {
                assert_eq!(fault.path, "sensor/base/device");
                failed += 1;
            }
        }
        assert_eq!(robot.safety(), Safety::Armed, "a device that is unplugged is no danger");
        assert!(matches!(robot.disarm(), Err(DisarmError::Failed(errors)) if errors.len() >= 2));
    });
}

#[test]
fn a_robot_that_is_disarmed_while_such_callbacks_run_waits_for_them() {
    let _alone = alone(true);
    within(60, || {
        GATE.close("here");
        let robot = sensing(Duration::from_secs(10)).start().expect("it starts");
        arm(&robot);
        // Both are run at once, each on a thread of its own, though each hangs.
        GATE.wait_for(2);
        let live = robot.live();
        let disarms = std::thread::spawn(move || live.disarm());
        while robot.safety() != Safety::Disarming {
            std::thread::yield_now();
        }
        assert_eq!((robot.safety(), entered()), (Safety::Disarming, 2), "they are not entered twice at a time");
        GATE.open();
        assert_eq!(disarms.join().expect("it does not panic"), Ok(()));
        assert_eq!((robot.safety(), entered()), (Safety::Disarmed, 4), "the disarming has run them once more");
    });
}

#[test]
fn an_actuator_whose_failed_init_hangs_in_its_callbacks_keeps_no_disarming_waiting_for_its_lock() {
    let _alone = alone(true);
    within(60, || {
        GATE.close("here");
        let mut builder = Moving::builder();
        builder.supervision().first_backoff = Duration::from_millis(1);
        let robot = builder.start().expect("it starts");
        arm(&robot);
        let servo = moving::actuator::base::pan::servo;
        while robot.actuate(servo, Number(1.0)).is_ok() {}
        let live = robot.live();
        let sends = std::thread::spawn(move || {
            while INSIDE.load(Ordering::SeqCst) < 2 {
                let _ = live.actuate(servo, Number(1.0));
            }
        });
        GATE.wait_for(2);
        let error = robot.disarm().expect_err("its callbacks hang");
        let DisarmError::Failed(errors) = &error else { panic!("{error}") };
        assert_eq!(errors.len(), 2, "its own `disarm` came back: {error}");
        GATE.open();
        sends.join().expect("it does not panic");
    });
}

#[test]
fn a_dead_device_whose_callbacks_hang_is_not_started_again_before_they_return() {
    let _alone = alone(true);
    within(120, || {
        GATE.close("here");
        let builder = sensing(Duration::from_millis(1));
        let faults = builder.subscribe(system::Faults);
        let robot = builder.start().expect("it starts");
        arm(&robot);
        let mut expected = vec![
            "a disarm callback of its last attempt to start has not returned",
            "did not come back from disarming in time",
            "no handshake",
            "unplugged",
        ];
        while !expected.is_empty() {
            let fault = faults.recv_timeout(Duration::from_secs(20)).expect("it is reported");
            assert_eq!(fault.path, "sensor/base/device");
            expected.retain(|message| *message != fault.message);
        }
        assert_eq!((robot.safety(), entered()), (Safety::Armed, 2));
        assert!(robot.disarm().is_err() && robot.force_disarm().is_err());
        assert_eq!((robot.safety(), entered()), (Safety::Disarmed, 2), "no thread for each time");
        assert_eq!(MADE.load(Ordering::SeqCst), 2);
        arm(&robot);
        GATE.open();
        while MADE.load(Ordering::SeqCst) < 3 {
            std::thread::sleep(Duration::from_millis(1));
        }
        assert_eq!(robot.safety(), Safety::Armed);
    });
}
