//! Options of a bag: the roles of its topics, and the facts that it does not hold.

use crate::declination::Declination;
use crate::frames::{Mount, numbers};
use crate::navigation::data::DEVIATIONS;
use bb_estimators::navigation::Geodetic;
use std::str::FromStr;

/// Roles of a bag's topics, and the facts that the bag does not hold. The default takes topics by their type.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "clap", derive(clap::Args), command(next_help_heading = "Options for bags"))]
pub struct BagOptions {
    /// The topic of the IMU, if there are several (sensor_msgs/Imu).
    #[cfg_attr(feature = "clap", arg(long, value_name = "TOPIC"))]
    pub imu_topic: Option<String>,
    /// The topic of the fixes, if there are several (sensor_msgs/NavSatFix), or `none`.
    #[cfg_attr(feature = "clap", arg(long, value_name = "TOPIC"))]
    pub gnss_topic: Option<String>,
    /// The topic of the receiver's velocity, east, north and up, which `eskf` uses (geometry_msgs/TwistWithCovarianceStamped).
    /// Default: none.
    #[cfg_attr(feature = "clap", arg(long, value_name = "TOPIC"))]
    pub gnss_velocity_topic: Option<String>,
    /// The topic of the orientation of the receiver's pair of antennas, whose heading `eskf` uses
    /// (geometry_msgs/QuaternionStamped). Default: none.
    #[cfg_attr(feature = "clap", arg(long, value_name = "TOPIC"))]
    pub gnss_heading_topic: Option<String>,
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
    /// The topic of a magnetometer whose heading `eskf` uses (sensor_msgs/MagneticField). Default: none.
    #[cfg_attr(feature = "clap", arg(long, value_name = "TOPIC"))]
    pub mag_topic: Option<String>,
    /// The angle from true north to magnetic north, in degrees, positive to the east, in place of the option `declination` of
    /// `eskf`; `auto` takes that of the World Magnetic Model at the first fix, or at --origin.
    #[cfg_attr(
        feature = "clap",
        arg(long, value_name = "DEGREES", allow_negative_numbers = true, requires = "mag_topic")
    )]
    pub declination: Option<Declination>,
    /// Start of the filters: `own` (as in a robot: from rest, or from the course), `truth`, or the topic of a pose
    /// (geometry_msgs/PoseWithCovarianceStamped, nav_msgs/Odometry). Default: /initialpose if there is one, or `own`.
    #[cfg_attr(feature = "clap", arg(long, value_name = "FROM"))]
    pub start: Option<StartFrom>,
    /// The place of a frame on the robot, m and degrees: FRAME=X,Y,Z or FRAME=X,Y,Z,ROLL,PITCH,YAW. FRAME may be the topic of a
    /// sensor, that of the IMU or of the truth. TOPIC=FRAME sets the frame whose pose or velocity a topic contains.
    #[cfg_attr(feature = "clap", arg(long, value_name = "FRAME=…", allow_hyphen_values = true))]
    pub mount: Vec<Mount>,
    /// The origin of the truth's world, in degrees and m above the ellipsoid. Default: that of the filter, its first fix.
    #[cfg_attr(feature = "clap", arg(long, value_name = "LATITUDE,LONGITUDE,HEIGHT", allow_hyphen_values = true))]
    pub origin: Option<Origin>,
    /// Standard deviations of a relative pose, m and rad. Default: from the growth of the covariance since the previous pose.
    #[cfg_attr(feature = "clap", arg(long, value_name = "TRANSLATION,ROTATION"))]
    pub relative_deviation: Option<RelativeDeviation>,
}

/// Source of the state in which filters start.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StartFrom {
    /// True pose.
    Truth,
    /// The robot's own start: from rest, or from the course in motion.
    Own,
    /// First pose of this topic.
    Topic(String),
}

impl FromStr for StartFrom {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Ok(match text {
            "truth" => Self::Truth,
            "own" | "align" => Self::Own,
            topic => Self::Topic(topic.to_owned()),
        })
    }
}

/// Heights of something on or above the Earth, m.
const HEIGHTS: std::ops::RangeInclusive<f64> = -1e4..=1e6;

/// Position of the world's origin on the Earth.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_out_of_their_range_are_refused() {
        assert!("48.1,11.6,520".parse::<Origin>().is_ok());
        for text in ["91,0,0", "48,11", "48,11,nan", "48,11,1e300"] {
            assert!(text.parse::<Origin>().is_err(), "{text}");
        }
        assert!("0.02,0.001".parse::<RelativeDeviation>().is_ok());
        for text in ["0,0.1", "0.1", "0.1,-1", "a,b", "1e-160,0.1", "0.1,1e200"] {
            assert!(text.parse::<RelativeDeviation>().is_err(), "{text}");
        }
    }
}
