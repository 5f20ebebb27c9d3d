//! A robot on which everything goes wrong that can: the content of a message decides what happens to the estimator that takes it.

use bb_core::RequestCodec;
use bb_core::prelude::*;
use bb_tests::random::Random;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// Number that chooses what happens where it arrives.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
#[payload(joint_position)]
pub(crate) struct Dice(pub(crate) f64);

impl bb_core::JointPositions for Dice {
    fn tell(&self, listener: &mut dyn FnMut(bb_core::JointReading<'_>)) {
        listener(bb_core::JointReading::at(&[self.0]));
    }
}

/// Options of [`Storm`].
#[derive(Clone, Debug, Options)]
pub(crate) struct StormOptions {
    #[option(default = 1)]
    pub(crate) seed: u64,
    #[option(default = 1000)]
    pub(crate) reads: u32,
    /// A parameter that is changed live.
    #[option(default = 1.0)]
    pub(crate) gain: f64,
}

/// A sensor whose readings are late, early, doubled, missing or not numbers, and that fails or panics now and then.
#[derive(Debug)]
pub(crate) struct Storm {
    random: Random,
    reads: u32,
    gain: f64,
}

impl Sensor for Storm {
    type Options = StormOptions;
    type Output = Dice;

    fn init(options: StormOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self { random: Random::new(options.seed), reads: options.reads, gain: options.gain })
    }

    fn read(&mut self, now: MonotonicTime) -> Result<Reading<Dice>, Fault> {
        if self.reads == 0 {
            return Ok(Reading::finished());
        }
        self.reads -= 1;
        let dice = Dice(self.gain.signum() * self.random.below(1000) as f64);
        Ok(match self.random.below(300) {
            0 => Reading::now(Dice(f64::NAN)),
            1 => Reading::at(now - Duration::from_millis(40), dice),
            2 => Reading::at(now + Duration::from_secs(3), dice),
            3 => return Err(Fault::new("the cable is loose")),
            4 => panic!("the driver has a bug"),
            5..12 => Reading::nothing(),
            _ => Reading::now(dice),
        })
    }
}

/// Asks for the sum.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
pub(crate) struct Ask(pub(crate) f64);

/// Request to emit a number; not recorded, so that a replay plays what was emitted.
#[derive(Debug)]
pub(crate) struct Add(pub(crate) f64);

/// Options of [`Fickle`].
#[derive(Clone, Debug, Options)]
pub(crate) struct FickleOptions {
    #[option(default = 1.0)]
    pub(crate) gain: f64,
}

/// An estimator that fails, panics, diverges, works for long and asks for timers, as the dice say.
#[derive(Debug)]
pub(crate) struct Fickle {
    sum: f64,
    gain: f64,
    start: MonotonicTime,
}

impl Estimator for Fickle {
    type Options = FickleOptions;
    type Input = Dice;
    type Output = Dice;

    fn init(options: FickleOptions, context: &Context) -> Result<Self, Fault> {
        context.request(Request::Continue(7));
        context.request(Request::Tick(Duration::from_millis(11)));
        Ok(Self { sum: 0.0, gain: options.gain, start: context.now() })
    }

    fn handle_input(&mut self, dice: &Stamped<Dice>) -> Result<Reply<Dice>, Fault> {
        self.sum += self.gain * dice.0 + dice.monotonic_time.seconds_since(self.start);
        let reply = Reply::emit(Dice(self.sum % 1000.0));
        Ok(match dice.0.abs() as u32 {
            0..4 => return Err(Fault::new("a bad number")),
            4..6 => panic!("a worse number"),
            6..30 => reply.diverged("far off"),
            30..40 => {
                std::thread::sleep(Duration::from_micros(400));
                reply
            }
            40..80 => reply.and(Request::Timer(1, Duration::from_millis(4))),
            80..100 => reply.and(Request::Timeout(Duration::from_millis(2))),
            100..120 => reply.and(Request::Continue(3)),
            120..125 => reply.and(Request::Tick(Duration::from_millis(7))),
            125..200 => Reply::none(),
            _ => reply,
        })
    }

    fn handle_info(&mut self, info: Info) -> Result<Reply<Dice>, Fault> {
        self.sum *= 0.5;
        match info {
            Info::Timeout if self.sum > 900.0 => Err(Fault::new("it took too long")),
            _ => Ok(Reply::emit(Dice(self.sum))),
        }
    }

    fn handle_continue(&mut self, step: u32) -> Result<Reply<Dice>, Fault> {
        self.sum += f64::from(step);
        Ok(if step == 0 { Reply::emit(Dice(self.sum)) } else { Reply::none().and(Request::Continue(step - 1)) })
    }
}

