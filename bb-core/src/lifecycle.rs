//! The lifecycle of every component: make, bind, run, fail, retire, restart.
//!
//! ```text
//! vacant ── make ──▶ running ── fault, panic ──▶ waiting ── its backoff is over ──▶ make …
//!                       │                           │
//!                       ├── permanent fault ──▶ stopped ◀── its supervisor gives up
//!                       └── restart from above, new options ──▶ retire, then make at once
//! ```
//!
//! Only the caller differs: an estimator's slot is called by its island, a sensor's or service's by its thread, an
//! actuator's by the senders of its commands. A component is always retired before the next one is created, so a
//! device is closed before it is opened again.

mod adapter;
mod backoff;
mod serving;
mod slot;
mod stand_in;

pub(crate) use adapter::{AsActuator, AsEstimator, AsSensor, Component};
pub use backoff::Supervision;
pub use serving::Serving;
pub(crate) use slot::{AfterFault, Recipe, Slot};
pub(crate) use stand_in::{replacement_of_actuator, replacement_of_estimator, replacement_of_sensor};
