//! The magnetic declination of a place and a time.

use crate::disturb::Time;
use bb_estimators::navigation::Geodetic;
use std::str::FromStr;
use world_magnetic_model::GeomagneticField;
use world_magnetic_model::time::OffsetDateTime;
use world_magnetic_model::uom::si::angle::{degree, radian};
use world_magnetic_model::uom::si::f32::{Angle, Length};
use world_magnetic_model::uom::si::length::meter;

/// The angle from true north to magnetic north, positive to the east.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Declination {
    /// A known angle, rad.
    Known(f64),
    /// Angle of the World Magnetic Model where and when the recording was made.
    Auto,
}

impl Default for Declination {
    fn default() -> Self {
        Self::Known(0.0)
    }
}

impl FromStr for Declination {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "auto" {
            return Ok(Self::Auto);
        }
        let degrees: Option<f64> = text.parse().ok();
        let degrees = degrees.filter(|degrees| (-180.0..=180.0).contains(degrees));
        let known = degrees.map(|degrees| Self::Known(degrees.to_radians()));
        known.ok_or_else(|| "write degrees in -180..=180, or auto".to_owned())
    }
}

impl Declination {
    /// Returns the angle, rad. That of the model is added to the notes.
    ///
    /// # Errors
    /// The model is asked for, and no place is known, or the model does not cover it.
    pub(crate) fn at(self, place: Option<Geodetic>, time_ns: Time, notes: &mut Vec<String>) -> Result<f64, String> {
        if let Self::Known(angle) = self {
            return Ok(angle);
        }
        let place = place.ok_or(
            "--declination auto: the recording holds no fix; say where it was made with --origin LATITUDE,LONGITUDE,HEIGHT",
        )?;
        let (latitude, longitude) = (place.latitude.to_degrees(), place.longitude.to_degrees());
        let beyond = |fault: &dyn std::fmt::Display| format!("--declination auto: {fault}; give it in degrees");
        let date = OffsetDateTime::from_unix_timestamp(time_ns.div_euclid(1_000_000_000));
        let date = date.map_err(|fault| beyond(&fault))?.date();
        let field = GeomagneticField::new(
            Length::new::<meter>(place.height as f32),
            Angle::new::<degree>(latitude as f32),
            Angle::new::<degree>(if longitude > 180.0 { longitude - 360.0 } else { longitude } as f32),
            date,
        );
        let field = field.map_err(|fault| beyond(&fault))?;
        let angle = f64::from(field.declination().get::<radian>());
        notes.push(format!(
            "the declination is {:.2} deg ±{:.1}, of the World Magnetic Model at {latitude:.3},{longitude:.3} on {date}",
            angle.to_degrees(),
            field.declination_uncertainty().get::<degree>()
        ));
        Ok(angle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Noon of 1 January 2020, in nanoseconds.
    const NEW_YEAR: Time = 1_577_880_000_000_000_000;

    #[test]
    fn the_model_gives_the_published_values() {
        // The test values of its report, A. Chulliat et al., "The US/UK World Magnetic Model for 2020-2025", NOAA, 2020: for 2020.0
        // on the ellipsoid, degrees.
        for (latitude, longitude, wanted) in [(80.0, 0.0, -1.28), (0.0, 120.0, 0.16), (-80.0, 240.0, 69.36)] {
            let place = Geodetic::from_degrees(latitude, longitude, 0.0);
            let mut notes = Vec::new();
            let angle = Declination::Auto.at(Some(place), NEW_YEAR, &mut notes).expect("is covered").to_degrees();
            assert!((angle - wanted).abs() < 0.006, "{latitude} {longitude}: {angle}");
            assert!(notes[0].contains("of the World Magnetic Model at") && notes[0].ends_with("on 2020-01-01"));
        }
    }

    #[test]
    fn it_is_degrees_or_of_the_model() {
        assert_eq!("auto".parse(), Ok(Declination::Auto));
        assert_eq!("-180".parse(), Ok(Declination::Known(-std::f64::consts::PI)));
        for text in ["181", "nan", "4 deg", "automatic"] {
            assert!(text.parse::<Declination>().is_err(), "{text}");
        }
        let at = |place, time_ns| Declination::Auto.at(place, time_ns, &mut Vec::new());
        assert!(at(None, NEW_YEAR).expect_err("there is no place").contains("--origin"));
        let place = Some(Geodetic::from_degrees(48.0, 11.0, 500.0));
        assert!(at(place, 0).expect_err("is before the models").contains("give it in degrees"));
    }
}
