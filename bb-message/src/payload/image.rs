//! Camera images.

use crate::message::Payload;
use std::sync::Arc;

/// An uncompressed image of a camera whose frame is the message's: x to the right, y down, z forward
/// (`sensor_msgs/Image`).
#[derive(Clone, Debug, PartialEq, Eq, Payload)]
#[payload(ros)]
pub struct Image {
    /// Rows.
    pub height: u32,
    /// Pixels in a row.
    pub width: u32,
    /// Channels and their size, by ROS's names: `rgb8`, `bgr8`, `mono8`, `mono16`, `16UC1` for a depth in mm, `32FC1` for
    /// one in m, `bayer_rggb8`.
    pub encoding: &'static str,
    /// `true` if multi-byte numbers are big-endian.
    pub is_bigendian: bool,
    /// Bytes of a row, including padding.
    pub step: u32,
    /// The rows from the top: `step * height` bytes.
    pub data: Arc<[u8]>,
}

impl Image {
    /// The bytes of a row, counted from the top. `None` if the image has fewer rows.
    pub fn row(&self, row: u32) -> Option<&[u8]> {
        let step = usize::try_from(self.step).ok()?;
        let start = usize::try_from(row).ok()?.checked_mul(step)?;
        (row < self.height).then(|| self.data.get(start..start.checked_add(step)?)).flatten()
    }
}
