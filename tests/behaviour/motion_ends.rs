//! Motions that end because their actuator fails, and code of actuators and commands that panics or hangs.

use crate::kit::*;
use bb_core::payload::{EndMotion, MotionEnd};
use bb_core::{Exceeded, JointBounds, JointCommand, OutOfBounds};

/// Fault of the driver, and whether it reports the end of its motion when it is disarmed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Fails {
    #[default]
    Never,
    Command,
    Panics,
    Update,
    NextUpdate,
    /// Hangs, in fact.
    NextUpdateHangs,
    Disarm,
    DisarmPanics,
}

type Script = Arc<Mutex<(Fails, bool)>>;

#[derive(Clone, Debug, Options)]
struct DriveOptions {
    #[option(default = Script::default())]
    script: Script,
    /// Current of the motor; the drive is restarted when it changes.
    #[option(default = 1.0)]
    current: f64,
}

/// Reports the beginning of a motion with each command, and follows a script.
struct Drive {
    script: Script,
    context: ActuatorContext,
    next: Option<MonotonicTime>,
}

impl Actuator for Drive {
    type Options = DriveOptions;
    type Command = Push;

    fn init(options: DriveOptions, context: &ActuatorContext) -> Result<Self, Fault> {
        Ok(Self { script: options.script, context: context.clone(), next: None })
    }

    fn handle_command(&mut self, command: &Stamped<Push>) -> Result<(), Fault> {
        match lock(&self.script).0 {
            Fails::Command => return Err(Fault::new("no current")),
            Fails::Panics => panic!("an index"),
            Fails::Update | Fails::NextUpdate => {
                self.next = Some(command.monotonic_time + Duration::from_millis(100));
            }
            _ => {}
        }
        self.context.begin_motion(BeginMotion {
            initial_position: 0.25,
            target_position: Some(command.position),
            velocity: None,
            speed: Some(0.5),
            expected_arrival: None,
        });
        Ok(())
    }

    fn next_update(&self) -> Option<MonotonicTime> {
        if lock(&self.script).0 == Fails::NextUpdateHangs {
            HANG.pass("next update");
        }
        assert!(self.next.is_none() || lock(&self.script).0 != Fails::NextUpdate, "an overflow");
        self.next
    }

    fn update(&mut self, _: MonotonicTime) -> Result<(), Fault> {
        self.next = None;
        Err(Fault::new("the encoder is silent"))
    }

    fn disarm(&mut self) -> Result<(), Fault> {
        let (fails, reports_end) = *lock(&self.script);
        if reports_end {
            self.context.end_motion(EndMotion { position: 0.75, end: MotionEnd::Stopped });
        }
        match fails {
            Fails::Disarm => Err(Fault::new("the brake is worn")),
            Fails::DisarmPanics => panic!("the brake is lost"),
            _ => Ok(()),
        }
    }
}

/// A command whose code panics, hangs, or does as it should.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
#[payload(joint_command)]
pub(crate) struct Push {
    pub(crate) position: f64,
}

const PANICS: f64 = -7.0;
const HANGS: f64 = -8.0;

static HANG: Gate = Gate::new();

impl JointCommand for Push {
    fn limit(&mut self, bounds: &JointBounds) -> Result<Exceeded, OutOfBounds> {
        assert!(self.position != PANICS, "a division by zero");
        if self.position == HANGS {
            HANG.pass("limit");
        }
        let mut exceeded = Exceeded::default();
        bounds.hold_position(&mut self.position, &mut exceeded);
        Ok(exceeded)
    }
}

robot! {
    robot Press;
    parameters { current: f64 = 1.0; }
    link base {
        joint ram: prismatic {
            axis: z;
            limit: { lower: 0 m, upper: 1 m, velocity: 1 m/s, effort: 1 N };
            actuator drive: Drive(current = param::current);
            sensor scale: External<JointState>();
            link head;
        }
    }
}

const DRIVE: ActuatorHandle<Press, Drive> = press::actuator::base::ram::drive;

/// A robot that moves.
fn moving(script: &Script) -> Result<(Simulation<Press>, DynamicSubscription), Failure> {
    lock(script).0 = Fails::Never;
    let mut builder = Press::builder();
    builder.options(DRIVE).script = Arc::clone(script);
    let mut simulation = armed_simulation(builder);
    let ends = simulation.subscribe_any(Select::Below("actuator"), "EndMotion", Overflow::default());
    simulation.actuate(DRIVE, Push { position: 1.0 })?;
    simulation.run_until(at(10));
    assert_eq!(ends.drain().count(), 0);
    Ok((simulation, ends))
}

fn reasons(ends: &DynamicSubscription) -> Vec<(f64, MotionEnd)> {
    ends.drain().filter_map(|end| end.downcast::<EndMotion>().map(|end| (end.position, end.end.clone()))).collect()
}

fn failed(reason: &str) -> MotionEnd {
    MotionEnd::Failed(reason.to_owned())
}

