//! Epochs over examples.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::augment::Moves;
use super::coding::Coder;
use super::examples::Examples;
use super::experiment::{Experiment, Seeded};
use crate::chip::engine::{Calibration, Currents, Engine, Phase};
use crate::chip::state::{Piece, Section, State, StateError, Visitor};
use crate::learn::driver::Driver;
use crate::learn::error;
use crate::learn::statistics::{self, FloorMap, PathwayRecord};
use crate::num::draw;
use crate::num::fixed::narrow;

/// Samples read together when nothing is learnt. Does not change a result.
const READ_BATCH: usize = 256;

/// How far an epoch is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct EpochProgress {
    /// Epoch in progress, from 0.
    pub epoch: u32,
    /// Samples learnt from in this epoch.
    pub samples: usize,
    /// Samples of an epoch.
    pub samples_total: usize,
    /// Right answers among them, given before learning from them.
    pub correct: u64,
}

/// The caller asked to stop and the epoch in progress is not finished, or there is no epoch left.
///
/// See [`Classifier`](crate::Classifier).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Stop;

/// Answers to a set of examples.
///
/// See [`Classifier`](crate::Classifier).
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Evaluation {
    /// Predicted class of each example.
    pub predictions: Vec<u8>,
    /// Output accumulator of the predicted class minus that of the true class: 0 when right.
    pub margins: Vec<i64>,
    /// Right answers.
    pub correct: u64,
    /// Bank currents by layer.
    pub currents: Vec<Currents>,
    /// Layers whose units put out the same whatever was shown.
    pub mute: Vec<bool>,
}

/// A training in progress.
#[derive(Debug)]
pub struct Trainer {
    experiment: Experiment,
    driver: Driver,
    coder: Coder,
    start: FloorMap,
    epoch: u32,
}

impl Trainer {
    /// Starts from initial levels.
    #[must_use]
    pub fn new(experiment: Experiment, Seeded(driver, coder): Seeded) -> Self {
        let start = statistics::floor_map(driver.engine());
        Self { experiment, driver, coder, start, epoch: 0 }
    }

    /// What decides the result.
    #[must_use]
    pub const fn experiment(&self) -> &Experiment {
        &self.experiment
    }

    /// Learning in progress.
    #[must_use]
    pub const fn driver(&self) -> &Driver {
        &self.driver
    }

    /// Learning in progress, to restore.
    pub const fn driver_mut(&mut self) -> &mut Driver {
        &mut self.driver
    }

    /// Epochs finished.
    #[must_use]
    pub const fn epoch(&self) -> u32 {
        self.epoch
    }

    /// Mean of each channel over what is learnt from, where inputs lie above and below it; else nothing.
    #[must_use]
    pub fn middles(&self) -> &[u8] {
        self.coder.middles()
    }

    /// Statistics of every pathway now.
    #[must_use]
    pub fn pathways(&self) -> Vec<PathwayRecord> {
        statistics::pathways(self.driver.engine(), &self.start)
    }

    /// Finds converter ranges from the first training examples, if the hardware has finite converters.
    pub fn calibrate(&mut self, train: &Examples) -> Option<Calibration> {
        let codes = self.codes(train, 0..train.len().min(READ_BATCH));
        self.driver.engine_mut().calibrate(&codes)
    }

    fn codes(&mut self, examples: &Examples, which: impl Iterator<Item = usize>) -> Vec<u8> {
        let mut codes = Vec::new();
        for example in which {
            self.coder.code(examples.values(example), &mut codes);
        }
        codes
    }

    /// One pass over the training set, in the epoch's order. Returns right answers given while learning.
    ///
    /// # Errors
    /// [`Stop`] when `go_on` says so; the state then lies inside an epoch.
    pub fn learn(
        &mut self,
        train: &Examples,
        go_on: &mut dyn FnMut(EpochProgress) -> bool,
    ) -> Result<u64, Stop> {
        let total = train.len();
        let samples = narrow(total, "fewer than 2^32 examples");
        let seed = self.experiment.seed;
        let order = draw::shuffled(seed, u64::from(self.epoch), samples);
        let mut moves = self.experiment.augment.map(|way| Moves::of(way, seed, self.epoch));
        let (mut correct, mut done) = (0, 0);
        let (mut codes, mut moved) = (Vec::new(), Vec::new());
        let mut shares = Shares::default();
        self.driver.engine_mut().set_phase(Phase::Training);
        for batch in order.chunks(self.experiment.network.batch.get() as usize) {
            codes.clear();
            for &example in batch {
                let values = train.values(example as usize);
                let values = match &mut moves {
                    Some(moves) => {
                        moves.next_of(values, &mut moved);
                        &moved
                    }
                    None => values,
                };
                self.coder.code(values, &mut codes);
            }
            self.driver.learn(&codes, |engine, first, errors| {
                for sample in 0..engine.samples() {
                    let label = train.labels()[batch[first + sample] as usize];
                    shares.errors(engine, sample, label, errors);
                    correct += u64::from(predict(engine, sample).0 == usize::from(label));
                }
            });
            done += batch.len();
            let (epoch, samples) = (self.epoch, done);
            if !go_on(EpochProgress { epoch, samples, samples_total: total, correct }) {
                return Err(Stop);
            }
        }
        self.epoch += 1;
        Ok(correct)
    }

