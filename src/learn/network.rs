//! The network builder: what a network is made of and how it learns, checked as a whole and built with its initial
//! levels.
//!
//! A [`NetworkSpec`] is plain data. [`NetworkSpec::check`] says of everything that does not fit together where it is,
//! what was found, what is allowed and what to try; nothing else in this wing can be built from outside. A run may hold
//! several networks: [`NetworkPlace`] numbers their layers through, so that no draw of one is a draw of another. See
//! docs/MODEL.md, 1, 3.5 and 3.6.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

mod check;
#[cfg(test)]
mod tests;

pub use check::{GAIN_64THS, WEIGHT_MAX_LOG2};

use std::num::NonZeroU32;

use super::driver::{Driver, Learning};
use super::error::{Centre, ErrorUnit, OutputError};
use super::route::Route;
use super::rule::{Control, Rule, UpdateMode};
use crate::chip::crossbar::kernel::Backend;
use crate::chip::crossbar::{InitialLaw, initial_levels, initial_scale};
use crate::chip::device::FaultMap;
use crate::chip::engine::{Engine, Operation};
use crate::chip::hardware::Hardware;
use crate::chip::layer::{
    self, Delivery, InitialLevels, Layer, LayerSpec, Listed, Optimiser, PlanError,
};
use crate::chip::population::{Pathway, Polarity};
use crate::num::draw::{Place, Site};
use crate::num::fixed::{Batch, RateMantissa, log2_ceil};
use crate::num::tables::{Activation, Decay, Positive, Rate, RateOf, SoftmaxTables, half_gaussian};

/// `log2` of the batches after which a mean drive has come all the way, were it not to turn: 0.1 a batch is the rate that
/// was measured, and an eighth the nearest power of two.
const CENTRED_BATCHES_LOG2: u32 = 3;

/// A network and how it learns.
///
/// An example is that of [`Classifier`](crate::Classifier); of what is wrong, that of [`NetworkError`].
#[derive(Debug, Clone, PartialEq)]
pub struct NetworkSpec {
    /// The layers, input to output.
    pub layers: Vec<LayerSpec>,
    /// The rule.
    pub rule: Rule,
    /// When a batch is written.
    pub mode: UpdateMode,
    /// What an error of an output is.
    pub error: OutputError,
    /// What is subtracted from errors.
    pub centre: Centre,
    /// How errors reach hidden layers; `None` for back-propagation, whose errors come down through the layers above.
    pub route: Option<Route>,
    /// Configured batch.
    pub batch: Batch,
    /// Small factor of the rate of each layer.
    pub mantissas: Vec<RateMantissa>,
    /// Rate of each layer, multiplier included.
    pub rates: Vec<Positive>,
    /// How the rate falls.
    pub decay: Decay,
    /// What makes requests of the sums of each layer.
    pub optimisers: Vec<Optimiser>,
    /// Whether the updates of each layer are centred: the mean drive of each row is taken off. The mean runs, an eighth of
    /// the way to that of each batch.
    pub centred: Vec<bool>,
    /// What is taken from it, to see whether it is needed.
    pub control: Control,
    /// After how many updates, again and again, what both cells of a pair hold is taken off both; see MODEL 3.15.
    pub refresh: Option<NonZeroU32>,
}

/// Where a network stands in a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NetworkPlace {
    /// Seed of all draws of the run.
    pub seed: u64,
    /// Number of its first layer in draws: the layers of the networks before it.
    pub first_layer: u16,
    /// Updates of the whole run, over which the rate falls.
    pub updates: u64,
}

/// What the units of hidden layers hear.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum HiddenWords {
    /// Words of the output, by the route of the network; back-propagation's from the layer above.
    #[default]
    Routed,
    /// Words of their own, one a unit, over a bus as wide as the layer: whoever drives the network forms them.
    Own,
}

/// A network that does not fit together, or not on the chip.
///
/// ```
/// use dalean::network::{Batch, Centre, Control, Decay, OutputError, Rule, UpdateMode};
/// use dalean::{Hardware, NetworkSpec};
///
/// let nothing = NetworkSpec {
///     layers: vec![],
///     rule: Rule::Bp,
///     mode: UpdateMode::Accumulate,
///     error: OutputError::OneVsAll,
///     centre: Centre::None,
///     route: None,
///     batch: Batch::new(1)?,
///     mantissas: vec![],
///     rates: vec![],
///     decay: Decay::Constant,
///     optimisers: vec![],
///     centred: vec![],
///     control: Control::None,
///     refresh: None,
/// };
/// let error = nothing.check(&Hardware::reference()).unwrap_err();
/// assert_eq!(error.key(), "network.hidden");
/// assert_eq!(error.to_string(), "the network has 0 layers; 1 to 64 are supported");
/// # Ok::<(), dalean::hardware::OutOfRange>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum NetworkError {
    /// The plan of arrays and tiles.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// A part that does not fit with the others.
    #[error("`{key}` {found}; {allowed}")]
    Misfit {
        /// The key that says it in an experiment, such as `learning.taps`.
        key: &'static str,
        /// What was found.
        found: String,
        /// What is allowed and what to try.
        allowed: String,
    },
}

