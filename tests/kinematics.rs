//! Kinematics of moving robots: positions, velocities, and how their joints reach a target.

mod inverse;
mod laws;
mod manipulator;
mod pinocchio;
mod robots;
