//! Where cycles go: stages of a phase, and what each waits for.

use crate::chip::ledger::{Interval, Part};
use crate::lab::store::ledger::CyclesRecord;

/// What a stage waits for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StageUse {
    /// Which stage.
    pub stage: Interval,
    /// Cycles of it.
    pub cycles: u64,
    /// The layer and part that works most of this time, and for how many cycles.
    pub critical: Option<(usize, Part, u64)>,
}

/// Stages that took time, and what each waited for.
#[must_use]
pub fn stages(cycles: &CyclesRecord) -> Vec<StageUse> {
    let elapsed = |stage: Interval| cycles.stages.get(stage.name()).copied().unwrap_or(0);
    let critical = |stage| {
        let layers = cycles.layers.iter().enumerate();
        let used = layers.flat_map(|(layer, this)| {
            parts_of(stage)
                .iter()
                .map(move |&part| (layer, part, this.used.get(part.name()).copied().unwrap_or(0)))
        });
        let used = used.filter(|(.., used)| *used > 0);
        used.max_by_key(|&(layer, _, used)| (used, std::cmp::Reverse(layer)))
    };
    let stages = Interval::ALL.into_iter().filter(|&stage| elapsed(stage) > 0);
    stages
        .map(|stage| StageUse { stage, cycles: elapsed(stage), critical: critical(stage) })
        .collect()
}

/// Parts that work in a stage.
const fn parts_of(stage: Interval) -> &'static [Part] {
    match stage {
        Interval::Forward | Interval::Columns => {
            &[Part::Arrays, Part::Converters, Part::Tree, Part::Lanes]
        }
        Interval::Error => &[Part::Bus, Part::Multipliers],
        Interval::Accumulate => &[Part::Accumulators],
        Interval::Load | Interval::Program => &[Part::Writers],
        Interval::Centre => &[],
    }
}
