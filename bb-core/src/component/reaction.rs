//! A controller that turns a condition on a field of a topic into a command.

use super::{Bus, CommandPath, Counter, DynamicExecution, Fault, Reading, Service, ServiceContext, TopicField};
use crate::message::Payload;
use crate::pubsub::{DynamicMessage, DynamicSubscription, Overflow, Select};
use crate::time::MonotonicTime;
use bb_macros::Options;
use std::mem::{replace, take};
use std::time::Duration;

/// Starts a command when a field of a topic's messages has been beyond a bound for some time:
///
/// ```
/// use bb_core::prelude::*;
/// # struct Land;
/// # impl Command for Land {
/// #     type Options = NoOptions;
/// #     type Arguments = NoArguments;
/// #     type Output = ();
/// #     async fn run(_: NoOptions, _: NoArguments, _: CommandContext) -> Result<Outcome<()>, Fault> {
/// #         Ok(Outcome::done(()))
/// #     }
/// # }
/// robot! {
///     robot Drone;
///     commands { land: Land { allowed_states: [idle, executing]; cancel: all; } }
///     sensors { sensor battery: External<BatteryState>(); }
///     controllers {
///         controller low: Reaction(
///             when = sensor::battery.voltage, below = 11 V, for = 2 s, run = command::land, cooldown = 30 s,
///         );
///     }
///     link base;
/// }
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let mut drone = Drone::builder().simulate()?;
/// drone.arm()?;
/// for second in 0..=3 {
///     drone.run_until(MonotonicTime::from_nanos(second * 1_000_000_000));
///     drone.publish(drone::sensor::battery, drone.clock().now(), BatteryState { voltage: 10.8, ..Default::default() });
/// }
/// drone.run_for(Duration::from_millis(20));
/// assert_eq!(drone.report().commands[0].started, 1);
/// # Ok(())
/// # }
/// ```
///
/// - The condition is *fulfilled* by a message whose value is less than `below` or greater than `above`. It must be fulfilled by all
///   messages for `for`, by their stamps; one that does not fulfil it restarts `for`.
/// - A value that is missing or NaN does not fulfil it, nor does silence: no message for `stale_after`. Both are counted, as
///   `not a number` and `silent` ([`SourceStatistics::counts`](crate::run::SourceStatistics::counts)).
/// - The command runs with its default arguments. Its events name this controller as the caller. When it has ended, it runs again
///   after `cooldown` if the condition still holds; likewise when it was refused, which is published at the command's path too.
/// - A message that is not newer than the one before it is ignored.
///
/// Without a `rate`, it acts when a message arrives, and on virtual time within 10 ms; with one, at that rate. All messages that arrived
/// in between are judged, the newest 16,384 of them; the others are counted as `lost`. It publishes a [`ReactionState`] when it starts to
/// be fulfilled, when that ends, also by silence or new bounds, and when it has started a command or been refused.
#[derive(Debug)]
pub struct Reaction {
    options: ReactionOptions,
    bus: Bus,
    messages: DynamicSubscription,
    /// `true` if the reaction waits for messages itself: it has no rate, and time is real.
    waits: bool,
    is_periodic: bool,
    stale_after: Duration,
    /// Declared period of the topic.
    period: Option<Duration>,
    /// The stamp of the newest message, and when it was received.
    last: Option<MonotonicTime>,
    received: MonotonicTime,
    is_silent: bool,
    fulfilled_since: Option<MonotonicTime>,
    /// The condition has ended by new bounds, which has yet to be published.
    has_ended: bool,
    /// A message after a silence, which is judged once the end of the condition is published.
    next: Option<DynamicMessage>,
    execution: Option<DynamicExecution>,
    ready: Option<MonotonicTime>,
    not_numbers: Counter,
    silences: Counter,
    refused_options: Counter,
    lost: Counter,
    /// Number of the lost messages that are counted.
    counted: u64,
}

/// Options of [`Reaction`].
#[derive(Clone, Debug, PartialEq, Options)]
pub struct ReactionOptions {
    /// The field that is watched: `sensor::battery.voltage`.
    #[option(required)]
    pub when: TopicField,
    /// Fulfilled by values less than this. At least one of `below` and `above` must be given.
    #[option(default = f64::NEG_INFINITY, compared_with = "when", one_of = "bounds")]
    pub below: f64,
    /// Fulfilled by values greater than this.
    #[option(default = f64::INFINITY, compared_with = "when", one_of = "bounds")]
    pub above: f64,
    /// Time for which it must be fulfilled. Default: a single message suffices.
    #[option(default = Duration::ZERO)]
    pub r#for: Duration,
    /// The command to start: `command::land`.
    #[option(required)]
    pub run: CommandPath,
    /// Time after the end of the command, or after it was refused, before it is started again. Default: 1 s.
    #[option(default = Duration::from_secs(1))]
    pub cooldown: Duration,
    /// The longest time without a message that does not count as silence. Default: as long as `for`, and at least 1 s and three
    /// periods of a topic with a declared rate.
    #[option(default = None)]
    pub stale_after: Option<Duration>,
}

