//! A dashboard and its clients over the loopback device, with a robot on virtual time: time passes when the test says so.

mod client;
mod hostile;
mod protocol;
mod robot;
mod web;
