//! ROS 2 bags, and recordings of this project, as a robot's messages and their truth.

mod messages;
mod notes;
mod options;
mod sensors;
mod topics;
mod truth;

pub use options::{BagOptions, Origin, RelativeDeviation, StartFrom};

use super::data::TruthMessage;
use super::drive::RecordedTruth;
pub(crate) use topics::FIX;
pub(crate) use truth::TrueTrack;

use super::drive::Drive;
use super::feed::{Message, What};
use crate::disturb::IMU;
use crate::frames::Frames;
use crate::progress::Progress;
use bb_core::nalgebra::Isometry3;
use bb_estimators::navigation::Geodetic;

use bb_mcap::Bag;
use messages::Messages;
use notes::Notes;
use std::path::Path;
use topics::Topics;

/// The messages of a bag that `bb eval navigation` plays.
///
/// They reach the robot in the order and at the times in which they were recorded, with the stamps of their headers.
#[derive(Debug)]
pub struct NavigationBag {
    topics: Topics,
    messages: Messages,
    frames: Frames,
    options: BagOptions,
    notes: Notes,
}

impl NavigationBag {
    /// Reads the messages of the chosen topics, up to where the bag is cut off.
    ///
    /// # Errors
    ///
    /// It is not a bag, lacks a topic, or has several matching ones; in words.
    pub fn read(file: &Path, options: &BagOptions) -> Result<Self, String> {
        let bag = Bag::open(file).map_err(|error| error.kind().to_string())?;
        let topics = Topics::choose(&bag, options)?;
        let progress = Progress::new("reading", topics.expected(&bag));
        let messages = Messages::read(&bag, &topics, &progress);
        progress.finish();
        let mut messages = messages?;
        let mut notes = Notes::default();
        messages.check_imu(&topics.imu, &mut notes)?;
        messages.settle_arrivals(&mut notes);
        let frames = Frames::new(&messages.transforms, &messages.frames, &topics.imu, &options.mount)?;
        frames.check_mounts(&bag)?;
        let mut bag = Self { topics, messages, frames, options: options.clone(), notes: Notes::default() };
        bag.doubt_units(&mut notes);
        bag.doubt_fixes(&mut notes);
        bag.doubt_covariances(&mut notes);
        bag.notes = notes;
        Ok(bag)
    }

    /// The damage that cut the bag off, if any.
    pub fn broken(&self) -> Option<&str> {
        self.messages.broken.as_deref()
    }

    /// Number of samples of the IMU.
    pub fn samples(&self) -> u64 {
        self.messages.stamps(0).count() as u64
    }

    /// The messages for a filter, and the truth.
    ///
    /// # Errors
    /// A frame that is not connected, or no state to start from; in words.
    pub fn drive(&self) -> Result<Drive, String> {
        self.check_origin()?;
        let mut notes = self.notes.clone();
        let feed = self.feed()?;
        let truth = self.truth()?;
        let declination = self.declination(&mut notes.notes)?;
        notes.notes.extend(self.frames.unplaced(&self.topics.all()));
        let Notes { notes, doubts } = notes;
        // The name of the IMU as `--mount` takes it.
        let imu = match self.frames.of_topic(&self.topics.imu) {
            "" => self.topics.imu.clone(),
            frame => frame.to_owned(),
        };
        let origin = self.options.origin.map(|origin| origin.0);
        Ok(Drive {
            feed,
            truth,
            notes,
            doubts,
            origin,
            imu,
            gnss: self.topics.gnss.clone(),
            noise: None,
            declination,
        })
    }

    /// The declination that is given, or that of the first fix, rad.
    fn declination(&self, notes: &mut Vec<String>) -> Result<Option<f64>, String> {
        let Some(declination) = self.options.declination else { return Ok(None) };
        let place = |message: &Message| match &message.what {
            What::Gnss(fix) => Geodetic::of_fix(fix, 0.0),
            _ => None,
        };
        let origin = self.options.origin.map(|origin| origin.0);
        let place = origin.or_else(|| self.messages.inputs.iter().find_map(place));
        let time_ns = self.messages.stamps(IMU).next().unwrap_or(0);
        declination.at(place, time_ns, notes).map(Some)
    }

    fn truth(&self) -> Result<RecordedTruth, String> {
        let topic = match (&self.topics.truth, &self.topics.no_truth) {
            (Some(topic), _) => Ok(topic.clone()),
            (None, why) => Err(why.clone().unwrap_or_else(|| "there is no topic of it".to_owned())),
        };
        let base_from_part = match &topic {
            Ok(topic) => self.frames.base_from(topic)?,
            Err(_) => Isometry3::identity(),
        };
        let messages = self.messages.truth.clone();
        let is_of_fixes = messages.iter().any(|(_, message)| matches!(message, TruthMessage::OnEarth(_)));
        Ok(RecordedTruth { messages, base_from_part, topic, is_of_fixes })
    }
}
