//! Mass, appearance and extent of a link: URDF's `inertial`, `visual` and `collision`.

use super::Origin;

/// Mass and moments of inertia.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inertial {
    /// Takes points from the frame of the moments, at the centre of mass, to the link's.
    pub link_from_inertia: Origin,
    /// Mass, kg.
    pub mass: f64,
    /// Moments about the centre of mass, kg·m²: xx, xy, xz, yy, yz, zz.
    pub inertia: [f64; 6],
}

/// A shape that viewers draw.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Visual {
    /// Takes points from the shape's frame to the link's.
    pub link_from_shape: Origin,
    /// The shape.
    pub geometry: Geometry,
    /// Colour; `None` leaves it to the viewer.
    pub material: Option<Material>,
}

/// A shape for collision checks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Collision {
    /// Takes points from the shape's frame to the link's.
    pub link_from_shape: Origin,
    /// The shape.
    pub geometry: Geometry,
}

/// A shape about the origin of its frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Geometry {
    /// A box, with its lengths along x, y and z, m.
    Box([f64; 3]),
    /// A cylinder along z.
    Cylinder {
        /// Radius, m.
        radius: f64,
        /// Length, m.
        length: f64,
    },
    /// A sphere.
    Sphere {
        /// Radius, m.
        radius: f64,
    },
    /// A mesh in a file.
    Mesh {
        /// Name of the file, as URDF has it: `package://…` or a path.
        file: &'static str,
        /// Factors along x, y and z.
        scale: [f64; 3],
    },
}

/// A colour by name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Name, empty if it has none.
    pub name: &'static str,
    /// Red, green, blue, opacity, each from 0 to 1.
    pub color: Option<[f64; 4]>,
    /// The file of its texture.
    pub texture: Option<&'static str>,
}