#[test]
fn a_motion_whose_actuator_fails_ends_with_the_reason() -> Result<(), Failure> {
    let causes = [
        (Fails::Command, "no current"),
        (Fails::Panics, "panicked: an index"),
        (Fails::Update, "the encoder is silent"),
        (Fails::NextUpdate, "panicked: an overflow"),
    ];
    for reports_end in [false, true] {
        for (fails, reason) in causes {
            let script = Script::default();
            *lock(&script) = (Fails::Never, reports_end);
            let (mut simulation, ends) = moving(&script)?;
            *lock(&script) = (fails, reports_end);
            let sent = simulation.actuate(DRIVE, Push { position: 0.5 });
            // The driver fails now or at its update, and is restarted.
            assert_eq!(sent.is_ok(), matches!(fails, Fails::Update | Fails::NextUpdate), "{fails:?}");
            simulation.run_for(Duration::from_millis(150));
            *lock(&script) = (Fails::Never, reports_end);
            // At the position that the driver knows, or where the motion began: nothing has measured it.
            let position = if reports_end { 0.75 } else { 0.25 };
            assert_eq!(reasons(&ends), [(position, failed(reason))], "{fails:?}");
            // The next motion is another one.
            simulation.run_for(Duration::from_secs(2));
            simulation.actuate(DRIVE, Push { position: 0.5 })?;
            assert_eq!(reasons(&ends), []);
        }
    }
    Ok(())
}

#[test]
fn a_failed_motion_ends_at_the_measured_position() -> Result<(), Failure> {
    let script = Script::default();
    let (mut simulation, ends) = moving(&script)?;
    simulation.publish(press::sensor::base::ram::scale, simulation.clock().now(), joint(0.5));
    *lock(&script) = (Fails::Command, false);
    assert!(simulation.actuate(DRIVE, Push { position: 0.5 }).is_err());
    assert_eq!(reasons(&ends), [(0.5, failed("no current"))]);
    Ok(())
}

#[test]
fn a_motion_whose_actuator_is_restarted_has_failed() -> Result<(), Failure> {
    let script = Script::default();
    let (mut simulation, ends) = moving(&script)?;
    simulation.set_parameter(press::param::current, 2.0)?;
    simulation.run_for(Duration::from_millis(10));
    assert_eq!(reasons(&ends), [(0.25, failed("the actuator is restarted"))]);
    Ok(())
}

#[test]
fn a_motion_that_is_disarmed_is_stopped_or_has_failed() -> Result<(), Failure> {
    let cases = [
        (Fails::Never, MotionEnd::Stopped),
        (Fails::Disarm, failed("the brake is worn")),
        (Fails::DisarmPanics, failed("panicked: the brake is lost")),
    ];
    for (fails, end) in cases {
        let script = Script::default();
        let (simulation, ends) = moving(&script)?;
        *lock(&script) = (fails, false);
        assert_eq!(simulation.disarm().is_ok(), fails == Fails::Never);
        assert_eq!(reasons(&ends), [(0.25, end)]);
    }
    // A driver that reports the end itself.
    let script = Script::default();
    *lock(&script) = (Fails::Never, true);
    let (simulation, ends) = moving(&script)?;
    assert_eq!(simulation.disarm(), Ok(()));
    assert_eq!(reasons(&ends), [(0.75, MotionEnd::Stopped)]);
    Ok(())
}

#[test]
fn a_limit_that_panics_refuses_the_command_alone() -> Result<(), Failure> {
    let (simulation, ends) = moving(&Script::default())?;
    let error = simulation.actuate(DRIVE, Push { position: PANICS }).expect_err("it panics");
    assert_eq!(error, ActuatorError::NotLimited("panicked: a division by zero".to_owned()));
    // The actuator goes on, and so does its motion.
    simulation.actuate(DRIVE, Push { position: 0.5 })?;
    assert_eq!(reasons(&ends), []);
    let report = simulation.stop();
    let faults: Vec<_> = report.faults.iter().map(|fault| (fault.path, fault.message.as_str())).collect();
    assert_eq!(faults, [(DRIVE.path(), "the limit of its command panicked: a division by zero")]);
    Ok(())
}

#[test]
fn code_that_hangs_beside_a_command_is_reported() -> Result<(), Failure> {
    for (place, position) in [("limit", HANGS), ("next update", 0.5)] {
        let script = Script::default();
        let mut builder = Press::builder();
        builder.options(DRIVE).script = script.clone();
        let running = armed(builder);
        if place == "next update" {
            *lock(&script) = (Fails::NextUpdateHangs, false);
        }
        let faults = running.subscribe(system::Faults);
        HANG.close(place);
        let live = running.live();
        let sender = std::thread::spawn(move || live.actuate(DRIVE, Push { position }));
        HANG.wait_for(1);
        let fault = faults.recv_timeout(PATIENCE).ok_or("it is reported while it hangs")?;
        HANG.open();
        assert_eq!(fault.path, DRIVE.path());
        assert!(sender.join().is_ok_and(|sent| sent.is_ok()), "{place}");
        running.stop();
    }
    Ok(())
}
