//! What a restart leaves alone, what it resets, and what becomes of those who fail in an unusual way.

use crate::components::{Counter, Number, at, within};
use bb_core::HealthTransition;
use bb_core::prelude::*;
use bb_core::run::DropReason;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

const PATIENCE: Duration = Duration::from_secs(20);

/// The device of these tests is there once.
static ALONE: Mutex<()> = Mutex::new(());

fn alone() -> MutexGuard<'static, ()> {
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Is unplugged from 0.5 s to 2 s.
#[derive(Debug)]
pub(crate) struct Plugged;

impl Sensor for Plugged {
    type Options = NoOptions;
    type Output = Number;

    fn init(_: NoOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn read(&mut self, now: MonotonicTime) -> Result<Reading<Number>, Fault> {
        if (at(500)..at(2000)).contains(&now) {
            return Err(Fault::new("unplugged"));
        }
        Ok(Reading::now(Number(1.0)))
    }
}

/// Counts its messages, and says how many there were.
#[derive(Debug)]
pub(crate) struct Tally(f64);

impl Estimator for Tally {
    type Options = NoOptions;
    type Input = Number;
    type Output = Number;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self(0.0))
    }

    fn handle_input(&mut self, _: &Stamped<Number>) -> Result<Reply<Number>, Fault> {
        self.0 += 1.0;
        Ok(Reply::emit(Number(self.0)))
    }
}

/// Does nothing.
#[derive(Debug)]
pub(crate) struct Note;

impl Command for Note {
    type Options = NoOptions;
    type Arguments = NoArguments;
    type Output = ();

    async fn run(_: NoOptions, _: NoArguments, _: CommandContext) -> Result<Outcome<()>, Fault> {
        Ok(Outcome::done(()))
    }
}

robot! {
    robot Cable;

    commands {
        alarm: Note { allowed_states: [disarmed, idle, executing]; }
        calm: Note { allowed_states: [disarmed, idle, executing]; }
    }

    link base {
        sensor plugged: Plugged() {
            rate: 100 Hz;
            estimator pose: Tally() { lost_after: 100 ms; recover_after: 3; on_lost: alarm; on_recovered: calm; }
        }
        sensor beside: Counter(count = 100000) { rate: 100 Hz; estimator tally: Tally(); }
    }
}

#[test]
fn a_device_that_is_unplugged_is_lost_once_and_found_again_and_nobody_else_notices() -> Result<(), StartError> {
    let builder = Cable::builder();
    let health = builder.subscribe(system::Health);
    let (pose, tally) = (
        builder.subscribe(cable::sensor::base::plugged::pose),
        builder.subscribe(cable::sensor::base::beside::tally),
    );
    let mut simulation = builder.simulate()?;
    assert_eq!(simulation.arm(), Ok(()));
    simulation.run_until(at(5005));
    let changes: Vec<_> = health
        .drain()
        .map(|change| {
            let HealthTransition { estimator, from, to, time, .. } = change.payload;
            (estimator, from, to, time.as_nanos() / 1_000_000)
        })
        .collect();
    // The last good reading was at 490 ms. After backoffs of 10 to 640 ms, and one of a second, it reads again at 2770 ms.
    const POSE: &str = "sensor/base/plugged/pose";
    use HealthState::{Degraded, Healthy, Lost};
    assert_eq!(
        changes,
        [(POSE, Healthy, Lost, 590), (POSE, Lost, Degraded, 2770), (POSE, Degraded, Healthy, 2790)],
    );
    // Neither lost its state.
    let counted = |tally: &Subscription<Number>| tally.drain().map(|number| number.0).collect::<Vec<_>>();
    let pose = counted(&pose);
    assert_eq!(pose, (1..=pose.len()).map(|number| number as f64).collect::<Vec<_>>());
    assert_eq!(pose.len(), 50 + 224);
    assert_eq!(counted(&tally), (1..=501).map(f64::from).collect::<Vec<_>>());
    assert_eq!(simulation.safety(), Safety::Armed, "a fault of a driver disarms nobody");
    let report = simulation.stop();
    let started = |name| report.commands.iter().find(|command| command.name == name).map(|command| command.started);
    assert_eq!((started("alarm"), started("calm")), (Some(1), Some(1)));
    assert!(report.estimators.iter().all(|estimator| estimator.restarts == 0));
    let faults: Vec<_> = report.faults.iter().map(ToString::to_string).collect();
    assert_eq!(faults, ["sensor/base/plugged failed: unplugged (8 times in 1.270 s)"]);
    Ok(())
}

