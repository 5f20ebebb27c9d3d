//! Rigid transforms: just enough to multiply out fixed joints at compile time.

/// A rotation followed by a translation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rigid {
    /// m
    pub(crate) translation: [f64; 3],
    /// Unit quaternion: w, x, y, z.
    pub(crate) rotation: [f64; 4],
}

impl Rigid {
    pub(crate) const IDENTITY: Self = Self { translation: [0.0; 3], rotation: [1.0, 0.0, 0.0, 0.0] };

    /// Converts a translation in m and the angles roll, pitch, yaw in rad about the fixed axes x, y, z in this order, as in URDF:
    /// R = Rz(yaw) Ry(pitch) Rx(roll).
    pub(crate) fn from_xyz_rpy(translation: [f64; 3], [roll, pitch, yaw]: [f64; 3]) -> Self {
        let about = |axis: usize, angle: f64| {
            let mut rotation = [(angle / 2.0).cos(), 0.0, 0.0, 0.0];
            rotation[axis] = (angle / 2.0).sin();
            rotation
        };
        let rotation = multiply(about(3, yaw), multiply(about(2, pitch), about(1, roll)));
        Self { translation, rotation }
    }

    /// `self ∘ inner`: a_from_c of a_from_b and b_from_c.
    pub(crate) fn then(self, inner: Self) -> Self {
        let moved = rotate(self.rotation, inner.translation);
        let translation = [0, 1, 2].map(|index| self.translation[index] + moved[index]);
        Self { translation, rotation: multiply(self.rotation, inner.rotation) }
    }

    pub(crate) fn inverse(self) -> Self {
        let rotation = conjugate(self.rotation);
        Self { translation: rotate(rotation, self.translation).map(|value| -value), rotation }
    }
}

fn conjugate([w, x, y, z]: [f64; 4]) -> [f64; 4] {
    [w, -x, -y, -z]
}

/// Hamilton's product.
fn multiply([aw, ax, ay, az]: [f64; 4], [bw, bx, by, bz]: [f64; 4]) -> [f64; 4] {
    [
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    ]
}

fn rotate(rotation: [f64; 4], [x, y, z]: [f64; 3]) -> [f64; 3] {
    let [_, x, y, z] = multiply(multiply(rotation, [0.0, x, y, z]), conjugate(rotation));
    [x, y, z]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    fn close(a: [f64; 3], b: [f64; 3]) -> bool {
        a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12)
    }

    #[test]
    fn roll_pitch_yaw_are_about_fixed_axes() {
        // Roll takes y to z; then yaw leaves it there.
        let rigid = Rigid::from_xyz_rpy([0.0; 3], [FRAC_PI_2, 0.0, FRAC_PI_2]);
        assert!(close(rotate(rigid.rotation, [0.0, 1.0, 0.0]), [0.0, 0.0, 1.0]));
        assert!(close(rotate(rigid.rotation, [1.0, 0.0, 0.0]), [0.0, 1.0, 0.0]));
    }

    #[test]
    fn a_transform_and_its_inverse_cancel() {
        let rigid = Rigid::from_xyz_rpy([1.0, -2.0, 3.0], [0.3, -0.4, 0.5]);
        let same = rigid.then(rigid.inverse());
        assert!(close(same.translation, [0.0; 3]));
        assert!((same.rotation[0] - 1.0).abs() < 1e-12);
    }

    #[test]
    fn transforms_apply_from_the_inside() {
        let a_from_b = Rigid::from_xyz_rpy([1.0, 0.0, 0.0], [0.0, 0.0, FRAC_PI_2]);
        let b_from_c = Rigid::from_xyz_rpy([2.0, 0.0, 0.0], [0.0; 3]);
        assert!(close(a_from_b.then(b_from_c).translation, [1.0, 2.0, 0.0]));
    }
}
