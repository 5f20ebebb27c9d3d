//! The kit that the robots of these tests are made of: components whose code is an option, so that a test writes only what it is
//! about, and what many of them share.

use bb_core::payload::ActuatorCommand;
use bb_core::prelude::*;
use bb_core::{Builder, HealthTransition, JointPositions, JointReading, Report, RequestCodec, Robot, Running};
use std::fmt::{Debug, Display, Formatter};
use std::pin::{Pin, pin};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context as Polled, Wake, Waker};

/// A number; at a joint, its position.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
#[payload(joint_position)]
pub(crate) struct Number(pub(crate) f64);

impl JointPositions for Number {
    fn tell(&self, listener: &mut dyn FnMut(JointReading<'_>)) {
        listener(JointReading::at(&[self.0]));
    }
}

pub(crate) type Failure = Box<dyn std::error::Error>;

/// Result of code that returns nothing.
pub(crate) type Done = Result<(), Fault>;

/// Result of code of an [`Echo`].
pub(crate) type Replied = Result<Reply<Number>, Fault>;

/// Code of an [`Echo`] for a number, with another one that it keeps.
pub(crate) type OnNumber = fn(&mut f64, f64) -> Replied;

/// Result of code of a [`Source`] or a [`Pulse`].
pub(crate) type Read = Result<Reading<Number>, Fault>;

/// Result of code of a [`Task`].
pub(crate) type Doing = Pin<Box<dyn Future<Output = Result<Outcome<()>, Fault>> + Send>>;

/// Options of [`Source`].
#[derive(Clone, Debug, Options)]
pub(crate) struct SourceOptions {
    #[option(default = |_| Ok(()))]
    pub(crate) init: fn(&SensorContext) -> Done,
    /// Code of the reading of this number, counted from 1.
    #[option(default = |_, _| Ok(Reading::nothing()))]
    pub(crate) read: fn(u32, MonotonicTime) -> Read,
    #[option(default = || None)]
    pub(crate) starts_at: fn() -> Option<MonotonicTime>,
    #[option(default = |_| ())]
    pub(crate) terminate: fn(Termination<'_>),
    #[option(default = || ())]
    pub(crate) dropped: fn(),
    /// Another one is made when it changes, unless there is code for that.
    #[option(default = 1.0, range = 0.0..=1e6)]
    pub(crate) gain: f64,
    #[option(default = None)]
    pub(crate) tune: Option<fn(f64) -> Done>,
}

/// A sensor; it measures nothing, unless it is told to.
pub(crate) struct Source(SourceOptions, u32);

impl Sensor for Source {
    type Options = SourceOptions;
    type Output = Number;

    fn init(options: SourceOptions, context: &SensorContext) -> Result<Self, Fault> {
        (options.init)(context)?;
        Ok(Self(options, 0))
    }

    fn starts_at(&self) -> Option<MonotonicTime> {
        (self.0.starts_at)()
    }

    fn read(&mut self, now: MonotonicTime) -> Read {
        self.1 += 1;
        (self.0.read)(self.1, now)
    }

    fn handle_options(&mut self, options: SourceOptions, context: &SensorContext) -> Done {
        // Else what a sensor without this method does.
        let Some(tune) = options.tune else { return CanEncoder.handle_options(NoOptions, context) };
        tune(options.gain)
    }

