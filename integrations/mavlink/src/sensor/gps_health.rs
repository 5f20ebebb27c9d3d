//! The state of the flight controller's receiver, from `GPS_RAW_INT` and `STATUSTEXT`.

use super::stream::Stream;
use crate::link::Peer;
use bb_core::{Fault, MonotonicTime, Options, Reading, Sensor, SensorContext};
use bb_estimators::navigation::state_estimator::{GpsHealth, GpsReport};
use mavlink::MessageData;
use mavlink::dialects::ardupilotmega::{GPS_RAW_INT_DATA, GpsFixType, MavMessage, STATUSTEXT_DATA};
use std::time::Duration;

/// Options of [`MavlinkGpsHealth`].
#[derive(Clone, Debug, Options)]
pub struct MavlinkGpsHealthOptions {
    /// Address of the flight controller: see [`Address`](crate::Address).
    #[option(required)]
    pub link: String,
    /// Number of satellites below which it is unstable. A receiver that does not report the number is not judged by it.
    #[option(default = 6)]
    pub least_satellites: u8,
    /// Dilution of precision above which it is unstable.
    #[option(default = 2.5, range = 0.1..=100.0)]
    pub largest_hdop: f64,
    /// Horizontal accuracy above which it is unstable, where the receiver reports one.
    #[option(default = 10.0, range = 0.01..=10000.0, unit = "m")]
    pub largest_accuracy: f64,
    /// Time for which it counts as spoofed after a text that reports spoofing.
    #[option(default = Duration::from_secs(10))]
    pub spoofed_for: Duration,
    /// System that sends; 0 for any.
    #[option(default = 1)]
    pub system_id: u8,
    /// Component that sends; 0 for any.
    #[option(default = 1)]
    pub component_id: u8,
    /// Time for which it may send nothing that can be used.
    #[option(default = Duration::from_secs(2))]
    pub timeout: Duration,
}

/// The health of the flight controller's receiver, with each `GPS_RAW_INT`, as input for the state estimator.
///
/// The dialect `ardupilotmega` has no message about spoofing. So the receiver counts as spoofed for a while after a
/// `STATUSTEXT` that reports it, as "GPS1: spoofing indicated", unless another one reports its end, as "spoofing
/// cleared".
#[derive(Debug)]
pub struct MavlinkGpsHealth {
    stream: Stream,
    options: MavlinkGpsHealthOptions,
    spoofed: Option<MonotonicTime>,
}

impl Sensor for MavlinkGpsHealth {
    type Options = MavlinkGpsHealthOptions;
    type Output = GpsReport;

