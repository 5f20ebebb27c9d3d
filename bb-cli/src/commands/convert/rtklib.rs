//! Solutions of RTKLIB, `.pos`: latitude, longitude and height in degrees and metres, with deviations.
//! The format: RTKLIB manual 2.4.2, appendix B.1.

use super::cells::LAST_NS;
use super::entry::{Entry, FIX, What};
use bb_core::nalgebra::Matrix3;
use bb_core::payload::{GeodeticPosition, GnssFix, GnssServices, GnssStatus};
use chrono::{NaiveDate, NaiveDateTime};
use std::path::Path;
use std::sync::Arc;

/// Offsets of GPS time from UTC since 2017, s; and before, by the time of each leap second.
const LEAP_SECONDS: [(i64, i64); 6] = [
    (1_483_228_800, 18),
    (1_435_708_800, 17),
    (1_341_100_800, 16),
    (1_230_768_000, 15),
    (1_136_073_600, 14),
    (915_148_800, 13),
];

/// 1980-01-06, the beginning of GPS time, s since 1970.
const GPS_EPOCH_S: i64 = 315_964_800;

/// Layout of the columns, by the head of the file.
#[derive(Debug)]
struct Head {
    is_gps_time: bool,
    has_deviations: bool,
}

/// The fixes of a file.
pub(super) fn read(file: &Path, topic: Option<&str>) -> Result<Vec<Entry>, String> {
    let bytes = std::fs::read(file).map_err(|error| format!("cannot be read: {error}"))?;
    // Names of files in its head may be in any encoding.
    let text = String::from_utf8_lossy(&bytes);
    let topic: Arc<str> = topic.unwrap_or(FIX).into();
    let mut head = None;
    let mut entries = Vec::new();
    for (index, line) in text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
        if let Some(words) = line.strip_prefix('%') {
            if words.contains("/geodetic") || words.contains("=Tokyo") {
                return Err(
                    "its heights are not above the ellipsoid of WGS 84; write it with `out-height =ellipsoidal, \
                            out-datum =wgs84`"
                        .into(),
                );
            }
            if words.contains("latitude") || words.contains("x-ecef") || words.contains("e-baseline") {
                head = Some(columns(words)?);
            }
            continue;
        }
        let head = head.as_ref().ok_or("no line of its head, which begins with `%`, names the columns")?;
        let (time_ns, fix) = row(head, line).map_err(|fault| format!("line {}: {fault}", index + 1))?;
        entries.push(Entry { time_ns, what: What::Fix { topic: Arc::clone(&topic), fix } });
    }
    match entries.is_empty() {
        true => Err("it has no solution".into()),
        false => Ok(entries),
    }
}

fn columns(words: &str) -> Result<Head, String> {
    let is_degrees =
        words.contains("latitude(deg)") && words.contains("longitude(deg)") && words.contains("height(m)");
    if !is_degrees {
        return Err(
            "its positions are not latitude(deg), longitude(deg), height(m); write it so with `-g` unset and \
                    `out-solformat =llh, out-degform =deg`"
                .into(),
        );
    }
    let is_gps_time = words.contains("GPST");
    if !is_gps_time && !words.contains("UTC") {
        return Err("its times are neither GPST nor UTC".into());
    }
    Ok(Head { is_gps_time, has_deviations: words.contains("sdn(m)") && words.contains("sdun(m)") })
}

fn row(head: &Head, line: &str) -> Result<(i64, GnssFix), String> {
    let words: Vec<&str> = line.split([' ', ',', ';', '\t']).filter(|word| !word.is_empty()).collect();
    let at = |index: usize| words.get(index).copied().ok_or_else(|| format!("{} columns are too few", words.len()));
    let number = |index: usize| {
        let word = at(index)?;
        word.parse::<f64>().ok().filter(|x| x.is_finite()).ok_or_else(|| format!("`{word}` is not a number"))
    };
    let time_ns = time(head, at(0)?, at(1)?)?;
    let (latitude, longitude, height) = (number(2)?, number(3)?, number(4)?);
    if latitude.abs() > 90.0 || longitude.abs() > 360.0 {
        return Err(format!("`{latitude} {longitude}` is no latitude and longitude in degrees"));
    }
    let status = match at(5)? {
        "1" | "2" | "4" => GnssStatus::GroundAugmented,
        "3" => GnssStatus::SatelliteAugmented,
        "5" | "6" => GnssStatus::Fix,
        _ => GnssStatus::Unknown,
    };
    let position_covariance = if head.has_deviations {
        // Of north, east and up; a mixed one has the sign of its covariance and is the root of its size.
        let [n, e, u, ne, eu, un] = [number(7)?, number(8)?, number(9)?, number(10)?, number(11)?, number(12)?];
        let mixed = |x: f64| x * x.abs();
        Some(Matrix3::new(
            e * e,
            mixed(ne),
            mixed(eu), //
            mixed(ne),
            n * n,
            mixed(un), //
            mixed(eu),
            mixed(un),
            u * u,
        ))
    } else {
        None
    };
    let position = GeodeticPosition {
        latitude_rad: latitude.to_radians(),
        longitude_rad: longitude.to_radians(),
        altitude: Some(height),
    };
    Ok((
        time_ns,
        GnssFix { status, services: GnssServices::default(), position: Some(position), position_covariance },
    ))
}