impl HandleCall<Ask> for Fickle {
    type Response = f64;
    const RECORD: Option<RequestCodec<Ask>> = Some(RequestCodec::bytes());

    fn handle_call(&mut self, Ask(more): Ask) -> Result<(f64, Reply<Dice>), Fault> {
        self.sum += more;
        if more > 90.0 {
            return Err(Fault::new("asked for too much"));
        }
        Ok((self.sum, Reply::emit(Dice(self.sum))))
    }
}

impl HandleCast<Ask> for Fickle {
    const RECORD: Option<RequestCodec<Ask>> = Some(RequestCodec::bytes());

    fn handle_cast(&mut self, Ask(more): Ask) -> Result<Reply<Dice>, Fault> {
        self.sum -= more;
        assert!(more < 97.0, "told too much");
        Ok(Reply::emit(Dice(self.sum)))
    }
}

impl HandleCast<Add> for Fickle {
    fn handle_cast(&mut self, Add(more): Add) -> Result<Reply<Dice>, Fault> {
        // It may not change the state: the journal holds what it emits, and nothing else.
        Ok(Reply::emit(Dice(more)))
    }
}

/// Takes two, and a third if there is one.
#[derive(Clone, Copy, Debug, Inputs)]
pub(crate) struct Three<'a> {
    first: Input<'a, Dice>,
    second: Input<'a, Dice>,
    third: Option<Input<'a, Dice>>,
}

/// Adds up what it takes.
#[derive(Debug)]
pub(crate) struct Join(f64);

impl Estimator for Join {
    type Options = NoOptions;
    type Input = Three<'static>;
    type Output = Dice;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self(0.0))
    }

    fn handle_input(&mut self, three: Three<'_>) -> Result<Reply<Dice>, Fault> {
        self.0 += three.first.0 + three.second.0 - three.third.map_or(0.0, |third| third.0);
        Ok(Reply::emit(Dice(self.0 % 1000.0)))
    }
}

/// Counts of a [`Squall`].
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
pub(crate) struct Gust {
    pub(crate) speed: f64,
}

/// All that has come since the last run, and what other code publishes.
#[derive(Clone, Copy, Debug, Inputs)]
pub(crate) struct Fronts<'a> {
    dice: Input<'a, Dice>,
    fronts: Every<'a, Dice>,
    newest: Option<Input<'a, Dice>>,
}

/// Emits none, one or several at times of their own in one reply.
#[derive(Debug)]
pub(crate) struct Squall;

impl Estimator for Squall {
    type Options = NoOptions;
    type Input = Fronts<'static>;
    type Output = Vec<Timed<Gust>>;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, fronts: Fronts<'_>) -> Result<Reply<Vec<Timed<Gust>>>, Fault> {
        let newest = fronts.newest.map_or(0.0, |newest| newest.0);
        let of_fronts = fronts.fronts.iter().map(|front| (front.monotonic_time, front.0 + newest));
        let of_dice =
            (0..fronts.dice.0.abs() as u32 % 4).map(|number| (fronts.dice.monotonic_time, f64::from(number)));
        let gusts = of_fronts.chain(of_dice);
        Ok(Reply::emit(gusts.map(|(time, speed)| Timed::new(time, Gust { speed })).collect()))
    }
}

/// Time at which the robot of a day in real time was asked to stop, and the delay until its motor was, day by day.
pub(crate) static STOPPED: Mutex<(Option<Instant>, Vec<Duration>)> = Mutex::new((None, Vec::new()));

/// An actuator that fails at some commands, and sometimes cannot be disarmed at first.
#[derive(Debug)]
pub(crate) struct Motor(f64);

impl Actuator for Motor {
    type Options = NoOptions;
    type Command = Dice;

    fn init(_: NoOptions, _: &ActuatorContext) -> Result<Self, Fault> {
        Ok(Self(0.0))
    }

    fn handle_command(&mut self, dice: &Stamped<Dice>) -> Result<(), Fault> {
        self.0 = dice.0;
        if dice.0.abs() < 3.0 { Err(Fault::new("it stalls")) } else { Ok(()) }
    }

    fn disarm(&mut self) -> Result<(), Fault> {
        let mut stopped = STOPPED.lock().unwrap_or_else(PoisonError::into_inner);
        let took = stopped.0.take().map(|start| start.elapsed());
        stopped.1.extend(took);
        drop(stopped);
        if self.0.abs() > 995.0 { Err(Fault::new("the brake is stuck")) } else { Ok(()) }
    }
}

