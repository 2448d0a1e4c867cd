//! Doing a run again and comparing everything that its folder says.

use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use serde::Serialize;
use serde_json::Value;

use super::again::read_config;
use super::proof::{self, Difference};
use super::session::chosen;
use super::{Machine, Progress, RunError, Session};
use crate::lab::config::Select;
use crate::lab::data::{self, DataRoot};
use crate::lab::store::checkpoint;
use crate::lab::store::folder::{self, FolderError, RunFolder, names};
use crate::lab::store::ledger::LedgerRecord;
use crate::lab::store::record::{BestRecord, EpochRecord, Receipt, TestOutcome};
use crate::lab::store::{hash, stream};
use crate::task::environment::{EnvSource, Replaying};

/// What doing a run again showed.
///
/// See [`train`](crate::train()).
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Verdict {
    /// Everything compared is equal.
    Same {
        /// Epochs compared, epoch 0 included.
        epochs: usize,
        /// Hash of the last state compared.
        state_hash: String,
        /// Whether the final test was compared too.
        test: bool,
        /// Files, or parts of them, that were not compared.
        unchecked: Vec<String>,
    },
    /// Something differs.
    Different {
        /// What, in words: which file, epoch, field.
        what: String,
        /// What the run says.
        wanted: String,
        /// What came out.
        found: String,
    },
}

/// What stops a comparison: a difference, or an error.
enum Halt {
    Different { what: String, wanted: String, found: String },
    Error(RunError),
}

impl<E: Into<RunError>> From<E> for Halt {
    fn from(error: E) -> Self {
        Self::Error(error.into())
    }
}

/// Re-executes a run, or its first `epochs` epochs, and compares every number of its records, its ledger, its receipt and
/// its checkpoints with what comes out, and every file with the hash that the receipt has of it.
///
/// See [`train`](crate::train()) for an example.
///
/// # Errors
/// When the run is damaged, its data is not the same, or the caller stops it.
pub fn verify(
    path: &Path,
    data_root: &DataRoot,
    machine: Machine,
    epochs: Option<u32>,
    on_batch: &mut (dyn FnMut(Progress) -> bool + Send),
) -> Result<Verdict, RunError> {
    verdict(compare(path, data_root, machine, epochs, None, on_batch))
}

/// The same of a policy, whose environments are not asked: it is shown what its folder has kept of them.
///
/// # Errors
/// As [`verify`], and when nothing was kept.
pub fn replay(
    path: &Path,
    data_root: &DataRoot,
    machine: Machine,
    epochs: Option<u32>,
    on_batch: &mut (dyn FnMut(Progress) -> bool + Send),
) -> Result<Verdict, RunError> {
    let replaying = Some(Arc::default());
    verdict(compare(path, data_root, machine, epochs, replaying, on_batch))
}

fn verdict(compared: Result<Verdict, Halt>) -> Result<Verdict, RunError> {
    match compared {
        Ok(verdict) => Ok(verdict),
        Err(Halt::Error(error)) => Err(error),
        Err(Halt::Different { what, wanted, found }) => {
            Ok(Verdict::Different { what, wanted, found })
        }
    }
}

/// Shows what was kept in a file of the folder next; nothing where environments are asked.
fn show(path: &Path, name: &str, replaying: Option<&Arc<Mutex<Replaying>>>) -> Result<(), Halt> {
    if let Some(replaying) = replaying {
        let bytes = folder::read_checkpoint(path, name)?;
        let damaged = |found| FolderError::Content { path: path.join(name), found };
        let record = stream::read(&bytes).map_err(damaged)?;
        replaying.lock().unwrap_or_else(PoisonError::into_inner).begin(record);
    }
    Ok(())
}

fn differ(what: impl Into<String>, wanted: &str, found: &str) -> Halt {
    Halt::Different { what: what.into(), wanted: wanted.into(), found: found.into() }
}

fn same<T: Serialize>(what: &str, kept: &Value, found: &T) -> Result<(), Halt> {
    match proof::difference(kept, found) {
        None => Ok(()),
        Some(Difference { place, kept, found }) => {
            Err(differ(format!("{what}, `{place}`"), &kept, &found))
        }
    }
}

