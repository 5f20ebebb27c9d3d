//! Quality of service, as ROS 2 has it and as tokens write it.

use std::fmt;
use std::str::FromStr;
use std::time::Duration;
use thiserror::Error;

/// Declares a policy with the numbers that `rmw/types.h` gives.
macro_rules! policy {
    ($(#[$doc:meta])* $name:ident { $($(#[$variant_doc:meta])* $variant:ident = $number:literal,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum $name {
            $($(#[$variant_doc])* $variant = $number,)*
        }

        impl $name {
            /// All of them.
            pub const ALL: &[Self] = &[$(Self::$variant),*];
        }

        impl Policy for $name {
            fn all() -> &'static [Self] {
                Self::ALL
            }
            fn number(self) -> u8 {
                self as u8
            }
        }
    };
}

/// A policy by its number.
trait Policy: Copy + PartialEq + 'static {
    fn all() -> &'static [Self];
    fn number(self) -> u8;
}

policy! {
    /// The delivery of messages.
    Reliability {
        /// Default of the middleware.
        SystemDefault = 0,
        /// All are delivered.
        Reliable = 1,
        /// Messages may be lost.
        BestEffort = 2,
        /// One that is not known.
        Unknown = 3,
        /// Policy of the other side.
        BestAvailable = 4,
    }
}

policy! {
    /// The messages that subscribers get which come late.
    Durability {
        /// Default of the middleware.
        SystemDefault = 0,
        /// The last ones.
        TransientLocal = 1,
        /// None.
        Volatile = 2,
        /// One that is not known.
        Unknown = 3,
        /// Policy of the other side.
        BestAvailable = 4,
    }
}

policy! {
    /// The messages that are kept.
    History {
        /// Default of the middleware.
        SystemDefault = 0,
        /// The last ones, as many as the depth.
        KeepLast = 1,
        /// All.
        KeepAll = 2,
        /// One that is not known.
        Unknown = 3,
    }
}

policy! {
    /// The proof that a publisher lives.
    Liveliness {
        /// Default of the middleware.
        SystemDefault = 0,
        /// The middleware gives it.
        Automatic = 1,
        /// The node gives it, of older versions.
        ManualByNode = 2,
        /// The publisher gives it.
        ManualByTopic = 3,
        /// One that is not known.
        Unknown = 4,
        /// Policy of the other side.
        BestAvailable = 5,
    }
}

/// The quality of service of a publisher, a subscription or a service. Times that are not given are infinite.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Qos {
    /// The delivery.
    pub reliability: Reliability,
    /// Messages for latecomers.
    pub durability: Durability,
    /// Kept messages.
    pub history: History,
    /// Number of kept messages.
    pub depth: u64,
    /// The longest time between two messages.
    pub deadline: Option<Duration>,
    /// The time after which a message is not delivered any more.
    pub lifespan: Option<Duration>,
    /// The proof that a publisher lives.
    pub liveliness: Liveliness,
    /// The time within which it must prove it.
    pub lease: Option<Duration>,
}

/// Values that tokens leave out.
const DEFAULT: Qos = Qos {
    reliability: Reliability::Reliable,
    durability: Durability::Volatile,
    history: History::KeepLast,
    depth: 42,
    deadline: None,
    lifespan: None,
    liveliness: Liveliness::Automatic,
    lease: None,
};

/// Infinite time of `rmw`.
const INFINITE: Duration = Duration::new(9_223_372_036, 854_775_807);

impl Qos {
    /// Reliable, for those who are there: that of services, with a depth of 10 the default of ROS.
    pub const fn reliable(depth: u64) -> Self {
        Self { depth, ..DEFAULT }
    }

    /// The last message, for latecomers too: that of `/tf_static` and `/robot_description`.
    pub const LATCHED: Self = Self { durability: Durability::TransientLocal, depth: 1, ..DEFAULT };
}

