//! A training in memory: data, trainer, and the records they give.
#![expect(
    clippy::disallowed_types,
    reason = "wall-clock seconds are shown to people, never compared"
)]

use std::collections::BTreeMap;
use std::time::Instant;

use super::RunError;
use crate::chip::crossbar::kernel::Backend;
use crate::chip::engine::{Calibration, Currents, Phase, Recorded};
use crate::chip::hardware::{Adc, AdcRange};
use crate::chip::ledger::{Event, Ledger};
use crate::lab::config::{Config, Select, TrainOn};
use crate::lab::data::Loaded;
use crate::lab::store::checkpoint::{self, CheckpointError, Identity};
use crate::lab::store::record::{
    DataRecord, EpochRecord, LayerRecord, Note, PathwayRecord, Score, TestRecord,
};
use crate::lab::store::{address, given, hash};
use crate::task::classify::{Evaluation, Examples, Progress, Trainer};

/// Wrong answers kept for the report.
const MISTAKES: usize = 24;
/// Confusions of which wrong answers are kept, and how many of each.
const CONFUSIONS: [usize; 2] = [6, 4];

/// What a run is carried out with; none of it changes a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Machine {
    /// Which loops run.
    pub backend: Backend,
    /// Threads.
    pub threads: usize,
}

/// A training in memory.
#[derive(Debug)]
pub struct Session {
    trainer: Trainer,
    train: Examples,
    validation: Examples,
    test: Examples,
    select: Select,
    /// Address of the run.
    run: String,
    data: DataRecord,
    /// What the configuration lets expect.
    warnings: Vec<String>,
    /// What the run showed.
    notes: Vec<Note>,
}

impl Session {
    /// Builds the network, loads its initial levels and calibrates its converters.
    ///
    /// # Errors
    /// When the configuration does not fit the data or the chip.
    ///
    /// # Panics
    /// When threads cannot be started.
    pub fn new(config: &Config, data: Loaded, machine: Machine) -> Result<Self, RunError> {
        let record = DataRecord::of(&data);
        let split = data.split;
        if split.train.is_empty() {
            let hint = "give it at least one example";
            return Err(RunError::Empty { part: "training", hint });
        }
        let experiment = config.experiment(record.features, record.classes, record.image)?;
        let given = given::given(&experiment, config.train_on, config.select);
        let run = address::key(given, &record.hash);
        let train = match config.train_on {
            TrainOn::Train => split.train,
            TrainOn::All => split.train.joined(&split.validation),
        };
        let validation = match config.train_on {
            TrainOn::Train => split.validation,
            TrainOn::All => split.validation.split_at(0).0,
        };
        if config.select == Select::BestValidation && validation.is_empty() {
            let hint = "choose the last epoch with learning.select = \"last\"";
            return Err(RunError::Empty { part: "validation", hint });
        }
        let seeded = experiment.build(machine.backend, train.len())?;
        let mut trainer = Trainer::new(experiment, seeded);
        trainer.driver_mut().engine_mut().set_threads(machine.threads);
        let mut session = Self {
            trainer,
            train,
            validation,
            test: split.test,
            select: config.select,
            run,
            data: record,
            warnings: config.warnings(),
            notes: vec![],
        };
        if let Some(calibration) = session.calibrate() {
            session.note_low_codes(&calibration);
        }
        Ok(session)
    }

    /// Learns this many updates of the first epoch and stops inside it.
    ///
    /// # Errors
    /// When the epoch has fewer.
    pub fn updates(&mut self, updates: u64) -> Result<(), RunError> {
        if updates == 0 {
            return Ok(());
        }
        let Self { trainer, train, .. } = self;
        let mut done = 0;
        let _ = trainer.learn(train, &mut |_| {
            done += 1;
            done < updates
        });
        if done < updates {
            Err(RunError::NoUpdate { update: updates, updates: done })
        } else {
            Ok(())
        }
    }

