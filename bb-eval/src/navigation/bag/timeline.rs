//! The measurements of a bag as keyframes, with the samples of the IMU between them.

use super::NavigationBag;
use super::messages::{Inertial, Time};
use super::notes::Notes;
use super::sensors::Sensors;
use crate::navigation::data::{DataSet, Keyframe, Sample};
use bb_estimators::navigation::{RelativePose, Start};
use std::collections::{BTreeSet, HashMap};

/// Less than a tenth of a second, so that a truth at 10 Hz is scored at each message even if its clock jitters.
const SCORED_PERIOD_NS: i64 = 90_000_000;

/// Keyframes by their time.
type Numbers = HashMap<Time, u64>;

/// `longest_s`: a longer time between two messages of the IMU is a gap, in which no measurement is used.
pub(super) fn data_set(
    bag: &NavigationBag,
    imu: &[Inertial],
    sensors: Sensors,
    start: Start,
    longest_s: f64,
    is_smoother: bool,
    notes: &mut Notes,
) -> Result<DataSet, String> {
    let start_ns = start.time_ns;
    let scored = scored(&sensors, start_ns);
    let is_snapped = is_smoother && !sensors.relative.is_empty();
    let mut moved = Moved::new(&sensors, is_snapped);
    let fixes: Vec<_> = sensors.fixes.iter().filter_map(|(time, of)| Some((moved.to(*time)?, *of))).collect();
    let anchors: Vec<_> = sensors.anchors.iter().filter_map(|(time, of)| Some((moved.to(*time)?, *of))).collect();
    let velocities: Vec<_> =
        sensors.velocities.iter().filter_map(|(time, of)| Some((moved.to(*time)?, *of))).collect();
    moved.tell(notes);
    let measured = fixes.iter().map(|(time, _)| *time);
    let measured = measured.chain(anchors.iter().map(|(time, _)| *time));
    let measured = measured.chain(velocities.iter().map(|(time, _)| *time));
    let mut times: BTreeSet<Time> = measured.chain(sensors.relative.iter().map(|pose| pose.time_ns)).collect();
    if !is_snapped {
        times.extend(&scored);
    }

    let mut walk = Walk::new(start_ns);
    let all = times.range(start_ns.saturating_add(1)..).count();
    let mut next = times.range(start_ns.saturating_add(1)..).copied().peekable();
    for pair in imu.windows(2) {
        let [before, after] = pair else { continue };
        let is_gap = (after.time_ns - before.time_ns) as f64 * 1e-9 > longest_s;
        while let Some(time) = next.next_if(|time| *time < after.time_ns) {
            if is_gap {
                walk.in_gaps += 1;
            } else {
                walk.to(time, after);
                walk.keyframe(time);
            }
        }
        walk.to(after.time_ns, after);
        if next.next_if_eq(&after.time_ns).is_some() {
            walk.keyframe(after.time_ns);
        }
    }
    let beyond = next.count();
    let Walk { samples, mut keyframes, numbers, in_gaps, .. } = walk;
    let imu_topic = &bag.topics.imu;
    if keyframes.len() < 2 {
        return Err(format!(
            "nothing was measured while {imu_topic} was there, after the start: are all stamped by one clock?"
        ));
    }
    let of_all = format!("of {all} instants at which something was measured are");
    let note = format!("{in_gaps} {of_all} in gaps of {imu_topic} of more than {longest_s} s: left out");
    notes.left_out(in_gaps, all, note);
    notes.left_out(beyond, all, format!("{beyond} {of_all} after the last of {imu_topic}: left out"));
    for (time, number) in &numbers {
        let Some(keyframe) = usize::try_from(*number).ok().and_then(|index| keyframes.get_mut(index)) else {
            continue;
        };
        keyframe.truth = sensors.truth.at(*time);
        keyframe.scored = keyframe.truth.is_some() && (is_snapped || scored.contains(time));
    }
    no_truth(bag, &sensors, keyframes.iter().any(|keyframe| keyframe.scored), notes);
    let data = DataSet {
        prefix: bag.file.clone(),
        samples,
        start: Start { time_ns: 0, ..start },
        noise: None,
        relative: relative(&sensors, &numbers),
        anchors: numbered(&anchors, &numbers),
        fixes: numbered(&fixes, &numbers),
        velocities: numbered(&velocities, &numbers),
        camera: None,
        seen: HashMap::new(),
        fixes_beside_relative: true,
        antenna: sensors.antenna,
        keyframes,
    };
    Ok(data.referred())
}

/// The times of the truth that are scored.
fn scored(sensors: &Sensors, start_ns: Time) -> BTreeSet<Time> {
    let mut scored = BTreeSet::new();
    let mut last = start_ns;
    for (time, _) in sensors.truth.points() {
        if *time >= last.saturating_add(SCORED_PERIOD_NS) {
            scored.insert(*time);
            last = *time;
        }
    }
    scored
}

