//! ROS 2 bags, and recordings of this project, as data sets.

mod align;
mod frames;
mod messages;
mod notes;
mod options;
mod sensors;
mod start;
mod timeline;
mod topics;
mod truth;

pub use options::{BagOptions, BiasDeviation, Mount, Origin, Place, RelativeDeviation, StartFrom};

use super::data::DataSet;
use super::filters::{NavigationSetting, bag_params};
use crate::progress::Progress;
use bb_mcap::Bag;
use frames::Frames;
use messages::Messages;
use notes::Notes;
use std::path::{Path, PathBuf};
use topics::Topics;

/// The messages of a bag that `bb eval navigation` plays.
///
/// Measurements are ordered by the time in their headers, regardless of the order of arrival. A message of the IMU
/// covers the time since the previous one.
#[derive(Debug)]
pub struct NavigationBag {
    file: PathBuf,
    topics: Topics,
    messages: Messages,
    frames: Frames,
    options: BagOptions,
}

/// A data set, with remarks on it.
#[derive(Debug)]
pub struct FromBag {
    /// The inputs of the filters.
    pub data: DataSet,
    /// What was left out or assumed.
    pub notes: Vec<String>,
    /// Why figures of the rest are misleading, if too much was left out.
    pub doubts: Vec<String>,
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
        let messages = messages?;
        let frames = Frames::new(&messages, options)?;
        Ok(Self { file: file.to_owned(), topics, messages, frames, options: options.clone() })
    }

    /// The damage that cut the bag off, if any.
    pub fn broken(&self) -> Option<&str> {
        self.messages.broken.as_deref()
    }

    /// The bag as a data set for filters, or for smoothers.
    ///
    /// The keyframes are the times of measurements and of the truth; at most ten of the truth a second are scored.
    /// For a smoother with relative poses, they are the messages of that odometry, and other measurements move to the
    /// nearest one.
    ///
    /// # Errors
    ///
    /// A frame that is not connected, no start, or no samples left; in words.
    pub fn data_set(&self, settings: &[NavigationSetting], is_smoother: bool) -> Result<FromBag, String> {
        let (params, sensors) = bag_params(settings)?;
        let mut notes = Notes::default();
        let imu = self.messages.samples(&self.topics.imu, &mut notes)?;
        let sensors = self.sensors(&imu, &sensors, &mut notes)?;
        let start = self.start(&imu, &sensors, &params, &mut notes)?;
        let data = timeline::data_set(self, &imu, sensors, start, params.longest_sample, is_smoother, &mut notes)?;
        let Notes { notes, doubts } = notes;
        Ok(FromBag { data, notes, doubts })
    }
}
