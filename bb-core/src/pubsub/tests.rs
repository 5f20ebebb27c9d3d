//! What subscribers' own code may do, and what concurrency may not break.

mod bounds;
mod concurrent;
mod deferred;
mod reentrant;
