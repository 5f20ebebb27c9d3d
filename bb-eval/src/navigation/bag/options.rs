//! Which topics of a bag are what, and what the bag does not say.

use crate::navigation::data::DEVIATIONS;
use bb_core::nalgebra::{Isometry3, UnitQuaternion, Vector3};
use bb_estimators::navigation::Geodetic;
use std::str::FromStr;

/// Which topics of a bag are what, and what the bag does not say. The default takes topics by their type.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "clap", derive(clap::Args), command(next_help_heading = "Options for bags"))]
pub struct BagOptions {
    /// The topic of the IMU, if there are several (sensor_msgs/Imu).
    #[cfg_attr(feature = "clap", arg(long, value_name = "TOPIC"))]
    pub imu_topic: Option<String>,
    /// The topic of the fixes, if there are several (sensor_msgs/NavSatFix), or `none`.
    #[cfg_attr(feature = "clap", arg(long, value_name = "TOPIC"))]
    pub gnss_topic: Option<String>,
    /// The topic of the wheel odometry, of which the velocity is used, if there are several (nav_msgs/Odometry), or `none`.
    #[cfg_attr(feature = "clap", arg(long, value_name = "TOPIC"))]
    pub odometry_topic: Option<String>,
    /// A topic whose poses are used as relative poses, each from the previous one, as for visual odometry (nav_msgs/Odometry).
    #[cfg_attr(feature = "clap", arg(long, value_name = "TOPIC"))]
    pub relative_topic: Option<String>,
    /// The topic of poses in the world, if there are several (geometry_msgs/PoseWithCovarianceStamped), or `none`.
    #[cfg_attr(feature = "clap", arg(long, value_name = "TOPIC"))]
    pub pose_topic: Option<String>,
    /// The topic of the truth, if there are several (geometry_msgs/PoseStamped, TransformStamped) or if it is
    /// nav_msgs/Odometry or sensor_msgs/NavSatFix; or `none`.
    #[cfg_attr(feature = "clap", arg(long, alias = "truth-topic", value_name = "TOPIC"))]
    pub truth: Option<String>,
    /// Where the filters start: `truth`, `align` (from rest, or in motion with --set heading_from_course=true), or the topic
    /// of a pose (geometry_msgs/PoseWithCovarianceStamped, nav_msgs/Odometry). Default: the first available of /initialpose,
    /// truth, and align.
    #[cfg_attr(feature = "clap", arg(long, value_name = "FROM"))]
    pub start: Option<StartFrom>,
    /// The pose of a frame in that of the IMU, m and degrees: FRAME=X,Y,Z or FRAME=X,Y,Z,ROLL,PITCH,YAW. FRAME may be the topic
    /// of a sensor. TOPIC=FRAME sets the frame whose pose or velocity a topic contains.
    #[cfg_attr(feature = "clap", arg(long, value_name = "FRAME=…", allow_hyphen_values = true))]
    pub mount: Vec<Mount>,
    /// The origin of the world, in degrees and m above the ellipsoid. Default: the first fix.
    #[cfg_attr(feature = "clap", arg(long, value_name = "LATITUDE,LONGITUDE,HEIGHT", allow_hyphen_values = true))]
    pub origin: Option<Origin>,
    /// Standard deviations of a relative pose, m and rad. Default: from the growth of the covariance since the previous pose.
    #[cfg_attr(feature = "clap", arg(long, value_name = "TRANSLATION,ROTATION"))]
    pub relative_deviation: Option<RelativeDeviation>,
    /// Standard deviations of the biases at the start, rad/s and m/s². Default: 0.02,0.2.
    #[cfg_attr(feature = "clap", arg(long, value_name = "GYROSCOPE,ACCELEROMETER"))]
    pub bias_deviation: Option<BiasDeviation>,
}

/// Where filters start.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StartFrom {
    /// At the true pose.
    Truth,
    /// From rest, or from the course in motion.
    Align,
    /// At the first pose of this topic.
    Topic(String),
}

impl FromStr for StartFrom {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Ok(match text {
            "truth" => Self::Truth,
            "align" => Self::Align,
            topic => Self::Topic(topic.to_owned()),
        })
    }
}

/// Where a frame is.
#[derive(Clone, Debug, PartialEq)]
pub struct Mount {
    /// A frame, or the topic of a sensor.
    pub name: String,
    /// Where it is.
    pub at: Place,
}

/// A place on the body.
#[derive(Clone, Debug, PartialEq)]
pub enum Place {
    /// That of a frame.
    Frame(String),
    /// Takes its coordinates to those of the IMU.
    Pose(Isometry3<f64>),
}

impl FromStr for Mount {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, place) = text.split_once('=').ok_or("no `=` in it; write FRAME=X,Y,Z, as gps=0,0,1.2")?;
        let (name, place) = (name.trim().to_owned(), place.trim());
        if name.is_empty() || place.is_empty() {
            return Err("write FRAME=X,Y,Z, as gps=0,0,1.2".into());
        }
        let begins_as_number = place.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
        let at = if begins_as_number || place.contains(',') {
            Place::Pose(pose(place)?)
        } else {
            Place::Frame(place.to_owned())
        };
        Ok(Self { name, at })
    }
}

/// The farthest that a sensor may be from another on the same robot, m.
pub(super) const FARTHEST: f64 = 1000.0;

