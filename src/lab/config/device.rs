//! `[device]`: from shares and deviations to checked numbers.

use serde::{Deserialize, Serialize};

use super::ConfigError;
use super::file::keys;
use crate::chip::device::DeviceSpec;
use crate::chip::hardware::Window;

mod response;

pub(super) use response::{ResponseFile, SpreadFile};

keys! {
    /// `[device]`.
    DeviceFile {
        /// What a pulse does to a cell.
        response: ResponseFile,
        /// How cells differ.
        spread: SpreadFile,
    }
}

/// Checks `[device]` of a chip with that window. `key` puts the place of a table before a name.
pub(super) fn resolve(
    device: Option<&DeviceFile>,
    window: Window,
    key: &dyn Fn(&str) -> String,
) -> Result<Option<DeviceSpec>, ConfigError> {
    let Some(DeviceFile { response, spread }) = device else { return Ok(None) };
    response::resolve(response.as_ref(), spread.as_ref(), window, key)
}
