//! A training in memory: a task, and the records of its chip.

use std::collections::BTreeMap;
use std::mem;

use super::task::{self, GoOn, Task, Told};
use super::{Machine, RunError};
use crate::chip::engine::{Engine, Phase, Recorded};
use crate::chip::ledger::Event;
use crate::lab::config::{Config, Select};
use crate::lab::data::Data;
use crate::lab::store::checkpoint::{self, CheckpointError, Identity};
use crate::lab::store::record::{
    DataRecord, EpochRecord, LayerRecord, Note, RateRecord, Score, TestOutcome,
};
use crate::lab::store::{address, hash};
use crate::learn::driver::Driver;
use crate::task::classify::Examples;
use crate::task::environment::{EnvSource, Record};
use crate::task::policy::WatchedStep;

/// A training in memory.
///
/// ```
/// use dalean::{Backend, Config, Data, DataRoot, Machine, Session, Sources};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let text = "data.set = \"xor\"\nnetwork.hidden = [4]\nlearning.epochs = 2";
/// let config = Config::load(&Sources { experiment: Some(("mine", text)), ..Sources::default() })?;
/// let data = Data::load(&config, &DataRoot::new("data"))?;
/// let mut session = Session::new(&config, data, Machine::new(Backend::best(), 1)?)?;
/// session.start()?;
/// session.advance(&mut |_progress| true)?;
/// let (checkpoint, hash) = (session.checkpoint(), session.state_hash());
/// session.advance(&mut |_progress| true)?;
/// session.restore(&checkpoint)?;
/// assert_eq!((session.epoch(), session.state_hash()), (1, hash));
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Session {
    task: Box<dyn Task>,
    /// Address of the run.
    run: String,
    data: DataRecord,
    /// Rates asked for and in effect.
    rates: Vec<RateRecord>,
    /// What the configuration lets expect.
    warnings: Vec<String>,
    /// What the run showed.
    notes: Vec<Note>,
    /// Right answers of the best epoch told so far.
    best_answers: u64,
}

impl Session {
    /// Builds what a configuration asks for: networks with their initial levels, and calibrated converters.
    ///
    /// # Errors
    /// When the configuration does not fit the data or the chip, or the system gives no threads.
    pub fn new(config: &Config, data: Data, machine: Machine) -> Result<Self, RunError> {
        Self::acting_on(config, data, machine, EnvSource::Native)
    }

    /// The same, of a policy whose environments come from elsewhere.
    pub(crate) fn acting_on(
        config: &Config,
        data: Data,
        machine: Machine,
        source: EnvSource,
    ) -> Result<Self, RunError> {
        let mut record = DataRecord::of(&data);
        let given = config.given(record.features, record.classes, record.image)?;
        let task = task::build(config, data, machine, source)?;
        record.middles = task.middles();
        let rates = rates(config, &record, &task.networks())?;
        let run = address::key(given, &record.hash);
        let notes = task.notes();
        let warnings = config.warnings();
        Ok(Self { task, run, data: record, rates, warnings, notes, best_answers: 0 })
    }

    /// Learns this many updates of the first epoch and stops inside it.
    ///
    /// # Errors
    /// When the epoch has fewer.
    pub fn updates(&mut self, updates: u64) -> Result<(), RunError> {
        match self.task.updates(updates)? {
            done if done < updates => Err(RunError::NoUpdate { update: updates, updates: done }),
            _ => Ok(()),
        }
    }

    /// Reads one sample, as an inference does.
    pub(crate) fn infer(&mut self) -> Result<(), RunError> {
        self.task.infer()
    }

    /// Reads the first samples that are learnt from; the words that their errors make, where they have labels.
    pub(crate) fn words(&mut self, samples: usize) -> Option<Vec<i16>> {
        self.task.words(samples)
    }

    /// What environments showed since the last call, where that is recorded.
    pub(crate) fn take_record(&mut self) -> Option<Record> {
        self.task.take_record()
    }

    /// Shows an episode of a policy step by step until `look` says false; false where there are none.
    pub(crate) fn watch(
        &mut self,
        episode: u32,
        look: &mut dyn FnMut(&WatchedStep) -> bool,
    ) -> Result<bool, RunError> {
        self.task.watch(episode, look)
    }

