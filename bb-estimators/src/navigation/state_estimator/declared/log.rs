//! Events as structured logs.

use super::output::Parts;
use crate::navigation::state_estimator::{Event, EventKind, EventSink, Level};

/// Passes every event to `tracing`, at its level and with its fields: a subscriber that writes JSON writes one object per line.
///
/// | field | |
/// |---|---|
/// | `event` | name of the kind |
/// | `time_ns` | time on the clock of the inputs |
/// | `frame` | id of the last estimate emitted before |
/// | `spoof_block` | whether the gate of the GNSS receiver keeps it out |
/// | `input`, `reason` | the input, and why it is not in the estimate |
/// | `from`, `to` | the old and the new value of a change |
/// | `nis` | normalised innovation squared of a measurement, over its dimension |
/// | `window` | number of keyframes of an estimator that is ready |
/// | `cov_inflation` | factor by which a covariance has grown |
/// | `waits` | whether an input is ahead of the IMU |
/// | `imu_added`, `vio_added`, `pose_added`, `smoothed_n` | of an estimate that was emitted: what was added since the one before, and the keyframes held |
/// | `status_text` | text for the ground station |
#[derive(Clone, Copy, Debug, Default)]
pub struct TracingSink;

impl EventSink for TracingSink {
    fn event(&mut self, event: &Event) {
        macro_rules! log {
            ($level:expr) => {{
                if !tracing::enabled!($level) {
                    return;
                }
                let Parts { input, reason, from, to, window, cov_inflation } = Parts::of(&event.kind);
                let (nis, waits) = match event.kind {
                    EventKind::Added { nis, waits, .. } => (nis, Some(waits)),
                    _ => (None, None),
                };
                let added = match event.kind {
                    EventKind::Emitted { imu, vio, poses, smoothed } => [imu, vio, poses, smoothed].map(Some),
                    _ => [None; 4],
                };
                let text = event.status_text();
                tracing::event!(
                    $level,
                    event = event.kind.name(),
                    time_ns = event.time_ns,
                    frame = (!event.frame_id.is_nil()).then(|| tracing::field::display(event.frame_id)),
                    spoof_block = event.spoof_block,
                    input,
                    reason = reason.as_deref(),
                    from,
                    to,
                    nis,
                    window,
                    cov_inflation,
                    waits,
                    imu_added = added[0],
                    vio_added = added[1],
                    pose_added = added[2],
                    smoothed_n = added[3],
                    status_text = text.as_ref().map(|text| text.as_str()),
                    "state estimator"
                );
            }};
        }
        match event.level() {
            Level::Error => log!(tracing::Level::ERROR),
            Level::Warn => log!(tracing::Level::WARN),
            Level::Info => log!(tracing::Level::INFO),
            Level::Debug => log!(tracing::Level::DEBUG),
        }
    }
}
