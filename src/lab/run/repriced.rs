//! Pricing a finished run, with its own chip's constants or with another's.

use std::path::Path;

use serde_json::{Value, json};

use super::again::read_config;
use super::{RunError, records};
use crate::chip::hardware::Hardware;
use crate::lab::config::{Absent, Config, Constants, Model, load_model};
use crate::lab::price::{Bill, Change, Cost, Footprint, Pieces, areas, changes, price};
use crate::lab::store::folder::{self, FolderError, names};
use crate::lab::store::hash;
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
    /// What real chips do and the run did not.
    pub absent: Vec<Absent>,
    /// [`Prices::fingerprint`] of the chip whose constants are used.
    pub fingerprint: String,
    /// What went through the chip.
    pub pieces: Pieces,
    plan: Footprint,
    hardware: Hardware,
    constants: Constants,
}

/// A chip as prices see it.
#[derive(Debug, Clone)]
pub struct Prices {
    /// Its name.
    pub name: String,
    /// What such chips do and this program does not simulate.
    pub absent: Vec<Absent>,
    /// The chip.
    pub hardware: Hardware,
    /// Its constants.
    pub constants: Constants,
}

impl Prices {
    /// Those of a configuration.
    #[must_use]
    pub fn of(config: &Config) -> Self {
        Self {
            name: config.hardware_name.clone(),
            absent: config.absent(),
            hardware: config.hardware.clone(),
            constants: config.constants.clone(),
        }
    }

    /// Says whether two are the same, without keeping either.
    #[must_use]
    pub fn fingerprint(&self) -> String {
        hash::bytes(format!("{self:?}"))[..16].to_owned()
    }
}

/// What real chips do and a run did not.
///
/// # Errors
/// When the folder is not that of a run.
pub fn absent(path: &Path) -> Result<Vec<Absent>, RunError> {
    Ok(read_config(path)?.0.absent())
}

/// Reads a finished run, and another model if one is named.
///
/// # Errors
/// When the run is not finished or damaged, or there is no such model.
pub fn reprice(path: &Path, other: Option<&str>) -> Result<Repriced, RunError> {
    let prices = |name: &str| -> Result<Prices, RunError> {
        let Model { name, hardware, constants, .. } = load_model(name)?;
        Ok(Prices { name, hardware, constants, absent: vec![] })
    };
    let other = other.map(prices).transpose()?;
    let mut repriced = reprice_as(path, other)?;
    // what the run leaves out is what the chip that made it leaves out
    repriced.absent = read_config(path)?.0.absent();
    Ok(repriced)
}

/// Of which nodes constants are, and how many of each.
#[must_use]
pub fn nodes_json(constants: &Constants) -> Value {
    let nodes = constants.nodes().into_iter();
    nodes.map(|(node, numbers)| json!({"node_nm": node, "numbers": numbers})).collect()
}

/// What a finished run cost on its chip or with the constants of another model, as the JSON object of `dalean price --json`:
/// joules and seconds in all and by class, component, phase, operation, layer and pathway, with bounds.
///
/// ```
/// let error = dalean::priced(std::path::Path::new("no/such/run"), None).unwrap_err();
/// assert!(error.to_string().contains("no/such/run"));
/// ```
///
/// # Errors
/// When the run is not finished or damaged, or there is no such model.
pub fn priced(path: &Path, other: Option<&str>) -> Result<String, RunError> {
    Ok(reprice(path, other)?.to_json(path).to_string())
}

/// Reads a finished run and prices it as if made on another chip; without one, as its own folder says.
///
/// # Errors
/// When the run is not finished or damaged.
pub fn reprice_as(path: &Path, other: Option<Prices>) -> Result<Repriced, RunError> {
    let (config, _) = read_config(path)?;
    let receipt = folder::read_receipt(path)?;
    let text = folder::read_text(path, names::LEDGER)?;
    let damaged = |name: &str, found| FolderError::Content { path: path.join(name), found };
    if receipt.ledger.as_ref().is_some_and(|kept| *kept != hash::bytes(&text)) {
        let found = format!("is not the ledger that {} speaks of", names::RECEIPT);
        return Err(damaged(names::LEDGER, found).into());
    }
    let ledger = LedgerRecord::parse(&text).map_err(|found| damaged(names::LEDGER, found))?;
    let records = records(path, &receipt)?;
    let Some(record) = records.last() else {
        return Err(damaged(names::METRICS, "has no record".into()).into());
    };
    let plan = Footprint::of_records(&record.pathways, &config.copies());
    let made_on = config.hardware_name.clone();
    let changes = other.as_ref().map_or_else(Vec::new, |o| changes(&config.hardware, &o.hardware));
    let prices = other.unwrap_or_else(|| Prices::of(&config));
    let fingerprint = prices.fingerprint();
    let Prices { name: priced_as, absent, hardware, constants } = prices;
    Ok(Repriced {
        made_on,
        priced_as,
        changes,
        ledger,
        absent,
        fingerprint,
        pieces: Pieces::of_records(&records),
        plan,
        hardware,
        constants,
    })
}

impl Repriced {
    /// All of it, of the run in `path`, as a JSON object.
    #[must_use]
    pub fn to_json(&self, path: &Path) -> Value {
        let changes = self.changes.iter().map(|change| {
            let events: Vec<_> = change.events.iter().map(|event| event.name()).collect();
            json!({"key": change.key, "events": events, "time": change.time})
        });
        let mut object = json!({"event": "price", "run": path.display().to_string(),
            "made_on": self.made_on, "priced_as": self.priced_as,
            "changes": changes.collect::<Vec<_>>(), "cycles": self.ledger.elapsed(),
            "nodes": nodes_json(&self.constants), "not_simulated": self.absent});
        if let (Some(object), Value::Object(more)) =
            (object.as_object_mut(), self.bill().to_json(&self.pieces))
        {
            object.extend(more);
        }
        object
    }

    /// What the run cost.
    #[must_use]
    pub fn bill(&self) -> Bill<'_> {
        price(&self.ledger, &self.plan, &self.hardware, &self.constants, &self.changes)
    }

    /// Square millimetres of the network's converters, if the model gives them for this chip.
    #[must_use]
    pub fn converters_mm2(&self) -> Option<f64> {
        let all = areas(&self.plan, &self.hardware, &self.constants);
        all.into_iter().find(|(name, _)| *name == "adc").map(|(_, area)| area[1] * 1e6)
    }

    /// The constants it is priced with.
    #[must_use]
    pub const fn constants(&self) -> &Constants {
        &self.constants
    }

    /// Its totals.
    #[must_use]
    pub fn cost(&self) -> Cost {
        Cost::of(&self.bill(), &self.ledger, &self.constants, &self.pieces)
    }
}
