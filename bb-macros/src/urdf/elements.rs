//! Converts the elements of a URDF to parts of the tree.

use crate::diagnostics::Place;
use crate::parse::{
    Axis, Dynamics, Geometry, Inertial, Joint, JointKind, JointProperties, Limit, Link, LinkBody, Material, Mimic,
    Origin, Quantity, Shape, Transmission,
};
use crate::units::Dimension;
use proc_macro2::{Ident, Span};
use roxmltree::{Document, Node};
use syn::LitStr;

/// Reads elements; collects faults with their lines and columns.
pub(super) struct Reader<'a, 'input> {
    document: &'a Document<'input>,
    place: Place,
    faults: Vec<String>,
}

impl<'a, 'input> Reader<'a, 'input> {
    pub(super) fn new(document: &'a Document<'input>, place: Place) -> Self {
        Self { document, place, faults: Vec::new() }
    }

    pub(super) fn fault(&mut self, node: Node<'_, '_>, message: &str) {
        let at = self.document.text_pos_at(node.range().start);
        self.faults.push(format!("{}:{}: {message}", at.row, at.col));
    }

    /// All faults, if there are any.
    pub(super) fn done(&mut self) -> Result<(), Vec<String>> {
        if self.faults.is_empty() { Ok(()) } else { Err(std::mem::take(&mut self.faults)) }
    }

    pub(super) fn children<'n, 'i>(&self, node: Node<'n, 'i>, name: &str) -> Vec<Node<'n, 'i>> {
        node.children().filter(|child| child.is_element() && child.tag_name().name() == name).collect()
    }

    pub(super) fn attribute<'n>(&mut self, node: Node<'n, '_>, name: &str) -> Option<&'n str> {
        let value = node.attribute(name);
        if value.is_none() {
            self.fault(node, &format!("<{}> needs the attribute {name:?}", node.tag_name().name()));
        }
        value
    }

    pub(super) fn link(&mut self, node: Node<'_, '_>, robot: Node<'_, '_>) -> Link {
        let label = self.attribute(node, "name").unwrap_or_default().to_owned();
        let inertials = self.children(node, "inertial").into_iter().map(|node| self.inertial(node)).collect();
        let visuals = self.children(node, "visual").into_iter().map(|node| self.shape(node, robot)).collect();
        let collisions = self.children(node, "collision").into_iter().map(|node| self.shape(node, robot)).collect();
        Link {
            attributes: Vec::new(),
            name: self.name(&label),
            label: Some(label),
            sensors: Vec::new(),
            estimators: Vec::new(),
            joints: Vec::new(),
            body: LinkBody { inertials, visuals, collisions },
        }
    }

