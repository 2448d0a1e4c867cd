//! What the joules of a run are cut into, for a bar.

use crate::lab::price::{Cost, prefixed};

/// Parts of a bar at most; what is left is one more.
const PARTS_MAX: usize = 6;

/// Joules of a run by component, the greatest first.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Parts {
    pub parts: Vec<(String, f64)>,
}

impl Parts {
    pub(super) fn total(&self) -> f64 {
        self.parts.iter().map(|(_, joules)| joules).sum()
    }

    /// The total in words.
    pub(super) fn words(&self) -> String {
        prefixed(self.total(), "J")
    }
}

/// None where nothing has a price.
pub(super) fn parts(cost: &Cost) -> Option<Parts> {
    cost.joules?;
    let of = |group: &crate::lab::price::Group| (group.name.replace('_', " "), group.joules[1]);
    let mut parts: Vec<_> =
        cost.components.iter().map(of).filter(|(_, joules)| *joules > 0.0).collect();
    if parts.len() > PARTS_MAX + 1 {
        let rest = parts.split_off(PARTS_MAX).iter().map(|(_, joules)| joules).sum();
        parts.push(("other".into(), rest));
    }
    (!parts.is_empty()).then_some(Parts { parts })
}
