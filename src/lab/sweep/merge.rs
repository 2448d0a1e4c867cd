//! Putting stores together, and making an index again from the folders.

use std::fs;
use std::path::Path;

use super::row::row;
use super::{Row, SweepError};
use crate::lab::run::{self, RunError};
use crate::lab::store::folder::{self, FolderError, RunFolder, names};
use crate::lab::store::index::{Store, StoreError};
use crate::lab::store::{ARITHMETIC, place};

/// Rows written to an index at a time.
const BATCH: usize = 256;

/// What came over.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Merged {
    /// Runs that were new.
    pub runs: usize,
    /// Runs that both had, with the same state.
    pub shared: usize,
    /// Runs left behind: another process is at them.
    pub held: usize,
    /// Runs left behind: they are broken, or say something else than the same run here.
    pub skipped: Vec<Skipped>,
    /// Sweeps that were new.
    pub sweeps: usize,
    /// Sweeps of a name that means another sweep here; their runs came over, their points did not.
    pub different: Vec<String>,
}

/// A run folder that was left as it is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Skipped {
    /// Its key.
    pub key: String,
    /// What is wrong with it.
    pub why: String,
}

/// What an index was made of.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Reindexed {
    /// Finished runs.
    pub finished: usize,
    /// Folders of runs that are not.
    pub unfinished: usize,
    /// Folders that say that they are finished and cannot be read as that.
    pub damaged: Vec<Skipped>,
    /// Runs that the index knew and that have no folder, or a damaged one.
    pub forgotten: usize,
}

/// The key a finished run should have, from what is in its folder.
pub(super) fn address_of(path: &Path) -> Result<String, SweepError> {
    let receipt = folder::read_receipt(path).map_err(RunError::from)?;
    if receipt.arithmetic != ARITHMETIC {
        let (found, wanted) = (receipt.arithmetic, ARITHMETIC);
        return Err(RunError::Arithmetic { found, wanted }.into());
    }
    run::address_of(path, &receipt.data).map_err(SweepError::from)
}

/// The row of a finished run that lies where its key says, read off plain files alone.
fn own_row(store: &Store, key: &str) -> Result<(Row, f64), SweepError> {
    let path = store.folder(key);
    let damaged = |found: &str| {
        let found = found.into();
        SweepError::from(RunError::from(FolderError::Content { path: path.clone(), found }))
    };
    let is_folder = |path: &Path| fs::symlink_metadata(path).is_ok_and(|found| found.is_dir());
    if !path.parent().is_some_and(is_folder) || !is_folder(&path) {
        return Err(damaged("is no folder of this store"));
    }
    let files = files(&path).map_err(|error| damaged(&error.to_string()))?;
    if let Some(name) = files.iter().find(|name| !place::is_plain(&path.join(name))) {
        return Err(damaged(&format!("holds a {name} that is no plain file")));
    }
    let found = row(&path)?;
    if address_of(&path)? != *key {
        return Err(damaged("does not hold the run its name says"));
    }
    Ok(found)
}

/// Names of the files of a run that lie in a folder; what else may lie there is nobody's.
fn files(path: &Path) -> std::io::Result<Vec<String>> {
    let mut files = Vec::new();
    for entry in fs::read_dir(path)? {
        files.extend(entry?.file_name().into_string().ok().filter(|name| folder::is_of_run(name)));
    }
    files.sort_by_key(|name| (name == names::RECEIPT, name.clone()));
    Ok(files)
}