    /// Starts recording operations; what was executed before the last update is forgotten.
    pub(crate) fn keep_tape(&mut self) {
        for network in self.task.networks_mut() {
            let _ = network.engine_mut().record(true);
        }
    }

    /// What a network executed in its last update.
    pub(crate) fn take_tape(&mut self, network: usize) -> Vec<Recorded> {
        let mut networks = self.task.networks_mut().into_iter().skip(network);
        networks.next().map_or_else(Vec::new, |network| network.engine_mut().record(false))
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

    /// The rate of each layer, as it was asked for and as it is.
    #[must_use]
    pub fn rates(&self) -> &[RateRecord] {
        &self.rates
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

    /// What a record shows for the first time, as receipts have always said it: conversions, tables or gates that saturate
    /// of all layers together and since the start, or an epoch that lost half of what was learnt. Records are told in the
    /// order of their epochs. What users are shown is [`notes`](super::notes).
    pub fn note(&mut self, record: &EpochRecord) -> &[Note] {
        let told = self.notes.len();
        let epoch = record.epoch;
        let training = record.events.get(Phase::Training.name());
        let total = |event: Event| training.and_then(|t| t.get(event.name()).copied()).unwrap_or(0);
        let mut add = |note: Note| {
            let alike = |known: &Note| match (known, &note) {
                (Note::Ends { of: one, .. }, Note::Ends { of: other, .. }) => one == other,
                _ => mem::discriminant(known) == mem::discriminant(&note),
            };
            if !self.notes.iter().any(alike) {
                self.notes.push(note);
            }
        };
        let (saturated, conversions) =
            (total(Event::SaturatedConversions), total(Event::Conversions));
        if saturated.saturating_mul(20) > conversions {
            add(Note::Saturated { epoch, saturated, conversions });
        }
        let ends = [
            ("tables", Event::SaturatedLookUps, Event::LookUps),
            ("gates", Event::SaturatedGates, Event::Multiplies),
        ];
        for (of, saturated, all) in ends {
            let scaled = if all == Event::LookUps { total(Event::Scalings) } else { 0 };
            let (saturated, all) = (total(saturated), total(all).saturating_add(scaled));
            if saturated.saturating_mul(2) > all {
                add(Note::Ends { epoch, of: of.into(), saturated, all });
            }
        }
        if let Some(Score { correct, .. }) = record.outcome.answers() {
            if correct.saturating_mul(2) < self.best_answers {
                add(Note::Forgot { epoch, correct, best: self.best_answers });
            }
            self.best_answers = self.best_answers.max(correct);
        }
        &self.notes[told..]
    }

    /// Networks, whose layers are numbered through.
    #[must_use]
    pub(crate) fn networks(&self) -> Vec<&Driver> {
        self.task.networks()
    }

    /// The chips of the networks, or the parts of one chip that they are on.
    #[must_use]
    pub(crate) fn engines(&self) -> Vec<&Engine> {
        self.task.networks().into_iter().map(Driver::engine).collect()
    }

    /// Epochs finished.
    #[must_use]
    pub fn epoch(&self) -> u32 {
        self.task.epoch()
    }

    /// Samples and updates of an epoch.
    #[must_use]
    pub fn epoch_size(&self) -> (usize, u64) {
        self.task.epoch_size()
    }

    /// Test examples, where mistakes can be shown as pictures.
    #[must_use]
    pub fn examples(&self) -> Option<&Examples> {
        self.task.examples()
    }

    /// The state as a checkpoint.
    #[must_use]
    pub fn checkpoint(&mut self) -> Vec<u8> {
        let Self { task, run, data, .. } = self;
        checkpoint::write(task.state(), Identity { run, data: &data.hash })
    }

    /// Hash of the state.
    #[must_use]
    pub fn state_hash(&mut self) -> String {
        hash::state(self.task.state())
    }

    /// Restores a state.
    ///
    /// # Errors
    /// When the checkpoint is damaged or another run's.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), CheckpointError> {
        let Self { task, run, data, .. } = self;
        checkpoint::read(bytes, task.state(), Identity { run, data: &data.hash })
    }

    /// The record of the state before the first update.
    ///
    /// # Errors
    /// When the environment of a policy cannot go on.
    pub fn start(&mut self) -> Result<EpochRecord, RunError> {
        let told = self.task.start()?;
        Ok(self.record(told).0)
    }

    /// One epoch, its record, and the seconds of learning. `None` when `go_on` said to stop, or when no epoch is left.
    ///
    /// # Errors
    /// When the environment of a policy cannot go on; the state then lies inside an epoch.
    pub fn advance(&mut self, go_on: GoOn<'_>) -> Result<Option<(EpochRecord, f64)>, RunError> {
        let told = self.task.advance(go_on)?;
        Ok(told.map(|told| self.record(told)))
    }

    /// Reads the test set with the present state, or plays the episodes of the final test.
    ///
    /// # Errors
    /// When the environment of a policy cannot go on.
    pub fn test(&mut self) -> Result<Option<TestOutcome>, RunError> {
        self.task.test()
    }

    /// What the chip says of an epoch, beside what the task told.
    fn record(&mut self, told: Told) -> (EpochRecord, f64) {
        let Told { outcome, currents, mute, seconds } = told;
        let state_hash = self.state_hash();
        let pathways = self.task.pathways();
        let networks = self.task.networks();
        let layers = networks.iter().flat_map(|driver| {
            driver.engine().layers().iter().enumerate().map(move |(at, layer)| (driver, at, layer))
        });
        let seen = currents.into_iter().zip(mute);
        let layers = layers.zip(seen).map(|((driver, at, this), (currents, mute))| {
            let layer = usize::from(this.index);
            LayerRecord {
                layer,
                levels: crate::learn::statistics::balance(&pathways, layer),
                currents,
                adc_shifts: this.adc_shifts.clone(),
                rate_shift: driver.shift(at),
                mute: Some(mute),
            }
        });
        let layers = layers.collect();
        let totals = |phase: Phase| -> BTreeMap<String, u64> {
            let of = |event: Event| {
                networks.iter().map(|driver| driver.engine().ledger(phase).total(event)).sum()
            };
            let totals = Event::ALL.into_iter().map(|event| (event.name().to_owned(), of(event)));
            totals.filter(|(_, count)| *count > 0).collect()
        };
        let events = Phase::ALL.map(|phase| (phase.name().to_owned(), totals(phase)));
        let cycles = Phase::ALL.map(|phase| {
            let of = |driver: &&Driver| {
                driver.engine().ledger(phase).cycles().map(|cycles| cycles.elapsed())
            };
            let cycles: Option<u64> = networks.iter().map(of).sum();
            Some((phase.name().to_owned(), cycles?))
        });
        let record = EpochRecord {
            epoch: self.task.epoch(),
            updates: networks.first().map_or(0, |driver| driver.updates()),
            outcome,
            state_hash,
            layers,
            pathways,
            events: events.into_iter().collect(),
            cycles: cycles.into_iter().collect(),
            #[cfg(feature = "grown")]
            grown: 7,
        };
        (record, seconds)
    }
}

/// The rates of networks that have learnt nothing yet, whose layers are numbered through.
fn rates(
    config: &Config,
    data: &DataRecord,
    drivers: &[&Driver],
) -> Result<Vec<RateRecord>, RunError> {
    let networks = config.networks(data.features, data.classes, data.image)?;
    let mut records = Vec::new();
    for (network, driver) in networks.iter().zip(drivers) {
        let effective = network.rates_effective(&config.hardware)?;
        let layers = network.rates.iter().zip(effective).zip(&network.mantissas).enumerate();
        for (at, ((asked, effective), mantissa)) in layers {
            records.push(RateRecord {
                layer: records.len(),
                asked: asked.get(),
                effective: effective.get(),
                shift: driver.shift(at),
                mantissa: mantissa.get(),
            });
        }
    }
    Ok(records)
}

/// The epoch whose state reads the test set, given the records so far.
pub(super) fn chosen(select: Select, records: &[EpochRecord]) -> Option<u32> {
    let mut learnt = records.iter().filter(|record| record.epoch > 0);
    match select {
        Select::Last => learnt.next_back().map(|record| record.epoch),
        Select::BestValidation => learnt
            .max_by_key(|record| (record.outcome.merit(), std::cmp::Reverse(record.epoch)))
            .map(|record| record.epoch),
    }
}
