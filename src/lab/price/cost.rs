//! What a report shows of a bill: a few totals.

use super::bill::{Bill, Group, Missing, Share};
use super::piece::{PerPiece, Pieces};
use super::total::{EnergySplit, EnergyTotal};
use crate::chip::engine::Phase;
use crate::chip::ledger::Event;
use crate::lab::config::{Constants, CostTable};
use crate::lab::store::ledger::LedgerRecord;

/// Totals of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Cost {
    /// Cycles, when the model has a timing.
    pub cycles: Option<u64>,
    /// Seconds on the chip.
    pub seconds: Option<f64>,
    /// Joules, when the model has any constant.
    pub energy: Option<EnergyTotal>,
    /// The same by class: device, converter, digital, static.
    pub split: Vec<EnergySplit>,
    /// What an image takes, or an update and a decision, by phase.
    pub per_piece: Vec<PerPiece>,
    /// Part of the typical total that goes into the memory of digital sums ([`Bill::sums_share`]).
    pub sums_share: Option<f64>,
    /// Constants that a law brought to this setting: key, law.
    pub scaled: Vec<(String, String)>,
    /// Joules by component, the greatest first.
    pub components: Vec<Group>,
    /// Joules by phase, the greatest first.
    pub phases: Vec<Group>,
    /// Joules by operation, the greatest first.
    pub operations: Vec<Group>,
    /// Joules by layer, static power last.
    pub layers: Vec<Group>,
    /// Joules by pathway, the greatest first.
    pub pathways: Vec<Group>,
    /// How much of the typical total leans on each constant, the greatest first.
    pub constants: Vec<Share>,
    /// Part of the typical total that leans on assumed constants.
    pub assumed_share: f64,
    /// What has no price.
    pub missing: Vec<Missing>,
    /// Typical joules of each event that has a price: event, component, joules.
    pub each: Vec<(&'static str, &'static str, f64)>,
}

impl Cost {
    /// What an image, an update or a decision of a phase takes.
    #[must_use]
    pub fn of_piece(&self, phase: Phase) -> Option<&PerPiece> {
        self.per_piece.iter().find(|one| one.phase == phase.name())
    }

    /// Totals of a bill.
    #[must_use]
    pub fn of(
        bill: &Bill<'_>,
        ledger: &LedgerRecord,
        constants: &Constants,
        pieces: &Pieces,
    ) -> Self {
        let priced = constants.iter().any(|c| c.quantity.table != CostTable::Area);
        let each = Event::ALL.into_iter().filter_map(|event| {
            let constant = constants.of(event).filter(|constant| constant.not_here().is_none())?;
            Some((event.name(), constant.quantity.name, constant.value[1]))
        });
        Self {
            cycles: ledger.elapsed(),
            seconds: bill.seconds_total(),
            energy: priced.then(|| bill.total()),
            split: bill.split(None),
            per_piece: if priced { bill.per_piece(pieces) } else { vec![] },
            sums_share: bill.sums_share(),
            scaled: bill.scaled.clone(),
            components: bill.by_component(),
            phases: bill.by_phase(),
            operations: bill.by_operation(),
            layers: bill.by_layer(),
            pathways: bill.by_pathway(),
            constants: bill.shares(),
            assumed_share: bill.assumed().0,
            missing: bill.missing.clone(),
            each: each.collect(),
        }
    }
}
