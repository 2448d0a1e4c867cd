//! What decides the result of a classification run, as checked numbers; and the network built from it.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use crate::chip::crossbar::kernel::Backend;
use crate::chip::hardware::Hardware;
use crate::chip::layer::LayerSpec;
use crate::learn::driver::Driver;
use crate::learn::error::OutputError;
use crate::learn::network::{NetworkError, NetworkPlace, NetworkSpec};
use crate::num::tables::Activation;

/// Random shifts of training images.
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
    /// Shifts of training images.
    pub augment: Option<Augment>,
}

/// A network with its initial levels.
#[derive(Debug)]
pub struct Seeded(pub(super) Driver);

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
        match self.augment {
            Some(augment) => {
                augment.check(self.network.layers.first().map_or(0, LayerSpec::sample_inputs))
            }
            None => Ok(()),
        }
    }

    /// Builds the network and loads its initial levels.
    ///
    /// # Errors
    /// When something does not fit together or on the chip.
    pub fn build(&self, backend: Backend, samples: usize) -> Result<Seeded, NetworkError> {
        self.check()?;
        let updates = self.updates_per_epoch(samples).saturating_mul(self.epochs.into());
        let place = NetworkPlace { seed: self.seed, first_layer: 0, updates };
        self.network.build(&self.hardware, backend, place).map(Seeded)
    }
}

impl Augment {
    /// Checks that examples of `inputs` values are images that can be moved.
    fn check(self, inputs: usize) -> Result<(), NetworkError> {
        let Self { pixels, height, width, channels } = self;
        let values = height.checked_mul(width).and_then(|plane| plane.checked_mul(channels));
        let key = "learning.shift_pixels";
        if values != Some(inputs) {
            let found = format!("moves images of {height} x {width} x {channels}");
            let allowed = format!("an example has {inputs} values; leave the key out");
            return Err(NetworkError::misfit(key, found, allowed));
        }
        if pixels as usize >= height.min(width) {
            let allowed = "only images larger than the shift can be moved";
            return Err(NetworkError::misfit(key, format!("is {pixels}"), allowed));
        }
        Ok(())
    }
}
