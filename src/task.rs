//! What the substrate is asked to learn.

pub mod classify;
