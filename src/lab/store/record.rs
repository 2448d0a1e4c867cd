//! What a run writes down: one record an epoch, and a receipt at the end. Plain numbers; `null` where there is
//! nothing to count. Counts are integers; wall-clock seconds stand in a record of their own.
//!
//! A field that is added has `#[serde(default)]`, so that runs of earlier programs are read; every other field has to be
//! there, also where it is `null`.

mod note;
mod policy;

pub use note::Note;
pub use policy::{EpisodesRecord, LOSS_BITS, PolicyOutcome, PolicyTest, RETURN_BITS, SumRecord};

use std::collections::BTreeMap;
use std::fmt;

use serde::{Deserialize, Serialize};

use crate::lab::data::Data;
use crate::learn::statistics::PathwayRecord;
use crate::task::classify::Split;

/// Right answers out of how many.
///
/// See [`train`](crate::train()).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
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
    /// Whether its units put out the same whatever was shown in the evaluation of this epoch; absent in records of earlier
    /// programs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mute: Option<bool>,
}

/// What a task says of an epoch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "task", rename_all = "snake_case")]
#[non_exhaustive]
pub enum Outcome {
    /// Classification.
    Classify(ClassifyOutcome),
    /// A policy.
    Policy(Box<PolicyOutcome>),
}

/// What classification says of an epoch.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClassifyOutcome {
    /// Answers given while learning; `null` before the first epoch.
    #[serde(deserialize_with = "Option::deserialize")]
    pub train: Option<Score>,
    /// Validation score.
    #[serde(deserialize_with = "Option::deserialize")]
    pub validation: Option<Score>,
}

impl Outcome {
    /// Name of the task.
    #[must_use]
    pub const fn task(&self) -> &'static str {
        match self {
            Self::Classify(_) => "classify",
            Self::Policy(_) => "policy",
        }
    }

    /// What the best state is chosen by: more is better.
    #[must_use]
    pub fn merit(&self) -> u64 {
        match self {
            Self::Classify(outcome) => outcome.validation.map_or(0, |score| score.correct),
            // the last state of a policy is the one that is tested
            Self::Policy(_) => 0,
        }
    }

    /// Right answers of the validation set, else of the epoch itself; nothing of a task without answers.
    #[must_use]
    pub fn answers(&self) -> Option<Score> {
        match self {
            Self::Classify(outcome) => outcome.validation.or(outcome.train),
            Self::Policy(_) => None,
        }
    }
}

impl EpochRecord {
    /// What classification says of it; nothing of another task.
    #[must_use]
    pub const fn classify(&self) -> Option<&ClassifyOutcome> {
        match &self.outcome {
            Outcome::Classify(outcome) => Some(outcome),
            Outcome::Policy(_) => None,
        }
    }

    /// What a policy says of it; nothing of another task.
    #[must_use]
    pub fn policy(&self) -> Option<&PolicyOutcome> {
        match &self.outcome {
            Outcome::Classify(_) => None,
            Outcome::Policy(outcome) => Some(outcome),
        }
    }

    /// Answers given while learning.
    #[must_use]
    pub fn train(&self) -> Option<Score> {
        self.classify()?.train
    }

    /// Validation score.
    #[must_use]
    pub fn validation(&self) -> Option<Score> {
        self.classify()?.validation
    }
}

/// Everything about one epoch: what the chip did and holds, and what the task says of it. Epoch 0 is the state before the first update.
///
/// See [`train`](crate::train()).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct EpochRecord {
    /// Epochs finished.
    pub epoch: u32,
    /// Updates done.
    pub updates: u64,
    /// What the task says of it.
    pub outcome: Outcome,
    /// BLAKE3 of state and counters.
    pub state_hash: String,
    /// Layers, in order.
    pub layers: Vec<LayerRecord>,
    /// Pathways, layer by layer, in code order.
    pub pathways: Vec<PathwayRecord>,
    /// Ledger totals so far by phase (`training`, `calibration`, `evaluation`) and event.
    pub events: BTreeMap<String, BTreeMap<String, u64>>,
    /// Cycles so far by phase; `null` when the hardware model has no timing.
    #[serde(deserialize_with = "Option::deserialize")]
    pub cycles: Option<BTreeMap<String, u64>>,
    /// What a later program counts.
    #[cfg(feature = "grown")]
    #[serde(default)]
    pub grown: u64,
}

