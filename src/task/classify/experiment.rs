//! What decides the result of a classification run, as checked numbers; and the network built from it.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use crate::chip::crossbar::kernel::Backend;
use crate::chip::crossbar::{initial_levels, initial_scale};
use crate::chip::engine::{Engine, Operation};
use crate::chip::hardware::Hardware;
use crate::chip::layer::{self, Delivery, Layer, LayerSpec, PlanError};
use crate::learn::driver::{Driver, Learning};
use crate::learn::error::{Centre, ErrorUnit};
use crate::learn::route::Route;
use crate::learn::rule::{Rule, UpdateMode};
use crate::num::draw::{Place, Site};
use crate::num::fixed::{Batch, RateMantissa};
use crate::num::tables::{Decay, Positive, Rate};

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
#[derive(Debug, Clone, PartialEq)]
pub struct Experiment {
    /// Seed of all draws.
    pub seed: u64,
    /// The chip.
    pub hardware: Hardware,
    /// The network, input to output.
    pub layers: Vec<LayerSpec>,
    /// The rule.
    pub rule: Rule,
    /// When a batch is written.
    pub mode: UpdateMode,
    /// What is subtracted from errors.
    pub centre: Centre,
    /// How errors reach hidden layers.
    pub route: Route,
    /// Configured batch.
    pub batch: Batch,
    /// Small factor of the rate.
    pub mantissa: RateMantissa,
    /// Rate of each layer, multiplier included.
    pub rates: Vec<Positive>,
    /// How the rate falls.
    pub decay: Decay,
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
        samples.div_ceil(self.batch.get() as usize) as u64
    }

    /// Checks that the network fits the chip.
    ///
    /// # Errors
    /// When it does not.
    pub fn check(&self) -> Result<(), PlanError> {
        layer::check(&self.layers, &self.hardware)
    }

    /// Builds the network and loads its initial levels.
    ///
    /// # Errors
    /// When it does not fit the chip.
    pub fn build(&self, backend: Backend, samples: usize) -> Result<Seeded, PlanError> {
        self.check()?;
        let bits = self.hardware.digital.error_bits;
        let outputs = self.layers.last().expect("checked: at least one layer").units;
        let last = self.layers.len() - 1;
        let layers = self.layers.iter().zip(0u16..).map(|(spec, index)| {
            let delivery = match self.rule {
                _ if usize::from(index) == last => Delivery::output(outputs),
                Rule::Bp => Delivery::above(spec.units),
                Rule::Ed | Rule::Kaneko | Rule::Dfa => {
                    self.route.delivery(spec.units, outputs, self.seed, index)
                }
            };
            Layer::new(index, spec.clone(), delivery, &self.hardware)
        });
        let layers: Vec<Layer> = layers.collect();
        let updates = self.updates_per_epoch(samples) * u64::from(self.epochs);
        let shifts = layers.iter().zip(&self.rates).map(|(layer, &rate)| {
            let rate = Rate {
                rate,
                batch: self.batch,
                mantissa: self.mantissa,
                error_bits: bits,
                activation: layer.spec.activation,
                unit: layer::unit(&layer.spec, &self.hardware),
            };
            rate.shifts(self.decay, updates)
        });
        let learning = Learning { rule: self.rule, mode: self.mode, shifts: shifts.collect() };
        let mut engine = Engine::new(self.hardware.clone(), backend, self.seed, layers);
        engine.set_potentiation_only(self.rule == Rule::Kaneko);
        engine.set_mantissa(self.mantissa.get());
        self.load_initial_levels(&mut engine);
        let unit = ErrorUnit::new(self.centre, bits, outputs);
        Ok(Seeded(Driver::new(engine, learning, unit)))
    }

    fn load_initial_levels(&self, engine: &mut Engine) {
        for layer in 0..self.layers.len() {
            let spec = &self.layers[layer];
            let layout = engine.layers()[layer].layout;
            for (array, pathway) in spec.wiring.pathways().iter().enumerate() {
                let inhibits = pathway.polarity == crate::chip::population::Polarity::Inhibits;
                let scale = initial_scale(
                    spec.gain_64ths[usize::from(inhibits)],
                    self.hardware.cell.level_bits.get(),
                    spec.weight_max_log2,
                    spec.inputs,
                );
                let place = Place {
                    seed: self.seed,
                    site: Site::InitialLevels,
                    layer: u16::try_from(layer).expect("checked: few layers"),
                    pathway: pathway.code,
                    sub: 0,
                    count: 0,
                };
                initial_levels(layout, self.hardware.cell.window, scale, place, |row, levels| {
                    engine.execute(&Operation::LoadWeights { layer, array, row, levels });
                });
            }
        }
    }
}
