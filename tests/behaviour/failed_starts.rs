//! Starts that fail: how what an `init` has started is made safe, and what becomes of callbacks that fail or hang.

use crate::kit::*;

/// The devices of one test.
struct Rig {
    gate: Gate,
    /// `true` if callbacks pass the gate; `false` if they fail.
    hangs: bool,
    /// Number of times that the device was made.
    made: AtomicU32,
    /// Numbers of threads that are in its callbacks, and that have left them.
    inside: AtomicI32,
    left: AtomicI32,
    /// The largest number of threads that were inside at a time.
    most: AtomicI32,
}

/// A rig for each test, so that they run side by side: most of their time they wait for limits of several seconds.
static RIGS: [Rig; 4] = [Rig::new(false), Rig::new(true), Rig::new(true), Rig::new(true)];
const FAILS: usize = 0;
const DISARMS: usize = 1;
const LOCKS: usize = 2;
const DIES: usize = 3;

impl Rig {
    const fn new(hangs: bool) -> Self {
        let (made, inside, left, most) =
            (AtomicU32::new(0), AtomicI32::new(0), AtomicI32::new(0), AtomicI32::new(0));
        Self { gate: Gate::new(), hangs, made, inside, left, most }
    }

    /// Returns the number of threads that have entered its callbacks.
    fn entered(&self) -> i32 {
        self.inside.load(Ordering::SeqCst) + self.left.load(Ordering::SeqCst)
    }

    fn stop(&self) -> Result<(), Fault> {
        let inside = self.inside.fetch_add(1, Ordering::SeqCst) + 1;
        self.most.fetch_max(inside, Ordering::SeqCst);
        if self.hangs {
            self.gate.pass("here");
        }
        self.inside.fetch_sub(1, Ordering::SeqCst);
        self.left.fetch_add(1, Ordering::SeqCst);
        if self.hangs { Ok(()) } else { Err(Fault::new("no answer")) }
    }
}

/// Works once, until it is read; never again.
fn make(rig: usize, register: impl Fn(&'static Rig)) -> Done {
    let rig = &RIGS[rig];
    if rig.made.fetch_add(1, Ordering::SeqCst) == 0 {
        return Ok(());
    }
    register(rig);
    register(rig);
    Err(Fault::new("no handshake"))
}

fn device<const RIG: usize>(context: &SensorContext) -> Done {
    make(RIG, |rig| context.on_disarm(move || rig.stop()))
}

fn servo(context: &ActuatorContext) -> Done {
    make(LOCKS, |rig| context.on_disarm(move || rig.stop()))
}

/// A robot whose backoff is so long that a second attempt of `attempts` is not followed by another.
fn sensing<const RIG: usize>(backoff: Duration) -> Builder<Plain> {
    let mut builder = Plain::builder();
    let source = builder.options(SOURCE);
    (source.init, source.read) = (device::<RIG>, |_, _| Err(Fault::new("unplugged")));
    builder.supervision().first_backoff = backoff;
    builder.supervision().longest_backoff = backoff;
    builder
}

#[test]
fn a_callback_that_fails_is_a_fault_and_stays_for_the_next_disarming() {
    within(60, || {
        let builder = sensing::<FAILS>(Duration::from_millis(100));
        let faults = builder.subscribe(system::Faults);
        let robot = armed(builder);
        let mut told = std::iter::from_fn(|| faults.recv_timeout(PATIENCE));
        for _ in 0..2 {
            let fault = told.find(|fault| fault.message == "disarming failed: no answer").expect("it is reported");
            assert_eq!(fault.path, "sensor/base/source");
        }
        assert_eq!(robot.safety(), Safety::Armed, "a device that is unplugged is no danger");
        assert!(matches!(robot.disarm(), Err(DisarmError::Failed(errors)) if errors.len() >= 2));
    });
}

#[test]
fn a_robot_that_is_disarmed_while_callbacks_hang_waits_for_them() {
    let rig = &RIGS[DISARMS];
    within(60, move || {
        rig.gate.close("here");
        let robot = armed(sensing::<DISARMS>(Duration::from_secs(10)));
        // Both are run at once, each on a thread of its own, though each hangs.
        rig.gate.wait_for(2);
        let live = robot.live();
        let disarms = std::thread::spawn(move || live.disarm());
        while robot.safety() != Safety::Disarming {
            std::thread::yield_now();
        }
        rig.gate.open();
        assert_eq!(disarms.join().expect("it does not panic"), Ok(()));
        assert_eq!((robot.safety(), rig.entered()), (Safety::Disarmed, 4), "the disarming has run them once more");
        assert_eq!(rig.most.load(Ordering::SeqCst), 2, "neither is entered twice at a time");
    });
}

#[test]
fn an_actuator_whose_failed_init_hangs_in_its_callbacks_keeps_no_disarming_waiting_for_its_lock() {
    let rig = &RIGS[LOCKS];
    within(60, move || {
        rig.gate.close("here");
        let mut builder = Plain::builder();
        let actuator = builder.options(SERVO);
        (actuator.init, actuator.command) = (servo, |_| Err(Fault::new("unplugged")));
        builder.supervision().first_backoff = Duration::from_millis(1);
        let robot = armed(builder);
        while robot.actuate(SERVO, Number(1.0)).is_ok() {}
        let live = robot.live();
        let sends = std::thread::spawn(move || {
            while rig.inside.load(Ordering::SeqCst) < 2 {
                let _ = live.actuate(SERVO, Number(1.0));
            }
        });
        rig.gate.wait_for(2);
        let error = robot.disarm().expect_err("its callbacks hang");
        let DisarmError::Failed(errors) = &error else { panic!("{error}") };
        assert_eq!(errors.len(), 2, "its own `disarm` came back: {error}");
        rig.gate.open();
        sends.join().expect("it does not panic");
    });
}

#[test]
fn a_dead_device_whose_callbacks_hang_is_not_started_again_before_they_return() {
    let rig = &RIGS[DIES];
    within(120, move || {
        rig.gate.close("here");
        let builder = sensing::<DIES>(Duration::from_millis(1));
        let faults = builder.subscribe(system::Faults);
        let robot = armed(builder);
        let mut expected = vec![
            "a disarm callback of its last attempt to start has not returned",
            "did not come back from disarming in time",
            "no handshake",
            "unplugged",
        ];
        while !expected.is_empty() {
            let fault = faults.recv_timeout(Duration::from_secs(20)).expect("it is reported");
            assert_eq!(fault.path, "sensor/base/source");
            expected.retain(|message| *message != fault.message);
        }
        assert_eq!((robot.safety(), rig.entered()), (Safety::Armed, 2));
        assert!(robot.disarm().is_err() && robot.force_disarm().is_err());
        assert_eq!((robot.safety(), rig.entered()), (Safety::Disarmed, 2), "no thread for each time");
        assert_eq!(rig.made.load(Ordering::SeqCst), 2);
        assert_eq!(robot.arm(), Ok(()));
        rig.gate.open();
        wait_until("it is made again", || rig.made.load(Ordering::SeqCst) == 3);
        assert_eq!(robot.safety(), Safety::Armed);
    });
}
