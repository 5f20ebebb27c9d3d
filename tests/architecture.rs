//! What the documents claim.
