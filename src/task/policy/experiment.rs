//! What decides the result of a policy's training, as checked numbers.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use fixed::types::U1F31;

use crate::chip::hardware::Hardware;
use crate::chip::layer::{DrivenBy, Listed};
use crate::learn::network::{NetworkError, NetworkSpec};
use crate::num::fixed::narrow;
use crate::num::tables::Activation;
use crate::task::environment::{EnvSpec, Shown, Taken};

/// A number from 0 to 1, or a little more: a discount, a probability, a coefficient.
pub type Share = U1F31;

/// How numbers of an observation become drives. What is on a row has no sign.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum InputCoding {
    /// Two rows a number: what is above 0, and what is below.
    Split,
    /// One row a number, half the scale added.
    Offset,
    /// One row a number, driven with what is above 0 and then with what is below, which counts against it: two phases a read.
    /// The first layers are [`DrivenBy::Signed`].
    Signed,
}

/// Steps of a run, at most.
const STEPS_MAX: u64 = 1 << 40;

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
    /// Steps of all environments in an epoch.
    #[must_use]
    pub fn steps_per_epoch(&self) -> u64 {
        u64::from(self.environments) * u64::from(self.horizon) * u64::from(self.rollouts)
    }

    /// Epochs: so many that no step is missing.
    ///
    /// # Panics
    /// When they are more than 2^32, or an epoch has no steps: [`PolicyExperiment::check`] refuses that.
    #[must_use]
    pub fn epochs(&self) -> u32 {
        narrow(self.steps.div_ceil(self.steps_per_epoch()), "checked")
    }

    /// Updates of each network.
    #[must_use]
    pub fn updates(&self) -> u64 {
        let rollouts = u64::from(self.epochs()) * u64::from(self.rollouts);
        match self.method {
            Method::Ppo(ppo) => {
                let steps = u64::from(self.environments) * u64::from(self.horizon);
                let each = steps.div_ceil(self.actor.batch.get().into());
                rollouts * u64::from(ppo.passes) * each
            }
            Method::Evolution(_) => rollouts,
        }
    }

    /// Rows that observations take, without the constant one.
    #[must_use]
    pub const fn rows(&self, spec: &EnvSpec) -> usize {
        match (spec.shown, self.input) {
            (Shown::Dense(values), InputCoding::Split) => values.saturating_mul(2),
            (Shown::Dense(values), InputCoding::Offset | InputCoding::Signed) => values,
            (Shown::Sparse { lines, .. }, _) => lines,
        }
    }

    /// Numbers that the actor puts out.
    #[must_use]
    pub const fn outputs(spec: &EnvSpec) -> usize {
        match spec.taken {
            Taken::Discrete(actions) => actions,
            Taken::Continuous(values) => values,
        }
    }

    /// The same on another environment: what is acted on, inputs of the first layers and outputs of the actor are as that has
    /// them. All else stays, the spread of actions that are numbers too: begin with an experiment on an environment that takes the
    /// same kind of actions.
    #[must_use]
    pub fn facing(mut self, spec: &EnvSpec) -> Self {
        self.environment = spec.id.to_string();
        let (rows, outputs) = (self.rows(spec), Self::outputs(spec));
        // lines that are on have no sign
        let driven_by = match (self.input, spec.shown) {
            (InputCoding::Signed, Shown::Dense(_)) => DrivenBy::Signed,
            _ => DrivenBy::Shared,
        };
        for (network, units) in [(&mut self.actor, outputs), (&mut self.critic, 1)] {
            if let Some(first) = network.layers.first_mut() {
                (first.inputs, first.driven_by) = (rows, driven_by);
            }
            if let Some(last) = network.layers.last_mut() {
                last.units = units;
            }
        }
        self
    }

    /// Thresholds and gains that track move after writes, of which evolution has none.
    fn middles(&self, network: &NetworkSpec) -> Result<(), NetworkError> {
        let moves = network.layers.iter().map(|layer| layer.homeostasis).find(|law| law.moves());
        let (Method::Evolution(_), Some(law)) = (self.method, moves) else { return Ok(()) };
        let (key, found) = match law.threshold {
            true => ("network.threshold", "is true"),
            false => ("network.gain", "is \"tracking\""),
        };
        let allowed =
            "it moves after writes, and evolution loads: use a gain that is \"fixed\", or none";
        Err(NetworkError::misfit(key, format_args!("{found} with evolution"), allowed))
    }

    /// Checks that everything fits together, on the chip, and with the environment.
    ///
    /// # Errors
    /// When something does not, with the key that says it.
    pub fn check(&self, spec: &EnvSpec) -> Result<(), NetworkError> {
        if !(1..=1024).contains(&self.environments) {
            let found = format!("is {}", self.environments);
            return Err(NetworkError::misfit(
                "environment.count",
                found,
                "it must lie in 1..=1024",
            ));
        }
        let sizes =
            [("environment.horizon", self.horizon), ("environment.rollouts", self.rollouts)];
        if let Some((key, _)) = sizes.into_iter().find(|(_, size)| *size == 0) {
            return Err(NetworkError::misfit(key, "is 0", "give at least 1"));
        }
        let epoch = self.steps_per_epoch();
        let few = self.steps > STEPS_MAX || self.steps.div_ceil(epoch) > u64::from(u32::MAX);
        if self.steps == 0 || few || epoch > 1 << 24 {
            let found = format!("is {}, in epochs of {epoch}", self.steps);
            let allowed =
                "give 1 step or more, 2^40 at most, in 2^32 epochs at most of 2^24 steps at most";
            return Err(NetworkError::misfit("environment.steps", found, allowed));
        }
        self.method.check()?;
        let networks = [(&self.actor, Self::outputs(spec)), (&self.critic, 1)];
        for (network, outputs) in networks {
            network.check(&self.hardware)?;
            let (first, last) = (&network.layers[0], &network.layers[network.layers.len() - 1]);
            if first.inputs != self.rows(spec) || last.units != outputs {
                let found = format!("has {} inputs and {} outputs", first.inputs, last.units);
                let allowed = format!("{} takes {} and {outputs}", spec.id, self.rows(spec));
                return Err(NetworkError::misfit("network.hidden", found, allowed));
            }
            // lines that are on have no sign
            let signed = self.input == InputCoding::Signed && matches!(spec.shown, Shown::Dense(_));
            if (first.driven_by == DrivenBy::Signed) != signed {
                let (has, wanted) = if signed { ("no", "one") } else { ("a", "none") };
                let found = format!("gives {} {has} sign in the first layer", spec.id);
                let allowed = format!(
                    "drives of numbers with input = \"signed\" have one, and no others: give them {wanted}"
                );
                return Err(NetworkError::misfit("network.input", found, allowed));
            }
            if last.activation != Activation::Accumulator {
                let allowed = "a policy reads the accumulators of both streams: use \"p-n\"";
                return Err(NetworkError::misfit("network.readout", "is not \"p-n\"", allowed));
            }
            self.middles(network)?;
        }
        let layers = self.actor.layers.iter().chain(&self.critic.layers);
        NetworkError::listed(&self.hardware.fault_map, (0..).zip(layers), Listed::All)?;
        if self.actor.batch != self.critic.batch {
            let allowed = "actor and critic learn from the same minibatches";
            return Err(NetworkError::misfit("learning.batch", "is not one", allowed));
        }
        Ok(())
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

impl Method {
    /// Checks that every number is one that it can be.
    fn check(self) -> Result<(), NetworkError> {
        let wrong = |key, found: &dyn std::fmt::Display, allowed: &str| {
            Err(NetworkError::misfit(key, format_args!("is {found}"), allowed))
        };
        match self {
            Self::Ppo(ppo) => {
                let shares = [
                    ("ppo.gamma", ppo.discount),
                    ("ppo.lambda", ppo.lambda),
                    ("ppo.clip", ppo.clip),
                    ("ppo.entropy", ppo.entropy),
                    ("ppo.log_sigma_rate", ppo.log_sigma_rate),
                ];
                if let Some((key, share)) =
                    shares.into_iter().find(|(_, share)| *share > Share::ONE)
                {
                    return wrong(key, &share, "it must lie in 0..=1");
                }
                if !(1..=1000).contains(&ppo.passes) {
                    return wrong("ppo.passes", &ppo.passes, "it must lie in 1..=1000");
                }
                if !(-4 << 16..=1 << 16).contains(&ppo.log_sigma_start) {
                    let allowed = "in units of 2^-16 it must lie in -4..=1";
                    return wrong("ppo.log_sigma", &ppo.log_sigma_start, allowed);
                }
                if !(1..=1024).contains(&ppo.noise_steps) {
                    return wrong("ppo.noise_steps", &ppo.noise_steps, "it must lie in 1..=1024");
                }
            }
            Self::Evolution(Evolution { pairs, step, shift }) => {
                if !(1..=4096).contains(&pairs) {
                    return wrong("es.pairs", &pairs, "it must lie in 1..=4096");
                }
                if !(1..=4095).contains(&step) {
                    return wrong("es.step", &step, "it must lie in 1..=4095");
                }
                if shift > 16 {
                    return wrong("es.shift", &shift, "it must lie in 0..=16");
                }
            }
        }
        Ok(())
    }
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
    /// Continuous actions: steps for which what was drawn stands, so that what is tried lasts.
    pub noise_steps: u32,
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
