//! Integers, words and tables: what everything else counts with.
//!
//! [`fixed`] holds the rounding and saturation rules, [`draw`] the addresses of random words, and
//! [`tables`] the only door through which a float becomes an integer.

pub mod draw;
pub mod fixed;
pub mod tables;
