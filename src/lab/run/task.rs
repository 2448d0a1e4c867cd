//! The seam between carrying out a run and what is learnt in it.
//!
//! A task starts, advances by an epoch, holds a state and is tested; everything else about a run (folder, records of the
//! chip, checkpoints, receipt, verifying, prices, pages) is the same for all of them. Which tasks there are is known to
//! the configuration and to [`build`] alone.

use std::fmt;

use super::classify::Classify;
use super::policy::Policy;
use super::{Machine, RunError};
use crate::chip::engine::Currents;
use crate::chip::state::State;
use crate::lab::config::Config;
use crate::lab::data::Data;
use crate::lab::store::record::{DataRecord, Note, Outcome, Score, SumRecord, TestOutcome};
use crate::learn::driver::Driver;
use crate::learn::statistics::PathwayRecord;
use crate::task::classify::Examples;
use crate::task::environment::{EnvSource, Record};
use crate::task::policy::WatchedStep;

/// How far an epoch is.
///
/// See [`train`](crate::train()).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Progress {
    /// Epoch in progress, from 0.
    pub epoch: u32,
    /// Epochs in all.
    pub epochs: u32,
    /// Samples learnt from in this epoch; of policies, steps of all environments.
    pub done: usize,
    /// The same of an epoch.
    pub total: usize,
    /// Answers given before learning from them, of tasks that give any.
    pub answers: Option<Score>,
    /// Returns of episodes that ended in this epoch, of policies.
    pub returns: Option<SumRecord>,
}

/// Asked after every update; false stops the run.
pub(super) type GoOn<'a> = &'a mut (dyn FnMut(Progress) -> bool + Send);

/// What a task tells of an epoch.
#[derive(Debug)]
pub(super) struct Told {
    /// What came of it.
    pub(super) outcome: Outcome,
    /// Bank currents of the evaluation, layer by layer through all networks.
    pub(super) currents: Vec<Currents>,
    /// Layers that put out the same whatever was shown in it.
    pub(super) mute: Vec<bool>,
    /// Wall-clock seconds of learning.
    pub(super) seconds: f64,
}

/// One thing that can be learnt.
pub(super) trait Task: fmt::Debug {
    /// Looks at the state before the first update.
    fn start(&mut self) -> Result<Told, RunError>;

    /// Learns for an epoch and looks at what came of it. `None` when `go_on` said to stop, the state then lies inside an
    /// epoch, or when no epoch is left.
    fn advance(&mut self, go_on: GoOn<'_>) -> Result<Option<Told>, RunError>;

    /// Everything that decides what comes next.
    fn state(&mut self) -> &mut dyn State;

    /// The final test with the present state, if there is anything to test on.
    fn test(&mut self) -> Result<Option<TestOutcome>, RunError>;

    /// Epochs finished.
    fn epoch(&self) -> u32;

    /// Networks, whose layers are numbered through.
    fn networks(&self) -> Vec<&Driver>;

    /// The same, to set what changes no result and to record operations.
    fn networks_mut(&mut self) -> Vec<&mut Driver>;

    /// Statistics of every pathway of every network.
    fn pathways(&self) -> Vec<PathwayRecord>;

    /// What building the task showed.
    fn notes(&self) -> Vec<Note>;

    /// Samples and updates of an epoch.
    fn epoch_size(&self) -> (usize, u64);

    /// Learns so many updates of the first epoch and stops inside it; how many were done.
    fn updates(&mut self, updates: u64) -> Result<u64, RunError>;

    /// Reads one sample as an inference does, or makes one decision.
    fn infer(&mut self) -> Result<(), RunError>;

    /// Means that inputs lie above and below, of each channel; none where they are coded otherwise.
    fn middles(&self) -> Vec<u8> {
        vec![]
    }

    /// Reads the first samples that are learnt from without learning; the words that their errors make, `[sample][output]`.
    /// None where there are no labels.
    fn words(&mut self, samples: usize) -> Option<Vec<i16>> {
        let _ = samples;
        None
    }

    /// Test examples, where mistakes can be shown as pictures.
    fn examples(&self) -> Option<&Examples> {
        None
    }

    /// What environments showed since the last call, where that is recorded.
    fn take_record(&mut self) -> Option<Record> {
        None
    }

    /// Shows an episode step by step until `look` says false; false where there are none.
    fn watch(
        &mut self,
        episode: u32,
        look: &mut dyn FnMut(&WatchedStep) -> bool,
    ) -> Result<bool, RunError> {
        let _ = (episode, look);
        Ok(false)
    }
}

/// Builds what a configuration asks to be learnt; a policy acts on environments of this source.
pub(super) fn build(
    config: &Config,
    data: Data,
    machine: Machine,
    source: EnvSource,
) -> Result<Box<dyn Task>, RunError> {
    if let Some(experiment) = config.policy_experiment()? {
        return Ok(Box::new(Policy::new(experiment, machine, source)?));
    }
    let record = DataRecord::of(&data);
    Ok(Box::new(Classify::new(config, data.split, &record, machine)?))
}
