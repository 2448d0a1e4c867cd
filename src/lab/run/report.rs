//! The report of a run folder, drawn when a run ends and again whenever someone asks for it.
//!
//! ```text
//! report.html = f(config.toml, receipt.json, metrics.jsonl [, ledger.json] [, state that read the test set] [, data])
//! ```
//!
//! What stands in brackets may be missing; figures that need it are then left out.

use std::iter;
use std::path::{Path, PathBuf};

use super::again::read_config;
use super::notes::notes;
use super::session::chosen;
use super::{Machine, RunError};
use crate::chip::crossbar::kernel::Backend;
use crate::lab::config::{Bias, Config, PolicySettings};
use crate::lab::data::{self, DataRoot, ImageShape};
use crate::lab::price::{Cost, Footprint, Pieces, price};
use crate::lab::report::{self, Film, Heat, Picture, PolicyInput, RunView, Sight};
use crate::lab::store::checkpoint::{self, CheckpointError, Identity};
use crate::lab::store::folder::{self, FolderError, RunFolder, names};
use crate::lab::store::ledger::LedgerRecord;
use crate::lab::store::record::{EpochRecord, Receipt, TimingRecord};
use crate::task::classify::Examples;
use crate::task::environment::Shown;
use crate::task::policy::InputCoding;

/// A report on disk.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReportMade {
    /// Where it is.
    pub path: PathBuf,
    /// The summary table, as `dalean train` prints it.
    pub summary: String,
    /// Which figures were left out, and why.
    pub notes: Vec<String>,
}

/// Draws `report.html` of a run folder again from what is on disk: also of a run that is not finished, and without its
/// states and its data, as far as that goes. The pictures of wrong answers come from the data set in `data_root`.
///
/// # Errors
/// When the folder is not that of a run, is damaged, or another process is carrying the run out.
pub fn report(path: &Path, data_root: Option<&DataRoot>) -> Result<ReportMade, RunError> {
    let folder = RunFolder::open(path)?;
    let text = folder::read_text(path, names::CONFIG)?;
    let (config, _) = read_config(path)?;
    let receipt = folder::read_receipt(path)?;
    let mut records = folder::read_metrics(path)?;
    // the receipt is written last: what it does not name was not finished
    records.truncate(receipt.epoch_hashes.len());
    let mut notes = vec![];
    let ledger = if path.join(names::LEDGER).exists() {
        let damaged = |found| FolderError::Content { path: path.join(names::LEDGER), found };
        Some(LedgerRecord::parse(&folder::read_text(path, names::LEDGER)?).map_err(damaged)?)
    } else {
        notes.push(format!("no time and energy: there is no {}", names::LEDGER));
        None
    };
    let cost = ledger.as_ref().map(|ledger| cost(&config, ledger, &records));
    let state = match state_name(path, &config, &records) {
        Some(name) => Some(folder::read_checkpoint(path, &name)?),
        None => {
            notes
                .push("no pictures of cells: the state that read the test set was not kept".into());
            None
        }
    };
    let source = config.source()?;
    let loaded = match data_root.map(|root| data::load(&source, root)) {
        Some(Ok(loaded)) if loaded.hash == receipt.data.hash => Some(loaded),
        Some(Ok(_)) => {
            notes.push("no pictures of wrong answers: the data has changed since".into());
            None
        }
        Some(Err(error)) => {
            notes.push(format!("no pictures of wrong answers: {error}"));
            None
        }
        None => None,
    };
    let film = match data_root.filter(|_| config.policy.is_some() && state.is_some()) {
        None => None,
        Some(root) => match watched(path, root) {
            Ok(film) => Some(film),
            Err(error) => {
                notes.push(format!("no episode: {error}"));
                None
            }
        },
    };
    let parts = Parts {
        config: &config,
        text: &text,
        receipt: &receipt,
        timing: &folder::read_timing(path),
        records: &records,
        counted: ledger.as_ref().zip(cost.as_ref()),
        state: state.as_deref(),
        examples: loaded.as_ref().and_then(|loaded| Some((&loaded.split.test, loaded.image?))),
        film: film.as_ref(),
    };
    let Page { html, summary, damage } = parts.draw();
    notes.extend(damage.map(|error| format!("no pictures of cells: {error}")));
    folder.write(names::REPORT, html.as_bytes())?;
    Ok(ReportMade { path: path.join(names::REPORT), summary, notes })
}

