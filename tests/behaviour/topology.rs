//! Masses, shapes and resistance of links and joints; URDF in and out.

use crate::kit::*;
use bb_core::topology::{Dynamics, Geometry, Mimic, Origin, Transmission};

/// A reduction of 50, and nothing else.
const GEAR: Transmission = Transmission { reduction: 50.0, offset: 0.0, is_reversed: false };

robot! {
    robot Gripper;

    link palm {
        inertial: {
            mass: 500 g,
            origin: { xyz: [0 m, 0 m, 1 cm] },
            inertia: { xx: 1e-3 kg*m^2, yy: 1e-3 kg*m^2, zz: 2e-3 kg*m^2, xy: -1e-5 kg*m^2 }
        };
        visual: { box: [10 cm, 8 cm, 2 cm], material: { name: "blue & \"shiny\"", color: [0, 0, 1, 0.5] } };
        visual: { origin: { rpy: [0 deg, 90 deg, 0 deg] }, mesh: { file: "package://gripper/cover.stl" } };
        collision: { cylinder: { radius: 5 cm, length: 2 cm } };
        sensor load: Counter() { rate: 1 Hz; estimator scaled: Scale(); }
        estimator both: Snapshot() {
            // The shortest end of a path that only one publisher has.
            input driver: scaled, driver;
            input second: left::force;
        }
        joint left: prismatic {
            axis: x;
            limit: { lower: 0 m, upper: 40 mm, velocity: 0.1 m/s, effort: 20 N };
            dynamics: { damping: 10 N*s/m, friction: 0.5 N };
            transmission: { reduction: 50 };
            sensor force: Counter() { rate: 1 Hz; }
            link left_finger { collision: { sphere: { radius: 1 cm } }; }
        }
        joint right: prismatic {
            axis: -x;
            limit: { lower: 0 m, upper: 40 mm };
            mimic: { joint: left, multiplier: 1, offset: 1 mm };
            link right_finger { sensor force: Counter() { rate: 1 Hz; } }
        }
    }
}

robot! {
    robot Arm;
    topology: urdf("urdf/arm.urdf");

    link base_link { sensor imu: Counter() { rate: 1 Hz; } }
    link tool {
        sensor imu: Counter() { rate: 1 Hz; }
        joint mount: fixed { link camera; }
    }
    joint elbow { sensor encoder: Counter() { rate: 1 Hz; } }
}

#[test]
fn bodies_and_mechanics_are_data() {
    let topology = Gripper::TOPOLOGY;
    let palm = topology.link("palm").expect("it is declared");
    let inertial = palm.inertial.expect("it is declared");
    assert_eq!((inertial.mass, inertial.inertia), (0.5, [1e-3, -1e-5, 0.0, 1e-3, 0.0, 2e-3]));
    assert_eq!(inertial.link_from_inertia, Origin { xyz: [0.0, 0.0, 0.01], rpy: [0.0; 3] });
    assert_eq!(palm.visuals[0].geometry, Geometry::Box([0.1, 0.08, 0.02]));
    assert_eq!(palm.visuals[0].material.and_then(|material| material.color), Some([0.0, 0.0, 1.0, 0.5]));
    let mesh = Geometry::Mesh { file: "package://gripper/cover.stl", scale: [1.0; 3] };
    assert_eq!(palm.visuals[1].geometry, mesh);
    assert_eq!(palm.collisions[0].geometry, Geometry::Cylinder { radius: 0.05, length: 0.02 });
    let (left, right) = (topology.joint("left").expect("there"), topology.joint("right").expect("there"));
    assert_eq!(left.dynamics, Some(Dynamics { damping: 10.0, friction: 0.5 }));
    assert_eq!(left.transmission, Some(GEAR));
    assert_eq!(right.mimic, Some(Mimic { joint: 0, multiplier: 1.0, offset: 0.001 }));
    assert_eq!(right.axis, Some([-1.0, 0.0, 0.0]));
}

#[test]
fn the_end_of_a_path_names_its_only_publisher() {
    let sources: Vec<_> = Gripper::ESTIMATORS[1].inputs.iter().map(|input| input.source).collect();
    assert_eq!(sources, ["sensor/palm/load/scaled", "sensor/palm/left/force"]);
}

#[test]
fn urdf_is_written_as_declared() {
    let urdf = Gripper::to_urdf();
    for expected in [
        "<robot name=\"Gripper\">",
        "<mass value=\"0.5\"/>",
        "<inertia ixx=\"0.001\" ixy=\"-0.00001\" ixz=\"0\" iyy=\"0.001\" iyz=\"0\" izz=\"0.002\"/>",
        "<origin xyz=\"0 0 0\" rpy=\"0 1.5707963267948966 0\"/>",
        "<material name=\"blue &amp; &quot;shiny&quot;\">",
        "<joint name=\"right\" type=\"prismatic\">",
        "<mimic joint=\"left\" multiplier=\"1\" offset=\"0.001\"/>",
        "<limit lower=\"0\" upper=\"0.04\" effort=\"20\" velocity=\"0.1\"/>",
        "<mechanicalReduction>50</mechanicalReduction>",
    ] {
        assert!(urdf.contains(expected), "{expected} is not in\n{urdf}");
    }
}

#[test]
fn components_are_declared_onto_a_urdf() -> Result<(), StartError> {
    let topology = Arm::TOPOLOGY;
    // Names that are no identifiers keep their text, and get an identifier.
    assert_eq!(topology.root().name(), "base-link");
    let elbow = topology.joint("elbow").expect("it is in the file");
    assert_eq!(elbow.parent_from_joint, Origin { xyz: [0.0, 0.0, 0.1], rpy: [0.0, 0.0, 1.5] });
    assert_eq!((elbow.axis, elbow.transmission), (Some([0.0, 1.0, 0.0]), Some(GEAR)));
    let base = topology.link("base-link").expect("it is in the file");
    let grey = base.visuals[0].material.and_then(|material| material.color);
    assert_eq!(grey, Some([0.5, 0.5, 0.5, 1.0]));
    assert!(topology.joint("flange").is_some_and(|flange| flange.axis.is_none()));
    assert!(topology.link("camera").is_some());

    let builder = Arm::builder();
    let base = builder.subscribe(arm::sensor::base_link::imu);
    let tool = builder.subscribe(arm::sensor::base_link::elbow::upper::flange::tool::imu);
    let encoder = builder.subscribe(arm::sensor::base_link::elbow::encoder);
    builder.simulate()?.step();
    assert_eq!(base.try_recv().map(|number| number.frame.name()), Some("base-link"));
    let expected = ("sensor/base_link/elbow/upper/flange/tool/imu", "sensor/base_link/elbow/encoder");
    assert_eq!((tool.path(), encoder.path()), expected);
    Ok(())
}
