//! Hardware that an `init`, a restart or a change of options starts, and commands that arm, while the robot is being disarmed or was.

use crate::kit::*;

/// Number of motors that turn.
static TURNING: AtomicI32 = AtomicI32::new(0);
/// Number of times that a motor was made.
static MADE: AtomicU32 = AtomicU32::new(0);
/// Behaviour in `init` of the motor made first, and of the later ones.
static FIRST: AtomicU32 = AtomicU32::new(WORKS);
static LATER: AtomicU32 = AtomicU32::new(WORKS);
/// Armed by the lidar's callback, with what that was told.
static ARMS: Mutex<Option<Live<Scanner>>> = Mutex::new(None);
static ARMED: Mutex<Option<Result<(), ArmError>>> = Mutex::new(None);
/// `true` while a brake holds.
static HOLDS: AtomicBool = AtomicBool::new(true);

/// `true` if a motor registers what stops it before it is started; `false` if after.
static REGISTERS_FIRST: AtomicBool = AtomicBool::new(false);

const WORKS: u32 = 0;
const FAILS: u32 = 1;
const PANICS: u32 = 2;
const FAILS_FOR_GOOD: u32 = 3;
/// Motor that works until it is read.
const FAILS_WHEN_READ: u32 = 4;
/// Motor that works, and goes on when it is made safe.
const STAYS: u32 = 5;

/// Condition that a brake waits for.
static BRAKES: AtomicU32 = AtomicU32::new(SLOWLY);
/// Wait for 300 ms.
const SLOWLY: u32 = 0;
/// Wait for a lidar that was started meanwhile to be made safe.
const UNTIL_SAFE: u32 = 1;
/// Wait for a lidar to be at the gate of its `init`.
const UNTIL_AT_GATE: u32 = 2;

/// Gate at which the second lidar's `init` and then its callback may wait.
static GATE: Gate = Gate::new();

fn alone() -> MutexGuard<'static, ()> {
    let alone = one_at_a_time();
    TURNING.store(0, Ordering::SeqCst);
    // `WORKS` and `SLOWLY` are zero.
    [&MADE, &FIRST, &LATER, &BRAKES, &CHANGED].into_iter().for_each(|number| number.store(0, Ordering::SeqCst));
    HOLDS.store(true, Ordering::SeqCst);
    [&REGISTERS_FIRST, &TURNS].into_iter().for_each(|is| is.store(false, Ordering::SeqCst));
    alone
}

fn turning() -> i32 {
    TURNING.load(Ordering::SeqCst)
}

/// Turns from `init` on, until it is made safe; fails once it does not turn.
pub(crate) struct Lidar {
    turns: Arc<AtomicBool>,
    fails: bool,
    stays: bool,
}

impl Sensor for Lidar {
    type Options = NoOptions;
    type Output = Number;

