//! What a run writes down: one record an epoch, and a receipt at the end. Plain numbers; `null` where there is
//! nothing to count. Counts are integers; the only floats are wall-clock seconds and derived accuracies.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Right answers out of how many.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Score {
    /// Right answers.
    pub correct: u64,
    /// Examples read.
    pub total: u64,
}

impl Score {
    /// Right answers as a fraction; 0 of nothing.
    #[must_use]
    pub fn fraction(self) -> f64 {
        if self.total == 0 { 0.0 } else { self.correct as f64 / self.total as f64 }
    }
}

/// Cells of one pathway of one layer at the end of an epoch (definitions: docs/GLOSSARY.md).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PathwayRecord {
    /// Layer, from 0 at the input.
    pub layer: usize,
    /// Name: `pp`, `np`, `nn`, `pn`, or `e`, `i` of a differential pair.
    pub pathway: String,
    /// Whether its current adds.
    pub excites: bool,
    /// Rows and columns.
    pub shape: [usize; 2],
    /// Cells.
    pub cells: u64,
    /// Cells on the floor.
    pub floor: u64,
    /// Cells at level 0.
    pub zero: u64,
    /// Cells gone for good.
    pub pruned: u64,
    /// Cells that left the floor since the start.
    pub births: u64,
    /// Cells that reached the floor since the start.
    pub deaths: u64,
    /// Sum of levels.
    pub levels: u64,
    /// `[idle, all]` rows, columns, tiles.
    pub idle: [[u64; 2]; 3],
    /// Cells by level, in equal bins (64 or fewer).
    pub histogram: Vec<u64>,
    /// Events of the training ledger so far, by name (requested, bounded, pulses_attempted, ...).
    pub training: BTreeMap<String, u64>,
}

/// One layer at the end of an epoch.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LayerRecord {
    /// Layer, from 0 at the input.
    pub layer: usize,
    /// Sum of excitatory and of inhibitory levels: E/I is their quotient.
    pub levels: [u64; 2],
    /// Sum of excitatory and of inhibitory bank currents by target stream, over the evaluation of this epoch.
    pub currents: [[i64; 2]; 2],
    /// Converter shifts by target stream and slice; empty with ideal converters.
    pub adc_shifts: Vec<Vec<u32>>,
    /// Shift k of the rate at the end of the epoch.
    pub rate_shift: u32,
}

/// Everything about one epoch. Epoch 0 is the state before the first update.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EpochRecord {
    /// Epochs finished.
    pub epoch: u32,
    /// Updates done.
    pub updates: u64,
    /// Answers given while learning; `null` before the first epoch.
    pub train: Option<Score>,
    /// Validation score.
    pub validation: Option<Score>,
    /// BLAKE3 of state and counters.
    pub state_hash: String,
    /// Layers, in order.
    pub layers: Vec<LayerRecord>,
    /// Pathways, layer by layer, in code order.
    pub pathways: Vec<PathwayRecord>,
    /// Ledger totals so far by phase (`training`, `calibration`, `evaluation`) and event.
    pub events: BTreeMap<String, BTreeMap<String, u64>>,
    /// Cycles so far by phase; absent when the hardware model has no timing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cycles: Option<BTreeMap<String, u64>>,
    /// Wall-clock seconds of learning in this epoch: for people, never compared.
    pub train_seconds: f64,
}

/// The final reading of the test set, once.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TestRecord {
    /// Which epoch's state was read.
    pub epoch: u32,
    /// Why that one: `last` or `best_validation`.
    pub select: String,
    /// Score.
    pub score: Score,
    /// `[true class][predicted class]` counts.
    pub confusion: Vec<Vec<u64>>,
    /// Wrong answers with the greatest margin, at most 24: example number, true class, predicted class.
    pub mistakes: Vec<[u64; 3]>,
    /// Wrong answers of the most frequent confusions, those with the greatest margin: at most 4 of each of 6. Receipts
    /// of earlier programs list none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub confused: Vec<[u64; 3]>,
}

impl TestRecord {
    /// Confusions that happened, the most frequent first: how often, true class, answered class.
    #[must_use]
    pub fn confusions(&self) -> Vec<(u64, usize, usize)> {
        let mut pairs = Vec::new();
        for (truth, row) in self.confusion.iter().enumerate() {
            let wrong = row.iter().enumerate().filter(|&(guess, &n)| guess != truth && n > 0);
            pairs.extend(wrong.map(|(guess, &n)| (n, truth, guess)));
        }
        pairs.sort_by_key(|&(n, truth, guess)| (std::cmp::Reverse(n), truth, guess));
        pairs
    }
}

/// Proof of a run: what went in, what came out, enough to do it again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Receipt {
    /// Version of this program.
    pub version: String,
    /// Version of the arithmetic; `verify` refuses another.
    pub arithmetic: u32,
    /// BLAKE3 of the resolved configuration file.
    pub config_hash: String,
    /// Which data set.
    pub data: String,
    /// BLAKE3 of its content.
    pub data_hash: String,
    /// BLAKE3 of all activation tables.
    pub tables_hash: String,
    /// State hash after each epoch, epoch 0 first.
    pub epoch_hashes: Vec<String>,
    /// `finished`, or `running` while it is not.
    pub status: String,
    /// The final test, when finished.
    pub test: Option<TestRecord>,
    /// Kernel back end that ran (informational: all give the same bits).
    pub kernel: String,
    /// Threads that ran (informational).
    pub threads: usize,
    /// Wall-clock seconds of learning (informational).
    pub train_seconds: f64,
    /// Notes and warnings shown to the user.
    pub warnings: Vec<String>,
}
