//! What an estimator may ask of the framework, and what comes of it.

use std::time::Duration;

/// What an estimator asks for in addition to its outputs: from a callback with [`Reply::and`](super::Reply::and), from `init`
/// with [`Context::request`](super::Context::request). Nothing is due sooner than a microsecond after it was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Request {
    /// [`handle_continue`](super::Estimator::handle_continue) with this number, before anything else happens to it. After a million
    /// in a row it is stopped, since nothing else could run.
    Continue(u32),
    /// [`Info::Timeout`], if nothing else happens to it for this long.
    Timeout(Duration),
    /// [`Info::Timer`] with the number, once, after this time. A pending one of the same number is replaced.
    Timer(u32, Duration),
    /// [`Info::Tick`] at a fixed rate from now on; a period of zero ends it.
    Tick(Duration),
}

/// Why [`handle_info`](super::Estimator::handle_info) is called.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Info {
    /// Nothing has happened for as long as it asked.
    Timeout,
    /// The timer of that number.
    Timer(u32),
    /// The next period of its tick has begun. Periods that are missed while it is busy are skipped; the phase is kept.
    Tick,
}
