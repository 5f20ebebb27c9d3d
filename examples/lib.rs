//! A ladder of examples, from the smallest up; each is an example target of this crate:
//! `hello`, `robot`, `driver`, `fan_in`, `estimator`, `commands`, `parameters`, `health`, `replay`, `bridge`, `navigation`,
//! `no_satellites`.
