//! Doing a run again and comparing.

use std::path::Path;

use super::train::{check_receipt, read_config};
use super::{Machine, RunError, Session};
use crate::lab::config::Select;
use crate::lab::data::{self, DataRoot};
use crate::lab::store::folder;
use crate::lab::store::hash;
use crate::lab::store::record::TestRecord;
use crate::task::classify::Progress;

/// What doing a run again showed.
#[derive(Debug, Clone, PartialEq)]
pub enum Verdict {
    /// Every hash compared is equal.
    Same {
        /// Epochs compared, epoch 0 included.
        epochs: usize,
        /// Hash of the last state compared.
        state_hash: String,
        /// Whether the final test was compared too.
        test: bool,
    },
    /// Something differs.
    Different {
        /// What, in words: which epoch, layer, pathway.
        what: String,
        /// What the run says.
        wanted: String,
        /// What came out.
        found: String,
    },
}

/// Re-executes a run, or its first `epochs` epochs, and compares every state hash and, at the end, the test.
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
    let config = read_config(path)?;
    let receipt = folder::read_receipt(path)?;
    let mut session = Session::new(&config, data::load(&config.source()?, data_root)?, machine)?;
    check_receipt(&receipt, &session)?;
    let different = |what: String, wanted: &str, found: &str| {
        Ok(Verdict::Different { what, wanted: wanted.into(), found: found.into() })
    };
    let tables = hash::tables(session.trainer().driver());
    if tables != receipt.tables_hash {
        return different("activation tables".into(), &receipt.tables_hash, &tables);
    }
    let kept = folder::read_metrics(path)?;
    let wanted = &receipt.epoch_hashes;
    let last = epochs.map_or(wanted.len(), |epochs| wanted.len().min(epochs as usize + 1));
    let mut best: Option<(u64, TestRecord)> = None;
    let whole = last == wanted.len() && receipt.status == "finished";
    let mut state_hash = String::new();
    for (epoch, wanted) in wanted.iter().enumerate().take(last) {
        let record = if epoch == 0 {
            session.start()
        } else {
            let stopped =
                || RunError::Stopped { epoch: epoch as u32 - 1, path: path.display().to_string() };
            session.epoch(on_batch).ok_or_else(stopped)?
        };
        if record.state_hash != *wanted {
            let what =
                kept.get(epoch).map_or_else(String::new, |kept| first_difference(kept, &record));
            let what = format!("state after epoch {epoch}{what}");
            return different(what, wanted, &record.state_hash);
        }
        state_hash.clone_from(&record.state_hash);
        if whole && epoch > 0 && config.select == Select::BestValidation {
            let score = record.validation.map_or(0, |score| score.correct);
            if best.as_ref().is_none_or(|(most, _)| score > *most) {
                // reading the test set charges a ledger, which is part of the state
                let state = session.checkpoint();
                best = Some((score, session.test()));
                session
                    .restore(&state)
                    .map_err(|error| RunError::Checkpoint { path: "memory".into(), error })?;
            }
        }
    }
    let mut tested = false;
    if let (true, Some(wanted)) = (whole, &receipt.test) {
        let mut found = best.map_or_else(|| session.test(), |(_, test)| test);
        // receipts of earlier programs list none
        if wanted.confused.is_empty() {
            found.confused.clear();
        }
        if found != *wanted {
            let show = |test: &TestRecord| format!("{:?} in epoch {}", test.score, test.epoch);
            return different("test result".into(), &show(wanted), &show(&found));
        }
        tested = true;
    }
    Ok(Verdict::Same { epochs: last, state_hash, test: tested })
}

/// The first layer and pathway whose statistics differ.
fn first_difference(
    kept: &crate::lab::store::record::EpochRecord,
    found: &crate::lab::store::record::EpochRecord,
) -> String {
    let pairs = kept.pathways.iter().zip(&found.pathways);
    pairs
        .filter(|(kept, found)| kept != found)
        .map(|(kept, _)| format!(", first seen in layer {} {}", kept.layer, kept.pathway))
        .next()
        .unwrap_or_default()
}
