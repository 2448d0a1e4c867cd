//! Looking into a run: what the updates of its layers have to do with the gradient, at the start, at its result, and between.

use std::path::Path;

use super::again::{read_again, read_config};
use super::task::GoOn;
use super::{Machine, Progress, RunError, Session};
use crate::lab::analysis::{self, Analysed};
use crate::lab::config::Config;
use crate::lab::data::{self, DataRoot};
use crate::lab::store::folder::{FolderError, names};

/// Analyses a run for the first `samples` of what it learns from, at most 256, at these epochs: 0 is the state before the
/// first update. Without any, at 0 and at the state that its result is of. States that are not kept are learnt again, and
/// compared with the receipt.
///
/// # Errors
/// When the run is damaged, its data is not the same, it is no classification, an epoch is beyond its last one, or the caller
/// stops it.
pub fn analyse(
    path: &Path,
    data_root: &DataRoot,
    machine: Machine,
    samples: usize,
    epochs: &[u32],
    on_batch: &mut (dyn FnMut(Progress) -> bool + Send),
) -> Result<Vec<Analysed>, RunError> {
    let (config, _) = read_config(path)?;
    let (mut kept, receipt) = read_again(path, data_root, machine)?;
    let last = kept.epoch();
    let mut wanted = if epochs.is_empty() { vec![0, last] } else { epochs.to_vec() };
    wanted.sort_unstable();
    wanted.dedup();
    let known = receipt.epoch_hashes.len().saturating_sub(1);
    if let Some(&epoch) = wanted.iter().find(|&&epoch| epoch as usize > known) {
        return Err(RunError::NoEpoch { path: path.display().to_string(), epoch, last: known });
    }
    let mut found = Vec::new();
    let mut again: Option<Session> = None;
    for epoch in wanted {
        if epoch == last {
            found.push(look(&mut kept, &config, path, samples)?);
            continue;
        }
        let session = match &mut again {
            Some(session) => session,
            none => {
                let data = data::load(&config.source()?, data_root)?;
                let session = none.insert(Session::new(&config, data, machine)?);
                let _ = session.start()?;
                session
            }
        };
        learn(session, epoch, path, on_batch)?;
        let state = session.state_hash();
        if receipt.epoch_hashes[epoch as usize] != state {
            let found = format!("has another state after epoch {epoch} than learning again gives");
            return Err(FolderError::Content { path: path.join(names::RECEIPT), found }.into());
        }
        let before = session.checkpoint();
        found.push(look(session, &config, path, samples)?);
        // what was read for a look is no part of the run
        session
            .restore(&before)
            .map_err(|error| RunError::Checkpoint { path: path.display().to_string(), error })?;
    }
    Ok(found)
}

/// Learns up to an epoch.
fn learn(
    session: &mut Session,
    epoch: u32,
    path: &Path,
    on_batch: GoOn<'_>,
) -> Result<(), RunError> {
    while session.epoch() < epoch {
        if session.advance(on_batch)?.is_none() {
            let path = path.display().to_string();
            return Err(RunError::Stopped { epoch: session.epoch(), path });
        }
    }
    Ok(())
}

fn look(
    session: &mut Session,
    config: &Config,
    path: &Path,
    samples: usize,
) -> Result<Analysed, RunError> {
    let epoch = session.epoch();
    let Some(words) = session.words(samples) else {
        return Err(RunError::NoLabels { path: path.display().to_string() });
    };
    let engines = session.engines();
    let engine = engines.first().expect("examples are learnt by one network");
    Ok(Analysed { epoch, layers: analysis::analyse(engine, &words, config.seed) })
}