impl NetworkError {
    /// Whether the cells of a list are those of layers with these numbers.
    pub(crate) fn listed<'a>(
        map: &FaultMap,
        layers: impl Iterator<Item = (u16, &'a LayerSpec)>,
        which: Listed,
    ) -> Result<(), Self> {
        layer::check_listed(map, layers, which)
            .map_err(|error| Self::misfit("hw.device.faults.map", error.found, error.allowed))
    }

    /// A part that does not fit with the others; tasks say so of what they add to a network.
    pub fn misfit(
        key: &'static str,
        found: impl std::fmt::Display,
        allowed: impl std::fmt::Display,
    ) -> Self {
        Self::Misfit { key, found: found.to_string(), allowed: allowed.to_string() }
    }

    /// The key that says it in an experiment: stable, for callers that keep several networks under several names.
    #[must_use]
    pub const fn key(&self) -> &'static str {
        match self {
            Self::Plan(PlanError::Tiles { .. }) => "hw.tile.count",
            Self::Plan(PlanError::Size { .. } | PlanError::Layers { .. }) => "network.hidden",
            Self::Misfit { key, .. } => key,
        }
    }
}

impl NetworkSpec {
    /// Checks that everything fits together and on the chip.
    ///
    /// # Errors
    /// When something does not, with the key that says it.
    pub fn check(&self, hardware: &Hardware) -> Result<(), NetworkError> {
        check::check(self, hardware)
    }

    /// The rate that each layer really has: `k` is a whole number, so a rate becomes another one.
    ///
    /// # Errors
    /// When the network does not fit together.
    pub fn rates_effective(&self, hardware: &Hardware) -> Result<Vec<Positive>, NetworkError> {
        self.check(hardware)?;
        let rates = self.rates(hardware).enumerate();
        rates.map(|(at, rate)| rate.effective().map_err(|e| check::no_shift(at, &e))).collect()
    }

    /// What the rate of each layer is made of.
    fn rates(&self, hardware: &Hardware) -> impl Iterator<Item = Rate> {
        let rates = self.rates.iter().zip(&self.mantissas).zip(&self.optimisers);
        self.layers.iter().zip(rates).map(|(spec, ((&rate, &mantissa), optimiser))| Rate {
            rate,
            of: rate_of(spec, *optimiser),
            batch: self.batch,
            positions: spec.positions(),
            mantissa,
            error_bits: hardware.digital.error_bits,
            activation: spec.activation,
            unit: layer::unit(spec, hardware),
            window: hardware.pulses_of_window(),
        })
    }

    /// Builds the network, loads its initial levels and stands ready to learn.
    ///
    /// # Errors
    /// When it does not fit together, not on the chip, or not behind so many other layers.
    ///
    /// # Panics
    /// Never: what could panic was checked.
    pub fn build(
        &self,
        hardware: &Hardware,
        backend: Backend,
        place: NetworkPlace,
    ) -> Result<Driver, NetworkError> {
        self.build_hearing(hardware, backend, place, HiddenWords::Routed)
    }

    /// The same; `words` says what hidden layers hear.
    pub(crate) fn build_hearing(
        &self,
        hardware: &Hardware,
        backend: Backend,
        place: NetworkPlace,
        words: HiddenWords,
    ) -> Result<Driver, NetworkError> {
        self.check(hardware)?;
        let numbers = self.numbers(place)?;
        let numbered = numbers.iter().copied().zip(&self.layers);
        NetworkError::listed(&hardware.fault_map, numbered, Listed::Some)?;
        let deliveries = self.deliveries(place.seed, &numbers, words);
        let layers = self.layers.iter().zip(deliveries).zip(&numbers);
        let layers = layers.map(|((spec, delivery), &number)| {
            Layer::new(number, spec.clone(), delivery, hardware)
        });
        let layers: Vec<_> = layers.collect();
        let shifts = self.rates(hardware).enumerate().map(|(at, rate)| {
            rate.shifts(self.decay, place.updates).map_err(|e| check::no_shift(at, &e))
        });
        let shifts = shifts.collect::<Result<_, _>>()?;
        let mut engine = Engine::new(hardware.clone(), backend, place.seed, layers);
        engine.set_potentiation_only(self.rule == Rule::Kaneko);
        let mantissas: Vec<u32> = self.mantissas.iter().map(|mantissa| mantissa.get()).collect();
        engine.set_mantissas(&mantissas);
        engine.set_optimisers(&self.optimisers);
        let window = log2_ceil(self.batch.get().into()) + CENTRED_BATCHES_LOG2;
        let windows: Vec<_> = self.centred.iter().map(|on| on.then_some(window)).collect();
        engine.set_centred(&windows);
        load_initial_levels(&mut engine, place.seed);
        let bits = hardware.digital.error_bits;
        let unit = match (self.error, self.layers.last()) {
            (OutputError::Softmax { temperature }, Some(last)) => {
                let unit = layer::unit(last, hardware);
                let tables = SoftmaxTables::new(unit, temperature, self.outputs());
                ErrorUnit::new(self.centre, bits, self.outputs()).with_softmax(tables)
            }
            (_, Some(last)) if last.activation == Activation::Accumulator => {
                ErrorUnit::handed(bits)
            }
            _ => ErrorUnit::new(self.centre, bits, self.outputs()),
        };
        let Self { rule, mode, control, refresh, .. } = *self;
        let learning = Learning { rule, mode, control, refresh, shifts };
        Ok(Driver::new(engine, learning, unit))
    }

