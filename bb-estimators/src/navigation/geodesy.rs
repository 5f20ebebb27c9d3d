//! Positions on the Earth, and the local frames that filters work in.
//!
//! The WGS 84 conversions are those of the crate `geoconv`: closed forms, by B. R. Bowring, "Transformation from spatial to
//! geographical coordinates", Survey Review 23(181), 1976. A round trip agrees to 0.1 mm up to 50 km above the ellipsoid.

use geoconv::{CoordinateSystem, Enu, Lle, Meters, Radians, Wgs84, Xyz};
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::math::{cos, sin};
use crate::navigation::numbers::{FARTHEST_FROM_ORIGIN, HEIGHTS};

/// A position on the Earth, WGS 84.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geodetic {
    /// Positive to the north, rad.
    pub latitude: f64,
    /// Positive to the east, rad.
    pub longitude: f64,
    /// Height above the ellipsoid, m; not above sea level.
    pub height: f64,
}

impl Geodetic {
    /// Creates a position from degrees and metres.
    pub fn from_degrees(latitude: f64, longitude: f64, height: f64) -> Self {
        Self { latitude: latitude.to_radians(), longitude: longitude.to_radians(), height }
    }

    /// Coordinates in the Earth-fixed frame, m: x through Greenwich on the equator, z through the north pole.
    pub fn earth_centred(&self) -> Vector3<f64> {
        let Xyz { x, y, z } = Wgs84::lle_to_xyz(&self.lle());
        Vector3::new(x.as_float(), y.as_float(), z.as_float())
    }

    /// The position with these coordinates in the Earth-fixed frame, m.
    pub fn from_earth_centred(position: &Vector3<f64>) -> Self {
        let metres = |x: f64| Meters::new(x);
        Self::of(&Wgs84::xyz_to_lle(&Xyz { x: metres(position.x), y: metres(position.y), z: metres(position.z) }))
    }

    /// Returns whether it is on or above the Earth. NaN is not.
    pub(super) fn is_possible(&self) -> bool {
        self.latitude.abs() <= core::f64::consts::FRAC_PI_2
            && self.longitude.abs() <= core::f64::consts::TAU
            && HEIGHTS.contains(&self.height)
    }

    fn lle(&self) -> Lle<Wgs84, Radians> {
        Lle::new(Radians::new(self.latitude), Radians::new(self.longitude), Meters::new(self.height))
    }

    fn of(position: &Lle<Wgs84, Radians>) -> Self {
        Self {
            latitude: position.latitude.as_float(),
            longitude: position.longitude.as_float(),
            height: position.elevation.as_float(),
        }
    }
}

/// A local tangent frame: x east, y north, z up at its origin.
///
/// Its axes are straight: 10 km away, the ground is 8 m below its xy plane and the vertical is tilted by 1.6 mrad. A filter
/// should move to a new frame before that; see [`EskfFilter::move_world`](super::EskfFilter::move_world).
///
/// ```
/// use bb_estimators::navigation::{Geodetic, LocalFrame};
///
/// let frame = LocalFrame::new(Geodetic::from_degrees(48.0, 11.0, 500.0));
/// let north = frame.position(&Geodetic::from_degrees(48.001, 11.0, 500.0));
/// assert!((north.y - 111.2).abs() < 0.1 && north.x.abs() < 1e-9);
/// assert!((frame.geodetic(&north).latitude - 48.001_f64.to_radians()).abs() < 1e-12);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalFrame {
    origin: Geodetic,
}

impl LocalFrame {
    /// Creates the frame with the given origin.
    pub fn new(origin: Geodetic) -> Self {
        Self { origin }
    }

    /// The origin of the frame.
    pub fn origin(&self) -> &Geodetic {
        &self.origin
    }

    /// Converts a geodetic position to frame coordinates, m.
    pub fn position(&self, position: &Geodetic) -> Vector3<f64> {
        let Enu { east, north, up } = Wgs84::lle_to_enu(&self.origin.lle(), &position.lle());
        Vector3::new(east.as_float(), north.as_float(), up.as_float())
    }

