//! What a training of a policy tells: integers, divided by nobody.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use crate::chip::engine::Currents;

/// How far an epoch is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PolicyProgress {
    /// Epoch in progress, from 0.
    pub epoch: u32,
    /// Epochs in all.
    pub epochs: u32,
    /// Steps of all environments in this epoch.
    pub steps: u64,
    /// Steps of an epoch.
    pub steps_total: u64,
    /// Episodes that ended in this epoch, and the sum of their returns, 16 fractional bits.
    pub returns: [i64; 2],
}

/// A sum and how many were added: a mean that nobody has divided.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SumOf {
    /// The sum, in the unit that its place says.
    pub sum: i64,
    /// How many.
    pub count: u64,
}

/// What came of an epoch.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct PolicyEpoch {
    /// Steps of all environments since the start.
    pub steps: u64,
    /// Returns of episodes that ended in the epoch, 16 fractional bits.
    pub returns: SumOf,
    /// Their lengths, in steps.
    pub lengths: SumOf,
    /// Policy loss by step learnt from, 20 fractional bits: minus the clipped surrogate objective.
    pub policy_loss: SumOf,
    /// Value loss: half of the squared error in standardised units, 20 fractional bits.
    pub value_loss: SumOf,
    /// Entropy of what the actor puts out, 20 fractional bits.
    pub entropy: SumOf,
    /// Approximate divergence of the policy from that of the rollout, `(r - 1) - ln r`, 20 fractional bits.
    pub approx_kl: SumOf,
    /// Steps whose ratio was clipped.
    pub clipped: SumOf,
    /// Explained variance of returns: variance that is left, and variance, of the last rollout, both as sums with 20
    /// fractional bits, cut to fit.
    pub unexplained: [i64; 2],
    /// Continuous actions: `ln sigma` of each value, 20 fractional bits.
    pub log_sigma: Vec<i64>,
}

/// Episodes without learning.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct PolicyEvaluation {
    /// Return of each episode, 16 fractional bits.
    pub returns: Vec<i64>,
    /// Steps of each.
    pub lengths: Vec<u32>,
    /// Bank currents by layer, through both networks.
    pub currents: Vec<Currents>,
    /// Layers whose units put out the same whatever was shown, through both networks.
    pub mute: Vec<bool>,
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
    /// What the actor put out, 20 fractional bits: logits, or means before `tanh`.
    pub actor: Vec<i64>,
    /// What the state is worth, in units of reward, 20 fractional bits.
    pub value: i64,
    /// The reward, 16 fractional bits.
    pub reward: i64,
}

impl SumOf {
    /// One more.
    pub(super) fn add(&mut self, number: i64) {
        self.sum += number;
        self.count += 1;
    }
}
