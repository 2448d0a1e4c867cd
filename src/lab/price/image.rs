//! What one image takes: the joules and seconds of a phase over the images that went through the chip in it.
//!
//! ```text
//! training     energy(training) / images learnt from          reads, errors, writes; the first loading of cells as well
//! evaluation   energy(evaluation) / images read               one inference
//! ```
//!
//! Calibration is of no image. See docs/MODEL.md, 4.6.

use serde_json::{Value, json};

use super::total::{EnergySplit, EnergyTotal};
use crate::chip::engine::Phase;
use crate::lab::store::record::{EpochRecord, Score};

/// How many images went through the chip, by phase: training first.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Images(Vec<(&'static str, u64)>);

impl Images {
    /// Images of one phase.
    #[must_use]
    pub fn of_phase(phase: Phase, images: u64) -> Self {
        Self(vec![(phase.name(), images)])
    }

    /// Those of a run: what its epochs learnt from and validated with. The final test is no part of a ledger.
    #[must_use]
    pub fn of_records(records: &[EpochRecord]) -> Self {
        let sum = |of: fn(&EpochRecord) -> Option<Score>| {
            let totals = records.iter().filter_map(of).map(|score| score.total);
            // a file may say anything
            totals.fold(0, u64::saturating_add)
        };
        let training = (Phase::Training.name(), sum(EpochRecord::train));
        Self(vec![training, (Phase::Evaluation.name(), sum(EpochRecord::validation))])
    }

    /// Phases that images went through, and how many.
    pub(super) fn phases(&self) -> impl Iterator<Item = (&'static str, u64)> + '_ {
        self.0.iter().copied().filter(|(_, images)| *images > 0)
    }
}

/// What an image of a phase takes.
#[derive(Debug, Clone, PartialEq)]
pub struct PerImage {
    /// The phase.
    pub phase: String,
    /// Images of it.
    pub images: u64,
    /// Joules of one.
    pub total: EnergyTotal,
    /// The same, split.
    pub split: Vec<EnergySplit>,
    /// Seconds of one; images of a batch overlap.
    pub seconds: Option<f64>,
}

impl PerImage {
    /// What is done with an image, in words.
    #[must_use]
    pub fn doing(&self) -> &'static str {
        if self.phase == Phase::Training.name() { "learn from an image" } else { "read an image" }
    }

    /// As a JSON object.
    #[must_use]
    pub fn to_json(&self) -> Value {
        let mut object = self.total.to_json();
        let split: Vec<_> = self.split.iter().map(EnergySplit::to_json).collect();
        object.extend([
            ("phase".to_owned(), json!(self.phase)),
            ("images".to_owned(), json!(self.images)),
            ("seconds".to_owned(), json!(self.seconds)),
            ("by_class".to_owned(), json!(split)),
        ]);
        object.into()
    }
}
