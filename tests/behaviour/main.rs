//! Whole robots: what a running one does, rule by rule of its documentation.

mod attitude;
mod callbacks;
mod components;
mod control;
mod external;
mod fan_in;
mod faults;
mod frames;
mod health;
mod hygiene;
mod outputs;
mod real_time;
mod simulation;
mod subscriptions;
mod topology;
