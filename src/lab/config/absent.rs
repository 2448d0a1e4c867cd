//! What real chips do and this program does not simulate: one table, for every chip alike.
//!
//! A model file adds the figures of its chip under `[not_simulated]`; it cannot leave a line out. A later step that
//! simulates an effect takes its line away.

use serde::Serialize;

use super::Config;
use crate::chip::device::{CellSpread, PulseNoise};

/// Which chips have an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Substrate {
    /// All of them.
    Any,
    /// Those that compute with currents in wires.
    Electronic,
    /// Those that compute with light.
    Optical,
}

/// Something that real chips do and the engine does not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Effect {
    /// Its key under `[not_simulated]`.
    pub key: &'static str,
    /// What real chips have.
    pub real: &'static str,
    /// What is simulated in its place.
    pub instead: &'static str,
    of: Substrate,
}

macro_rules! effects {
    ($($of:ident $key:literal, $real:literal, $instead:literal;)*) => {
        &[$(Effect { key: $key, real: $real, instead: $instead, of: Substrate::$of },)*]
    };
}

/// The effects: writes, storage, reads, and what surrounds the tiles.
#[rustfmt::skip]
pub const EFFECTS: &[Effect] = effects![
    Any "write_nonlinearity", "steps that depend on level and direction", "pulses move a cell by exactly the levels asked for, inside its window";
    Any "unidirectional", "cells that move in small steps one way only", "steps up and down are alike";
    Any "cycle_to_cycle", "steps that vary from pulse to pulse", "every pulse does the same";
    Any "device_to_device", "cells that differ in step, range and response", "all cells are alike";
    Any "programming_noise", "loads that miss their level", "loads are exact";
    Any "write_failure", "pulses that fail, verified writes that do not end", "a verified pulse takes its time and is always right";
    Any "write_disturb", "pulses that move neighbours on the same line", "a pulse reaches its own cell alone";
    Any "stuck_cells", "cells that no pulse moves", "every cell works";
    Any "endurance", "cells that wear out", "cells take any number of pulses";
    Any "drift", "levels that drift, relax or are lost with time", "a level stays as it was written";
    Any "read_noise", "noise of cells, lines, amplifiers and light", "reads are free of noise";
    Any "read_nonlinearity", "currents that are not in proportion to drive and level", "a current is the exact product";
    Any "on_off", "a lowest level that still conducts", "level 0 conducts nothing";
    Electronic "ir_drop", "voltage lost along wires, sneak currents", "wires have no resistance";
    Any "settling", "currents that have not settled when they are sampled", "a read has settled after the cycles the model gives";
    Any "converter_errors", "offset, gain error, non-linearity and noise of converters and drivers", "converters and drivers are exact but for bits and range";
    Any "temperature", "temperature and supply that vary", "temperature and supply are constant";
    Optical "loss", "light lost in couplers, crossings and cells", "no light is lost";
    Optical "wavelength_crosstalk", "colours that leak into one another", "colours do not leak";
    Optical "thermal_crosstalk", "heaters that warm their neighbours", "a heater warms its own cell only";
    Any "input_transport", "time and energy of images and answers beyond the tiles", "images arrive as fast as they are read, and cost nothing until then";
    Any "control", "time and energy of what issues the operations", "the next operation is there when the last has ended; energy only where a model gives it as static";
];

/// An effect that a chip is simulated without.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Absent {
    /// Its key.
    pub effect: String,
    /// What real chips have; nothing where only the model names the effect.
    pub real: Option<&'static str>,
    /// What is simulated in its place.
    pub instead: Option<&'static str>,
    /// What the model says of its own chip.
    pub chip: Option<String>,
}

impl Absent {
    /// `read noise`.
    #[must_use]
    pub fn name(&self) -> String {
        self.effect.replace('_', " ")
    }

    /// What is simulated, and what the chip has.
    #[must_use]
    pub fn text(&self) -> String {
        let chip = self.chip.as_ref().map(|chip| match self.instead {
            Some(_) => format!("this chip: {chip}"),
            None => chip.clone(),
        });
        let parts = [self.instead.map(str::to_owned), chip];
        parts.into_iter().flatten().collect::<Vec<_>>().join("; ")
    }
}

/// `19 effects of real chips are not simulated, 5 with figures of this one`.
#[must_use]
pub fn absent_words(absent: &[Absent]) -> String {
    let figures = absent.iter().filter(|one| one.chip.is_some()).count();
    let (noun, verb) = if absent.len() == 1 { ("effect", "is") } else { ("effects", "are") };
    let mut text = format!("{} {noun} of real chips {verb} not simulated", absent.len());
    if figures > 0 {
        text += &format!(", {figures} with figures of this one");
    }
    text
}

