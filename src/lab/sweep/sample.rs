//! Doing some runs of a store again, to see whether its numbers hold.

use super::row::row;
use super::{Row, SweepError};
use crate::lab::data::DataRoot;
use crate::lab::run::{self, Machine, Progress, Verdict};
use crate::lab::store::index::Store;

/// A run that was done again.
#[derive(Debug)]
pub struct Sampled {
    /// Which.
    pub key: String,
    /// What doing it again showed.
    pub verdict: Verdict,
}

/// Draws `count` finished runs by the number `seed` and does each again: its row in the index must be what its folder
/// says, its folder must be that of its key, and every state hash and the test must come out the same. Gives the number
/// of runs done again.
///
/// # Errors
/// When a folder is missing or damaged, data is not the same, or the caller stops it.
pub fn sample(
    store: &Store,
    count: usize,
    seed: u64,
    root: &DataRoot,
    machine: Machine,
    on_run: &mut dyn FnMut(usize, &Sampled),
    on_batch: &mut (dyn FnMut(Progress) -> bool + Send),
) -> Result<usize, SweepError> {
    let rows = store.rows()?;
    let mut order: Vec<_> = rows
        .iter()
        .map(|(key, text, _)| {
            let mut hash = blake3::Hasher::new();
            hash.update(&seed.to_le_bytes()).update(key.as_bytes());
            (*hash.finalize().as_bytes(), key, text)
        })
        .collect();
    order.sort();
    order.truncate(count);
    let runs = order.len();
    for (number, (_, key, text)) in order.into_iter().enumerate() {
        let path = store.folder(key);
        let (found, _) = row(&path)?;
        let kept: Option<Row> = serde_json::from_str(text).ok();
        let address = super::merge::address_of(&path)?;
        let verdict = if address != *key {
            let what = format!("the key of {}", path.display());
            Verdict::Different { what, wanted: key.clone(), found: address }
        } else if let Some(place) = kept
            .as_ref()
            .map_or(Some("which cannot be read"), |kept| kept.disagreement(&found, true))
        {
            let what = format!("the row of run {key} in the index, {place},");
            Verdict::Different { what, wanted: text.clone(), found: found.to_json() }
        } else {
            run::verify(&path, root, machine, None, on_batch)?
        };
        on_run(number + 1, &Sampled { key: key.clone(), verdict });
    }
    Ok(runs)
}