/// What a task says of the final test.
///
/// See [`train`](crate::train()).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "task", rename_all = "snake_case")]
#[non_exhaustive]
pub enum TestOutcome {
    /// Classification.
    Classify(TestRecord),
    /// A policy.
    Policy(PolicyTest),
}

impl TestOutcome {
    /// After which epoch the state stood that was tested.
    #[must_use]
    pub const fn epoch(&self) -> u32 {
        match self {
            Self::Classify(test) => test.epoch,
            Self::Policy(test) => test.epoch,
        }
    }

    /// What classification says of it; nothing of another task.
    #[must_use]
    pub const fn classify(&self) -> Option<&TestRecord> {
        match self {
            Self::Classify(test) => Some(test),
            Self::Policy(_) => None,
        }
    }

    /// What a policy says of it; nothing of another task.
    #[must_use]
    pub const fn policy(&self) -> Option<&PolicyTest> {
        match self {
            Self::Classify(_) => None,
            Self::Policy(test) => Some(test),
        }
    }
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
    /// Wrong answers of the most frequent confusions, those with the greatest margin: at most 4 of each of 6.
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

/// What was learnt from, as far as numbers tell. A policy has no examples: what it is shown has `features` numbers or
/// lines.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DataRecord {
    /// BLAKE3 of its content.
    pub hash: String,
    /// Training, validation and test examples.
    pub examples: [usize; 3],
    /// Values of an example.
    pub features: usize,
    /// Greatest value.
    pub full_scale: u8,
    /// Classes; of a policy, actions, or numbers of an action.
    pub classes: usize,
    /// Height, width and channels, where examples are pictures.
    #[serde(deserialize_with = "Option::deserialize")]
    pub image: Option<[usize; 3]>,
    /// What the classes are called, where it is not by their numbers.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub names: Vec<String>,
    /// Mean of each channel over what was learnt from, where inputs lie above and below it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub middles: Vec<u8>,
}

impl DataRecord {
    /// What was loaded.
    #[must_use]
    pub fn of(data: &Data) -> Self {
        let Split { train, validation, test } = &data.split;
        Self {
            hash: data.hash.clone(),
            examples: [train.len(), validation.len(), test.len()],
            features: train.features(),
            full_scale: train.full_scale(),
            classes: train.classes(),
            image: data.image.map(|shape| [shape.height, shape.width, shape.channels]),
            names: data.names.clone(),
            middles: vec![],
        }
    }
}

impl fmt::Display for DataRecord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { examples: [train, validation, test], features, full_scale, classes, .. } = self;
        if self.examples == [0; 3] {
            return write!(f, "{features} inputs, {classes} actions");
        }
        write!(
            f,
            "{train} training, {validation} validation, {test} test examples of {features} values 0 to {full_scale}, \
             {classes} classes"
        )
    }
}

/// The rate of a layer: the shift is a whole number, so a rate becomes another one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct RateRecord {
    /// Layer, from 0 at the input.
    pub layer: usize,
    /// Rate asked for, its multiplier included.
    pub asked: f64,
    /// Rate that shift and mantissa give before any decay.
    pub effective: f64,
    /// Shift k before any decay.
    pub shift: u32,
    /// Small factor beside it.
    pub mantissa: u32,
}

