//! Topics created while the robot runs, and subscriptions waiting for them.

#[cfg(test)]
mod tests;

use super::any::{AnyTopic, DynamicMessage, Tap};
use super::queue::Queue;
use super::statistics::TopicStatistics;
use super::timer::Timer;
use super::{Delivery, DynamicSubscription, Payloads, Select, Topic};
use crate::message::Payload;
use crate::message::codec::intern;
use crate::sorted::Sorted;
use std::any::{Any, type_name};
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::task::Waker;

/// The topics of one robot that it does not declare. A topic created here is subscribed to by every subscription
/// whose selection includes it, whether made before or after.
///
/// It is bounded: at most [`MAX_TOPICS`](Self::MAX_TOPICS) topics, and only live subscriptions.
#[derive(Default)]
pub(crate) struct Registry {
    /// The paths of all other topics of the robot, which exist from its builder on.
    declared: Box<[&'static str]>,
    state: Mutex<State>,
    timer: Timer,
}

#[derive(Default)]
struct State {
    topics: Sorted<&'static str, Made>,
    /// In a replay: paths that had a publisher, whose payload's type is not known before the first message.
    expected: Sorted<&'static str, Expected>,
    /// Topics that were made or expected so far.
    made: u64,
    selections: Selections,
    is_closed: bool,
}

/// The place for another topic.
enum Room {
    Free,
    /// The path of an unused topic.
    Of(&'static str),
}

/// A topic, and its index in the order of creation.
struct Made {
    number: u64,
    topic: Arc<dyn AnyTopic>,
    /// In a replay: in the run it has made room for another one. It is kept for those who use it in the replay, and because it
    /// knows the type of the payload.
    is_gone: bool,
    /// What it had published and lost when it went.
    before: (u64, u64),
}

/// A path that had a publisher: which one it is in that order, and the name of the payload.
struct Expected {
    number: u64,
    payload: &'static str,
}

/// What happens to the paths of a registry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PathChange {
    /// It has a topic now.
    Made { path: &'static str, payload: &'static str },
    /// Its topic, which nobody used, has made room for another.
    Evicted { path: &'static str },
}

impl Registry {
    /// The largest number of paths. Beyond it, a topic without a publisher and without a typed subscription is
    /// removed.
    pub(crate) const MAX_TOPICS: usize = 1024;

    /// For a robot that declares these paths.
    pub(crate) fn new(declared: impl IntoIterator<Item = &'static str>) -> Self {
        Self { declared: declared.into_iter().collect(), ..Self::default() }
    }

    /// The clock of the run, for subscriptions with a highest rate.
    pub(crate) fn timer(&self) -> &Timer {
        &self.timer
    }

    /// Subscribes to the selected ones of `topics`, of the topics created here, and of those created later.
    pub(crate) fn subscribe(
        &self,
        topics: &[&dyn AnyTopic],
        select: Select<'_>,
        payloads: &Payloads<'_>,
        delivery: Delivery,
    ) -> DynamicSubscription {
        let mut state = self.lock();
        let topics: Vec<&dyn AnyTopic> =
            topics.iter().copied().chain(state.topics.iter().map(|(_, made)| &*made.topic)).collect();
        // Under the lock, so that a topic created meanwhile is subscribed to once.
        let subscription = DynamicSubscription::among(&topics, select, payloads, delivery, &self.timer);
        if !state.is_closed {
            state.selections.add(Selection::new(select, payloads, subscription.tap()));
        }
        drop(state);
        subscription.warn();
        subscription
    }

    /// The same for tests, which no journal is told of.
    #[cfg(test)]
    pub(crate) fn topic<T: Payload>(&self, path: &str) -> Result<Arc<Topic<T>>, PathError> {
        self.topic_noted(path, &mut |_| ())
    }

