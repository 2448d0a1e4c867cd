//! Runs side by side: which there are, and what sets them apart.

mod compare;
mod list;

pub use compare::compare;
pub use list::{ListedRun, RunStatus, list, meant};