/// Samples of the IMU, split at measurements.
struct Walk {
    start_ns: Time,
    now_ns: Time,
    samples: Vec<Sample>,
    keyframes: Vec<Keyframe>,
    numbers: Numbers,
    in_gaps: usize,
}

impl Walk {
    fn new(start_ns: Time) -> Self {
        let (samples, keyframes, numbers) = (Vec::new(), Vec::new(), Numbers::new());
        let mut walk = Self { start_ns, now_ns: start_ns, samples, keyframes, numbers, in_gaps: 0 };
        walk.keyframe(start_ns);
        walk
    }

    /// On with this message of the IMU.
    fn to(&mut self, time: Time, message: &Inertial) {
        if time > self.now_ns {
            let Inertial { angular_velocity, specific_force, .. } = *message;
            let dt = (time - self.now_ns) as f64 * 1e-9;
            self.samples.push(Sample { angular_velocity, specific_force, dt });
            self.now_ns = time;
        }
    }

    fn keyframe(&mut self, time: Time) {
        self.numbers.insert(time, self.keyframes.len() as u64);
        self.keyframes.push(Keyframe {
            time_s: (time - self.start_ns) as f64 * 1e-9,
            sample: self.samples.len(),
            scored: false,
            is_referred_to: false,
            truth: None,
        });
    }
}

/// The new keyframes of measurements whose own keyframe a smoother cannot have.
struct Moved {
    nodes: Vec<Time>,
    /// The largest move.
    period_ns: i64,
    farthest_ns: i64,
    dropped: usize,
    all: usize,
}

impl Moved {
    fn new(sensors: &Sensors, is_snapped: bool) -> Self {
        let nodes: Vec<Time> = match is_snapped {
            true => sensors.relative.iter().map(|pose| pose.time_ns).collect(),
            false => Vec::new(),
        };
        let mut periods: Vec<_> = nodes.windows(2).map(|pair| pair[1] - pair[0]).collect();
        periods.sort_unstable();
        let period_ns = periods.get(periods.len() / 2).copied().unwrap_or(0);
        Self { nodes, period_ns, farthest_ns: 0, dropped: 0, all: 0 }
    }

    fn to(&mut self, time: Time) -> Option<Time> {
        if self.nodes.is_empty() {
            return Some(time);
        }
        self.all += 1;
        let next = self.nodes.partition_point(|node| *node < time);
        let near =
            [next.checked_sub(1), Some(next)].into_iter().flatten().filter_map(|index| self.nodes.get(index));
        let nearest = near.copied().min_by_key(|node| (node - time).abs())?;
        if (nearest - time).abs() > self.period_ns {
            self.dropped += 1;
            return None;
        }
        self.farthest_ns = self.farthest_ns.max((nearest - time).abs());
        Some(nearest)
    }

    fn tell(&self, notes: &mut Notes) {
        if self.farthest_ns > 0 {
            notes.push(format!(
                "a smoother takes measurements at the nearest relative pose: by up to {:.1} ms away",
                self.farthest_ns as f64 * 1e-6
            ));
        }
        let Self { dropped, all, .. } = *self;
        let note =
            format!("{dropped} of {all} measurements are farther than a period from a relative pose: left out");
        notes.left_out(dropped, all, note);
    }
}

fn numbered<T: Copy>(measured: &[(Time, T)], numbers: &Numbers) -> HashMap<u64, T> {
    measured.iter().filter_map(|(time, of)| Some((*numbers.get(time)?, *of))).collect()
}

/// Each pose relative to the previous one.
fn relative(sensors: &Sensors, numbers: &Numbers) -> HashMap<u64, RelativePose> {
    let pairs = sensors.relative.windows(2).filter_map(|pair| {
        let [from, to] = pair else { return None };
        let (from_number, to_number) = (*numbers.get(&from.time_ns)?, *numbers.get(&to.time_ns)?);
        let way = from.world_from_imu.inverse() * to.world_from_imu;
        let (translation, rotation) = to.deviation;
        let (translation, rotation) = ((way.translation.vector, translation), (way.rotation, rotation));
        Some((to_number, RelativePose::new(from_number, translation, rotation)))
    });
    pairs.collect()
}

/// Says why nothing is scored.
fn no_truth(bag: &NavigationBag, sensors: &Sensors, is_scored: bool, notes: &mut Notes) {
    if let Some(why) = &bag.topics.no_truth {
        notes.push(format!("no truth, so no errors: {why}"));
    } else if let Some(topic) = &bag.topics.truth {
        if sensors.truth.points().is_empty() {
            notes.push(format!("no truth, so no errors: {topic} holds no position that is a number"));
        } else if !is_scored {
            notes.push(format!("no errors: {topic} has no message while {} is there", bag.topics.imu));
        }
    }
}
