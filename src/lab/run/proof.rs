//! What a run folder says against what follows from it: the receipt that a session and its records make, and the first
//! field in which two of them differ.

use std::path::Path;

use serde::Serialize;
use serde_json::Value;

use super::{RunError, Session};
use crate::lab::store::folder::{self, FolderError, names};
use crate::lab::store::record::{BestRecord, EpochRecord, Receipt};
use crate::lab::store::{ARITHMETIC, hash};

/// The receipt of a run whose states stay: `text` is its `config.toml`, `metrics` the hash of its records' text,
/// `checkpoint` that of the state after the last record. It is neither finished nor tested.
pub(super) fn receipt(
    session: &Session,
    text: &str,
    records: &[EpochRecord],
    [metrics, checkpoint]: [String; 2],
    best: Option<BestRecord>,
) -> Receipt {
    Receipt {
        arithmetic: ARITHMETIC,
        status: "running".into(),
        run: session.run().into(),
        config: hash::bytes(text),
        data: session.data().clone(),
        tables: hash::tables(&session.networks()),
        metrics,
        ledger: None,
        checkpoint,
        best,
        states: true,
        epoch_hashes: records.iter().map(|record| record.state_hash.clone()).collect(),
        test: None,
        notes: session.notes().to_vec(),
        rates: session.rates().to_vec(),
    }
}

/// Whether a run was made of this configuration and these data, with this arithmetic.
pub(super) fn inputs(receipt: &Receipt, session: &Session, text: &str) -> Result<(), RunError> {
    let data = session.data();
    if receipt.arithmetic == ARITHMETIC && receipt.data.hash != data.hash {
        let (found, wanted) = (data.hash.clone(), receipt.data.hash.clone());
        return Err(RunError::DataChanged { found, wanted });
    }
    untouched(receipt, text)?;
    for (what, wanted, found) in [
        ("address of the run is", &receipt.run, &session.run().to_owned()),
        ("activation tables have", &receipt.tables, &hash::tables(&session.networks())),
    ] {
        if wanted != found {
            let (found, wanted) = (found.clone(), wanted.clone());
            return Err(RunError::ConfigChanged { what, found, wanted });
        }
    }
    let content = |found| Err(FolderError::Content { path: names::RECEIPT.into(), found }.into());
    if receipt.data != *data {
        return content(format!("says that the data has {}, but it has {data}", receipt.data));
    }
    // receipts of earlier programs have none
    if !receipt.rates.is_empty() && receipt.rates != session.rates() {
        return content("says other rates than its configuration gives".into());
    }
    Ok(())
}

/// Whether a receipt speaks of this `config.toml`, in this program's arithmetic.
///
/// # Errors
/// When it does not.
pub fn untouched(receipt: &Receipt, text: &str) -> Result<(), RunError> {
    if receipt.arithmetic != ARITHMETIC {
        return Err(RunError::Arithmetic { found: receipt.arithmetic, wanted: ARITHMETIC });
    }
    let (wanted, found) = (receipt.config.clone(), hash::bytes(text));
    if wanted != found {
        let what = "bytes of config.toml have";
        return Err(RunError::ConfigChanged { what, found, wanted });
    }
    Ok(())
}

/// The records that a receipt speaks of, as they were when it was written.
///
/// # Errors
/// When they are missing, damaged or not those.
pub fn records(path: &Path, receipt: &Receipt) -> Result<Vec<EpochRecord>, RunError> {
    let text = records_text(path, receipt)?;
    let damaged = |found| FolderError::Content { path: path.join(names::METRICS), found };
    let records = folder::parse_metrics(&text).map_err(damaged)?;
    for (record, hash) in records.iter().zip(&receipt.epoch_hashes) {
        if record.state_hash != *hash {
            let found = format!(
                "has another state hash for epoch {} than {}",
                record.epoch,
                names::RECEIPT
            );
            return Err(damaged(found).into());
        }
    }
    Ok(records)
}

/// The text of these records.
pub(super) fn records_text(path: &Path, receipt: &Receipt) -> Result<String, RunError> {
    let damaged = |found| FolderError::Content { path: path.join(names::METRICS), found };
    let text = folder::read_text(path, names::METRICS)?;
    let epochs = receipt.epoch_hashes.len();
    // a kill may have come between the records of later epochs and their receipt
    let end = text.match_indices('\n').nth(epochs.wrapping_sub(1)).map(|(at, _)| at + 1);
    let spoken_of = end.and_then(|end| text.get(..end));
    // but nothing comes behind the last one of a finished run
    if receipt.status == "finished" && end.is_some_and(|end| end < text.len()) {
        let found =
            format!("holds more than the {epochs} records that {} speaks of", names::RECEIPT);
        return Err(damaged(found).into());
    }
    match spoken_of.filter(|text| hash::bytes(text) == receipt.metrics) {
        Some(text) => Ok(text.to_owned()),
        None => {
            let found = format!(
                "does not hold the {epochs} records with the hash {} that {} speaks of",
                receipt.metrics,
                names::RECEIPT
            );
            Err(damaged(found).into())
        }
    }
}

