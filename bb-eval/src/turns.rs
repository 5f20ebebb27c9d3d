//! The mean of rotations, and their spread about it.

use bb_core::nalgebra::{Isometry3, Matrix4, Quaternion, SymmetricEigen, UnitQuaternion, Vector3};
use std::str::FromStr;

/// Rotation that is taken from the truth before it is compared, whose world has axes of its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Align {
    /// No rotation: the truth is in east, north, up.
    #[default]
    None,
    /// A turn about the vertical, and for navigation the origin.
    Heading,
    /// Any rotation, and for navigation the origin.
    Full,
}

impl FromStr for Align {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "none" => Ok(Self::None),
            "heading" => Ok(Self::Heading),
            "full" => Ok(Self::Full),
            _ => Err(format!("`{text}` is no alignment; choose none, heading or full")),
        }
    }
}

/// A mean rotation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn {
    /// The mean.
    pub rotation: UnitQuaternion<f64>,
    /// Root mean square of the angles to it, rad.
    pub spread: f64,
}

/// Rotations, gathered one by one.
///
/// F. L. Markley, Y. Cheng, J. L. Crassidis, Y. Oshman, "Averaging quaternions", Journal of Guidance, Control, and Dynamics
/// 30(4), 2007.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Turns {
    outer: Matrix4<f64>,
    about_up: (f64, f64),
    count: u64,
}

impl Turns {
    /// Adds one.
    pub fn add(&mut self, rotation: &UnitQuaternion<f64>) {
        self.outer += rotation.coords * rotation.coords.transpose();
        let heading = heading(rotation);
        self.about_up = (self.about_up.0 + heading.cos(), self.about_up.1 + heading.sin());
        self.count += 1;
    }

    /// The mean; `None` without any.
    pub fn mean(&self) -> Option<Turn> {
        let eigen = (self.count > 0).then(|| SymmetricEigen::new(self.outer))?;
        let (index, largest) = eigen.eigenvalues.argmax();
        let coords = eigen.eigenvectors.column(index).into_owned();
        let rotation = UnitQuaternion::new_normalize(Quaternion::from_vector(coords));
        // The mean of the squared cosine of half the angle.
        let spread = 2.0 * (largest / self.count as f64).clamp(0.0, 1.0).sqrt().acos();
        Some(Turn { rotation, spread })
    }

    /// The mean of the parts about the vertical.
    pub fn heading(&self) -> Option<Turn> {
        let (cos, sin) = self.about_up;
        let length = cos.hypot(sin) / self.count as f64;
        let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), sin.atan2(cos));
        (self.count > 0).then(|| Turn { rotation, spread: (-2.0 * length.min(1.0).ln()).sqrt() })
    }

    /// The mean that an alignment takes away.
    pub fn of(&self, align: Align) -> Option<Turn> {
        match align {
            Align::None => None,
            Align::Heading => self.heading(),
            Align::Full => self.mean(),
        }
    }
}

/// The angle of a rotation's part about the vertical, rad.
pub(crate) fn heading(rotation: &UnitQuaternion<f64>) -> f64 {
    2.0 * rotation.k.atan2(rotation.w)
}

/// Roll, pitch and yaw, in whole hundredths of a degree: as `--mount` takes them.
pub(crate) fn angles(rotation: &UnitQuaternion<f64>) -> String {
    let (roll, pitch, yaw) = rotation.euler_angles();
    let shown = |angle: f64| format!("{:.2}", angle.to_degrees() + 0.0);
    let plain = |text: String| if text == "-0.00" { "0.00".to_owned() } else { text };
    [roll, pitch, yaw].map(|angle| plain(shown(angle))).join(",")
}

/// Factor by which an error must shrink without a constant for that constant to explain it.
pub(crate) const LEFT: f64 = 3.0;

