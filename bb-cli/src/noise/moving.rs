//! Motion that wheels and fixes show in a bag.

use super::still::Moving;
use bb_core::nalgebra::Vector3;
use bb_core::payload::{GnssFix, Odometry};
use bb_eval::motion::scatter::{Fix, position, track};
use bb_mcap::{Bag, ODOMETRY, RecordingError};
use std::ops::Range;
use std::path::Path;

const FIX: &str = "sensor_msgs/msg/NavSatFix";
/// Velocity beyond which an odometry moves, m/s or rad/s.
const FASTEST: f64 = 0.05;
/// Distance in m from the fixes that were [`SPAN_S`] before and after, beyond which a fix shows motion: at rest they scatter by less.
const FARTHEST_M: f64 = 10.0;
/// Time between two fixes that are compared, s.
const SPAN_S: f64 = 8.0;
/// Time before and after a message that moves, in which it counts as moving, ns.
const MARGIN_NS: i64 = 1_000_000_000;

/// The times in which each odometry and each receiver of a bag moves.
pub(super) fn moving(file: &Path) -> Result<Vec<Moving>, RecordingError> {
    let bag = Bag::open(file)?;
    let mut all = Vec::new();
    for topic in bag.topics() {
        let mut spans_ns: Vec<Range<i64>> = Vec::new();
        let mut add = |time_ns: i64| match spans_ns.last_mut() {
            Some(last) if time_ns - MARGIN_NS <= last.end => last.end = last.end.max(time_ns + MARGIN_NS),
            _ => spans_ns.push(time_ns - MARGIN_NS..time_ns + MARGIN_NS),
        };
        // Damage is met, and reported, where the samples are read.
        let messages = || Ok::<_, RecordingError>(bag.messages(&[&topic.name])?.map_while(Result::ok));
        match &*topic.schema {
            ODOMETRY => {
                for message in messages()? {
                    let (Odometry { twist, .. }, time) = message.payload()?;
                    let is_fast = |of: Vector3<f64>| of.iter().any(|value| value.abs() > FASTEST);
                    if is_fast(twist.linear) || is_fast(twist.angular) {
                        add(time.as_unix_nanos());
                    }
                }
            }
            FIX => {
                let mut positions = Vec::new();
                for message in messages()? {
                    let (fix, time) = message.payload::<GnssFix>()?;
                    positions.extend(position(&fix).map(|(at, variance)| (time.as_unix_nanos(), at, variance)));
                }
                let zero_ns = positions.first().map_or(0, |(time_ns, ..)| *time_ns);
                let track = track(&positions, zero_ns);
                let is_far = |fix: &Fix, from_s: f64| {
                    let other = track.get(track.partition_point(|other| other.time_s < from_s));
                    other.is_some_and(|other| {
                        other.time_s < from_s + 0.5 * SPAN_S
                            && (other.position - fix.position).xy().norm() > FARTHEST_M
                    })
                };
                for fix in &track {
                    if is_far(fix, fix.time_s - SPAN_S) && is_far(fix, fix.time_s + SPAN_S) {
                        add(zero_ns + (fix.time_s * 1e9) as i64);
                    }
                }
            }
            _ => {}
        }
        if [ODOMETRY, FIX].contains(&&*topic.schema) {
            all.push(Moving { topic: topic.name.to_string(), spans_ns });
        }
    }
    Ok(all)
}
