//! Training in a folder, and continuing.
#![expect(
    clippy::disallowed_types,
    reason = "how often files are written may depend on the clock; what a run gives does not"
)]

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::again::{read_config, restore};
use super::notes::{Watcher, with_calibration};
use super::session::chosen;
use super::{Machine, Progress, RunError, Session, proof};
use crate::lab::config::{Absent, Config, Select};
use crate::lab::data::{self, Data, DataRoot, ImageShape, Told};
use crate::lab::price::Cost;
use crate::lab::report::Film;
use crate::lab::store::folder::{self, FolderError, MetricsLog, RunFolder, names};
use crate::lab::store::ledger::LedgerRecord;
use crate::lab::store::record::{
    BestRecord, EpochRecord, Note, RateRecord, Receipt, TestOutcome, TimingRecord,
};
use crate::lab::store::{hash, stream};
use crate::task::environment::EnvSource;
use crate::task::policy::WatchedStep;

/// What happens while a run is carried out.
///
/// See [`train`](crate::train()).
#[derive(Debug)]
#[non_exhaustive]
pub enum RunEvent<'a> {
    /// The run is about to start.
    Started {
        /// Its folder.
        folder: &'a Path,
        /// The data, in one line.
        data: &'a str,
        /// How files of one's own were read, as far as nobody had said it.
        said: &'a [String],
        /// What the user should know.
        warnings: &'a [String],
        /// The rate of each layer, as it was asked for and as it is.
        rates: &'a [RateRecord],
        /// Epochs finished before (0 unless continued).
        epoch: u32,
        /// Epochs in all.
        epochs: u32,
    },
    /// A batch was learnt from. Returning false stops the run.
    Batch(Progress),
    /// An epoch is finished and on disk; learning took so many seconds.
    Epoch(&'a EpochRecord, f64),
    /// Something to know came up.
    Warning(&'a str),
}

/// Which files a run leaves, and how much work it may lose when it is killed.
///
/// See [`train`](crate::train()).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Keeping {
    /// Whether the states stay when the run is finished. Without them nobody can `eval` it, and its page has no levels.
    pub states: bool,
    /// Epochs that end within this time of the last checkpoint are not written down one by one.
    pub every: Duration,
    /// Whether what the environments of a policy showed is kept, so that it can be done again without them.
    pub streams: bool,
}

impl Keeping {
    /// Everything, after every epoch.
    pub const ALL: Self = Self { states: true, every: Duration::ZERO, streams: false };

    /// The same, with what environments showed.
    pub const STREAMS: Self = Self { streams: true, ..Self::ALL };

    /// Where the environments of a policy come from.
    fn source(self) -> EnvSource {
        if self.streams { EnvSource::Recorded(Arc::default()) } else { EnvSource::Native }
    }
}

/// A finished run.
///
/// See [`train`](crate::train()).
#[derive(Debug)]
#[non_exhaustive]
pub struct Trained {
    /// Its receipt.
    pub receipt: Receipt,
    /// Its records.
    pub records: Vec<EpochRecord>,
    /// What it took here.
    pub timing: TimingRecord,
    /// What to know beside the result, as [`notes`](super::notes()) says it.
    pub notes: Vec<Note>,
    /// The summary table.
    pub summary: String,
    /// What it cost on its chip, the final test aside.
    pub cost: Cost,
    /// What real chips do and the run did not.
    pub absent: Vec<Absent>,
}

