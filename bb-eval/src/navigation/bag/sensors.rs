//! The feed of a filter from a bag: its messages, relative poses from a drifting odometry, and a state to start from.

use super::NavigationBag;
use super::notes::Notes;
use super::options::StartFrom;
use super::truth::{TrueTrack, isometry};
use crate::motion::{self, Motion, scatter};
use crate::navigation::data::Truth;
use crate::navigation::feed::{Feed, INPUTS, Message, START, Time, What};
use crate::units::Units;
use bb_core::nalgebra::{Isometry3, Matrix6, Vector3};
use bb_core::payload::{GeodeticPosition, GnssFix, GnssStatus, Odometry, Pose, RelativePose, Twist};
use bb_core::time::MonotonicTime;
use bb_estimators::navigation::{Geodetic, LocalFrame};

/// Standard deviations of a pose to start from that has no covariance: m, rad.
const POSITION: f64 = 0.1;
const ROTATION: f64 = 0.02;

/// Standard deviations of a true velocity, of one from true positions, and of an unknown one, m/s.
const TRUE_VELOCITY: f64 = 0.1;
const VELOCITY_FROM_POSITIONS: f64 = 0.5;
const UNKNOWN_VELOCITY: f64 = 5.0;

/// The farthest that the origin of a local frame may be from all fixes, m: the Earth is round.
const FARTHEST_ORIGIN: f64 = 1e5;

/// The time over which true positions give a velocity, ns.
const BASELINE_NS: i64 = 100_000_000;

/// Arrival, stamp and pose of a drifting odometry, with the variances of translation and rotation if available.
type DriftingPose = (Time, Time, Isometry3<f64>, Option<(f64, f64)>);

impl NavigationBag {
    /// Creates the feed of a filter.
    pub(super) fn feed(&self) -> Result<Feed, String> {
        let topics = &self.topics;
        let mut mounts = [None; INPUTS.len()];
        let of_inputs = [
            &Some(topics.imu.clone()),
            &topics.gnss,
            &topics.odometry,
            &topics.pose,
            &topics.relative,
            &topics.magnetic_field,
            &topics.gnss_velocity,
            &topics.gnss_heading,
        ];
        for (mount, topic) in mounts.iter_mut().zip(of_inputs) {
            *mount = topic.as_ref().map(|topic| self.frames.base_from(topic)).transpose()?;
        }
        let mut messages = self.messages.inputs.clone();
        messages.extend(self.relative()?);
        let world = self.world();
        let start = self.start(world.as_ref())?;
        mounts[START] = start.is_some().then(Isometry3::identity);
        messages.extend(start);
        let mut feed = Feed { messages, mounts, world };
        feed.sort();
        Ok(feed)
    }

    /// Notes units that look wrong.
    pub(super) fn doubt_units(&self, notes: &mut Notes) {
        let mut units = Units::default();
        for message in &self.messages.inputs {
            match &message.what {
                What::Imu(imu) => units.take_imu(message.stamp_ns, imu.angular_velocity, imu.linear_acceleration),
                What::MagneticField(field) => units.take_field(&field.magnetic_field),
                _ => {}
            }
        }
        notes.notes.extend(units.of_topics(&self.topics.imu, self.topics.magnetic_field.as_deref()));
    }

    /// Checks that the given origin is near one of the fixes.
    ///
    /// # Errors
    /// It is not, as if its numbers were swapped.
    pub(super) fn check_origin(&self) -> Result<(), String> {
        let Some(origin) = self.options.origin.map(|origin| LocalFrame::new(origin.0)) else { return Ok(()) };
        let places = self.fixes().filter_map(|(_, fix)| Geodetic::of_fix(fix, 0.0));
        let nearest = places.map(|place| origin.position(&place).norm()).reduce(f64::min);
        match nearest.filter(|metres| *metres > FARTHEST_ORIGIN) {
            Some(metres) => Err(format!(
                "--origin is {:.0} km from the nearest fix; it is LATITUDE,LONGITUDE,HEIGHT of the place where the recording was made",
                metres / 1e3
            )),
            None => Ok(()),
        }
    }

    /// Notes fixes that a filter cannot use.
    pub(super) fn doubt_fixes(&self, notes: &mut Notes) {
        let fixes: Vec<&GnssFix> = self.fixes().map(|(_, fix)| fix).collect();
        let is_nowhere = |fix: &&&GnssFix| fix.status != GnssStatus::NoFix && Geodetic::of_fix(fix, 0.0).is_none();
        let nowhere: Vec<_> = fixes.iter().filter(is_nowhere).filter_map(|fix| fix.position).collect();
        let count = fixes.len();
        if let Some(GeodeticPosition { latitude_rad, longitude_rad, altitude }) = nowhere.first() {
            let (latitude, longitude) = (latitude_rad.to_degrees(), longitude_rad.to_degrees());
            let note = format!(
                "{} of {count} fixes of {} are nowhere on the Earth, the first at latitude {latitude}°, longitude {longitude}°, \
                 {} m: no filter uses them",
                nowhere.len(),
                self.topics.gnss.as_deref().unwrap_or_default(),
                altitude.unwrap_or(0.0)
            );
            notes.left_out(nowhere.len(), count, note);
        }
        let without = fixes.iter().filter(|fix| Geodetic::of_fix(fix, 0.0).is_none()).count() - nowhere.len();
        if without > 0 {
            notes.push(format!("{without} of {count} fixes have no position"));
        }
    }

