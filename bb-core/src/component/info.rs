//! Requests of an estimator to the framework, and their results.

use std::time::Duration;

/// A request that an estimator makes in addition to its outputs: from a callback with
/// [`Reply::and`](super::Reply::and), from `init` with [`Context::request`](super::Context::request). Nothing is due
/// sooner than a microsecond after the request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Request {
    /// [`handle_continue`](super::Estimator::handle_continue) with this number, before any other callback. After a
    /// million in a row the estimator is stopped, since nothing else could run.
    Continue(u32),
    /// [`Info::Timeout`], if no other callback runs for this long.
    Timeout(Duration),
    /// [`Info::Timer`] with this number, once, after this time. Replaces a pending timer of the same number.
    Timer(u32, Duration),
    /// [`Info::Tick`] at a fixed rate from now on; a period of zero ends it.
    Tick(Duration),
    /// A restart with fresh state, as if the callback had returned this reason as a [`Fault`](super::Fault). It happens once the outputs
    /// of the reply are published and the answer to a call is sent, and before a [`Continue`](Self::Continue) of the same reply.
    Restart(&'static str),
}

/// Reason for a call of [`handle_info`](super::Estimator::handle_info).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Info {
    /// No callback ran for the requested time.
    Timeout,
    /// The timer of that number.
    Timer(u32),
    /// The next period of the estimator's tick has begun. Periods missed while it is busy are skipped; the phase is kept.
    Tick,
}