    /// Units of the last layer: error words of a sample. Only asked of a network that has layers.
    fn outputs(&self) -> usize {
        self.layers.last().map_or(0, |layer| layer.units)
    }

    /// Numbers of the layers in draws.
    fn numbers(&self, place: NetworkPlace) -> Result<Vec<u16>, NetworkError> {
        let first = usize::from(place.first_layer);
        let numbers = (first..first + self.layers.len()).map(u16::try_from);
        numbers.collect::<Result<_, _>>().map_err(|_| {
            let found = format!("of {} layers comes behind {first} others", self.layers.len());
            let allowed = "the layers of a run are numbered 0..=65535 in draws; use fewer";
            NetworkError::misfit("network.hidden", found, allowed)
        })
    }

    /// How errors reach each layer.
    fn deliveries(&self, seed: u64, numbers: &[u16], words: HiddenWords) -> Vec<Delivery> {
        let (outputs, last) = (self.outputs(), self.layers.len() - 1);
        let layers = self.layers.iter().zip(numbers).enumerate();
        let delivery = layers.map(|(at, (spec, &number))| {
            let delivery = match self.route {
                _ if at == last => Delivery::output(outputs),
                _ if words == HiddenWords::Own => Delivery::output(spec.units),
                None => Delivery::above(spec.units),
                Some(route) => route.delivery(spec.units, outputs, seed, number),
            };
            Delivery { alike: self.control.is_alike(at == last), ..delivery }
        });
        delivery.collect()
    }
}

/// What the rate of a layer is a measure of.
fn rate_of(spec: &LayerSpec, optimiser: Optimiser) -> RateOf {
    match optimiser {
        Optimiser::Sign { .. } => RateOf::Pulses,
        Optimiser::Rms => {
            let excites = |pathway: &&Pathway| pathway.polarity == Polarity::Excites;
            let arrays = spec.wiring.pathways().iter().filter(excites).count();
            let rows = spec.inputs + usize::from(spec.constant_row);
            RateOf::Levels { fan_in: spec.inputs, cells: rows * spec.units * arrays }
        }
        Optimiser::AdamFx { .. } => RateOf::Requests,
        _ => RateOf::Sums,
    }
}

/// Draws the initial levels of every array and loads them row by row.
fn load_initial_levels(engine: &mut Engine, seed: u64) {
    let (level_bits, window) = (engine.hardware().cell.level_bits, engine.hardware().cell.window);
    let half = half_gaussian();
    for layer in 0..engine.layers().len() {
        let this = &engine.layers()[layer];
        let (layout, number, wiring) = (this.layout, this.index, this.spec.wiring);
        let (initial, weight_max_log2, fan_in) =
            (this.spec.initial, this.spec.weight_max_log2, this.spec.inputs);
        for (array, pathway) in wiring.pathways().iter().enumerate() {
            let inhibits = pathway.polarity == Polarity::Inhibits;
            let scale = |gain, halved| {
                initial_scale(gain, halved, level_bits.get(), weight_max_log2, fan_in)
            };
            let law = match initial {
                InitialLevels::Uniform { gain_64ths } => {
                    InitialLaw::Uniform(scale([gain_64ths[usize::from(inhibits)], 64], false))
                }
                InitialLevels::AbsGaussian { gain } => {
                    InitialLaw::AbsGaussian(scale(gain, true), &half)
                }
            };
            let place = Place {
                seed,
                site: Site::InitialLevels,
                layer: number,
                pathway: pathway.code,
                sub: 0,
                count: 0,
            };
            initial_levels(layout, window, law, place, |row, levels| {
                engine.execute(&Operation::LoadWeights { layer, array, row, levels });
            });
        }
    }
}
