//! Robots of one kind each: moving ones, simulated ones, those that count allocations, and those that need a process. Beside them the
//! tables of the guides, and an attack on an attitude filter.

mod allocations;
mod attack;
mod kinematics;
mod processes;
mod simulation;
mod tables;
