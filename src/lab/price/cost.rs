//! What a report shows of a bill: a few totals.

use super::bill::{Bill, Group, Missing, Range};
use crate::chip::ledger::Event;
use crate::lab::config::{Constants, Table};
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
        let priced = constants.iter().any(|c| c.quantity.table == Table::Energy);
        let each = Event::ALL.into_iter().filter_map(|event| {
            let constant = constants.of(event)?;
            Some((event.name(), constant.quantity.name, constant.value[1]))
        });
        Self {
            cycles: ledger.elapsed(),
            seconds: bill.seconds_total(),
            joules: priced.then(|| bill.total()),
            components: bill.by_component(),
            assumed_share: bill.assumed().0,
            missing: bill.missing.clone(),
            each: each.collect(),
        }
    }
}
