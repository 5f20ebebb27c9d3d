//! Angles and lengths the wrong way round, an axis with a unit, a limit of the wrong kind of joint.

use bb_core::prelude::*;

robot! {
    robot Rover;
    link base {
        joint pan: revolute {
            origin: { xyz: [0 m, 0 m, 90 deg], rpy: [0 deg, 0 deg, 0.9 m/s^2] };
            axis: [0, 0, 1 m];
            limit: { lower: -0.1 m, upper: 90 deg, velocity: 1 m/s, effort: 5 N };
            link head { }
        }
    }
}

fn main() {}
