//! Options without a default, with one outside its range, with both, and with an unknown unit.

use bb_core::prelude::*;

#[derive(Clone, Debug, Options)]
pub struct Missing {
    pub gain: f64,
}

#[derive(Clone, Debug, Options)]
pub struct Outside {
    #[option(default = 5.0, range = 0.0..=1.0)]
    pub gain: f64,
}

#[derive(Clone, Debug, Options)]
pub struct Both {
    #[option(default = 0.5, required)]
    pub gain: f64,
}

#[derive(Clone, Debug, Options)]
pub struct Unit {
    #[option(default = 0.5, unit = "metre")]
    pub track: f64,
}

#[derive(Clone, Debug, Options)]
pub enum Choice {
    A,
}

fn main() {}
