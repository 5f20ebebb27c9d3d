//! The components that the robots of these tests declare.
