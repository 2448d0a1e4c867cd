//! The results of a finished run as one row, read off its folder alone.

use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::{Map, Number, Value};

use super::SweepError;
use crate::chip::engine::Phase;
use crate::lab::config::CostClass;
use crate::lab::price::Cost;
use crate::lab::run::{self, Prices, RunError, reprice_as};
use crate::lab::store::folder;
use crate::lab::store::record::{EpochRecord, PolicyOutcome, Receipt, Score, TestOutcome};
use crate::lab::table::ColumnUnit;

/// What the numbers of a column are made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ResultKind {
    /// Counts of the run: whole numbers.
    Whole,
    /// Quotients of such counts.
    Quotient,
    /// Counts and the constants of a chip, which are no part of a run.
    Priced,
}

/// A column of results.
#[derive(Debug, Clone, Copy)]
pub struct ResultColumn {
    /// Its name.
    pub name: &'static str,
    /// Words for people.
    pub label: &'static str,
    /// What it is measured in.
    pub unit: ColumnUnit,
    /// What its numbers are made of.
    pub kind: ResultKind,
    /// The task whose runs have it; `None`: all.
    pub task: Option<&'static str>,
    of: fn(&Facts<'_>) -> Option<Number>,
}

/// What a row is made of.
struct Facts<'a> {
    receipt: &'a Receipt,
    /// The last record.
    last: &'a EpochRecord,
    /// The record of the epoch whose state read the test set.
    read: &'a EpochRecord,
    cost: Cost,
    converters_mm2: Option<f64>,
}

impl Facts<'_> {
    /// Ledger total of the training.
    fn event(&self, name: &str) -> u64 {
        self.last.events.get("training").and_then(|events| events.get(name)).copied().unwrap_or(0)
    }

    fn policy(&self) -> Option<&PolicyOutcome> {
        self.last.policy()
    }

    fn pathways(&self, of: fn(&crate::learn::statistics::PathwayRecord) -> u64) -> u64 {
        self.last.pathways.iter().map(of).sum()
    }

    /// Cells that are worn out, where cells wear out.
    fn worn(&self) -> Option<u64> {
        let wear = self.last.pathways.iter().map(|one| one.wear.as_ref());
        wear.map(|wear| wear.map(|wear| wear.worn)).sum()
    }

    fn levels(&self, bank: usize) -> u64 {
        self.last.layers.iter().map(|layer| layer.levels[bank]).sum()
    }

    /// Typical joules of an image, an update or a decision of a phase, if every part of them has a price.
    fn piece(&self, phase: Phase, class: Option<CostClass>) -> Option<Number> {
        let one = self.cost.of_piece(phase)?;
        let total = match class {
            None => one.total,
            Some(class) => one.split.iter().find(|split| split.class == class)?.total,
        };
        Number::from_f64(total.whole()?[1])
    }

    fn piece_seconds(&self, phase: Phase) -> Option<Number> {
        self.cost.of_piece(phase)?.seconds.and_then(Number::from_f64)
    }

    fn joules(&self, bound: usize) -> Option<Number> {
        self.cost.energy.and_then(|energy| Number::from_f64(energy.whole()?[bound]))
    }
}

/// A quotient; nothing when there is nothing to divide by.
fn over(part: u64, whole: u64) -> Option<Number> {
    if whole == 0 { None } else { Number::from_f64(part as f64 / whole as f64) }
}

fn real(number: Option<f64>) -> Option<Number> {
    number.and_then(Number::from_f64)
}

fn share(score: Option<Score>) -> Option<Number> {
    score.and_then(|score| over(score.correct, score.total))
}

macro_rules! task {
    () => {
        None
    };
    ($task:literal) => {
        Some($task)
    };
}