    fn terminate(&mut self, reason: Termination<'_>) {
        (self.0.terminate)(reason);
    }
}

impl Drop for Source {
    fn drop(&mut self) {
        (self.0.dropped)();
    }
}

/// Options of [`Echo`].
#[derive(Clone, Options)]
pub(crate) struct EchoOptions {
    #[option(default = |_| Ok(()))]
    pub(crate) init: fn(&Context) -> Done,
    /// The number that it keeps at first.
    #[option(default = |_| 0.0)]
    pub(crate) keep: fn(&Context) -> f64,
    /// Code for a number, with another one that it keeps.
    #[option(default = |_, number| Ok(Reply::emit(Number(number))))]
    pub(crate) input: OnNumber,
    #[option(default = |_, _| Ok(Reply::none()))]
    pub(crate) info: fn(&mut f64, Info) -> Replied,
    #[option(default = |_, _| Ok(Reply::none()))]
    pub(crate) go_on: fn(&mut f64, u32) -> Replied,
    #[option(default = || None)]
    pub(crate) end: fn() -> Option<Number>,
    #[option(default = |_| ())]
    pub(crate) terminate: fn(Termination<'_>),
    #[option(default = || ())]
    pub(crate) dropped: fn(),
    /// Factor of what it gets. Another one is made when it changes, unless there is code for that.
    #[option(default = 1.0)]
    pub(crate) gain: f64,
    #[option(default = None)]
    pub(crate) tune: Option<fn(f64) -> Done>,
}

/// Leaves out the addresses of its code, which are others in another process that replays a journal with it.
impl Debug for EchoOptions {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("EchoOptions").field("gain", &self.gain).finish_non_exhaustive()
    }
}

/// An estimator with a number that it keeps; it emits what it gets, unless it is told to do something else.
pub(crate) struct Echo(EchoOptions, pub(crate) f64);

impl Estimator for Echo {
    type Options = EchoOptions;
    type Input = Number;
    type Output = Number;

    fn init(options: EchoOptions, context: &Context) -> Result<Self, Fault> {
        (options.init)(context)?;
        let kept = (options.keep)(context);
        Ok(Self(options, kept))
    }

    fn handle_input(&mut self, number: &Stamped<Number>) -> Replied {
        (self.0.input)(&mut self.1, self.0.gain * number.0)
    }

    fn handle_options(&mut self, options: EchoOptions, context: &Context) -> Done {
        // Else what an estimator without this method does.
        let Some(tune) = options.tune else { return Snapshot.handle_options(NoOptions, context) };
        self.0.gain = options.gain;
        tune(options.gain)
    }

    fn handle_info(&mut self, info: Info) -> Replied {
        (self.0.info)(&mut self.1, info)
    }

    fn handle_continue(&mut self, step: u32) -> Replied {
        (self.0.go_on)(&mut self.1, step)
    }

    fn handle_end(&mut self) -> Option<Number> {
        (self.0.end)()
    }

    fn terminate(&mut self, reason: Termination<'_>) {
        (self.0.terminate)(reason);
    }
}

impl Drop for Echo {
    fn drop(&mut self) {
        (self.0.dropped)();
    }
}

/// Asks an [`Echo`] for the number that it keeps.
pub(crate) struct Ask;

impl HandleCall<Ask> for Echo {
    type Response = f64;
    fn handle_call(&mut self, Ask: Ask) -> Result<(f64, Reply<Number>), Fault> {
        Ok((self.1, Reply::none()))
    }
}

/// Call at which an [`Echo`] fails.
pub(crate) struct Break;

impl HandleCall<Break> for Echo {
    type Response = ();
    fn handle_call(&mut self, Break: Break) -> Result<((), Reply<Number>), Fault> {
        Err(Fault::new("broken on request"))
    }
}

impl HandleCast<Number> for Echo {
    const RECORD: Option<RequestCodec<Number>> = Some(RequestCodec::bytes());

    fn handle_cast(&mut self, number: Number) -> Replied {
        Ok(Reply::emit(number))
    }
}

/// Options of [`Servo`].
#[derive(Clone, Debug, Options)]
pub(crate) struct ServoOptions {
    #[option(default = |_| Ok(()))]
    pub(crate) init: fn(&ActuatorContext) -> Done,
    #[option(default = |_| Ok(()))]
    pub(crate) command: fn(f64) -> Done,
    /// Code that runs with the last number when it is disarmed.
    #[option(default = |_| Ok(()))]
    pub(crate) disarm: fn(f64) -> Done,
    #[option(default = |_| ())]
    pub(crate) terminate: fn(Termination<'_>),
    #[option(default = || ())]
    pub(crate) dropped: fn(),
    /// Another one is made when it changes.
    #[option(default = 1.0)]
    pub(crate) gain: f64,
}

/// An actuator; it does nothing, unless it is told to.
pub(crate) struct Servo(ServoOptions, f64);

impl Actuator for Servo {
    type Options = ServoOptions;
    type Command = Number;

    fn init(options: ServoOptions, context: &ActuatorContext) -> Result<Self, Fault> {
        (options.init)(context)?;
        Ok(Self(options, 0.0))
    }