    /// Reads the first training example, as an inference does.
    pub fn read_one(&mut self) {
        let Self { trainer, train, .. } = self;
        let (first, _) = train.clone().split_at(1);
        let _ = trainer.evaluate(&first);
    }

    /// Starts recording operations; what was read before the last samples were loaded is forgotten.
    pub fn keep_tape(&mut self) {
        let _ = self.trainer.driver_mut().engine_mut().record(true);
    }

    /// What was executed since the last samples were loaded.
    pub fn take_tape(&mut self) -> Vec<Recorded> {
        self.trainer.driver_mut().engine_mut().record(false)
    }

    fn calibrate(&mut self) -> Option<Calibration> {
        let Self { trainer, train, .. } = self;
        trainer.calibrate(train)
    }

    fn note_low_codes(&mut self, calibration: &Calibration) {
        for (layer, &code_max) in calibration.code_max.iter().enumerate() {
            if code_max <= 3 {
                self.notes.push(Note::LowCodes { layer, code_max });
            }
        }
    }

    /// Address of the run.
    #[must_use]
    pub fn run(&self) -> &str {
        &self.run
    }

    /// What is learnt from.
    #[must_use]
    pub const fn data(&self) -> &DataRecord {
        &self.data
    }

    /// What the configuration lets expect, and what the run showed so far.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        self.warnings.iter().cloned().chain(self.notes.iter().map(ToString::to_string)).collect()
    }

    /// What the run showed so far.
    #[must_use]
    pub fn notes(&self) -> &[Note] {
        &self.notes
    }

    /// Notes, once, when many conversions of the epochs up to that of a record saturated.
    pub fn note(&mut self, record: &EpochRecord) -> Option<&Note> {
        let training = record.events.get(Phase::Training.name())?;
        let total = |event: Event| training.get(event.name()).copied().unwrap_or(0);
        let (saturated, conversions) =
            (total(Event::SaturatedConversions), total(Event::Conversions));
        let known = self.notes.iter().any(|note| matches!(note, Note::Saturated { .. }));
        if known || saturated.saturating_mul(20) <= conversions {
            return None;
        }
        self.notes.push(Note::Saturated { epoch: record.epoch, saturated, conversions });
        self.notes.last()
    }

    /// The training.
    #[must_use]
    pub const fn trainer(&self) -> &Trainer {
        &self.trainer
    }

    /// The test examples.
    #[must_use]
    pub const fn test_examples(&self) -> &Examples {
        &self.test
    }

    /// Examples an epoch learns from.
    #[must_use]
    pub fn train_len(&self) -> usize {
        self.train.len()
    }

    /// The state as a checkpoint.
    #[must_use]
    pub fn checkpoint(&mut self) -> Vec<u8> {
        let Self { trainer, run, data, .. } = self;
        checkpoint::write(trainer, Identity { run, data: &data.hash })
    }

    /// Hash of the state.
    #[must_use]
    pub fn state_hash(&mut self) -> String {
        hash::state(&mut self.trainer)
    }

    /// Restores a state.
    ///
    /// # Errors
    /// When the checkpoint is damaged or another run's.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), CheckpointError> {
        let Self { trainer, run, data, .. } = self;
        checkpoint::read(bytes, trainer, Identity { run, data: &data.hash })
    }

    /// The record of the state before the first update.
    pub fn start(&mut self) -> EpochRecord {
        let (validation, currents) = self.validate();
        self.record(None, validation, &currents)
    }

    /// One epoch, its record, and the seconds of learning. `None` when `go_on` said to stop.
    pub fn epoch(
        &mut self,
        go_on: &mut (dyn FnMut(Progress) -> bool + Send),
    ) -> Option<(EpochRecord, f64)> {
        let started = Instant::now();
        let again = matches!(
            self.trainer.experiment().hardware.adc,
            Adc::Finite { range: AdcRange::Calibrated { every_epoch: true, .. }, .. }
        );
        if again && self.trainer.epoch() > 0 {
            let _ = self.calibrate();
        }
        let Self { trainer, train, .. } = self;
        let correct = trainer.learn(train, go_on).ok()?;
        let seconds = started.elapsed().as_secs_f64();
        let total = self.train.len() as u64;
        let (validation, currents) = self.validate();
        Some((self.record(Some(Score { correct, total }), validation, &currents), seconds))
    }

    fn validate(&mut self) -> (Option<Score>, Vec<Currents>) {
        let Self { trainer, validation, .. } = self;
        if validation.is_empty() {
            return (None, vec![[[0; 2]; 2]; trainer.driver().engine().layers().len()]);
        }
        let Evaluation { correct, currents, .. } = trainer.evaluate(validation);
        (Some(Score { correct, total: validation.len() as u64 }), currents)
    }

    /// Reads the test set with the present state.
    pub fn test(&mut self) -> TestRecord {
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
        record
    }

    fn record(
        &mut self,
        train: Option<Score>,
        validation: Option<Score>,
        currents: &[Currents],
    ) -> EpochRecord {
        let state_hash = self.state_hash();
        let driver = self.trainer.driver();
        let engine = driver.engine();
        let statistics = self.trainer.statistics();
        let ledger = engine.ledger(Phase::Training);
        let layers = engine.layers().iter().enumerate().map(|(layer, this)| LayerRecord {
            layer,
            levels: crate::learn::statistics::balance(&statistics, layer),
            currents: currents[layer],
            adc_shifts: this.adc_shifts.clone(),
            rate_shift: driver.shift(layer),
        });
        let layers = layers.collect();
        let pathways = statistics.into_iter().map(|s| {
            let layout = engine.layers()[s.layer].layout;
            let events = Event::ALL.into_iter().filter_map(|event| {
                let count = ledger.of_pathway(s.layer, s.code, event);
                (count > 0).then(|| (event.name().to_owned(), count))
            });
            PathwayRecord {
                layer: s.layer,
                pathway: s.name.into(),
                excites: s.excites,
                shape: [layout.rows, layout.columns],
                cells: s.cells,
                floor: s.floor,
                zero: s.zero,
                pruned: s.pruned,
                births: s.births,
                deaths: s.deaths,
                levels: s.levels,
                idle: s.idle,
                histogram: s.histogram,
                training: events.collect(),
            }
        });
        let pathways = pathways.collect();
        let totals = |ledger: &Ledger| -> BTreeMap<String, u64> {
            let of = |event: Event| (event.name().to_owned(), ledger.total(event));
            Event::ALL.into_iter().map(of).filter(|(_, count)| *count > 0).collect()
        };
        let events =
            Phase::ALL.map(|phase| (phase.name().to_owned(), totals(engine.ledger(phase))));
        let cycles = Phase::ALL.map(|phase| {
            let cycles = engine.ledger(phase).cycles()?;
            Some((phase.name().to_owned(), cycles.elapsed()))
        });
        EpochRecord {
            epoch: self.trainer.epoch(),
            updates: driver.updates(),
            train,
            validation,
            state_hash,
            layers,
            pathways,
            events: events.into_iter().collect(),
            cycles: cycles.into_iter().collect(),
            #[cfg(feature = "grown")]
            grown: 7,
        }
    }
}

/// The epoch whose state reads the test set, given the records so far.
pub(super) fn chosen(select: Select, records: &[EpochRecord]) -> Option<u32> {
    let mut learnt = records.iter().filter(|record| record.epoch > 0);
    match select {
        Select::Last => learnt.next_back().map(|record| record.epoch),
        Select::BestValidation => {
            let score = |r: &EpochRecord| r.validation.map_or(0, |score| score.correct);
            learnt.max_by_key(|r| (score(r), std::cmp::Reverse(r.epoch))).map(|r| r.epoch)
        }
    }
}
