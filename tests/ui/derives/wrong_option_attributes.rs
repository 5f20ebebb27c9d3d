//! Attributes of options in other words, and numbers of another kind.

use bb_core::prelude::*;

#[derive(Clone, Debug, Options)]
struct Attributes {
    #[option(default = 1.0 m)]
    reach: f64,
    #[option(default = 100 ms)]
    timeout: Duration,
    #[option(default = 0.1)]
    wait: Duration,
    #[option(default = Duration::from_millis(5), range = 0.0..=1.0)]
    period: Duration,
    #[option(default = 1.0, unti = "m")]
    length: f64,
    #[option(defualt = 1.0)]
    gain: f64,
    #[option(default = 1.0, unit = m)]
    width: f64,
    #[option(default: 1.0)]
    height: f64,
    #[option(default = 1.0, min = 0.0, max = 5.0)]
    depth: f64,
    #[options(default = 0.1)]
    share: f64,
    #[option(default = 1.0 2.0)]
    pair: f64,
}

#[derive(Clone, Debug, Options)]
struct Numbers {
    #[option(default = 1.0, range = 0..=5)]
    reach: f64,
    #[option(default = -1, range = -2.0..=5.0)]
    offset: f64,
    #[option(default = "1 m", unit = "m")]
    length: f64,
    #[option(default = 1.0, range = 0.0..5.0)]
    gain: f64,
    #[option(default = 5, range = 0.5..=10.0)]
    count: u32,
}

fn main() {}