    fn handle_command(&mut self, command: &Stamped<Number>) -> Done {
        self.1 = command.0;
        (self.0.command)(self.1)
    }

    fn disarm(&mut self) -> Done {
        (self.0.disarm)(self.1)
    }

    fn terminate(&mut self, reason: Termination<'_>) {
        (self.0.terminate)(reason);
    }
}

impl Drop for Servo {
    fn drop(&mut self) {
        (self.0.dropped)();
    }
}

/// Options of [`Pulse`].
#[derive(Clone, Debug, Options)]
pub(crate) struct PulseOptions {
    /// Gives the code of its updates.
    #[option(default = |_| Ok(Box::new(|_| Ok(Reading::nothing()))))]
    pub(crate) init: MakeUpdate,
}

/// Function that gives a [`Pulse`] its code.
pub(crate) type MakeUpdate = fn(&ServiceContext) -> Result<Update, Fault>;

/// The code of an update of a [`Pulse`].
pub(crate) type Update = Box<dyn FnMut(MonotonicTime) -> Read + Send>;

/// A controller or bridge; it publishes nothing, unless it is told to.
pub(crate) struct Pulse(Update);

impl Service for Pulse {
    type Options = PulseOptions;
    type Output = Number;

    fn init(options: PulseOptions, context: &ServiceContext) -> Result<Self, Fault> {
        Ok(Self((options.init)(context)?))
    }

    fn update(&mut self, now: MonotonicTime) -> Read {
        (self.0)(now)
    }
}

/// Options of [`Task`].
#[derive(Clone, Debug, Options)]
pub(crate) struct TaskOptions {
    #[option(default = |_| Box::pin(async { Ok(Outcome::done(())) }))]
    pub(crate) run: fn(CommandContext) -> Doing,
}

/// A command; it does nothing, unless it is told to. It may arm the robot when it is done.
pub(crate) struct Task<const ARMS: bool = false>;

impl<const ARMS: bool> Command for Task<ARMS> {
    type Options = TaskOptions;
    type Arguments = NoArguments;
    type Output = ();
    const ROLE: Role = if ARMS { Role::Arming } else { Role::Plain };

    fn run(
        options: TaskOptions,
        _: NoArguments,
        context: CommandContext,
    ) -> impl Future<Output = Result<Outcome<()>, Fault>> + Send {
        (options.run)(context)
    }
}

/// The code of a [`Task`] that is done after so long.
pub(crate) fn after(context: CommandContext, millis: u64) -> Doing {
    Box::pin(async move {
        context.sleep(Duration::from_millis(millis)).await;
        Ok(Outcome::done(()))
    })
}

/// The code of an [`Echo`] that ticks from its start on.
pub(crate) fn tick<const MILLIS: u64>(context: &Context) -> Done {
    context.request(Request::Tick(Duration::from_millis(MILLIS)));
    Ok(())
}

/// An estimator that says what its options are.
pub(crate) struct Known<O>(O);

impl<O: Options> Estimator for Known<O> {
    type Options = O;
    type Input = Number;
    type Output = Number;

    fn init(options: O, _: &Context) -> Result<Self, Fault> {
        Ok(Self(options))
    }

    fn handle_input(&mut self, _: &Stamped<Number>) -> Replied {
        Ok(Reply::none())
    }

    fn handle_options(&mut self, options: O, _: &Context) -> Done {
        self.0 = options;
        Ok(())
    }
}

/// Asks a [`Known`] for its options.
pub(crate) struct Which;

impl<O: Options> HandleCall<Which> for Known<O> {
    type Response = O;
    fn handle_call(&mut self, Which: Which) -> Result<(O, Reply<Number>), Fault> {
        Ok((self.0.clone(), Reply::none()))
    }
}

/// Options of [`Counter`].
#[derive(Clone, Debug, Options)]
pub(crate) struct CounterOptions {
    /// First number.
    #[option(default = 0.0)]
    pub(crate) start: f64,
    /// Number of numbers that it gives.
    #[option(default = 5)]
    pub(crate) count: u32,
}

/// Counts up by one.
pub(crate) struct Counter(CounterOptions);

impl Sensor for Counter {
    type Options = CounterOptions;
    type Output = Number;

