//! What one image takes, or one update and one decision of a policy: the joules and seconds of a phase over what went
//! through the chip in it.
//!
//! ```text
//! training     energy(training) / images learnt from          reads, errors, writes; the first loading of cells as well
//! evaluation   energy(evaluation) / images read               one inference
//! of a policy  energy(training) / updates                     its share of the rollouts and of the first loading as well
//!              energy(evaluation) / decisions                 one step of one episode
//! ```
//!
//! Calibration is of none. See docs/MODEL.md, 4.6.

use serde_json::{Value, json};

use super::total::{EnergySplit, EnergyTotal};
use crate::chip::engine::Phase;
use crate::lab::store::record::{EpochRecord, Outcome, Score};

/// What goes through the chip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PieceKind {
    /// An example.
    Image,
    /// An update of a policy, of both networks.
    Update,
    /// A step that a policy decides on without learning.
    Decision,
}

impl PieceKind {
    /// Several of them.
    #[must_use]
    pub const fn plural(self) -> &'static str {
        match self {
            Self::Image => "images",
            Self::Update => "updates",
            Self::Decision => "decisions",
        }
    }
}

/// How many went through the chip, by phase: training first.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Pieces(Vec<(&'static str, PieceKind, u64)>);

impl Pieces {
    /// Those of one phase.
    #[must_use]
    pub fn of_phase(phase: Phase, kind: PieceKind, count: u64) -> Self {
        Self(vec![(phase.name(), kind, count)])
    }

    /// Those of a run: what its epochs learnt from and were evaluated with. The final test is no part of a ledger.
    #[must_use]
    pub fn of_records(records: &[EpochRecord]) -> Self {
        // a file may say anything
        let sum = |counts: &mut dyn Iterator<Item = u64>| counts.fold(0, u64::saturating_add);
        let scores = |of: fn(&EpochRecord) -> Option<Score>| {
            sum(&mut records.iter().filter_map(of).map(|score| score.total))
        };
        let (training, evaluation) = (Phase::Training.name(), Phase::Evaluation.name());
        let [learnt, read] = match records.last().map(|record| &record.outcome) {
            Some(Outcome::Policy(_)) => {
                let lengths = records.iter().filter_map(|record| record.policy());
                let lengths = lengths.flat_map(|outcome| &outcome.evaluation.lengths);
                let decisions = sum(&mut lengths.map(|&steps| steps.into()));
                let updates = records.last().map_or(0, |record| record.updates);
                [(PieceKind::Update, updates), (PieceKind::Decision, decisions)]
            }
            _ => [EpochRecord::train, EpochRecord::validation]
                .map(|of| (PieceKind::Image, scores(of))),
        };
        Self(vec![(training, learnt.0, learnt.1), (evaluation, read.0, read.1)])
    }

    /// Phases that any went through, of which kind, and how many.
    pub(super) fn phases(&self) -> impl Iterator<Item = (&'static str, PieceKind, u64)> + '_ {
        self.0.iter().copied().filter(|(.., count)| *count > 0)
    }

    /// What a JSON object calls what each takes.
    #[must_use]
    pub fn key(&self) -> &'static str {
        key(self.0.iter().map(|(_, kind, _)| *kind))
    }
}

/// What a JSON object calls what each of some pieces takes.
fn key(mut kinds: impl Iterator<Item = PieceKind>) -> &'static str {
    if kinds.all(|kind| kind == PieceKind::Image) { "per_image" } else { "per_act" }
}

/// What an image, an update or a decision of a phase takes.
#[derive(Debug, Clone, PartialEq)]
pub struct PerPiece {
    /// The phase.
    pub phase: String,
    /// What it is.
    pub kind: PieceKind,
    /// How many there were.
    pub count: u64,
    /// Joules of one.
    pub total: EnergyTotal,
    /// The same, split.
    pub split: Vec<EnergySplit>,
    /// Seconds of one; those of a batch overlap.
    pub seconds: Option<f64>,
}

impl PerPiece {
    /// What is done, in words.
    #[must_use]
    pub fn doing(&self) -> &'static str {
        match self.kind {
            PieceKind::Image if self.phase == Phase::Training.name() => "learn from an image",
            PieceKind::Image => "read an image",
            PieceKind::Update => "learn in an update",
            PieceKind::Decision => "decide",
        }
    }

    /// What a JSON object calls a list of them.
    #[must_use]
    pub fn list_key(list: &[Self]) -> &'static str {
        key(list.iter().map(|one| one.kind))
    }

    /// As a JSON object.
    #[must_use]
    pub fn to_json(&self) -> Value {
        let mut object = self.total.to_json();
        let split: Vec<_> = self.split.iter().map(EnergySplit::to_json).collect();
        object.extend([
            ("phase".to_owned(), json!(self.phase)),
            (self.kind.plural().to_owned(), json!(self.count)),
            ("seconds".to_owned(), json!(self.seconds)),
            ("by_class".to_owned(), json!(split)),
        ]);
        object.into()
    }
}
