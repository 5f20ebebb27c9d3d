//! Accuracy on recordings.
