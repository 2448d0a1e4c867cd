//! Rollouts and updates.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::experiment::PolicyExperiment;
use super::outcome::{PolicyEpoch, PolicyEvaluation, PolicyProgress};
use crate::chip::crossbar::kernel::Backend;
use crate::chip::state::{State, StateError, Visitor};
use crate::learn::driver::Driver;
use crate::learn::network::NetworkError;
use crate::learn::statistics::PathwayRecord;
use crate::task::environment::{EnvError, EnvSpec};

/// Why a policy cannot be trained, or not further.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PolicyError {
    /// A network that does not fit.
    #[error(transparent)]
    Network(#[from] NetworkError),
    /// An environment that cannot go on. The state is that before the step.
    #[error(transparent)]
    Environment(#[from] EnvError),
    /// Stopped by the caller inside an epoch, or no epoch is left.
    #[error("stopped")]
    Stopped,
}

/// A training in progress.
#[derive(Debug)]
pub struct PolicyTrainer {
    experiment: PolicyExperiment,
    drivers: Vec<Driver>,
}

impl PolicyTrainer {
    /// Builds the networks with their initial levels and the environments, and finds ranges of converters.
    ///
    /// # Errors
    /// When something does not fit.
    pub fn new(_experiment: PolicyExperiment, _backend: Backend) -> Result<Self, PolicyError> {
        unimplemented!("being written")
    }

    /// What decides the result.
    #[must_use]
    pub const fn experiment(&self) -> &PolicyExperiment {
        &self.experiment
    }

    /// What is acted on.
    #[must_use]
    pub fn environment(&self) -> &EnvSpec {
        unimplemented!("being written")
    }

    /// Epochs in all.
    #[must_use]
    pub fn epochs(&self) -> u32 {
        unimplemented!("being written")
    }

    /// Epochs finished.
    #[must_use]
    pub fn epoch(&self) -> u32 {
        unimplemented!("being written")
    }

    /// Steps and updates (of each network) of an epoch.
    #[must_use]
    pub fn epoch_size(&self) -> (u64, u64) {
        unimplemented!("being written")
    }

    /// One epoch.
    ///
    /// # Errors
    /// When `go_on` says to stop (asked after every update), no epoch is left, or the environment cannot go on.
    pub fn learn(
        &mut self,
        _go_on: &mut dyn FnMut(PolicyProgress) -> bool,
    ) -> Result<PolicyEpoch, PolicyError> {
        unimplemented!("being written")
    }

    /// Episodes without learning, from fresh environments whose draws are their own; charged to evaluation.
    ///
    /// # Errors
    /// When the environment cannot go on.
    pub fn evaluate(&mut self, _episodes: u32) -> Result<PolicyEvaluation, PolicyError> {
        unimplemented!("being written")
    }

    /// Watches one episode: after each step the picture of the environment, the reward (16 fractional bits), the action and
    /// what the actor and the critic put out. False stops.
    ///
    /// # Errors
    /// When the environment cannot go on.
    pub fn watch(
        &mut self,
        _episode: u32,
        _look: &mut dyn FnMut(&WatchedStep) -> bool,
    ) -> Result<(), PolicyError> {
        unimplemented!("being written")
    }

    /// Actor, then critic.
    #[must_use]
    pub fn networks(&self) -> Vec<&Driver> {
        self.drivers.iter().collect()
    }

    /// The same, to set what changes no result, or to restore.
    pub fn networks_mut(&mut self) -> Vec<&mut Driver> {
        self.drivers.iter_mut().collect()
    }

    /// Statistics of every pathway of both networks.
    #[must_use]
    pub fn pathways(&self) -> Vec<PathwayRecord> {
        unimplemented!("being written")
    }
}

/// One step of an episode that is watched.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct WatchedStep {
    /// Step, from 0.
    pub step: u32,
    /// Picture in characters, before the step.
    pub picture: String,
    /// What was shown, 16 fractional bits, or lines that were on.
    pub shown: Vec<i64>,
    /// The action: its number, or its values with 16 fractional bits.
    pub action: Vec<i64>,
    /// Whether it is one of some actions.
    pub discrete: bool,
    /// What the actor put out: probabilities with 31 fractional bits, or means with 20.
    pub actor: Vec<i64>,
    /// What the state is worth, in units of reward, 20 fractional bits.
    pub value: i64,
    /// The reward, 16 fractional bits.
    pub reward: i64,
}

impl State for PolicyTrainer {
    fn visit(&mut self, _visitor: &mut dyn Visitor) -> Result<(), StateError> {
        unimplemented!("being written")
    }
}
