//! Metrics of a running robot, for Prometheus.
//!
//! An [`Exporter`] takes a new report of the robot for each scrape: the robot itself does nothing more than without it.
//! [`Exporter::render`] gives the text, [`Exporter::serve`] answers `GET /metrics`.
//!
//! ```
//! use bb_core::prelude::*;
//! use bb_metrics::Exporter;
//!
//! robot! {
//!     robot Counted;
//!     link base { sensor imu: External<Imu>(); }
//! }
//!
//! fn main() -> Result<(), Box<dyn std::error::Error>> {
//!     let running = Counted::builder().start()?;
//!     let server = Exporter::new(running.live()).serve("127.0.0.1:0")?; // until it is dropped
//!     println!("http://{}/metrics", server.address());
//!     running.stop().ok()?;
//!     Ok(())
//! }
//! ```
//!
//! | metric | labels beside `robot` | what |
//! |---|---|---|
//! | `bb_estimator_messages_received_total` | `estimator`, `input` | messages that arrived, the dropped ones included |
//! | `bb_estimator_messages_dropped_total` | `estimator`, `input`, `reason` | those that were dropped |
//! | `bb_estimator_dispatches_total` | `estimator` | calls |
//! | `bb_estimator_emissions_total` | `estimator` | calls that emitted |
//! | `bb_estimator_divergences_total` | `estimator` | times it said that it has diverged |
//! | `bb_estimator_restarts_total` | `estimator` | times it was restarted |
//! | `bb_estimator_health_transitions_total` | `estimator` | changes of its health |
//! | `bb_estimator_health` | `estimator`, `state` | 1 for `healthy`, `degraded` or `lost`, 0 for the others |
//! | `bb_estimator_running` | `estimator` | 0 if it has stopped or waits for its restart |
//! | `bb_estimator_latencies_total` | `estimator` | callbacks that were measured |
//! | `bb_estimator_latency_seconds` | `estimator`, `quantile` | time in callbacks since the start, within an eighth; 1 is the longest; every callback where a `latency_budget` is declared, otherwise every 64th |
//! | `bb_estimator_input_age_seconds` | `estimator`, `input`, `quantile` | how old messages of the driver were when the callback returned; likewise |
//! | `bb_source_readings_total` | `source` | readings of a sensor, updates of a service |
//! | `bb_source_readings_skipped_total` | `source` | readings at its rate for which it came too late |
//! | `bb_source_restarts_total` | `source` | times it was restarted |
//! | `bb_source_events_total` | `source`, `event` | what a sensor or a service counts itself, such as the silences of a `Reaction` |
//! | `bb_source_running` | `source` | 0 if it has stopped or waits for its restart |
//! | `bb_topic_messages_published_total` | `topic`, `payload` | messages |
//! | `bb_topic_messages_lost_total` | `topic`, `payload` | messages that slow subscribers lost |
//! | `bb_topic_subscribers` | `topic`, `payload` | subscriptions that listen now |
//! | `bb_command_starts_total` | `command` | starts |
//! | `bb_command_ends_total` | `command`, `outcome` | `succeeded`, `failed`, `timed_out`, `cancelled` |
//! | `bb_command_refusals_total` | `command` | refusals |
//! | `bb_safety_state` | `state` | 1 for the one that it is in |
//! | `bb_operational_state` | `state` | 1 for the one that it is in |
//! | `bb_faults_total` | | faults of components |
//! | `bb_safety_errors_total` | `component`, `kind` | errors that made the safety state `error` |
//! | `bb_panics_total` | `kind` | panics of code that no component is charged with: `wakers`, `loggers`, `telemetry`, `journal` |
//!
//! Counters are exported at 0 from the first scrape on, so that the first increment is seen as one.

// A robot must not stop because of an unexpected value.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod collector;
mod exporter;
mod request;
mod server;

pub use exporter::Exporter;
pub use server::{ServeError, Server};
