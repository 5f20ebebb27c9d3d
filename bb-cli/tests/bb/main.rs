//! The command, on small recordings that are made here.

mod attitude;
mod bad;
mod calibrate;
mod cart;
mod common;
mod convert;
mod doubts;
mod guides;
mod help;
mod inspect;
mod live;
mod navigation;
mod navigation_bag;
mod new;
mod noise;
mod recorded;
mod recorded_trials;