/// The first episode of the evaluation.
fn watched(path: &Path, root: &DataRoot) -> Result<Film, RunError> {
    let machine = Machine::new(Backend::best(), 1)?;
    let mut steps = Vec::new();
    let _ = super::watch(path, root, machine, 0, &mut |_, step| {
        steps.push(step.clone());
        true
    })?;
    Ok(Film::new(0, &steps))
}

/// What drives the rows of the first layer of a policy: of split numbers, what is above 0 and what is below.
fn inputs(policy: &PolicySettings) -> Vec<PolicyInput> {
    let of = |(name, count): &(&'static str, usize)| match (policy.environment.shown, policy.input)
    {
        (Shown::Dense(_), InputCoding::Split) => (0..*count)
            .flat_map(|at| {
                let name = if *count == 1 { (*name).to_owned() } else { format!("{name} {at}") };
                ["+", "-"].map(|side| PolicyInput { name: format!("{name} {side}"), rows: 1 })
            })
            .collect(),
        _ => vec![PolicyInput { name: (*name).to_owned(), rows: *count }],
    };
    policy.environment.inputs.iter().flat_map(of).collect()
}

/// What a run cost on its own chip.
pub(super) fn cost(config: &Config, ledger: &LedgerRecord, records: &[EpochRecord]) -> Cost {
    let pathways = records.last().map_or(&[][..], |record| &record.pathways);
    let plan = Footprint::of_records(pathways, &config.copies());
    let bill = price(ledger, &plan, &config.hardware, &config.constants, &[]);
    Cost::of(&bill, ledger, &config.constants, &Pieces::of_records(records))
}

/// The file of the state that reads the test set; `None` when it was not kept.
fn state_name(path: &Path, config: &Config, records: &[EpochRecord]) -> Option<String> {
    let last = records.last().map(|record| record.epoch);
    let wanted = chosen(config.select, records).or(last);
    let best = wanted.filter(|_| wanted != last).map(RunFolder::best_name);
    let name = best.unwrap_or_else(|| names::CHECKPOINT.into());
    path.join(&name).exists().then_some(name)
}

/// What a report is drawn from.
#[derive(Debug, Clone, Copy)]
pub(super) struct Parts<'a> {
    /// The configuration.
    pub config: &'a Config,
    /// The same as the folder holds it.
    pub text: &'a str,
    /// What went in and came out.
    pub receipt: &'a Receipt,
    /// What it took.
    pub timing: &'a TimingRecord,
    /// One an epoch.
    pub records: &'a [EpochRecord],
    /// What was counted, and its price.
    pub counted: Option<(&'a LedgerRecord, &'a Cost)>,
    /// Checkpoint of the state that reads the test set.
    pub state: Option<&'a [u8]>,
    /// The test set and how to draw it.
    pub examples: Option<(&'a Examples, ImageShape)>,
    /// An episode of a policy.
    pub film: Option<&'a Film>,
}

/// A report, drawn.
#[derive(Debug)]
pub(super) struct Page {
    /// The page.
    pub html: String,
    /// The table for the terminal.
    pub summary: String,
    /// Why the state could not be drawn.
    pub damage: Option<CheckpointError>,
}

impl Parts<'_> {
    /// Draws page and table.
    pub(super) fn draw(&self) -> Page {
        let (heats, damage) = match self.heats() {
            Ok(heats) => (heats, None),
            Err(error) => (vec![], Some(error)),
        };
        let pictures = self.pictures();
        let notes: Vec<_> =
            notes(self.receipt, self.records).iter().map(ToString::to_string).collect();
        let warnings: Vec<_> =
            self.config.warnings().into_iter().chain(notes.iter().cloned()).collect();
        let absent = self.config.absent();
        let inputs = self.config.policy.as_ref().map_or_else(Vec::new, inputs);
        let view = RunView {
            title: self.title(),
            config: self.text,
            receipt: self.receipt,
            data: format!("{}: {}", self.config.data_name(), self.receipt.data),
            timing: self.timing,
            warnings: &warnings,
            absent: &absent,
            epochs: self.records,
            level_max: self.config.hardware.cell.level_bits.level_max(),
            heats: &heats,
            pictures: &pictures,
            inputs: &inputs,
            window: self.config.convolutions.first().map(|first| Sight {
                side: first.shape.side,
                channels: first.shape.channels,
                halves: self.config.input.has_halves(),
            }),
            film: self.film,
            class_names: &self.receipt.data.names,
            ledger: self.counted.map(|(ledger, _)| ledger),
            cost: self.counted.map(|(_, cost)| cost),
        };
        let summary = report::text::summary(&view) + report::text::beside("note", &notes).as_str();
        Page { html: report::html(&view), summary, damage }
    }

    fn title(&self) -> String {
        let shapes = self.records.first().map(|record| &record.pathways).into_iter().flatten();
        let mut sizes: Vec<(usize, [usize; 2])> = shapes.map(|p| (p.layer, p.shape)).collect();
        sizes.dedup();
        let bias = usize::from(self.config.bias != Bias::None);
        let of_network = |sizes: &[(usize, [usize; 2])]| {
            let first = sizes.first().map_or(0, |(_, [rows, _])| rows.saturating_sub(bias));
            let units = sizes.iter().map(|(_, [_, columns])| columns);
            let sizes = std::iter::once(&first).chain(units).map(usize::to_string);
            sizes.collect::<Vec<_>>().join("-")
        };
        let windows = &self.config.convolutions;
        let (windowed, dense) = sizes.split_at(windows.len().min(sizes.len()));
        // of a policy, the layers of the critic follow those of the actor
        let networks = dense.chunks(self.config.hidden.len() + 1).map(of_network);
        let mut networks: Vec<String> = networks.collect();
        if let (Some(first), false) = (windows.first(), windowed.is_empty()) {
            let channels = windows.iter().map(|window| window.units);
            let channels: Vec<_> = iter::once(first.shape.channels).chain(channels).collect();
            let channels: Vec<_> = channels.iter().map(usize::to_string).collect();
            networks.insert(0, format!("convolutions {}", channels.join("-")));
        }
        let differs = self.config.differences_text();
        format!(
            "{} by {}: {} on {}{}{differs}",
            self.config.data_name(),
            self.config.rule_name(),
            networks.join(" and "),
            self.config.hardware_name,
            if differs.is_empty() { "" } else { "; " }
        )
    }

    fn heats(&self) -> Result<Vec<Heat>, CheckpointError> {
        let epoch = chosen(self.config.select, self.records);
        let of_epoch = |record: &&EpochRecord| epoch.is_none_or(|epoch| record.epoch == epoch);
        let (Some(state), Some(record)) = (self.state, self.records.iter().find(of_epoch)) else {
            return Ok(vec![]);
        };
        let identity = Identity { run: &self.receipt.run, data: &self.receipt.data.hash };
        let pathways = &record.pathways;
        let arrays: Vec<_> = pathways.iter().map(|p| (p.layer, &*p.pathway, p.shape)).collect();
        let levels = checkpoint::levels(state, identity, &record.state_hash, &arrays)?;
        let heats = arrays.into_iter().zip(levels).map(|((layer, pathway, shape), levels)| {
            let [rows, columns] = shape;
            Heat { layer, pathway: pathway.into(), rows, columns, levels }
        });
        Ok(heats.collect())
    }

    fn pictures(&self) -> Vec<Picture> {
        let Some((test, ImageShape { height, width, channels })) = self.examples else {
            return vec![];
        };
        let mut places: Vec<[u64; 3]> = vec![];
        for place in self
            .receipt
            .classified()
            .into_iter()
            .flat_map(|test| test.mistakes.iter().chain(&test.confused))
        {
            if !places.contains(place) {
                places.push(*place);
            }
        }
        let places = places.into_iter().filter_map(|[example, truth, guess]| {
            let at = usize::try_from(example).ok().filter(|&at| at < test.len())?;
            let (values, full_scale) = (test.values(at).to_vec(), test.full_scale());
            Some(Picture { example, truth, guess, height, width, channels, full_scale, values })
        });
        places.collect()
    }
}
