//! What decides the result of a policy's training, as checked numbers.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use fixed::types::U1F31;

use crate::chip::hardware::Hardware;
use crate::learn::network::NetworkSpec;

/// A number from 0 to 1, or a little more: a discount, a probability, a coefficient.
pub type Share = U1F31;

/// How numbers of an observation become drives, which have no sign.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum InputCoding {
    /// Two rows a number: what is above 0, and what is below.
    Split,
    /// One row a number, half the scale added.
    Offset,
}

/// Everything that decides a result.
#[derive(Debug, Clone, PartialEq)]
pub struct PolicyExperiment {
    /// Seed of all draws.
    pub seed: u64,
    /// The chip.
    pub hardware: Hardware,
    /// What the environment is called: see [`crate::task::environment`].
    pub environment: String,
    /// How many run side by side, 1..=1024.
    pub environments: u32,
    /// How observations become drives. Lines that are on are driven at the full code whatever this says.
    pub input: InputCoding,
    /// The network that acts.
    pub actor: NetworkSpec,
    /// The network that says what a state is worth. Its layers are numbered behind those of the actor. Not used by evolution.
    pub critic: NetworkSpec,
    /// How it learns.
    pub method: Method,
    /// Steps of all environments together, at least; whole epochs are done.
    pub steps: u64,
    /// Steps of an environment in a rollout, or of an episode in a generation of evolution.
    pub horizon: u32,
    /// Rollouts of an epoch: what is recorded and kept at once.
    pub rollouts: u32,
    /// What is read without learning.
    pub evaluation: Evaluating,
}

impl PolicyExperiment {
    /// Steps of all environments in an epoch; of evolution, at most.
    #[must_use]
    pub fn epoch_steps(&self) -> u64 {
        self.method.epoch_steps(self.environments, self.horizon, self.rollouts)
    }

    /// Epochs in all: `ceil(steps / epoch_steps)`.
    #[must_use]
    pub fn epochs(&self) -> u32 {
        u32::try_from(self.steps.div_ceil(self.epoch_steps())).unwrap_or(u32::MAX)
    }
}

impl Method {
    /// Steps of an epoch of so many rollouts, at least 1: environments x horizon x rollouts, or 2 pairs x horizon x generations.
    #[must_use]
    pub fn epoch_steps(self, environments: u32, horizon: u32, rollouts: u32) -> u64 {
        let side_by_side = match self {
            Self::Ppo(_) => u64::from(environments),
            Self::Evolution(Evolution { pairs, .. }) => 2 * u64::from(pairs),
        };
        let rollout = side_by_side.saturating_mul(u64::from(horizon));
        rollout.saturating_mul(u64::from(rollouts)).max(1)
    }
}

/// How a policy learns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Proximal policy optimisation, by the rule of the networks.
    Ppo(Ppo),
    /// Evolution strategies: no error reaches a layer.
    Evolution(Evolution),
}

/// Proximal policy optimisation (Schulman et al. 2017). The minibatch is the batch of both networks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ppo {
    /// Passes over a rollout.
    pub passes: u32,
    /// `gamma`: discount of rewards.
    pub discount: Share,
    /// `lambda` of generalised advantage estimation.
    pub lambda: Share,
    /// `epsilon`: how far a ratio may go before it is clipped.
    pub clip: Share,
    /// `beta`: what entropy is worth.
    pub entropy: Share,
    /// Continuous actions: `ln sigma` at the start, 16 fractional bits.
    pub log_sigma_start: i32,
    /// Continuous actions: how far `ln sigma` moves in an update for a mean error of 1.
    pub log_sigma_rate: Share,
}

/// Antithetic evolution strategies with ranks (Salimans et al. 2017), in integers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Evolution {
    /// Pairs of candidates in a generation.
    pub pairs: u32,
    /// Levels by which a candidate's cells differ, up and down.
    pub step: u32,
    /// A cell moves by a level with a probability of `2^-shift` times the sum of ranks that ask for it.
    pub shift: u32,
}

/// What is read without learning.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Evaluating {
    /// Episodes after every epoch.
    pub episodes: u32,
    /// Episodes of the final test.
    pub episodes_final: u32,
    /// Whether the likeliest action is taken, and not one that is drawn.
    pub deterministic: bool,
}