    /// Notes that fixes scatter more than their covariances state, as `bb info` does.
    pub(super) fn doubt_covariances(&self, notes: &mut Notes) {
        let sample = |message: &Message| match &message.what {
            What::Imu(imu) => Some((message.stamp_ns, imu.angular_velocity, imu.linear_acceleration)),
            _ => None,
        };
        let samples: Vec<motion::Sample> = self.messages.inputs.iter().filter_map(sample).collect();
        let start_ns = self.messages.inputs.iter().map(|message| message.arrival_ns).min();
        let Some(((zero_ns, ..), start_ns)) = samples.first().copied().zip(start_ns) else { return };
        let position = |(time_ns, fix): (Time, &GnssFix)| {
            let (position, variance) = scatter::position(fix)?;
            Some((time_ns, position, variance))
        };
        let positions: Vec<_> = self.fixes().filter_map(position).collect();
        let track = scatter::track(&positions, zero_ns);
        if let Some(found) = scatter::oddities(&track, Some(&Motion::new(&samples, zero_ns))).scatter {
            let topic = self.topics.gnss.as_deref().unwrap_or_default();
            let since_s = zero_ns.saturating_sub(start_ns) as f64 * 1e-9;
            let said = found.in_words(since_s, Some(&self.topics.imu));
            notes.push(format!(
                "{topic}: {said}; the filter takes their scatter for their noise, so nothing is to be done"
            ));
        }
    }

    fn fixes(&self) -> impl Iterator<Item = (Time, &GnssFix)> {
        self.messages.inputs.iter().filter_map(|message| match &message.what {
            What::Gnss(fix) => Some((message.stamp_ns, fix)),
            _ => None,
        })
    }

    /// The local frame of the world on the Earth: at the given origin, or at the first fix.
    fn world(&self) -> Option<LocalFrame> {
        let given = self.options.origin.map(|origin| origin.0);
        let first = || self.fixes().find_map(|(_, fix)| Geodetic::of_fix(fix, 0.0));
        given.or_else(first).map(LocalFrame::new)
    }

    /// The state that a filter is given to start from, at the time of the first sample after it.
    fn start(&self, world: Option<&LocalFrame>) -> Result<Option<Message>, String> {
        let first_ns = self.messages.stamps(0).next().unwrap_or(0);
        let state = match (&self.options.start, &self.topics.start) {
            (Some(StartFrom::Own), _) | (None, None) => return Ok(None),
            (Some(StartFrom::Truth), _) => {
                let base_from_truth = match &self.topics.truth {
                    Some(topic) => self.frames.base_from(topic)?,
                    None => Isometry3::identity(),
                };
                let track = TrueTrack::new(&self.messages.truth, &base_from_truth, world);
                start_from_truth(&track, first_ns)
                    .ok_or("the truth tells no orientation to start with; choose --start own, or a topic")?
            }
            (_, Some(topic)) => {
                self.start_from_topic(topic)?.ok_or_else(|| format!("{topic} holds no pose to start from"))?
            }
            (Some(StartFrom::Topic(name)), None) => return Err(format!("{name}: no such topic")),
        };
        let (time_ns, odometry) = state;
        let stamp_ns = self.messages.stamps(0).find(|stamp| *stamp >= time_ns).unwrap_or(time_ns);
        Ok(Some(Message { arrival_ns: stamp_ns, stamp_ns, what: What::Start(odometry) }))
    }

    /// The first state of the topic, for the base instead of the topic's frame.
    fn start_from_topic(&self, topic: &str) -> Result<Option<(Time, Odometry)>, String> {
        let Some((time_ns, pose, twist)) = self.messages.start else { return Ok(None) };
        let base_from_part = self.frames.base_from(topic)?;
        let part = Isometry3::from_parts(pose.position.into(), pose.world_from_body);
        let Some(world_from_part) = isometry(&part) else { return Ok(None) };
        let world_from_base = world_from_part * base_from_part.inverse();
        let turn = base_from_part.rotation;
        let state = twist.map(|twist| {
            let angular = turn * twist.angular;
            (turn * twist.linear - angular.cross(&base_from_part.translation.vector), angular, twist.covariance)
        });
        let (linear, angular, covariance) = state.unwrap_or((Vector3::zeros(), Vector3::zeros(), None));
        let unknown = if twist.is_some() { None } else { Some(diagonal(UNKNOWN_VELOCITY, 1.0)) };
        let twist = Twist { linear, angular, covariance: covariance.or(unknown) };
        Ok(Some((time_ns, Odometry { pose: pose_of(&world_from_base, pose.covariance), twist })))
    }

