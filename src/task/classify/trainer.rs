//! Epochs over examples.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::examples::Examples;
use super::experiment::{Augment, Experiment, Seeded};
use crate::chip::engine::{Calibration, Currents, Engine, Phase};
use crate::chip::layer::LayerSpec;
use crate::chip::state::{Piece, Section, State, StateError, Visitor};
use crate::learn::driver::Driver;
use crate::learn::error;
use crate::learn::network::NetworkError;
use crate::learn::statistics::{self, FloorMap, PathwayRecord};
use crate::num::draw::{self, Place, Site, below};
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
    start: FloorMap,
    epoch: u32,
}

impl Trainer {
    /// Starts from initial levels.
    #[must_use]
    pub fn new(experiment: Experiment, Seeded(driver): Seeded) -> Self {
        let start = statistics::floor_map(driver.engine());
        Self { experiment, driver, start, epoch: 0 }
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

    /// Checks that examples have the values and classes that the network is for.
    ///
    /// # Errors
    /// When they do not.
    pub fn fits(&self, examples: &Examples) -> Result<(), NetworkError> {
        let layers = &self.experiment.network.layers;
        let inputs = layers.first().map_or(0, LayerSpec::sample_inputs);
        let outputs = layers.last().map_or(0, |layer| layer.units);
        let (features, classes) = (examples.features(), examples.classes());
        if features != inputs {
            let found = format!("has {inputs} inputs");
            let allowed = format!("the examples have {features} values each");
            return Err(NetworkError::misfit("network.hidden", found, allowed));
        }
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

    fn codes(&self, examples: &Examples, which: impl Iterator<Item = usize>) -> Vec<u8> {
        let table = examples.codes(self.experiment.hardware.drive.bits);
        which
            .flat_map(|example| examples.values(example).iter().map(|&v| table[usize::from(v)]))
            .collect()
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
        let shifts = self.experiment.augment.map(|augment| shifts(augment, seed, self.epoch));
        let table = train.codes(self.experiment.hardware.drive.bits);
        let same = table.iter().zip(0..=u8::MAX).all(|(&code, value)| code == value);
        let (mut correct, mut done) = (0, 0);
        let mut codes = Vec::new();
        let (mut sums, mut shares) = (Vec::new(), Vec::new());
        let mut shifts = shifts;
        self.driver.engine_mut().set_phase(Phase::Training);
        for batch in order.chunks(self.experiment.network.batch.get() as usize) {
            codes.clear();
            for &example in batch {
                let start = codes.len();
                let values = train.values(example as usize);
                match (&mut shifts, self.experiment.augment) {
                    (Some(shifts), Some(augment)) => {
                        let by = shifts.next().expect("the stream has no end");
                        shift_into(values, augment, by, &mut codes);
                    }
                    _ => codes.extend_from_slice(values),
                }
                if !same {
                    for code in &mut codes[start..] {
                        *code = table[usize::from(*code)];
                    }
                }
            }
            self.driver.learn(&codes, |engine, first, errors| {
                for sample in 0..engine.samples() {
                    let label = train.labels()[batch[first + sample] as usize];
                    let outputs = outputs(engine);
                    match engine.error_unit().softmax() {
                        Some(tables) => {
                            sums.clear();
                            sums.extend(
                                (0..outputs).map(|at| engine.output_accumulator(sample, at)),
                            );
                            tables.share_out(&sums, &mut shares);
                            error::errors(label, shares.iter().copied(), errors);
                        }
                        None => {
                            let activity =
                                (0..outputs).map(|at| engine.output_activity(sample, at));
                            error::errors(label, activity, errors);
                        }
                    }
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

/// Shifts of an epoch's samples in batch order: right and down, two words a sample.
fn shifts(augment: Augment, seed: u64, epoch: u32) -> impl Iterator<Item = [i64; 2]> {
    let mut words = Place::global(seed, Site::Augment, u64::from(epoch)).words();
    let span = 2 * augment.pixels + 1;
    let mut next = move || {
        let word = words.next().expect("the stream has no end");
        i64::from(below(word, span)) - i64::from(augment.pixels)
    };
    std::iter::from_fn(move || Some([next(), next()]))
}

/// Appends an image moved by `[right, down]` pixels; what comes in from outside is 0.
fn shift_into(values: &[u8], augment: Augment, [right, down]: [i64; 2], out: &mut Vec<u8>) {
    let Augment { height, width, channels, .. } = augment;
    let inside = |at: i64, size: usize| usize::try_from(at).ok().filter(|&at| at < size);
    for plane in values.chunks_exact(height * width).take(channels) {
        for y in 0..height {
            let from_row = inside(y as i64 - down, height);
            for x in 0..width {
                let from = from_row.zip(inside(x as i64 - right, width));
                out.push(from.map_or(0, |(y, x)| plane[y * width + x]));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_image_moves_right_and_down_and_loses_its_edge() {
        let augment = Augment { pixels: 1, height: 2, width: 3, channels: 1 };
        let mut out = Vec::new();
        shift_into(&[1, 2, 3, 4, 5, 6], augment, [1, 0], &mut out);
        shift_into(&[1, 2, 3, 4, 5, 6], augment, [0, -1], &mut out);
        assert_eq!(out, [0, 1, 2, 0, 4, 5, 4, 5, 6, 0, 0, 0]);
    }

    #[test]
    fn shifts_stay_within_their_pixels_and_use_all_of_them() {
        let augment = Augment { pixels: 1, height: 2, width: 3, channels: 1 };
        let some: Vec<_> = shifts(augment, 1, 0).take(500).flatten().collect();
        assert!((-1..=1).all(|by| some.contains(&by)) && some.iter().all(|by| by.abs() <= 1));
    }
}