    /// `None` if its type cannot be read.
    pub(super) fn joint(&mut self, node: Node<'_, '_>, robot: Node<'_, '_>) -> Option<Joint> {
        let label = self.attribute(node, "name").unwrap_or_default().to_owned();
        let kind_text = self.attribute(node, "type")?;
        let Some(kind) = JointKind::of(kind_text) else {
            self.fault(node, &format!("unknown type of joint: {kind_text:?}"));
            return None;
        };
        let has_axis = !matches!(kind, JointKind::Fixed | JointKind::Floating);
        let turns = matches!(kind, JointKind::Revolute | JointKind::Continuous);
        let position = if turns { Dimension::ANGLE } else { Dimension::LENGTH };
        let effort = if turns { Dimension::TORQUE } else { Dimension::FORCE };
        let velocity = if turns { Dimension::ANGULAR_VELOCITY } else { Dimension::VELOCITY };
        let damping = if turns { Dimension::ANGULAR_DAMPING } else { Dimension::LINEAR_DAMPING };

        // URDF's default axis is x; a fixed joint's motion elements have no meaning.
        let axes = if has_axis { vec![self.axis(node)] } else { Vec::new() };
        let needs_limit = matches!(kind, JointKind::Revolute | JointKind::Prismatic);
        let limits = self.children(node, "limit").into_iter().filter(|_| has_axis).map(|limit| Limit {
            word: self.word("limit"),
            lower: Some(self.number(limit, "lower", position).unwrap_or_else(|| self.quantity(0.0, position)))
                .filter(|_| needs_limit),
            upper: Some(self.number(limit, "upper", position).unwrap_or_else(|| self.quantity(0.0, position)))
                .filter(|_| needs_limit),
            velocity: self.number(limit, "velocity", velocity),
            effort: self.number(limit, "effort", effort),
        });
        let limits: Vec<Limit> = limits.collect();
        if needs_limit {
            self.range(node, kind_text, &limits);
        }
        let dynamics = self.children(node, "dynamics").into_iter().filter(|_| has_axis).map(|dynamics| Dynamics {
            damping: self.number(dynamics, "damping", damping),
            friction: self.number(dynamics, "friction", effort),
        });
        let dynamics = dynamics.collect();
        let follows = matches!(kind, JointKind::Revolute | JointKind::Continuous | JointKind::Prismatic);
        let mimics = self.children(node, "mimic").into_iter().filter(|_| follows).map(|mimic| {
            let joint = self.attribute(mimic, "joint").map(str::to_owned);
            let is_declared = |joint: &String| {
                let mut joints = self.children(robot, "joint").into_iter();
                joints.any(|other| other.attribute("name") == Some(joint.as_str()))
            };
            if let Some(unknown) = joint.as_ref().filter(|joint| !is_declared(joint)) {
                self.fault(mimic, &format!("the joint {unknown:?} to follow is not declared"));
            }
            Mimic {
                word: self.word("mimic"),
                joint: joint.map(|joint| self.joint_name(&joint, robot)),
                multiplier: self.number(mimic, "multiplier", Dimension::NONE),
                offset: self.number(mimic, "offset", position),
            }
        });
        let mimics = mimics.collect();
        let origins = self.children(node, "origin").into_iter().map(|node| self.origin(node)).collect();
        Some(Joint {
            attributes: Vec::new(),
            name: self.joint_name(&label, robot),
            kind,
            kind_word: self.word(kind_text),
            properties: JointProperties {
                origins,
                axes,
                limits,
                dynamics,
                mimics,
                transmissions: self.transmissions(robot, &label, position),
            },
            sensors: Vec::new(),
            actuators: Vec::new(),
            links: Vec::new(),
            label: Some(label),
        })
    }

    fn range(&mut self, joint: Node<'_, '_>, kind: &str, limits: &[Limit]) {
        let Some(limit) = limits.first() else {
            return self.fault(joint, &format!("a {kind} joint needs a <limit>"));
        };
        if let (Some(lower), Some(upper)) = (&limit.lower, &limit.upper)
            && lower.value > upper.value
        {
            let (lower, upper) = (lower.value, upper.value);
            self.fault(joint, &format!("the upper limit, {upper}, is below the lower one, {lower}"));
        }
    }

    fn axis(&mut self, joint: Node<'_, '_>) -> Axis {
        let written = self.children(joint, "axis").into_iter().next();
        let direction = written.and_then(|axis| self.numbers::<3>(axis, "xyz")).unwrap_or([1.0, 0.0, 0.0]);
        if let Some(axis) = written
            && direction == [0.0; 3]
        {
            self.fault(axis, "this axis has no direction");
        }
        Axis { word: self.word("axis"), direction, components: Vec::new(), place: self.place }
    }

    fn transmissions(&mut self, robot: Node<'_, '_>, joint: &str, position: Dimension) -> Vec<Transmission> {
        let of_joint = |transmission: &Node<'_, '_>| {
            let mut joints = transmission.children().filter(|node| node.tag_name().name() == "joint");
            joints.any(|node| node.attribute("name") == Some(joint))
        };
        let transmissions: Vec<_> = self.children(robot, "transmission").into_iter().filter(of_joint).collect();
        let reductions = transmissions.into_iter().map(|transmission| {
            let mut number = |name: &str, default: f64| {
                let Some(node) = transmission.descendants().find(|node| node.tag_name().name() == name) else {
                    return default;
                };
                node.text().and_then(|text| text.trim().parse().ok()).unwrap_or_else(|| {
                    self.fault(node, "expected a number");
                    default
                })
            };
            let (reduction, offset) = (number("mechanicalReduction", 1.0), number("offset", 0.0));
            let reversed = reduction < 0.0;
            let reduction = Some(self.quantity(reduction.abs(), Dimension::NONE));
            Transmission { reduction, offset: Some(self.quantity(offset, position)), reversed }
        });
        // A joint has one; further ones for other interfaces repeat it.
        reductions.take(1).collect()
    }