/// Whether a checkpoint is the one that a receipt speaks of: by its state, and where the receipt knows it by its bytes.
pub(super) fn checkpoint(
    path: &Path,
    name: &str,
    receipt: &Receipt,
    epoch: u32,
    (bytes, state): (&[u8], &str),
) -> Result<(), RunError> {
    let damaged = |found| FolderError::Content { path: path.join(name), found };
    let wanted = receipt.epoch_hashes.get(epoch as usize);
    if wanted.is_none_or(|wanted| wanted != state) {
        let found = format!("holds a state of epoch {epoch} that {} does not know", names::RECEIPT);
        return Err(damaged(found).into());
    }
    let best = receipt.best.as_ref().filter(|_| name != names::CHECKPOINT);
    let known = match best {
        Some(best) => Some(&best.checkpoint),
        None => (epoch as usize + 1 == receipt.epoch_hashes.len()).then_some(&receipt.checkpoint),
    };
    if known.is_some_and(|known| *known != hash::bytes(bytes)) {
        return Err(damaged(format!("has other bytes than {} says", names::RECEIPT)).into());
    }
    Ok(())
}

/// Whether a receipt says what follows from the folder.
pub(super) fn same_receipt(
    path: &Path,
    kept: &Receipt,
    expected: &Receipt,
) -> Result<(), RunError> {
    let kept = serde_json::to_value(kept).expect("receipts have a JSON form");
    match difference(&kept, expected) {
        None => Ok(()),
        Some(Difference { place, kept, found }) => {
            let found = format!("says {kept} for `{place}`, but its own files give {found}");
            Err(FolderError::Content { path: path.join(names::RECEIPT), found }.into())
        }
    }
}

/// Where two records differ first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Difference {
    /// Which field, such as `events.training.requested`.
    pub(super) place: String,
    /// What is kept.
    pub(super) kept: String,
    /// What was found.
    pub(super) found: String,
}

/// The first field of a kept record in which another of its kind differs. What the kept one does not have, because the
/// program that wrote it did not know it, says nothing: a record that lacks what it must have cannot be read.
pub(super) fn difference<T: Serialize>(kept: &Value, found: &T) -> Option<Difference> {
    differs("", kept, &serde_json::to_value(found).expect("records have a JSON form"))
}

/// Tables of counts by name. A name that such a table does not have was counted 0 times: there a missing one is wrong
/// unless nothing was counted.
const COUNTS: [&str; 6] = ["events", "cycles", "training", "stages", "busy", "used"];

/// Whether a count, or every count of a table, is 0.
fn is_nothing(value: &Value) -> bool {
    match value {
        Value::Null => true,
        Value::Number(number) => number.as_u64() == Some(0),
        Value::Object(map) => map.values().all(is_nothing),
        _ => false,
    }
}

fn differs(place: &str, kept: &Value, found: &Value) -> Option<Difference> {
    let inside =
        |name: &str| if place.is_empty() { name.into() } else { format!("{place}.{name}") };
    let nothing = Value::String("nothing".into());
    match (kept, found) {
        (Value::Object(kept), Value::Object(found)) => {
            let counted = place.split('.').any(|part| COUNTS.contains(&part));
            let lost = found
                .iter()
                .filter(|(name, value)| counted && !kept.contains_key(*name) && !is_nothing(value));
            let lost = lost.map(|(name, value)| (name, &nothing, value));
            let pairs =
                kept.iter().map(|(name, kept)| (name, kept, found.get(name).unwrap_or(&nothing)));
            pairs
                .chain(lost)
                .filter_map(|(name, kept, found)| differs(&inside(name), kept, found))
                .next()
        }
        (Value::Array(kept), Value::Array(found)) if kept.len() == found.len() => {
            let pairs = kept.iter().zip(found).enumerate();
            pairs.filter_map(|(at, (a, b))| differs(&inside(&at.to_string()), a, b)).next()
        }
        (kept, found) if kept == found => None,
        (kept, found) => {
            let (kept, found) = (kept.to_string(), found.to_string());
            Some(Difference { place: place.into(), kept, found })
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_difference_is_found_at_its_place_and_what_is_unknown_says_nothing() {
        let kept = json!({"a": 1, "b": {"c": [1, null]}});
        assert_eq!(difference(&kept, &json!({"a": 1, "b": {"c": [1, null], "new": 3}})), None);
        let place = |found: &Value| difference(&kept, found).map(|d| (d.place, d.kept, d.found));
        let wanted = |place: &str, kept: &str, found: &str| {
            Some((place.to_owned(), kept.to_owned(), found.to_owned()))
        };
        let counts = |line: Value| json!({"cycles": line});
        let kept_counts = counts(json!({"training": 5}));
        let more = |line| difference(&kept_counts, &counts(line)).map(|d| d.place);
        assert_eq!(more(json!({"training": 5, "evaluation": 0})), None);
        assert_eq!(more(json!({"training": 5, "x": 3})), Some("cycles.x".to_owned()));
        assert_eq!(place(&json!({"a": 2, "b": {"c": [1, null]}})), wanted("a", "1", "2"));
        assert_eq!(place(&json!({"a": 1, "b": {"c": [1, 0]}})), wanted("b.c.1", "null", "0"));
        assert_eq!(place(&json!({"b": {"c": [1, null]}})), wanted("a", "1", "\"nothing\""));
        assert_eq!(place(&json!({"a": 1, "b": {"c": [1]}})), wanted("b.c", "[1,null]", "[1]"));
    }
}