impl Config {
    /// What real chips of this kind do and a run does not: the program's list, with what the model says of its own.
    #[must_use]
    pub(crate) fn absent(&self) -> Vec<Absent> {
        let drive = self.resolved.hw.as_ref().and_then(|hw| hw.drive.as_ref());
        let optical = drive.is_some_and(|drive| drive.mode.as_deref() == Some("amplitude"));
        let has = |effect: &&Effect| match (effect.of, effect.key) {
            // a floor above 0 is a lowest level that conducts too
            (_, "on_off") => {
                self.hardware.cell.window.floor() == 0 && self.hardware.conductance.is_none()
            }
            (_, "stuck_cells") => !self.hardware.has_stuck_cells(),
            (_, "ir_drop") if self.hardware.wires.is_some() => false,
            (_, "endurance") => self.hardware.endurance.is_none(),
            (_, "read_noise") => self.hardware.read_noise.is_none(),
            (_, "programming_noise") => self.hardware.programming.is_none(),
            (_, "write_nonlinearity") => self.hardware.device.is_none(),
            (_, "cycle_to_cycle") => {
                self.hardware.device.as_ref().is_none_or(|of| of.noise == PulseNoise::Off)
            }
            (_, "device_to_device") => {
                let device = self.hardware.device.as_ref();
                device.is_none_or(|of| of.spread == CellSpread::default())
            }
            (Substrate::Any, _) => true,
            (Substrate::Electronic, _) => !optical,
            (Substrate::Optical, _) => optical,
        };
        let mut all: Vec<_> = EFFECTS
            .iter()
            .filter(has)
            .map(|effect| Absent {
                effect: effect.key.into(),
                real: Some(effect.real),
                instead: Some(effect.instead),
                chip: self.not_simulated.get(effect.key).cloned(),
            })
            .collect();
        for (key, chip) in &self.not_simulated {
            if !all.iter().any(|one| one.effect == *key) {
                let (effect, chip) = (key.clone(), Some(chip.clone()));
                all.push(Absent { effect, real: None, instead: None, chip });
            }
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::config::{Sources, load};

    fn absent(hardware: Option<&str>, settings: &[&str]) -> Vec<Absent> {
        let settings: Vec<String> = settings.iter().map(ToString::to_string).collect();
        let sources = Sources { hardware, settings: &settings, ..Sources::default() };
        load(&sources).unwrap().absent()
    }

    fn find<'a>(all: &'a [Absent], key: &str) -> Option<&'a Absent> {
        all.iter().find(|one| one.effect == key)
    }

    #[test]
    fn a_model_that_names_nothing_leaves_nothing_out() {
        let bare = absent(None, &[]);
        let keys: Vec<_> = EFFECTS.iter().map(|effect| effect.key).collect();
        let mut once = keys.clone();
        once.sort_unstable();
        once.dedup();
        assert_eq!(once.len(), keys.len());
        for effect in EFFECTS {
            assert_eq!(find(&bare, effect.key).is_some(), effect.of != Substrate::Optical);
        }
        let light = absent(Some("mrr"), &[]);
        assert!(find(&light, "loss").is_some() && find(&light, "ir_drop").is_none());
    }

    #[test]
    fn a_model_adds_its_figures_and_its_own_lines() {
        let all = absent(Some("pcm14"), &["hw.not_simulated.ageing=\"3 % a year\""]);
        let drift = find(&all, "drift").unwrap();
        assert!(drift.text().starts_with("a level stays as it was written; this chip: "));
        let own = find(&all, "ageing").unwrap();
        assert_eq!((&*own.text(), own.real), ("3 % a year", None));
        assert!(absent_words(&all).starts_with(&format!("{} effects", all.len())));
    }

    #[test]
    fn a_device_is_not_said_to_be_absent() {
        let curved = absent(None, &["hw.device.response.curve=soft_bounds"]);
        assert!(find(&curved, "write_nonlinearity").is_none());
        assert!(find(&curved, "cycle_to_cycle").is_some());
        let both = ["hw.device.response.noise=0.1", "hw.device.spread.step=0.2"];
        let noisy = absent(None, &both);
        assert!(find(&noisy, "cycle_to_cycle").is_none());
        assert!(find(&noisy, "device_to_device").is_none());
    }

    #[test]
    fn a_floor_above_0_is_an_on_off_ratio() {
        assert!(find(&absent(None, &[]), "on_off").is_some());
        assert!(find(&absent(None, &["hw.cell.floor=2"]), "on_off").is_none());
        assert!(find(&absent(None, &["hw.device.conductance.on_off=5"]), "on_off").is_none());
        let wires = ["hw.device.wires.segment_ohm=1", "hw.device.wires.cell_on_ohm=1e5"];
        assert!(find(&absent(None, &[]), "ir_drop").is_some());
        assert!(find(&absent(None, &wires), "ir_drop").is_none());
    }

    #[test]
    fn what_is_simulated_is_not_said_to_be_absent() {
        let stuck = absent(None, &["hw.device.faults.stuck_any=0.01"]);
        assert!(find(&stuck, "stuck_cells").is_none() && find(&stuck, "read_noise").is_some());
        let noisy = absent(None, &["hw.device.read_noise.sigma_cells=0.1"]);
        assert!(find(&noisy, "stuck_cells").is_some() && find(&noisy, "read_noise").is_none());
    }
}
