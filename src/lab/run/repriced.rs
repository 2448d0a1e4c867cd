//! Pricing a finished run, with its own chip's constants or with another's.

use std::collections::BTreeMap;
use std::path::Path;

use super::RunError;
use super::train::read_config;
use crate::chip::hardware::Hardware;
use crate::lab::config::{Constants, load_model};
use crate::lab::price::{Bill, Change, Cost, Plan, changes, price};
use crate::lab::store::folder::{self, FolderError, names};
use crate::lab::store::ledger::LedgerRecord;

/// A run and the constants it is priced with.
#[derive(Debug, Clone)]
pub struct Repriced {
    /// Name of the chip that made the run.
    pub made_on: String,
    /// Name of the chip whose constants are used.
    pub priced_as: String,
    /// What that chip would have done otherwise.
    pub changes: Vec<Change>,
    /// What was counted.
    pub ledger: LedgerRecord,
    /// What the chip that made the run does and this program does not simulate.
    pub not_simulated: BTreeMap<String, String>,
    plan: Plan,
    hardware: Hardware,
    constants: Constants,
}

/// Reads a finished run, and another model if one is named.
///
/// # Errors
/// When the run is not finished or damaged, or there is no such model.
pub fn reprice(path: &Path, other: Option<&str>) -> Result<Repriced, RunError> {
    let (config, _) = read_config(path)?;
    let text = folder::read_text(path, names::LEDGER)?;
    let damaged = |name: &str, found| FolderError::Content { path: path.join(name), found };
    let ledger = LedgerRecord::parse(&text).map_err(|found| damaged(names::LEDGER, found))?;
    let records = folder::read_metrics(path)?;
    let Some(record) = records.last() else {
        return Err(damaged(names::METRICS, "has no record".into()).into());
    };
    let plan = Plan::of_records(&record.pathways);
    let (made_on, run) = (config.hardware_name.clone(), config.hardware);
    let not_simulated = config.not_simulated;
    Ok(match other {
        None => Repriced {
            priced_as: made_on.clone(),
            made_on,
            changes: vec![],
            ledger,
            not_simulated,
            plan,
            hardware: run,
            constants: config.constants,
        },
        Some(name) => {
            let model = load_model(name)?;
            Repriced {
                made_on,
                priced_as: model.name,
                changes: changes(&run, &model.hardware),
                ledger,
                not_simulated,
                plan,
                hardware: model.hardware,
                constants: model.constants,
            }
        }
    })
}

impl Repriced {
    /// What the run cost.
    #[must_use]
    pub fn bill(&self) -> Bill<'_> {
        price(&self.ledger, &self.plan, &self.hardware, &self.constants, &self.changes)
    }

    /// Its totals.
    #[must_use]
    pub fn cost(&self) -> Cost {
        Cost::of(&self.bill(), &self.ledger, &self.constants)
    }
}