fn pose(text: &str) -> Result<Isometry3<f64>, String> {
    let pose = |x, y, z, rotation| Isometry3::from_parts(Vector3::new(x, y, z).into(), rotation);
    let numbers = numbers(text)?;
    if let Some(far) = numbers.iter().take(3).find(|metres| metres.abs() > FARTHEST) {
        return Err(format!("`{far}` is no place on a robot: at most {FARTHEST} m"));
    }
    if let Some(turn) = numbers.iter().skip(3).find(|degrees| degrees.abs() > 360.0) {
        return Err(format!("`{turn}` is no angle: from -360 to 360 degrees"));
    }
    match *numbers {
        [x, y, z] => Ok(pose(x, y, z, UnitQuaternion::identity())),
        [x, y, z, roll, pitch, yaw] => {
            let [roll, pitch, yaw] = [roll, pitch, yaw].map(f64::to_radians);
            Ok(pose(x, y, z, UnitQuaternion::from_euler_angles(roll, pitch, yaw)))
        }
        _ => Err(format!("`{text}` must be X,Y,Z in m, or X,Y,Z,ROLL,PITCH,YAW in m and degrees")),
    }
}

/// Heights of something on or above the Earth, m.
const HEIGHTS: std::ops::RangeInclusive<f64> = -1e4..=1e6;

/// Where the origin of the world is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Origin(pub Geodetic);

impl FromStr for Origin {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match *numbers(text)? {
            [latitude, longitude, height]
                if latitude.abs() <= 90.0 && longitude.abs() <= 360.0 && HEIGHTS.contains(&height) =>
            {
                Ok(Self(Geodetic::from_degrees(latitude, longitude, height)))
            }
            _ => Err("must be LATITUDE,LONGITUDE,HEIGHT on the Earth, in degrees and m, as 48.1,11.6,520".into()),
        }
    }
}

/// Standard deviations of a relative pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelativeDeviation {
    /// m.
    pub translation: f64,
    /// rad.
    pub rotation: f64,
}

impl FromStr for RelativeDeviation {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let [translation, rotation] = deviations(text, "0.02,0.001 (m, rad)")?;
        Ok(Self { translation, rotation })
    }
}

/// Standard deviations of biases.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BiasDeviation {
    /// rad/s.
    pub gyroscope: f64,
    /// m/s².
    pub accelerometer: f64,
}

impl FromStr for BiasDeviation {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let [gyroscope, accelerometer] = deviations(text, "0.01,0.1 (rad/s, m/s²)")?;
        Ok(Self { gyroscope, accelerometer })
    }
}

fn deviations(text: &str, example: &str) -> Result<[f64; 2], String> {
    match *numbers(text)? {
        [a, b] if DEVIATIONS.contains(&a) && DEVIATIONS.contains(&b) => Ok([a, b]),
        [a, b] if a > 0.0 && b > 0.0 => {
            let (least, most) = (DEVIATIONS.start(), DEVIATIONS.end());
            Err(format!("must be two numbers from {least:e} to {most:e}, as {example}"))
        }
        _ => Err(format!("must be two positive numbers, as {example}")),
    }
}

fn numbers(text: &str) -> Result<Vec<f64>, String> {
    let number = |cell: &str| {
        let value: Option<f64> = cell.trim().parse().ok();
        value.filter(|value| value.is_finite()).ok_or_else(|| format!("`{}` is no number", cell.trim()))
    };
    text.split(',').map(number).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mount_is_a_pose_or_a_frame() {
        let mount: Mount = "gps=-0.5,0,1.5".parse().expect("is one");
        let pose = Isometry3::translation(-0.5, 0.0, 1.5);
        assert_eq!(mount, Mount { name: "gps".into(), at: Place::Pose(pose) });
        let mount: Mount = "/wheels=base_link".parse().expect("is one");
        assert_eq!(mount.at, Place::Frame("base_link".into()));
        let Place::Pose(turned) = "imu=0,0,0,180,0,0".parse::<Mount>().expect("is one").at else {
            panic!("it is a pose")
        };
        assert!((turned.rotation * Vector3::z() + Vector3::z()).norm() < 1e-12);
        for (text, fault) in [
            ("gps", "no `=`"),
            ("gps=", "write FRAME=X,Y,Z"),
            ("gps=1,2", "must be X,Y,Z in m"),
            ("gps=1,two,3", "`two` is no number"),
            ("gps=1,inf,3", "`inf` is no number"),
            ("gps=1,nan,3", "`nan` is no number"),
            ("gps=1e300,0,0", "is no place on a robot: at most 1000 m"),
            ("gps=0,0,0,1e20,0,0", "is no angle: from -360 to 360 degrees"),
        ] {
            let said = text.parse::<Mount>().expect_err("is none");
            assert!(said.contains(fault), "{text}: {said}");
        }
    }

    #[test]
    fn numbers_out_of_their_range_are_refused() {
        assert!("48.1,11.6,520".parse::<Origin>().is_ok());
        for text in ["91,0,0", "48,11", "48,11,nan", "48,11,1e300"] {
            assert!(text.parse::<Origin>().is_err(), "{text}");
        }
        assert!("0.02,0.001".parse::<RelativeDeviation>().is_ok());
        for text in ["0,0.1", "0.1", "0.1,-1", "a,b", "1e-160,0.1", "0.1,1e200"] {
            assert!(text.parse::<RelativeDeviation>().is_err() && text.parse::<BiasDeviation>().is_err(), "{text}");
        }
    }
}
