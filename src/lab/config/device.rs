//! `[device]`: from shares and deviations to checked numbers.

use serde::{Deserialize, Serialize};

use super::ConfigError;
use super::check::wrong;
use super::file::keys;
use crate::chip::device::{Chance, Faults, ReadNoise};

keys! {
    /// `[device]`.
    DeviceFile {
        /// Cells that hold one level.
        faults: FaultsFile,
        /// Noise of conversions.
        read_noise: ReadNoiseFile,
    }
    /// `[device.faults]`: shares of all cells, which add up to at most 1.
    FaultsFile {
        /// Share of the cells that are stuck at the floor.
        stuck_floor: f64,
        /// Share of the cells that are stuck at the ceiling.
        stuck_ceiling: f64,
        /// Share of the cells that are stuck at any level of the window, each level as often as any other.
        stuck_any: f64,
        /// Where the numbers come from.
        source: String,
        /// How far to trust the numbers.
        kind: String,
    }
    /// `[device.read_noise]`.
    ReadNoiseFile {
        /// Standard deviation of a conversion, in currents of one cell at the ceiling under the greatest slice of a drive.
        sigma_cells: f64,
        /// Where the numbers come from.
        source: String,
        /// How far to trust the numbers.
        kind: String,
    }
}

/// A number between two ends.
fn real(key: &str, found: f64, [least, most]: [f64; 2]) -> Result<f64, ConfigError> {
    if (least..=most).contains(&found) {
        return Ok(found);
    }
    let hint = if found == 0.0 { "; without the key there is none" } else { "" };
    let allowed = format!("it must lie in {least}..={most}{hint}");
    Err(wrong(key, format!("is {found}"), allowed))
}

/// `floor(2^bits x + 1/2)` of a number that was checked.
fn scaled(x: f64, bits: i32) -> u64 {
    (x * f64::from(bits).exp2() + 0.5).floor() as u64
}

/// Checks `[device]`. `key` puts the place of a table before a name.
pub(super) fn resolve(
    device: Option<&DeviceFile>,
    key: &dyn Fn(&str) -> String,
) -> Result<(Faults, Option<ReadNoise>), ConfigError> {
    let Some(DeviceFile { faults, read_noise }) = device else { return Ok((Faults::NONE, None)) };
    let faults = faults.as_ref().map(|table| stuck(table, key)).transpose()?;
    let noise = read_noise.as_ref().map(|table| noise(table, key)).transpose()?;
    Ok((faults.unwrap_or(Faults::NONE), noise))
}

fn stuck(table: &FaultsFile, key: &dyn Fn(&str) -> String) -> Result<Faults, ConfigError> {
    let share = |name: &str, found: Option<f64>| {
        let Some(found) = found else { return Ok(Chance::NEVER) };
        let share = real(&key(&format!("device.faults.{name}")), found, [1e-9, 1.0])?;
        Ok(Chance::new(scaled(share, 32)).expect("at most 1"))
    };
    let faults = Faults {
        floor: share("stuck_floor", table.stuck_floor)?,
        ceiling: share("stuck_ceiling", table.stuck_ceiling)?,
        any: share("stuck_any", table.stuck_any)?,
    };
    if faults.is_none() {
        let allowed = "give stuck_floor, stuck_ceiling or stuck_any, or take the table out";
        return Err(wrong(&key("device.faults"), "has no share of stuck cells", allowed));
    }
    Ok(faults)
}

fn noise(table: &ReadNoiseFile, key: &dyn Fn(&str) -> String) -> Result<ReadNoise, ConfigError> {
    let at = key("device.read_noise.sigma_cells");
    let Some(sigma) = table.sigma_cells else {
        let allowed = "give the standard deviation of a conversion, such as 0.1";
        return Err(wrong(&at, "is missing", allowed));
    };
    let sigma = scaled(real(&at, sigma, [1e-4, 16.0])?, 16);
    Ok(ReadNoise { sigma: u32::try_from(sigma).expect("at most 2^20") })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::config::{Sources, load};

    fn hardware(settings: &[&str]) -> Result<crate::chip::hardware::Hardware, String> {
        let settings: Vec<String> = settings.iter().map(ToString::to_string).collect();
        let config = load(&Sources { settings: &settings, ..Sources::default() });
        config.map(|config| config.hardware).map_err(|error| error.to_string())
    }

    #[test]
    fn shares_and_deviations_become_integers() {
        let chip =
            hardware(&["hw.device.faults.stuck_floor=0.25", "hw.device.faults.stuck_any=1e-9"]);
        let faults = chip.unwrap().faults;
        assert_eq!([faults.floor, faults.ceiling, faults.any].map(Chance::get), [1 << 30, 0, 4]);
        let chip = hardware(&["hw.device.read_noise.sigma_cells=0.5"]).unwrap();
        assert_eq!(chip.read_noise, Some(ReadNoise { sigma: 1 << 15 }));
        let chip = hardware(&[]).unwrap();
        assert!(chip.faults.is_none() && chip.read_noise.is_none());
    }

    #[test]
    fn mistakes_name_the_key_and_what_is_allowed() {
        for (settings, wanted) in [
            (&["hw.device.faults.stuck_floor=0"][..], "without the key there is none"),
            (&["hw.device.faults.stuck_floor=1.5"], "`hw.device.faults.stuck_floor` is 1.5"),
            (
                &["hw.device.faults.stuck_floor=0.6", "hw.device.faults.stuck_any=0.6"],
                "`hw.device.faults` make more than all cells",
            ),
            (&["hw.device.faults.source=\"s\""], "has no share of stuck cells"),
            (
                &["hw.device.read_noise.kind=assumed"],
                "`hw.device.read_noise.sigma_cells` is missing",
            ),
            (&["hw.device.read_noise.sigma=1"], "unknown field `sigma`"),
        ] {
            let error = hardware(settings).unwrap_err();
            assert!(error.contains(wanted), "{settings:?}: {error}");
        }
    }
}
