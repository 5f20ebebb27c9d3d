//! Topics created while the robot runs, and subscriptions waiting for them.

#[cfg(test)]
mod tests;

use super::any::{AnyTopic, DynamicMessage, Tap};
use super::queue::Queue;
use super::select::ANY_NAME;
use super::statistics::TopicStatistics;
use super::timer::Timer;
use super::{Delivery, DynamicSubscription, Payloads, Select, Topic};
use crate::message::Payload;
use bb_message::__private::{Sorted, intern};
use std::any::{Any, type_name};
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::task::Waker;

/// The topics of one robot that it does not declare. A topic created here is subscribed to by every subscription
/// whose selection includes it, whether made before or after.
///
/// It is bounded: at most [`MAX_TOPICS`](Self::MAX_TOPICS) topics with a publisher and as many without, and only live subscriptions.
/// A topic stays until the robot stops.
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
    /// Paths that had a publisher, in a replay, whose payload's type is not known before the first message; the name of it.
    expected: Sorted<&'static str, &'static str>,
    selections: Selections,
    is_closed: bool,
}

/// The type of a payload.
struct Kind<'a> {
    name: &'static str,
    type_name: &'static str,
    make: &'a dyn Fn(&'static str) -> Arc<dyn AnyTopic>,
    fits: &'a dyn Fn(&dyn AnyTopic) -> bool,
}

impl Kind<'_> {
    fn of<T: Payload>() -> Self {
        Self {
            name: T::NAME,
            type_name: type_name::<T>(),
            make: &|path| Arc::new(Topic::<T>::new(path)),
            fits: &|topic| topic.as_any().is::<Topic<T>>(),
        }
    }
}

/// A topic.
struct Made {
    topic: Arc<dyn AnyTopic>,
    /// `true` if the topic has, or had, a publisher. Others are kept for their subscribers: topics of paths that are subscribed to
    /// before anything publishes there.
    is_published: bool,
}

/// Is told of each path that gets its first publisher, with the name of its payload.
pub(crate) type NotePath<'a> = &'a mut dyn FnMut(&'static str, &'static str);

impl Registry {
    /// The largest number of paths. Others are refused.
    pub(crate) const MAX_TOPICS: usize = 1024;

