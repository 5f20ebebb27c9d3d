//! A running robot in the browser, and for the command `bb`: what is wrong and since when, safety, health, commands, parameters, joints,
//! events and plots, seen and steered over one WebSocket.
//!
//! ```no_run
//! use bb_core::prelude::*;
//! use bb_dashboard::{Dashboard, DashboardOptions};
//! # use bb_core::Options;
//!
//! robot! {
//!     robot Rover;
//!     parameters { speed: f64 = 0.5 m/s, range: 0 m/s..=1.5 m/s; }
//!     link base;
//! }
//!
//! fn main() -> Result<(), Box<dyn std::error::Error>> {
//!     let running = Rover::builder().start()?;
//!     let dashboard = Dashboard::serve(&running, DashboardOptions::defaults())?;
//!     println!("{}", dashboard.url());
//!     // `Running::wait` waits for sensors and bridges of the robot, of which this one has none.
//!     loop {
//!         std::thread::park();
//!     }
//! }
//! ```
//!
//! Or as a line of the robot, which prints the address when it starts:
//! `bridges { bridge dashboard: Dashboard(port = 8912); }`.
//!
//! Nothing of the robot waits for a viewer. Without one, the robot's threads hand over its events alone, which are rare. With viewers, one
//! thread takes the newest message of each watched path, at most sixteen times a second, and one thread speaks to the browsers.
//!
//! # Who may do what
//!
//! It listens on the loopback device. A page or a program without the token of the printed address may read, and disarm the robot; with
//! [`DashboardOptions::read`]` = "token"`, only disarm it. With the token it has the rights of [`DashboardOptions::rights`]. Their calls
//! have a name, such as `page 3`, in the events and the journal of the robot, and everything obtained through a connection refuses to act once it ends.
//! Requests with an `Origin`, `Sec-Fetch-Site` or `Host` other than those of the listed hosts are refused.
//!
//! # The protocol
//!
//! Version 1. The WebSocket is at `/ws`; each message is a JSON object whose `op` says what it is. The first one of the client, within 5 s, is
//!
//! ```json
//! {"op": "hello", "version": 1, "client": "mine", "token": "…", "robot": "Rover"}
//! ```
//!
//! `token` and `robot` may be left out. The answer is `welcome` with `robot`, `robots`, `caller`, `rights`, `meshes` (the addresses of the served
//! files, by their names in the description; with `read = "token"` they need the header `Authorization: Bearer TOKEN`) and the `description`
//! (`Description::to_json`), or `error`. Then frames come, whose members are there if they are new:
//!
//! | member of `frame` | |
//! |---|---|
//! | `report` | `Report::to_json`: `time`, `state`, `safety`, `problems`, `executions`, `topics`, `estimators`, `sources`, `actuators`, `commands`, `faults` |
//! | `messages` | by path, the newest message of each that is watched, with its stamp; `{"too_long": bytes}` for a long one |
//! | `events` | `path`, `kind` (the payload's type) and `message`, in order; `lost_events` counts those that are not kept any more |
//! | `parameters` | the values of all, in SI, after a change |
//! | `joints` | `position` and `stale` of each joint whose state is known, and the `motion` of what it carries: `xyz`, and `quaternion` as x, y, z, w |
//!
//! Requests have an `id`, which their answer repeats: `{"op": "answer", "id": 7, "ok": true}` or `{"op": "answer", "id": 7, "error": "…"}`.
//!
//! | `op` | members | answer |
//! |---|---|---|
//! | `watch` | `paths`, all that it watches from now on, at most 256 | |
//! | `set` | `values`: an object of paths and values; all or none | |
//! | `start` | `path`, `arguments` (may be left out) | `execution`; later `{"op": "result", "execution": 3, "value": …}` or `error` |
//! | `cancel` | `execution` | |
//! | `send` | `path` of an actuator, `command` | `command` as it was carried out, within the limits |
//! | `publish` | `path` of a sensor or an input whose messages other code publishes, `payload` | |
//! | `arm`, `disarm`, `force_disarm`, `stop` | | once it is so |
//! | `describe` | | `description` |
//! | `token` | `token` | `rights` |
//! | `ping` | | |
//!
//! A version that removes or changes a member has another number; members may be added.

mod bridge;
mod connections;
mod gate;
mod guests;
mod hub;
mod meshes;
mod options;
mod page;
mod protocol;
mod server;
mod shared;
mod token;
mod viewer;

pub use options::DashboardOptions;
pub use protocol::VERSION;
pub use server::{Dashboard, DashboardState, ServeError};
