//! Whole robots: what a running one does, rule by rule of its documentation.

mod attitude;
mod callbacks;
mod command_faults;
mod components;
mod contention;
mod control;
mod everything;
mod external;
mod fan_in;
mod faults;
mod frames;
mod health;
mod hygiene;
mod outputs;
mod own_paths;
mod parameters;
mod real_time;
mod replay;
mod safety;
mod simulation;
mod subscriptions;
mod supervision;
mod timing;
mod topology;
mod workers;
