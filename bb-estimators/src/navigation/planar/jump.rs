//! A bias that jumps, and what that says of the heading, which is its integral.
//!
//! A measurement that overrides its gate moves the bias at once. If the bias did jump, it did so before, while the gate was closed, and
//! the heading has turned with the wrong one since. If it soon jumps back, more likely the sensor was wrong, and the heading has turned
//! by what the sensor made of the bias all the while. No fused measurement shows either, so the heading becomes as uncertain as that.

use core::f64::consts::PI;

use super::estimate::HEADING;
use super::filter::PlanarEkf;
use crate::navigation::stream::Stream;

/// A bias that stays for longer, s, is the gyroscope's.
const LONGEST_S: f64 = 120.0;

/// A sensor that was silent for longer, s, does not show when the bias jumped.
const LONGEST_CLOSED_S: f64 = 10.0;

/// A bias is back if it is closer to the former one than this fraction of the way that it had come.
const BACK: f64 = 0.5;

/// The variance of a heading of which nothing is known, rad²: uniform over a turn.
const UNKNOWN: f64 = PI * PI / 3.0;

/// A jump of the bias that may be the fault of a sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct BiasJump {
    /// The bias before, rad/s.
    before: f64,
    first_ns: i64,
    /// The last jump: the way back may take several.
    last_ns: i64,
    /// How far the heading has turned since because the bias is not the former one, rad.
    turned: f64,
}

impl PlanarEkf {
    /// Raises the variance of the heading after `stream` has overridden its gate and moved the bias by `change`.
    #[cold]
    pub(super) fn follow_jump(&mut self, stream: &Stream, change: f64) {
        let Some(estimate) = &self.estimate else { return };
        let now_ns = estimate.time_ns;
        let since = |time_ns: i64| now_ns.saturating_sub(time_ns) as f64 * 1e-9;
        let bias = estimate.gyroscope_bias;
        let left = bias - change;
        let closed_s = stream.fused_ns().map_or(0.0, since).min(LONGEST_CLOSED_S);
        let mut variance = change * change * closed_s * closed_s;
        let open = self.jump.filter(|jump| since(jump.first_ns) <= LONGEST_S);
        self.jump = match open {
            Some(jump) => {
                let way = left - jump.before;
                let turned = jump.turned - way * since(jump.last_ns);
                if (bias - jump.before).abs() < BACK * way.abs() {
                    variance = variance.max(turned * turned);
                    None
                } else {
                    Some(BiasJump { last_ns: now_ns, turned, ..jump })
                }
            }
            None => Some(BiasJump { before: left, first_ns: now_ns, last_ns: now_ns, turned: 0.0 }),
        };
        let unknown = (UNKNOWN - self.covariance.matrix()[(HEADING, HEADING)]).max(0.0);
        self.covariance.inflate(HEADING, variance.min(unknown));
    }
}
