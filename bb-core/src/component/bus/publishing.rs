//! Publishing by path: at paths of the caller's choice, and for sensors whose messages other code publishes.

use super::Bus;
use crate::component::host::{ExternalSensor, Host};
use crate::component::{Caller, Fault};
use crate::event::Right;
use crate::joints::TELLING_PATHS;
use crate::message::codec::json_to_bytes;
use crate::message::{Frame, Payload, Stamp};
use crate::pubsub::{AnyTopic, DynamicMessage, Encoded, Enter, Gate, Publisher, Tell};
use crate::time::{MonotonicTime, WallTime};
use bb_message::__private::{did_you_mean, nearest_path};
use std::cell::Cell;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Weak};

/// The largest age of a message in ROS's layout, by its header: what a slow link may take.
const OLD_NANOS: i64 = 10_000_000_000;
/// The longest time by which its header may be ahead: what synchronised clocks differ by.
const AHEAD_NANOS: i64 = 100_000_000;

/// Makes a message of a topic with the stamp of now, in a frame.
type Decode<'a> = dyn Fn(&dyn AnyTopic, Stamp, Frame) -> Result<DynamicMessage, String> + 'a;

impl Bus {
    /// Returns a publisher at a path of the caller's choice, such as `mission/progress`: names of letters, digits,
    /// `_`, `-` and `.`, separated by `/`. Existing subscriptions to everything, or to a subtree with this path,
    /// receive its messages. A second publisher at the same path shares it.
    ///
    /// A robot has at most 1024 such paths; a new one replaces the oldest that is no longer used. Names of paths are kept for as long as
    /// the process lives, at most 1 MiB of them: what changes without end, such as the number of a request, belongs in the payload.
    /// The path may also be that of an
    /// `external` input of an estimator, or of a sensor declared as [`External`](crate::component::External): everything downstream then runs before
    /// `publish` returns, as for messages of a sensor.
    ///
    /// Payloads that name joints, such as [`JointStates`](crate::payload::JointStates), update the [joints](Self::joints) if the path is
    /// below `sensor/`.
    ///
    /// # Errors
    /// The path is that of another declared publisher or of a topic that every robot has, it has another payload already, it is
    /// malformed, too many are in use, the robot has stopped, the command that this bus belongs to has ended, or the caller may
    /// not publish.
    pub fn publisher<T: Payload>(&self, path: &str) -> Result<Publisher<T>, Fault> {
        self.check(Right::Publish)?;
        let _permit = self.caller.permit()?;
        if let Some(ExternalSensor { path, frame, payload, enter }) = self.host.external(path) {
            return match enter.downcast::<Weak<Enter<T>>>() {
                Ok(enter) => Ok(Publisher::of_sensor(path, frame, *enter, Arc::new(self.entrance(path)))),
                Err(_) => Err(self.other_payload(path, payload, T::NAME)),
            };
        }
        let topic =
            self.host.registry().topic_noted::<T>(path, &mut |path, payload| self.host.note_path(path, payload))?;
        let entrance = self.entrance(topic.path());
        Ok(Publisher::new(topic, Arc::new(entrance)))
    }

    /// Publishes a payload in JSON, measured now, where [`Self::publisher`] would, for callers that do not know its type: at the path of a
    /// sensor declared as [`External`](crate::component::External), of an `external` input, or of the caller's choice if it has a payload
    /// already. `TopicDescription::layouts` has its JSON Schema.
    ///
    /// ```
    /// use bb_core::prelude::*;
    ///
    /// robot! { robot Rig; link base { sensor sonar: External<Range>(); } }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let builder = Rig::builder();
    /// let ranges = builder.subscribe(rig::sensor::base::sonar);
    /// let rig = builder.simulate()?;
    /// let range = r#"{"radiation": "Ultrasound", "field_of_view": 0.3, "min_range": 0.02, "max_range": 4, "range": 1.5}"#;
    /// rig.publish_json("sensor/base/sonar", range)?;
    /// assert_eq!(ranges.try_recv().map(|range| range.range), Some(1.5));
    /// let error = rig.publish_json("sensor/base/sonar", &range.replace("1.5", "\"far\"")).unwrap_err();
    /// assert_eq!(
    ///     error.to_string(),
    ///     "nothing is published at `sensor/base/sonar`: range: expected a number, found the text \"far\""
    /// );
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// Nothing is published: the text does not fit the payload, and which field does not; nothing may be published at the path, or the
    /// payload there is not known; the robot has stopped, the session or the command of this bus has ended, or the caller may not
    /// publish.
    pub fn publish_json(&self, path: &str, payload: &str) -> Result<(), Fault> {
        self.publish_encoded(path, &|topic, now, frame| {
            let bytes = json_to_bytes(payload, topic.layouts().payload()).map_err(|error| error.to_string())?;
            let stamp = move |_| Stamp { frame, ..now };
            match topic.decode(Encoded::Payload(&bytes), &stamp) {
                Ok(message) => Ok(message),
                // In the words for JSON, without the place in the bytes.
                Err(error) => Err(crate::message::codec::JsonError::from(error).to_string()),
            }
        })
    }