    fn init(_: NoOptions, context: &SensorContext) -> Result<Self, Fault> {
        let turns = Arc::new(AtomicBool::new(false));
        let stops = Arc::clone(&turns);
        let stop = move || {
            if stops.swap(false, Ordering::SeqCst) {
                GATE.pass("callback");
                if let Some(live) = ARMS.lock().map_err(|_| "it panicked")?.take() {
                    *ARMED.lock().map_err(|_| "it panicked")? = Some(live.arm());
                }
                TURNING.fetch_sub(1, Ordering::SeqCst);
            }
            Ok(())
        };
        let is_first = REGISTERS_FIRST.load(Ordering::SeqCst);
        if is_first {
            context.on_disarm(stop.clone());
            // Meanwhile the callback may run.
            std::thread::sleep(Duration::from_millis(30));
        }
        if MADE.load(Ordering::SeqCst) > 0 {
            GATE.pass("init");
        }
        turns.store(true, Ordering::SeqCst);
        TURNING.fetch_add(1, Ordering::SeqCst);
        if !is_first {
            context.on_disarm(stop);
        }
        let way = if MADE.fetch_add(1, Ordering::SeqCst) == 0 { &FIRST } else { &LATER };
        match way.load(Ordering::SeqCst) {
            FAILS => Err(Fault::new("no handshake")),
            PANICS => panic!("no handshake"),
            FAILS_FOR_GOOD => Err(Fault::permanent("no handshake")),
            way => Ok(Self { turns, fails: way == FAILS_WHEN_READ, stays: way == STAYS }),
        }
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Number>, Fault> {
        if self.fails || !(self.stays || self.turns.load(Ordering::SeqCst)) {
            return Err(Fault::new("it does not turn"));
        }
        Ok(Reading::nothing())
    }
}

/// Takes its time to be made safe.
fn brake(context: &SensorContext) -> Done {
    context.on_disarm(|| {
        match BRAKES.load(Ordering::SeqCst) {
            UNTIL_SAFE => {
                wait_until("it is restarted and made safe", || MADE.load(Ordering::SeqCst) > 1 && turning() == 0)
            }
            UNTIL_AT_GATE => GATE.wait_for(1),
            _ => std::thread::sleep(Duration::from_millis(300)),
        }
        if HOLDS.load(Ordering::SeqCst) { Ok(()) } else { Err(Fault::new("it slips")) }
    });
    Ok(())
}

/// Gate at which a command blocks its thread.
static BLOCK: Gate = Gate::new();

robot! {
    robot Scanner;
    commands {
        category other { concurrency: 3; }
        arm: Arm;
        block: Task(run = |_| BLOCK.stuck("block")) { allowed_states: [idle]; category: other; }
    }
    link base {
        sensor lidar: Lidar() { rate: 100 Hz; }
        sensor brake: Source(init = brake) { rate: 10 Hz; }
    }
}

#[test]
fn what_is_started_while_the_robot_is_disarmed_is_made_safe_as_well() {
    let _alone = alone();
    within(60, || {
        LATER.store(STAYS, Ordering::SeqCst);
        BRAKES.store(UNTIL_SAFE, Ordering::SeqCst);
        for registers_first in [false, true] {
            MADE.store(0, Ordering::SeqCst);
            REGISTERS_FIRST.store(registers_first, Ordering::SeqCst);
            // The lidar's own callback stops it at once, it fails and is restarted once. The brake waits for the second one.
            let robot = armed(Scanner::builder());
            assert_eq!((robot.disarm(), turning()), (Ok(()), 0), "{registers_first}");
            assert_eq!(MADE.load(Ordering::SeqCst), 2, "it was restarted meanwhile");
            let report = robot.stop();
            assert_eq!((report.safety, turning()), (Safety::Disarmed, 0), "{registers_first}");
        }
    });
}

/// Caller that arms the robot.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Arms {
    Call,
    Command,
    /// A command that waits for another one, which is gone while something is made safe.
    AfterAnother,
}

/// `disarm` does not wait for an `init` that takes longer. What that has started is made safe when it returns or fails, and the
/// robot is not armed before.
#[test]
fn what_is_started_after_a_disarming_by_an_init_from_before_is_made_safe_before_the_robot_is_armed() {
    let _alone = alone();
    within(60, || {
        BRAKES.store(UNTIL_AT_GATE, Ordering::SeqCst);
        for by in [Arms::Call, Arms::Command, Arms::AfterAnother] {
            for (registers_first, later) in [(false, STAYS), (true, STAYS), (false, FAILS_FOR_GOOD)] {
                let case = format!("{by:?}, {registers_first}, {later}");
                MADE.store(0, Ordering::SeqCst);
                LATER.store(later, Ordering::SeqCst);
                REGISTERS_FIRST.store(registers_first, Ordering::SeqCst);
                GATE.close("init");
                let robot = armed(Scanner::builder());
                if by == Arms::AfterAnother {
                    BLOCK.close("block");
                    robot.command(scanner::command::block, NoArguments).expect("it is allowed");
                    BLOCK.wait_for(1);
                }
                assert_eq!((robot.disarm(), turning(), robot.safety()), (Ok(()), 0, Safety::Disarmed), "{case}");
                let live = robot.live();
                let arm = move || match by {
                    Arms::Call => live.arm().map_err(|error| error.to_string()),
                    _ => {
                        let arm = live.command(scanner::command::arm, NoArguments).expect("it is allowed");
                        arm.wait().map_err(|error| error.to_string())
                    }
                };
                let mut arms = None;
                if by == Arms::AfterAnother {
                    arms = Some(std::thread::spawn(arm.clone()));
                    // It waits for the other one by now.
                    std::thread::sleep(Duration::from_millis(30));
                }
                GATE.close("callback");
                GATE.wait_for(1);
                assert_eq!((MADE.load(Ordering::SeqCst), turning()), (2, 1), "{case}: it turns, its callback runs");
                let arms = arms.unwrap_or_else(|| std::thread::spawn(arm));
                BLOCK.open();
                std::thread::sleep(Duration::from_millis(30));
                assert_eq!((robot.safety(), turning()), (Safety::Disarmed, 1), "{case}: not while something turns");
                GATE.open();
                assert_eq!(arms.join().expect("it does not panic"), Ok(()), "{case}");
                assert_eq!((robot.safety(), turning()), (Safety::Armed, 0), "{case}");
                let report = robot.stop();
                assert_eq!((report.safety, turning()), (Safety::Disarmed, 0), "{case}");
            }
        }
    });
}