/// A change of a [`Reaction`].
#[derive(Clone, Debug, PartialEq, Payload)]
#[payload(no_frame)]
pub struct ReactionState {
    /// Event at the reaction.
    pub event: ReactionEvent,
    /// The value that caused it; `None` for one that is missing or NaN, and for silence.
    pub value: Option<f64>,
}

/// Event at a reaction, see [`ReactionState`].
#[derive(Clone, Debug, PartialEq, Eq, Payload)]
#[non_exhaustive]
pub enum ReactionEvent {
    /// The condition is fulfilled.
    Fulfilled,
    /// The condition is no longer fulfilled, or has new bounds.
    NotFulfilled,
    /// The command was started.
    Started,
    /// The command was refused, and why.
    Refused(String),
}

/// A condition that ends without a message.
const NOT_ANY_MORE: ReactionState = ReactionState { event: ReactionEvent::NotFulfilled, value: None };
/// The period without a rate on virtual time.
const PERIOD: Duration = Duration::from_millis(10);
/// The number of messages that may wait until it acts.
const MOST_WAITING: usize = 16_384;
/// The longest wait for a message in real time, after which it looks at the command and at silence.
const LONGEST_WAIT: Duration = Duration::from_millis(50);

impl ReactionOptions {
    /// # Errors
    /// Every value would fulfil the condition, or none.
    fn check(&self) -> Result<(), Fault> {
        let Self { below, above, .. } = self;
        if *below == f64::NEG_INFINITY && *above == f64::INFINITY {
            return Err(Fault::permanent("no value fulfils the condition; give `below` or `above`"));
        }
        if below < above {
            return Ok(());
        }
        Err(Fault::permanent(format!("`below` is {below}, but must be less than `above`, {above}")))
    }

    fn is_fulfilled_by(&self, value: f64) -> bool {
        value < self.below || value > self.above
    }

    /// # Errors
    /// The topic's declared period is longer.
    fn silence(&self, period: Option<Duration>) -> Result<Duration, Fault> {
        let period = period.unwrap_or_default();
        match self.stale_after {
            Some(stale_after) if stale_after < period => Err(Fault::permanent(format!(
                "`{}` is published every {period:?}, which is longer than `stale_after`, {stale_after:?}",
                self.when.path()
            ))),
            Some(stale_after) => Ok(stale_after),
            None => Ok(self.r#for.max(Duration::from_secs(1)).max(period.saturating_mul(3))),
        }
    }
}

impl Service for Reaction {
    type Options = ReactionOptions;
    type Output = ReactionState;

    fn init(options: ReactionOptions, context: &ServiceContext) -> Result<Self, Fault> {
        options.check()?;
        let bus = context.bus();
        let description = bus.description();
        let Some(topic) = description.topic(options.when.path()) else {
            return Err(Fault::permanent(format!("nothing is published at `{}`", options.when.path())));
        };
        if description.command(options.run.path()).is_none() {
            return Err(Fault::permanent(format!("no command is at `{}`", options.run.path())));
        }
        let stale_after = options.silence(topic.period)?;
        let is_periodic = context.period_s().is_some();
        let messages = bus.subscribe_any(
            Select::Path(options.when.path()),
            None,
            Overflow::DropOldest { capacity: MOST_WAITING },
        );
        Ok(Self {
            messages,
            waits: !is_periodic && !context.clock().is_virtual(),
            is_periodic,
            stale_after,
            period: topic.period,
            last: None,
            received: context.clock().now(),
            is_silent: false,
            fulfilled_since: None,
            has_ended: false,
            next: None,
            execution: None,
            ready: None,
            not_numbers: context.counter("not a number"),
            silences: context.counter("silent"),
            refused_options: context.counter("refused options"),
            lost: context.counter("lost"),
            counted: 0,
            options,
            bus,
        })
    }

