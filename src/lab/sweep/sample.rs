//! Doing some runs of a store again, to see whether its numbers hold.

use std::collections::BTreeMap;
use std::path::Path;

use super::row::row;
use super::{Row, SweepError};
use crate::lab::data::DataRoot;
use crate::lab::run::{self, Machine, Progress, RunError, Verdict};
use crate::lab::store::folder::{self, FolderError, RunFolder};
use crate::lab::store::index::Store;

/// A run that was looked at.
#[derive(Debug)]
pub struct Sampled {
    /// Which.
    pub key: String,
    /// What came of it.
    pub finding: Finding,
}

/// What looking at a run again showed.
#[derive(Debug)]
pub enum Finding {
    /// It was done again.
    Done(Verdict),
    /// The index says something else of it than its folder does.
    Index {
        /// Which column.
        column: String,
        /// What the index says.
        index: String,
        /// What the folder says.
        folder: String,
    },
    /// Its folder is that of another run.
    Address {
        /// The address of what lies there.
        found: String,
    },
    /// Another process is at it.
    Busy,
    /// It cannot be done again.
    Broken(String),
}

impl Finding {
    /// Whether nothing speaks against what the store says.
    #[must_use]
    pub const fn holds(&self) -> bool {
        matches!(self, Self::Done(Verdict::Same { .. }) | Self::Busy)
    }
}

/// Draws `count` runs by the number `seed`, of those that the index knows and those that have a folder, and does
/// each again: its rows in the index must be what its folder says, its folder must be that of its key, and everything in
/// it must come out the same. Gives the number of runs looked at.
///
/// # Errors
/// When the index or the list of folders cannot be read, or the caller stops it.
pub fn sample(
    store: &Store,
    count: usize,
    seed: u64,
    root: &DataRoot,
    machine: Machine,
    on_run: &mut dyn FnMut(usize, &Sampled),
    on_batch: &mut (dyn FnMut(Progress) -> bool + Send),
) -> Result<usize, SweepError> {
    // what has no row may have lost it: an index is made from the folders it could read
    let folders = store.folders()?.into_iter().filter(|key| store.has_folder(key));
    let mut rows: BTreeMap<String, Vec<String>> = folders.map(|key| (key, vec![])).collect();
    for (key, row, _) in store.rows()? {
        rows.entry(key).or_default().push(row);
    }
    for sweep in store.sweeps()? {
        // rows of points whose run was priced with other constants stand beside that of the run
        for (point, row) in store.points(&sweep.name)? {
            if let (Some(key), Some(row)) = (point.key, row)
                && let Some(known) = rows.get_mut(&key)
                && !known.contains(&row)
            {
                known.push(row);
            }
        }
    }
    let order = |key: &String| {
        let mut hash = blake3::Hasher::new();
        hash.update(&seed.to_le_bytes()).update(key.as_bytes());
        (*hash.finalize().as_bytes(), key.clone())
    };
    let mut drawn: Vec<_> = rows.into_iter().collect();
    drawn.sort_by_cached_key(|(key, _)| order(key));
    drawn.truncate(count);
    let runs = drawn.len();
    for (number, (key, rows)) in drawn.into_iter().enumerate() {
        let finding = match look(store, &key, &rows, root, machine, on_batch) {
            Ok(finding) => finding,
            Err(error @ SweepError::Run(RunError::Stopped { .. })) => return Err(error),
            Err(error) => Finding::Broken(error.to_string()),
        };
        on_run(number + 1, &Sampled { key, finding });
    }
    Ok(runs)
}

fn look(
    store: &Store,
    key: &str,
    rows: &[String],
    root: &DataRoot,
    machine: Machine,
    on_batch: &mut (dyn FnMut(Progress) -> bool + Send),
) -> Result<Finding, SweepError> {
    let path = store.folder(key);
    // a run that nobody is at is compared as far as it came
    let running = rows.is_empty() && is_running(&path);
    let _held = match running.then(|| RunFolder::open(&path)).transpose() {
        Ok(held) => held,
        Err(FolderError::Held { .. }) => return Ok(Finding::Busy),
        Err(error) => return Err(RunError::from(error).into()),
    };
    let found = if running { None } else { Some(row(&path)?.0) };
    let address = super::merge::address_of(&path)?;
    if address != key {
        return Ok(Finding::Address { found: address });
    }
    for (number, text) in rows.iter().enumerate() {
        let Some(found) = &found else { continue };
        let Ok(kept) = serde_json::from_str::<Row>(text) else {
            let (column, folder) = ("row".into(), found.to_json());
            return Ok(Finding::Index { column, index: text.clone(), folder });
        };
        // further rows have prices of their own, and the same counts
        let own_prices = number > 0 && kept.priced_with != found.priced_with;
        if let Some(column) = kept.disagreement(found, !own_prices) {
            let [index, folder] = [&kept, found].map(|row| row.word(column));
            return Ok(Finding::Index { column: column.into(), index, folder });
        }
    }
    Ok(Finding::Done(run::verify(&path, root, machine, None, on_batch)?))
}

fn is_running(path: &Path) -> bool {
    folder::read_receipt(path).is_ok_and(|receipt| receipt.status == "running")
}