    /// Creates the registry of a robot that declares these paths.
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
            topics.iter().copied().chain(state.published().map(|made| &*made.topic)).collect();
        // Under the lock, so that a topic created meanwhile is subscribed to once.
        let subscription = DynamicSubscription::among(&topics, select, payloads, delivery, &self.timer);
        let selection = Selection::new(select, payloads, subscription.tap());
        for made in state.waiting().filter(|made| selection.includes(&*made.topic)) {
            made.topic.tap(&subscription.tap());
        }
        if !state.is_closed {
            state.selections.add(selection);
        }
        drop(state);
        subscription.warn();
        subscription
    }

    /// Returns the topic at `path` to publish at, for tests, which have no journal.
    #[cfg(test)]
    pub(crate) fn topic<T: Payload>(&self, path: &str) -> Result<Arc<Topic<T>>, PathError> {
        self.topic_noted(path, &mut |_, _| ())
    }

    /// The topic at `path`, made if it is not there; `note` is told of a path's first publisher, in that order on all threads. It must
    /// not wait.
    pub(crate) fn topic_noted<T: Payload>(
        &self,
        path: &str,
        note: NotePath<'_>,
    ) -> Result<Arc<Topic<T>>, PathError> {
        Ok(typed(self.published(path, &Kind::of::<T>(), note)?))
    }

    /// The topic at `path` for a subscriber, made if it is not there: its publisher may come later. Also whether it has one.
    pub(crate) fn awaited<T: Payload>(&self, path: &str) -> Result<(Arc<Topic<T>>, bool), PathError> {
        let kind = Kind::of::<T>();
        let refused = |reason| PathError::new(Act::Subscribe, path, reason);
        self.check(path).map_err(refused)?;
        let mut state = self.lock();
        if state.is_closed {
            return Err(refused(Reason::Stopped));
        }
        let (found, stale) = state.find(path, &kind).map_err(refused)?;
        if let Some((topic, is_published)) = found {
            return Ok((typed(topic), is_published));
        }
        if state.waiting().count() >= Self::MAX_TOPICS {
            return Err(refused(Reason::TooMany));
        }
        let path = intern(path).ok_or_else(|| refused(Reason::TooMany))?;
        let topic = state.make(path, &kind, false);
        drop(state);
        drop(stale);
        Ok((typed(topic), false))
    }

    /// The topic at the path of a message, created for its payload if it does not exist; `note` as for [`Self::topic_noted`].
    pub(crate) fn topic_of(
        &self,
        message: &DynamicMessage,
        note: NotePath<'_>,
    ) -> Result<Arc<dyn AnyTopic>, PathError> {
        let erased = message.message();
        let kind = Kind {
            name: message.payload_name(),
            type_name: erased.type_name(),
            make: &|path| erased.new_topic(path),
            fits: &|topic| erased.fits(topic),
        };
        self.published(message.path(), &kind, note)
    }

    fn published(&self, path: &str, kind: &Kind<'_>, note: NotePath<'_>) -> Result<Arc<dyn AnyTopic>, PathError> {
        let refused = |reason| PathError::new(Act::Publish, path, reason);
        self.check(path).map_err(refused)?;
        let mut state = self.lock();
        if state.is_closed {
            return Err(refused(Reason::Stopped));
        }
        let (found, stale) = state.find(path, kind).map_err(refused)?;
        if let Some((topic, true)) = found {
            return Ok(topic);
        }
        if state.published().count() >= Self::MAX_TOPICS {
            return Err(refused(Reason::TooMany));
        }
        // Last, since an interned name stays.
        let known = found.as_ref().map(|(topic, _)| topic.path());
        let path = known.or_else(|| intern(path)).ok_or_else(|| refused(Reason::TooMany))?;
        let topic = match found {
            Some((topic, _)) => {
                if let Some(made) = state.topics.get_mut(path) {
                    made.is_published = true;
                }
                topic
            }
            None => state.make(path, kind, true),
        };
        note(path, topic.payload_name());
        drop(state);
        drop(stale);
        Ok(topic)
    }

    fn check(&self, path: &str) -> Result<(), Reason> {
        match is_path(path) {
            false => Err(Reason::Malformed),
            true if self.declared.contains(&path) => Err(Reason::Declared),
            true => Ok(()),
        }
    }

    /// Replays that somebody could publish at `path` from now on.
    pub(crate) fn expect(&self, path: &'static str, payload: &'static str) {
        let mut state = self.lock();
        let dropped = state.expect(path, payload);
        drop(state);
        if let Some(Made { topic, .. }) = &dropped
            && topic.subscribers().iter().any(|one| one.is_typed)
        {
            tracing::error!(
                path,
                payload,
                "subscriptions to `{}` end: the run has published another payload",
                topic.payload_name()
            );
        }
        drop(dropped);
    }

    /// The counts of all topics created here, by path.
    pub(crate) fn statistics(&self) -> Vec<TopicStatistics> {
        let state = self.lock();
        let mut all = Sorted::default();
        for (path, payload) in state.expected.iter() {
            all.insert(*path, TopicStatistics { path, payload, published: 0, lost: 0, panics: 0, subscribers: 0 });
        }
        let made: Vec<_> = state.published().map(|made| Arc::clone(&made.topic)).collect();
        drop(state);
        // Subscriptions are asked for what they have counted without the lock.
        for topic in made {
            all.insert(topic.path(), topic.statistics());
        }
        all.iter().map(|(_, counted)| counted.clone()).collect()
    }

    /// The topics created here that have, or had, a publisher, by path.
    pub(crate) fn published_topics(&self) -> Vec<Arc<dyn AnyTopic>> {
        self.lock().published().map(|made| Arc::clone(&made.topic)).collect()
    }

    /// All topics created here, by path: also those that have subscribers alone.
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

/// A topic, and whether it has a publisher.
type Found = (Arc<dyn AnyTopic>, bool);

/// The topic, whose payload is a `T`.
fn typed<T: Payload>(topic: Arc<dyn AnyTopic>) -> Arc<Topic<T>> {
    let path = topic.path();
    let topic: Arc<dyn Any + Send + Sync> = topic;
    topic.downcast().unwrap_or_else(|_| Arc::new(Topic::new(path)))
}

