//! The thread that takes from a robot what its viewers see. The robot's own threads never wait for it.

use bb_core::event::{CommandEvent, ParameterChange, Right, SafetyError, SafetyTransition, StateTransition};
use bb_core::{
    Bus, ComponentFault, DynamicMessage, DynamicSubscription, HealthTransition, Overflow, Payload, Select,
};
use std::collections::{BTreeMap, HashMap, VecDeque};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};
use tokio::sync::watch;

/// The time between two frames.
const FRAME: Duration = Duration::from_millis(50);
/// The time between two messages of a path. It is a little longer, so that a frame that is late finds one, and loses none.
const MESSAGE: Duration = Duration::from_millis(60);
/// The frames between two reports.
const FRAMES_PER_REPORT: u64 = 4;
/// Events that are kept for viewers that come late, or are slow.
const KEPT_EVENTS: usize = 512;
/// A message whose JSON is longer is not sent; its length is.
const LONGEST_MESSAGE: usize = 256 * 1024;
/// A path with such a message rests for this long: its JSON is made on the thread of all viewers.
const REST: Duration = Duration::from_secs(2);

const EVENTS: [&str; 7] = [
    HealthTransition::NAME,
    ComponentFault::NAME,
    SafetyTransition::NAME,
    SafetyError::NAME,
    StateTransition::NAME,
    CommandEvent::NAME,
    ParameterChange::NAME,
];

/// A robot and what is newest of it.
#[derive(Debug)]
pub(crate) struct Hub {
    pub(crate) name: String,
    pub(crate) bus: Bus,
    seen: Arc<Seen>,
    thread: Option<JoinHandle<()>>,
}

/// State that the thread shares with the viewers.
#[derive(Debug)]
struct Seen {
    newest: Mutex<Newest>,
    /// Viewers that watch each path.
    watched: Mutex<BTreeMap<String, usize>>,
    has_changed: AtomicBool,
    is_over: AtomicBool,
    /// The number of the newest frame; its receivers are the viewers.
    frame: watch::Sender<u64>,
}

/// JSON with the number of the frame that it came with.
type Part = (u64, Arc<str>);

#[derive(Debug, Default)]
struct Newest {
    report: Option<Part>,
    parameters: Option<Part>,
    joints: Option<Part>,
    messages: HashMap<&'static str, Part>,
    events: VecDeque<Part>,
    /// All events, with those that came too fast to be kept.
    counted: u64,
}

/// A place in the stream of frames and events.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Position {
    frame: u64,
    events: u64,
}

impl Position {
    /// Everything is to be sent again but events.
    pub(crate) fn again(&mut self) {
        self.frame = 0;
    }
}

impl Hub {
    pub(crate) fn start(name: String, bus: &Bus) -> std::io::Result<Self> {
        let bus = bus.clone();
        let reader = bus.for_caller("dashboard", [Right::Read]);
        let seen = Arc::new(Seen {
            newest: Mutex::default(),
            watched: Mutex::default(),
            has_changed: AtomicBool::new(false),
            is_over: AtomicBool::new(false),
            frame: watch::channel(0).0,
        });
        let events = reader.subscribe_any(Select::All, EVENTS, Overflow::DropOldest { capacity: KEPT_EVENTS });
        let drawn = Arc::clone(&seen);
        let thread =
            thread::Builder::new().name("dashboard hub".into()).spawn(move || draw(&reader, &events, &drawn))?;
        Ok(Self { name, bus, seen, thread: Some(thread) })
    }

    /// The numbers of the frames to come. While there is a receiver, there are frames.
    pub(crate) fn frames(&self) -> watch::Receiver<u64> {
        let frames = self.seen.frame.subscribe();
        self.wake();
        frames
    }

