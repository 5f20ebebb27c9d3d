//! A link that weighs something and is seen.

use bb_core::prelude::*;

robot! {
    robot Case;

    link body {
        inertial: { mass: 2 kg, inertia: { xx: 0.1 kg*m^2, yy: 0.1 kg*m^2, zz: 0.1 kg*m^2 } };
        visual: { box: [0.1 m, 0.2 m, 0.3 m], material: { name: "red", color: [1, 0, 0, 1] } };
        collision: { origin: { xyz: [0 m, 0 m, 0.1 m] }, mesh: { file: "body.stl", scale: [1, 1, 2] } };
    }
}

#[test]
fn compiles() {
    assert!(Case::TOPOLOGY.links[0].inertial.is_some());
}
