//! What is laid over a model: which of its settings and numbers are no longer its own.
//!
//! A physical number that `--set` gives is `assumed, by --set`, and so is one that a file gives without its source and mark. The
//! chip is called changed, and its summary says in what.

use std::collections::BTreeSet;

use toml::{Table, Value};

use super::check::wrong;
use super::file::HardwareFile;
use super::law::{Settings, kind_of, settings};
use super::{ConfigError, chip};

/// Tables of physical numbers.
const NUMBERS: [&str; 3] = ["energy", "power", "area"];

/// A model under a chip: what its numbers are for.
#[derive(Debug, Default)]
pub(super) struct UnderModel {
    /// Its settings; empty when it is no chip by itself.
    pub(super) settings: Settings,
    /// Keys of the chip that are not its own.
    pub(super) changed: Vec<String>,
}

/// Numbers of `hw` in a text: `conversion_pj = 1.4` as `--set` may say it becomes a table, and what does not say where it
/// comes from is assumed. `by` says who speaks; `always`: whatever is said, it is assumed.
pub(super) fn mark(over: &mut Table, by: &str, always: bool) {
    let Some(Value::Table(hw)) = over.get_mut("hw") else { return };
    if hw.contains_key("name") {
        return;
    }
    for table in NUMBERS {
        let Some(Value::Table(numbers)) = hw.get_mut(table) else { continue };
        for (_, number) in numbers.iter_mut() {
            let Value::Table(number) = number else { continue };
            let complete = number.contains_key("source") && number.contains_key("kind");
            if complete && !always {
                continue;
            }
            let source = match number.get("source").and_then(Value::as_str) {
                Some(source) => format!("by {by}: {source}"),
                None => format!("by {by}"),
            };
            number.insert("source".into(), Value::String(source));
            number.insert("kind".into(), Value::String("assumed".into()));
        }
    }
}

/// Bare numbers in place of physical ones, as tables whose bounds are the number itself; whether there were any.
pub(super) fn spread(over: &mut Table) -> bool {
    let Some(Value::Table(hw)) = over.get_mut("hw") else { return false };
    let mut any = false;
    for table in NUMBERS {
        let Some(Value::Table(numbers)) = hw.get_mut(table) else { continue };
        for (_, number) in numbers.iter_mut() {
            if matches!(number, Value::Float(_) | Value::Integer(_)) {
                let parts = ["low", "typical", "high"].map(|part| (part.into(), number.clone()));
                *number = Value::Table(Table::from_iter(parts));
                any = true;
            }
        }
    }
    any
}

/// Lays `own` keys over those of a model.
pub(super) fn lay(
    mut model: Table,
    file: &HardwareFile,
    own: Table,
) -> Result<(Table, UnderModel), ConfigError> {
    for (key, why) in [
        ("modes", "ways to use a chip are listed in its model file"),
        ("constants_for", "the program writes it beside a chip of its own"),
    ] {
        if own.contains_key(key) {
            let allowed = format!("{why}: remove the key");
            return Err(wrong(&format!("hw.{key}"), "is given", allowed));
        }
    }
    model.remove("modes");
    give_way(&mut model, &own);
    let before = model.clone();
    super::overlay(&mut model, own);
    model.remove("model");
    let changed = differences(&before, &model);
    if !changed.is_empty() {
        let text = |key: &str| model.get(key).and_then(Value::as_str).unwrap_or_default();
        let name = format!("{}, changed", text("name"));
        let summary = format!("{}; changed: {}", text("summary"), changed.join(", "));
        model.insert("name".into(), Value::String(name));
        model.insert("summary".into(), Value::String(summary));
    }
    let mut alone = file.clone();
    let own_settings = chip::resolve(&mut alone, "").map(|chip| settings(&chip, kind_of(&alone)));
    let settings = own_settings.unwrap_or_default();
    Ok((model, UnderModel { settings, changed }))
}

/// Another kind of converter takes other keys: those of the model's kind give way to it.
fn give_way(model: &mut Table, own: &Table) {
    let kind = own.get("adc").and_then(Value::as_table).and_then(|adc| adc.get("converter"));
    let Some(kind) = kind else { return };
    let now = model.get("adc").and_then(Value::as_table).and_then(|adc| adc.get("converter"));
    if now == Some(kind) {
        return;
    }
    if let Some(Value::Table(timing)) = model.get_mut("timing") {
        timing.remove("convert_cycles");
    }
    if let Some(Value::Table(adc)) = model.get_mut("adc") {
        adc.remove("step_cycles");
        adc.remove("phase_bits");
    }
}

/// Keys whose values differ, prose and marks aside.
fn differences(before: &Table, after: &Table) -> Vec<String> {
    let mut found = Vec::new();
    let keys: BTreeSet<&String> = before.keys().chain(after.keys()).collect();
    for key in keys {
        match (before.get(key), after.get(key)) {
            _ if ["name", "summary", "not_simulated", "node_nm"].contains(&key.as_str()) => {}
            (Some(Value::Table(before)), Some(Value::Table(after))) => {
                let inner: BTreeSet<&String> = before.keys().chain(after.keys()).collect();
                let numbers = NUMBERS.contains(&key.as_str());
                let prose = |inner: &str| !numbers && ["source", "kind"].contains(&inner);
                let differ = inner.into_iter().filter(|inner| !prose(inner));
                let differ = differ.filter(|inner| before.get(*inner) != after.get(*inner));
                found.extend(differ.map(|inner| format!("{key}.{inner}")));
            }
            (before, after) if before != after => found.push(key.clone()),
            _ => {}
        }
    }
    found
}

/// Writes into a chip what its numbers are for: settings of the model that it has otherwise, and what stands for the chip
/// itself because it was given with it.
pub(super) fn settle(file: &mut HardwareFile, model: &UnderModel, chip: &Settings) {
    let other = |(setting, value): (&_, &_)| chip.get(setting) != Some(value);
    let others: Settings = model
        .settings
        .iter()
        .filter(|&pair| other(pair))
        .map(|(&setting, value)| (setting, value.clone()))
        .collect();
    if others.is_empty() {
        return;
    }
    let here: Settings =
        others.keys().filter_map(|key| Some((*key, chip.get(key)?.clone()))).collect();
    super::quantity::stand_here(file, &model.changed, &here);
    file.constants_for = Some(others);
}
