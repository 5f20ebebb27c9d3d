//! Bodies that lack what they need.

use bb_core::prelude::*;

robot! {
    robot Case;

    link body {
        inertial: { mass: 2 kg, inertia: { xx: 0.1 kg*m^2, yy: 0.1 kg*m^2 } };
        visual: { material: { name: "red" } };
        visual: { cylinder: { radius: 0.1 m } };
        collision: { mesh: { scale: [1, 1, 1] } };
        collision: { sphere: { radius: 0.1 m }, box: [0.1 m, 0.1 m, 0.1 m] };
    }
}

fn main() {
    let _ = Case::to_urdf();
}
