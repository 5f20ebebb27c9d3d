//! Sentences of a receiver, NMEA 0183: a fix for each GGA, with the date of RMC or ZDA and the deviations of GST.

use super::cells::LAST_NS;
use super::entry::{Entry, FIX, What};
use bb_core::nalgebra::{Matrix3, Vector3};
use bb_core::payload::{GeodeticPosition, GnssFix, GnssServices, GnssStatus};
use bb_eval::table::counted;
use nmea::ParseResult;
use nmea::sentences::FixType;
use nmea::sentences::rmc::RmcStatusOfFix;
use std::path::Path;
use std::sync::Arc;

const DAY_S: i64 = 86_400;

/// The fixes of a file, and the number of lines that are no sentence with the right checksum.
pub(super) fn read(file: &Path, topic: Option<&str>) -> Result<(Vec<Entry>, u64), String> {
    let bytes = std::fs::read(file).map_err(|error| format!("cannot be read: {error}"))?;
    let topic: Arc<str> = topic.unwrap_or(FIX).into();
    let (mut fixes, mut bad) = (Fixes::default(), 0);
    for line in bytes.split(|byte| *byte == b'\n').map(<[u8]>::trim_ascii).filter(|line| !line.is_empty()) {
        // Of one maker alone.
        if line.starts_with(b"$P") {
            continue;
        }
        match nmea::parse_bytes(line) {
            Ok(sentence) => fixes.sentence(&sentence),
            // Sentences of other kinds are whole.
            Err(nmea::Error::Unsupported(_) | nmea::Error::Unknown(_) | nmea::Error::DisabledSentence) => {}
            Err(_) => bad += 1,
        }
    }
    if !fixes.dated {
        return Err(match bad {
            0 => "no RMC or ZDA sentence says the date".into(),
            _ => format!(
                "{} the right checksum, and none of the others is an RMC or ZDA that says the date",
                counted(bad as usize, "line is no sentence with", "lines are no sentences with")
            ),
        });
    }
    let entries = fixes.all.into_iter().map(|(time_ns, fix)| {
        let topic = Arc::clone(&topic);
        Entry { time_ns, what: What::Fix { topic, fix } }
    });
    Ok((entries.collect(), bad))
}

/// The fixes so far.
#[derive(Default)]
struct Fixes {
    /// Days since 1970, and the time of day at which they were said, ns.
    day: Option<(i64, i64)>,
    dated: bool,
    all: Vec<(i64, GnssFix)>,
    /// Deviations to the north, the east and upward, m, at a time of day.
    deviations: Option<(i64, Vector3<f64>)>,
}

impl Fixes {
    fn sentence(&mut self, sentence: &ParseResult) {
        match sentence {
            // Without a fix the date may be any.
            ParseResult::RMC(rmc) if rmc.status_of_fix == RmcStatusOfFix::Invalid => {}
            ParseResult::RMC(rmc) => self.date(rmc.fix_date, rmc.fix_time),
            ParseResult::ZDA(zda) => self.date(zda.utc_date(), zda.utc_time),
            ParseResult::GST(gst) => {
                let (Some(time), Some(north), Some(east), Some(up)) =
                    (gst.time, gst.lat_sd, gst.long_sd, gst.alt_sd)
                else {
                    return;
                };
                let (time_ns, deviations) = (of_day(time), Vector3::new(east, north, up).map(f64::from));
                self.deviations = Some((time_ns, deviations));
                // It may come after the position that it belongs to.
                let time_ns = self.time(time_ns);
                if let Some((last_ns, fix)) = self.all.last_mut()
                    && *last_ns == time_ns
                {
                    fix.position_covariance = Some(covariance(&deviations));
                }
            }
            ParseResult::GGA(gga) => {
                let Some(time) = gga.fix_time else { return };
                let time_ns = of_day(time);
                let status = gga.fix_type.map_or(GnssStatus::Unknown, status);
                let place = gga.latitude.zip(gga.longitude).filter(|_| status != GnssStatus::NoFix);
                let position = place.map(|(latitude, longitude)| GeodeticPosition {
                    latitude_rad: latitude.to_radians(),
                    longitude_rad: longitude.to_radians(),
                    // Its altitude is above the geoid.
                    altitude: gga.altitude.zip(gga.geoid_separation).map(|(a, b)| f64::from(a) + f64::from(b)),
                });
                let known = self.deviations.filter(|(at_ns, _)| *at_ns == time_ns);
                let fix = GnssFix {
                    status,
                    services: GnssServices::default(),
                    position,
                    position_covariance: known.map(|(_, deviations)| covariance(&deviations)),
                };
                self.all.push((self.time(time_ns), fix));
            }
            _ => {}
        }
    }

    fn date(&mut self, date: Option<chrono::NaiveDate>, time: Option<chrono::NaiveTime>) {
        let (Some(date), Some(time)) = (date, time) else { return };
        let day = i64::from(date.to_epoch_days());
        // Stamps of ROS end in 2038, and no receiver is older than 2000.
        if !(10_957..=LAST_NS / (DAY_S * 1_000_000_000)).contains(&day) {
            return;
        }
        let time_ns = of_day(time);
        self.day = Some((day, time_ns));
        if !self.dated {
            self.dated = true;
            // Fixes before the first date are at most half a day earlier.
            for (at_ns, _) in &mut self.all {
                *at_ns = at(day, time_ns, *at_ns);
            }
        }
    }

    /// A time of day on the date that was said last.
    fn time(&self, time_ns: i64) -> i64 {
        self.day.map_or(time_ns, |(day, said_ns)| at(day, said_ns, time_ns))
    }
}

/// A time of day near another on this day, at most half a day apart: midnight may be between them.
fn at(day: i64, said_ns: i64, time_ns: i64) -> i64 {
    let day_ns = DAY_S * 1_000_000_000;
    let days = match time_ns - said_ns {
        apart if apart > day_ns / 2 => day - 1,
        apart if apart < -day_ns / 2 => day + 1,
        _ => day,
    };
    days * day_ns + time_ns
}

fn of_day(time: chrono::NaiveTime) -> i64 {
    use chrono::Timelike;
    i64::from(time.num_seconds_from_midnight()) * 1_000_000_000 + i64::from(time.nanosecond())
}

fn covariance(deviations: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::from_diagonal(&deviations.map(|deviation| deviation * deviation))
}

fn status(kind: FixType) -> GnssStatus {
    match kind {
        FixType::Invalid => GnssStatus::NoFix,
        FixType::Gps | FixType::Pps => GnssStatus::Fix,
        FixType::DGps | FixType::Rtk | FixType::FloatRtk => GnssStatus::GroundAugmented,
        FixType::Estimated | FixType::Manual | FixType::Simulation => GnssStatus::Unknown,
    }
}
