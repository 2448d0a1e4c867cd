//! What sets runs apart: keys, results, and the first epoch whose states differ.

use std::collections::BTreeMap;
use std::path::PathBuf;

use crate::lab::config::{Config, flat};
use crate::lab::report::compare::{ComparedKey, ComparedResult, ComparedRun, Comparison};
use crate::lab::run::{self, RunError};
use crate::lab::store::folder;
use crate::lab::store::record::EpochRecord;
use crate::lab::sweep::{self, RESULTS, SweepError};

/// Reads runs and puts them side by side. A run that is not finished has records and no results yet.
///
/// # Errors
/// When one of them is missing or damaged.
pub fn compare(paths: &[PathBuf]) -> Result<Comparison, SweepError> {
    let mut runs: Vec<ComparedRun> = Vec::new();
    let mut keys: Vec<BTreeMap<String, String>> = Vec::new();
    let mut results = Vec::new();
    for path in paths {
        let (config, text) = run::configuration(path)?;
        let receipt = folder::read_receipt(path).map_err(RunError::from)?;
        run::untouched(&receipt, &text)?;
        let records = run::records(path, &receipt)?;
        let finished = receipt.status == "finished";
        let differs_from = runs.first().and_then(|first| parted(&first.records, &records));
        let name = path.canonicalize().ok();
        let name = name.as_ref().unwrap_or(path).file_name();
        runs.push(ComparedRun {
            name: name.map_or_else(String::new, |name| name.to_string_lossy().into_owned()),
            folder: path.display().to_string(),
            title: title(&config),
            status: receipt.status.clone(),
            data: receipt.data.hash.clone(),
            epochs: config.epochs(),
            test: receipt.test.clone(),
            cost: if finished { Some(run::reprice_as(path, None)?.cost()) } else { None },
            differs_from,
            notes: run::notes(&receipt, &records).iter().map(ToString::to_string).collect(),
            records,
        });
        results.push(if finished { sweep::row(path)?.0.results } else { serde_json::Map::new() });
        keys.push(flat(&config).into_iter().collect());
    }
    let mut names: Vec<&String> = keys.iter().flat_map(BTreeMap::keys).collect();
    names.sort();
    names.dedup();
    let compared = names.into_iter().map(|key| {
        let values = keys.iter().map(|keys| keys.get(key).cloned()).collect();
        ComparedKey { key: key.clone(), values }
    });
    let differing = compared.filter(|key| key.values.windows(2).any(|two| two[0] != two[1]));
    let columns = RESULTS.iter().map(|column| {
        let value =
            |row: &serde_json::Map<String, serde_json::Value>| row.get(column.name)?.as_f64();
        let values = results.iter().map(value).collect();
        ComparedResult { name: column.name, label: column.label, unit: column.unit, values }
    });
    let keys = differing.collect();
    let results = columns.filter(|result| result.values.iter().any(Option::is_some)).collect();
    Ok(Comparison { runs, keys, results })
}

/// The first epoch that both have and whose states differ.
fn parted(one: &[EpochRecord], other: &[EpochRecord]) -> Option<u32> {
    let both = one.iter().zip(other);
    both.into_iter().find(|(a, b)| a.state_hash != b.state_hash).map(|(a, _)| a.epoch)
}

fn title(config: &Config) -> String {
    let what =
        format!("{} by {} on {}", config.data_name(), config.rule_name(), config.hardware_name);
    match config.differences_text() {
        text if text.is_empty() => what,
        text => format!("{what}; {text}"),
    }
}
