//! Mass, appearance and extent of a link: `inertial`, `visual` and `collision`, as in URDF.

use super::Origin;
use crate::language::{
    CollisionField, CylinderField, InertiaField, InertialField, MaterialField, MeshField, SphereField, VisualField,
    Word, words,
};
use crate::parse::block::{Head, colon, semicolon};
use crate::parse::record::{array, record};
use crate::parse::{Notes, Quantity};
use proc_macro2::Ident;
use syn::LitStr;
use syn::parse::ParseStream;

/// `inertial: { mass: 1.2 kg, origin: { … }, inertia: { xx: 0.1 kg*m^2, yy: …, zz: …, xy: … } };`
#[derive(Clone, Debug)]
pub(crate) struct Inertial {
    pub(crate) word: Ident,
    pub(crate) origin: Option<Origin>,
    pub(crate) mass: Option<Quantity>,
    /// xx, xy, xz, yy, yz, zz
    pub(crate) inertia: [Option<Quantity>; 6],
}

/// `visual: { origin: { … }, box: [1 m, 2 m, 3 m], material: { … } };`, or a `collision`, which has no material.
#[derive(Clone, Debug)]
pub(crate) struct Shape {
    pub(crate) word: Ident,
    pub(crate) origin: Option<Origin>,
    /// All occurrences; there must be one.
    pub(crate) geometries: Vec<(Ident, Geometry)>,
    pub(crate) material: Option<Material>,
}

#[derive(Clone, Debug)]
pub(crate) enum Geometry {
    Box([Quantity; 3]),
    Cylinder { radius: Option<Quantity>, length: Option<Quantity> },
    Sphere { radius: Option<Quantity> },
    Mesh { file: Option<LitStr>, scale: Option<[Quantity; 3]> },
}

/// `material: { name: "blue", color: [0, 0, 1, 1], texture: "wood.png" }`
#[derive(Clone, Debug, Default)]
pub(crate) struct Material {
    pub(crate) name: Option<LitStr>,
    pub(crate) color: Option<[Quantity; 4]>,
    pub(crate) texture: Option<LitStr>,
}

impl Inertial {
    pub(super) fn parse(head: Head, input: ParseStream<'_>, notes: &mut Notes<'_>) -> syn::Result<Self> {
        colon(input, &head.word, "its fields in braces")?;
        let mut inertial = Self { word: head.word, origin: None, mass: None, inertia: Default::default() };
        record(&words::INERTIAL, input, notes, |field, word, _, input, notes| {
            match field {
                InertialField::Mass => inertial.mass = Some(notes.number(word, input)?),
                InertialField::Origin => {
                    inertial.origin = Some(Origin::parse_value(word, input, notes)?);
                }
                InertialField::Inertia => inertia(word, &mut inertial.inertia, input, notes)?,
            }
            Ok(())
        })?;
        semicolon(input, "`inertial`", notes);
        Ok(inertial)
    }
}

fn inertia(
    word: &Word,
    moments: &mut [Option<Quantity>; 6],
    input: ParseStream<'_>,
    notes: &mut Notes<'_>,
) -> syn::Result<()> {
    let [xx, xy, xz, yy, yz, zz] = moments;
    record(word, input, notes, |field, word, _, input, notes| {
        let slot = match field {
            InertiaField::Xx => &mut *xx,
            InertiaField::Xy => &mut *xy,
            InertiaField::Xz => &mut *xz,
            InertiaField::Yy => &mut *yy,
            InertiaField::Yz => &mut *yz,
            InertiaField::Zz => &mut *zz,
        };
        *slot = Some(notes.number(word, input)?);
        Ok(())
    })
}

