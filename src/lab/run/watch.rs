//! Looking at a policy while it acts: an episode with the chosen state of a run.

use std::path::Path;

use super::again::{read_again, read_config};
use super::{Machine, RunError};
use crate::lab::data::DataRoot;
use crate::task::environment::EnvSpec;
use crate::task::policy::WatchedStep;

/// What is watched.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Watched {
    /// After which epoch the state stood that acts.
    pub epoch: u32,
    /// Its hash.
    pub state_hash: String,
}

/// Plays an episode of the evaluation with the chosen state of a run, step by step, until it ends or `look` says false.
///
/// # Errors
/// When the run is damaged, is none of a policy, or its environment cannot go on.
pub fn watch(
    path: &Path,
    root: &DataRoot,
    machine: Machine,
    episode: u32,
    look: &mut dyn FnMut(&EnvSpec, &WatchedStep) -> bool,
) -> Result<Watched, RunError> {
    let none = || RunError::NoEpisodes { path: path.display().to_string() };
    let spec = read_config(path)?.0.policy.ok_or_else(none)?.environment;
    let (mut session, receipt) = read_again(path, root, machine)?;
    let epoch = session.epoch();
    session.watch(episode, &mut |step| look(&spec, step))?;
    Ok(Watched { epoch, state_hash: receipt.epoch_hashes[epoch as usize].clone() })
}
