//! Bodies of wrong values: negative, without a unit, of the wrong dimension, too few, and what does not belong there.

use bb_core::prelude::*;

robot! {
    robot Case;

    link body {
        inertial: { mass: -2 kg, inertia: { xx: 0.1, yy: 0.1 kg*m^2, zz: 0.1 kg } };
        visual: { box: [0.1 m, 0.1 m] };
        collision: { sphere: { radius: 0.1 s } };
        collision: { sphere: { radius: 0.1 m }, material: { name: "red" } };
        collision: { sphere: { radios: 0.1 m } };
    }
}

fn main() {
    let _ = Case::to_urdf();
}