    fn inertial(&mut self, node: Node<'_, '_>) -> Inertial {
        let mass = self.only(node, "mass").and_then(|mass| self.needed(mass, "value", Dimension::MASS));
        // Many files leave out the moments, or some of them; they are then 0.
        let inertia = self.children(node, "inertia").into_iter().next();
        let inertia = ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"].map(|moment| {
            let written = inertia.and_then(|inertia| self.number(inertia, moment, Dimension::MOMENT_OF_INERTIA));
            written.or_else(|| Some(self.quantity(0.0, Dimension::MOMENT_OF_INERTIA)))
        });
        let origin = self.children(node, "origin").into_iter().next().map(|node| self.origin(node));
        Inertial { word: self.word("inertial"), origin, mass, inertia }
    }

    fn shape(&mut self, node: Node<'_, '_>, robot: Node<'_, '_>) -> Shape {
        let origin = self.children(node, "origin").into_iter().next().map(|node| self.origin(node));
        let geometry = self.only(node, "geometry");
        let shape = geometry.and_then(|geometry| geometry.children().find(Node::is_element));
        if let (Some(geometry), None) = (geometry, shape) {
            self.fault(geometry, "<geometry> is empty");
        }
        let geometries = shape.and_then(|shape| self.geometry(shape)).into_iter().collect();
        let is_visual = node.tag_name().name() == "visual";
        let material = self.children(node, "material").into_iter().next().filter(|_| is_visual);
        let material = material.map(|material| self.material(material, robot));
        Shape { word: self.word(node.tag_name().name()), origin, geometries, material }
    }

    fn geometry(&mut self, node: Node<'_, '_>) -> Option<(Ident, Geometry)> {
        let kind = node.tag_name().name();
        let geometry = match kind {
            "box" => Geometry::Box(self.triple(node, "size", Dimension::LENGTH)?),
            "cylinder" => Geometry::Cylinder {
                radius: self.needed(node, "radius", Dimension::LENGTH),
                length: self.needed(node, "length", Dimension::LENGTH),
            },
            "sphere" => Geometry::Sphere { radius: self.needed(node, "radius", Dimension::LENGTH) },
            "mesh" => {
                let file = self.attribute(node, "filename").map(str::to_owned);
                let scale = node.has_attribute("scale").then(|| self.triple(node, "scale", Dimension::NONE));
                Geometry::Mesh { file: file.map(|file| self.text(&file)), scale: scale.flatten() }
            }
            other => {
                self.fault(node, &format!("unknown shape <{other}>"));
                return None;
            }
        };
        Some((self.word(kind), geometry))
    }

    /// A material may be declared once, by name, and used in many places.
    fn material(&mut self, node: Node<'_, '_>, robot: Node<'_, '_>) -> Material {
        let name = node.attribute("name").unwrap_or_default();
        let is_reference = node.children().all(|child| !child.is_element());
        let declared =
            self.children(robot, "material").into_iter().find(|other| other.attribute("name") == Some(name));
        let source = declared.filter(|_| is_reference).unwrap_or(node);
        let color = self.children(source, "color").into_iter().next();
        let color = color.and_then(|color| self.numbers::<4>(color, "rgba"));
        let texture = self.children(source, "texture").into_iter().next();
        let texture = texture.and_then(|texture| texture.attribute("filename")).map(str::to_owned);
        Material {
            name: Some(self.text(name)),
            color: color.map(|color| color.map(|part| self.quantity(part, Dimension::NONE))),
            texture: texture.map(|texture| self.text(&texture)),
        }
    }

    fn origin(&mut self, node: Node<'_, '_>) -> Origin {
        let xyz = node.has_attribute("xyz").then(|| self.triple(node, "xyz", Dimension::LENGTH)).flatten();
        let rpy = node.has_attribute("rpy").then(|| self.triple(node, "rpy", Dimension::ANGLE)).flatten();
        Origin { xyz, rpy }
    }

    /// The only child of that name, which is required.
    fn only<'n, 'i>(&mut self, node: Node<'n, 'i>, name: &str) -> Option<Node<'n, 'i>> {
        let child = self.children(node, name).into_iter().next();
        if child.is_none() {
            self.fault(node, &format!("<{}> needs a <{name}>", node.tag_name().name()));
        }
        child
    }

    fn needed(&mut self, node: Node<'_, '_>, name: &str, dimension: Dimension) -> Option<Quantity> {
        self.attribute(node, name)?;
        self.number(node, name, dimension)
    }

    /// `None` if it is missing; a fault if it is not a number.
    fn number(&mut self, node: Node<'_, '_>, name: &str, dimension: Dimension) -> Option<Quantity> {
        node.attribute(name)?;
        let [number] = self.numbers::<1>(node, name)?;
        const NEVER_NEGATIVE: [&str; 9] =
            ["value", "ixx", "iyy", "izz", "velocity", "effort", "radius", "length", "damping"];
        if number < 0.0 && NEVER_NEGATIVE.contains(&name) {
            // Computed moments may deviate from 0 by rounding.
            if number > -1e-12 {
                return Some(self.quantity(0.0, dimension));
            }
            self.fault(node, &format!("{name}={number} must not be negative"));
        }
        Some(self.quantity(number, dimension))
    }

    fn triple(&mut self, node: Node<'_, '_>, name: &str, dimension: Dimension) -> Option<[Quantity; 3]> {
        self.attribute(node, name)?;
        let numbers = self.numbers::<3>(node, name)?;
        Some(numbers.map(|number| self.quantity(number, dimension)))
    }

    fn numbers<const N: usize>(&mut self, node: Node<'_, '_>, name: &str) -> Option<[f64; N]> {
        let text = node.attribute(name)?;
        let numbers: Option<Vec<f64>> = text.split_whitespace().map(|word| word.parse().ok()).collect();
        let numbers = numbers.filter(|numbers| numbers.iter().all(|number| number.is_finite()));
        let numbers = numbers.and_then(|numbers| numbers.try_into().ok());
        if numbers.is_none() {
            let count = if N == 1 { "a number".to_owned() } else { format!("{N} numbers") };
            self.fault(node, &format!("expected {count} in {name}={text:?}"));
        }
        numbers
    }

    fn quantity(&self, value: f64, dimension: Dimension) -> Quantity {
        Quantity { value, dimension, has_unit: true, place: self.place }
    }

    fn text(&self, text: &str) -> LitStr {
        LitStr::new(text, self.place.start)
    }

    fn word(&self, word: &str) -> Ident {
        Ident::new(word, self.place.start)
    }

    /// The identifier of a joint. A link and a joint may share a name in URDF, but not here.
    fn joint_name(&self, label: &str, robot: Node<'_, '_>) -> Ident {
        let name = self.name(label);
        let mut links = self.children(robot, "link").into_iter().filter_map(|link| link.attribute("name"));
        if links.any(|link| self.name(link) == name) { self.name(&format!("{label}_joint")) } else { name }
    }

    /// The identifier for a name: characters that an identifier cannot have become `_`.
    fn name(&self, label: &str) -> Ident {
        let mut name: String = label
            .chars()
            .map(|character| if character.is_ascii_alphanumeric() { character } else { '_' })
            .collect();
        if name.chars().next().is_none_or(|first| first.is_ascii_digit()) {
            name.insert(0, '_');
        }
        if syn::parse_str::<Ident>(&name).is_err() {
            name.push('_');
        }
        let place: Span = self.place.start;
        Ident::new(&name, place)
    }
}