/// Panics when it is dropped, on its own or as a payload of a panic.
struct Bomb;

impl Drop for Bomb {
    fn drop(&mut self) {
        panic!("a bomb");
    }
}

/// Whether these are to throw a bomb the next time.
static THROWS: [AtomicBool; 4] = [const { AtomicBool::new(false) }; 4];

fn may_throw(number: usize) {
    if THROWS[number].swap(false, Ordering::SeqCst) {
        std::panic::panic_any(Bomb);
    }
}

/// A sensor, an estimator, a command and an actuator that do.
#[derive(Debug)]
pub(crate) struct Thrower(f64);

impl Sensor for Thrower {
    type Options = NoOptions;
    type Output = Number;

    fn init(_: NoOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self(0.0))
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Number>, Fault> {
        may_throw(0);
        Ok(Reading::now(Number(1.0)))
    }
}

impl Estimator for Thrower {
    type Options = NoOptions;
    type Input = Number;
    type Output = Number;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self(0.0))
    }

    fn handle_input(&mut self, _: &Stamped<Number>) -> Result<Reply<Number>, Fault> {
        may_throw(1);
        self.0 += 1.0;
        Ok(Reply::emit(Number(self.0)))
    }
}

impl Command for Thrower {
    type Options = NoOptions;
    type Arguments = NoArguments;
    type Output = ();

    async fn run(_: NoOptions, _: NoArguments, _: CommandContext) -> Result<Outcome<()>, Fault> {
        may_throw(2);
        Ok(Outcome::done(()))
    }
}

impl Actuator for Thrower {
    type Options = NoOptions;
    type Command = Number;

    fn init(_: NoOptions, _: &ActuatorContext) -> Result<Self, Fault> {
        Ok(Self(0.0))
    }

    fn handle_command(&mut self, _: &Stamped<Number>) -> Result<(), Fault> {
        may_throw(3);
        Ok(())
    }

    fn disarm(&mut self) -> Result<(), Fault> {
        Ok(())
    }
}

robot! {
    robot Minefield;

    commands { throw: Thrower; }

    link base {
        joint pan: continuous { axis: z; sensor encoder: External<Number>(); actuator motor: Thrower(); link head { } }
        sensor numbers: Thrower() { rate: 100 Hz; estimator sum: Thrower(); }
        sensor beside: Counter(count = 100000) { rate: 100 Hz; estimator tally: Tally(); }
    }
}

#[test]
fn what_a_panic_throws_may_itself_panic_when_it_is_dropped() -> Result<(), StartError> {
    let _alone = alone();
    let builder = Minefield::builder();
    let (sum, tally) = (
        builder.subscribe(minefield::sensor::base::numbers::sum),
        builder.subscribe(minefield::sensor::base::beside::tally),
    );
    let mut simulation = builder.simulate()?;
    assert_eq!(simulation.arm(), Ok(()));
    let motor = minefield::actuator::base::pan::motor;
    for (number, millis) in [(0, 100), (1, 200), (2, 300), (3, 400)] {
        simulation.run_until(at(millis));
        THROWS[number].store(true, Ordering::SeqCst);
        match number {
            2 => {
                let throwing = simulation.command(minefield::command::throw, NoArguments).expect("it is idle");
                simulation.run_until(at(millis + 50));
                assert!(throwing.try_result().is_some_and(|result| result.is_err()));
            }
            3 => assert!(simulation.actuate(motor, Number(1.0)).is_err()),
            _ => {}
        }
        simulation.run_until(at(millis + 90));
        assert!(!THROWS[number].load(Ordering::SeqCst), "it was thrown");
        assert!(sum.drain().count() >= 8, "the robot goes on");
    }
    assert_eq!(simulation.actuate(motor, Number(1.0)), Ok(()));
    assert_eq!(tally.drain().count(), 50);
    assert_eq!(simulation.safety(), Safety::Armed);
    let report = simulation.stop();
    let paths: Vec<_> = report.faults.iter().map(|fault| fault.path).collect();
    assert_eq!(paths, ["sensor/base/numbers", "sensor/base/numbers/sum", "actuator/base/pan/motor"]);
    Ok(())
}

