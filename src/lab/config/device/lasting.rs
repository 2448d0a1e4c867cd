//! `[device.endurance]`, `[device.leakage]` and what of `[device.drift]` belongs to learning: from pulses, lifetimes and seconds to checked
//! numbers.

use serde::{Deserialize, Serialize};

use super::flaws::{DriftFile, real};
use super::response::millionths;
use crate::chip::device::{Ageing, Endurance, Leakage, Worn};
use crate::lab::config::ConfigError;
use crate::lab::config::check::{word, wrong};
use crate::lab::config::file::keys;
use crate::num::fixed::Millionths;
use crate::num::tables::DriftRates;

keys! {
    /// `[device.endurance]`.
    EnduranceFile {
        /// Pulses that a cell takes before it moves no more: of the cell in the middle, where they differ. A load counts as a pulse.
        pulses: f64,
        /// Standard deviation of the logarithm of that number, from cell to cell.
        spread: f64,
        /// Where a cell stays that is worn out.
        worn: String,
        /// Where the numbers come from.
        source: String,
        /// How far to trust the numbers.
        kind: String,
    }
    /// `[device.leakage]`.
    LeakageFile {
        /// Writes of an array after which a cell that is not pulsed has lost 1 - 1/e of its distance to where it rests.
        lifetime: f64,
        /// Writes of an array from one look to the next: what was lost in between is taken off at once.
        every: i64,
        /// Where cells come to rest: 0 is the floor, 1 the ceiling of a cell.
        rest: f64,
        /// Standard deviation of what is lost, from cell to cell, in parts of the mean.
        spread: f64,
        /// Where the numbers come from.
        source: String,
        /// How far to trust the numbers.
        kind: String,
    }
}

type Key<'a> = &'a dyn Fn(&str) -> String;

/// A share that is 0 where the key is missing.
fn share(key: &str, found: Option<f64>, most: f64) -> Result<Millionths, ConfigError> {
    found.map_or(Ok(Millionths(0)), |found| millionths(key, real(key, found, [1e-6, most])?))
}

/// How many pulses cells take.
pub(super) fn endurance(table: &EnduranceFile, key: Key<'_>) -> Result<Endurance, ConfigError> {
    let at = key("device.endurance.pulses");
    let Some(pulses) = table.pulses else {
        return Err(wrong(&at, "is missing", "give the pulses that a cell takes, such as 1e6"));
    };
    let pulses = real(&at, pulses, [1.0, f64::from(u32::MAX)])?;
    if pulses.fract() != 0.0 {
        return Err(wrong(&at, format!("is {pulses}"), "pulses are whole"));
    }
    let at = key("device.endurance.worn");
    let stays = [("level", Worn::Level), ("floor", Worn::Floor), ("ceiling", Worn::Ceiling)];
    Ok(Endurance {
        pulses: pulses as u32,
        spread: share(&key("device.endurance.spread"), table.spread, 2.0)?,
        worn: word(&at, &mut table.worn.clone(), "level", &stays)?,
    })
}

/// How cells forget.
pub(super) fn leakage(table: &LeakageFile, key: Key<'_>) -> Result<Leakage, ConfigError> {
    let at = key("device.leakage.lifetime");
    let Some(lifetime) = table.lifetime else {
        let allowed = "give the writes in which a cell forgets, such as 1e6";
        return Err(wrong(&at, "is missing", allowed));
    };
    let lifetime = real(&at, lifetime, [0.1, 1e11])?;
    let every = looks(&key("device.leakage.every"), table.every, Leakage::EVERY_MAX)?;
    let kept = libm::exp(-f64::from(every) / lifetime);
    let lost = ((1.0 - kept) * 4_294_967_296.0 + 0.5).floor();
    if lost < 1.0 {
        let allowed = format!(
            "in {every} writes a cell would lose less than 2^-33: look less often, or take the table out"
        );
        return Err(wrong(&at, format!("is {lifetime}"), allowed));
    }
    Ok(Leakage {
        lost: lost.min(f64::from(u32::MAX)) as u32,
        every,
        rest: share(&key("device.leakage.rest"), table.rest, 1.0)?,
        spread: share(&key("device.leakage.spread"), table.spread, 1.0)?,
    })
}

