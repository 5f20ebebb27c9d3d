//! Subscribers' own code, and concurrency.

mod bounds;
mod concurrent;
mod deferred;
mod rates;
mod reentrant;
