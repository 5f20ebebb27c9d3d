//! Components that play back what a recording contains of them.

use crate::{Messages, Recording};
use bb_core::component::{InputTransforms, Inputs};
use bb_core::prelude::*;
use std::iter::Peekable;
use std::marker::PhantomData;
use std::path::{Path, PathBuf};

/// Options of [`PlayedSensor`] and [`PlayedEstimator`].
#[derive(Clone, Debug, Options)]
pub struct PlayedOptions {
    /// The recording of a [`Recorder`](crate::Recorder). Must be given, here or before the start.
    #[option(default = "")]
    pub file: PathBuf,
    /// The path in the recording. Default: that of the component itself.
    #[option(default = "")]
    pub path: String,
    /// Added to the recorded stamps: the difference between this run's clock and that of the recorded run. Default: 0.
    #[option(default = 0.0, range = -1e9..=1e9, unit = "s")]
    pub offset: f64,
    /// Time from its stamp after which a sensor's message is published: the time that it took from the measurement to the robot, which is
    /// not recorded. The stamp remains that of the measurement. An estimator ignores it. Unit: s. Default: 0.
    #[option(default = Duration::ZERO)]
    pub delay: Duration,
}

impl PlayedOptions {
    /// The defaults, with this recording.
    pub fn of(file: impl AsRef<Path>) -> Self {
        Self { file: file.as_ref().to_owned(), path: String::new(), offset: 0.0, delay: Duration::ZERO }
    }
}

/// The recorded messages of one path, with their stamps on this run's clock.
#[derive(Debug)]
struct Played<T: Payload> {
    messages: Peekable<Messages<T>>,
    offset_nanos: i64,
}

impl<T: Payload> Played<T> {
    fn open(options: &PlayedOptions, own_path: &str) -> Result<Self, Fault> {
        let path = if options.path.is_empty() { own_path } else { &options.path };
        let messages = Recording::open(&options.file).and_then(|recording| recording.messages(path));
        let messages = messages.map_err(|error| Fault::permanent(error.to_string()))?.peekable();
        Ok(Self { messages, offset_nanos: (options.offset * 1e9).round() as i64 })
    }

    /// The stamp of the next message; `None` at the end, and before a message that cannot be read.
    fn next_time(&mut self) -> Option<MonotonicTime> {
        let offset_nanos = self.offset_nanos;
        let message = self.messages.peek()?.as_ref().ok()?;
        Some(MonotonicTime::from_nanos(message.monotonic_time.as_nanos().saturating_add(offset_nanos)))
    }

    /// Returns whether a message, or the error in its place, is due at `now`.
    fn is_due(&mut self, now: MonotonicTime) -> bool {
        self.messages.peek().is_some() && self.next_time().is_none_or(|time| time <= now)
    }

    /// The next message. A restart would meet the same damage again, so an error is permanent.
    fn advance(&mut self) -> Result<Option<(MonotonicTime, T)>, Fault> {
        let time = self.next_time();
        let message = self.messages.next().transpose().map_err(|error| Fault::permanent(error.to_string()))?;
        Ok(time.zip(message.map(|message| message.payload)))
    }
}

/// Publishes what a recording contains of a sensor, with the recorded stamps.
///
/// Each message is published at its stamp, the time of its measurement. Those of a sensor with stamps of its own were published
/// later, by a latency that a recording does not contain: give it as [`delay`](PlayedOptions::delay) if what runs on the messages
/// depends on it.
///
/// On virtual time, the run starts when the first message of its recordings is due. In real time, set
/// [`offset`](PlayedOptions::offset) so that the recording begins after the start: messages that would have been due
/// before it are left out.
#[derive(Debug)]
pub struct PlayedSensor<T: Payload> {
    played: Played<T>,
    delay: Duration,
    first: Option<MonotonicTime>,
}

impl<T: Payload> Sensor for PlayedSensor<T> {
    type Options = PlayedOptions;
    type Output = T;

    fn init(options: PlayedOptions, context: &SensorContext) -> Result<Self, Fault> {
        let mut played = Played::open(&options, context.path())?;
        // After a restart, and in real time.
        let (now, delay) = (context.clock().now(), options.delay);
        while now > MonotonicTime::ZERO && played.next_time().is_some_and(|time| time + delay < now) {
            played.advance()?;
        }
        let first = played.next_time().map(|time| time + delay);
        Ok(Self { played, delay, first })
    }

    fn starts_at(&self) -> Option<MonotonicTime> {
        self.first
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<T>, Fault> {
        let Some((time, payload)) = self.played.advance()? else { return Ok(Reading::finished()) };
        let next = self.played.next_time().unwrap_or(time);
        Ok(Reading::at(time, payload).next_at(next + self.delay))
    }
}

/// Emits what a recording contains of an estimator with a single output.
///
/// It keeps the inputs of the declared estimator, `I`, and runs when a message of the driver arrives: it then emits
/// the newest recorded message that is not younger than that message and was not emitted before, with the stamp of
/// the driver's message. If the driver plays back the same recording, the output of an estimator that emits at most once for each
/// message of its driver is the recorded one, bit for bit. Of those emitted in between, by a timer or a continuation, only the
/// newest at each message of the driver is emitted, with that message's stamp.
///
/// Whatever keeps the declared estimator from running does so here too: a required input that is missing or too old, or has no
/// known transform.
///
/// ```no_run
/// use bb_core::prelude::*;
/// use bb_estimators::{Madgwick, SimulatedImu};
/// use bb_mcap::{PlayedEstimator, PlayedOptions};
///
/// robot! {
///     robot Rover;
///     link base { sensor imu: SimulatedImu() { rate: 200 Hz; estimator tilt: Madgwick<Marg>(); } }
/// }
///
/// fn main() -> Result<(), Box<dyn std::error::Error>> {
///     let mut builder = Rover::builder();
///     let recording = PlayedOptions::of("walk.mcap");
///     builder.replace_estimator::<PlayedEstimator<Marg, Orientation>>("sensor/base/imu/tilt", recording)?;
///     builder.simulate()?.run_to_end();
///     Ok(())
/// }
/// ```
#[derive(Debug)]
pub struct PlayedEstimator<I, T: Payload> {
    played: Played<T>,
    now: MonotonicTime,
    inputs: PhantomData<fn(I)>,
}

impl<I: Inputs, T: Payload> Estimator for PlayedEstimator<I, T> {
    type Options = PlayedOptions;
    type Input = I;
    type Output = T;

    // Its inputs may span the same joints as those of the declared estimator, and `handle_transforms` gives it the stamp of the
    // driver's message. As there, a dispatch is dropped if a joint to a required input is unknown.
    const HANDLES_MOVING_JOINTS: bool = true;

    fn init(options: PlayedOptions, context: &Context) -> Result<Self, Fault> {
        let played = Played::open(&options, context.path())?;
        Ok(Self { played, now: MonotonicTime::ZERO, inputs: PhantomData })
    }

    fn handle_transforms(&mut self, transforms: &InputTransforms<'_>) -> Result<(), Fault> {
        self.now = transforms.driver_time();
        Ok(())
    }

    fn handle_input(&mut self, _: I::View<'_>) -> Result<Reply<T>, Fault> {
        let mut newest = None;
        while self.played.is_due(self.now) {
            newest = self.played.advance()?;
        }
        Ok(newest.map(|(_, payload)| payload).into())
    }
}
