//! Faults of a URDF, with line and column.

use super::read;
use crate::parse::{Link, Topology};
use proc_macro2::{Ident, Span};
use syn::LitStr;

fn root(urdf: &str) -> Result<Link, Vec<String>> {
    let span = Span::call_site();
    let topology =
        Topology { word: Ident::new("topology", span), file: LitStr::new("robot.urdf", span), place: span.into() };
    read::root(urdf, &topology)
}

fn faults(body: &str) -> Vec<String> {
    root(&format!("<robot name=\"r\">\n{body}\n</robot>")).err().unwrap_or_default()
}

#[test]
fn faults_are_reported_with_their_places() {
    let two = "<link name=\"a\"/><link name=\"b\"/>";
    let joint = |inside: &str, attributes: &str| {
        format!("{two}\n<joint name=\"j\" {attributes}><parent link=\"a\"/><child link=\"b\"/>{inside}</joint>")
    };
    let cases = [
        (String::new(), "1:1: there is no root link: every link is the child of a joint"),
        (two.into(), "2:17: the link \"b\" is a second root; a joint must carry it"),
        ("<link name=\"a\"/>\n  <link name=\"a\"/>".into(), "3:3: there is a second link \"a\""),
        ("<link/>".into(), "2:1: <link> needs the attribute \"name\""),
        (joint("", "type=\"hinge\""), "3:1: unknown type of joint: \"hinge\""),
        (joint("", "type=\"revolute\""), "3:1: a revolute joint needs a <limit>"),
        (
            joint("<limit lower=\"1\" upper=\"-1\"/>", "type=\"revolute\""),
            "3:1: the upper limit, -1, is below the lower one, 1",
        ),
        (joint("<origin xyz=\"1 2\"/>", "type=\"fixed\""), "3:65: expected 3 numbers in xyz=\"1 2\""),
        (joint("<axis xyz=\"0 0 0\"/>", "type=\"continuous\""), "3:70: this axis has no direction"),
        (joint("<mimic joint=\"k\"/>", "type=\"continuous\""), "3:70: the joint \"k\" to follow is not declared"),
        (
            "<link name=\"a\"/><joint name=\"j\" type=\"fixed\"><parent link=\"a\"/><child link=\"c\"/></joint>"
                .into(),
            "2:17: the child link \"c\" is not declared",
        ),
        (
            "<link name=\"a\"><visual><geometry><torus/></geometry></visual></link>".into(),
            "2:34: unknown shape <torus>",
        ),
        (
            "<link name=\"a\"><inertial><mass value=\"-1\"/></inertial></link>".into(),
            "2:26: value=-1 must not be negative",
        ),
    ];
    for (body, expected) in cases {
        let found = faults(&body);
        assert!(found.iter().any(|fault| fault == expected), "{body}\n{found:?}\nhas no {expected}");
    }
}

#[test]
fn links_in_a_circle_are_found() {
    let circle = "<link name=\"a\"/><link name=\"b\"/><link name=\"c\"/>\
        <joint name=\"j\" type=\"fixed\"><parent link=\"b\"/><child link=\"c\"/></joint>\
        <joint name=\"k\" type=\"fixed\"><parent link=\"c\"/><child link=\"b\"/></joint>";
    assert!(faults(circle).iter().any(|fault| fault.contains("in a circle")));
}

#[test]
fn what_is_no_xml_is_reported_where_it_breaks() {
    assert_eq!(root("<robot>\n  <link name=a/>").err().map(|faults| faults.len()), Some(1));
    assert!(root("").is_err());
    assert!(root("<sdf/>").err().is_some_and(|faults| faults[0] == "1:1: expected a <robot> element"));
}

#[test]
fn a_moment_that_misses_zero_by_a_rounding_is_zero() {
    let link = root(
        "<robot name=\"r\"><link name=\"a\"><inertial><mass value=\"1\"/><inertia ixx=\"-5e-20\"/></inertial></link></robot>",
    );
    let moment = link.map(|link| link.body.inertials[0].inertia[0].as_ref().map(|moment| moment.value));
    assert_eq!(moment.ok().flatten(), Some(0.0));
}

#[test]
fn actuators_are_declared_onto_joints() {
    let text = "robot Arm; topology: urdf(\"../tests/urdf/arm.urdf\");
        joint elbow { sensor encoder: Encoder(); actuator motor: Motor(); }";
    let mut diagnostics = crate::diagnostics::Diagnostics::default();
    let tokens = text.parse().unwrap_or_default();
    let (tree, _) = super::graft(crate::parse::robot(tokens, &mut diagnostics), &mut diagnostics);
    let robot = crate::model::resolve(tree);
    crate::verify::verify(&robot, &mut diagnostics);
    assert!(!diagnostics.any(), "{:?}", diagnostics.all());
    let ends: Vec<_> =
        robot.actuators.iter().map(|actuator| actuator.path[actuator.path.len() - 2..].join("/")).collect();
    assert_eq!(ends, ["elbow/motor"]);
}

#[test]
fn names_become_identifiers() {
    let link = root("<robot name=\"r\"><link name=\"3 fingers-loop\"/></robot>").map(|link| link.name.to_string());
    assert_eq!(link.ok().as_deref(), Some("_3_fingers_loop"));
    let link = root("<robot name=\"r\"><link name=\"loop\"/></robot>").map(|link| link.name.to_string());
    assert_eq!(link.ok().as_deref(), Some("loop_"));
}
