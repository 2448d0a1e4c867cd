//! dalean
pub mod chip;
pub mod lab;
pub mod learn;
pub mod num;
pub mod task;