    /// Exchanges the paths that a viewer watches.
    pub(crate) fn watch(&self, before: &[String], after: &[String]) {
        let mut watched = lock(&self.seen.watched);
        for path in after {
            *watched.entry(path.clone()).or_default() += 1;
        }
        for path in before {
            if let Some(count) = watched.get_mut(path) {
                *count -= 1;
                if *count == 0 {
                    watched.remove(path);
                }
            }
        }
        self.seen.has_changed.store(true, Ordering::Release);
    }

    /// Returns what is newer than `position`, as the next frame of a viewer that watches `paths`; `None` if nothing is.
    pub(crate) fn frame(&self, position: &mut Position, paths: &[String]) -> Option<String> {
        let newest = lock(&self.seen.newest);
        let before = *position;
        let mut json = r#"{"op":"frame""#.to_owned();
        let empty = json.len();
        for (name, part) in
            [("report", &newest.report), ("parameters", &newest.parameters), ("joints", &newest.joints)]
        {
            if let Some((frame, part)) = part.as_ref().filter(|(frame, _)| *frame > before.frame) {
                position.frame = position.frame.max(*frame);
                json.push_str(&format!(r#","{name}":{part}"#));
            }
        }
        let mut opening = r#","messages":{"#;
        for path in paths {
            let Some((path, (frame, message))) = newest.messages.get_key_value(path.as_str()) else { continue };
            if *frame > before.frame {
                position.frame = position.frame.max(*frame);
                json.push_str(&format!(r#"{opening}"{path}":{message}"#));
                opening = ",";
            }
        }
        if opening == "," {
            json.push('}');
        }
        let mut opening = r#","events":["#;
        for (_, event) in newest.events.iter().filter(|(number, _)| *number > before.events) {
            json.push_str(opening);
            json.push_str(event);
            opening = ",";
        }
        if opening == "," {
            json.push(']');
        }
        let first = newest.events.front().map_or(newest.counted, |(number, _)| number - 1);
        if first > before.events {
            json.push_str(&format!(r#","lost_events":{}"#, first - before.events));
        }
        position.events = newest.counted;
        if json.len() == empty {
            return None;
        }
        json.push('}');
        Some(json)
    }

    fn wake(&self) {
        if let Some(thread) = &self.thread {
            thread.thread().unpark();
        }
    }
}

impl Drop for Hub {
    fn drop(&mut self) {
        self.seen.is_over.store(true, Ordering::Release);
        self.wake();
        if let Some(thread) = self.thread.take() {
            // Its panic was printed.
            let _ = thread.join();
        }
    }
}

/// Draws frames while there are viewers.
fn draw(bus: &Bus, events: &DynamicSubscription, seen: &Seen) {
    let mut messages: Option<DynamicSubscription> = None;
    let mut rests: HashMap<&'static str, Instant> = HashMap::new();
    let mut frame = 0_u64;
    let mut lost_before = 0;
    let mut next = Instant::now();
    while !seen.is_over.load(Ordering::Acquire) {
        if seen.frame.receiver_count() == 0 {
            messages = None;
            lock(&seen.newest).messages.clear();
            thread::park();
            next = Instant::now();
            continue;
        }
        if seen.has_changed.swap(false, Ordering::AcqRel) || messages.is_none() {
            let watched: Vec<String> = lock(&seen.watched).keys().cloned().collect();
            messages = subscribe(bus, &watched);
            lock(&seen.newest).messages.retain(|path, _| watched.iter().any(|other| other == path));
        }
        frame += 1;
        let drained: Vec<DynamicMessage> = events.drain().collect();
        let parameters_changed =
            frame == 1 || drained.iter().any(|event| event.payload_name() == ParameterChange::NAME);
        let news: Vec<(&'static str, Arc<str>)> = messages
            .iter()
            .flat_map(|messages| messages.drain())
            .filter_map(|message| json_of(&message, &mut rests))
            .collect();
        let occurred: Vec<Arc<str>> = drained.iter().map(event).collect();
        let report = if frame % FRAMES_PER_REPORT == 1 { bus.report_json().ok() } else { None };
        let joints = (frame % FRAMES_PER_REPORT == 1).then(|| joints(bus));
        let parameters = parameters_changed.then(|| parameters(bus));
        {
            let mut newest = lock(&seen.newest);
            let part = |json: String| (frame, Arc::from(json));
            newest.report = report.map(part).or_else(|| newest.report.take());
            newest.joints = joints.map(part).or_else(|| newest.joints.take());
            newest.parameters = parameters.map(part).or_else(|| newest.parameters.take());
            newest.messages.extend(news.into_iter().map(|(path, json)| (path, (frame, json))));
            let lost = events.lagged();
            newest.counted += lost - lost_before;
            lost_before = lost;
            for event in occurred {
                newest.counted += 1;
                let number = newest.counted;
                newest.events.push_back((number, event));
            }
            while newest.events.len() > KEPT_EVENTS {
                newest.events.pop_front();
            }
        }
        seen.frame.send_replace(frame);
        next += FRAME;
        let now = Instant::now();
        match next.checked_duration_since(now) {
            Some(left) => thread::sleep(left),
            // It was late: the frames between are left out.
            None => next = now,
        }
    }
}

/// The newest message of each of these paths, at most one in each frame; `None` without paths.
fn subscribe(bus: &Bus, paths: &[String]) -> Option<DynamicSubscription> {
    if paths.is_empty() {
        return None;
    }
    let selected: Vec<Select<'_>> = paths.iter().map(|path| Select::Path(path)).collect();
    Some(bus.subscribe_any(Select::AnyOf(&selected), None, Overflow::LatestPerPath.at_most_every(MESSAGE)))
}

/// A message as JSON, unless its path rests.
fn json_of(
    message: &DynamicMessage,
    rests: &mut HashMap<&'static str, Instant>,
) -> Option<(&'static str, Arc<str>)> {
    let path = message.path();
    if rests.get(path).is_some_and(|until| *until > Instant::now()) {
        return None;
    }
    let json = message.to_json();
    if json.len() <= LONGEST_MESSAGE {
        rests.remove(path);
        return Some((path, json.into()));
    }
    rests.insert(path, Instant::now() + REST);
    Some((path, format!(r#"{{"too_long":{}}}"#, json.len()).into()))
}

fn event(message: &DynamicMessage) -> Arc<str> {
    let (path, kind, json) = (message.path(), message.payload_name(), message.to_json());
    let message = if json.len() <= LONGEST_MESSAGE { json } else { format!(r#"{{"too_long":{}}}"#, json.len()) };
    format!(r#"{{"path":"{path}","kind":"{kind}","message":{message}}}"#).into()
}

fn parameters(bus: &Bus) -> String {
    let values = bus.description().parameters.into_iter().map(|parameter| {
        let value = match parameter.value {
            bb_core::ParameterValue::Bool(value) => value.into(),
            bb_core::ParameterValue::Integer(value) => value.into(),
            bb_core::ParameterValue::Float(value) => value.into(),
            bb_core::ParameterValue::Text(value) => serde_json::Value::from(value),
        };
        (parameter.path.to_owned(), value)
    });
    serde_json::Value::Object(values.collect()).to_string()
}

/// The positions of the joints whose state is known, and how they move what they carry.
fn joints(bus: &Bus) -> String {
    let all = bus.joints().all().into_iter().map(|joint| {
        let declared = bus.topology().joints.iter().find(|declared| declared.name == joint.joint);
        let motion = declared.map(|declared| {
            let motion = declared.motion(&joint.position);
            serde_json::json!({ "xyz": motion.translation.vector.as_slice(), "quaternion": motion.rotation.coords.as_slice() })
        });
        let (position, stale) = (joint.position, joint.is_stale);
        (joint.joint.to_owned(), serde_json::json!({ "position": position, "stale": stale, "motion": motion }))
    });
    serde_json::Value::Object(all.collect()).to_string()
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