/// Returns the constant rotation that explains a large error of the orientation: one that leaves less than a third of it. `is_world` says
/// whether what else is known of the world allows that it is turned.
pub(crate) fn cause(
    rms: f64,
    of_body: &Turns,
    of_world: &Turns,
    base_from_imu: &Isometry3<f64>,
    imu: &str,
    align: Align,
    is_world: impl Fn(&UnitQuaternion<f64>) -> bool,
) -> Option<String> {
    const LARGE: f64 = 15.0;
    if rms.to_degrees() < LARGE {
        return None;
    }
    let explains = |turn: &Turn| turn.spread * LEFT < rms;
    let body = of_body.mean().filter(explains);
    let heading = of_world.heading().zip(of_world.mean()).filter(|(heading, mean)| {
        explains(mean) && mean.rotation.angle_to(&heading.rotation) < mean.spread.max(0.1)
    });
    let world = of_world.mean().filter(explains);
    let said = |turn: &Turn| format!("{:.1} deg", turn.rotation.angle().to_degrees());
    match (body, heading, world) {
        (_, Some((heading, mean)), _)
            if align == Align::None && body.is_none_or(|body| mean.spread <= body.spread) =>
        {
            if !is_world(&heading.rotation) {
                return Some(format!(
                    "the filter's heading is off by {:.1} deg throughout while its positions agree with the truth: the filter is wrong, \
                     not the truth's world",
                    self::heading(&heading.rotation).to_degrees()
                ));
            }
            Some(format!(
                "the truth's world is turned about the vertical by {:.1} deg to the filter's, which leaves {:.1} of {:.1} deg: \
                 --align heading, or --declination for a compass",
                self::heading(&heading.rotation).to_degrees(),
                mean.spread.to_degrees(),
                rms.to_degrees()
            ))
        }
        (Some(body), ..) => {
            let mount = base_from_imu.translation.vector;
            Some(format!(
                "the IMU is mounted at {} to the truth, which leaves {:.1} of {:.1} deg: --mount {imu}={},{},{},{}",
                said(&body),
                body.spread.to_degrees(),
                rms.to_degrees(),
                mount.x,
                mount.y,
                mount.z,
                angles(&(body.rotation * base_from_imu.rotation))
            ))
        }
        (None, _, Some(world)) if align == Align::None && is_world(&world.rotation) => Some(format!(
            "the truth's world is turned by {} to the filter's, which leaves {:.1} of {:.1} deg: --align full",
            said(&world),
            world.spread.to_degrees(),
            rms.to_degrees()
        )),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_world_is_named_only_if_positions_allow_it() {
        let off = UnitQuaternion::from_euler_angles(0.0, 0.0, 2.6);
        let (mut of_body, mut of_world) = (Turns::default(), Turns::default());
        for index in 0..100 {
            let truth = UnitQuaternion::from_euler_angles(0.3 * f64::from(index % 7), 0.2, 0.1 * f64::from(index));
            let estimate = off * truth;
            of_body.add(&(truth.inverse() * estimate));
            of_world.add(&(estimate * truth.inverse()));
        }
        let said = |allows: bool| {
            cause(2.6, &of_body, &of_world, &Isometry3::identity(), "imu", Align::None, |_| allows)
                .expect("it is large")
        };
        assert!(said(true).contains("--align heading"), "{}", said(true));
        assert!(said(false).starts_with("the filter's heading is off by 149.0 deg"), "{}", said(false));
    }

    #[test]
    fn the_mean_and_the_spread_are_those_of_the_rotations() {
        let middle = UnitQuaternion::from_euler_angles(0.4, -0.2, 2.9);
        let mut turns = Turns::default();
        for index in 0..1000 {
            let angle = if index % 2 == 0 { 0.05 } else { -0.05 };
            let rotation = middle * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), angle);
            // A quaternion and its negative are one rotation.
            turns.add(&if index % 3 == 0 {
                UnitQuaternion::new_unchecked(-rotation.into_inner())
            } else {
                rotation
            });
        }
        let mean = turns.mean().expect("there are some");
        assert!(mean.rotation.angle_to(&middle) < 1e-9 && (mean.spread - 0.05).abs() < 1e-4, "{mean:?}");
        let mut headings = Turns::default();
        for angle in [3.1, 3.2] {
            headings.add(&UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle));
        }
        let mean = headings.heading().expect("there are some");
        assert!(
            (heading(&mean.rotation).abs() - 3.15).abs() < 1e-3 || (heading(&mean.rotation) + 3.133).abs() < 1e-2
        );
        assert!((mean.spread - 0.05).abs() < 1e-3);
        assert_eq!(Turns::default().mean(), None);
    }
}
