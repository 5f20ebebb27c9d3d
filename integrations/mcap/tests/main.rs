//! Recordings of robots, bags of other programs, and journals.

mod bags;
mod journal;
mod recordings;