    /// Converts frame coordinates, m, to a geodetic position.
    pub fn geodetic(&self, position: &Vector3<f64>) -> Geodetic {
        let metres = |x: f64| Meters::new(x);
        let enu = Enu { east: metres(position.x), north: metres(position.y), up: metres(position.z) };
        Geodetic::of(&Wgs84::enu_to_lle(&self.origin.lle(), &enu))
    }

    /// The transformation from this frame to `other`.
    pub fn other_from_self(&self, other: &Self) -> Isometry3<f64> {
        let rotation = other.earth_from_self().inverse() * self.earth_from_self();
        let between = self.origin.earth_centred() - other.origin.earth_centred();
        let translation = other.earth_from_self().inverse() * between;
        Isometry3::from_parts(Translation3::from(translation), UnitQuaternion::from_rotation_matrix(&rotation))
    }

    /// The frame at a position that is too far from the origin of this one, at the height of that origin; `None` at any other.
    pub(super) fn moved_on(&self, position: &Vector3<f64>) -> Option<Self> {
        let is_far = position.xy().norm() > FARTHEST_FROM_ORIGIN;
        is_far.then(|| Self::new(Geodetic { height: self.origin.height, ..self.geodetic(position) }))
    }

    /// The rotation from this frame to the Earth-fixed frame.
    fn earth_from_self(&self) -> Rotation3<f64> {
        let (sin_latitude, cos_latitude) = (sin(self.origin.latitude), cos(self.origin.latitude));
        let (sin_longitude, cos_longitude) = (sin(self.origin.longitude), cos(self.origin.longitude));
        let east = Vector3::new(-sin_longitude, cos_longitude, 0.0);
        let up = Vector3::new(cos_latitude * cos_longitude, cos_latitude * sin_longitude, sin_latitude);
        Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[east, up.cross(&east), up]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bb_tests::laws;
    use proptest::prelude::*;

    fn positions() -> impl Strategy<Value = Geodetic> {
        (-90.0..=90.0, -180.0..180.0, -400.0..20_000.0)
            .prop_map(|(latitude, longitude, height)| Geodetic::from_degrees(latitude, longitude, height))
    }

    laws! {
        #[test]
        fn there_and_back_is_the_same_place(position in positions(), origin in positions()) {
            let frame = LocalFrame::new(origin);
            let back = frame.geodetic(&frame.position(&position));
            prop_assert!((back.earth_centred() - position.earth_centred()).norm() < 1e-4);
            let back = Geodetic::from_earth_centred(&position.earth_centred());
            prop_assert!((back.earth_centred() - position.earth_centred()).norm() < 1e-4);
        }

        #[test]
        fn a_frame_takes_positions_to_another(position in positions(), from in positions(), to in positions()) {
            let (from, to) = (LocalFrame::new(from), LocalFrame::new(to));
            let moved = from.other_from_self(&to).transform_point(&from.position(&position).into());
            // The frames are up to 13,000 km apart.
            prop_assert!((moved.coords - to.position(&position)).norm() < 1e-7);
        }

        /// A robot that drives 1,000 km, with a new frame every 5 km.
        #[test]
        fn a_thousand_kilometres_lose_no_centimetre(start in positions(), course in 0.0..core::f64::consts::TAU) {
            let first = LocalFrame::new(start);
            let (mut frame, mut first_from_frame) = (first, Isometry3::identity());
            let step = Vector3::new(course.cos(), course.sin(), 0.0) * 5000.0;
            for _ in 0..200 {
                let next = LocalFrame::new(frame.geodetic(&step));
                first_from_frame *= next.other_from_self(&frame);
                frame = next;
            }
            let position = first_from_frame.translation.vector;
            prop_assert!((position - first.position(frame.origin())).norm() < 1e-3);
            prop_assert!((first.geodetic(&position).earth_centred() - frame.origin().earth_centred()).norm() < 1e-2);
        }
    }

    /// Points at the ends of the ellipsoid's semi-axes.
    #[test]
    fn known_places() {
        let pole = Geodetic::from_degrees(90.0, 0.0, 0.0).earth_centred();
        assert!((pole - Vector3::new(0.0, 0.0, 6_356_752.314_245)).norm() < 1e-6);
        let equator = Geodetic::from_degrees(0.0, 90.0, 1.0).earth_centred();
        assert!((equator - Vector3::new(0.0, 6_378_138.0, 0.0)).norm() < 1e-6);
    }
}
