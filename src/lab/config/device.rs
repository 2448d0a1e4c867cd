//! `[device]`: from shares and deviations to checked numbers.

use serde::{Deserialize, Serialize};

use super::ConfigError;
use super::check::wrong;
use super::file::keys;
use crate::chip::device::DeviceSpec;
use crate::chip::hardware::Window;

mod currents;
mod fault_list;
mod flaws;
mod lasting;
mod response;

pub(super) use fault_list::listed;

pub(super) use currents::{ConductanceFile, WiresFile};
pub use flaws::Retention;
pub(super) use flaws::{DriftFile, FaultsFile, ProgrammingFile, ReadNoiseFile, flaws};
pub(super) use lasting::{EnduranceFile, LeakageFile};
pub(super) use response::{ResponseFile, SpreadFile};

keys! {
    /// `[device]`.
    DeviceFile {
        /// What a pulse does to a cell.
        response: ResponseFile,
        /// How cells differ.
        spread: SpreadFile,
        /// Cells that hold one level.
        faults: FaultsFile,
        /// What cells conduct at level 0.
        conductance: ConductanceFile,
        /// What wires take.
        wires: WiresFile,
        /// Noise of conversions.
        read_noise: ReadNoiseFile,
        /// Noise of loads.
        programming: ProgrammingFile,
        /// What time does to levels, between programming and reading (`dalean eval --after`).
        drift: DriftFile,
        /// How many pulses cells take.
        endurance: EnduranceFile,
        /// What volatile cells forget while they learn.
        leakage: LeakageFile,
    }
}

/// Reads the list of stuck cells that is named, and keeps it in its place. `key` puts the place of a table before a name.
pub(super) fn keep_lists(
    device: Option<&mut DeviceFile>,
    key: &dyn Fn(&str) -> String,
) -> Result<(), ConfigError> {
    let Some(faults) = device.and_then(|device| device.faults.as_mut()) else { return Ok(()) };
    let Some(path) = faults.map.take() else { return Ok(()) };
    let at = key("device.faults.map");
    if faults.cells.is_some() {
        let allowed = "cells are listed by the file or in place: remove one of them";
        return Err(wrong(&at, "is given beside `cells`", allowed));
    }
    faults.cells = Some(fault_list::read(&at, &path)?);
    Ok(())
}

/// Tries are those of verified pulses.
pub(super) fn check_tries(
    device: Option<&DeviceFile>,
    verified: bool,
    key: &dyn Fn(&str) -> String,
) -> Result<(), ConfigError> {
    let tries = device.and_then(|device| device.response.as_ref()?.tries);
    let Some(tries) = tries.filter(|_| !verified) else { return Ok(()) };
    let allowed = "pulses are not verified: set timing.verify, or remove the key";
    Err(wrong(&key("device.response.tries"), format!("is {tries}"), allowed))
}

/// Checks `[device]` of a chip with that window. `key` puts the place of a table before a name.
pub(super) fn resolve(
    device: Option<&DeviceFile>,
    window: Window,
    key: &dyn Fn(&str) -> String,
) -> Result<Option<DeviceSpec>, ConfigError> {
    let Some(DeviceFile { response, spread, .. }) = device else { return Ok(None) };
    response::resolve(response.as_ref(), spread.as_ref(), window, key)
}
