//! `[device.conductance]` and `[device.wires]`: from ratios and ohms to checked numbers.

use serde::{Deserialize, Serialize};

use super::flaws::{real, scaled};
use crate::chip::device::{CONDUCTANCE_BITS, Conductance, Reference, Wires};
use crate::lab::config::ConfigError;
use crate::lab::config::check::{word, wrong};
use crate::lab::config::file::keys;

keys! {
    /// `[device.conductance]`.
    ConductanceFile {
        /// Conductance of a cell at the ceiling over that at level 0. Levels lie evenly between: level 0 no longer conducts nothing.
        on_off: f64,
        /// What takes off what cells conduct at level 0.
        reference: String,
        /// Where the numbers come from.
        source: String,
        /// How far to trust the numbers.
        kind: String,
    }
    /// `[device.wires]`. Only the ratio of both resistances counts.
    WiresFile {
        /// Resistance of the wire from one cell to the next, along rows and along columns.
        segment_ohm: f64,
        /// Resistance of a cell at the ceiling, with what selects it.
        cell_on_ohm: f64,
        /// Where the numbers come from.
        source: String,
        /// How far to trust the numbers.
        kind: String,
    }
}

type Key<'a> = &'a dyn Fn(&str) -> String;

/// A number that a table cannot do without.
fn given(key: &str, value: Option<f64>, example: &str) -> Result<f64, ConfigError> {
    value.ok_or_else(|| wrong(key, "is missing", format!("give {example}")))
}

/// What level 0 conducts on a chip whose window ends at `ceiling`.
pub(super) fn conductance(
    table: &ConductanceFile,
    ceiling: u16,
    key: Key<'_>,
) -> Result<Conductance, ConfigError> {
    let at = key("device.conductance.on_off");
    let on_off =
        given(&at, table.on_off, "the ratio of the greatest conductance to the least, such as 10")?;
    let on_off = real(&at, on_off, [1.1, 1e9])?;
    let full = u32::from(ceiling) << CONDUCTANCE_BITS;
    let least = (f64::from(full) / (on_off - 1.0) + 0.5).floor() as u32;
    if least == 0 {
        let most = 2 * full;
        let allowed = format!(
            "of {ceiling} levels that is less than half of 2^-8 of a level, which is nothing: give {most} or less, or take the \
             table out"
        );
        return Err(wrong(&at, format!("is {on_off}"), allowed));
    }
    let references = [("none", Reference::None), ("column", Reference::Column)];
    let at = key("device.conductance.reference");
    let reference = word(&at, &mut table.reference.clone(), "none", &references)?;
    Ok(Conductance { least, reference })
}

/// Wires of a chip that computes with currents; `light`: with light.
pub(super) fn wires(table: &WiresFile, light: bool, key: Key<'_>) -> Result<Wires, ConfigError> {
    if light {
        let allowed =
            "drive.mode = \"amplitude\" drives light, which has no wires: take the table out";
        return Err(wrong(&key("device.wires"), "is given", allowed));
    }
    let ohm = |name: &str, value, example| -> Result<(String, f64), ConfigError> {
        let at = key(&format!("device.wires.{name}"));
        let ohm = real(&at, given(&at, value, example)?, [1e-6, 1e15])?;
        Ok((at, ohm))
    };
    let (at, segment) =
        ohm("segment_ohm", table.segment_ohm, "the ohms of a segment, such as 2.5")?;
    let (_, cell) = ohm("cell_on_ohm", table.cell_on_ohm, "the ohms of a cell, such as 1e5")?;
    let ratio = segment / cell;
    if !(1e-12..=1.0).contains(&ratio) {
        let found = format!("is {ratio:e} of device.wires.cell_on_ohm");
        return Err(wrong(&at, found, "a segment has 1e-12 to 1 of the resistance of a cell"));
    }
    let bits = i32::try_from(Wires::SEGMENT_BITS).expect("48");
    Ok(Wires { segment: scaled(ratio, bits) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chip::hardware::Hardware;
    use crate::lab::config::{Sources, load};

    fn hardware(settings: &[&str]) -> Result<Hardware, String> {
        let settings: Vec<String> = settings.iter().map(ToString::to_string).collect();
        let config = load(&Sources { settings: &settings, ..Sources::default() });
        config.map(|config| config.hardware).map_err(|error| error.to_string())
    }

    #[test]
    fn ratios_become_integers() {
        let chip = hardware(&["hw.device.conductance.on_off=11"]).unwrap();
        let wanted = Conductance { least: 6528, reference: Reference::None };
        assert_eq!((chip.conductance, chip.wires), (Some(wanted), None));
        let column = ["hw.device.conductance.on_off=4.5", "hw.device.conductance.reference=column"];
        let chip = hardware(&column).unwrap();
        assert_eq!(
            chip.conductance.unwrap(),
            Conductance { least: 18_651, reference: Reference::Column }
        );
        let wires = ["hw.device.wires.segment_ohm=2.5", "hw.device.wires.cell_on_ohm=1e5"];
        let chip = hardware(&wires).unwrap();
        assert_eq!(chip.wires, Some(Wires { segment: 7_036_874_418 }));
        assert!(hardware(&[]).unwrap().conducting().is_none());
    }

    #[test]
    fn mistakes_name_the_key_and_what_is_allowed() {
        for (settings, wanted) in [
            (
                &["hw.device.conductance.reference=column"][..],
                "`hw.device.conductance.on_off` is missing",
            ),
            (&["hw.device.conductance.on_off=1"], "1.1..=1000000000"),
            (&["hw.device.conductance.on_off=200000"], "give 130560 or less"),
            (
                &["hw.device.conductance.on_off=2", "hw.device.conductance.reference=row"],
                "it is one of none, column",
            ),
            (&["hw.device.wires.segment_ohm=1"], "`hw.device.wires.cell_on_ohm` is missing"),
            (&["hw.device.wires.cell_on_ohm=1"], "`hw.device.wires.segment_ohm` is missing"),
            (
                &["hw.device.wires.segment_ohm=2", "hw.device.wires.cell_on_ohm=1"],
                "is 2e0 of device.wires.cell_on_ohm",
            ),
            (
                &[
                    "hw.device.wires.segment_ohm=1",
                    "hw.device.wires.cell_on_ohm=1e5",
                    "hw.drive.mode=amplitude",
                ],
                "light, which has no wires",
            ),
        ] {
            let error = hardware(settings).unwrap_err();
            assert!(error.contains(wanted), "{settings:?}: {error}");
        }
    }
}