/// Brings the finished runs and the sweeps of `from` into `into`. What is broken there is left behind, with the reason.
///
/// # Errors
/// When an index refuses, or the place that is written to.
pub fn merge(
    into: &mut Store,
    from: &Store,
    on_run: &mut dyn FnMut(usize, usize),
) -> Result<Merged, SweepError> {
    let mut merged = Merged::default();
    let rows = from.rows()?;
    let mut fresh = Vec::new();
    for (number, (key, ..)) in rows.iter().enumerate() {
        on_run(number + 1, rows.len());
        // the folder is asked, not the other index
        let (row, seconds) = match own_row(from, key) {
            Ok(found) => found,
            Err(error) => {
                merged.skipped.push(Skipped { key: key.clone(), why: error.to_string() });
                continue;
            }
        };
        if let Some(here) = into.row(key)?.filter(|_| into.has_folder(key)) {
            match contradiction(into, from, key, &here, &row) {
                Some(why) => merged.skipped.push(Skipped { key: key.clone(), why }),
                None => merged.shared += 1,
            }
            continue;
        }
        match RunFolder::take(&into.folder(key)) {
            Ok(folder) => copy(&from.folder(key), &folder)?,
            Err(FolderError::Held { .. }) => {
                merged.held += 1;
                continue;
            }
            Err(error) => return Err(RunError::from(error).into()),
        }
        fresh.push((key.clone(), row.to_json(), seconds));
        merged.runs += 1;
        if fresh.len() == BATCH {
            into.keep(&fresh)?;
            fresh.clear();
        }
    }
    into.keep(&fresh)?;
    let here = into.sweeps()?;
    for sweep in from.sweeps()? {
        match here.iter().find(|here| here.name == sweep.name) {
            None => {
                let points: Vec<_> =
                    from.points(&sweep.name)?.into_iter().map(|(point, _)| point).collect();
                into.plan(&sweep, &points, false)?;
                merged.sweeps += 1;
            }
            Some(here) if *here == sweep => {}
            Some(_) => merged.different.push(sweep.name),
        }
    }
    Ok(merged)
}

/// Why a run here and one there cannot both be right.
fn contradiction(into: &Store, from: &Store, key: &str, here: &str, row: &Row) -> Option<String> {
    let Ok(here) = serde_json::from_str::<Row>(here) else {
        return Some(format!(
            "the index of {} has a row of it that cannot be read",
            into.path().display()
        ));
    };
    here.disagreement(row, false)?;
    let error = SweepError::Contradiction {
        key: key.into(),
        store: into.path().into(),
        here: here.state_hash,
        other: from.path().into(),
        there: row.state_hash.clone(),
    };
    Some(error.to_string())
}

/// Copies a finished run; the receipt, which makes it count, comes last.
fn copy(source: &Path, folder: &RunFolder) -> Result<(), SweepError> {
    let fail = |error| StoreError::Io { doing: "read", path: source.into(), error };
    for name in files(source).map_err(fail)? {
        folder.copy(source, &name).map_err(RunError::from)?;
    }
    Ok(())
}

/// Makes the rows of the index again from the run folders.
///
/// # Errors
/// When folders cannot be listed or the index refuses.
pub fn reindex(
    store: &mut Store,
    on_run: &mut dyn FnMut(usize, usize),
) -> Result<Reindexed, SweepError> {
    let keys = store.folders()?;
    let mut made = Reindexed::default();
    let mut rows = Vec::new();
    let mut kept = Vec::new();
    for (number, key) in keys.iter().enumerate() {
        on_run(number + 1, keys.len());
        match own_row(store, key) {
            Ok((row, seconds)) => {
                rows.push((key.clone(), row.to_json(), seconds));
                kept.push(key.clone());
                made.finished += 1;
            }
            Err(_) if is_unfinished(&store.folder(key)) => made.unfinished += 1,
            Err(error) => {
                made.damaged.push(Skipped { key: key.clone(), why: error.to_string() });
            }
        }
        if rows.len() == BATCH {
            store.keep(&rows)?;
            rows.clear();
        }
    }
    store.keep(&rows)?;
    made.forgotten = store.forget_others(&kept)?;
    Ok(made)
}

/// Whether a folder is that of a run that someone may go on with: no receipt yet, or one that says so.
fn is_unfinished(path: &Path) -> bool {
    let none = fs::symlink_metadata(path.join(names::RECEIPT)).is_err();
    // the ledger is written when the last epoch is done
    let begun = none && fs::symlink_metadata(path.join(names::LEDGER)).is_err();
    begun || folder::read_receipt(path).is_ok_and(|receipt| receipt.status == "running")
}
