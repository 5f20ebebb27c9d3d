//! What subscribers' own code may do, and what concurrency may not break.

mod deferred;
mod reentrant;