fn compare(
    path: &Path,
    data_root: &DataRoot,
    machine: Machine,
    epochs: Option<u32>,
    replaying: Option<Arc<Mutex<Replaying>>>,
    on_batch: &mut (dyn FnMut(Progress) -> bool + Send),
) -> Result<Verdict, Halt> {
    let (config, text) = read_config(path)?;
    let receipt = folder::read_receipt(path)?;
    let replaying = replaying.as_ref();
    show(path, &stream::stream_name(0), replaying)?;
    let source = replaying.map_or(EnvSource::Native, |one| EnvSource::Replayed(Arc::clone(one)));
    let loaded = data::load(&config.source()?, data_root)?;
    let mut session = Session::acting_on(&config, loaded, machine, source)?;
    proof::inputs(&receipt, &session, &text)?;
    let kept = proof::records(path, &receipt)?;
    // as they were written: a record of an earlier program has fewer fields
    let lines = proof::records_text(path, &receipt)?;
    let lines: Vec<Value> =
        lines.lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
    let written: Value = parsed(path, names::RECEIPT)?;
    let files = Files::read(path, &receipt)?;
    let learnt = kept.len().saturating_sub(1);
    if learnt > config.epochs as usize {
        let (found, wanted) = (learnt.to_string(), config.epochs.to_string());
        return Err(differ("number of epochs in the records", &found, &wanted));
    }
    let last = epochs.map_or(kept.len(), |epochs| kept.len().min(epochs as usize + 1));
    let whole = last == kept.len();
    let finished = receipt.status == "finished";
    let best_epoch = match config.select {
        Select::BestValidation => chosen(config.select, &kept),
        Select::Last => None,
    };

    let epochs = kept[..last].last().map_or(0, |record| record.epoch);
    let mut on_batch = |progress: Progress| on_batch(Progress { epochs, ..progress });
    let mut records: Vec<EpochRecord> = Vec::new();
    let mut seen = false;
    let mut best: Option<(BestRecord, Option<TestOutcome>)> = None;
    for (kept, line) in kept[..last].iter().zip(&lines) {
        let epoch = kept.epoch;
        let record = if epoch == 0 {
            session.start()?
        } else {
            let (folder, path) = (path, path.display().to_string());
            let stopped = || RunError::Stopped { epoch: epoch - 1, path };
            show(folder, &stream::stream_name(epoch), replaying)?;
            session.advance(&mut on_batch)?.ok_or_else(stopped)?.0
        };
        let _ = session.note(&record);
        let state_differs = record.state_hash != kept.state_hash;
        if state_differs && epoch as usize + 1 == receipt.epoch_hashes.len() {
            let found = session.checkpoint();
            let place = files.checkpoint.as_deref();
            let place = place.and_then(|kept| checkpoint::first_difference(kept, &found));
            let place = place.map_or(String::new(), |place| format!(", first seen in {place}"));
            let what = format!("state after epoch {epoch}{place}");
            return Err(differ(what, &kept.state_hash, &record.state_hash));
        }
        same(&format!("record of epoch {epoch} in {}", names::METRICS), line, &record)?;
        records.push(record);
        let kept = files.checkpoint.as_ref().filter(|_| !finished);
        seen |= kept.is_some_and(|kept| *kept == session.checkpoint());
        if best_epoch == Some(epoch) {
            let state = session.checkpoint();
            let checkpoint = hash::bytes(&state);
            files.best(&state, epoch)?;
            // reading the test set charges a ledger, which is part of the state
            let tested = whole && finished && receipt.test.is_some();
            let test = if tested { session.test()? } else { None };
            if test.is_some() {
                session
                    .restore(&state)
                    .map_err(|error| RunError::Checkpoint { path: "memory".into(), error })?;
            }
            best = Some((BestRecord { epoch, checkpoint }, test));
        }
    }
    let state_hash = records.last().map(|record| record.state_hash.clone()).unwrap_or_default();
    let mut unchecked = vec![names::REPORT.to_owned(), names::TIMING.to_owned()];
    if replaying.is_none() && path.join(stream::stream_name(0)).exists() {
        unchecked.push("what its environments showed (see --replay)".into());
    }
    if !whole {
        unchecked.push(format!("epochs after {}", last.saturating_sub(1)));
        unchecked.push(format!("{} and {} beyond their hashes", names::LEDGER, names::CHECKPOINT));
        return Ok(Verdict::Same { epochs: last, state_hash, test: false, unchecked });
    }

    let state = session.checkpoint();
    files.last(&state, seen)?;
    let (best, test) = best.map_or((None, None), |(best, test)| (Some(best), test));
    // records were compared number by number; their bytes are those that the receipt names
    let hashes = [receipt.metrics.clone(), hash::bytes(&state)];
    let mut expected = proof::receipt(&session, &text, &records, hashes, best);
    if finished {
        let ledger = LedgerRecord::of(&session.engines());
        if let Some(kept) = &files.ledger {
            same(names::LEDGER, kept, &ledger)?;
        }
        expected.ledger.clone_from(&receipt.ledger);
        expected.status.clone_from(&receipt.status);
        expected.test = match test {
            Some(test) => Some(test),
            None => {
                show(path, stream::STREAM_TEST, replaying)?;
                session.test()?
            }
        };
    }
    expected.states = receipt.states;
    same(names::RECEIPT, &written, &expected)?;
    Ok(Verdict::Same { epochs: last, state_hash, test: expected.test.is_some(), unchecked })
}

