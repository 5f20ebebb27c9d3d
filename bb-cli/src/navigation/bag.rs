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

/// A bag that was read: what `bb eval navigation` plays.
///
/// Measurements are taken at the time in their headers, in that order, whatever order they came in. A message of the IMU holds
/// since the one before it.
#[derive(Debug)]
pub struct NavigationBag {
    file: PathBuf,
    topics: Topics,
    messages: Messages,
    frames: Frames,
    options: BagOptions,
}

/// A data set, and what to know about it.
#[derive(Debug)]
pub struct FromBag {
    /// What the filters are given.
    pub data: DataSet,
    /// What was left out or assumed.
    pub notes: Vec<String>,
    /// So much was left out that figures of the rest mislead: why.
    pub doubts: Vec<String>,
}

impl NavigationBag {
    /// Reads the messages of the chosen topics, up to where the bag breaks off.
    ///
    /// # Errors
    ///
    /// It is no bag, has not the topics, or not one of each; in words.
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

    /// What broke the bag off, if something did.
    pub fn broken(&self) -> Option<&str> {
        self.messages.broken.as_deref()
    }

    /// The bag as a data set for filters, or for smoothers.
    ///
    /// The keyframes are the instants at which something was measured, and those of the truth, of which at most ten a second
    /// are scored. Those of a smoother with relative poses are the messages of that odometry; other measurements move to the
    /// nearest.
    ///
    /// # Errors
    ///
    /// A frame that is not connected, nothing to start from, or no sample left; in words.
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