    /// Publishes a message with its stamp, as [`DynamicMessage::encode`](crate::DynamicMessage::encode) writes it, where
    /// [`Self::publish_json`] would. Its times are those of this robot's clock, as for [`Publisher::forward`].
    ///
    /// # Errors
    /// As [`Self::publish_json`].
    pub fn publish_cdr(&self, path: &str, message: &[u8]) -> Result<(), Fault> {
        self.publish_encoded(path, &|topic, now, frame| {
            let decoded = topic.decode(Encoded::Exact(message), &|stamp| stamp.completed(now, frame));
            decoded.map_err(|error| error.to_string())
        })
    }

    /// Publishes a message in ROS's layout, where [`Self::publish_json`] would, in the frame of the sensor. It was measured when its header
    /// says, by the date of this robot's clock: at most 10 s ago, and at most 100 ms ahead, which counts as now. A message without a header,
    /// or with a stamp of zero, was measured now.
    ///
    /// # Errors
    /// As [`Self::publish_json`], or ROS has no message for the payload, or the header's stamp is further from now: the clock of its sender is
    /// another one, or the message is of another day.
    pub fn publish_ros(&self, path: &str, message: &[u8]) -> Result<(), Fault> {
        self.publish_encoded(path, &|topic, now, frame| {
            let far = Cell::new(None);
            let stamp = |stamp: Stamp| match stamp.wall_time {
                wall_time if wall_time == WallTime::default() => Stamp { frame, ..now },
                wall_time => {
                    let age = now.wall_time.as_unix_nanos().saturating_sub(wall_time.as_unix_nanos());
                    if !(-AHEAD_NANOS..=OLD_NANOS).contains(&age) {
                        far.set(Some(age));
                    }
                    let monotonic_time = now.monotonic_time.plus_nanos(age.max(0).saturating_neg());
                    Stamp { monotonic_time, wall_time, frame, ..now }
                }
            };
            let message = topic.decode(Encoded::Ros(message), &stamp).map_err(|error| error.to_string())?;
            match far.get() {
                None => Ok(message),
                Some(age) => Err(not_of_now(age)),
            }
        })
    }

    /// Publishes what `decode` makes of it at the topic of that path, with the stamp of now and the frame of the sensor.
    fn publish_encoded(&self, path: &str, decode: &Decode<'_>) -> Result<(), Fault> {
        self.check(Right::Publish)?;
        self.caller.check_valid()?;
        let sensor = self.host.external(path);
        let own = self.host.registry().topics().into_iter().find(|topic| topic.path() == path);
        let (known, frame) = match (&sensor, &own) {
            (Some(sensor), _) => (sensor.path, sensor.frame),
            (None, Some(topic)) => (topic.path(), Frame::NONE),
            (None, None) => return Err(self.not_published(path)),
        };
        let refused = |why: String| Fault::new(format!("nothing is published at `{path}`: {why}"));
        let entrance = self.entrance(known);
        let mut published = None;
        entrance.pass(&mut |now| {
            let decoded = match &own {
                Some(topic) => Some(decode(&**topic, now, frame)),
                None => self.with_topics(|topics| {
                    topics.iter().find(|topic| topic.path() == path).map(|topic| decode(*topic, now, frame))
                }),
            };
            published = decoded.map(|decoded| match decoded {
                Ok(message) => self.hand_out(&entrance, &message, sensor.is_some(), now.monotonic_time),
                Err(why) => Err(refused(why)),
            });
        });
        published.unwrap_or_else(|| {
            self.caller.check_valid()?;
            Err(refused("the robot has stopped".to_owned()))
        })
    }