/// `2019/05/01 07:26:19.000`, or week and seconds: `2051 264379.000`.
fn time(head: &Head, first: &str, second: &str) -> Result<i64, String> {
    let fault = || format!("`{first} {second}` is not a time");
    let ns = if first.contains('/') {
        let date = NaiveDate::parse_from_str(first, "%Y/%m/%d").map_err(|_| fault())?;
        let (clock, part) = second.split_once('.').unwrap_or((second, "0"));
        let clock = chrono::NaiveTime::parse_from_str(clock, "%H:%M:%S").map_err(|_| fault())?;
        let whole = NaiveDateTime::new(date, clock).and_utc().timestamp();
        if !part.bytes().all(|byte| byte.is_ascii_digit()) {
            return Err(fault());
        }
        let part: f64 = format!("0.{part}").parse().map_err(|_| fault())?;
        whole.checked_mul(1_000_000_000).map(|whole| whole + (part * 1e9).round() as i64)
    } else {
        let week: i64 = first.parse().map_err(|_| fault())?;
        let seconds: f64 = second.parse().map_err(|_| fault())?;
        if !(0..10_000).contains(&week) || !(0.0..=604_800.0).contains(&seconds) {
            return Err(fault());
        }
        Some((GPS_EPOCH_S + week * 604_800) * 1_000_000_000 + (seconds * 1e9).round() as i64)
    };
    let ns = ns.filter(|ns| (GPS_EPOCH_S * 1_000_000_000..=LAST_NS).contains(ns)).ok_or_else(fault)?;
    let leap = LEAP_SECONDS.iter().find(|(from, ahead)| ns / 1_000_000_000 - ahead >= *from);
    let ahead = leap.filter(|_| head.is_gps_time).map_or(0, |(_, ahead)| *ahead);
    Ok(ns - ahead * 1_000_000_000)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_forms_of_a_time_are_utc() {
        let gps = Head { is_gps_time: true, has_deviations: false };
        let by_date = time(&gps, "2019/05/01", "07:26:19.250").expect("is one");
        // Wednesday of week 2051.
        assert_eq!(by_date, 1_556_695_561_250_000_000);
        assert_eq!(time(&gps, "2051", "285979.250"), Ok(by_date));
        let utc = Head { is_gps_time: false, has_deviations: false };
        assert_eq!(time(&utc, "2019/05/01", "07:26:01.250"), Ok(by_date));
        assert_eq!(time(&utc, "2019/05", "07:26:01"), Err("`2019/05 07:26:01` is not a time".into()));
        assert_eq!(time(&gps, "-3", "1.0"), Err("`-3 1.0` is not a time".into()));
    }

    #[test]
    fn deviations_are_a_covariance_of_east_north_up() {
        let head = Head { is_gps_time: true, has_deviations: true };
        let line = "2019/05/01 07:26:19.000 48.137 11.575 520.0 1 9 0.02 0.01 0.05 -0.003 0.002 0.001 0.5 3.0";
        let (_, fix) = row(&head, line).expect("is one");
        let covariance = fix.position_covariance.expect("is known");
        assert_eq!((covariance[(0, 0)], covariance[(1, 1)], covariance[(2, 2)]), (1e-4, 4e-4, 0.05 * 0.05));
        assert_eq!(covariance[(0, 1)], -0.003 * 0.003);
        assert_eq!(fix.status, GnssStatus::GroundAugmented);
        assert_eq!(row(&head, "2019/05/01 07:26:19.000 48.1"), Err("3 columns are too few".into()));
    }
}
