//! Robots in whole stories; each is an example target of this crate.
