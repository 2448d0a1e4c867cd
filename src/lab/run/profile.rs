//! What one update and one inference take on a chip: the experiment is built, calibrated, and stopped after its first
//! batch.

use super::{Machine, RunError, Session};
use crate::chip::engine::Phase;
use crate::chip::hardware::Hardware;
use crate::chip::ledger::{Event, Ledger};
use crate::lab::config::{Config, Constants, Sources, load};
use crate::lab::data::{self, Data, DataRoot};
use crate::lab::price::{Bill, Convention, Footprint, PieceKind, Pieces, StageUse, price, stages};
use crate::lab::store::ledger::{CyclesRecord, LedgerRecord};

/// One update or one inference.
#[derive(Debug, Clone, PartialEq)]
pub struct Act {
    /// What it is.
    pub name: &'static str,
    /// Samples it takes in.
    pub samples: u64,
    /// What it is priced as.
    pub kind: PieceKind,
    /// Which ledger it was charged to.
    pub phase: Phase,
    /// What happened.
    pub ledger: LedgerRecord,
    /// Products of a cell and a whole drive code: those of reads and those of accumulation.
    pub products: [u64; 2],
}

/// The same first update in a mode of writing a batch.
#[derive(Debug, Clone, PartialEq)]
pub struct ModeUse {
    /// `learning.mode`.
    pub mode: &'static str,
    /// Whether it is the experiment's own.
    pub own: bool,
    /// What had to change beside it, as a setting.
    pub also: Option<&'static str>,
    /// What it did, or why the experiment cannot have it.
    pub act: Result<Act, String>,
}

/// Modes of writing a batch.
const MODES: [&str; 3] = ["accumulate", "replay", "online"];
/// What a mode that writes after each sample needs where the experiment centres over a batch.
const RUNNING: &str = "learning.centre=running";

/// What an experiment costs, before it is carried out.
#[derive(Debug, Clone)]
pub struct Profile {
    /// The first update, and an inference after it.
    pub acts: [Act; 2],
    /// The first update in each mode of writing a batch, this experiment's own among them.
    pub modes: Vec<ModeUse>,
    /// Arrays of the network.
    pub plan: Footprint,
    /// The chip.
    pub hardware: Hardware,
    /// Its constants.
    pub constants: Constants,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// Builds an experiment, learns its first batch, reads one example.
///
/// # Errors
/// When the configuration does not fit the data or the chip, or the data cannot be read.
pub fn profile(config: &Config, root: &DataRoot, machine: Machine) -> Result<Profile, RunError> {
    let data = data::load(&config.source()?, root)?;
    let mut session = Session::new(config, data.clone(), machine)?;
    let step = step(&mut session, config, &data)?;
    let layers = session.engines().into_iter().flat_map(|engine| engine.layers().iter());
    let plan = Footprint::of_layers(layers);
    let before = ledgers(&session, Phase::Evaluation);
    session.infer()?;
    // a policy acts by its first network
    let engines = session.engines();
    let inference = LedgerRecord::since(&engines[..1], Phase::Evaluation, &before);
    let (name, kind) = match config.policy {
        None => ("inference", PieceKind::Image),
        Some(_) => ("decision", PieceKind::Decision),
    };
    let inference = act(name, 1, kind, inference, config);
    Ok(Profile {
        modes: modes(config, &data, machine, &step),
        acts: [step, inference],
        plan,
        hardware: config.hardware.clone(),
        constants: config.constants.clone(),
        warnings: session.warnings(),
    })
}

fn act(
    name: &'static str,
    samples: u64,
    kind: PieceKind,
    ledger: LedgerRecord,
    config: &Config,
) -> Act {
    let phase = match name {
        "inference" | "decision" => Phase::Evaluation,
        _ => Phase::Training,
    };
    let slices = u64::from(config.hardware.slices());
    let products = [ledger.total(Event::CellReads) / slices, ledger.total(Event::Accumulates)];
    Act { name, samples, kind, phase, ledger, products }
}

/// Learns the first batch; of a policy, the second minibatch, before which there is no rollout.
fn step(session: &mut Session, config: &Config, data: &Data) -> Result<Act, RunError> {
    let samples = (session.epoch_size().0 as u64).min(u64::from(config.batch.get()));
    if config.policy.is_none() {
        let before = ledgers(session, Phase::Training);
        session.updates(1)?;
        let ledger = LedgerRecord::since(&session.engines(), Phase::Training, &before);
        return Ok(act("training step", samples, PieceKind::Image, ledger, config));
    }
    let before = {
        let machine = Machine::new(session.engines()[0].backend(), 1)?;
        let mut other = Session::new(config, data.clone(), machine)?;
        other.updates(1)?;
        ledgers(&other, Phase::Training)
    };
    session.updates(2)?;
    let ledger = LedgerRecord::since(&session.engines(), Phase::Training, &before);
    Ok(act("update", samples, PieceKind::Update, ledger, config))
}

/// What the networks of a session have counted in a phase.
fn ledgers(session: &Session, phase: Phase) -> Vec<Ledger> {
    session.engines().into_iter().map(|engine| engine.ledger(phase).clone()).collect()
}

/// The first update in every mode: the experiment is built again with that key alone changed, and centred by running
/// means where it centres over the batch and the mode cannot.
fn modes(config: &Config, data: &Data, machine: Machine, own: &Act) -> Vec<ModeUse> {
    let text = config.to_toml();
    let other = |settings: &[String]| -> Result<Act, RunError> {
        let experiment = Some(("this experiment", &*text));
        let config = load(&Sources { experiment, settings, ..Sources::default() })?;
        step(&mut Session::new(&config, data.clone(), machine)?, &config, data)
    };
    let of = |mode: &'static str| {
        if mode == config.mode_name() {
            return ModeUse { mode, own: true, also: None, act: Ok(own.clone()) };
        }
        let set = format!("learning.mode={mode}");
        let first = other(std::slice::from_ref(&set));
        let (also, act) = match first {
            Err(_) => match other(&[set, RUNNING.to_owned()]) {
                Ok(act) => (Some(RUNNING), Ok(act)),
                Err(_) => (None, first),
            },
            Ok(_) => (None, first),
        };
        ModeUse { mode, own: false, also, act: act.map_err(|error| error.to_string()) }
    };
    MODES.map(of).into()
}

impl Profile {
    /// What an act costs.
    #[must_use]
    pub fn bill<'a>(&self, act: &'a Act) -> Bill<'a> {
        price(&act.ledger, &self.plan, &self.hardware, &self.constants, &[])
    }
}

impl Act {
    /// Cycles, when the model has a timing.
    #[must_use]
    pub fn cycles(&self) -> Option<&CyclesRecord> {
        self.ledger.cycles.as_ref()?.get(self.phase.name())
    }

    /// What it does, as it is priced: images, an update, a decision.
    #[must_use]
    pub fn pieces(&self) -> Pieces {
        let count = if self.kind == PieceKind::Update { 1 } else { self.samples };
        Pieces::of_phase(self.phase, self.kind, count)
    }

    /// Operations of it, as a convention counts them.
    #[must_use]
    pub fn operations(&self, convention: Convention) -> f64 {
        convention.operations(self.products.iter().sum())
    }

    /// Stages that took time, and what each waited for.
    #[must_use]
    pub fn stages(&self) -> Vec<StageUse> {
        self.cycles().map_or_else(Vec::new, stages)
    }
}