    fn init(options: MavlinkGpsHealthOptions, context: &SensorContext) -> Result<Self, Fault> {
        let messages =
            [(GPS_RAW_INT_DATA::NAME, GPS_RAW_INT_DATA::ID), (STATUSTEXT_DATA::NAME, STATUSTEXT_DATA::ID)];
        let peer = Peer { system_id: options.system_id, component_id: options.component_id };
        let stream = Stream::open(&options.link, peer, &messages, options.timeout, context)?;
        Ok(Self { stream, options, spoofed: None })
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<GpsReport>, Fault> {
        let Some(received) = self.stream.next()? else { return Ok(Reading::nothing()) };
        let arrival = received.arrival;
        let health = match &received.message {
            MavMessage::STATUSTEXT(text) => match spoofing(text) {
                Some(true) => {
                    self.spoofed = Some(arrival);
                    GpsHealth::Spoofed
                }
                said => {
                    self.spoofed = self.spoofed.filter(|_| said.is_none());
                    // A flood of texts must not hide that no other messages come.
                    return self.stream.check_silence().map(|()| Reading::nothing());
                }
            },
            MavMessage::GPS_RAW_INT(data) => {
                self.stream.has_value();
                let is_recent =
                    |at: MonotonicTime| arrival.seconds_since(at) <= self.options.spoofed_for.as_secs_f64();
                if self.spoofed.is_some_and(is_recent) { GpsHealth::Spoofed } else { health(data, &self.options) }
            }
            _ => return Ok(Reading::nothing()),
        };
        Ok(Reading::at(arrival, GpsReport { health }))
    }
}

/// Words that negate the next word.
const NOT: [&str; 4] = ["no", "not", "none", "without"];

/// Words that may be between these and the word.
const BETWEEN: [&str; 6] = ["gps", "gnss", "gps1", "gps2", "longer", "more"];

/// Words after "spoofing" that say that it has ended, or is not present.
const ENDED: [&str; 10] =
    ["cleared", "clear", "ended", "gone", "stopped", "resolved", "recovered", "none", "ok", "inactive"];

/// Words beside "spoofing" that say that it is present, unless they are denied.
const FOUND: [&str; 4] = ["detect", "detects", "detected", "indicated"];

/// Returns whether a text reports spoofing, or its absence; `None` if it is about something else. In doubt, it counts
/// as spoofing.
fn spoofing(text: &STATUSTEXT_DATA) -> Option<bool> {
    // A colon is a word: a negation before it, as in "not trusted: spoofed", does not apply after it.
    let text = text.text.to_str().ok()?.to_ascii_lowercase().replace(':', " : ");
    let is_between = |c: char| !c.is_ascii_alphanumeric() && c != ':';
    let words: Vec<&str> = text.split(is_between).filter(|word| !word.is_empty()).collect();
    let at = words.iter().position(|word| word.starts_with("spoof"))?;
    let (before, after) = words.split_at(at);
    let is_denied = |before: &[&str]| {
        let last = before.iter().rev().find(|word| !BETWEEN.contains(word));
        last.is_some_and(|word| NOT.contains(word))
    };
    // Further words are about something else, as in "spoofing detected, IMU ok".
    let beside = at.saturating_sub(1)..words.len();
    let mut found = beside.filter(|i| FOUND.contains(&words[*i])).map(|i| !is_denied(&words[..i])).peekable();
    let has_ended = match found.peek() {
        Some(_) => !found.any(|is_found| is_found),
        None => after.iter().enumerate().any(|(i, word)| ENDED.contains(word) && !is_denied(&after[..i])),
    };
    Some(!has_ended && !is_denied(before))
}

fn health(data: &GPS_RAW_INT_DATA, options: &MavlinkGpsHealthOptions) -> GpsHealth {
    match data.fix_type {
        GpsFixType::GPS_FIX_TYPE_NO_GPS | GpsFixType::GPS_FIX_TYPE_NO_FIX => return GpsHealth::NoFix,
        GpsFixType::GPS_FIX_TYPE_2D_FIX => return GpsHealth::Unstable,
        _ => {}
    }
    let has_few = data.satellites_visible != u8::MAX && data.satellites_visible < options.least_satellites;
    let is_diluted = data.eph != u16::MAX && f64::from(data.eph) * 1e-2 > options.largest_hdop;
    // Zero if unknown.
    let is_inaccurate = f64::from(data.h_acc) * 1e-3 > options.largest_accuracy;
    if has_few || is_diluted || is_inaccurate { GpsHealth::Unstable } else { GpsHealth::Stable }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_sign_of_trouble_is_unstable() {
        let options = MavlinkGpsHealthOptions::defaults();
        let good = GPS_RAW_INT_DATA {
            fix_type: GpsFixType::GPS_FIX_TYPE_3D_FIX,
            satellites_visible: 6,
            eph: 250,
            h_acc: 10_000,
            ..Default::default()
        };
        let unknown = GPS_RAW_INT_DATA { satellites_visible: u8::MAX, eph: u16::MAX, h_acc: 0, ..good.clone() };
        let rows = [
            (good.clone(), GpsHealth::Stable),
            (unknown, GpsHealth::Stable),
            (GPS_RAW_INT_DATA { satellites_visible: 5, ..good.clone() }, GpsHealth::Unstable),
            (GPS_RAW_INT_DATA { eph: 251, ..good.clone() }, GpsHealth::Unstable),
            (GPS_RAW_INT_DATA { h_acc: 10_001, ..good.clone() }, GpsHealth::Unstable),
            (GPS_RAW_INT_DATA { fix_type: GpsFixType::GPS_FIX_TYPE_2D_FIX, ..good.clone() }, GpsHealth::Unstable),
            (GPS_RAW_INT_DATA { fix_type: GpsFixType::GPS_FIX_TYPE_NO_FIX, ..good.clone() }, GpsHealth::NoFix),
            (GPS_RAW_INT_DATA { fix_type: GpsFixType::GPS_FIX_TYPE_NO_GPS, ..good }, GpsHealth::NoFix),
        ];
        for (data, expected) in rows {
            assert_eq!(health(&data, &options), expected, "{data:?}");
        }
    }

    #[test]
    fn texts_about_spoofing_are_read() {
        let said = |text: &str| spoofing(&STATUSTEXT_DATA { text: text.into(), ..Default::default() });
        for text in [
            "GPS1: Spoofing indicated",
            "GPS reports multiple spoofing indicated",
            "GPS spoofed",
            "GPS 1 not trusted: spoofed",
            "GPS lost, no fix, spoofing detected",
            "Spoofing not cleared",
            "Spoofing detected, IMU ok",
            "spoofing detected, RTK none",
            "spoofing detected over 3 satellites",
            "Spoofing over 3 satellites",
            "Detected spoofing, IMU ok",
            "SPOOFING!",
        ] {
            assert_eq!(said(text), Some(true), "{text}");
        }
        for text in [
            "GPS1: spoofing cleared",
            "No spoofing indicated",
            "GPS: no GNSS spoofing",
            "GPS no longer spoofed",
            "GPS spoofing state: none",
            "Spoofing OK",
            "GPS not spoofed",
            "Spoofing: none detected",
            "Spoofing not detected",
            "Spoofing no longer indicated",
        ] {
            assert_eq!(said(text), Some(false), "{text}");
        }
        for text in ["GPS1: detected u-blox", "", "no fix"] {
            assert_eq!(said(text), None, "{text}");
        }
    }
}
