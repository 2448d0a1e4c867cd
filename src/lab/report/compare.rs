//! Runs side by side, as a page draws them: plain numbers and texts, read off run folders by [`crate::lab::runs`].

mod energy;
mod page;

pub use page::html;

use crate::lab::price::Cost;
use crate::lab::store::record::{EpochRecord, TestOutcome};
use crate::lab::table::ColumnUnit;

/// One of the runs.
#[derive(Debug, Clone, PartialEq)]
pub struct ComparedRun {
    /// Name of its folder.
    pub name: String,
    /// Its folder, as it was given.
    pub folder: String,
    /// Its title: data, rule, chip, what differs from saying nothing.
    pub title: String,
    /// `finished`, or `running` while it is not.
    pub status: String,
    /// Hash of its data.
    pub data: String,
    /// One an epoch, epoch 0 first.
    pub records: Vec<EpochRecord>,
    /// Epochs that its configuration asks for.
    pub epochs: u32,
    /// The final test.
    pub test: Option<TestOutcome>,
    /// What it cost on its chip, when finished.
    pub cost: Option<Cost>,
    /// The first epoch whose state is another than that of the first run; nothing when none is, or for the first itself.
    pub differs_from: Option<u32>,
    /// What the run showed, in words.
    pub notes: Vec<String>,
}

/// A key that the runs do not all have alike.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ComparedKey {
    /// The key in full.
    pub key: String,
    /// Its value in each run, as TOML; nothing where a run does not have it.
    pub values: Vec<Option<String>>,
}

/// A result of the runs.
#[derive(Debug, Clone, PartialEq)]
pub struct ComparedResult {
    /// Its name in tables and exports.
    pub name: &'static str,
    /// Words for people.
    pub label: &'static str,
    /// What it is measured in.
    pub unit: ColumnUnit,
    /// Its value in each run; nothing where a run does not have it.
    pub values: Vec<Option<f64>>,
}

/// Runs side by side, in the order they were given.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// The runs.
    pub runs: Vec<ComparedRun>,
    /// Keys that differ, by name.
    pub keys: Vec<ComparedKey>,
    /// Results, in the order of the tables of sweeps.
    pub results: Vec<ComparedResult>,
}

impl Comparison {
    /// Whether all runs learnt from the same data.
    #[must_use]
    pub fn same_data(&self) -> bool {
        self.runs.windows(2).all(|two| two[0].data == two[1].data)
    }
}