    /// The topic at `path`, made if it is not there; `note` is told of what changes, in that order on all threads. It must not
    /// wait.
    pub(crate) fn topic_noted<T: Payload>(
        &self,
        path: &str,
        note: &mut dyn FnMut(PathChange),
    ) -> Result<Arc<Topic<T>>, PathError> {
        let found = self.find_or_make(path, &|path| Arc::new(Topic::<T>::new(path)), note)?;
        let topic: Arc<dyn Any + Send + Sync> = Arc::clone(&found) as _;
        topic.downcast().map_err(|_| PathError::other_payload(&*found, T::NAME, type_name::<T>()))
    }

    /// The topic at the path of a message, created for its payload if it does not exist.
    pub(crate) fn topic_of(&self, message: &DynamicMessage) -> Result<Arc<dyn AnyTopic>, PathError> {
        let found = self.find_or_make(message.path(), &|path| message.message().new_topic(path), &mut |_| ())?;
        if !message.message().fits(&*found) {
            let name = message.payload_name();
            return Err(PathError::other_payload(&*found, name, message.message().type_name()));
        }
        Ok(found)
    }

    fn find_or_make(
        &self,
        path: &str,
        make: &dyn Fn(&'static str) -> Arc<dyn AnyTopic>,
        note: &mut dyn FnMut(PathChange),
    ) -> Result<Arc<dyn AnyTopic>, PathError> {
        if !is_path(path) {
            return Err(PathError::Malformed(path.into()));
        }
        if self.declared.contains(&path) {
            return Err(PathError::Declared(path.into()));
        }
        let mut state = self.lock();
        if state.is_closed {
            return Err(PathError::Stopped(path.into()));
        }
        if let Some(made) = state.topics.get_mut(path) {
            made.is_gone = false;
            return Ok(Arc::clone(&made.topic));
        }
        let room = state.room().ok_or_else(|| PathError::TooMany(path.into()))?;
        // Last, since an interned name stays.
        let path = intern(path).ok_or_else(|| PathError::TooMany(path.into()))?;
        let evicted = match room {
            Room::Free => None,
            Room::Of(unused) => {
                note(PathChange::Evicted { path: unused });
                state.topics.remove(unused)
            }
        };
        let topic = make(path);
        state.selections.tap(&*topic);
        note(PathChange::Made { path, payload: topic.payload_name() });
        let number = state.next_number();
        state.topics.insert(path, Made { number, topic: Arc::clone(&topic), is_gone: false, before: (0, 0) });
        drop(state);
        drop(evicted);
        Ok(topic)
    }

    /// In a replay: somebody could publish at `path` from now on; no more if the name of the payload is empty.
    pub(crate) fn expect(&self, path: &'static str, payload: &'static str) {
        let mut state = self.lock();
        let dropped = if payload.is_empty() { state.forget(path) } else { state.expect(path, payload) };
        drop(state);
        drop(dropped);
    }

    /// The counts of all topics created here, by path.
    pub(crate) fn statistics(&self) -> Vec<TopicStatistics> {
        let state = self.lock();
        let mut all = Sorted::default();
        for (path, expected) in state.expected.iter() {
            let payload = expected.payload;
            all.insert(*path, TopicStatistics { path, payload, published: 0, lost: 0, subscribers: 0 });
        }
        let made = state.topics.iter().filter(|(_, made)| !made.is_gone);
        let made: Vec<_> = made.map(|(_, made)| (Arc::clone(&made.topic), made.before)).collect();
        drop(state);
        // Subscriptions are asked for what they have counted without the lock.
        for (topic, (published, lost)) in made {
            let mut counted = topic.statistics();
            counted.published = counted.published.saturating_sub(published);
            counted.lost = counted.lost.saturating_sub(lost);
            all.insert(topic.path(), counted);
        }
        all.iter().map(|(_, counted)| counted.clone()).collect()
    }

    /// All topics created here, by path.
    pub(crate) fn topics(&self) -> Vec<Arc<dyn AnyTopic>> {
        self.lock().topics.iter().map(|(_, made)| Arc::clone(&made.topic)).collect()
    }

    /// Tells the subscribers that no more will come. Returns the tasks to wake. No further topic is created.
    #[must_use = "a task that waits for a message waits for ever unless it is woken"]
    pub(crate) fn close(&self) -> Vec<Waker> {
        let mut state = self.lock();
        state.is_closed = true;
        let selections = std::mem::take(&mut state.selections);
        drop(state);
        let closed = self.topics().into_iter().flat_map(|topic| topic.close());
        // Nothing waits for its time any more.
        let queues = selections.all.iter().filter_map(|selection| selection.queue.upgrade());
        closed.chain(queues.filter_map(|queue| queue.hurry())).collect()
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    /// Finds room for another topic. An untyped subscription to a removed topic loses nothing: if the topic is
    /// created again, it is subscribed to again.
    fn room(&self) -> Option<Room> {
        if self.topics.len() - self.gone().count() < Registry::MAX_TOPICS {
            return Some(Room::Free);
        }
        let unused = self.topics.iter().filter(|(_, made)| !made.is_used());
        unused.min_by_key(|(_, made)| made.number).map(|(path, _)| Room::Of(path))
    }

    fn gone(&self) -> impl Iterator<Item = (&&'static str, &Made)> {
        self.topics.iter().filter(|(_, made)| made.is_gone)
    }

    fn next_number(&mut self) -> u64 {
        self.made += 1;
        self.made
    }

    /// A topic is returned that is to be dropped.
    fn expect(&mut self, path: &'static str, payload: &'static str) -> Option<Made> {
        let number = self.next_number();
        self.expected.insert(path, Expected { number, payload });
        // Of a journal that does not say which have made room, the oldest is forgotten.
        if self.expected.len() > Registry::MAX_TOPICS
            && let Some((oldest, _)) = self.expected.iter().min_by_key(|(_, expected)| expected.number)
        {
            let oldest = *oldest;
            self.expected.remove(oldest);
        }
        let made = self.topics.get_mut(path)?;
        if made.is_gone && made.topic.payload_name() != payload {
            return self.topics.remove(path);
        }
        made.is_gone = false;
        None
    }

    /// The same.
    fn forget(&mut self, path: &'static str) -> Option<Made> {
        self.expected.remove(path);
        let made = self.topics.get_mut(path)?;
        let counted = made.topic.statistics();
        (made.is_gone, made.before) = (true, (counted.published, counted.lost));
        if self.gone().count() <= Registry::MAX_TOPICS {
            return None;
        }
        let unused = self.gone().filter(|(_, made)| !made.is_used());
        let (oldest, _) = unused.min_by_key(|(_, made)| made.number)?;
        let oldest = *oldest;
        self.topics.remove(oldest)
    }
}

impl Made {
    /// Publishers hold the topic, and so does a thread that is subscribing to it.
    fn is_used(&self) -> bool {
        Arc::strong_count(&self.topic) > 1 || self.topic.subscribers().iter().any(|one| one.is_typed)
    }
}

impl fmt::Debug for Registry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Registry").field("declared", &self.declared).finish_non_exhaustive()
    }
}

/// What live subscriptions select.
#[derive(Default)]
struct Selections {
    all: Vec<Selection>,
    /// How many there may be before dropped ones are removed: twice the number left the last time.
    clean_at: usize,
}

impl Selections {
    const FEW: usize = 64;

