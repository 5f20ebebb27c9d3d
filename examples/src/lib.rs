//! Small robots that run; each is an example target of this crate.