impl Shape {
    pub(super) fn visual(head: Head, input: ParseStream<'_>, notes: &mut Notes<'_>) -> syn::Result<Self> {
        colon(input, &head.word, "its fields in braces")?;
        let mut shape = Self::new(head.word);
        record(&words::VISUAL, input, notes, |field, word, ident, input, notes| {
            match field {
                VisualField::Origin => {
                    shape.origin = Some(Origin::parse_value(word, input, notes)?);
                }
                VisualField::Box => shape.add(ident, Geometry::cuboid(word, input, notes)?),
                VisualField::Cylinder => shape.add(ident, Geometry::cylinder(word, input, notes)?),
                VisualField::Sphere => shape.add(ident, Geometry::sphere(word, input, notes)?),
                VisualField::Mesh => shape.add(ident, Geometry::mesh(word, input, notes)?),
                VisualField::Material => shape.material = Some(Material::parse(word, input, notes)?),
            }
            Ok(())
        })?;
        semicolon(input, "`visual`", notes);
        Ok(shape)
    }

    pub(super) fn collision(head: Head, input: ParseStream<'_>, notes: &mut Notes<'_>) -> syn::Result<Self> {
        colon(input, &head.word, "its fields in braces")?;
        let mut shape = Self::new(head.word);
        record(&words::COLLISION, input, notes, |field, word, ident, input, notes| {
            match field {
                CollisionField::Origin => {
                    shape.origin = Some(Origin::parse_value(word, input, notes)?);
                }
                CollisionField::Box => shape.add(ident, Geometry::cuboid(word, input, notes)?),
                CollisionField::Cylinder => shape.add(ident, Geometry::cylinder(word, input, notes)?),
                CollisionField::Sphere => shape.add(ident, Geometry::sphere(word, input, notes)?),
                CollisionField::Mesh => shape.add(ident, Geometry::mesh(word, input, notes)?),
            }
            Ok(())
        })?;
        semicolon(input, "`collision`", notes);
        Ok(shape)
    }

    fn new(word: Ident) -> Self {
        Self { word, origin: None, geometries: Vec::new(), material: None }
    }

    fn add(&mut self, word: &Ident, geometry: Geometry) {
        self.geometries.push((word.clone(), geometry));
    }
}

impl Geometry {
    fn cuboid(word: &'static Word, input: ParseStream<'_>, notes: &mut Notes<'_>) -> syn::Result<Self> {
        array(word, input, notes).map(Self::Box)
    }

    fn cylinder(word: &Word, input: ParseStream<'_>, notes: &mut Notes<'_>) -> syn::Result<Self> {
        let mut radius = None;
        let mut length = None;
        record(word, input, notes, |field, word, _, input, notes| {
            let slot = match field {
                CylinderField::Radius => &mut radius,
                CylinderField::Length => &mut length,
            };
            *slot = Some(notes.number(word, input)?);
            Ok(())
        })?;
        Ok(Self::Cylinder { radius, length })
    }

    fn sphere(word: &Word, input: ParseStream<'_>, notes: &mut Notes<'_>) -> syn::Result<Self> {
        let mut radius = None;
        record(word, input, notes, |field, word, _, input, notes| {
            match field {
                SphereField::Radius => radius = Some(notes.number(word, input)?),
            }
            Ok(())
        })?;
        Ok(Self::Sphere { radius })
    }

    fn mesh(word: &Word, input: ParseStream<'_>, notes: &mut Notes<'_>) -> syn::Result<Self> {
        let mut file = None;
        let mut scale = None;
        record(word, input, notes, |field, word, _, input, notes| {
            match field {
                MeshField::File => file = Some(input.parse()?),
                MeshField::Scale => scale = Some(array(word, input, notes)?),
            }
            Ok(())
        })?;
        Ok(Self::Mesh { file, scale })
    }
}

impl Material {
    fn parse(word: &Word, input: ParseStream<'_>, notes: &mut Notes<'_>) -> syn::Result<Self> {
        let mut material = Self::default();
        record(word, input, notes, |field, word, _, input, notes| {
            match field {
                MaterialField::Name => material.name = Some(input.parse()?),
                MaterialField::Color => material.color = Some(array(word, input, notes)?),
                MaterialField::Texture => material.texture = Some(input.parse()?),
            }
            Ok(())
        })?;
        Ok(material)
    }
}
