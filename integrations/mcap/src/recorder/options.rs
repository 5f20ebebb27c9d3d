//! Options of a recorder.

use bb_core::Robot;
use bb_core::topology::Topology;
use mcap::WriteOptions;
use std::time::Duration;

/// Compression of chunks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Compression {
    /// No compression.
    None,
    /// Fast.
    #[default]
    Lz4,
    /// Small.
    Zstd,
}

/// Options of a recorder.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct RecorderOptions {
    /// Number of messages after which they are handed to the operating system, so that the death of the process does
    /// not lose them. Small: larger files and more calls; large: more is lost. Default: 100.
    pub flush_messages: u64,
    /// Time after which they are handed over likewise, if anything has come. Default: 200 ms.
    pub flush_interval: Duration,
    /// `true` to wait at each flush until the disk has it, so that a loss of power does not lose it. Default: no.
    pub sync: bool,
    /// Compression of chunks. Default: lz4.
    pub compression: Compression,
    /// The largest chunk, in bytes; a flush ends one as well. Default: 1 MiB.
    pub chunk_bytes: u64,
    /// `true` to write joints that move, poses and orientations as transforms to `/tf` as well, of a robot that the
    /// recorder was given. Default: yes.
    pub transforms: bool,
    /// The path whose poses or orientations place the robot's root link in `world`, on `/tf`. Default: the first that
    /// publishes poses of the root link, or orientations as long as none does.
    pub body: Option<String>,
    /// Robot whose frames, URDF and name are written. Default: none.
    pub(crate) robot: Option<Described>,
}

#[derive(Clone, Debug)]
pub(crate) struct Described {
    pub(crate) name: &'static str,
    pub(crate) topology: &'static Topology,
}

impl Default for RecorderOptions {
    fn default() -> Self {
        Self {
            flush_messages: 100,
            flush_interval: Duration::from_millis(200),
            sync: false,
            compression: Compression::default(),
            chunk_bytes: 1 << 20,
            transforms: true,
            body: None,
            robot: None,
        }
    }
}

impl RecorderOptions {
    /// The defaults, with the frames, the URDF and the name of a robot.
    pub fn of<R: Robot>() -> Self {
        let robot = Described { name: R::NAME, topology: R::TOPOLOGY };
        Self { robot: Some(robot), ..Self::default() }
    }

    pub(crate) fn mcap(&self) -> WriteOptions {
        let compression = match self.compression {
            Compression::None => None,
            Compression::Lz4 => Some(mcap::Compression::Lz4),
            Compression::Zstd => Some(mcap::Compression::Zstd),
        };
        WriteOptions::new()
            .profile("ros2")
            .library(library())
            .compression(compression)
            .compression_threads(0)
            .chunk_size(Some(self.chunk_bytes))
            // A chunk is put together in memory and written as a whole: a file that breaks off has no half-known chunk.
            .disable_seeking(true)
    }
}

/// Name of the program by which recordings of this crate are recognised.
pub(crate) const LIBRARY: &str = "bb-mcap";

fn library() -> String {
    format!("{LIBRARY} {}", env!("CARGO_PKG_VERSION"))
}
