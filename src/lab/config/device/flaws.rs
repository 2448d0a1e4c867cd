//! What cells and reads do beside a pulse: stuck cells, noise, drift; from shares and deviations to checked numbers.

use serde::{Deserialize, Serialize};

use super::{DeviceFile, currents, fault_list, lasting};
use crate::chip::device::{
    Ageing, Chance, Conductance, Endurance, FaultMap, Faults, Leakage, Programming, ReadNoise,
    Wires,
};
use crate::lab::config::ConfigError;
use crate::lab::config::check::wrong;
use crate::lab::config::file::keys;
use crate::num::tables::{DriftLaw, DriftTables, OfLogarithm};

keys! {
    /// `[device.faults]`: shares of all cells, which add up to at most 1, and a list.
    FaultsFile {
        /// Share of the cells that are stuck at the floor.
        stuck_floor: f64,
        /// Share of the cells that are stuck at the ceiling.
        stuck_ceiling: f64,
        /// Share of the cells that are stuck at any level of the window, each level as often as any other.
        stuck_any: f64,
        /// A CSV file that lists stuck cells, `layer,pathway,row,column,state`, in a file relative to that file; state is a level, `floor` or `ceiling`. Listed cells are stuck on every chip, whatever is drawn.
        map: String,
        /// The same lines in place, as a run keeps them.
        cells: Vec<String>,
        /// Where the numbers come from.
        source: String,
        /// How far to trust the numbers.
        kind: String,
    }
    /// `[device.programming]`.
    ProgrammingFile {
        /// Standard deviation of what a load leaves, in shares of the greatest conductance: coefficients of a polynomial in the conductance as a share of the greatest, the constant first.
        sigma: Vec<f64>,
        /// Where the numbers come from.
        source: String,
        /// How far to trust the numbers.
        kind: String,
    }
    /// `[device.drift]`: by a power of time (`exponent`) or by its logarithm (`change`).
    DriftFile {
        /// Seconds after programming that levels are of, as they are loaded or learnt.
        start_s: f64,
        /// Mean exponent: a number, or slope, offset, least and most of `clamp(slope ln g + offset, least, most)`, g the conductance as a share of the greatest.
        exponent: Vec<f64>,
        /// Its standard deviation from cell to cell, in the same form.
        exponent_spread: Vec<f64>,
        /// Mean change a decade of time, in shares of the greatest conductance.
        change: f64,
        /// Its standard deviation from cell to cell.
        change_spread: f64,
        /// Seconds from one write of an array to the next while a net learns: levels drift meanwhile, each since the write that last pulsed its cell.
        update_s: f64,
        /// Writes of an array from one look to the next: levels are brought to where they have drifted to.
        every: i64,
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
pub(super) fn real(key: &str, found: f64, [least, most]: [f64; 2]) -> Result<f64, ConfigError> {
    if (least..=most).contains(&found) {
        return Ok(found);
    }
    let hint = if found == 0.0 { "; without the key there is none" } else { "" };
    let allowed = format!("it must lie in {least}..={most}{hint}");
    Err(wrong(key, format!("is {found}"), allowed))
}

/// `floor(2^bits x + 1/2)` of a number that was checked.
pub(super) fn scaled(x: f64, bits: i32) -> u64 {
    (x * f64::from(bits).exp2() + 0.5).floor() as u64
}

/// What a chip does beside the ideal.
pub(in crate::lab::config) struct Flaws {
    pub(in crate::lab::config) faults: Faults,
    pub(in crate::lab::config) fault_map: FaultMap,
    pub(in crate::lab::config) conductance: Option<Conductance>,
    pub(in crate::lab::config) wires: Option<Wires>,
    pub(in crate::lab::config) read_noise: Option<ReadNoise>,
    pub(in crate::lab::config) programming: Option<Programming>,
    pub(in crate::lab::config) drift: Option<Retention>,
    pub(in crate::lab::config) endurance: Option<Endurance>,
    pub(in crate::lab::config) leakage: Option<Leakage>,
    pub(in crate::lab::config) ageing: Option<Ageing>,
}

/// How levels drift, and since when.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Retention {
    law: DriftLaw,
    start_s: f64,
}

impl Retention {
    /// Tables for so many seconds after programming, of levels up to `greatest` on a chip of that ceiling; none before its start.
    #[must_use]
    pub fn after(&self, seconds: f64, ends: [u16; 2]) -> Option<DriftTables> {
        let ratio = seconds / self.start_s;
        (1.0..=1e30).contains(&ratio).then(|| DriftTables::new(self.law, ends, ratio))
    }

    /// Seconds after programming that levels are of.
    #[must_use]
    pub const fn start_s(&self) -> f64 {
        self.start_s
    }
}

/// Checks `[device]` of a chip whose window ends at `ceiling`; `light`: it computes with light. `key` puts the place of a table before a
/// name.
pub(in crate::lab::config) fn flaws(
    device: Option<&DeviceFile>,
    (ceiling, light): (u16, bool),
    key: &dyn Fn(&str) -> String,
) -> Result<Flaws, ConfigError> {
    let none = DeviceFile::default();
    let DeviceFile {
        response: _,
        spread: _,
        faults,
        conductance,
        wires,
        read_noise,
        programming,
        drift,
        endurance,
        leakage,
    } = device.unwrap_or(&none);
    let faults = faults.as_ref().map(|table| stuck(table, key)).transpose()?;
    let (faults, fault_map) = faults.unwrap_or((Faults::NONE, FaultMap::default()));
    let conductance = conductance.as_ref();
    let conductance = conductance.map(|table| currents::conductance(table, ceiling, key));
    let wires = wires.as_ref().map(|table| currents::wires(table, light, key)).transpose()?;
    Ok(Flaws {
        faults,
        fault_map,
        conductance: conductance.transpose()?,
        wires,
        read_noise: read_noise.as_ref().map(|table| noise(table, key)).transpose()?,
        programming: programming.as_ref().map(|table| loads(table, key)).transpose()?,
        drift: drift.as_ref().map(|table| retention(table, key)).transpose()?,
        endurance: endurance.as_ref().map(|table| lasting::endurance(table, key)).transpose()?,
        leakage: leakage.as_ref().map(|table| lasting::leakage(table, key)).transpose()?,
        ageing: drift.as_ref().map_or(Ok(None), |table| lasting::ageing(table, key))?,
    })
}

fn loads(
    table: &ProgrammingFile,
    key: &dyn Fn(&str) -> String,
) -> Result<Programming, ConfigError> {
    let at = key("device.programming.sigma");
    let sigma = table.sigma.as_deref().unwrap_or_default();
    if !(1..=4).contains(&sigma.len()) || sigma.iter().all(|c| *c == 0.0) {
        let allowed =
            "give 1 to 4 numbers, not all 0, such as [0.01]: a polynomial in the conductance";
        return Err(wrong(&at, format!("has {} coefficients", sigma.len()), allowed));
    }
    let mut coefficients = [0; 4];
    for (to, &c) in coefficients.iter_mut().zip(sigma) {
        let size = real(&at, c.abs(), [0.0, 4.0])?;
        *to = scaled(size, 24).cast_signed() * if c < 0.0 { -1 } else { 1 };
    }
    Ok(Programming { coefficients })
}

fn retention(table: &DriftFile, key: &dyn Fn(&str) -> String) -> Result<Retention, ConfigError> {
    let key = |name: &str| key(&format!("device.drift.{name}"));
    let Some(start_s) = table.start_s else {
        let allowed = "give the seconds after programming that levels are of, such as 20.0";
        return Err(wrong(&key("start_s"), "is missing", allowed));
    };
    let start_s = real(&key("start_s"), start_s, [1e-9, 1e12])?;
    let of_logarithm = |name: &str, numbers: &[f64], most: f64| {
        let ends = |x: f64| real(&key(name), x, [0.0, most]);
        match *numbers {
            [x] => {
                let x = ends(x)?;
                Ok(OfLogarithm { slope: 0.0, offset: x, least: x, most: x })
            }
            [slope, offset, least, greatest] if least <= greatest => {
                for x in [slope, offset] {
                    real(&key(name), x.abs(), [0.0, 100.0])?;
                }
                Ok(OfLogarithm { slope, offset, least: ends(least)?, most: ends(greatest)? })
            }
            _ => {
                let found = format!("has {} numbers", numbers.len());
                let allowed = "give one number, or slope, offset, least and most of clamp(slope ln g + offset, least, \
                               most)";
                Err(wrong(&key(name), found, allowed))
            }
        }
    };
    let law = match (&table.exponent, table.change) {
        (Some(exponent), None) => {
            if table.change_spread.is_some() {
                let allowed = "a power of time has exponent_spread";
                return Err(wrong(&key("change_spread"), "is given", allowed));
            }
            let spread = table.exponent_spread.as_deref().unwrap_or(&[0.0]);
            DriftLaw::Power {
                exponent: of_logarithm("exponent", exponent, 10.0)?,
                spread: of_logarithm("exponent_spread", spread, 10.0)?,
            }
        }
        (None, Some(change)) => {
            if table.exponent_spread.is_some() {
                let allowed = "a logarithm of time has change_spread";
                return Err(wrong(&key("exponent_spread"), "is given", allowed));
            }
            real(&key("change"), change.abs(), [0.0, 1.0])?;
            let spread =
                real(&key("change_spread"), table.change_spread.unwrap_or(0.0), [0.0, 1.0])?;
            DriftLaw::Log { change, spread }
        }
        (both, _) => {
            let found = if both.is_some() { "is given beside `exponent`" } else { "is missing" };
            let allowed = "levels drift by a power of time (exponent) or by its logarithm (change): give one of them";
            return Err(wrong(&key("change"), found, allowed));
        }
    };
    Ok(Retention { law, start_s })
}

fn stuck(
    table: &FaultsFile,
    key: &dyn Fn(&str) -> String,
) -> Result<(Faults, FaultMap), ConfigError> {
    let share = |name: &str, found: Option<f64>| -> Result<Chance, ConfigError> {
        let Some(found) = found else { return Ok(Chance::NEVER) };
        let share = real(&key(&format!("device.faults.{name}")), found, [1e-9, 1.0])?;
        Ok(Chance::new(scaled(share, 32)).expect("at most 1"))
    };
    let faults = Faults {
        floor: share("stuck_floor", table.stuck_floor)?,
        ceiling: share("stuck_ceiling", table.stuck_ceiling)?,
        any: share("stuck_any", table.stuck_any)?,
    };
    let cells = table.cells.as_deref();
    let map = cells.map(|cells| fault_list::of_cells(&key("device.faults.cells"), cells));
    let map = map.transpose()?.unwrap_or_default();
    if faults.is_none() && map.is_empty() {
        let allowed = "give stuck_floor, stuck_ceiling, stuck_any or a map, or take the table out";
        return Err(wrong(&key("device.faults"), "has no share of stuck cells", allowed));
    }
    Ok((faults, map))
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
            (&["hw.device.programming.sigma=[0.0]"], "`hw.device.programming.sigma` has 1 coeff"),
            (&["hw.device.programming.sigma=[5.0]"], "`hw.device.programming.sigma` is 5"),
            (&["hw.device.drift.exponent=[0.05]"], "`hw.device.drift.start_s` is missing"),
            (&["hw.device.drift.start_s=20"], "`hw.device.drift.change` is missing"),
            (
                &["hw.device.drift.start_s=20", "hw.device.drift.exponent=[0.05, 1]"],
                "`hw.device.drift.exponent` has 2 numbers",
            ),
            (
                &[
                    "hw.device.drift.start_s=20",
                    "hw.device.drift.exponent=[0.05]",
                    "hw.device.drift.change=0.1",
                ],
                "is given beside `exponent`",
            ),
            (
                &[
                    "hw.device.drift.start_s=20",
                    "hw.device.drift.exponent=[0.05]",
                    "hw.device.drift.change_spread=0.1",
                ],
                "a power of time has exponent_spread",
            ),
        ] {
            let error = hardware(settings).unwrap_err();
            assert!(error.contains(wanted), "{settings:?}: {error}");
        }
    }
}
