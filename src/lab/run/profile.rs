//! What one update and one inference take on a chip: the experiment is built, calibrated, and stopped after its first
//! batch.

use super::{Machine, RunError, Session};
use crate::chip::engine::Phase;
use crate::chip::hardware::Hardware;
use crate::chip::ledger::Event;
use crate::lab::config::{Config, Constants};
use crate::lab::data::{self, DataRoot};
use crate::lab::price::{Bill, Convention, Footprint, Images, StageUse, price, stages};
use crate::lab::store::ledger::{CyclesRecord, LedgerRecord};

/// One update or one inference.
#[derive(Debug, Clone, PartialEq)]
pub struct Act {
    /// What it is.
    pub name: &'static str,
    /// Samples it takes in.
    pub samples: u64,
    /// Which ledger it was charged to.
    pub phase: Phase,
    /// What happened.
    pub ledger: LedgerRecord,
    /// Products of a cell and a whole drive code: those of reads and those of accumulation.
    pub products: [u64; 2],
}

/// What an experiment costs, before it is carried out.
#[derive(Debug, Clone)]
pub struct Profile {
    /// The first update, and an inference after it.
    pub acts: [Act; 2],
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
    let mut session = Session::new(config, data::load(&config.source()?, root)?, machine)?;
    let ledger = |session: &Session, phase| session.engines()[0].ledger(phase).clone();
    let before = ledger(&session, Phase::Training);
    session.updates(1)?;
    let engine = session.engines()[0];
    let step = LedgerRecord::since(engine, Phase::Training, &before);
    let plan = Footprint::of_layers(engine.layers());
    let samples = (session.epoch_size().0 as u64).min(u64::from(config.batch.get()));
    let before = ledger(&session, Phase::Evaluation);
    session.infer();
    let engine = session.engines()[0];
    let inference = LedgerRecord::since(engine, Phase::Evaluation, &before);
    let act = |name, samples, phase: Phase, ledger: LedgerRecord| {
        let slices = u64::from(config.hardware.slices());
        let products = [ledger.total(Event::CellReads) / slices, ledger.total(Event::Accumulates)];
        Act { name, samples, phase, ledger, products }
    };
    Ok(Profile {
        acts: [
            act("training step", samples, Phase::Training, step),
            act("inference", 1, Phase::Evaluation, inference),
        ],
        plan,
        hardware: config.hardware.clone(),
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
        self.ledger.cycles.as_ref()?.get(self.phase.name())
    }

    /// Its samples, as images.
    #[must_use]
    pub fn images(&self) -> Images {
        Images::of_phase(self.phase, self.samples)
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
