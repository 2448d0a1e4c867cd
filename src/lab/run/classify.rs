//! Classification as a task: epochs over examples, scores, and the final reading of the test set.
#![expect(
    clippy::disallowed_types,
    reason = "wall-clock seconds are shown to people, never compared"
)]

use std::time::Instant;

use super::task::{GoOn, Progress, Task, Told};
use super::{Machine, RunError};
use crate::chip::engine::Currents;
use crate::chip::hardware::{Adc, AdcRange};
use crate::chip::state::State;
use crate::lab::config::{Config, Select, TrainOn};
use crate::lab::store::record::{
    ClassifyOutcome, DataRecord, Note, Outcome, Score, TestOutcome, TestRecord,
};
use crate::learn::driver::Driver;
use crate::learn::statistics::PathwayRecord;
use crate::task::classify::{self, Evaluation, Examples, Split, Trainer};

/// Wrong answers kept for the report.
const MISTAKES: usize = 24;
/// Confusions of which wrong answers are kept, and how many of each.
const CONFUSIONS: [usize; 2] = [6, 4];

/// A training on labelled examples.
#[derive(Debug)]
pub(super) struct Classify {
    trainer: Trainer,
    train: Examples,
    validation: Examples,
    test: Examples,
    select: Select,
    notes: Vec<Note>,
}

impl Classify {
    /// Builds the network, loads its initial levels and calibrates its converters.
    pub(super) fn new(
        config: &Config,
        split: Split,
        data: &DataRecord,
        machine: Machine,
    ) -> Result<Self, RunError> {
        if split.train.is_empty() {
            let hint = "give it at least one example";
            return Err(RunError::Empty { part: "training", hint });
        }
        let experiment = config.experiment(data.features, data.classes, data.image)?;
        let (train, validation) = match config.train_on {
            TrainOn::Train => (split.train, split.validation),
            TrainOn::All => (split.train.joined(&split.validation), split.validation.split_at(0).0),
        };
        if config.select == Select::BestValidation && validation.is_empty() {
            let hint = "choose the last epoch with learning.select = \"last\"";
            return Err(RunError::Empty { part: "validation", hint });
        }
        let network = &experiment.network;
        let left = super::Memory::left();
        super::weigh(&network.layers, &experiment.hardware, network.batch, left)?;
        let seeded = experiment.build(machine.backend(), &train)?;
        let mut trainer = Trainer::new(experiment, seeded);
        let (threads, engine) = (machine.threads(), trainer.driver_mut().engine_mut());
        engine.set_threads(threads).map_err(|error| RunError::NoThreads { threads, error })?;
        let codes = trainer.calibrate(&train).map(|calibration| calibration.code_max);
        let low = codes.into_iter().flatten().enumerate().filter(|&(_, code_max)| code_max <= 3);
        let notes = low.map(|(layer, code_max)| Note::LowCodes { layer, code_max }).collect();
        Ok(Self { trainer, train, validation, test: split.test, select: config.select, notes })
    }

    fn told(&mut self, train: Option<Score>, seconds: f64) -> Told {
        let (validation, currents, mute) = self.validate();
        let outcome = Outcome::Classify(ClassifyOutcome { train, validation });
        Told { outcome, currents, mute, seconds }
    }

    fn validate(&mut self) -> (Option<Score>, Vec<Currents>, Vec<bool>) {
        let Self { trainer, validation, .. } = self;
        if validation.is_empty() {
            let layers = trainer.driver().engine().layers().len();
            return (None, vec![[[0; 2]; 2]; layers], vec![false; layers]);
        }
        let Evaluation { correct, currents, mute, .. } = trainer.evaluate(validation);
        (Some(Score { correct, total: validation.len() as u64 }), currents, mute)
    }
}

impl Task for Classify {
    fn start(&mut self) -> Result<Told, RunError> {
        Ok(self.told(None, 0.0))
    }

