//! Error diffusion: the output error is handed to every layer at once; no backward pass.
//!
//! Kaneko's rule and direct feedback alignment issue the same operations: they differ in which gates pulse and in
//! what the error unit puts on the bus.

use super::{Step, UpdateMode, writes};

pub(super) fn steps(mode: UpdateMode, layers: usize, samples: usize) -> Vec<Step> {
    let error = |layer| Step::Error { layer, samples: 0..samples };
    let mut steps: Vec<_> = (0..layers).map(error).collect();
    steps.extend(writes(mode, layers, samples));
    steps
}