/// Panics when it is asked where it starts, as often as it is told.
#[derive(Debug)]
pub(crate) struct Startled;

static STARTLES: AtomicU32 = AtomicU32::new(0);

impl Sensor for Startled {
    type Options = NoOptions;
    type Output = Number;

    fn init(_: NoOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn starts_at(&self) -> Option<MonotonicTime> {
        let left = STARTLES.fetch_update(Ordering::SeqCst, Ordering::SeqCst, |left| left.checked_sub(1));
        assert!(left.is_err(), "no index");
        None
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Number>, Fault> {
        Ok(Reading::now(Number(1.0)))
    }
}

robot! {
    robot Nervous;
    link base {
        sensor startled: Startled() { rate: 100 Hz; }
        sensor beside: Counter(count = 100000) { rate: 100 Hz; }
    }
}

#[test]
fn a_sensor_that_panics_in_starts_at_is_restarted() -> Result<(), StartError> {
    let _alone = alone();
    STARTLES.store(2, Ordering::SeqCst);
    let builder = Nervous::builder();
    let (startled, beside) =
        (builder.subscribe(nervous::sensor::base::startled), builder.subscribe(nervous::sensor::base::beside));
    let mut simulation = builder.simulate()?;
    simulation.run_until(at(195));
    assert_eq!(beside.drain().count(), 20, "the other one is read from the start");
    // After backoffs of 10 ms and 20 ms.
    assert_eq!(startled.try_recv().map(|number| number.monotonic_time), Some(at(30)));
    let faults: Vec<_> = simulation.stop().faults.iter().map(ToString::to_string).collect();
    assert_eq!(faults, ["sensor/base/startled failed: panicked: no index (2 times in 0.010 s)"]);

    STARTLES.store(1, Ordering::SeqCst);
    let builder = Nervous::builder();
    let startled = builder.subscribe(nervous::sensor::base::startled);
    let running = builder.start()?;
    assert!(startled.recv_timeout(PATIENCE).is_some(), "in real time its thread goes on");
    let faults: Vec<_> = running.stop().faults.iter().map(ToString::to_string).collect();
    assert_eq!(faults, ["sensor/base/startled failed: panicked: no index"]);
    Ok(())
}

/// Options of [`Exclusive`].
#[derive(Clone, Debug, Options)]
pub(crate) struct ExclusiveOptions {
    #[option(default = 1.0)]
    pub(crate) gain: f64,
}

/// One that only one at a time can have open, closed by `terminate`.
#[derive(Debug)]
pub(crate) struct Exclusive {
    generation: u32,
    log: &'static Log,
}

/// What has become of the instances of a component.
#[derive(Debug)]
pub(crate) struct Log {
    made: AtomicU32,
    lines: Mutex<Vec<String>>,
}

impl Log {
    const fn new() -> Self {
        Self { made: AtomicU32::new(0), lines: Mutex::new(Vec::new()) }
    }

    fn add(&self, line: String) {
        self.lines.lock().unwrap_or_else(PoisonError::into_inner).push(line);
    }

    fn take(&self) -> Vec<String> {
        self.made.store(0, Ordering::SeqCst);
        std::mem::take(&mut *self.lines.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn make(&'static self, gain: f64) -> Exclusive {
        let generation = self.made.fetch_add(1, Ordering::SeqCst);
        self.add(format!("made {generation} with {gain}"));
        Exclusive { generation, log: self }
    }
}

impl Drop for Exclusive {
    fn drop(&mut self) {
        self.log.add(format!("dropped {}", self.generation));
    }
}

static OF_ESTIMATOR: Log = Log::new();
static OF_SENSOR: Log = Log::new();
static OF_ACTUATOR: Log = Log::new();

impl Estimator for Exclusive {
    type Options = ExclusiveOptions;
    type Input = Number;
    type Output = Number;

    fn init(options: ExclusiveOptions, context: &Context) -> Result<Self, Fault> {
        let this = OF_ESTIMATOR.make(options.gain);
        context.request(Request::Timer(this.generation, Duration::from_millis(100)));
        Ok(this)
    }

    fn handle_input(&mut self, _: &Stamped<Number>) -> Result<Reply<Number>, Fault> {
        Ok(Reply::none())
    }

    fn handle_info(&mut self, info: Info) -> Result<Reply<Number>, Fault> {
        let Info::Timer(of) = info else { return Err(Fault::new("it asked for none")) };
        self.log.add(format!("timer of {of} at {}", self.generation));
        Ok(Reply::none())
    }

    fn terminate(&mut self) {
        self.log.add(format!("closed {}", self.generation));
    }
}

impl Sensor for Exclusive {
    type Options = ExclusiveOptions;
    type Output = Number;

    fn init(options: ExclusiveOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(OF_SENSOR.make(options.gain))
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Number>, Fault> {
        Ok(Reading::now(Number(1.0)))
    }

    fn terminate(&mut self) {
        self.log.add(format!("closed {}", self.generation));
    }
}

impl Actuator for Exclusive {
    type Options = ExclusiveOptions;
    type Command = Number;

    fn init(options: ExclusiveOptions, _: &ActuatorContext) -> Result<Self, Fault> {
        Ok(OF_ACTUATOR.make(options.gain))
    }

    fn handle_command(&mut self, _: &Stamped<Number>) -> Result<(), Fault> {
        Ok(())
    }

    fn disarm(&mut self) -> Result<(), Fault> {
        self.log.add(format!("made {} safe", self.generation));
        Ok(())
    }

    fn terminate(&mut self) {
        self.log.add(format!("closed {}", self.generation));
    }
}

robot! {
    robot Single;

    parameters { gain: f64 = 1.0; }

    link base {
        joint pan: continuous {
            axis: z;
            sensor encoder: External<Number>();
            actuator motor: Exclusive(gain = param::gain);
            link head { }
        }
        sensor numbers: Exclusive(gain = param::gain) {
            rate: 100 Hz;
            estimator only: Exclusive(gain = param::gain);
        }
    }
}

#[test]
fn new_options_close_and_drop_the_old_instance_before_the_new_one_is_made() -> Result<(), StartError> {
    let _alone = alone();
    let logs = [&OF_ESTIMATOR, &OF_SENSOR, &OF_ACTUATOR];
    logs.iter().for_each(|log| drop(log.take()));
    let mut simulation = Single::builder().simulate()?;
    assert_eq!(simulation.arm(), Ok(()));
    simulation.run_until(at(55));
    simulation.set_parameter(single::param::gain, 2.0).expect("it is finite");
    simulation.run_until(at(154));
    let mut expected = vec!["made 0 with 1", "closed 0", "dropped 0", "made 1 with 2"];
    assert_eq!(OF_SENSOR.take(), expected);
    assert_eq!(OF_ESTIMATOR.take(), expected, "the timer of the old one, due at 100 ms, is gone");
    expected.insert(1, "made 0 safe");
    assert_eq!(OF_ACTUATOR.take(), expected);
    simulation.run_until(at(160));
    assert_eq!(OF_ESTIMATOR.take(), ["timer of 1 at 1"]);
    Ok(())
}

#[test]
fn parameters_that_change_often_are_no_failures() -> Result<(), StartError> {
    let _alone = alone();
    let mut simulation = Single::builder().simulate()?;
    assert_eq!(simulation.arm(), Ok(()));
    for change in 1..=50_u32 {
        simulation.run_until(at(20 * i64::from(change)));
        simulation.set_parameter(single::param::gain, f64::from(change)).expect("it is finite");
    }
    simulation.run_until(at(2000));
    assert_eq!(simulation.safety(), Safety::Armed);
    simulation.actuate(single::actuator::base::pan::motor, Number(1.0)).expect("it runs");
    let report = simulation.stop();
    assert_eq!(report.all_faults, 0, "{report}");
    Ok(())
}

/// Passes on; a negative number is a fault. Hangs at -1000 until it is let go.
#[derive(Debug)]
pub(crate) struct Fragile;

static IS_INSIDE: AtomicBool = AtomicBool::new(false);

impl Estimator for Fragile {
    type Options = NoOptions;
    type Input = Number;
    type Output = Number;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, number: &Stamped<Number>) -> Result<Reply<Number>, Fault> {
        if number.0 == -1000.0 {
            IS_INSIDE.store(true, Ordering::SeqCst);
            while IS_INSIDE.load(Ordering::SeqCst) {
                std::thread::sleep(Duration::from_millis(1));
            }
        }
        if number.0 < 0.0 { Err(Fault::new("negative")) } else { Ok(Reply::emit(number.payload)) }
    }
}

pub(crate) struct Break;

impl HandleCall<Break> for Fragile {
    type Response = ();
    fn handle_call(&mut self, Break: Break) -> Result<((), Reply<Number>), Fault> {
        Err(Fault::new("asked to"))
    }
}

robot! {
    robot Patched;
    link base {
        sensor number: External<Number>() { estimator near: Fragile(); }
        sensor other: External<Number>();
        estimator apart: Fragile() { input number: sensor::base::other; runs_on: worker; }
    }
}

#[test]
fn messages_that_come_while_an_estimator_waits_for_its_restart_are_delivered_after_it() -> Result<(), StartError> {
    let builder = Patched::builder();
    let near = builder.subscribe(patched::sensor::base::number::near);
    let mut simulation = builder.simulate()?;
    simulation.publish(patched::sensor::base::number, at(100), Number(-1.0));
    for number in 1..=9 {
        simulation.publish(patched::sensor::base::number, at(100 + number), Number(number as f64));
    }
    assert_eq!(near.drain().count(), 0, "it is not back yet");
    simulation.run_until(at(200));
    assert_eq!(near.drain().map(|number| number.0).collect::<Vec<_>>(), (1..=9).map(f64::from).collect::<Vec<_>>());
    let report = simulation.stop();
    let near = report.estimator("sensor/base/number/near").expect("it is declared");
    assert_eq!((near.restarts, near.inputs[0].dropped(DropReason::Stopped)), (1, 0));
    Ok(())
}

#[test]
fn messages_that_wait_for_a_worker_outlast_its_failure() {
    let _alone = alone();
    within(60, || {
        let builder = Patched::builder();
        let apart = builder.subscribe(patched::estimator::base::apart);
        let running = builder.start().expect("it starts");
        let publish = |number| running.publish(patched::sensor::base::other, running.clock().now(), Number(number));
        publish(-1000.0);
        while !IS_INSIDE.load(Ordering::SeqCst) {
            std::thread::sleep(Duration::from_millis(1));
        }
        (1..=500).map(f64::from).for_each(publish);
        IS_INSIDE.store(false, Ordering::SeqCst);
        let numbers: Vec<_> = (0..500).map_while(|_| apart.recv_timeout(PATIENCE)).map(|number| number.0).collect();
        assert_eq!(numbers, (1..=500).map(f64::from).collect::<Vec<_>>());
        let report = running.stop();
        assert_eq!(report.estimator("estimator/base/apart").map(|apart| apart.restarts), Some(1));
    });
}

#[test]
fn one_stamp_far_ahead_does_not_outlast_a_restart() -> Result<(), StartError> {
    let builder = Patched::builder();
    let near = builder.subscribe(patched::sensor::base::number::near);
    let mut simulation = builder.simulate()?;
    simulation.run_until(at(100));
    let live = simulation.live();
    // Less than a second ahead of the clock, so that it is let in; the next ones are out of order.
    live.publish(patched::sensor::base::number, at(1000), Number(1.0));
    simulation.publish(patched::sensor::base::number, at(110), Number(2.0));
    assert!(live.call(patched::sensor::base::number::near, Break).is_err());
    simulation.run_until(at(150));
    simulation.publish(patched::sensor::base::number, at(160), Number(3.0));
    assert_eq!(near.drain().map(|number| number.0).collect::<Vec<_>>(), [1.0, 3.0]);
    Ok(())
}

/// Panics at a negative number.
#[derive(Debug)]
pub(crate) struct Panicky;

impl Estimator for Panicky {
    type Options = NoOptions;
    type Input = Number;
    type Output = Number;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, number: &Stamped<Number>) -> Result<Reply<Number>, Fault> {
        assert!(number.0 >= 0.0, "negative");
        Ok(Reply::none())
    }
}

/// Counts how often it was made safe.
#[derive(Debug)]
pub(crate) struct Careful;

static MADE_SAFE: AtomicU32 = AtomicU32::new(0);

impl Actuator for Careful {
    type Options = NoOptions;
    type Command = Number;

    fn init(_: NoOptions, _: &ActuatorContext) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_command(&mut self, _: &Stamped<Number>) -> Result<(), Fault> {
        Ok(())
    }

    fn disarm(&mut self) -> Result<(), Fault> {
        MADE_SAFE.fetch_add(1, Ordering::SeqCst);
        Ok(())
    }
}

robot! {
    robot Household;
    link base {
        joint pan: continuous {
            axis: z;
            sensor encoder: External<Number>();
            actuator motor: Careful();
            link head { }
        }
        sensor number: External<Number>() { estimator panicky: Panicky(); }
        sensor beside: Counter(count = 100000) { rate: 100 Hz; estimator tally: Tally(); }
    }
}

#[test]
fn a_sibling_that_is_restarted_from_above_says_so() -> Result<(), StartError> {
    let builder = Household::builder();
    let (health, tally) =
        (builder.subscribe(system::Health), builder.subscribe(household::sensor::base::beside::tally));
    let mut simulation = builder.simulate()?;
    for failure in 1..=4 {
        simulation.publish(household::sensor::base::number, at(failure * 100 + 5), Number(-1.0));
    }
    let of_tally = |change: &Stamped<HealthTransition>| change.estimator == "sensor/base/beside/tally";
    let changes: Vec<_> = health.drain().filter(of_tally).map(|change| (change.to, change.reason)).collect();
    assert_eq!(changes, [(HealthState::Degraded, HealthReason::Restarted)]);
    simulation.run_until(at(500));
    let numbers: Vec<_> = tally.drain().map(|number| number.0).collect();
    assert!(numbers.windows(2).any(|pair| pair[1] < pair[0]), "it has lost its state: {numbers:?}");
    Ok(())
}

#[test]
fn panics_that_use_up_the_budget_of_the_robot_have_it_made_safe() -> Result<(), StartError> {
    let _alone = alone();
    let mut builder = Household::builder();
    builder.supervision().max_restarts = 1;
    let mut simulation = builder.simulate()?;
    assert_eq!(simulation.arm(), Ok(()));
    let before = MADE_SAFE.load(Ordering::SeqCst);
    let mut failures = 0;
    while simulation.safety() == Safety::Armed && failures < 10 {
        failures += 1;
        simulation.publish(household::sensor::base::number, at(failures * 300), Number(-1.0));
    }
    // One that its link allows, one that the robot does.
    assert_eq!((failures, simulation.safety()), (3, Safety::Error));
    assert!(MADE_SAFE.load(Ordering::SeqCst) > before);
    assert!(simulation.arm().is_err());
    Ok(())
}