    fn update(&mut self, now: MonotonicTime) -> Result<Reading<ReactionState>, Fault> {
        if take(&mut self.has_ended) {
            return Ok(Reading::now(NOT_ANY_MORE).next_at(now));
        }
        let mut next = match self.next.take() {
            None if self.waits => self.messages.recv_timeout(LONGEST_WAIT),
            None => self.messages.try_recv(),
            next => next,
        };
        let lost = self.messages.lagged();
        (replace(&mut self.counted, lost)..lost).for_each(|_| self.lost.add());
        let now = if self.waits { self.bus.clock().now() } else { now };
        if self.execution.as_ref().is_some_and(|execution| execution.try_result().is_some()) {
            self.cool_down(now);
        }
        while let Some(message) = next {
            if let Some(state) = self.end_by_gap(&message) {
                self.next = Some(message);
                return Ok(Reading::now(state).next_at(now));
            }
            if let Some(state) = self.receive(&message, now) {
                // What else waits is processed at the same time.
                return Ok(Reading::now(state).next_at(now));
            }
            next = self.messages.try_recv();
        }
        let state = if now.duration_since(self.received) > self.stale_after { self.fall_silent() } else { None };
        let reading = state.map_or(Reading::nothing(), Reading::now);
        Ok(if self.is_periodic || self.waits { reading } else { reading.next_at(now + PERIOD) })
    }

    fn handle_options(&mut self, options: ReactionOptions, _: &ServiceContext) -> Result<(), Fault> {
        if (&options.when, options.run) != (&self.options.when, self.options.run) {
            return Err(Fault::remake());
        }
        // Parameters are set one by one, and a reaction must not end because of values between: it goes on with the old ones.
        self.stale_after = match options.check().and_then(|()| options.silence(self.period)) {
            Ok(stale_after) => stale_after,
            Err(fault) => {
                tracing::warn!(%fault, "a reaction keeps its options");
                self.refused_options.add();
                return Ok(());
            }
        };
        if (options.below, options.above) != (self.options.below, self.options.above) {
            self.has_ended |= self.fulfilled_since.take().is_some();
        }
        self.options = options;
        Ok(())
    }
}

impl Reaction {
    /// Returns what changes with the silence before a message, if there was one.
    fn end_by_gap(&mut self, message: &DynamicMessage) -> Option<ReactionState> {
        let gap = message.stamp().monotonic_time.duration_since(self.last?);
        if gap > self.stale_after { self.fall_silent() } else { None }
    }

    /// Returns what changes with a message.
    fn receive(&mut self, message: &DynamicMessage, now: MonotonicTime) -> Option<ReactionState> {
        let time = message.stamp().monotonic_time;
        if self.last.is_some_and(|last| time <= last) {
            return None;
        }
        // An older stamp is nothing heard: a clock that was set back shows as silence.
        self.received = now;
        self.is_silent = false;
        self.last = Some(time);
        let value = self.options.when.number_in(message).filter(|value| !value.is_nan());
        if value.is_none() {
            self.not_numbers.add();
        }
        if !value.is_some_and(|value| self.options.is_fulfilled_by(value)) {
            return self
                .fulfilled_since
                .take()
                .map(|_| ReactionState { event: ReactionEvent::NotFulfilled, value });
        }
        let is_first = self.fulfilled_since.is_none();
        let since = *self.fulfilled_since.get_or_insert(time);
        let holds = time.duration_since(since) >= self.options.r#for;
        let may = holds && self.execution.is_none() && self.ready.is_none_or(|ready| now >= ready);
        let event = if may && !self.runs() {
            self.start(now)
        } else if is_first {
            ReactionEvent::Fulfilled
        } else {
            return None;
        };
        Some(ReactionState { event, value })
    }

    /// Returns whether somebody else has started the command: a second start might cancel the first.
    fn runs(&self) -> bool {
        self.bus.commands().iter().any(|command| command.path == self.options.run.path() && command.running > 0)
    }

    fn start(&mut self, now: MonotonicTime) -> ReactionEvent {
        match self.bus.start_command(self.options.run.path(), "") {
            Ok(execution) => {
                self.execution = Some(execution);
                ReactionEvent::Started
            }
            Err(fault) => {
                self.cool_down(now);
                ReactionEvent::Refused(fault.to_string())
            }
        }
    }

    fn cool_down(&mut self, now: MonotonicTime) {
        self.execution = None;
        self.ready = Some(now + self.options.cooldown);
    }

    /// Counts a silence once, whether it is noticed by the clock or by the stamp of the next message.
    fn fall_silent(&mut self) -> Option<ReactionState> {
        if !replace(&mut self.is_silent, true) {
            self.silences.add();
        }
        self.fulfilled_since.take().map(|_| NOT_ANY_MORE)
    }
}