    fn advance(&mut self, go_on: GoOn<'_>) -> Result<Option<Told>, RunError> {
        if self.trainer.epoch() >= self.trainer.experiment().epochs {
            return Ok(None);
        }
        let started = Instant::now();
        let again = matches!(
            self.trainer.experiment().hardware.adc,
            Adc::Finite { range: AdcRange::Calibrated { every_epoch: true, .. }, .. }
        );
        let Self { trainer, train, .. } = self;
        let epochs = trainer.experiment().epochs;
        if again && trainer.epoch() > 0 {
            let _ = trainer.calibrate(train);
        }
        let learnt = trainer.learn(train, &mut |classify::EpochProgress {
                                                    epoch,
                                                    samples,
                                                    samples_total,
                                                    correct,
                                                }| {
            let answers = Some(Score { correct, total: samples as u64 });
            let (done, total) = (samples, samples_total);
            go_on(Progress { epoch, epochs, done, total, answers, returns: None })
        });
        let Ok(correct) = learnt else { return Ok(None) };
        let total = train.len() as u64;
        let seconds = started.elapsed().as_secs_f64();
        Ok(Some(self.told(Some(Score { correct, total }), seconds)))
    }

    fn state(&mut self) -> &mut dyn State {
        &mut self.trainer
    }

    fn test(&mut self) -> Result<Option<TestOutcome>, RunError> {
        if self.test.is_empty() {
            return Ok(None);
        }
        let Self { trainer, test, .. } = self;
        let found = trainer.evaluate(test);
        let classes = test.classes();
        let mut confusion = vec![vec![0; classes]; classes];
        let mut wrong = Vec::new();
        for (example, (&guess, &truth)) in found.predictions.iter().zip(test.labels()).enumerate() {
            confusion[usize::from(truth)][usize::from(guess)] += 1;
            if guess != truth {
                wrong.push((found.margins[example], example as u64, truth, guess));
            }
        }
        wrong.sort_by_key(|&(margin, example, ..)| (std::cmp::Reverse(margin), example));
        let wrong = wrong.into_iter().map(|(_, e, t, g)| [e, u64::from(t), u64::from(g)]);
        let wrong: Vec<[u64; 3]> = wrong.collect();
        let mut record = TestRecord {
            epoch: self.trainer.epoch(),
            select: match self.select {
                Select::BestValidation => "best_validation".into(),
                Select::Last => "last".into(),
            },
            score: Score { correct: found.correct, total: self.test.len() as u64 },
            confusion,
            mistakes: wrong.iter().copied().take(MISTAKES).collect(),
            confused: vec![],
        };
        let [pairs, each] = CONFUSIONS;
        for (_, truth, guess) in record.confusions().into_iter().take(pairs) {
            let of_pair = |one: &&[u64; 3]| one[1..] == [truth as u64, guess as u64];
            record.confused.extend(wrong.iter().filter(of_pair).take(each));
        }
        Ok(Some(TestOutcome::Classify(record)))
    }

    fn epoch(&self) -> u32 {
        self.trainer.epoch()
    }

    fn networks(&self) -> Vec<&Driver> {
        vec![self.trainer.driver()]
    }

    fn networks_mut(&mut self) -> Vec<&mut Driver> {
        vec![self.trainer.driver_mut()]
    }

    fn pathways(&self) -> Vec<PathwayRecord> {
        self.trainer.pathways()
    }

    fn notes(&self) -> Vec<Note> {
        self.notes.clone()
    }

    fn epoch_size(&self) -> (usize, u64) {
        let samples = self.train.len();
        (samples, self.trainer.experiment().updates_per_epoch(samples))
    }

    fn updates(&mut self, updates: u64) -> Result<u64, RunError> {
        let Self { trainer, train, .. } = self;
        let mut done = 0;
        if updates > 0 {
            let _ = trainer.learn(train, &mut |_| {
                done += 1;
                done < updates
            });
        }
        Ok(done)
    }

    fn infer(&mut self) -> Result<(), RunError> {
        let (first, _) = self.train.clone().split_at(1);
        let _ = self.trainer.evaluate(&first);
        Ok(())
    }

    fn middles(&self) -> Vec<u8> {
        self.trainer.middles().to_vec()
    }

    fn words(&mut self, samples: usize) -> Option<Vec<i16>> {
        Some(self.trainer.words(&self.train, samples))
    }

    fn examples(&self) -> Option<&Examples> {
        Some(&self.test)
    }
}
