//! Robots of one kind each: moving ones, simulated ones, those that count allocations, and those that need a process. Beside them the
//! tables of the guides.

mod allocations;
mod kinematics;
mod processes;
mod simulation;
mod tables;
