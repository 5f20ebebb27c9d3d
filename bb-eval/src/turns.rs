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

impl Turn {
    /// Returns whether it is more about the vertical than `least` degrees, and than its spread may be.
    pub(crate) fn is_turned(&self, least: f64) -> bool {
        let angle = heading(&self.rotation).abs();
        angle.to_degrees() > least && self.spread * LEFT < angle
    }

    /// Says that the truth's world is turned by it about the vertical, and what to do.
    pub(crate) fn of_world(&self) -> String {
        format!(
            "the truth's world is turned {} to the filter's, but for {:.1} deg: --align heading, or --declination for a compass",
            about_up(&self.rotation),
            self.spread.to_degrees()
        )
    }
}

fn about_up(rotation: &UnitQuaternion<f64>) -> String {
    format!("about the vertical by {:.1} deg", heading(rotation).to_degrees())
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

/// The angle of a rotation's part about the vertical, rad, from -π to π.
pub(crate) fn heading(rotation: &UnitQuaternion<f64>) -> f64 {
    2.0 * (rotation.k * rotation.w.signum()).atan2(rotation.w.abs())
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

/// Error of an orientation, degrees, above which any constant rotation is sought.
const LARGE: f64 = 15.0;

/// Angles about the vertical, degrees, above which a constant one counts as a turn of the world: where the motion shows the heading, and where
/// a compass alone does, which may be off by as much.
pub(crate) const TURNED: f64 = 2.0;
pub(crate) const TURNED_BY_COMPASS: f64 = 5.0;

/// Returns the constant rotation that explains the error of the orientation: a turn about the vertical of several times its spread, or
/// any that leaves less than a third of a large error. `imu` is its name and place, `least` the angle of a turn in degrees. `is_world` says whether what else is known of the world allows that it is
/// turned.
pub(crate) fn cause(
    rms: f64,
    of_body: &Turns,
    of_world: &Turns,
    (imu, base_from_imu): (&str, &Isometry3<f64>),
    align: Align,
    least: f64,
    is_world: impl Fn(&UnitQuaternion<f64>) -> bool,
) -> Option<String> {
    let explains = |turn: &Turn| rms.to_degrees() > LARGE && turn.spread * LEFT < rms;
    let body = of_body.mean().filter(explains);
    let world = of_world.mean();
    let upright = of_world.heading().filter(|turn| turn.is_turned(least)).zip(world).filter(|(upright, world)| {
        world.rotation.angle_to(&upright.rotation) < world.spread.max(0.1)
            && body.is_none_or(|body| world.spread <= body.spread)
    });
    let said = |turn: &Turn| format!("{:.1} deg", turn.rotation.angle().to_degrees());
    if let Some((upright, _)) = upright.filter(|_| align == Align::None) {
        return Some(match is_world(&upright.rotation) {
            true => upright.of_world(),
            false => format!(
                "the filter's heading is turned {} throughout while its positions agree with the truth: the filter is wrong, \
                 not the truth's world; see --mount for its IMU, and --declination for a compass",
                about_up(&upright.rotation)
            ),
        });
    }
    if let Some(body) = body {
        let place = base_from_imu.translation.vector;
        let mount = |rotation: &UnitQuaternion<f64>| {
            format!("--mount {imu}={},{},{},{}", place.x, place.y, place.z, angles(rotation))
        };
        let whole = body.rotation * base_from_imu.rotation;
        let (square, rest) = near_square(&whole);
        let least = body.spread.max(least.to_radians());
        let is_upright = rest.axis().is_some_and(|axis| axis.z.abs() > 0.95) && rest.angle() > least;
        let split = (align == Align::None && is_upright && is_world(&rest)).then(|| {
            format!(
                "; or it is mounted at right angles in a world that is turned {} ({}, then --align heading, or --declination for a \
                 compass)",
                about_up(&rest),
                mount(&square)
            )
        });
        return Some(format!(
            "the IMU is mounted at {} to the truth, which leaves {:.1} of {:.1} deg: {}{}",
            said(&body),
            body.spread.to_degrees(),
            rms.to_degrees(),
            mount(&whole),
            split.unwrap_or_default()
        ));
    }
    let world = world.filter(|world| explains(world) && align == Align::None && is_world(&world.rotation))?;
    Some(format!(
        "the truth's world is turned by {} to the filter's, which leaves {:.1} of {:.1} deg: --align full",
        said(&world),
        world.spread.to_degrees(),
        rms.to_degrees()
    ))
}

/// The nearest rotation by right angles, and the one that is left of it.
fn near_square(rotation: &UnitQuaternion<f64>) -> (UnitQuaternion<f64>, UnitQuaternion<f64>) {
    let right = |count: u32| f64::from(count) * std::f64::consts::FRAC_PI_2;
    let all = (0..64).map(|i| UnitQuaternion::from_euler_angles(right(i / 16), right(i / 4 % 4), right(i % 4)));
    let nearest = all.min_by(|a, b| a.angle_to(rotation).total_cmp(&b.angle_to(rotation))).unwrap_or_default();
    (nearest, rotation * nearest.inverse())
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
            cause(2.6, &of_body, &of_world, ("imu", &Isometry3::identity()), Align::None, TURNED, |_| allows)
                .expect("it is large")
        };
        assert!(said(true).contains("--align heading"), "{}", said(true));
        assert!(
            said(false).starts_with("the filter's heading is turned about the vertical by 149.0 deg"),
            "{}",
            said(false)
        );
    }

    /// The error of a cart on level ground whose estimates err at random by half a degree.
    fn of_cart(world: f64, mount: f64) -> Option<String> {
        let (mut of_body, mut of_world) = (Turns::default(), Turns::default());
        let about_up = |degrees: f64| UnitQuaternion::from_euler_angles(0.0, 0.0, degrees.to_radians());
        for index in 0..100 {
            let truth = UnitQuaternion::from_euler_angles(0.0, 0.02 * f64::from(index % 3), 0.1 * f64::from(index));
            let error = if index % 2 == 0 { 0.5 } else { -0.5 };
            let estimate = about_up(world + error) * truth * about_up(mount);
            of_body.add(&(truth.inverse() * estimate));
            of_world.add(&(estimate * truth.inverse()));
        }
        let rms = (world + mount).to_radians().abs();
        cause(rms, &of_body, &of_world, ("imu", &Isometry3::identity()), Align::None, TURNED, |_| true)
    }

    #[test]
    fn a_world_turned_by_a_few_degrees_is_named() {
        for world in [4.0, -4.0] {
            let said = of_cart(world, 0.0).expect("it is constant");
            let lead = format!("the truth's world is turned about the vertical by {world:.1} deg");
            assert!(said.starts_with(&lead) && said.contains("--align heading, or --declination"), "{said}");
        }
        assert_eq!(of_cart(0.0, 0.0), None);
        assert_eq!(of_cart(1.4, 0.0), None, "compasses err by as much");
    }

    #[test]
    fn of_a_mounting_near_right_angles_the_rest_may_be_the_world() {
        for (world, mount, whole) in [(4.4, 90.0, "94.40"), (-4.4, -90.0, "-94.40"), (4.4, 180.0, "-175.60")] {
            let said = of_cart(world, mount).expect("it is large");
            let square = if mount == 180.0 { 180.0 } else { mount };
            assert!(said.contains(&format!(",{whole}; or")), "{said}");
            assert!(said.contains(&format!("turned about the vertical by {world:.1} deg")), "{said}");
            assert!(said.contains(&format!("0.00,{square:.2}, then --align heading")), "{said}");
        }
        let said = of_cart(1.4, 90.0).expect("it is large");
        assert!(!said.contains("; or"), "{said}");
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