impl fmt::Display for RateRecord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { layer, asked, effective, shift, mantissa } = self;
        let off = 100.0 * (effective / asked - 1.0);
        write!(
            f,
            "layer {layer}: {asked} asked for, {effective:.4} in effect ({off:+.1} %; {mantissa} x 2^-{shift})"
        )
    }
}

/// A state other than the last one that is kept.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BestRecord {
    /// After which epoch.
    pub epoch: u32,
    /// BLAKE3 of the bytes of its checkpoint.
    pub checkpoint: String,
}

/// Proof of a run: what went in, what came out, enough to do it again. Nothing in it depends on machine or time; a run
/// that is done again gives the same bytes.
///
/// See [`train`](crate::train()).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Receipt {
    /// Version of the arithmetic; `verify` refuses another.
    pub arithmetic: u32,
    /// `finished`, or `running` while it is not.
    pub status: String,
    /// Address: what decides the result.
    pub run: String,
    /// BLAKE3 of the bytes of `config.toml`.
    pub config: String,
    /// What was learnt from.
    pub data: DataRecord,
    /// BLAKE3 of all activation tables.
    pub tables: String,
    /// BLAKE3 of the bytes of `metrics.jsonl` up to the last epoch below.
    pub metrics: String,
    /// BLAKE3 of the bytes of `ledger.json`, when finished.
    #[serde(deserialize_with = "Option::deserialize")]
    pub ledger: Option<String>,
    /// BLAKE3 of the bytes of the checkpoint after the last epoch below.
    pub checkpoint: String,
    /// The state with the best validation score, where that is chosen.
    #[serde(deserialize_with = "Option::deserialize")]
    pub best: Option<BestRecord>,
    /// Whether checkpoints stay when the run is finished.
    pub states: bool,
    /// State hash after each epoch, epoch 0 first.
    pub epoch_hashes: Vec<String>,
    /// The final test, when finished.
    #[serde(deserialize_with = "Option::deserialize")]
    pub test: Option<TestOutcome>,
    /// What the run showed, as far as a receipt says it; `lab::run::notes` has the rest.
    pub notes: Vec<Note>,
    /// Rates of the layers; empty in receipts of earlier programs.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rates: Vec<RateRecord>,
}

impl Receipt {
    /// What classification says of the final test; nothing of another task, or when there was none.
    #[must_use]
    pub fn classified(&self) -> Option<&TestRecord> {
        self.test.as_ref()?.classify()
    }

    /// What a policy says of the final test; nothing of another task, or when there was none.
    #[must_use]
    pub fn played(&self) -> Option<&PolicyTest> {
        self.test.as_ref()?.policy()
    }
}

/// What depends on machine and time: shown to people, marked as such, and part of no hash.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TimingRecord {
    /// Version of this program.
    pub version: String,
    /// Kernel back end that ran: all give the same bits.
    pub kernel: String,
    /// Threads that ran.
    pub threads: usize,
    /// Wall-clock seconds of learning, an epoch each, epoch 0 first.
    pub epoch_seconds: Vec<f64>,
    /// Steps of all environments a second, an epoch each from the first one on; of policies.
    #[serde(rename = "charts/SPS", default, skip_serializing_if = "Vec::is_empty")]
    pub steps_per_second: Vec<f64>,
}

impl TimingRecord {
    /// Steps a second of every epoch, of the steps that records tell.
    pub(crate) fn note_steps(&mut self, records: &[EpochRecord]) {
        let steps = records.iter().filter_map(|record| Some(record.policy()?.steps));
        let steps: Vec<u64> = steps.collect();
        let each = steps.windows(2).zip(self.epoch_seconds.iter().skip(1));
        let each =
            each.map(|(two, seconds)| two[1].saturating_sub(two[0]) as f64 / seconds.max(1e-9));
        self.steps_per_second = each.collect();
    }

    /// Wall-clock seconds of learning.
    #[must_use]
    pub fn train_seconds(&self) -> f64 {
        self.epoch_seconds.iter().sum()
    }
}