    fn add(&mut self, selection: Selection) {
        if self.all.len() >= self.clean_at {
            self.clean();
        }
        self.all.push(selection);
    }

    /// Subscribes all whose selection includes it to a new topic.
    fn tap(&mut self, topic: &dyn AnyTopic) {
        self.clean();
        for selection in self.all.iter().filter(|selection| selection.includes(topic)) {
            if let Some(queue) = selection.queue.upgrade() {
                topic.tap(&Tap(queue));
            }
        }
    }

    fn clean(&mut self) {
        self.all.retain(Selection::is_alive);
        self.clean_at = (2 * self.all.len()).max(Self::FEW);
    }
}

struct Selection {
    select: OwnedSelect,
    payloads: Option<Box<[Box<str>]>>,
    queue: Weak<Queue<DynamicMessage>>,
}

impl Selection {
    fn new(select: Select<'_>, payloads: &Payloads<'_>, tap: Tap) -> Self {
        let payloads = payloads.names().map(|names| names.iter().map(|name| Box::from(*name)).collect());
        Self { select: select.into(), payloads, queue: Arc::downgrade(&tap.0) }
    }

    /// A dropped subscription may still be on the lists of silent topics.
    fn is_alive(&self) -> bool {
        self.queue.upgrade().is_some_and(|queue| !queue.is_abandoned())
    }

