//! The substrate: unsigned crossbars, their periphery, and the engine that drives them.

pub mod crossbar;
