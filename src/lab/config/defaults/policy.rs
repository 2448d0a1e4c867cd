//! What users get by saying nothing of a policy, where it depends on what is acted on.
//!
//! ```text
//! rollouts of an epoch = steps / (count x horizon x 50), rounded, at least 1        a run has about 50 epochs
//! ```

use crate::chip::layer::Optimiser;
use crate::lab::config::file::PerLayer;
use crate::learn::rule::Rule;

/// Defaults of policies for one environment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PolicyDefaults {
    /// The environment; `None`: every other one.
    pub id: Option<&'static str>,
    /// `ppo.gamma`.
    pub gamma: f64,
    /// `ppo.entropy` of one of some actions.
    pub entropy: f64,
    /// `evaluation.deterministic`. A policy that does not remember walks in circles where it never tries anything else.
    pub deterministic: bool,
}

/// One entry an environment that has defaults of its own, then the entry of all others.
pub const POLICY_DEFAULTS: [PolicyDefaults; 3] = [
    PolicyDefaults { id: Some("Pendulum-v1"), gamma: 0.95, entropy: 0.01, deterministic: true },
    PolicyDefaults { id: Some("Foray-v0"), gamma: 0.98, entropy: 0.03, deterministic: false },
    PolicyDefaults { id: None, gamma: 0.99, entropy: 0.01, deterministic: true },
];

/// What is acted on.
pub(in crate::lab::config) const ENVIRONMENT: &str = "CartPole-v1";
/// Environments side by side.
pub(in crate::lab::config) const COUNT: i64 = 16;
/// Steps of all environments together.
pub(in crate::lab::config) const STEPS: i64 = 500_000;
/// Steps of one in a rollout.
pub(in crate::lab::config) const HORIZON: i64 = 128;
/// Units of each hidden layer of both networks.
pub(in crate::lab::config) const HIDDEN: [usize; 2] = [64, 64];
/// Weight of the level after the greatest: of hidden layers and of the output.
pub(in crate::lab::config) const WEIGHT_MAX: [f64; 2] = [0.5, 0.25];
/// The same of outputs behind ramps, which put out about a quarter of what is normalised.
pub(in crate::lab::config) const WEIGHT_MAX_BEHIND_RAMPS: f64 = 1.0;
/// Width of sigmoids, where those are chosen.
pub(in crate::lab::config) const ALPHA: f64 = 6.0;
/// Steps of a minibatch.
pub(in crate::lab::config) const BATCH: i64 = 256;
/// `ppo.entropy` of actions that are numbers.
pub(in crate::lab::config) const ENTROPY_OF_NUMBERS: f64 = 0.0;
/// `ppo.log_sigma`.
pub(in crate::lab::config) const LOG_SIGMA: f64 = 0.0;
/// `ppo.log_sigma_rate`.
pub(in crate::lab::config) const LOG_SIGMA_RATE: f64 = 0.003;
/// `ppo.noise_steps`.
pub(in crate::lab::config) const NOISE_STEPS: i64 = 1;
/// `es.pairs`.
pub(in crate::lab::config) const PAIRS: i64 = 16;
/// `es.step`.
pub(in crate::lab::config) const STEP: i64 = 16;
/// `es.shift`.
pub(in crate::lab::config) const SHIFT: i64 = 4;
/// Epochs that a run has by default.
const EPOCHS: i64 = 50;

impl PolicyDefaults {
    /// Those of an environment.
    #[must_use]
    pub fn of(id: &str) -> &'static Self {
        let [.., others] = &POLICY_DEFAULTS;
        POLICY_DEFAULTS.iter().find(|one| one.id == Some(id)).unwrap_or(others)
    }
}

/// `learning.rate` by a rule. A cell of a pair is pulsed half as often (MODEL, 3.10); rules of one stream of pairs end far behind
/// where that is not made up for, those of two streams do not (docs/results/policies.md).
pub(in crate::lab::config) const fn rate_of(optimiser: Optimiser, rule: Rule) -> f64 {
    match (optimiser, rule) {
        (Optimiser::Sign { .. }, Rule::Bp | Rule::Dfa) => 2.0 * rate(optimiser),
        _ => rate(optimiser),
    }
}

/// `learning.rate`: the probability of a pulse of hidden layers, a step of weights, or as in classification.
pub(in crate::lab::config) const fn rate(optimiser: Optimiser) -> f64 {
    match optimiser {
        Optimiser::Sign { .. } => 0.25,
        Optimiser::Rms | Optimiser::AdamFx { .. } => 0.002,
        _ => 1.0,
    }
}

/// `learning.rate_multipliers` of a network of so many layers: outputs are pulsed twice as often.
pub(in crate::lab::config) fn multipliers(optimiser: Optimiser, layers: usize) -> PerLayer<f64> {
    if !optimiser.is_sign() {
        return PerLayer::All(1.0);
    }
    let mut each = vec![1.0; layers];
    if let Some(output) = each.last_mut() {
        *output = 2.0;
    }
    PerLayer::Each(each)
}

/// `network.weight_max` of a network of so many layers, its outputs behind ramps or not.
pub(in crate::lab::config) fn weight_max(layers: usize, ramps: bool) -> PerLayer<f64> {
    let [hidden, of_output] = WEIGHT_MAX;
    let of_output = if ramps { WEIGHT_MAX_BEHIND_RAMPS } else { of_output };
    let mut each = vec![hidden; layers];
    if let Some(output) = each.last_mut() {
        *output = of_output;
    }
    PerLayer::Each(each)
}

/// `environment.rollouts` of a run of so many steps whose rollouts have so many.
pub(in crate::lab::config) fn rollouts(steps: i64, of_rollout: i64) -> i64 {
    let epochs = of_rollout.saturating_mul(EPOCHS).max(1);
    (steps.saturating_add(epochs / 2) / epochs).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_has_about_fifty_epochs_and_never_none() {
        for (steps, of_rollout, wanted) in
            [(500_000, 2048, 5), (150_000, 2048, 1), (1, 2048, 1), (1_000_000, 1024, 20)]
        {
            assert_eq!(rollouts(steps, of_rollout), wanted, "{steps} {of_rollout}");
        }
    }
}
