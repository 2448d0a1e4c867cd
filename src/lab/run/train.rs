//! Training in a folder, and continuing.
#![expect(
    clippy::disallowed_types,
    reason = "how often files are written may depend on the clock; what a run gives does not"
)]

use std::path::Path;
use std::time::{Duration, Instant};

use super::session::chosen;
use super::{Machine, RunError, Session};
use crate::lab::config::{self, Config, Select, Sources};
use crate::lab::data::{self, DataRoot, ImageShape, Loaded};
use crate::lab::price::Cost;
use crate::lab::store::ARITHMETIC;
use crate::lab::store::folder::{self, RunFolder, names};
use crate::lab::store::hash;
use crate::lab::store::ledger::LedgerRecord;
use crate::lab::store::record::{EpochRecord, Receipt, TestRecord};
use crate::task::classify::Progress;

/// What happens while a run is carried out.
#[derive(Debug)]
pub enum Event<'a> {
    /// The run is about to start.
    Started {
        /// Its folder.
        folder: &'a Path,
        /// The data, in one line.
        data: &'a str,
        /// What the user should know.
        warnings: &'a [String],
        /// Epochs finished before (0 unless continued).
        epoch: u32,
        /// Epochs in all.
        epochs: u32,
    },
    /// A batch was learnt from. Returning false stops the run.
    Batch(Progress),
    /// An epoch is finished and on disk.
    Epoch(&'a EpochRecord),
    /// Something to know came up.
    Warning(&'a str),
}

/// Which files a run leaves, and how much work it may lose when it is killed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Keeping {
    /// Whether the states stay when the run is finished. Without them nobody can `eval` it, and its page has no levels.
    pub states: bool,
    /// Epochs that end within this time of the last checkpoint are not written down one by one.
    pub every: Duration,
}

impl Keeping {
    /// Everything, after every epoch.
    pub const ALL: Self = Self { states: true, every: Duration::ZERO };
}

/// A finished run.
#[derive(Debug)]
pub struct Outcome {
    /// Its receipt.
    pub receipt: Receipt,
    /// Its records.
    pub records: Vec<EpochRecord>,
    /// The summary table.
    pub summary: String,
    /// What it cost on its chip, the final test aside.
    pub cost: Cost,
}

