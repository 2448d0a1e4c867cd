//! What the joules of a run are cut into, for a bar.

use crate::lab::price::{Cost, prefixed};

/// Typical joules of a run by class: device, converter, digital, static.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Parts {
    pub parts: Vec<(String, f64)>,
    /// Whether something that was counted has no price.
    least: bool,
}

impl Parts {
    pub(super) fn total(&self) -> f64 {
        self.parts.iter().map(|(_, joules)| joules).sum()
    }

    /// The total in words.
    pub(super) fn words(&self) -> String {
        let total = prefixed(self.total(), "J");
        if self.least { format!("\u{2265} {total}") } else { total }
    }
}

/// None where nothing has a price.
pub(super) fn parts(cost: &Cost) -> Option<Parts> {
    let energy = cost.energy.filter(|energy| energy.priced > 0)?;
    let classes = cost.split.iter();
    let classes = classes.map(|one| (one.class.name().to_owned(), one.total.joules[1]));
    let parts: Vec<_> = classes.filter(|(_, joules)| *joules > 0.0).collect();
    (!parts.is_empty()).then(|| Parts { parts, least: energy.whole().is_none() })
}
