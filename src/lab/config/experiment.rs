//! What a configuration makes of data: the network with its sizes, and the experiment around it.

use std::iter;

use super::check::{Bias, Convolved, ImageInput, wrong};
use super::{Config, ConfigError};
use crate::chip::layer::{DrivenBy, Homeostasis, InitialLevels, LayerSpec, Pool};
use crate::learn::network::NetworkSpec;
use crate::learn::rule::{Readout, Rule};
use crate::num::tables::Activation;
use crate::task::classify::{Augment, Coding, Experiment};

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
        let coding = self.coding(image)?;
        let experiment = Experiment {
            seed: self.seed,
            hardware: self.hardware.clone(),
            network: self.network_of(coding.rows(features), &self.hidden, outputs),
            coding,
            epochs: self.epochs,
            augment: self.augment(image)?,
        };
        experiment.check()?;
        Ok(experiment)
    }

    /// What examples put on rows.
    fn coding(&self, image: Option<[usize; 3]>) -> Result<Coding, ConfigError> {
        const SHAPE: &str =
            "say their sizes with data.shape = [height, width, channels], or leave the key out";
        let convolution = self.convolutions.first();
        let Some(image) = image else {
            return match (self.input, convolution) {
                (ImageInput::Raw, None) => Ok(Coding::Values),
                (ImageInput::Raw, Some(_)) => {
                    Err(wrong("network.channels", "is given and the data holds no images", SHAPE))
                }
                (ImageInput::OnOff | ImageInput::White, _) => {
                    Err(wrong("network.input", "is of images and the data holds none", SHAPE))
                }
            };
        };
        let coding = self.input.coding(image, convolution.is_some());
        if let Some(Convolved { shape, .. }) = convolution {
            let [height, width, _] = image;
            let given = [height, width, coding.channels().unwrap_or_default()];
            if given != [shape.height, shape.width, shape.channels] {
                let found = format!(
                    "was made for images of {} x {} with {} channels of codes",
                    shape.height, shape.width, shape.channels
                );
                let allowed = format!(
                    "those of the data are {height} x {width} with {}: say so with data.shape",
                    given[2]
                );
                return Err(wrong("network.channels", found, allowed));
            }
        }
        Ok(coding)
    }

    /// What becomes of training images.
    fn augment(&self, image: Option<[usize; 3]>) -> Result<Option<Augment>, ConfigError> {
        let (pixels, flip) = (self.shift_pixels, self.flip);
        if pixels == 0 && !flip {
            return Ok(None);
        }
        if let Some([height, width, channels]) = image {
            return Ok(Some(Augment { pixels, height, width, channels, flip }));
        }
        let allowed = "the data holds no images; leave the key out";
        Err(match pixels {
            0 => wrong("learning.flip", "is true", allowed),
            _ => wrong("learning.shift_pixels", format!("is {pixels}"), allowed),
        })
    }

    /// How often the arrays of each convolution stand on the chip.
    pub(crate) fn copies(&self) -> Vec<usize> {
        self.convolutions.iter().map(|window| window.copies).collect()
    }

    /// The network between so many values and outputs, through convolutions and hidden layers of so many units.
    pub(super) fn network_of(
        &self,
        inputs: usize,
        hidden: &[usize],
        outputs: usize,
    ) -> NetworkSpec {
        let windows = self.convolutions.len();
        let below = self.convolutions.last().map(|last| last.pooled().iter().product());
        let mut sizes = vec![below.unwrap_or(inputs)];
        sizes.extend(hidden);
        sizes.push(outputs);
        let count = windows + hidden.len() + 1;
        let behind = |activation: &Activation| match activation {
            Activation::Rms => DrivenBy::Normalised,
            _ => DrivenBy::Streams,
        };
        let driven = iter::once(DrivenBy::Shared).chain(self.activations.iter().map(behind));
        let layers = (0..count).zip(driven).map(|(layer, driven_by)| {
            let last = layer + 1 == count;
            let window = self.convolutions.get(layer);
            let (inputs, units) = match window {
                Some(window) => (window.shape.rows(), window.units),
                None => (sizes[layer - windows], sizes[layer - windows + 1]),
            };
            let activation = self.activations[layer];
            let wiring = self.rule.wiring(last.then(|| Readout::of(activation, self.error)));
            LayerSpec {
                inputs,
                units,
                wiring,
                driven_by,
                activation,
                weight_max_log2: self.weight_max_log2[layer],
                initial: InitialLevels::Uniform { gain_64ths: self.gain_64ths[usize::from(last)] },
                constant_row: match self.bias {
                    Bias::None => false,
                    Bias::InputRow => driven_by.is_shared(),
                    Bias::Rows => true,
                },
                convolution: window.map(|window| window.shape),
                copies: window.map_or(1, |window| window.copies),
                pool: window.map_or(Pool::None, |window| window.pool),
                homeostasis: if last { Homeostasis::OFF } else { self.homeostasis },
            }
        });
        NetworkSpec {
            layers: layers.collect(),
            rule: self.rule,
            mode: self.mode,
            error: self.error,
            centre: self.centre,
            route: self.route,
            batch: self.batch,
            mantissas: self.mantissas.clone(),
            rates: self.rates.clone(),
            decay: self.decay,
            optimisers: vec![self.optimiser; count],
            centred: vec![self.centred; count],
            control: self.control,
            refresh: self.refresh,
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