/// A JSON file as it was written.
fn parsed(path: &Path, name: &str) -> Result<Value, Halt> {
    let text = folder::read_text(path, name)?;
    let damaged = |found: serde_json::Error| FolderError::Content {
        path: path.join(name),
        found: found.to_string(),
    };
    Ok(serde_json::from_str(&text).map_err(damaged)?)
}

/// The files of a folder beside its records, each as its receipt says.
struct Files<'a> {
    path: &'a Path,
    ledger: Option<Value>,
    checkpoint: Option<Vec<u8>>,
    best: Option<Vec<u8>>,
}

impl<'a> Files<'a> {
    fn read(path: &'a Path, receipt: &Receipt) -> Result<Self, Halt> {
        let finished = match &*receipt.status {
            "finished" => true,
            "running" => false,
            other => return Err(differ("status in the receipt", other, "finished or running")),
        };
        let ledger = match &receipt.ledger {
            None if finished => {
                return Err(differ("ledger in the receipt", "null", "a hash, when finished"));
            }
            None => None,
            Some(wanted) => {
                let text = folder::read_text(path, names::LEDGER)?;
                if hash::bytes(&text) != *wanted {
                    return Err(differ("bytes of ledger.json", wanted, &hash::bytes(&text)));
                }
                let damaged =
                    |found| FolderError::Content { path: path.join(names::LEDGER), found };
                LedgerRecord::parse(&text).map_err(damaged)?;
                Some(parsed(path, names::LEDGER)?)
            }
        };
        if finished && !receipt.states && path.join(names::CHECKPOINT).exists() {
            return Err(differ("states in the receipt", "false", "they are in the folder"));
        }
        // a run that is going on has its states, whatever it will keep of them
        let (mut checkpoint, mut best) = (None, None);
        if receipt.states || !finished {
            checkpoint = Some(folder::read_checkpoint(path, names::CHECKPOINT)?);
            if let Some(record) = &receipt.best {
                best = Some(folder::read_checkpoint(path, &RunFolder::best_name(record.epoch))?);
            }
        }
        Ok(Self { path, ledger, checkpoint, best })
    }

    /// Compares the state after the last record with the checkpoint. `seen`: the checkpoint is that of an epoch before,
    /// as a kill between a receipt and the checkpoint it speaks of leaves it.
    fn last(&self, state: &[u8], seen: bool) -> Result<(), Halt> {
        match &self.checkpoint {
            Some(kept) if kept != state && !seen => Err(self.other(names::CHECKPOINT, kept, state)),
            _ => Ok(()),
        }
    }

    /// Compares the best state, reached in `epoch`, with its file.
    fn best(&self, state: &[u8], epoch: u32) -> Result<(), Halt> {
        match &self.best {
            Some(kept) if kept != state => {
                Err(self.other(&RunFolder::best_name(epoch), kept, state))
            }
            _ => Ok(()),
        }
    }

    fn other(&self, name: &str, kept: &[u8], state: &[u8]) -> Halt {
        let place = checkpoint::first_difference(kept, state);
        let place = place.map_or(String::new(), |place| format!(", {place}"));
        let file = self.path.join(name);
        differ(format!("{}{place}", file.display()), &hash::bytes(kept), &hash::bytes(state))
    }
}