/// How levels drift while a net learns, if they do. The table was checked as a law of drift.
pub(super) fn ageing(table: &DriftFile, key: Key<'_>) -> Result<Option<Ageing>, ConfigError> {
    let key = |name: &str| key(&format!("device.drift.{name}"));
    let Some(update_s) = table.update_s else {
        if let Some(every) = table.every {
            let allowed = "levels do not drift while a net learns: give device.drift.update_s, or remove the key";
            return Err(wrong(&key("every"), format!("is {every}"), allowed));
        }
        return Ok(None);
    };
    let update_s = real(&key("update_s"), update_s, [1e-12, 1e12])?;
    let every = looks(&key("every"), table.every, Ageing::EVERY_MAX)?;
    let start_s = table.start_s.expect("checked before");
    let since = libm::floor(libm::log2(update_s / start_s) * 65_536.0 + 0.5) as i64;
    let four = |name: &str, given: Option<&Vec<f64>>| -> Result<[Millionths; 4], ConfigError> {
        let fine = |x: f64| millionths(&key(name), x);
        Ok(match given.map_or(&[0.0][..], Vec::as_slice) {
            [slope, offset, least, most] => {
                [fine(*slope)?, fine(*offset)?, fine(*least)?, fine(*most)?]
            }
            [x, ..] => [Millionths(0), fine(*x)?, fine(*x)?, fine(*x)?],
            [] => [Millionths(0); 4],
        })
    };
    let rates = match table.change {
        Some(change) => DriftRates::Log([
            millionths(&key("change"), change)?,
            millionths(&key("change_spread"), table.change_spread.unwrap_or(0.0))?,
        ]),
        None => DriftRates::Power([
            four("exponent", table.exponent.as_ref())?,
            four("exponent_spread", table.exponent_spread.as_ref())?,
        ]),
    };
    Ok(Some(Ageing { rates, since, every }))
}

/// Writes from one look to the next.
fn looks(key: &str, found: Option<i64>, most: u32) -> Result<u32, ConfigError> {
    let found = found.unwrap_or(100);
    let every = u32::try_from(found).ok().filter(|every| (1..=most).contains(every));
    every.ok_or_else(|| wrong(key, format!("is {found}"), format!("it must lie in 1..={most}")))
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
    fn pulses_and_lifetimes_become_integers() {
        let chip = hardware(&["hw.device.endurance.pulses=1e6", "hw.device.endurance.spread=0.5"]);
        let (spread, worn) = (Millionths(500_000), Worn::Level);
        assert_eq!(chip.unwrap().endurance, Some(Endurance { pulses: 1_000_000, spread, worn }));
        let chip =
            hardware(&["hw.device.leakage.lifetime=100", "hw.device.leakage.rest=0.5"]).unwrap();
        let leakage = chip.leakage.unwrap();
        // 2^32 (1 - 1/e)
        assert_eq!((leakage.lost, leakage.every), (2_714_937_127, 100));
        assert_eq!(leakage.rest, Millionths(500_000));
        let chip = hardware(&[
            "hw.device.drift.start_s=20",
            "hw.device.drift.exponent=[0.05]",
            "hw.device.drift.update_s=5",
            "hw.device.drift.every=7",
        ]);
        let [none, nu] = [0, 50_000].map(Millionths);
        let rates = DriftRates::Power([[none, nu, nu, nu], [none; 4]]);
        let since = -2 << 16;
        assert_eq!(chip.unwrap().ageing, Some(Ageing { rates, since, every: 7 }));
        let quick = hardware(&["hw.device.leakage.lifetime=0.1", "hw.device.leakage.every=1000"]);
        assert_eq!(quick.unwrap().leakage.unwrap().lost, u32::MAX);
    }

    #[test]
    fn mistakes_name_the_key_and_what_is_allowed() {
        for (settings, wanted) in [
            (&["hw.device.endurance.worn=floor"][..], "`hw.device.endurance.pulses` is missing"),
            (&["hw.device.endurance.pulses=0"], "`hw.device.endurance.pulses` is 0"),
            (&["hw.device.endurance.pulses=1.5"], "pulses are whole"),
            (
                &["hw.device.endurance.pulses=10", "hw.device.endurance.worn=gone"],
                "`hw.device.endurance.worn` is \"gone\"",
            ),
            (&["hw.device.leakage.every=3"], "`hw.device.leakage.lifetime` is missing"),
            (&["hw.device.leakage.lifetime=1e11", "hw.device.leakage.every=1"], "look less often"),
            (
                &["hw.device.leakage.lifetime=10", "hw.device.leakage.rest=1.5"],
                "`hw.device.leakage.rest` is 1.5",
            ),
            (
                &[
                    "hw.device.drift.start_s=20",
                    "hw.device.drift.exponent=[0.05]",
                    "hw.device.drift.every=3",
                ],
                "give device.drift.update_s",
            ),
            (
                &[
                    "hw.device.drift.start_s=20",
                    "hw.device.drift.exponent=[0.05]",
                    "hw.device.drift.update_s=1",
                    "hw.device.leakage.lifetime=1000",
                ],
                "`hw.device.drift.update_s` is given beside device.leakage",
            ),
            (
                &["hw.device.leakage.lifetime=10", "hw.device.leakage.every=0"],
                "`hw.device.leakage.every` is 0",
            ),
        ] {
            let error = hardware(settings).unwrap_err();
            assert!(error.contains(wanted), "{settings:?}: {error}");
        }
    }
}
