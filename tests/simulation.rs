//! Robots in a simulated world: what their sensors measure, and what estimators make of it.

mod arm;
mod drive;
mod late;
