//! What decides the result of a classification run, as checked numbers; and the network built from it.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::coding::{Coder, Coding};
use super::examples::Examples;
use crate::chip::crossbar::kernel::Backend;
use crate::chip::hardware::Hardware;
use crate::chip::layer::{DrivenBy, LayerSpec, Listed};
use crate::learn::driver::Driver;
use crate::learn::error::OutputError;
use crate::learn::network::{NetworkError, NetworkPlace, NetworkSpec};
use crate::num::tables::Activation;

/// Random shifts and mirror images of training images.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Augment {
    /// Greatest shift, in pixels, in each direction.
    pub pixels: u32,
    /// Image height.
    pub height: usize,
    /// Image width.
    pub width: usize,
    /// Planes of an image.
    pub channels: usize,
    /// Whether left and right are exchanged, of each image with a chance of a half; before it is moved.
    pub flip: bool,
}

/// Everything that decides a result, the data aside.
///
/// See [`Classifier`](crate::Classifier).
#[derive(Debug, Clone, PartialEq)]
pub struct Experiment {
    /// Seed of all draws.
    pub seed: u64,
    /// The chip.
    pub hardware: Hardware,
    /// The network and how it learns.
    pub network: NetworkSpec,
    /// Passes over the training set.
    pub epochs: u32,
    /// What the values of an example put on the rows of the first layer.
    pub coding: Coding,
    /// Shifts and mirror images of training images.
    pub augment: Option<Augment>,
}

/// A network with its initial levels, and what codes examples for it.
#[derive(Debug)]
pub struct Seeded(pub(super) Driver, pub(super) Coder);

impl Experiment {
    /// Updates of one epoch over `samples` examples.
    #[must_use]
    pub fn updates_per_epoch(&self, samples: usize) -> u64 {
        samples.div_ceil(self.network.batch.get() as usize) as u64
    }

    /// Checks that everything fits together and on the chip.
    ///
    /// # Errors
    /// When something does not, with the key that says it.
    pub fn check(&self) -> Result<(), NetworkError> {
        self.network.check(&self.hardware)?;
        let layers = (0..).zip(&self.network.layers);
        NetworkError::listed(&self.hardware.fault_map, layers, Listed::All)?;
        if self.network.layers[0].driven_by == DrivenBy::Signed {
            let allowed = "values of examples have none: give the first layer one set of drives";
            return Err(NetworkError::misfit("network.input", "gives drives a sign", allowed));
        }
        let (last, hidden) = self.network.layers.split_last().expect("a network that was checked");
        let thresholds = hidden.iter().all(|layer| layer.homeostasis.threshold);
        let alone = self.network.error == OutputError::OneVsAll;
        if alone && last.activation == Activation::Accumulator {
            let found = "is \"one_vs_all\" beside outputs without a table";
            let allowed =
                "classes are told apart by activities; give outputs a table, or use \"softmax\"";
            return Err(NetworkError::misfit("learning.error", found, allowed));
        }
        if alone && self.network.centred.contains(&true) && !thresholds {
            let found = "is true of a layer";
            let allowed = "where an error is that of one class against all others, centred updates do not learn without \
                           thresholds: use network.threshold = true or learning.error = \"softmax\", or leave it out";
            return Err(NetworkError::misfit("learning.centred", found, allowed));
        }
        let rows = self.network.layers.first().map_or(0, LayerSpec::sample_inputs);
        self.coding.check(rows)?;
        match self.augment {
            Some(augment) => augment.check(self.coding.features(rows)),
            None => Ok(()),
        }
    }

    /// Values of an example.
    #[must_use]
    pub fn features(&self) -> usize {
        self.coding.features(self.network.layers.first().map_or(0, LayerSpec::sample_inputs))
    }

    /// Builds the network and loads its initial levels. Of the examples to learn from there are so many, and a coding may
    /// take their means.
    ///
    /// # Errors
    /// When something does not fit together, on the chip or with the examples.
    pub fn build(&self, backend: Backend, train: &Examples) -> Result<Seeded, NetworkError> {
        self.check()?;
        self.fits(train)?;
        let updates = self.updates_per_epoch(train.len()).saturating_mul(self.epochs.into());
        let place = NetworkPlace { seed: self.seed, first_layer: 0, updates };
        let driver = self.network.build(&self.hardware, backend, place)?;
        Ok(Seeded(driver, self.coding.of(train, self.hardware.drive.bits)))
    }

    /// Checks that examples have the values and classes that the network is for.
    ///
    /// # Errors
    /// When they do not.
    pub fn fits(&self, examples: &Examples) -> Result<(), NetworkError> {
        let (wanted, features) = (self.features(), examples.features());
        if features != wanted {
            let inputs = self.network.layers.first().map_or(0, LayerSpec::sample_inputs);
            let found = format!("has {inputs} inputs");
            let allowed = match self.coding {
                Coding::Values => format!("the examples have {features} values each"),
                _ => format!("they code {wanted} values, and the examples have {features} each"),
            };
            return Err(NetworkError::misfit("network.hidden", found, allowed));
        }
        let outputs = self.network.layers.last().map_or(0, |layer| layer.units);
        let classes = examples.classes();
        // a single output answers 0 or 1
        if classes == 1 {
            let allowed = "there is nothing to tell apart; give it at least 2";
            return Err(NetworkError::misfit("data.classes", "is 1", allowed));
        }
        if outputs != classes && !(outputs == 1 && classes == 2) {
            let found = format!("is {outputs}");
            let allowed =
                format!("the data has {classes} classes: use {classes}, or 1 for two classes");
            return Err(NetworkError::misfit("network.outputs", found, allowed));
        }
        Ok(())
    }
}

impl Augment {
    /// Checks that examples of so many values are images that can be moved.
    fn check(self, features: usize) -> Result<(), NetworkError> {
        let Self { pixels, height, width, channels, flip } = self;
        let values = height.checked_mul(width).and_then(|plane| plane.checked_mul(channels));
        let key = if flip && pixels == 0 { "learning.flip" } else { "learning.shift_pixels" };
        if values != Some(features) {
            let found = format!("moves images of {height} x {width} x {channels}");
            let allowed = format!("an example has {features} values; leave the key out");
            return Err(NetworkError::misfit(key, found, allowed));
        }
        if pixels as usize >= height.min(width) {
            let allowed = "only images larger than the shift can be moved";
            return Err(NetworkError::misfit(key, format!("is {pixels}"), allowed));
        }
        Ok(())
    }
}
