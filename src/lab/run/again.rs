//! Reading a run again: its configuration, its address, and the state that its result is of.

use std::path::Path;

use super::session::chosen;
use super::{Machine, RunError, Session, proof};
use crate::lab::config::{self, Config, Select, Sources};
use crate::lab::data::{self, DataRoot};
use crate::lab::store::address;
use crate::lab::store::folder::{self, FolderError, RunFolder, names};
use crate::lab::store::record::{DataRecord, Receipt, TestOutcome};

/// The configuration a run was made with, and its text.
pub(super) fn read_config(path: &Path) -> Result<(Config, String), RunError> {
    let text = folder::read_text(path, names::CONFIG)?;
    let name = path.join(names::CONFIG).display().to_string();
    let sources = Sources { experiment: Some((&name, &text)), ..Sources::default() };
    Ok((config::load(&sources)?, text))
}

/// The configuration a run was made with, and its text.
///
/// # Errors
/// When it is missing or damaged.
pub fn configuration(path: &Path) -> Result<(Config, String), RunError> {
    read_config(path)
}

/// The address that a run folder's configuration has with these data.
///
/// # Errors
/// When the configuration is missing, damaged, or does not fit the data.
pub fn address_of(path: &Path, data: &DataRecord) -> Result<String, RunError> {
    let (config, _) = read_config(path)?;
    Ok(address::key(config.given(data.features, data.classes, data.image)?, &data.hash))
}

/// Brings a session to a state of a run; gives the bytes of that state.
pub(super) fn restore(session: &mut Session, path: &Path, name: &str) -> Result<Vec<u8>, RunError> {
    let bytes = folder::read_checkpoint(path, name)?;
    session.restore(&bytes).map_err(|error| RunError::Checkpoint {
        path: path.join(name).display().to_string(),
        error,
    })?;
    Ok(bytes)
}

/// Reads the test set with the chosen state of a run.
///
/// See [`train`](crate::train()) for an example.
///
/// # Errors
/// When the run is damaged or its data is not the same.
pub fn evaluate(
    path: &Path,
    data_root: &DataRoot,
    machine: Machine,
) -> Result<(TestOutcome, String), RunError> {
    let (mut session, receipt) = read_again(path, data_root, machine)?;
    let hint = "there is nothing to evaluate on";
    let test = session.test()?.ok_or(RunError::Empty { part: "test", hint })?;
    if receipt.test.as_ref().is_some_and(|kept| *kept != test) {
        let found = "has another test result than its own state gives".into();
        return Err(FolderError::Content { path: path.join(names::RECEIPT), found }.into());
    }
    let state = receipt.epoch_hashes[session.epoch() as usize].clone();
    Ok((test, state))
}

/// A session with the chosen state of a run, and its receipt, which knows that state.
pub(super) fn read_again(
    path: &Path,
    data_root: &DataRoot,
    machine: Machine,
) -> Result<(Session, Receipt), RunError> {
    let (config, text) = read_config(path)?;
    let mut session = Session::new(&config, data::load(&config.source()?, data_root)?, machine)?;
    let receipt = folder::read_receipt(path)?;
    proof::inputs(&receipt, &session, &text)?;
    let records = proof::records(path, &receipt)?;
    let best = chosen(config.select, &records).filter(|_| config.select == Select::BestValidation);
    if best != receipt.best.as_ref().map(|best| best.epoch) {
        let found = "names another best state than its records do".into();
        return Err(FolderError::Content { path: path.join(names::RECEIPT), found }.into());
    }
    let name = best.map_or_else(|| names::CHECKPOINT.to_owned(), RunFolder::best_name);
    let name = &*name;
    let bytes = restore(&mut session, path, name)?;
    let state = session.state_hash();
    let epoch = session.epoch();
    proof::checkpoint(path, name, &receipt, epoch, (&bytes, &state))?;
    Ok((session, receipt))
}
