//! What the substrate is asked to learn.

pub mod classify;
pub mod environment;
pub mod policy;
