//! A training whose parts were checked against one another: nothing that is asked of it can panic.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::examples::Examples;
use super::experiment::Experiment;
use super::trainer::{EpochProgress, Evaluation, Stop, Trainer};
use crate::chip::crossbar::kernel::Backend;
use crate::chip::hardware::{Adc, AdcRange};
use crate::chip::state::{State, StateError, Visitor};
use crate::learn::network::NetworkError;

/// A network on a chip, and the examples it learns from.
///
/// ```
/// use dalean::network::{
///     Activation, Centre, Coding, Control, Decay, DrivenBy, Homeostasis, InitialLevels, LayerSpec,
///     Pool,
/// };
/// use dalean::network::{
///     Batch, Optimiser, OutputError, Positive, RateMantissa, Route, Rule, UpdateMode, Wiring,
/// };
/// use dalean::{Backend, Classifier, Examples, Experiment, Hardware, NetworkSpec};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// // exclusive or: four examples of two values, two classes
/// let xor = Examples::new(vec![0, 0, 0, 1, 1, 0, 1, 1], vec![0, 1, 1, 0], 2, 1, 2)?;
/// let alpha = Positive::new(4.0).ok_or("a width")?;
/// let layer = |inputs, units, wiring, driven_by| LayerSpec {
///     inputs,
///     units,
///     wiring,
///     driven_by,
///     activation: Activation::Sigmoid(alpha),
///     weight_max_log2: 2,
///     initial: InitialLevels::Uniform { gain_64ths: [96, 32] },
///     constant_row: true,
///     convolution: None,
///     copies: 1,
///     pool: Pool::None,
///     homeostasis: Homeostasis::OFF,
/// };
/// let network = NetworkSpec {
///     layers: vec![
///         layer(2, 8, Wiring::Dual, DrivenBy::Shared),
///         layer(8, 2, Wiring::DualReadout, DrivenBy::Streams),
///     ],
///     rule: Rule::Ed,
///     mode: UpdateMode::Accumulate,
///     error: OutputError::OneVsAll,
///     centre: Centre::Batch,
///     route: Some(Route::Modulo { taps: 1, shift: None }),
///     batch: Batch::new(4)?,
///     mantissas: vec![RateMantissa::new(1)?; 2],
///     rates: vec![Positive::new(20.0).ok_or("a rate")?; 2],
///     decay: Decay::Constant,
///     optimisers: vec![Optimiser::Plain; 2],
///     centred: vec![false; 2],
///     control: Control::None,
///     refresh: None,
/// };
/// let hardware = Hardware::reference();
/// let coding = Coding::Values;
/// let experiment = Experiment { seed: 1, hardware, network, epochs: 3, coding, augment: None };
/// let mut classifier = Classifier::new(experiment, &xor, Backend::best())?;
/// for _ in 0..3 {
///     classifier.learn(&mut |_progress| true).expect("nobody asks it to stop");
/// }
/// assert_eq!(classifier.evaluate(&xor)?.predictions.len(), 4);
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Classifier {
    trainer: Trainer,
    train: Examples,
}

impl Classifier {
    /// Builds the network with its initial levels, and finds the ranges of its converters where the chip asks for it.
    ///
    /// # Errors
    /// When something does not fit together, not on the chip, or not with the examples.
    pub fn new(
        experiment: Experiment,
        train: &Examples,
        backend: Backend,
    ) -> Result<Self, NetworkError> {
        let seeded = experiment.build(backend, train)?;
        let mut trainer = Trainer::new(experiment, seeded);
        trainer.calibrate(train);
        Ok(Self { trainer, train: train.clone() })
    }

    /// One pass over the training examples, in the epoch's order. Returns right answers given while learning.
    ///
    /// # Errors
    /// [`Stop`] when `go_on` says so, the state then lies inside an epoch, or when the experiment has no epoch left.
    pub fn learn(&mut self, go_on: &mut dyn FnMut(EpochProgress) -> bool) -> Result<u64, Stop> {
        let again = matches!(
            self.trainer.experiment().hardware.adc,
            Adc::Finite { range: AdcRange::Calibrated { every_epoch: true, .. }, .. }
        );
        let Self { trainer, train } = self;
        if trainer.epoch() >= trainer.experiment().epochs {
            return Err(Stop);
        }
        if again && trainer.epoch() > 0 {
            trainer.calibrate(train);
        }
        trainer.learn(train, go_on)
    }

    /// Reads examples without learning.
    ///
    /// # Errors
    /// When they do not fit the network.
    pub fn evaluate(&mut self, examples: &Examples) -> Result<Evaluation, NetworkError> {
        self.trainer.experiment().fits(examples)?;
        Ok(self.trainer.evaluate(examples))
    }

    /// Accumulators of the outputs for each example, `[example][output]`: the greatest is the answer. Nothing is learnt.
    ///
    /// # Errors
    /// When they do not fit the network.
    pub fn outputs(&mut self, examples: &Examples) -> Result<Vec<i64>, NetworkError> {
        self.trainer.experiment().fits(examples)?;
        Ok(self.trainer.outputs(examples))
    }

    /// Shares large operations among so many threads from now on; no bit depends on it.
    ///
    /// # Errors
    /// When the system gives no threads.
    pub fn set_threads(&mut self, threads: usize) -> std::io::Result<()> {
        self.trainer.driver_mut().engine_mut().set_threads(threads)
    }

    /// Epochs finished.
    #[must_use]
    pub const fn epoch(&self) -> u32 {
        self.trainer.epoch()
    }
}

impl State for Classifier {
    fn visit(&mut self, visitor: &mut dyn Visitor) -> Result<(), StateError> {
        self.trainer.visit(visitor)
    }
}