    /// Hands a message to the estimators that take it and to its subscribers, as a [`Publisher`] of its type does.
    fn hand_out(
        &self,
        entrance: &Entrance,
        message: &DynamicMessage,
        is_of_sensor: bool,
        now: MonotonicTime,
    ) -> Result<(), Fault> {
        if is_of_sensor {
            entrance.note_caller();
            self.host.enter(message, now);
            return Ok(());
        }
        let topic =
            self.host.registry().topic_of(message, &mut |path, payload| self.host.note_path(path, payload))?;
        entrance.note_caller();
        entrance.hear(topic.path(), message.stamp(), now, &|listener| message.tell_joints(listener));
        match entrance.is_noted() {
            true => topic.publish_dynamic_as_written(message, &mut || entrance.note(message.clone(), now)),
            false => topic.publish_dynamic(message),
        };
        Ok(())
    }

    /// The error for a path at which nothing can be published without its type.
    fn not_published(&self, path: &str) -> Fault {
        let refused = |why: &str| Fault::new(format!("cannot publish at `{path}`: {why}"));
        if self.with_topics(|topics| topics.iter().any(|topic| topic.path() == path)) {
            return refused("only its own publisher does; choose another path");
        }
        let own = self.host.registry().topics();
        let known = self.host.externals().into_iter().chain(own.iter().map(|topic| topic.path()));
        let hint = did_you_mean(nearest_path(path, known));
        refused(&format!("its payload is not known, since nobody has published or subscribed there{hint}"))
    }

    /// The error for a payload that is not that of an external input or sensor.
    fn other_payload(&self, path: &str, taken: &str, offered: &str) -> Fault {
        let mut takers = String::new();
        for (estimator, input) in self.host.takers(path) {
            let and = if takers.is_empty() { "" } else { " and " };
            takers += &format!("{and}the input `{input}` of `{estimator}`");
        }
        let takers = if takers.is_empty() { "the robot" } else { &takers };
        Fault::new(format!("cannot publish `{offered}` at `{path}`: {takers} takes `{taken}`"))
    }

    fn entrance(&self, path: &'static str) -> Entrance {
        Entrance {
            path,
            host: Arc::clone(&self.host),
            caller: self.caller.clone(),
            number: ENTRANCES.fetch_add(1, Ordering::Relaxed),
            last: self.host.last_entrance(path),
        }
    }
}

/// The error for a message in ROS's layout whose header's stamp is that long ago.
fn not_of_now(age_nanos: i64) -> String {
    let seconds = (age_nanos as f64 / 1e9).abs();
    match age_nanos > 0 {
        true => format!(
            "the stamp of its header is {seconds:.1} s old by the robot's clock: expected at most {} s",
            OLD_NANOS / 1_000_000_000
        ),
        false => format!(
            "the stamp of its header is {seconds:.1} s ahead of the robot's clock: expected at most {} ms",
            AHEAD_NANOS / 1_000_000
        ),
    }
}

/// The number of the next entrance. 0 is that of none.
static ENTRANCES: AtomicU64 = AtomicU64::new(1);

/// Lets a caller publish at a path.
struct Entrance {
    path: &'static str,
    host: Arc<dyn Host>,
    caller: Caller,
    number: u64,
    /// The number of the entrance that was used last at the path, for the journal: while it is this one, the caller is the same.
    last: Option<Arc<AtomicU64>>,
}

impl Gate for Entrance {
    fn pass(&self, publish: &mut dyn FnMut(Stamp)) {
        self.host.while_open(&mut || {
            // After what had to be waited for.
            let Ok(_permit) = self.caller.permit() else { return };
            let robot = self.host.controls();
            let clock = robot.clock();
            let monotonic_time = clock.now();
            let wall_time = clock.wall_at(monotonic_time);
            let stamp = Stamp { monotonic_time, wall_time, origin: robot.origin(), ..Stamp::default() };
            publish(stamp);
        });
        if self.caller.is_outside() {
            self.host.settle();
        }
    }

    fn is_noted(&self) -> bool {
        self.host.is_journaled()
    }

    fn note_caller(&self) {
        if let Some(last) = &self.last
            && last.load(Ordering::Acquire) != self.number
        {
            self.host.note_caller(self.path, self.number, self.caller.name());
        }
    }

    fn note(&self, message: DynamicMessage, now: MonotonicTime) {
        self.host.note_own(message, now);
    }

    fn hear(&self, path: &str, stamp: Stamp, now: MonotonicTime, tell: &Tell<'_>) {
        if TELLING_PATHS.includes(path) {
            self.host.joints().hear_at(path, stamp, now, tell);
        }
    }
}