/// Trains a configuration in a new folder below `root`.
///
/// # Errors
/// When something does not fit, the disk refuses, or the caller stops it.
pub fn train(
    config: &Config,
    data_root: &DataRoot,
    root: &Path,
    machine: Machine,
    on_event: &mut (dyn FnMut(Event<'_>) -> bool + Send),
) -> Result<Outcome, RunError> {
    let loaded = data::load(&config.source()?, data_root)?;
    let (description, image) = (loaded.description.clone(), loaded.image);
    let session = Session::new(config, loaded, machine)?;
    let name = format!("{}-{}-seed{}", config.data_name(), config.rule_name(), config.seed);
    let folder = RunFolder::create(root, &name)?;
    folder.write(names::CONFIG, config.to_toml().as_bytes())?;
    Run::new(config, folder, machine, (description, image), session).carry_out(on_event)
}

/// Continues a run from its last finished epoch.
///
/// # Errors
/// When the run is finished or damaged, its data is not the same, or as [`train`].
pub fn resume(
    path: &Path,
    data_root: &DataRoot,
    machine: Machine,
    on_event: &mut (dyn FnMut(Event<'_>) -> bool + Send),
) -> Result<Outcome, RunError> {
    let folder = RunFolder::open(path)?;
    let config = read_config(path)?;
    let loaded = data::load(&config.source()?, data_root)?;
    let (description, image) = (loaded.description.clone(), loaded.image);
    let mut session = Session::new(&config, loaded, machine)?;
    let records = restored(&mut session, path)?;
    let run = Run::new(&config, folder, machine, (description, image), session);
    Run { records, ..run }.carry_out(on_event)
}

/// Carries a run out in a folder that the caller holds: new, or from where it was left. A damaged state is thrown away.
///
/// # Errors
/// When something does not fit, the disk refuses, the run is finished, or the caller stops it.
pub fn carry_on(
    config: &Config,
    loaded: &Loaded,
    folder: RunFolder,
    machine: Machine,
    keeping: Keeping,
    on_event: &mut (dyn FnMut(Event<'_>) -> bool + Send),
) -> Result<Outcome, RunError> {
    let mut session = Session::new(config, loaded.clone(), machine)?;
    let text = config.to_toml();
    let begun = folder::read_text(folder.path(), names::CONFIG).is_ok_and(|found| found == text);
    let records = if begun { restored(&mut session, folder.path()) } else { Ok(vec![]) };
    let records = match records {
        Ok(records) => records,
        Err(error @ RunError::Finished { .. }) => return Err(error),
        Err(_) => {
            session = Session::new(config, loaded.clone(), machine)?;
            vec![]
        }
    };
    if !begun {
        folder.write(names::CONFIG, text.as_bytes())?;
    }
    let about = (loaded.description.clone(), loaded.image);
    let run = Run::new(config, folder, machine, about, session);
    Run { records, keeping, ..run }.carry_out(on_event)
}

/// Brings a session to the last finished epoch on disk; none of it when there is no checkpoint.
fn restored(session: &mut Session, path: &Path) -> Result<Vec<EpochRecord>, RunError> {
    if !path.join(names::CHECKPOINT).exists() {
        return Ok(vec![]);
    }
    if let Ok(receipt) = folder::read_receipt(path) {
        if receipt.status == "finished" {
            return Err(RunError::Finished { path: path.display().to_string() });
        }
        check_receipt(&receipt, session)?;
    }
    restore(session, path, names::CHECKPOINT)?;
    let mut records = folder::read_metrics(path)?;
    let finished = session.trainer().epoch() as usize;
    if records.len() <= finished {
        let found = format!("has {} records, but epoch {finished} is finished", records.len());
        return Err(folder::FolderError::Content { path: path.join(names::METRICS), found }.into());
    }
    records.truncate(finished + 1);
    Ok(records)
}

/// The configuration a run was made with.
pub(super) fn read_config(path: &Path) -> Result<Config, RunError> {
    let text = folder::read_text(path, names::CONFIG)?;
    let name = path.join(names::CONFIG).display().to_string();
    Ok(config::load(&Sources { experiment: Some((&name, &text)), ..Sources::default() })?)
}

pub(super) fn check_receipt(receipt: &Receipt, session: &Session) -> Result<(), RunError> {
    if receipt.arithmetic != ARITHMETIC {
        return Err(RunError::Arithmetic { found: receipt.arithmetic, wanted: ARITHMETIC });
    }
    if receipt.data_hash != session.data_hash() {
        let (found, wanted) = (session.data_hash().into(), receipt.data_hash.clone());
        return Err(RunError::DataChanged { found, wanted });
    }
    if receipt.config_hash != session.config_hash() {
        let (found, wanted) = (session.config_hash().into(), receipt.config_hash.clone());
        return Err(RunError::ConfigChanged { found, wanted });
    }
    Ok(())
}

fn restore(session: &mut Session, path: &Path, name: &str) -> Result<(), RunError> {
    let bytes = folder::read_checkpoint(path, name)?;
    session.restore(&bytes).map_err(|error| RunError::Checkpoint {
        path: path.join(name).display().to_string(),
        error,
    })
}

/// Reads the test set with the chosen state of a run.
///
/// # Errors
/// When the run is damaged or its data is not the same.
pub fn evaluate(
    path: &Path,
    data_root: &DataRoot,
    machine: Machine,
) -> Result<(TestRecord, String), RunError> {
    let config = read_config(path)?;
    let mut session = Session::new(&config, data::load(&config.source()?, data_root)?, machine)?;
    check_receipt(&folder::read_receipt(path)?, &session)?;
    let records = folder::read_metrics(path)?;
    let best = chosen(config.select, &records).map(RunFolder::best_name);
    let name = best.filter(|name| path.join(name).exists());
    restore(&mut session, path, name.as_deref().unwrap_or(names::CHECKPOINT))?;
    let state = hash::state(session.trainer().driver());
    Ok((session.test(), state))
}

struct Run<'a> {
    config: &'a Config,
    folder: RunFolder,
    machine: Machine,
    description: String,
    image: Option<ImageShape>,
    session: Session,
    records: Vec<EpochRecord>,
    keeping: Keeping,
    /// When files were written last.
    written: Instant,
    /// Whether epochs have ended since.
    pending: bool,
    /// The best state so far and its epoch, while it is not on disk.
    best: Option<(u32, Vec<u8>)>,
}

impl<'a> Run<'a> {
    fn new(
        config: &'a Config,
        folder: RunFolder,
        machine: Machine,
        (description, image): (String, Option<ImageShape>),
        session: Session,
    ) -> Self {
        let (written, keeping) = (Instant::now(), Keeping::ALL);
        let records = vec![];
        Self {
            config,
            folder,
            machine,
            description,
            image,
            session,
            records,
            keeping,
            written,
            pending: false,
            best: None,
        }
    }

    fn carry_out(
        mut self,
        on_event: &mut (dyn FnMut(Event<'_>) -> bool + Send),
    ) -> Result<Outcome, RunError> {
        let path = self.folder.path().to_path_buf();
        let epochs = self.config.epochs;
        on_event(Event::Started {
            folder: &path,
            data: &self.description,
            warnings: self.session.warnings(),
            epoch: self.session.trainer().epoch(),
            epochs,
        });
        if self.records.is_empty() {
            let record = self.session.start();
            self.keep(record)?;
        }
        while self.session.trainer().epoch() < epochs {
            let epoch = self.session.trainer().epoch();
            let record = self.session.epoch(&mut |progress| on_event(Event::Batch(progress)));
            let Some(record) = record else {
                return Err(RunError::Stopped { epoch, path: path.display().to_string() });
            };
            let warning = self.session.warn_of_saturation();
            self.keep(record)?;
            on_event(Event::Epoch(self.records.last().expect("just kept")));
            if let Some(warning) = warning {
                on_event(Event::Warning(&warning));
            }
        }
        self.finish()
    }

    /// Puts a finished epoch on disk: best state and records first, the checkpoint that makes them count last.
    fn keep(&mut self, record: EpochRecord) -> Result<(), RunError> {
        self.records.push(record);
        let epoch = self.session.trainer().epoch();
        let best = chosen(self.config.select, &self.records);
        let is_best = self.config.select == Select::BestValidation && best == Some(epoch);
        let due = self.written.elapsed() >= self.keeping.every;
        self.pending = true;
        if !is_best && !due {
            return Ok(());
        }
        let state = self.session.checkpoint();
        if is_best {
            self.best = Some((epoch, state.clone()));
        }
        if !due {
            return Ok(());
        }
        self.flush(&state)
    }

    /// Writes down all epochs so far; `state` is the present one.
    fn flush(&mut self, state: &[u8]) -> Result<(), RunError> {
        if let Some((epoch, state)) = self.best.take() {
            self.folder.write(&RunFolder::best_name(epoch), &state)?;
        }
        self.folder.write_metrics(&self.records)?;
        self.folder.write(names::CHECKPOINT, state)?;
        self.folder.write_receipt(&self.receipt("running", None))?;
        self.folder.tidy(chosen(self.config.select, &self.records));
        (self.written, self.pending) = (Instant::now(), false);
        Ok(())
    }

    fn receipt(&self, status: &str, test: Option<TestRecord>) -> Receipt {
        Receipt {
            version: env!("CARGO_PKG_VERSION").into(),
            arithmetic: ARITHMETIC,
            config_hash: self.session.config_hash().into(),
            data: self.description.clone(),
            data_hash: self.session.data_hash().into(),
            tables_hash: hash::tables(self.session.trainer().driver()),
            epoch_hashes: self.records.iter().map(|r| r.state_hash.clone()).collect(),
            status: status.into(),
            test,
            kernel: self.machine.backend.name().into(),
            threads: self.machine.threads,
            train_seconds: self.records.iter().map(|r| r.train_seconds).sum(),
            warnings: self.session.warnings().to_vec(),
        }
    }

    fn finish(mut self) -> Result<Outcome, RunError> {
        if self.keeping.states && self.pending {
            self.flush(&self.session.checkpoint())?;
        }
        let ledger = LedgerRecord::of(self.session.trainer().driver().engine());
        self.folder.write_metrics(&self.records)?;
        self.folder.write(names::LEDGER, ledger.to_json().as_bytes())?;
        let cost = super::report::cost(self.config, &ledger, &self.records);
        let epoch = self.session.trainer().epoch();
        let best = chosen(self.config.select, &self.records).unwrap_or(epoch);
        let path = self.folder.path().to_path_buf();
        if best != epoch {
            match self.best.take() {
                Some((_, state)) => self.session.restore(&state).map_err(|error| {
                    RunError::Checkpoint { path: "the best state".into(), error }
                })?,
                None => restore(&mut self.session, &path, &RunFolder::best_name(best))?,
            }
        }
        let state = self.session.checkpoint();
        let test = (!self.session.test_examples().is_empty()).then(|| self.session.test());
        let receipt = self.receipt("finished", test);
        let page = super::report::Parts {
            config: self.config,
            text: &self.config.to_toml(),
            receipt: &receipt,
            records: &self.records,
            counted: Some((&ledger, &cost)),
            state: self.keeping.states.then_some(&state),
            examples: self.image.map(|image| (self.session.test_examples(), image)),
        };
        let page = page.draw();
        self.folder.write(names::REPORT, page.html.as_bytes())?;
        self.folder.write_receipt(&receipt)?;
        if !self.keeping.states {
            self.folder.forget_states();
        }
        Ok(Outcome { receipt, records: self.records, summary: page.summary, cost })
    }
}