/// Options of [`Drive`].
#[derive(Clone, Debug, Options)]
pub(crate) struct DriveOptions {
    #[option(default = 5)]
    pub(crate) steps: u32,
}

/// Moves the motor step by step, changes a parameter, and ends in another state.
#[derive(Debug)]
pub(crate) struct Drive;

impl Command for Drive {
    type Options = DriveOptions;
    type Arguments = NoArguments;
    type Output = f64;

    async fn run(options: DriveOptions, _: NoArguments, context: CommandContext) -> Result<Outcome<f64>, Fault> {
        let motor = context.bus().actuator::<Dice>("actuator/base/arm/motor")?;
        let mut random = Random::new(context.now().as_nanos() as u64);
        for _ in 0..options.steps {
            context.sleep(Duration::from_millis(random.below(6))).await;
            motor.send(Dice(random.below(1000) as f64))?;
            context.set_parameter("param/gain", random.below(20) as f64 / 10.0 - 1.0)?;
        }
        match random.below(8) {
            0 => Err(Fault::new("it did not get there")),
            1 => panic!("the command has a bug"),
            2 => Ok(Outcome::done(1.0)),
            _ => Ok(Outcome::done(2.0).next_state(if random.below(2) == 0 { "careful" } else { "idle" })),
        }
    }
}

/// Publishes what it received last, and sets a parameter from it.
#[derive(Debug)]
pub(crate) struct Minder {
    joined: Subscription<Dice>,
    bus: bb_core::Bus,
}

impl Service for Minder {
    type Options = NoOptions;
    type Output = Dice;

    fn init(_: NoOptions, context: &ServiceContext) -> Result<Self, Fault> {
        let bus = context.bus();
        Ok(Self { joined: bus.subscribe("estimator/base/joined", Overflow::default())?, bus })
    }

    fn update(&mut self, _: MonotonicTime) -> Result<Reading<Dice>, Fault> {
        let Some(dice) = self.joined.drain().last() else { return Ok(Reading::nothing()) };
        if dice.0 < -900.0 {
            return Err(Fault::new("too little"));
        }
        if dice.0 > 900.0 {
            self.bus.set_parameter("param/pace", dice.0 / 1000.0)?;
        }
        Ok(Reading::now(dice.payload))
    }
}

robot! {
    pub(crate) robot Weathered;

    parameters {
        gain: f64 = 1.0, range: -1.0..=2.0;
        pace: f64 = 1.0;
        lull: f64 = 1.0;
    }
    states { careful; }
    commands {
        category motion { concurrency: 2; }
        arm: Arm;
        disarm: Disarm;
        drive: Drive { category: motion; allowed_states: [idle, executing, careful]; timeout: 20 ms; }
        react: Drive(steps = 2) { category: motion; allowed_states: [idle, executing, careful]; cancel: [motion]; }
        halt: Drive(steps = 1) { allowed_states: [idle, executing, careful]; cancel: all; }
    }
    controllers {
        controller minder: Minder() { rate: 90 Hz; }
        controller gale: Reaction(
            when = estimator::base::squall.speed, above = 400.0, for = 4 ms, run = command::react, cooldown = 9 ms,
        );
        controller calm: Reaction(
            when = estimator::base::squall.speed, below = param::lull, run = command::drive, cooldown = 30 ms,
        ) { rate: 70 Hz; }
    }

    link base {
        sensor a: Storm(gain = param::gain) {
            rate: 1 kHz;
            estimator near: Fickle(gain = param::gain) {
                latency_budget: 200 us;
                lost_after: 5 ms;
                recover_after: 3;
                on_degraded: react;
                on_lost: halt;
                on_recovered: drive;
            }
        }
        sensor b: Storm(seed = 2) { rate: 700 Hz; estimator beside: Fickle(); }
        sensor fed: External<Dice>();
        estimator joined: Join() {
            input first: sensor::base::a::near, driver;
            input second: sensor::base::b;
            input third: sensor::base::fed, optional, within: 4 ms;
            sync_tolerance: 3 ms;
            lost_after: 20 ms;
        }
        estimator far: Fickle(gain = param::pace) { input dice: sensor::base::b::beside; runs_on: worker; lost_after: 9 ms; }
        estimator squall: Squall() {
            input dice: sensor::base::b, driver;
            input fronts: weather::front, external;
            input newest: weather::front, external, optional;
        }
        estimator last: Fickle() { input dice: far; latency_budget: 300 us; }
        joint arm: continuous {
            axis: z;
            actuator motor: Motor();
            sensor encoder: Storm(seed = 3) { rate: 50 Hz; }
            link hand { }
        }
    }
}
