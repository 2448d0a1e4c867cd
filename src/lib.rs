//! dalean
pub mod chip;
pub mod cli;
pub mod lab;
pub mod learn;
pub mod num;
pub mod task;