    /// The motions between the poses of the drifting odometry.
    fn relative(&self) -> Result<Vec<Message>, String> {
        let poses = self.drifting_poses();
        let usual = self.usual_deviations(&poses)?;
        let motion = |pair: &[DriftingPose]| {
            let [before @ (_, start_ns, from, _), after @ (arrival_ns, end_ns, to, _)] = pair else { return None };
            let start_from_end = from.inverse() * to;
            let (translation, rotation) = match self.options.relative_deviation {
                Some(_) => usual,
                None => added_deviations(before, after).unwrap_or(usual),
            };
            let relative = RelativePose {
                start: MonotonicTime::from_nanos(*start_ns),
                end: MonotonicTime::from_nanos(*end_ns),
                position: start_from_end.translation.vector,
                start_from_end: start_from_end.rotation,
                covariance: Some(diagonal(translation, rotation)),
            };
            Some(Message { arrival_ns: *arrival_ns, stamp_ns: *end_ns, what: What::Relative(relative) })
        };
        Ok(poses.windows(2).filter_map(motion).collect())
    }

    /// The poses of the drifting odometry, without repeated stamps.
    fn drifting_poses(&self) -> Vec<DriftingPose> {
        let mut poses: Vec<DriftingPose> = Vec::new();
        for (arrival, time, odometry) in &self.messages.relative {
            let pose = &odometry.pose;
            let part = Isometry3::from_parts(pose.position.into(), pose.world_from_body);
            let Some(world_from_camera) = isometry(&part) else { continue };
            if poses.last().is_some_and(|(_, last, ..)| last == time) {
                continue;
            }
            let mean = |first: usize| {
                let covariance = pose.covariance?;
                Some(covariance.fixed_view::<3, 3>(first, first).trace() / 3.0)
            };
            poses.push((*arrival, *time, world_from_camera, mean(0).zip(mean(3))));
        }
        poses
    }

    /// The deviations of a motion whose own are unknown: as given, or the median of those known.
    fn usual_deviations(&self, poses: &[DriftingPose]) -> Result<(f64, f64), String> {
        if let Some(given) = self.options.relative_deviation {
            return Ok((given.translation, given.rotation));
        }
        let mut all: Vec<_> = poses.windows(2).filter_map(|pair| added_deviations(&pair[0], &pair[1])).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        match (all.get(all.len() / 2), &self.topics.relative) {
            (Some(median), _) => Ok(*median),
            (None, Some(topic)) if poses.len() > 1 => Err(format!(
                "the covariance of {topic} does not grow, so it does not tell how well its poses are known \
                 relative to each other; say so with --relative-deviation"
            )),
            _ => Ok((1.0, 1.0)),
        }
    }
}

/// The deviations of translation and rotation that a motion adds; `None` if the variances do not grow.
fn added_deviations(before: &DriftingPose, after: &DriftingPose) -> Option<(f64, f64)> {
    let (before, after) = (before.3?, after.3?);
    let (translation, rotation) = (after.0 - before.0, after.1 - before.1);
    (translation > 0.0 && rotation > 0.0).then(|| (translation.sqrt(), rotation.sqrt()))
}

/// The covariance with these deviations of the first and of the last three.
fn diagonal(first: f64, last: f64) -> Matrix6<f64> {
    let variances = [first, first, first, last, last, last].map(|deviation| deviation * deviation);
    Matrix6::from_diagonal(&variances.into())
}

/// A pose with its covariance, or an assumed one.
fn pose_of(world_from_base: &Isometry3<f64>, covariance: Option<Matrix6<f64>>) -> Pose {
    Pose {
        position: world_from_base.translation.vector,
        world_from_body: world_from_base.rotation,
        covariance: Some(covariance.unwrap_or_else(|| diagonal(POSITION, ROTATION))),
    }
}

fn start_from_truth(track: &TrueTrack, first_ns: Time) -> Option<(Time, Odometry)> {
    let points = track.points();
    let from = points.iter().position(|(time, truth)| *time >= first_ns && truth.world_from_body.is_some())?;
    let (time_ns, Truth { position, world_from_body, velocity }) = points.get(from)?;
    let later = points.iter().skip(from).find(|(time, _)| time - time_ns >= BASELINE_NS);
    let velocity = velocity.map(|velocity| (velocity, TRUE_VELOCITY)).or_else(|| {
        let (later_ns, later) = later?;
        let seconds = (later_ns - time_ns) as f64 * 1e-9;
        Some(((later.position - position) / seconds, VELOCITY_FROM_POSITIONS))
    });
    let (velocity, deviation) = velocity.unwrap_or((Vector3::zeros(), UNKNOWN_VELOCITY));
    let pose = pose_of(&Isometry3::from_parts((*position).into(), (*world_from_body)?), None);
    let linear = pose.world_from_body.inverse() * velocity;
    let twist = Twist { linear, angular: Vector3::zeros(), covariance: Some(diagonal(deviation, 1.0)) };
    Some((*time_ns, Odometry { pose, twist }))
}