impl State {
    /// The topic at `path`, and whether it has a publisher. One of another payload that nobody uses is removed, to be dropped without
    /// the lock.
    fn find(&mut self, path: &str, kind: &Kind<'_>) -> Result<(Option<Found>, Option<Made>), Reason> {
        let Some(made) = self.topics.get(path) else { return Ok((None, None)) };
        if (kind.fits)(&*made.topic) {
            return Ok((Some((Arc::clone(&made.topic), made.is_published)), None));
        }
        if made.is_published || made.is_used() {
            return Err(Reason::other_payload(made, kind));
        }
        Ok((None, self.topics.remove(path)))
    }

    fn make(&mut self, path: &'static str, kind: &Kind<'_>, is_published: bool) -> Arc<dyn AnyTopic> {
        let topic = (kind.make)(path);
        self.selections.tap(&*topic);
        self.topics.insert(path, Made { topic: Arc::clone(&topic), is_published });
        topic
    }

    fn published(&self) -> impl Iterator<Item = &Made> {
        self.topics.iter().map(|(_, made)| made).filter(|made| made.is_published)
    }

    /// The topics without a publisher.
    fn waiting(&self) -> impl Iterator<Item = &Made> {
        self.topics.iter().map(|(_, made)| made).filter(|made| !made.is_published)
    }

    /// A topic of another payload is returned, which is to be dropped.
    fn expect(&mut self, path: &'static str, payload: &'static str) -> Option<Made> {
        // A run has no more, whatever a journal says.
        if self.expected.len() >= Registry::MAX_TOPICS && self.expected.get(path).is_none() {
            return None;
        }
        self.expected.insert(path, payload);
        let made = self.topics.get_mut(path)?;
        if !made.is_published && made.topic.payload_name() != payload {
            return self.topics.remove(path);
        }
        made.is_published = true;
        None
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

/// Selections of live subscriptions.
#[derive(Default)]
struct Selections {
    all: Vec<Selection>,
    /// Number of selections at which dropped ones are removed: twice the number left the last time.
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

/// Selection that owns its paths, see [`Select`].
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

/// Reason for which a path of the caller's choice is refused.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct PathError {
    act: Act,
    path: String,
    reason: Reason,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Act {
    Publish,
    Subscribe,
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum Reason {
    Malformed,
    Declared,
    /// The path has another payload, which is published there or only subscribed to.
    OtherPayload {
        payload: &'static str,
        is_published: bool,
        wanted: &'static str,
    },
    TooMany,
    Stopped,
}

impl Reason {
    fn other_payload(made: &Made, kind: &Kind<'_>) -> Self {
        let payload = made.topic.payload_name();
        // Two types may have the same name.
        let wanted = if payload == kind.name { kind.type_name } else { kind.name };
        Self::OtherPayload { payload, is_published: made.is_published, wanted }
    }
}

impl PathError {
    fn new(act: Act, path: &str, reason: Reason) -> Self {
        Self { act, path: path.to_owned(), reason }
    }
}

impl fmt::Display for PathError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { act, path, reason } = self;
        if let Reason::OtherPayload { payload, is_published, wanted } = reason {
            let has = if *is_published { "publishes" } else { "is subscribed to as" };
            return match act {
                Act::Publish => {
                    write!(f, "cannot publish `{wanted}` at `{path}`: it {has} `{payload}`; choose another path")
                }
                Act::Subscribe => write!(f, "`{path}` {has} `{payload}`, not `{wanted}`"),
            };
        }
        match act {
            Act::Publish => write!(f, "cannot publish at `{path}`: "),
            Act::Subscribe => write!(f, "cannot subscribe to `{path}`: "),
        }?;
        match reason {
            Reason::Malformed if *act == Act::Subscribe && path.contains(ANY_NAME) => {
                f.write_str("a typed subscription is to one path; `subscribe_any(Select::Path(…), …)` takes a `*`")
            }
            Reason::Malformed => write!(
                f,
                "a path is names of letters, digits, `_`, `-` and `.` with `/` between them, at most {MAX_PATH_BYTES} bytes"
            ),
            Reason::Declared if *act == Act::Subscribe => f.write_str("the robot is gone"),
            Reason::Declared => f.write_str("only its own publisher does; choose another path"),
            Reason::TooMany => write!(
                f,
                "{} other paths are in use, or their names fill the memory for names; use fewer paths",
                Registry::MAX_TOPICS
            ),
            Reason::Stopped | Reason::OtherPayload { .. } => f.write_str("the robot has stopped"),
        }
    }
}

impl std::error::Error for PathError {}