/// Trains a configuration in a new folder below `root`.
///
/// ```
/// use dalean::{Backend, Config, DataRoot, Machine, RunError, RunEvent, Sources, Verdict};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let text = "data.set = \"xor\"\nnetwork.hidden = [4]\nlearning.epochs = 1";
/// let config = Config::load(&Sources { experiment: Some(("mine", text)), ..Sources::default() })?;
/// let folder = format!("dalean-example-{}", std::process::id());
/// let (data, runs) = (DataRoot::new("data"), std::env::temp_dir().join(folder));
/// let machine = Machine::new(Backend::best(), 1)?;
///
/// let (mut folder, mut epochs) = (None, 0);
/// let trained = dalean::train(&config, &data, &runs, machine, &mut |event| {
///     match event {
///         RunEvent::Started { folder: path, .. } => folder = Some(path.to_owned()),
///         RunEvent::Epoch(record, _seconds) => epochs = record.epoch,
///         _ => {}
///     }
///     true
/// })?;
/// let folder = folder.ok_or("every run has started")?;
/// assert_eq!((epochs, trained.records.len(), &*trained.receipt.status), (1, 2, "finished"));
///
/// // read the test set again, do the whole run again, and see that there is nothing to continue
/// let (test, _state_hash) = dalean::evaluate(&folder, &data, machine)?;
/// assert_eq!(trained.receipt.test, Some(test));
/// let verdict = dalean::verify(&folder, &data, machine, None, &mut |_progress| true)?;
/// assert!(matches!(verdict, Verdict::Same { epochs: 2, .. }));
/// let again = dalean::resume(&folder, &data, machine, &mut |_event| true);
/// assert!(matches!(again, Err(RunError::Finished { .. })));
/// # std::fs::remove_dir_all(&runs)?;
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// When something does not fit, the disk refuses, or the caller stops it.
pub fn train(
    config: &Config,
    data_root: &DataRoot,
    root: &Path,
    machine: Machine,
    on_event: &mut (dyn FnMut(RunEvent<'_>) -> bool + Send),
) -> Result<Trained, RunError> {
    train_keeping(config, data_root, root, machine, Keeping::ALL, on_event)
}

/// The same; `keeping` says which files it leaves.
///
/// # Errors
/// As [`train`].
pub fn train_keeping(
    config: &Config,
    data_root: &DataRoot,
    root: &Path,
    machine: Machine,
    keeping: Keeping,
    on_event: &mut (dyn FnMut(RunEvent<'_>) -> bool + Send),
) -> Result<Trained, RunError> {
    let loaded = data::load(&config.source()?, data_root)?;
    let about = About::of(&loaded);
    let session = Session::acting_on(config, loaded, machine, keeping.source())?;
    let folder = RunFolder::create(root, &config.run_name())?;
    let text = config.settled(&about.told, folder.path());
    folder.write(names::CONFIG, text.as_bytes())?;
    let mut run = Run::new(config, text, folder, machine, about, session);
    run.keeping = keeping;
    run.carry_out(on_event)
}

/// Continues a run from its last finished epoch.
///
/// See [`train`](crate::train()) for an example.
///
/// # Errors
/// When the run is finished or damaged, its data is not the same, or as [`train`].
pub fn resume(
    path: &Path,
    data_root: &DataRoot,
    machine: Machine,
    on_event: &mut (dyn FnMut(RunEvent<'_>) -> bool + Send),
) -> Result<Trained, RunError> {
    let folder = RunFolder::open(path)?;
    let (config, text) = read_config(path)?;
    let loaded = data::load(&config.source()?, data_root)?;
    let about = About::of(&loaded);
    // a run that began to keep what it was shown goes on with it
    let streams = path.join(stream::stream_name(0)).exists();
    let keeping = if streams { Keeping::STREAMS } else { Keeping::ALL };
    let session = Session::acting_on(&config, loaded, machine, keeping.source())?;
    let mut run = Run::new(&config, text, folder, machine, about, session);
    run.keeping = keeping;
    run.restore()?;
    if !run.records.is_empty() {
        // of what was shown while this was built, the folder has a record already
        let _ = run.session.take_record();
    }
    run.carry_out(on_event)
}

/// Carries a run out in a folder that the caller holds: new, or from where it was left. A damaged state is thrown away.
///
/// # Errors
/// When something does not fit, the disk refuses, or the caller stops it.
pub fn carry_on(
    config: &Config,
    loaded: &Data,
    folder: RunFolder,
    machine: Machine,
    keeping: Keeping,
    on_event: &mut (dyn FnMut(RunEvent<'_>) -> bool + Send),
) -> Result<Trained, RunError> {
    let about = About::of(loaded);
    let session = || Session::acting_on(config, loaded.clone(), machine, keeping.source());
    let text = config.settled(&about.told, folder.path());
    let begun = folder::read_text(folder.path(), names::CONFIG).is_ok_and(|found| found == text);
    let mut run = Run::new(config, text, folder, machine, about, session()?);
    run.keeping = keeping;
    if begun {
        // what cannot be gone on from, or was finished and cannot be read, is done again
        if run.restore().is_err() {
            run.start_over(session()?);
        }
    } else {
        run.folder.write(names::CONFIG, run.text.as_bytes())?;
    }
    run.carry_out(on_event)
}

/// What is told of data beside their examples.
struct About {
    description: String,
    image: Option<ImageShape>,
    said: Vec<String>,
    told: Told,
}

impl About {
    fn of(data: &Data) -> Self {
        let Data { description, image, said, told, .. } = data;
        let (description, said, told) = (description.clone(), said.clone(), told.clone());
        Self { description, image: *image, said, told }
    }
}

struct Run<'a> {
    config: &'a Config,
    /// `config.toml`, as it lies in the folder.
    text: String,
    folder: RunFolder,
    about: About,
    session: Session,
    records: Vec<EpochRecord>,
    /// The records on disk, once this process has written any.
    log: Option<MetricsLog>,
    timing: TimingRecord,
    keeping: Keeping,
    /// When files were written last.
    written: Instant,
    /// Whether epochs have ended since.
    pending: bool,
    /// The best state so far, if the configuration chooses one.
    best: Option<BestRecord>,
    /// It, while it is not on disk.
    best_state: Option<Vec<u8>>,
    /// What the records show.
    seen: Watcher,
}

impl<'a> Run<'a> {
    fn new(
        config: &'a Config,
        text: String,
        folder: RunFolder,
        machine: Machine,
        about: About,
        session: Session,
    ) -> Self {
        Self {
            config,
            text,
            folder,
            about,
            session,
            records: vec![],
            log: None,
            timing: TimingRecord {
                version: env!("CARGO_PKG_VERSION").into(),
                kernel: machine.backend().name().into(),
                threads: machine.threads(),
                epoch_seconds: vec![],
                steps_per_second: vec![],
            },
            keeping: Keeping::ALL,
            written: Instant::now(),
            pending: false,
            best: None,
            best_state: None,
            seen: Watcher::default(),
        }
    }

    /// Forgets everything and starts with another session.
    fn start_over(&mut self, session: Session) {
        self.session = session;
        self.records.clear();
        self.log = None;
        self.timing.epoch_seconds.clear();
        (self.best, self.best_state) = (None, None);
        self.seen = Watcher::default();
    }

    /// Brings the session to the last finished epoch on disk; to none when there is no checkpoint.
    fn restore(&mut self) -> Result<(), RunError> {
        let path = self.folder.path().to_path_buf();
        if !path.join(names::CHECKPOINT).exists() && !path.join(names::RECEIPT).exists() {
            // the ledger is written when the last epoch is done: such a run is never begun anew behind its owner's back
            if path.join(names::LEDGER).exists() {
                let found = format!(
                    "is missing, though {} says that the run came to its end",
                    names::LEDGER
                );
                return Err(FolderError::Content { path: path.join(names::RECEIPT), found }.into());
            }
            return Ok(());
        }
        let receipt = folder::read_receipt(&path)?;
        if receipt.status == "finished" {
            return Err(RunError::Finished { path: path.display().to_string() });
        }
        proof::inputs(&receipt, &self.session, &self.text)?;
        let mut records = proof::records(&path, &receipt)?;
        if !path.join(names::CHECKPOINT).exists() {
            // killed before the first one was in its place; later there is always one
            if receipt.epoch_hashes.len() > 1 && self.keeping.every == Duration::ZERO {
                let found = format!("is missing, though {} speaks of it", names::RECEIPT);
                return Err(
                    FolderError::Content { path: path.join(names::CHECKPOINT), found }.into()
                );
            }
            return Ok(());
        }
        let bytes = restore(&mut self.session, &path, names::CHECKPOINT)?;
        let (epoch, state) = (self.session.epoch(), self.session.state_hash());
        proof::checkpoint(&path, names::CHECKPOINT, &receipt, epoch, (&bytes, &state))?;
        // a kill may have come between the receipt and the checkpoint it speaks of
        let last = records.len() == epoch as usize + 1;
        records.truncate(epoch as usize + 1);
        for record in &records {
            let _ = self.session.note(record);
            let _ = self.seen.look(record);
        }
        self.best = self.best_on_disk(&path, &records)?;
        self.records = records;
        if last {
            let hashes = [receipt.metrics.clone(), hash::bytes(&bytes)];
            let expected = self.receipt("running", None, hashes, None);
            let expected = Receipt { states: receipt.states, ..expected };
            proof::same_receipt(&path, &receipt, &expected)?;
        }
        let seconds = folder::read_timing(&path).epoch_seconds;
        self.timing.epoch_seconds =
            seconds.into_iter().chain(std::iter::repeat(0.0)).take(self.records.len()).collect();
        self.timing.note_steps(&self.records);
        Ok(())
    }

    /// The best state that the records name, from its file.
    fn best_on_disk(
        &mut self,
        path: &Path,
        records: &[EpochRecord],
    ) -> Result<Option<BestRecord>, RunError> {
        let best = chosen(self.config.select, records);
        let (Select::BestValidation, Some(epoch)) = (self.config.select, best) else {
            return Ok(None);
        };
        let bytes = folder::read_checkpoint(path, &RunFolder::best_name(epoch))?;
        Ok(Some(BestRecord { epoch, checkpoint: hash::bytes(bytes) }))
    }

    fn carry_out(
        mut self,
        on_event: &mut (dyn FnMut(RunEvent<'_>) -> bool + Send),
    ) -> Result<Trained, RunError> {
        let path = self.folder.path().to_path_buf();
        let epochs = self.config.epochs;
        on_event(RunEvent::Started {
            folder: &path,
            data: &self.about.description,
            said: &self.about.said,
            warnings: &self.session.warnings(),
            rates: self.session.rates(),
            epoch: self.session.epoch(),
            epochs,
        });
        if self.records.is_empty() {
            let record = self.session.start()?;
            let _ = self.seen.look(&record);
            self.keep(record, 0.0)?;
        }
        while self.session.epoch() < epochs {
            let epoch = self.session.epoch();
            let learnt =
                self.session.advance(&mut |progress| on_event(RunEvent::Batch(progress)))?;
            let Some((record, seconds)) = learnt else {
                return Err(RunError::Stopped { epoch, path: path.display().to_string() });
            };
            let _ = self.session.note(&record);
            let notes = self.seen.look(&record);
            self.keep(record, seconds)?;
            on_event(RunEvent::Epoch(self.records.last().expect("just kept"), seconds));
            for note in notes {
                on_event(RunEvent::Warning(&note.to_string()));
            }
        }
        self.finish()
    }

    /// Keeps what environments showed, where that is asked for.
    fn keep_stream(&mut self, name: &str) -> Result<(), RunError> {
        if let Some(record) = self.session.take_record() {
            self.folder.write(name, &stream::write(&record))?;
        }
        Ok(())
    }

    /// Puts a finished epoch on disk, if it is time to.
    fn keep(&mut self, record: EpochRecord, seconds: f64) -> Result<(), RunError> {
        self.keep_stream(&stream::stream_name(record.epoch))?;
        self.records.push(record);
        self.timing.epoch_seconds.push(seconds);
        self.timing.note_steps(&self.records);
        let epoch = self.session.epoch();
        let best = chosen(self.config.select, &self.records);
        let is_best = self.config.select == Select::BestValidation && best == Some(epoch);
        let due = self.written.elapsed() >= self.keeping.every;
        self.pending = true;
        if !is_best && !due {
            return Ok(());
        }
        let state = self.session.checkpoint();
        if is_best {
            self.best = Some(BestRecord { epoch, checkpoint: hash::bytes(&state) });
            self.best_state = Some(state.clone());
        }
        if !due {
            return Ok(());
        }
        self.flush(&state)
    }

    /// Writes down all epochs so far; `state` is the present one. Best state and records come first, then the receipt
    /// that speaks of them, and last the checkpoint that makes them count.
    fn flush(&mut self, state: &[u8]) -> Result<(), RunError> {
        if let (Some(state), Some(best)) = (self.best_state.take(), &self.best) {
            self.folder.write(&RunFolder::best_name(best.epoch), &state)?;
        }
        let metrics = self.write_records()?;
        self.folder.write_timing(&self.timing)?;
        let hashes = [metrics, hash::bytes(state)];
        self.folder.write_receipt(&self.receipt("running", None, hashes, None))?;
        self.folder.write(names::CHECKPOINT, state)?;
        self.folder.tidy(self.best.as_ref().map(|best| best.epoch));
        (self.written, self.pending) = (Instant::now(), false);
        Ok(())
    }

    /// Puts the records behind those on disk, and gives the hash of their text.
    fn write_records(&mut self) -> Result<String, RunError> {
        let log = match &mut self.log {
            Some(log) => {
                log.grow(&self.records)?;
                log
            }
            none => none.insert(self.folder.begin_metrics(&self.records)?),
        };
        Ok(log.hash())
    }

    /// What the run can prove so far; `hashes` are those of the records' text and of the state after the last one.
    fn receipt(
        &self,
        status: &str,
        ledger: Option<&str>,
        hashes: [String; 2],
        test: Option<TestOutcome>,
    ) -> Receipt {
        let Self { session, records, best, text, .. } = self;
        let receipt = proof::receipt(session, text, records, hashes, best.clone());
        Receipt {
            status: status.into(),
            ledger: ledger.map(hash::bytes),
            states: self.keeping.states,
            test,
            ..receipt
        }
    }

    /// The first episode of the evaluation of a policy, with the present state.
    fn film(&mut self) -> Result<Option<Film>, RunError> {
        let mut steps = Vec::new();
        let mut look = |step: &WatchedStep| {
            steps.push(step.clone());
            true
        };
        let watched = self.session.watch(0, &mut look)?;
        Ok(watched.then(|| Film::new(0, &steps)))
    }

    fn finish(mut self) -> Result<Trained, RunError> {
        let state = self.session.checkpoint();
        if self.keeping.states && self.pending {
            self.flush(&state)?;
        }
        let checkpoint = hash::bytes(&state);
        let ledger = LedgerRecord::of(&self.session.engines());
        let ledger_text = ledger.to_json();
        let metrics = self.write_records()?;
        self.folder.write_timing(&self.timing)?;
        self.folder.write(names::LEDGER, ledger_text.as_bytes())?;
        let cost = super::report::cost(self.config, &ledger, &self.records);
        let epoch = self.session.epoch();
        let path = self.folder.path().to_path_buf();
        match self.best.clone() {
            Some(best) if best.epoch != epoch => {
                let bytes = match self.best_state.take() {
                    Some(state) => {
                        self.session.restore(&state).map_err(|error| RunError::Checkpoint {
                            path: "the best state".into(),
                            error,
                        })?;
                        state
                    }
                    None => restore(&mut self.session, &path, &RunFolder::best_name(best.epoch))?,
                };
                if hash::bytes(bytes) != best.checkpoint {
                    let path = path.join(RunFolder::best_name(best.epoch));
                    let found = "is not the state that the run wrote".into();
                    return Err(FolderError::Content { path, found }.into());
                }
            }
            _ => {}
        }
        let read = self.session.checkpoint();
        let test = self.session.test()?;
        self.keep_stream(stream::STREAM_TEST)?;
        let receipt = self.receipt("finished", Some(&ledger_text), [metrics, checkpoint], test);
        let film = self.film()?;
        let page = super::report::Parts {
            config: self.config,
            text: &self.text,
            receipt: &receipt,
            timing: &self.timing,
            records: &self.records,
            counted: Some((&ledger, &cost)),
            state: self.keeping.states.then_some(&read),
            examples: self.session.examples().zip(self.about.image),
            film: film.as_ref(),
        };
        let page = page.draw();
        self.folder.write(names::REPORT, page.html.as_bytes())?;
        self.folder.write_receipt(&receipt)?;
        if !self.keeping.states {
            self.folder.forget_states();
        }
        let notes = with_calibration(&receipt, &self.seen);
        let Self { records, timing, .. } = self;
        let absent = self.config.absent();
        Ok(Trained { receipt, records, timing, notes, summary: page.summary, cost, absent })
    }
}
