//! Grids of runs: what is varied, which points that makes, carrying them out, and the table of results.
//!
//! ```text
//! file.toml  --Sweep-->  points  --plan-->  runs by key  --carry_out-->  store  --table-->  report, export
//! ```
//!
//! A point is a configuration; points that resolve to the same configuration share a run. A finished run is never done
//! again, by whoever asks. Nothing here changes a run's result: each is what `dalean train` would give.

mod axis;
mod carry;
mod file;
mod filter;
mod merge;
mod plan;
mod points;
mod report;
mod row;
mod sample;
mod table;
mod whole;

pub use axis::{Axis, Choice, Value};
pub use carry::{Carried, Options, SweepEvent, carry_out};
pub use file::{Sample, Sweep};
pub use merge::{Merged, Reindexed, Skipped, merge, reindex};
pub use plan::{Estimate, Planned, PlannedRun, Shard, SweepPlan, estimate, plan};
pub use points::Point;
pub use report::{SweepPage, report};
pub use row::{RESULTS, ResultColumn, ResultKind, Row, row, row_as};
pub use sample::{Finding, Sampled, sample};
pub use table::{Results, find, results};
pub use whole::{SweepProgress, Swept, sweep, sweep_part, sweep_runs};

use std::path::PathBuf;

use super::config::ConfigError;
use super::config::file::ExperimentFile;
use super::data::DataError;
use super::run::RunError;
use super::store::index::StoreError;

/// Why a sweep cannot be carried out or shown.
#[derive(Debug, thiserror::Error)]
pub enum SweepError {
    /// A file of the sweep, or a configuration it makes.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The data.
    #[error(transparent)]
    Data(#[from] DataError),
    /// The store.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A run.
    #[error(transparent)]
    Run(#[from] RunError),
    /// A key of the sweep file.
    #[error("`{key}` {found}; {allowed}")]
    Key {
        /// Which.
        key: String,
        /// What was found.
        found: String,
        /// What is allowed.
        allowed: String,
    },
    /// An axis.
    #[error("axis `{axis}` {found}; {allowed}")]
    Axis {
        /// Which.
        axis: String,
        /// What was found.
        found: String,
        /// What is allowed.
        allowed: String,
    },
    /// A condition.
    #[error("filter `{text}`: {error}it must be true or false, and may use {names}")]
    Filter {
        /// The condition.
        text: String,
        /// What is wrong.
        error: String,
        /// What it may use.
        names: String,
    },
    /// Data that an earlier point could not read.
    #[error("{0}")]
    Unread(String),
    /// Files that a sweep leans on are not what they were.
    #[error(
        "a file that the point leans on was changed since the sweep was planned; give the command again"
    )]
    Changed,
    /// No point is left.
    #[error("the sweep has no points: its filters refuse all {points}")]
    Empty {
        /// Before the filters.
        points: usize,
    },
    /// A store has no such sweep.
    #[error("{store} has no sweep `{name}`; it has {known}")]
    NoSweep {
        /// Which store.
        store: PathBuf,
        /// Asked for.
        name: String,
        /// What it has.
        known: String,
    },
    /// Several sweeps and no name.
    #[error("{store} has {known}; name one with --sweep")]
    Several {
        /// Which store.
        store: PathBuf,
        /// What it has.
        known: String,
    },
    /// The same run with two results.
    #[error(
        "run {key} has the state {here} in {store} and {there} in {other}: one of the two machines is wrong; \
         `dalean verify` on both folders tells which"
    )]
    Contradiction {
        /// Which run.
        key: String,
        /// The store that is merged into.
        store: PathBuf,
        /// State hash there.
        here: String,
        /// The store that is merged.
        other: PathBuf,
        /// State hash there.
        there: String,
    },
}

impl SweepError {
    fn key(key: &str, found: &str, allowed: &str) -> Self {
        Self::Key { key: key.into(), found: found.into(), allowed: allowed.into() }
    }

    fn axis(axis: &str, found: &str, allowed: &str) -> Self {
        Self::Axis { axis: axis.into(), found: found.into(), allowed: allowed.into() }
    }
}

/// Keys of an experiment as a table.
fn table(file: &ExperimentFile) -> toml::Table {
    toml::Table::try_from(file).expect("every key has a TOML form")
}