macro_rules! results {
    ($($(#[cfg($cfg:meta)])? $name:literal, $label:literal, $unit:ident, $kind:ident $(of $task:literal)?, $of:expr;)*) => {
        &[$($(#[cfg($cfg)])? ResultColumn { name: $name, label: $label, unit: ColumnUnit::$unit, kind: ResultKind::$kind, task: task!($($task)?), of: $of },)*]
    };
}

/// All results, in the order of the table.
#[rustfmt::skip]
pub const RESULTS: &[ResultColumn] = results![
    "test_accuracy", "test accuracy", Fraction, Quotient of "classify", |f| share(f.receipt.classified().map(|test| test.score));
    "validation_accuracy", "validation accuracy", Fraction, Quotient of "classify", |f| share(f.read.validation());
    "train_accuracy", "accuracy while learning", Fraction, Quotient of "classify", |f| share(f.last.train());
    "return_mean", "mean return of the final test", Plain, Quotient of "policy", |f| f.receipt.played().and_then(|test| real(test.episodes.mean()));
    "return_least", "least return of the final test", Plain, Quotient of "policy", |f| f.receipt.played().and_then(|test| real(test.episodes.return_range.map(|range| range[1])));
    "return_most", "greatest return of the final test", Plain, Quotient of "policy", |f| f.receipt.played().and_then(|test| real(test.episodes.return_range.map(|range| range[2])));
    "return_evaluated", "mean return after the last epoch", Plain, Quotient of "policy", |f| f.policy().and_then(|of| real(of.evaluation.mean()));
    "return_learning", "mean return while learning", Plain, Quotient of "policy", |f| f.policy().and_then(|of| real(of.episodic_return));
    "steps", "environment steps", Count, Whole of "policy", |f| f.policy().map(|of| of.steps.into());
    "entropy", "entropy of the policy", Plain, Quotient of "policy", |f| f.policy().and_then(|of| real(of.mean_entropy));
    "explained_variance", "explained variance of returns", Plain, Quotient of "policy", |f| f.policy().and_then(|of| real(of.explained_variance));
    "test_epoch", "epoch of the state that was tested", Plain, Whole, |f| f.receipt.test.as_ref().map(|test| test.epoch().into());
    "epochs", "epochs", Plain, Whole, |f| Some(f.last.epoch.into());
    "updates", "updates", Count, Whole, |f| Some(f.last.updates.into());
    "cells", "cells", Count, Whole, |f| Some(f.pathways(|p| p.cells).into());
    "floor_fraction", "cells at the floor", Fraction, Quotient, |f| over(f.pathways(|p| p.floor), f.pathways(|p| p.cells));
    "pruned_fraction", "cells pruned for good", Fraction, Quotient, |f| over(f.pathways(|p| p.pruned), f.pathways(|p| p.cells));
    "worn_fraction", "cells worn out", Fraction, Quotient, |f| f.worn().and_then(|worn| over(worn, f.pathways(|p| p.cells)));
    "pulses_a_cell", "pulses a cell was given", Plain, Quotient, |f| over(f.event("pulses_attempted"), f.pathways(|p| p.cells));
    "ei_ratio", "E/I of stored levels", Plain, Quotient, |f| over(f.levels(0), f.levels(1));
    "pulses_attempted", "pulses given", Count, Whole, |f| Some(f.event("pulses_attempted").into());
    "pulses_effective", "pulses that moved a cell", Count, Whole, |f| Some(f.event("pulses_effective").into());
    "bounded_fraction", "writes cut by the bound", Fraction, Quotient, |f| over(f.event("bounded"), f.event("requested"));
    "saturated_fraction", "conversions that saturated", Fraction, Quotient, |f| over(f.event("saturated_conversions"), f.event("conversions"));
    "cycles", "cycles on the chip", Cycles, Whole, |f| f.cost.cycles.map(Number::from);
    "chip_seconds", "time on the chip", Seconds, Priced, |f| f.cost.seconds.and_then(Number::from_f64);
    "joules", "energy on the chip", Joules, Priced, |f| f.joules(1);
    "joules_low", "energy on the chip, low", Joules, Priced, |f| f.joules(0);
    "joules_high", "energy on the chip, high", Joules, Priced, |f| f.joules(2);
    "joules_assumed", "share of energy that leans on assumed constants", Fraction, Priced,
        |f| f.cost.energy.and_then(|_| Number::from_f64(f.cost.assumed_share));
    "parts_priced", "share of the parts that have a price", Fraction, Priced, |f| f.cost.energy.and_then(|e| over(e.priced as u64, e.parts as u64));
    "learn_joules", "energy to learn from an image", Joules, Priced of "classify", |f| f.piece(Phase::Training, None);
    "learn_joules_device", "energy to learn from an image, device", Joules, Priced of "classify", |f| f.piece(Phase::Training, Some(CostClass::Device));
    "learn_joules_converter", "energy to learn from an image, converters", Joules, Priced of "classify", |f| f.piece(Phase::Training, Some(CostClass::Converter));
    "learn_joules_digital", "energy to learn from an image, digital", Joules, Priced of "classify", |f| f.piece(Phase::Training, Some(CostClass::Digital));
    "learn_joules_static", "energy to learn from an image, static", Joules, Priced of "classify", |f| f.piece(Phase::Training, Some(CostClass::Static));
    "learn_seconds", "time to learn from an image", Seconds, Priced of "classify", |f| f.piece_seconds(Phase::Training);
    "read_joules", "energy to read an image", Joules, Priced of "classify", |f| f.piece(Phase::Evaluation, None);
    "read_joules_device", "energy to read an image, device", Joules, Priced of "classify", |f| f.piece(Phase::Evaluation, Some(CostClass::Device));
    "read_joules_converter", "energy to read an image, converters", Joules, Priced of "classify", |f| f.piece(Phase::Evaluation, Some(CostClass::Converter));
    "read_joules_digital", "energy to read an image, digital", Joules, Priced of "classify", |f| f.piece(Phase::Evaluation, Some(CostClass::Digital));
    "read_joules_static", "energy to read an image, static", Joules, Priced of "classify", |f| f.piece(Phase::Evaluation, Some(CostClass::Static));
    "read_seconds", "time to read an image", Seconds, Priced of "classify", |f| f.piece_seconds(Phase::Evaluation);
    "update_joules", "energy of an update", Joules, Priced of "policy", |f| f.piece(Phase::Training, None);
    "update_seconds", "time of an update", Seconds, Priced of "policy", |f| f.piece_seconds(Phase::Training);
    "decision_joules", "energy of a decision", Joules, Priced of "policy", |f| f.piece(Phase::Evaluation, None);
    "decision_joules_device", "energy of a decision, device", Joules, Priced of "policy", |f| f.piece(Phase::Evaluation, Some(CostClass::Device));
    "decision_joules_converter", "energy of a decision, converters", Joules, Priced of "policy", |f| f.piece(Phase::Evaluation, Some(CostClass::Converter));
    "decision_joules_digital", "energy of a decision, digital", Joules, Priced of "policy", |f| f.piece(Phase::Evaluation, Some(CostClass::Digital));
    "decision_joules_static", "energy of a decision, static", Joules, Priced of "policy", |f| f.piece(Phase::Evaluation, Some(CostClass::Static));
    "decision_seconds", "time of a decision", Seconds, Priced of "policy", |f| f.piece_seconds(Phase::Evaluation);
    "converters_mm2", "area of converters", SquareMillimetres, Priced, |f| f.converters_mm2.and_then(Number::from_f64);
    #[cfg(feature = "grown")] "grown", "what a later program shows", Count, Whole, |f| Some(f.last.grown.into());
];

/// One finished run. Nothing in it depends on the machine or the time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Row {
    /// Results by name; those that the run does not have are absent.
    pub results: Map<String, Value>,
    /// Hash of the last state.
    pub state_hash: String,
    /// Hash of the data.
    pub data_hash: String,
    /// Name of the chip.
    pub hardware: String,
    /// What its model says of what is left out: `key = text`.
    pub not_simulated: Vec<String>,
    /// Effects of real chips that it is simulated without: keys of [`crate::lab::config::EFFECTS`] and its own.
    #[serde(default)]
    pub absent: Vec<String>,
    /// [`Prices::fingerprint`] of the constants that its prices were made with.
    #[serde(default)]
    pub priced_with: String,
}

impl Row {
    /// The first thing that one run cannot have in two ways: state, data, or a number that both rows have. A column that
    /// one program does not know says nothing. Prices follow from constants, which are no part of a run: they count
    /// where both rows come from one folder.
    #[must_use]
    pub fn disagreement(&self, other: &Self, one_folder: bool) -> Option<&'static str> {
        if self.state_hash != other.state_hash {
            return Some("state_hash");
        }
        if self.data_hash != other.data_hash {
            return Some("data_hash");
        }
        let counts = |column: &&ResultColumn| one_folder || column.kind != ResultKind::Priced;
        let differs = |column: &&ResultColumn| {
            let both = self.results.get(column.name).zip(other.results.get(column.name));
            both.is_some_and(|(mine, theirs)| mine != theirs)
        };
        // two programs may know different columns, but no folder gives what its row has and it has not
        let made_up = |column: &&ResultColumn| {
            one_folder
                && self.results.contains_key(column.name)
                && !other.results.contains_key(column.name)
        };
        let wrong = |column: &&ResultColumn| differs(column) || made_up(column);
        let column = RESULTS.iter().filter(counts).find(wrong).map(|column| column.name);
        let said = one_folder && self.priced_with == other.priced_with;
        column.or_else(|| (said && self.hardware != other.hardware).then_some("hardware")).or_else(
            || (said && self.not_simulated != other.not_simulated).then_some("not_simulated"),
        )
    }

    /// What it says of a column, for people.
    pub(super) fn word(&self, column: &str) -> String {
        match column {
            "state_hash" => self.state_hash.clone(),
            "data_hash" => self.data_hash.clone(),
            "hardware" => self.hardware.clone(),
            "not_simulated" => self.not_simulated.join(", "),
            _ => self.results.get(column).map_or_else(|| "nothing".into(), Value::to_string),
        }
    }

    /// As an index keeps it.
    pub(super) fn to_json(&self) -> String {
        serde_json::to_string(self).expect("rows have a JSON form")
    }
}

/// Reads a finished run; with it, the seconds its learning took.
///
/// # Errors
/// When it is not finished or damaged.
pub fn row(path: &Path) -> Result<(Row, f64), SweepError> {
    row_as(path, None)
}

/// The same, with the constants of another chip that would have done the same.
///
/// # Errors
/// As [`row`].
pub fn row_as(path: &Path, prices: Option<Prices>) -> Result<(Row, f64), SweepError> {
    let receipt = folder::read_receipt(path).map_err(RunError::from)?;
    let records = run::records(path, &receipt)?;
    let priced = reprice_as(path, prices)?;
    let damaged = |found: &str| {
        let found = found.into();
        RunError::from(folder::FolderError::Content { path: path.into(), found })
    };
    let last = records.last().ok_or_else(|| damaged("has no record"))?;
    if receipt.status != "finished" {
        return Err(damaged("is not finished").into());
    }
    let tested = receipt.test.as_ref().map(TestOutcome::epoch);
    let read = records.iter().find(|record| Some(record.epoch) == tested).unwrap_or(last);
    let facts = Facts {
        receipt: &receipt,
        last,
        read,
        cost: priced.cost(),
        converters_mm2: priced.converters_mm2(),
    };
    let task = last.outcome.task();
    let columns = RESULTS.iter().filter(|column| column.task.is_none_or(|of| of == task));
    let results = columns.filter_map(|column| {
        let value = (column.of)(&facts)?;
        Some((column.name.to_owned(), Value::Number(value)))
    });
    let not_simulated = priced.absent.iter().filter_map(|one| {
        let chip = one.chip.as_ref()?;
        Some(format!("{} = {chip}", one.effect))
    });
    let row = Row {
        results: results.collect(),
        state_hash: last.state_hash.clone(),
        data_hash: receipt.data.hash.clone(),
        hardware: priced.priced_as.clone(),
        not_simulated: not_simulated.collect(),
        absent: priced.absent.iter().map(|one| one.effect.clone()).collect(),
        priced_with: priced.fingerprint.clone(),
    };
    Ok((row, folder::read_timing(path).train_seconds()))
}