/// Code that makes hardware safe gets an error at once if it arms the robot: it would wait for itself.
#[test]
fn what_makes_hardware_safe_cannot_arm_the_robot_meanwhile() {
    let _alone = alone();
    within(60, || {
        LATER.store(STAYS, Ordering::SeqCst);
        BRAKES.store(UNTIL_AT_GATE, Ordering::SeqCst);
        GATE.close("init");
        let robot = Scanner::builder().start().expect("it starts");
        assert_eq!((robot.arm(), robot.disarm()), (Ok(()), Ok(())));
        *lock(&ARMS) = Some(robot.live());
        GATE.open();
        wait_until("the second one is made safe", || MADE.load(Ordering::SeqCst) > 1 && turning() == 0);
        let told = lock(&ARMED).take();
        assert_eq!(told, Some(Err(ArmError::MakingSafe(vec!["sensor/base/lidar"]))));
        wait_until("it may be armed", || robot.arm() == Ok(()));
        lock(&ARMS).take();
        assert_eq!(robot.stop().safety, Safety::Disarmed);
    });
}

/// Starts a scanner whose restarts are so far apart that its panics do not escalate meanwhile.
fn start() -> Result<Running<Scanner>, StartError> {
    let mut builder = Scanner::builder();
    builder.supervision().first_backoff = Duration::from_millis(20);
    builder.start()
}

#[test]
fn what_an_init_has_started_that_fails_is_made_safe() {
    let _alone = alone();
    within(60, || {
        for way in [FAILS, PANICS, FAILS_FOR_GOOD] {
            MADE.store(0, Ordering::SeqCst);
            FIRST.store(way, Ordering::SeqCst);
            assert!(start().is_err() && turning() == 0, "{way}");
        }
        for way in [FAILS, PANICS, FAILS_FOR_GOOD] {
            MADE.store(0, Ordering::SeqCst);
            FIRST.store(FAILS_WHEN_READ, Ordering::SeqCst);
            LATER.store(way, Ordering::SeqCst);
            let robot = start().expect("it starts");
            assert_eq!(robot.arm(), Ok(()));
            wait_until("it is made again", || MADE.load(Ordering::SeqCst) >= 2);
            std::thread::sleep(Duration::from_millis(50));
            assert_eq!(robot.safety(), Safety::Armed, "{way}: the fault of one component is no danger");
            assert_eq!((robot.disarm(), turning()), (Ok(()), 0), "{way}");
            assert_eq!((robot.stop().safety, turning()), (Safety::Disarmed, 0), "{way}");
        }
    });
}

/// Distance to go. Its default takes long to find out.
#[derive(Clone, Debug, Payload)]
pub(crate) struct Far {
    metres: f64,
}

impl Default for Far {
    fn default() -> Self {
        std::thread::sleep(Duration::from_millis(200));
        Self { metres: 5.0 }
    }
}