    fn includes(&self, topic: &dyn AnyTopic) -> bool {
        let payload = topic.payload_name();
        self.select.includes(topic.path())
            && self.payloads.as_ref().is_none_or(|names| names.iter().any(|name| **name == *payload))
    }
}

/// See [`Select`].
enum OwnedSelect {
    All,
    Path(Box<str>),
    Below(Box<str>),
    AnyOf(Box<[OwnedSelect]>),
}

impl From<Select<'_>> for OwnedSelect {
    fn from(select: Select<'_>) -> Self {
        match select {
            Select::All => Self::All,
            Select::Path(path) => Self::Path(path.into()),
            Select::Below(above) => Self::Below(above.into()),
            Select::AnyOf(several) => Self::AnyOf(several.iter().map(|select| Self::from(*select)).collect()),
        }
    }
}

impl OwnedSelect {
    fn includes(&self, path: &str) -> bool {
        match self {
            Self::All => Select::All.includes(path),
            Self::Path(selected) => Select::Path(selected).includes(path),
            Self::Below(above) => Select::Below(above).includes(path),
            Self::AnyOf(several) => several.is_empty() || several.iter().any(|select| select.includes(path)),
        }
    }
}

/// The longest path created at run time.
const MAX_PATH_BYTES: usize = 255;

/// Names separated by `/`.
fn is_path(path: &str) -> bool {
    let is_name = |name: &str| {
        name.chars().any(char::is_alphanumeric)
            && name.chars().all(|character| character.is_alphanumeric() || "_-.".contains(character))
    };
    path.len() <= MAX_PATH_BYTES && path.split('/').all(is_name)
}

/// Why nothing can be published at a path of the caller's choice.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum PathError {
    Malformed(String),
    Declared(String),
    OtherPayload { path: &'static str, payload: String, wanted: String },
    TooMany(String),
    Stopped(String),
}

impl PathError {
    fn other_payload(topic: &dyn AnyTopic, name: &str, type_name: &str) -> Self {
        let payload = topic.payload_name();
        // Two types may have the same name.
        let wanted = if payload == name { type_name } else { name };
        Self::OtherPayload { path: topic.path(), payload: payload.into(), wanted: wanted.into() }
    }
}

impl fmt::Display for PathError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Malformed(path) => write!(
                f,
                "cannot publish at `{path}`: a path is names of letters, digits, `_`, `-` and `.` with `/` between \
                 them, at most {MAX_PATH_BYTES} bytes"
            ),
            Self::Declared(path) => {
                write!(f, "cannot publish at `{path}`: only its own publisher does; choose another path")
            }
            Self::OtherPayload { path, payload, wanted } => {
                write!(f, "cannot publish `{wanted}` at `{path}`: it publishes `{payload}`; choose another path")
            }
            Self::TooMany(path) => write!(
                f,
                "cannot publish at `{path}`: {} other paths are in use, or their names fill the memory for names; \
                 publish at fewer paths",
                Registry::MAX_TOPICS
            ),
            Self::Stopped(path) => write!(f, "cannot publish at `{path}`: the robot has stopped"),
        }
    }
}

impl std::error::Error for PathError {}