    fn init(options: CounterOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self(options))
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Number>, Fault> {
        if self.0.count == 0 {
            return Ok(Reading::finished());
        }
        self.0.count -= 1;
        self.0.start += 1.0;
        Ok(Reading::now(Number(self.0.start - 1.0)))
    }
}

/// Options of [`Scale`].
#[derive(Clone, Debug, Options)]
pub(crate) struct ScaleOptions {
    /// Factor that each number is multiplied by.
    #[option(default = 2.0, range = -1e3..=1e3)]
    pub(crate) factor: f64,
}

/// Multiplies.
pub(crate) struct Scale(f64);

impl Estimator for Scale {
    type Options = ScaleOptions;
    type Input = Number;
    type Output = Number;

    fn init(options: ScaleOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self(options.factor))
    }

    fn handle_input(&mut self, number: &Stamped<Number>) -> Result<Reply<Number>, Fault> {
        Ok(Reply::emit(Number(number.0 * self.0)))
    }
}

/// Inputs that [`Snapshot`] received: the numbers, and which were new. NaN would be dropped, so what is missing is -1.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
pub(crate) struct Seen {
    pub(crate) driver: f64,
    pub(crate) second: f64,
    pub(crate) second_is_new: bool,
    pub(crate) third: f64,
    pub(crate) third_is_new: bool,
}

/// Three numbers.
#[derive(Clone, Copy, Debug, Inputs)]
pub(crate) struct Numbers<'a> {
    /// Input that dispatches in these tests.
    pub(crate) driver: Input<'a, Number>,
    /// One that must be there.
    pub(crate) second: Input<'a, Number>,
    /// One that need not.
    pub(crate) third: Option<Input<'a, Number>>,
}

/// Declares estimators without options and state by the code of their inputs.
macro_rules! stateless {
    ($($(#[$doc:meta])* $name:ident: $Input:ty => $Output:ty, |$input:ident: $View:ty| $code:expr;)*) => { $(
        $(#[$doc])*
        pub(crate) struct $name;

        impl Estimator for $name {
            type Options = NoOptions;
            type Input = $Input;
            type Output = $Output;

            fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
                Ok(Self)
            }

            fn handle_input(&mut self, $input: $View) -> Result<Reply<$Output>, Fault> {
                $code
            }
        }
    )* };
}
#[allow(unused_imports, reason = "other binaries of tests take a part of this file")]
pub(crate) use stateless;

stateless! {
    /// Emits what it is given.
    Snapshot: Numbers<'static> => Seen, |numbers: Numbers<'_>| Ok(Reply::emit(Seen {
        driver: numbers.driver.0,
        second: numbers.second.0,
        second_is_new: numbers.second.is_new(),
        third: numbers.third.map_or(-1.0, |third| third.0),
        third_is_new: numbers.third.is_some_and(|third| third.is_new()),
    }));
}

/// The driver of an encoder on a bus that is not there.
pub(crate) struct CanEncoder;

impl Sensor for CanEncoder {
    type Options = NoOptions;
    type Output = JointState;

    fn init(_: NoOptions, _: &SensorContext) -> Result<Self, Fault> {
        Err(Fault::new("no such bus: can0"))
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<JointState>, Fault> {
        Ok(Reading::nothing())
    }
}

/// Arguments of a [`Move`].
#[derive(Clone, Copy, Debug, Default, Payload)]
pub(crate) struct Target {
    pub(crate) millis: u64,
    pub(crate) does: Option<&'static str>,
}

/// Takes its time.
pub(crate) struct Move;

impl Command for Move {
    type Options = NoOptions;
    type Arguments = Target;
    type Output = MonotonicTime;

    async fn run(_: NoOptions, target: Target, context: CommandContext) -> Result<Outcome<MonotonicTime>, Fault> {
        context.sleep(Duration::from_millis(target.millis)).await;
        let outcome = Outcome::done(context.now());
        match target.does {
            Some("fail") => Err(Fault::new("no way there")),
            Some("panic") => panic!("fell over"),
            Some(state) => Ok(outcome.next_state(state)),
            None => Ok(outcome),
        }
    }
}

/// Locks what threads and tests share, though one that had it panicked.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The changes of health that wait in a subscription, with their reasons.
pub(crate) fn changes_of(health: &Subscription<HealthTransition>) -> Vec<(HealthState, HealthReason)> {
    health.drain().map(|change| (change.to, change.reason)).collect()
}

/// The numbers that wait in a subscription.
pub(crate) fn numbers(subscription: &Subscription<Number>) -> Vec<f64> {
    subscription.drain().map(|number| number.0).collect()
}

/// Calls `run` on the publisher's thread at the next message.
pub(crate) fn when_woken<T: Payload>(subscription: &mut Subscription<T>, run: impl FnMut() + Send + 'static) {
    struct Wakes(Mutex<Box<dyn FnMut() + Send>>);
    impl Wake for Wakes {
        fn wake(self: Arc<Self>) {
            (lock(&self.0))();
        }
    }
    let waker = Waker::from(Arc::new(Wakes(Mutex::new(Box::new(run)))));
    let awaited = pin!(subscription.recv_async());
    assert!(awaited.poll(&mut Polled::from_waker(&waker)).is_pending());
}

/// A joint at rest, or that does not know better.
pub(crate) fn joint(position: f64) -> JointState {
    JointState { position, velocity: None, effort: None }
}

pub(crate) fn move_to(position: f64) -> ActuatorCommand {
    PositionCommand { position, ..Default::default() }.into()
}

pub(crate) fn move_at(velocity: f64) -> ActuatorCommand {
    VelocityCommand { velocity, effort: None }.into()
}

/// The time `millis` after zero.
pub(crate) fn at(millis: i64) -> MonotonicTime {
    MonotonicTime::from_nanos(millis * 1_000_000)
}

/// Starts a robot on virtual time and arms it.
pub(crate) fn armed_simulation<R: Robot>(builder: Builder<R>) -> Simulation<R> {
    let simulation = builder.simulate().expect("it starts");
    simulation.arm().expect("it may be armed");
    simulation
}

/// Starts a robot and arms it.
pub(crate) fn armed<R: Robot>(builder: Builder<R>) -> Running<R> {
    let running = builder.start().expect("it starts");
    running.arm().expect("it may be armed");
    running
}

/// The faults of a report, as it writes them.
pub(crate) fn told(report: &Report) -> Vec<String> {
    report.faults.iter().map(ToString::to_string).collect()
}

/// Asserts that something is refused, and that the error says so.
#[track_caller]
pub(crate) fn assert_refused<T, E: Display>(result: Result<T, E>, says: &str) {
    assert_eq!(result.map(drop).map_err(|error| error.to_string()), Err(says.to_owned()));
}

/// Times in milliseconds and numbers of the messages that wait in a subscription.
pub(crate) fn timed(numbers: &Subscription<Number>) -> Vec<(i64, f64)> {
    numbers.drain().map(|number| (number.monotonic_time.as_nanos() / 1_000_000, number.0)).collect()
}

/// Takes steps such as `a1 b2: seen`, which publishes for `a` at 1 ms and for `b` at 2 ms: what is seen then is compared.
pub(crate) fn check_steps<R: Robot>(
    row: &str,
    steps: &str,
    simulation: &mut Simulation<R>,
    publish: impl Fn(&mut Simulation<R>, &str, i64),
    mut seen: impl FnMut(&Simulation<R>) -> Vec<String>,
) {
    for step in steps.split("; ") {
        let (publishes, expected) = step.split_once(": ").unwrap_or((step, ""));
        for (sensor, millis) in publishes.split(' ').map(|publish| publish.split_at(1)) {
            publish(simulation, sensor, millis.parse().expect("milliseconds"));
        }
        assert_eq!(seen(simulation).join(", "), expected, "{row}: {step}");
    }
}

/// Runs a test that might hang; panics if it is not over after `seconds`.
pub(crate) fn within(seconds: u64, test: impl FnOnce() + Send + 'static) {
    let thread = std::thread::spawn(test);
    let start = std::time::Instant::now();
    while !thread.is_finished() {
        assert!(start.elapsed() < Duration::from_secs(seconds), "it hangs");
        std::thread::sleep(Duration::from_millis(1));
    }
    if let Err(panic) = thread.join() {
        std::panic::resume_unwind(panic);
    }
}
