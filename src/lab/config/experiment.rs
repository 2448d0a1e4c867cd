//! What a configuration makes of data: the network with its sizes, and the experiment around it.

use std::iter;

use super::check::{Bias, wrong};
use super::{Config, ConfigError};
use crate::chip::layer::{DrivenBy, Homeostasis, InitialLevels, LayerSpec, Pool};
use crate::learn::error::OutputError;
use crate::learn::network::NetworkSpec;
use crate::learn::rule::{Readout, Rule};
use crate::num::tables::Activation;
use crate::task::classify::{Augment, Experiment};

impl Config {
    /// The experiment for examples of `features` values and `classes` classes.
    ///
    /// # Errors
    /// When it does not fit the data or the chip, or its parts do not fit together.
    pub fn experiment(
        &self,
        features: usize,
        classes: usize,
        image: Option<[usize; 3]>,
    ) -> Result<Experiment, ConfigError> {
        if self.policy.is_some() {
            let allowed = "a policy learns from no examples; see `policy_experiment`";
            return Err(wrong("task", "is \"policy\"", allowed));
        }
        if classes == 1 {
            let allowed = "there is nothing to tell apart; give it at least 2";
            return Err(wrong("data.classes", "is 1", allowed));
        }
        let default = if self.rule == Rule::Kaneko && classes == 2 { 1 } else { classes };
        let outputs = self.outputs.unwrap_or(default);
        if outputs != classes && !(outputs == 1 && classes == 2) {
            let allowed =
                format!("the data has {classes} classes: use {classes}, or 1 for two classes");
            return Err(wrong("network.outputs", format!("is {outputs}"), allowed));
        }
        let augment = match (self.shift_pixels, image) {
            (0, _) => None,
            (pixels, Some([height, width, channels])) => {
                Some(Augment { pixels, height, width, channels })
            }
            (pixels, None) => {
                let allowed = "the data holds no images; leave the key out";
                return Err(wrong("learning.shift_pixels", format!("is {pixels}"), allowed));
            }
        };
        let experiment = Experiment {
            seed: self.seed,
            hardware: self.hardware.clone(),
            network: self.network_of(features, &self.hidden, outputs),
            epochs: self.epochs,
            augment,
        };
        experiment.check()?;
        Ok(experiment)
    }

    /// The network between so many inputs and outputs, through hidden layers of so many units.
    pub(super) fn network_of(
        &self,
        inputs: usize,
        hidden: &[usize],
        outputs: usize,
    ) -> NetworkSpec {
        let mut sizes = vec![inputs];
        sizes.extend(hidden);
        sizes.push(outputs);
        let behind = |activation: &Activation| match activation {
            Activation::Rms => DrivenBy::Normalised,
            _ => DrivenBy::Streams,
        };
        let driven = iter::once(DrivenBy::Shared).chain(self.activations.iter().map(behind));
        let layers = (0..hidden.len() + 1).zip(driven).map(|(layer, driven_by)| {
            let last = layer == hidden.len();
            let activation = self.activations[layer];
            let wiring =
                self.rule.wiring(last.then(|| Readout::of(activation, OutputError::OneVsAll)));
            LayerSpec {
                inputs: sizes[layer],
                units: sizes[layer + 1],
                wiring,
                driven_by,
                activation,
                weight_max_log2: self.weight_max_log2[layer],
                initial: InitialLevels::Uniform { gain_64ths: self.gain_64ths[usize::from(last)] },
                constant_row: match self.bias {
                    Bias::None => false,
                    Bias::InputRow => driven_by == DrivenBy::Shared,
                    Bias::Rows => true,
                },
                convolution: None,
                pool: Pool::None,
                homeostasis: Homeostasis::OFF,
            }
        });
        NetworkSpec {
            layers: layers.collect(),
            rule: self.rule,
            mode: self.mode,
            error: OutputError::OneVsAll,
            centre: self.centre,
            route: self.route,
            batch: self.batch,
            mantissas: self.mantissas.clone(),
            rates: self.rates.clone(),
            decay: self.decay,
            optimisers: vec![self.optimiser; hidden.len() + 1],
            centred: vec![false; hidden.len() + 1],
        }
    }

    /// The rule as it was written.
    #[must_use]
    pub fn rule_name(&self) -> &str {
        self.resolved.learning.as_ref().and_then(|l| l.rule.as_deref()).unwrap_or("ed")
    }

    /// The mode of writing a batch as it was written.
    #[must_use]
    pub(crate) fn mode_name(&self) -> &str {
        self.resolved.learning.as_ref().and_then(|l| l.mode.as_deref()).unwrap_or("accumulate")
    }

    /// What may go wrong with these numbers, before anything runs.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        self.constants.complaints()
    }
}
