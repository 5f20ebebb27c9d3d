//! Robots of one kind each: moving ones, simulated ones, those that count allocations, those that are recorded, and those that need a
//! process. Beside them the tables of the guides, and an attack on an attitude filter.

mod allocations;
mod attack;
mod kinematics;
mod processes;
mod recordings;
mod simulation;
mod tables;
