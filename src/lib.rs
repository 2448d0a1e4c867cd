//! dalean
pub mod chip;
pub mod lab;
pub mod num;
pub mod task;
