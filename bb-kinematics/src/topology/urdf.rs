//! A topology as URDF. Numbers are written so that they read back unchanged.

use super::{Collision, Geometry, Inertial, Joint, Link, Material, Origin, Topology, Visual};
use std::fmt::{Display, Write};

impl Topology {
    /// The robot as a URDF file. URDF has no sensors and estimators; they are left out.
    pub fn to_urdf(&self, robot: &str) -> String {
        let mut xml = Xml::default();
        xml.line("<?xml version=\"1.0\"?>");
        xml.open(&format!("robot name={}", quoted(robot)));
        for link in self.links {
            xml.link(link);
        }
        for joint in self.joints {
            xml.joint(joint, self);
        }
        for joint in self.joints {
            xml.transmission(joint);
        }
        xml.close("robot");
        xml.text
    }
}

#[derive(Default)]
struct Xml {
    text: String,
    depth: usize,
}

impl Xml {
    fn line(&mut self, line: &str) {
        // Writing to a string cannot fail.
        let _ = writeln!(self.text, "{:1$}{line}", "", 2 * self.depth);
    }

    fn open(&mut self, tag: &str) {
        self.line(&format!("<{tag}>"));
        self.depth += 1;
    }

    fn close(&mut self, tag: &str) {
        self.depth -= 1;
        self.line(&format!("</{tag}>"));
    }

    fn empty(&mut self, tag: &str) {
        self.line(&format!("<{tag}/>"));
    }

    fn link(&mut self, link: &Link) {
        let tag = format!("link name={}", quoted(link.name));
        if link.inertial.is_none() && link.visuals.is_empty() && link.collisions.is_empty() {
            return self.empty(&tag);
        }
        self.open(&tag);
        if let Some(inertial) = &link.inertial {
            self.inertial(inertial);
        }
        for Visual { link_from_shape, geometry, material } in link.visuals {
            self.open("visual");
            self.origin(link_from_shape);
            self.geometry(geometry);
            if let Some(material) = material {
                self.material(material);
            }
            self.close("visual");
        }
        for Collision { link_from_shape, geometry } in link.collisions {
            self.open("collision");
            self.origin(link_from_shape);
            self.geometry(geometry);
            self.close("collision");
        }
        self.close("link");
    }

    fn inertial(&mut self, inertial: &Inertial) {
        let Inertial { link_from_inertia, mass, inertia: [xx, xy, xz, yy, yz, zz] } = inertial;
        self.open("inertial");
        self.origin(link_from_inertia);
        self.empty(&format!("mass value=\"{mass}\""));
        self.empty(&format!(
            "inertia ixx=\"{xx}\" ixy=\"{xy}\" ixz=\"{xz}\" iyy=\"{yy}\" iyz=\"{yz}\" izz=\"{zz}\""
        ));
        self.close("inertial");
    }

    fn geometry(&mut self, geometry: &Geometry) {
        self.open("geometry");
        self.empty(&match geometry {
            Geometry::Box(size) => format!("box size=\"{}\"", joined(size)),
            Geometry::Cylinder { radius, length } => format!("cylinder radius=\"{radius}\" length=\"{length}\""),
            Geometry::Sphere { radius } => format!("sphere radius=\"{radius}\""),
            Geometry::Mesh { file, scale } => {
                format!("mesh filename={} scale=\"{}\"", quoted(file), joined(scale))
            }
        });
        self.close("geometry");
    }

    fn material(&mut self, material: &Material) {
        let tag = format!("material name={}", quoted(material.name));
        if material.color.is_none() && material.texture.is_none() {
            return self.empty(&tag);
        }
        self.open(&tag);
        if let Some(color) = &material.color {
            self.empty(&format!("color rgba=\"{}\"", joined(color)));
        }
        if let Some(texture) = material.texture {
            self.empty(&format!("texture filename={}", quoted(texture)));
        }
        self.close("material");
    }

    fn joint(&mut self, joint: &Joint, topology: &Topology) {
        let name_of = |link: usize| topology.links.get(link).map_or("", |link| link.name);
        self.open(&format!("joint name={} type=\"{}\"", quoted(joint.name), joint.kind.name()));
        self.origin(&joint.parent_from_joint);
        self.empty(&format!("parent link={}", quoted(name_of(joint.parent))));
        self.empty(&format!("child link={}", quoted(name_of(joint.child))));
        if let Some(axis) = &joint.axis {
            self.empty(&format!("axis xyz=\"{}\"", joined(axis)));
        }
        if let Some(limit) = &joint.limit {
            let values = [
                ("lower", limit.lower),
                ("upper", limit.upper),
                ("effort", limit.effort),
                ("velocity", limit.velocity),
            ];
            let values = values.iter().filter_map(|(name, value)| Some(format!(" {name}=\"{}\"", (*value)?)));
            self.empty(&format!("limit{}", values.collect::<String>()));
        }
        if let Some(dynamics) = &joint.dynamics {
            self.empty(&format!("dynamics damping=\"{}\" friction=\"{}\"", dynamics.damping, dynamics.friction));
        }
        if let Some(mimic) = &joint.mimic {
            let followed = topology.joints.get(mimic.joint).map_or("", |joint| joint.name);
            let (multiplier, offset) = (mimic.multiplier, mimic.offset);
            self.empty(&format!(
                "mimic joint={} multiplier=\"{multiplier}\" offset=\"{offset}\"",
                quoted(followed)
            ));
        }
        self.close("joint");
    }

    fn transmission(&mut self, joint: &Joint) {
        let Some(transmission) = &joint.transmission else { return };
        self.open(&format!("transmission name={}", quoted(&format!("{}_transmission", joint.name))));
        self.line("<type>transmission_interface/SimpleTransmission</type>");
        if transmission.offset == 0.0 {
            self.empty(&format!("joint name={}", quoted(joint.name)));
        } else {
            self.open(&format!("joint name={}", quoted(joint.name)));
            self.line(&format!("<offset>{}</offset>", transmission.offset));
            self.close("joint");
        }
        self.open(&format!("actuator name={}", quoted(&format!("{}_motor", joint.name))));
        self.line(&format!("<mechanicalReduction>{}</mechanicalReduction>", transmission.ratio()));
        self.close("actuator");
        self.close("transmission");
    }

    fn origin(&mut self, origin: &Origin) {
        if *origin != Origin::IDENTITY {
            self.empty(&format!("origin xyz=\"{}\" rpy=\"{}\"", joined(&origin.xyz), joined(&origin.rpy)));
        }
    }
}

fn joined(values: &[impl Display]) -> String {
    values.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ")
}

/// Returns a text in quotes, as an attribute's value.
fn quoted(text: &str) -> String {
    let escaped = text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;");
    format!("\"{escaped}\"")
}
