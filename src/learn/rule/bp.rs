//! Back-propagation: each layer's gates are read backwards through it before anything is written.

use super::{Step, UpdateMode, writes};

pub(super) fn steps(mode: UpdateMode, layers: usize, samples: usize) -> Vec<Step> {
    let error = |layer| Step::Error { layer, samples: 0..samples };
    let Some(last) = layers.checked_sub(1) else { return vec![] };
    let mut steps = vec![error(last)];
    for layer in (1..layers).rev() {
        steps.push(Step::ReadColumns { layer });
        steps.push(error(layer - 1));
    }
    steps.extend(writes(mode, layers, samples));
    steps
}
