//! A sensor of something that is no payload.

use bb_core::prelude::*;
use std::rc::Rc;

robot! {
    robot Rover;
    link base { sensor lidar: External<Rc<u8>>(); }
}

fn main() {}
