//! What a configuration makes of an environment: actor, critic, and the experiment around them.

use super::{Config, ConfigError};
use crate::chip::layer::{DrivenBy, InitialLevels};
use crate::learn::network::NetworkSpec;
use crate::learn::route::Route;
use crate::task::environment::{EnvSpec, Shown, Taken};
use crate::task::policy::{Evaluating, InputCoding, Method, PolicyExperiment};

/// What a policy has beside networks and a way to learn.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PolicySettings {
    /// What is acted on.
    pub(crate) environment: EnvSpec,
    /// How many run side by side.
    pub(crate) environments: u32,
    /// How numbers become drives.
    pub(crate) input: InputCoding,
    /// Units of each hidden layer of the critic.
    pub(crate) critic_hidden: Vec<usize>,
    /// Whether the actor's hidden layers are centred.
    pub(crate) centred: bool,
    /// How it learns.
    pub(crate) method: Method,
    /// Steps of all environments, at least.
    pub(crate) steps: u64,
    /// Steps of one in a rollout.
    pub(crate) horizon: u32,
    /// Rollouts of an epoch.
    pub(crate) rollouts: u32,
    /// What is read without learning.
    pub(crate) evaluation: Evaluating,
}

impl PolicySettings {
    /// Rows that an observation drives.
    pub(crate) fn rows(&self) -> usize {
        match (self.environment.shown, self.input) {
            (Shown::Dense(values), InputCoding::Split) => 2 * values,
            (Shown::Dense(values), _) => values,
            (Shown::Sparse { lines, .. }, _) => lines,
        }
    }

    /// Epochs of the run, if there are fewer than 2^32.
    pub(crate) fn epochs(&self) -> Option<u32> {
        let rollout = u64::from(self.environments) * u64::from(self.horizon);
        let of_epoch = rollout.saturating_mul(u64::from(self.rollouts));
        u32::try_from(self.steps.div_ceil(of_epoch.max(1))).ok()
    }

    /// Samples read or learnt from in the whole run, roughly.
    pub(crate) fn work(&self) -> f64 {
        let passes = match self.method {
            Method::Ppo(ppo) => f64::from(ppo.passes),
            Method::Evolution(_) => 1.0,
        };
        self.steps as f64 * (1.0 + passes)
    }

    /// Outputs of the actor: one an action, or one a number.
    pub(crate) const fn outputs(&self) -> usize {
        match self.environment.taken {
            Taken::Discrete(actions) => actions,
            Taken::Continuous(values) => values,
        }
    }
}

/// Which of the two networks of a policy.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    Actor,
    Critic,
}

impl Config {
    /// The experiment of a policy; nothing in classification.
    ///
    /// # Errors
    /// When a network does not fit together, or not on the chip.
    pub fn policy_experiment(&self) -> Result<Option<PolicyExperiment>, ConfigError> {
        let Some(policy) = &self.policy else { return Ok(None) };
        let actor = self.part(Part::Actor, policy);
        let critic = self.part(Part::Critic, policy);
        let experiment = PolicyExperiment {
            seed: self.seed,
            hardware: self.hardware.clone(),
            environment: policy.environment.id.to_string(),
            environments: policy.environments,
            input: policy.input,
            actor,
            critic,
            method: policy.method,
            steps: policy.steps,
            horizon: policy.horizon,
            rollouts: policy.rollouts,
            evaluation: policy.evaluation,
        };
        experiment.check(&policy.environment)?;
        Ok(Some(experiment))
    }

    /// The networks of a run on data of this shape, whose layers are numbered through.
    ///
    /// # Errors
    /// When they do not fit the data or the chip.
    pub(crate) fn networks(
        &self,
        features: usize,
        classes: usize,
        image: Option<[usize; 3]>,
    ) -> Result<Vec<NetworkSpec>, ConfigError> {
        match self.policy_experiment()? {
            None => Ok(vec![self.experiment(features, classes, image)?.network]),
            Some(PolicyExperiment { actor, critic, method: Method::Ppo(_), .. }) => {
                Ok(vec![actor, critic])
            }
            Some(PolicyExperiment { actor, .. }) => Ok(vec![actor]),
        }
    }

    /// Actor or critic: they differ in units, in how the error arrives, in where they start and in what is centred.
    fn part(&self, part: Part, policy: &PolicySettings) -> NetworkSpec {
        let (hidden, outputs) = match part {
            Part::Actor => (&self.hidden, policy.outputs()),
            Part::Critic => (&policy.critic_hidden, 1),
        };
        let mut network = self.network_of(policy.rows(), hidden, outputs);
        let dense = matches!(policy.environment.shown, Shown::Dense(_));
        if policy.input == InputCoding::Signed && dense {
            network.layers[0].driven_by = DrivenBy::Signed;
        }
        for (at, layer) in network.layers.iter_mut().enumerate() {
            let gain = match (part, at == hidden.len()) {
                (_, false) => [1, 1],
                (Part::Actor, true) => [1, 10],
                (Part::Critic, true) => [3, 10],
            };
            layer.initial = InitialLevels::AbsGaussian { gain };
        }
        if part == Part::Actor && policy.centred {
            // output layers alone can learn the mean of what they put out
            network.centred[..hidden.len()].fill(true);
        }
        if part == Part::Critic {
            // one word, which all units hear
            network.route = match self.route {
                Some(Route::Modulo { .. }) => Some(Route::Modulo { taps: 1, shift: None }),
                other => other,
            };
        }
        network
    }
}
