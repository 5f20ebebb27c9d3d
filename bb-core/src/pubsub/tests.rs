//! What subscribers' own code may do, and what concurrency may not break.

mod reentrant;