/// Number of times that `go` ran.
static WENT: AtomicU32 = AtomicU32::new(0);

/// Goes there.
pub(crate) struct Go;

impl Command for Go {
    type Options = NoOptions;
    type Arguments = Far;
    type Output = ();

    async fn run(_: NoOptions, far: Far, _: CommandContext) -> Result<Outcome<()>, Fault> {
        WENT.fetch_add(far.metres as u32, Ordering::SeqCst);
        Ok(Outcome::done(()))
    }
}

/// Starts another command.
fn mission(context: CommandContext) -> Doing {
    Box::pin(async move {
        context.bus().start_command("command/go", "")?;
        Ok(Outcome::done(()))
    })
}

robot! {
    robot Commanded;
    commands {
        category other { concurrency: 3; }
        check: Task<true>(run = |context| after(context, 200));
        block: Task(run = |_| BLOCK.stuck("block")) { allowed_states: [idle]; category: other; }
        go: Go { allowed_states: [idle, executing]; category: other; }
        mission: Task(run = mission) { allowed_states: [idle]; category: other; }
    }
    link base { sensor brake: Source(init = brake) { rate: 10 Hz; } }
}

#[test]
fn a_robot_that_was_disarmed_is_not_armed_by_what_began_before() -> Result<(), Failure> {
    let _alone = alone();
    for somebody_arms in [false, true] {
        let mut simulation = Commanded::builder().simulate()?;
        let check = simulation.command(commanded::command::check, NoArguments)?;
        simulation.run_for(Duration::from_millis(100));
        if somebody_arms {
            simulation.arm()?;
        }
        assert_eq!((simulation.disarm(), simulation.safety()), (Ok(()), Safety::Disarmed));
        simulation.run_for(Duration::from_secs(1));
        assert_eq!(simulation.safety(), Safety::Disarmed);
        assert_eq!(check.try_result(), Some(Err(CommandError::Cancelled)));
    }

    let robot = armed(Commanded::builder());
    BLOCK.close("block");
    let _block = robot.command(commanded::command::block, NoArguments)?;
    BLOCK.wait_for(1);
    assert_eq!(robot.disarm(), Ok(()));
    // Both wait for the code that blocks.
    let live = robot.live();
    let (begins, has_begun) = mpsc::channel();
    let arms = std::thread::spawn(move || {
        let _ = begins.send(());
        live.arm()
    });
    let check = robot.command(commanded::command::check, NoArguments)?;
    has_begun.recv()?;
    std::thread::sleep(Duration::from_millis(100));
    assert_eq!((robot.disarm(), robot.safety()), (Ok(()), Safety::Disarmed));
    BLOCK.open();
    assert_eq!(arms.join().map_err(|_| "it does not panic")?, Err(ArmError::Cancelled));
    std::thread::sleep(Duration::from_millis(600));
    assert_eq!(robot.safety(), Safety::Disarmed);
    assert!(check.try_result().is_some_and(|result| result.is_err()), "it was cancelled");
    Ok(())
}

#[test]
fn a_command_that_was_cancelled_while_it_made_arguments_starts_nothing() -> Result<(), Failure> {
    let _alone = alone();
    let robot = armed(Commanded::builder());
    let mission = robot.command(commanded::command::mission, NoArguments)?;
    std::thread::sleep(Duration::from_millis(60));
    mission.cancel();
    std::thread::sleep(Duration::from_millis(400));
    assert_eq!(WENT.load(Ordering::SeqCst), 0);
    // The same one goes if nobody cancels it.
    robot.command(commanded::command::mission, NoArguments)?.wait()?;
    wait_until("the other command goes", || WENT.load(Ordering::SeqCst) > 0);
    assert_eq!(WENT.load(Ordering::SeqCst), 5);
    Ok(())
}

#[test]
fn force_forgives_nothing_once_the_robot_stops() {
    let _alone = alone();
    HOLDS.store(false, Ordering::SeqCst);
    within(60, || {
        for first in [true, false] {
            let robot = armed(Commanded::builder());
            let live = robot.live();
            let forces = std::thread::spawn(move || {
                std::thread::sleep(Duration::from_millis(if first { 0 } else { 100 }));
                live.force_disarm()
            });
            std::thread::sleep(Duration::from_millis(if first { 100 } else { 0 }));
            assert_eq!(robot.stop().safety, Safety::Error);
            assert!(forces.join().expect("it does not panic").is_err());
        }
    });
}

