//! What a link weighs, looks like and occupies: `inertial`, `visual` and `collision`, with URDF's meaning.

use super::block::{Head, colon, semicolon};
use super::record::{array, record};
use super::{Origin, Quantity};
use crate::diagnostics::Diagnostics;
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
    /// All that were written; there must be one.
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

/// The moments of inertia, in the order in which they are kept.
const MOMENTS: [&str; 6] = ["xx", "xy", "xz", "yy", "yz", "zz"];

impl Inertial {
    pub(super) fn parse(head: Head, input: ParseStream<'_>, diagnostics: &mut Diagnostics) -> syn::Result<Self> {
        colon(input, &head.word, "its fields in braces")?;
        let mut inertial = Self { word: head.word, origin: None, mass: None, inertia: Default::default() };
        record(
            input,
            "{ mass: 1.2 kg, inertia: { xx: 0.1 kg*m^2, yy: 0.1 kg*m^2, zz: 0.1 kg*m^2 } }",
            &["mass", "origin", "inertia"],
            |field, input| {
                match &*field.to_string() {
                    "mass" => inertial.mass = Some(Quantity::parse(input)?),
                    "origin" => inertial.origin = Some(Origin::parse_value(field.clone(), input)?),
                    _ => record(
                        input,
                        "{ xx: 0.1 kg*m^2, yy: 0.1 kg*m^2, zz: 0.1 kg*m^2 }",
                        &MOMENTS,
                        |moment, input| {
                            let quantity = Quantity::parse(input)?;
                            for (slot, name) in inertial.inertia.iter_mut().zip(MOMENTS) {
                                if moment == name {
                                    *slot = Some(quantity.clone());
                                }
                            }
                            Ok(())
                        },
                    )?,
                }
                Ok(())
            },
        )?;
        semicolon(input, "`inertial`", diagnostics);
        Ok(inertial)
    }
}

impl Shape {
    pub(super) fn parse(head: Head, input: ParseStream<'_>, diagnostics: &mut Diagnostics) -> syn::Result<Self> {
        colon(input, &head.word, "its fields in braces")?;
        let fields = ["origin", "box", "cylinder", "sphere", "mesh", "material"];
        // A collision is not to be seen.
        let fields = if head.word == "visual" { &fields[..] } else { &fields[..5] };
        let mut shape = Self { word: head.word, origin: None, geometries: Vec::new(), material: None };
        record(input, "{ box: [0.4 m, 0.3 m, 0.1 m] }", fields, |field, input| {
            match &*field.to_string() {
                "origin" => shape.origin = Some(Origin::parse_value(field.clone(), input)?),
                "material" => shape.material = Some(Material::parse(input)?),
                kind => shape.geometries.push((field.clone(), Geometry::parse(kind, input)?)),
            }
            Ok(())
        })?;
        semicolon(input, &format!("`{}`", shape.word), diagnostics);
        Ok(shape)
    }
}

impl Geometry {
    fn parse(kind: &str, input: ParseStream<'_>) -> syn::Result<Self> {
        let (mut radius, mut length, mut file, mut scale) = (None, None, None, None);
        match kind {
            "box" => return array(input).map(Self::Box),
            "cylinder" => {
                record(input, "{ radius: 0.1 m, length: 0.3 m }", &["radius", "length"], |field, input| {
                    let slot = if field == "radius" { &mut radius } else { &mut length };
                    *slot = Some(Quantity::parse(input)?);
                    Ok(())
                })?
            }
            "sphere" => record(input, "{ radius: 0.1 m }", &["radius"], |_, input| {
                radius = Some(Quantity::parse(input)?);
                Ok(())
            })?,
            _ => record(input, "{ file: \"base.stl\" }", &["file", "scale"], |field, input| {
                if field == "file" {
                    file = Some(input.parse()?);
                } else {
                    scale = Some(array(input)?);
                }
                Ok(())
            })?,
        }
        Ok(match kind {
            "cylinder" => Self::Cylinder { radius, length },
            "sphere" => Self::Sphere { radius },
            _ => Self::Mesh { file, scale },
        })
    }
}

impl Material {
    fn parse(input: ParseStream<'_>) -> syn::Result<Self> {
        let mut material = Self::default();
        record(input, "{ color: [0, 0, 1, 1] }", &["name", "color", "texture"], |field, input| {
            match &*field.to_string() {
                "name" => material.name = Some(input.parse()?),
                "color" => material.color = Some(array(input)?),
                _ => material.texture = Some(input.parse()?),
            }
            Ok(())
        })?;
        Ok(material)
    }
}