/// A text that is not a quality of service.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("`{0}` is no quality of service: {1}")]
pub struct QosError(String, &'static str);

/// Text in tokens: values other than the default, between colons and commas.
impl fmt::Display for Qos {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { reliability, durability, history, depth, deadline, lifespan, liveliness, lease } = *self;
        policy(f, reliability, DEFAULT.reliability, ":")?;
        policy(f, durability, DEFAULT.durability, ":")?;
        policy(f, history, DEFAULT.history, ",")?;
        number(f, depth, DEFAULT.depth, ":")?;
        time(f, deadline, ":")?;
        time(f, lifespan, ":")?;
        policy(f, liveliness, DEFAULT.liveliness, ",")?;
        time(f, lease, "")
    }
}

fn policy<T: Policy>(f: &mut fmt::Formatter<'_>, value: T, default: T, end: &str) -> fmt::Result {
    number(f, value.number().into(), default.number().into(), end)
}

fn number(f: &mut fmt::Formatter<'_>, value: u64, default: u64, end: &str) -> fmt::Result {
    if value != default {
        write!(f, "{value}")?;
    }
    f.write_str(end)
}

fn time(f: &mut fmt::Formatter<'_>, time: Option<Duration>, end: &str) -> fmt::Result {
    let time = time.unwrap_or(INFINITE);
    number(f, time.as_secs(), INFINITE.as_secs(), ",")?;
    number(f, time.subsec_nanos().into(), INFINITE.subsec_nanos().into(), end)
}

impl FromStr for Qos {
    type Err = QosError;

    fn from_str(text: &str) -> Result<Self, QosError> {
        let error = |fault| QosError(text.to_owned(), fault);
        let parts: Vec<Vec<&str>> = text.split(':').map(|part| part.split(',').collect()).collect();
        let [reliability, durability, history, deadline, lifespan, liveliness] = parts.as_slice() else {
            return Err(error("it does not have six parts between colons"));
        };
        let lists = (reliability.as_slice(), durability.as_slice(), history.as_slice(), liveliness.as_slice());
        let ([reliability], [durability], [history, depth], [liveliness, seconds, nanos]) = lists else {
            return Err(error("a part of it has too many or too few commas"));
        };
        let policy = "one of its policies is not known";
        Ok(Self {
            reliability: policy_of(reliability, DEFAULT.reliability).ok_or_else(|| error(policy))?,
            durability: policy_of(durability, DEFAULT.durability).ok_or_else(|| error(policy))?,
            history: policy_of(history, DEFAULT.history).ok_or_else(|| error(policy))?,
            depth: number_of(depth, DEFAULT.depth).ok_or_else(|| error("its depth is no number"))?,
            deadline: time_of(deadline).ok_or_else(|| error("its deadline is no time"))?,
            lifespan: time_of(lifespan).ok_or_else(|| error("its lifespan is no time"))?,
            liveliness: policy_of(liveliness, DEFAULT.liveliness).ok_or_else(|| error(policy))?,
            lease: time_of(&[seconds, nanos]).ok_or_else(|| error("its lease is no time"))?,
        })
    }
}

fn policy_of<T: Policy>(text: &str, default: T) -> Option<T> {
    let number = number_of(text, default.number().into())?;
    T::all().iter().copied().find(|policy| u64::from(policy.number()) == number)
}

fn number_of(text: &str, default: u64) -> Option<u64> {
    match text {
        "" => Some(default),
        text if text.bytes().all(|letter| letter.is_ascii_digit()) => text.parse().ok(),
        _ => None,
    }
}

/// Seconds and nanoseconds. No time at all is how `rmw` says that none is given.
fn time_of(parts: &[&str]) -> Option<Option<Duration>> {
    let [seconds, nanos] = parts else { return None };
    let nanos = number_of(nanos, INFINITE.subsec_nanos().into())?;
    let nanos = u32::try_from(nanos).ok().filter(|nanos| *nanos < 1_000_000_000)?;
    let time = Duration::new(number_of(seconds, INFINITE.as_secs())?, nanos);
    Some(Some(time).filter(|time| *time != INFINITE && !time.is_zero()))
}
