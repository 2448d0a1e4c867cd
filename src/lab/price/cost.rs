//! What a report shows of a bill: a few totals.

use super::bill::{Bill, Group, Missing, Range, Share};
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
    /// Joules, when the model has energies.
    pub joules: Option<Range>,
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
    /// Totals of a bill.
    #[must_use]
    pub fn of(bill: &Bill<'_>, ledger: &LedgerRecord, constants: &Constants) -> Self {
        let priced = constants.iter().any(|c| c.quantity.table == CostTable::Energy);
        let each = Event::ALL.into_iter().filter_map(|event| {
            let constant = constants.of(event)?;
            Some((event.name(), constant.quantity.name, constant.value[1]))
        });
        Self {
            cycles: ledger.elapsed(),
            seconds: bill.seconds_total(),
            joules: priced.then(|| bill.total()),
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
