//! What one update and one inference take on a chip: the experiment is built, calibrated, and stopped after its first
//! batch.

use super::{Machine, RunError, Session};
use crate::chip::engine::Phase;
use crate::chip::hardware::Hardware;
use crate::chip::ledger::{Event, Part, Stage};
use crate::lab::config::{Config, Constants};
use crate::lab::data::{self, DataRoot};
use crate::lab::price::{Bill, Plan, price};
use crate::lab::store::ledger::{CyclesRecord, LedgerRecord};

/// One update or one inference.
#[derive(Debug, Clone, PartialEq)]
pub struct Act {
    /// What it is.
    pub name: &'static str,
    /// Samples it takes in.
    pub samples: u64,
    /// Which ledger it was charged to.
    pub phase: &'static str,
    /// What happened.
    pub ledger: LedgerRecord,
    /// Cells that multiplied a whole drive code: those of reads and those of accumulation.
    pub macs: [u64; 2],
}

/// What an experiment costs, before it is carried out.
#[derive(Debug, Clone)]
pub struct Profile {
    /// The first update, and an inference after it.
    pub acts: [Act; 2],
    /// Arrays of the network.
    pub plan: Plan,
    /// The chip.
    pub hardware: Hardware,
    /// Its constants.
    pub constants: Constants,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// What a stage waits for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StageUse {
    /// Which stage.
    pub stage: Stage,
    /// Cycles of it.
    pub cycles: u64,
    /// The layer and part that works most of this time, and for how many cycles.
    pub critical: Option<(usize, Part, u64)>,
}

/// Builds an experiment, learns its first batch, reads one example.
///
/// # Errors
/// When the configuration does not fit the data or the chip, or the data cannot be read.
pub fn profile(config: &Config, root: &DataRoot, machine: Machine) -> Result<Profile, RunError> {
    let mut session = Session::new(config, data::load(&config.source()?, root)?, machine)?;
    let ledger =
        |session: &Session, phase| session.trainer().driver().engine().ledger(phase).clone();
    let before = ledger(&session, Phase::Training);
    session.updates(1)?;
    let engine = session.trainer().driver().engine();
    let step = LedgerRecord::since(engine, Phase::Training, &before);
    let plan = Plan::of_layers(engine.layers());
    let samples = (session.train_len() as u64).min(u64::from(config.batch.get()));
    let before = ledger(&session, Phase::Evaluation);
    session.read_one();
    let engine = session.trainer().driver().engine();
    let inference = LedgerRecord::since(engine, Phase::Evaluation, &before);
    let act = |name, samples, phase: Phase, ledger: LedgerRecord| {
        let slices = u64::from(config.hardware.slices());
        let macs = [ledger.total(Event::CellReads) / slices, ledger.total(Event::Accumulates)];
        Act { name, samples, phase: phase.name(), ledger, macs }
    };
    Ok(Profile {
        acts: [
            act("training step", samples, Phase::Training, step),
            act("inference", 1, Phase::Evaluation, inference),
        ],
        plan,
        hardware: config.hardware,
        constants: config.constants.clone(),
        warnings: session.warnings().to_vec(),
    })
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
        self.ledger.cycles.as_ref()?.get(self.phase)
    }

    /// Stages that took time, and what each waited for.
    #[must_use]
    pub fn stages(&self) -> Vec<StageUse> {
        let Some(cycles) = self.cycles() else { return vec![] };
        let elapsed = |stage: Stage| cycles.stages.get(stage.name()).copied().unwrap_or(0);
        let stages = Stage::ALL.into_iter().filter(|&stage| elapsed(stage) > 0);
        let critical = |stage| {
            let layers = cycles.layers.iter().enumerate();
            let used = layers.flat_map(|(layer, this)| {
                parts_of(stage).iter().map(move |&part| {
                    (layer, part, this.used.get(part.name()).copied().unwrap_or(0))
                })
            });
            let used = used.filter(|(.., used)| *used > 0);
            used.max_by_key(|&(layer, _, used)| (used, std::cmp::Reverse(layer)))
        };
        stages
            .map(|stage| StageUse { stage, cycles: elapsed(stage), critical: critical(stage) })
            .collect()
    }
}

/// Parts that work in a stage.
const fn parts_of(stage: Stage) -> &'static [Part] {
    match stage {
        Stage::Forward | Stage::Columns => {
            &[Part::Arrays, Part::Converters, Part::Tree, Part::Lanes]
        }
        Stage::Error => &[Part::Bus, Part::Multipliers],
        Stage::Accumulate => &[Part::Accumulators],
        Stage::Load | Stage::Program => &[Part::Writers],
        Stage::Centre => &[],
    }
}