    /// Reads the first of these examples without learning, [`READ_BATCH`] at most; gives the words that their errors make,
    /// `[example][output]`. A mean that runs over errors moves by them.
    pub(crate) fn words(&mut self, examples: &Examples, count: usize) -> Vec<i16> {
        let which = 0..count.min(examples.len()).min(READ_BATCH);
        let phase = self.driver.engine().phase();
        self.driver.engine_mut().set_phase(Phase::Evaluation);
        let codes = self.codes(examples, which.clone());
        self.driver.read(&codes);
        let (mut errors, mut shares) = (Vec::new(), Shares::default());
        for example in which {
            let label = examples.labels()[example];
            shares.errors(self.driver.engine(), example, label, &mut errors);
        }
        let words = self.driver.engine_mut().output_words(&errors);
        self.driver.engine_mut().set_phase(phase);
        words
    }

    /// Accumulators of the outputs for each example, `[example][output]`.
    pub fn outputs(&mut self, examples: &Examples) -> Vec<i64> {
        let phase = self.driver.engine().phase();
        self.driver.engine_mut().set_phase(Phase::Evaluation);
        let mut all = Vec::new();
        for first in (0..examples.len()).step_by(READ_BATCH) {
            let which = first..(first + READ_BATCH).min(examples.len());
            let codes = self.codes(examples, which.clone());
            self.driver.read(&codes);
            let engine = self.driver.engine();
            for sample in 0..which.len() {
                all.extend((0..outputs(engine)).map(|at| engine.output_accumulator(sample, at)));
            }
        }
        self.driver.engine_mut().set_phase(phase);
        all
    }

    /// Reads examples without learning.
    pub fn evaluate(&mut self, examples: &Examples) -> Evaluation {
        let phase = self.driver.engine().phase();
        self.driver.engine_mut().set_phase(Phase::Evaluation);
        let _ = (self.driver.engine_mut().take_currents(), self.driver.engine_mut().take_mute());
        let (mut predictions, mut margins) = (Vec::new(), Vec::new());
        let mut correct = 0;
        for first in (0..examples.len()).step_by(READ_BATCH) {
            let which = first..(first + READ_BATCH).min(examples.len());
            let codes = self.codes(examples, which.clone());
            self.driver.read(&codes);
            let engine = self.driver.engine();
            for (sample, example) in which.enumerate() {
                let truth = usize::from(examples.labels()[example]);
                let (guess, value) = predict(engine, sample);
                let own =
                    if outputs(engine) == 1 { 0 } else { engine.output_accumulator(sample, truth) };
                correct += u64::from(guess == truth);
                predictions.push(narrow(guess, "at most 256 classes"));
                margins.push(if guess == truth { 0 } else { (value - own).abs() });
            }
        }
        let currents = self.driver.engine_mut().take_currents();
        let mute = self.driver.engine_mut().take_mute();
        self.driver.engine_mut().set_phase(phase);
        Evaluation { predictions, margins, correct, currents, mute }
    }
}

impl State for Trainer {
    fn visit(&mut self, visitor: &mut dyn Visitor) -> Result<(), StateError> {
        let within = 0..=i64::from(self.experiment.epochs);
        let piece = Piece { name: "epoch", section: Some(Section::Progress), within };
        if let Some(epoch) = visitor.numbers(&piece, &[i64::from(self.epoch)])? {
            self.epoch = u32::try_from(epoch[0]).expect("a visitor keeps to the range");
        }
        self.driver.visit(visitor)
    }
}

/// What classes share, while errors are formed of it.
#[derive(Default)]
struct Shares {
    sums: Vec<i64>,
    shares: Vec<u8>,
}

impl Shares {
    /// Appends the error of each output for a loaded sample.
    fn errors(&mut self, engine: &Engine, sample: usize, label: u8, errors: &mut Vec<i32>) {
        let outputs = 0..outputs(engine);
        match engine.error_unit().softmax() {
            Some(tables) => {
                self.sums.clear();
                self.sums.extend(outputs.map(|at| engine.output_accumulator(sample, at)));
                tables.share_out(&self.sums, &mut self.shares);
                error::errors(label, self.shares.iter().copied(), errors);
            }
            None => {
                let activity = outputs.map(|at| engine.output_activity(sample, at));
                error::errors(label, activity, errors);
            }
        }
    }
}

fn outputs(engine: &Engine) -> usize {
    engine.layers().last().expect("a network has layers").spec.units
}

/// The argmax of the output accumulators, the lowest class on ties, and its accumulator. A single output says
/// class 1 above 0.
fn predict(engine: &Engine, sample: usize) -> (usize, i64) {
    let outputs = outputs(engine);
    if outputs == 1 {
        let value = engine.output_accumulator(sample, 0);
        return (usize::from(value > 0), value);
    }
    let mut best = (0, engine.output_accumulator(sample, 0));
    for unit in 1..outputs {
        let value = engine.output_accumulator(sample, unit);
        if value > best.1 {
            best = (unit, value);
        }
    }
    best
}
