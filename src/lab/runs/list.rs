//! Which runs lie in a folder, the newest first.
#![expect(
    clippy::disallowed_types,
    reason = "the order of a list, and nothing else, depends on when files were written"
)]

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use crate::lab::config::Difference;
use crate::lab::near;
use crate::lab::run::{self, RunError};
use crate::lab::store::folder::{self, FolderError, names};
use crate::lab::store::index::{INDEX, Store};
use crate::lab::store::record::{EpochRecord, Score, TestOutcome};
use crate::lab::sweep::SweepError;

/// How far a run is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RunStatus {
    /// Done.
    Finished,
    /// Being carried out, or stopped: it can be continued.
    Unfinished,
    /// Its files contradict one another, or cannot be read.
    Damaged(String),
}

impl RunStatus {
    /// In a word.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Finished => "finished",
            Self::Unfinished => "unfinished",
            Self::Damaged(_) => "damaged",
        }
    }
}

/// A run in a list.
#[derive(Debug, Clone, PartialEq)]
pub struct ListedRun {
    /// Its folder.
    pub folder: PathBuf,
    /// How far it is.
    pub status: RunStatus,
    /// Data, rule and chip.
    pub what: [String; 3],
    /// What differs from saying nothing but those.
    pub differences: Vec<Difference>,
    /// Seed of all draws.
    pub seed: u64,
    /// Epochs finished, and asked for.
    pub epochs: [u32; 2],
    /// Score of the final test.
    pub test: Option<Score>,
    /// Validation score of the epoch that was tested, or of the last one.
    pub validation: Option<Score>,
    /// Of a policy: mean returns of the final test, and after that epoch.
    pub returns: Option<[Option<f64>; 2]>,
    written: Option<SystemTime>,
}

/// Runs below a folder: of a folder of runs those in it, of a store all of its runs, of the folder of a run itself. The
/// newest first; those of one moment by name.
///
/// # Errors
/// When the folder cannot be listed.
pub fn list(root: &Path) -> Result<Vec<ListedRun>, SweepError> {
    let is_run = |path: &Path| path.join(names::CONFIG).is_file();
    let folders: Vec<PathBuf> = if root.join(INDEX).is_file() {
        let store = Store::existing(root)?;
        store.folders()?.iter().map(|key| store.folder(key)).collect()
    } else if is_run(root) {
        vec![root.into()]
    } else {
        let cannot = |error| FolderError::Io {
            doing: "list",
            path: root.into(),
            error,
            hint: "; name a folder of runs, such as runs, or a store",
        };
        let entries = fs::read_dir(root).map_err(cannot).map_err(RunError::from)?;
        entries.flatten().map(|entry| entry.path()).filter(|path| is_run(path)).collect()
    };
    let mut runs: Vec<ListedRun> = folders.into_iter().map(listed).collect();
    runs.sort_by(|a, b| b.written.cmp(&a.written).then_with(|| a.folder.cmp(&b.folder)));
    Ok(runs)
}

/// The run beside a folder that is not there whose name is nearest: for messages about a file in it, or about itself.
#[must_use]
pub fn meant(path: &Path) -> Option<PathBuf> {
    let folder =
        path.ancestors().take(2).find(|path| path.extension().is_none_or(|end| !is_file(end)))?;
    let parent = folder.parent().filter(|parent| !parent.as_os_str().is_empty());
    let parent = parent.unwrap_or_else(|| Path::new("."));
    if folder.exists() {
        return None;
    }
    let entries = fs::read_dir(parent).ok()?.flatten().map(|entry| entry.path());
    let runs = entries.filter(|path| path.join(names::CONFIG).is_file());
    let names: Vec<String> =
        runs.filter_map(|path| Some(path.file_name()?.to_str()?.to_owned())).collect();
    let near = near::nearest(folder.file_name()?.to_str()?, names.iter().map(String::as_str))?;
    Some(folder.with_file_name(near))
}

/// Whether an ending is that of a file of a run: names of runs hold dots too.
fn is_file(ending: &OsStr) -> bool {
    ["toml", "json", "jsonl", "safetensors", "html"].iter().any(|known| ending == *known)
}

fn listed(path: PathBuf) -> ListedRun {
    let written = |name: &str| fs::metadata(path.join(name)).and_then(|data| data.modified()).ok();
    let mut run = ListedRun {
        status: RunStatus::Unfinished,
        what: Default::default(),
        differences: vec![],
        seed: 0,
        epochs: [0; 2],
        test: None,
        validation: None,
        returns: None,
        written: written(names::RECEIPT).or_else(|| written(names::CONFIG)),
        folder: path,
    };
    if let Err(error) = read(&mut run) {
        run.status = RunStatus::Damaged(error.to_string());
    }
    run
}

fn read(run: &mut ListedRun) -> Result<(), RunError> {
    let (config, text) = run::configuration(&run.folder)?;
    run.what = [config.data_name(), config.rule_name().into(), config.hardware_name.clone()];
    run.differences = config.differences();
    run.seed = config.seed();
    run.epochs = [0, config.epochs()];
    if !run.folder.join(names::RECEIPT).exists() {
        // killed before its first record was in place
        return Ok(());
    }
    let receipt = folder::read_receipt(&run.folder)?;
    run::untouched(&receipt, &text)?;
    let records = run::records(&run.folder, &receipt)?;
    run.test = receipt.classified().map(|test| test.score);
    let tested = receipt.test.as_ref().map(TestOutcome::epoch);
    let read = records.iter().find(|record| Some(record.epoch) == tested).or(records.last());
    run.validation = read.and_then(EpochRecord::validation);
    run.returns = read.and_then(EpochRecord::policy).map(|outcome| {
        let test = receipt.played().and_then(|test| test.episodes.mean());
        [test, outcome.evaluation.mean()]
    });
    run.epochs[0] = records.last().map_or(0, |record| record.epoch);
    if receipt.status == "finished" {
        run.status = RunStatus::Finished;
    }
    Ok(())
}