#[test]
fn each_disarm_reports_its_own_callbacks() {
    let _alone = alone();
    HOLDS.store(false, Ordering::SeqCst);
    within(60, || {
        let robot = armed(Commanded::builder());
        let live: Live<Commanded> = robot.live();
        let disarms = std::thread::spawn(move || live.disarm());
        // Its callback has read that the brake slips by the time the next one begins.
        wait_until("it has disarmed", || !matches!(robot.safety(), Safety::Armed | Safety::Disarming));
        HOLDS.store(true, Ordering::SeqCst);
        assert_eq!(robot.force_disarm(), Ok(()));
        let says = "not everything could be made safe: `sensor/base/brake`: disarming failed: it slips";
        assert_refused(disarms.join().expect("it does not panic"), says);
    });
}

/// `true` while a motor turns that is restarted, or whose options change; and the number of those changes.
static TURNS: AtomicBool = AtomicBool::new(false);
static CHANGED: AtomicU32 = AtomicU32::new(0);

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
fn gated_brake(context: &SensorContext) -> Done {
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
        sensor brake: Source(init = gated_brake) { rate: 10 Hz; }
        sensor fan: Source(init = fan, gain = param::speed, tune = Some(set_speed)) { rate: 100 Hz; }
    }
}

#[test]
fn an_actuator_that_restarts_while_the_robot_is_disarmed_is_disarmed_once_more() {
    let _alone = alone();
    within(60, || {
        let mut builder = Plain::builder();
        builder.options(SOURCE).init = gated_brake;
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

/// Results of `disarm` and `arm` in a callback.
type Said = (Result<(), DisarmError>, Result<(), ArmError>);

static SAID: Mutex<Vec<Said>> = Mutex::new(Vec::new());

/// The robot that is called.
static ROBOT: Mutex<Option<Live<Plain>>> = Mutex::new(None);

/// Calls the robot from its callback.
fn calls(context: &SensorContext) -> Done {
    context.on_disarm(|| {
        let robot = lock(&ROBOT).clone();
        if let Some(robot) = robot {
            lock(&SAID).push((robot.disarm(), robot.arm()));
        }
        Ok(())
    });
    Ok(())
}

#[test]
fn a_callback_cannot_wait_for_itself_and_a_replay_obeys_its_journal_alone() -> Result<(), Failure> {
    let _alone = alone();
    let calling = || {
        let mut builder = Plain::builder();
        builder.options(SOURCE).init = calls;
        builder
    };
    let mut builder = calling();
    let lines = journal(&mut builder);
    let called = |robot| *lock(&ROBOT) = robot;
    let mut simulation = builder.simulate()?;
    called(Some(simulation.live()));
    assert_eq!(simulation.arm(), Ok(()));
    assert_eq!(simulation.disarm(), Ok(()));
    simulation.run_for(Duration::from_millis(100));
    assert_eq!(simulation.stop().safety, Safety::Disarmed);
    let robot = calling().start()?;
    called(Some(robot.live()));
    assert_eq!((robot.arm(), robot.disarm()), (Ok(()), Ok(())));
    robot.stop();
    called(None);
    let said = std::mem::take(&mut *lock(&SAID));
    // On virtual time and in real time, at the disarming and at the stop.
    let during = (Err(DisarmError::Callback), Err(ArmError::Disarming));
    let stopping = (Err(DisarmError::Callback), Err(ArmError::Stopping));
    assert_eq!(said, [during.clone(), stopping.clone(), during, stopping]);

    let mut replay = calling().replay()?;
    assert_eq!((replay.arm(), replay.disarm()), (Err(ArmError::Replay), Err(DisarmError::Replay)));
    replay.play(entries(&lines))?;
    assert_eq!(replay.stop().safety, Safety::Disarmed);
    Ok(())
}
