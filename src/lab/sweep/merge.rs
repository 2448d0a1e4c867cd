//! Putting stores together, and making an index again from the folders.
#![expect(clippy::disallowed_methods, reason = "stores live in files")]

use std::fs;
use std::path::Path;

use super::row::row;
use super::{Row, SweepError};
use crate::lab::run::{self, RunError};
use crate::lab::store::ARITHMETIC;
use crate::lab::store::folder::{self, FolderError, RunFolder, names};
use crate::lab::store::index::{Store, StoreError};

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
    /// Sweeps that were new.
    pub sweeps: usize,
    /// Sweeps of a name that means another sweep here; their runs came over, their points did not.
    pub different: Vec<String>,
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

/// Brings the finished runs and the sweeps of `from` into `into`.
///
/// # Errors
/// When a run is damaged, or the two stores hold different results of one run.
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
        let source = from.folder(key);
        let damaged =
            |found: &str| FolderError::Content { path: source.clone(), found: found.into() };
        if address_of(&source)? != *key {
            return Err(RunError::from(damaged("does not hold the run its name says")).into());
        }
        // the folder is asked, not the other index
        let (row, seconds) = row(&source)?;
        if let Some(here) = into.row(key)? {
            let here: Row = serde_json::from_str(&here)
                .map_err(|error| RunError::from(damaged(&format!("has a row that {error}"))))?;
            if here.disagreement(&row, false).is_some() {
                return Err(SweepError::Contradiction {
                    key: key.clone(),
                    store: into.path().into(),
                    here: here.state_hash,
                    other: from.path().into(),
                    there: row.state_hash,
                });
            }
            merged.shared += 1;
            continue;
        }
        match RunFolder::take(&into.folder(key)) {
            Ok(folder) => copy(&source, &folder)?,
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
                into.plan(&sweep, &points)?;
                merged.sweeps += 1;
            }
            Some(here) if *here == sweep => {}
            Some(_) => merged.different.push(sweep.name),
        }
    }
    Ok(merged)
}

/// Copies a finished run; the receipt, which makes it count, comes last.
fn copy(source: &Path, folder: &RunFolder) -> Result<(), SweepError> {
    let fail = |error| StoreError::Io { doing: "read", path: source.into(), error };
    let mut files = Vec::new();
    for entry in fs::read_dir(source).map_err(fail)? {
        let name = entry.map_err(fail)?.file_name().to_string_lossy().into_owned();
        if name != "lock" && !name.starts_with(".part-") {
            files.push(name);
        }
    }
    files.sort_by_key(|name| (name == names::RECEIPT, name.clone()));
    for name in files {
        let bytes = fs::read(source.join(&name)).map_err(fail)?;
        folder.write(&name, &bytes).map_err(RunError::from)?;
    }
    Ok(())
}

/// Makes the rows of the index again from the run folders. Gives the finished runs and those that are not.
///
/// # Errors
/// When folders cannot be listed or the index refuses.
pub fn reindex(
    store: &mut Store,
    on_run: &mut dyn FnMut(usize, usize),
) -> Result<[usize; 2], SweepError> {
    let keys = store.folders()?;
    let mut rows = Vec::new();
    let mut finished = 0;
    for (number, key) in keys.iter().enumerate() {
        on_run(number + 1, keys.len());
        let path = store.folder(key);
        let Ok((row, seconds)) = row(&path) else { continue };
        if address_of(&path).is_ok_and(|address| address == *key) {
            rows.push((key.clone(), row.to_json(), seconds));
            finished += 1;
        }
        if rows.len() == BATCH {
            store.keep(&rows)?;
            rows.clear();
        }
    }
    store.keep(&rows)?;
    Ok([finished, keys.len() - finished])
}
