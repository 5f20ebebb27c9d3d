//! A bias that jumps, and what that says of the heading, which is its integral.
//!
//! A measurement that overrides its gate moves the bias at once. If the bias did jump, it did so before, while the gate was closed, and
//! the heading has turned with the wrong one since. If it soon jumps back, more likely the sensor was wrong, and the heading has turned
//! by what the sensor made of the bias all the while. No fused measurement shows either, so the heading becomes as uncertain as that.

/// A bias that stays for longer, s, is the gyroscope's.
const LONGEST_S: f64 = 120.0;

/// A sensor that was silent for longer, s, does not show when the bias jumped.
const LONGEST_CLOSED_S: f64 = 10.0;

/// A bias is back if it is closer to the former one than this fraction of the way that it had come.
const BACK: f64 = 0.5;

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

/// What a measurement that has overridden its gate did to the bias.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moved {
    pub(super) now_ns: i64,
    /// When a measurement of its stream was last fused before it.
    pub(super) fused_ns: Option<i64>,
    /// The bias now, rad/s.
    pub(super) bias: f64,
    /// What the measurement has added to it, rad/s.
    pub(super) change: f64,
}

impl BiasJump {
    /// What is known of a jump after the bias has moved, and how uncertain the heading has become by that, rad².
    #[cold]
    pub(super) fn follow(jump: Option<Self>, moved: &Moved) -> (Option<Self>, f64) {
        let Moved { now_ns, fused_ns, bias, change } = *moved;
        let since = |time_ns: i64| now_ns.saturating_sub(time_ns) as f64 * 1e-9;
        let left = bias - change;
        let closed_s = fused_ns.map_or(0.0, since).min(LONGEST_CLOSED_S);
        let variance = change * change * closed_s * closed_s;
        match jump.filter(|jump| since(jump.first_ns) <= LONGEST_S) {
            Some(jump) => {
                let way = left - jump.before;
                let turned = jump.turned - way * since(jump.last_ns);
                if (bias - jump.before).abs() < BACK * way.abs() {
                    (None, variance.max(turned * turned))
                } else {
                    (Some(Self { last_ns: now_ns, turned, ..jump }), variance)
                }
            }
            None => (Some(Self { before: left, first_ns: now_ns, last_ns: now_ns, turned: 0.0 }), variance),
        }
    }
}
