//! A chip that is loaded and read later: what loads leave, how levels drift, and a digital factor that makes up for it.
//!
//! ```text
//! factor = floor( (2^12 S + S'/2) / S' )         S, S': sums of all levels of a layer as they were loaded, and as they are
//! acc'   = rsh(acc factor, 12)                   behind converters and adders, before thresholds and tables
//! ```
//!
//! Global drift compensation: one factor a layer, from currents of all cells under the same drives. It is known exactly here; reading it
//! is not charged. See docs/MODEL.md, 3.13.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::borrow::Cow;
use std::sync::Arc;

use super::noise::gaussian_of;
use super::{Engine, Operation, Registers};
use crate::chip::crossbar::Crossbar;
use crate::chip::device::{Programming, cell_words};
use crate::chip::hardware::{HardwareError, HardwareSpec};
use crate::chip::layer::{Listed, check_listed};
use crate::chip::ledger::{During, Event};
use crate::num::draw::{Place, Site};
use crate::num::tables::{DriftTables, Gaussian};

/// Levels of all arrays of an engine, `[layer][array]`, row by row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AllLevels(Vec<Vec<Vec<u16>>>);

impl Engine {
    /// Makes its cells and reads those of another kind of chip, but for its loads; windows of cells too, if those of the other kind differ.
    /// Levels stay as they are, inside the windows.
    ///
    /// # Errors
    /// When there is no such chip.
    pub fn set_device(
        &mut self,
        of: &HardwareSpec,
        programming: Option<Programming>,
    ) -> Result<(), HardwareError> {
        let hardware = self.hardware.with(|h| {
            (h.faults, h.fault_map) = (of.faults, of.fault_map.clone());
            (h.conductance, h.wires) = (of.conductance, of.wires);
            (h.read_noise, h.programming) = (of.read_noise, programming);
            let windows = of.device.as_ref().filter(|device| device.spread.moves_window());
            if let Some(device) = windows {
                h.device = Some(device.clone());
            }
        })?;
        if let (true, Some(key)) = (self.has_copies(), hardware.differs_by_cell()) {
            let found = "is given where arrays have copies".to_owned();
            let allowed = "cells of it differ, so copies of an array would not be alike: it is not simulated; take it out, \
                           or learn with network.copies = 1";
            return Err(HardwareError { key, found, allowed: allowed.into() });
        }
        let layers = self.layers.iter().map(|layer| (layer.index, &layer.spec));
        check_listed(&hardware.fault_map, layers, Listed::Some)?;
        self.gaussian = gaussian_of(&hardware);
        self.hardware = hardware;
        self.set_chip_seed(self.chip_seed);
        Ok(())
    }

    /// Whether an array stands more than once on the chip.
    #[must_use]
    pub fn has_copies(&self) -> bool {
        self.layers.iter().any(|layer| layer.spec.copies > 1)
    }

    /// Its levels.
    #[must_use]
    pub fn all_levels(&self) -> AllLevels {
        let of = |array: &Crossbar| array.levels().collect();
        AllLevels(self.layers.iter().map(|layer| layer.arrays.iter().map(of).collect()).collect())
    }

    /// Loads levels row by row into the chip it is; what made up for drift is forgotten.
    ///
    /// # Panics
    /// When they are another network's.
    pub fn load_all(&mut self, levels: &AllLevels) {
        for (layer, arrays) in levels.0.iter().enumerate() {
            for (array, levels) in arrays.iter().enumerate() {
                let columns = self.layers[layer].layout.columns;
                for (row, levels) in levels.chunks_exact(columns).enumerate() {
                    self.execute(&Operation::LoadWeights { layer, array, row, levels });
                }
            }
        }
        self.registers.fill(Registers::default());
        self.factors.fill(None);
    }

    /// Samples loaded so far, by phase.
    #[must_use]
    pub const fn all_loaded(&self) -> [u64; 3] {
        self.loaded
    }

    /// Counts samples on from there.
    pub const fn set_loaded(&mut self, loaded: [u64; 3]) {
        self.loaded = loaded;
    }

    /// Seed of what makes this chip another than its like.
    #[must_use]
    pub const fn chip_seed(&self) -> u64 {
        self.chip_seed
    }

    /// What a load leaves of a row of levels.
    pub(super) fn programmed<'a>(
        &mut self,
        layer: usize,
        array: usize,
        row: usize,
        levels: &'a [u16],
    ) -> Cow<'a, [u16]> {
        let Some(programming) = self.hardware.programming else { return levels.into() };
        let place = self.cell_place(layer, array, Site::ProgrammingNoise);
        let gaussian = self.gaussian.as_ref().expect("made with the noise");
        let this = &self.layers[layer];
        let size = [this.layout.rows, this.layout.columns];
        let words = &mut self.load_words[layer];
        words.resize(this.arrays.len(), vec![]);
        if words[array].is_empty() {
            words[array] = cell_words(place, size);
        }
        let window = [this.arrays[array].window().floor(), this.arrays[array].window().ceiling()];
        let words = &words[array][row * size[1]..][..size[1]];
        let left = levels.iter().zip(words);
        left.map(|(&level, &words)| programming.left(gaussian, level, words, window)).collect()
    }

    /// Lets all levels but those of stuck cells drift; with `made_up`, a factor a layer makes up for it.
    pub fn age(&mut self, drift: &DriftTables, made_up: bool) {
        let gaussian = self.gaussian.clone().unwrap_or_else(|| Arc::new(Gaussian::new()));
        let level_max = self.hardware.level_greatest();
        for layer in 0..self.layers.len() {
            let sum = |engine: &Self| {
                let arrays = engine.layers[layer].arrays.iter();
                arrays.flat_map(Crossbar::levels).map(u64::from).sum::<u64>()
            };
            let before = sum(self);
            for array in 0..self.layers[layer].arrays.len() {
                let place = self.cell_place(layer, array, Site::Drift);
                let layout = self.layers[layer].layout;
                let words = cell_words(place, [layout.rows, layout.columns]);
                self.layers[layer].arrays[array]
                    .move_all(|cell, level| drift.aged(&gaussian, level, words[cell], level_max));
            }
            let after = sum(self);
            self.levels_moved(layer);
            let factor = ((before << 12) + after / 2).checked_div(after).filter(|_| made_up);
            self.factors[layer] = factor.map(|factor| i64::try_from(factor).expect("12 bits more"));
        }
    }

    /// Where the draws of the cells of an array begin, of the chip it is.
    fn cell_place(&self, layer: usize, array: usize, site: Site) -> Place {
        let this = &self.layers[layer];
        let pathway = this.spec.wiring.pathways()[array].code;
        Place { seed: self.chip_seed, site, layer: this.index, pathway, sub: 0, count: 0 }
    }

    /// `LOADW`.
    pub(super) fn load_weights(&mut self, layer: usize, array: usize, row: usize, levels: &[u16]) {
        let pathway = self.layers[layer].spec.wiring.pathways()[array].code;
        let left = self.programmed(layer, array, row, levels);
        let writes = self.layers[layer].writes[array];
        self.layers[layer].arrays[array].program_row(row, &left, writes);
        self.levels_moved(layer);
        let (during, count) = (During::LoadWeights, levels.len() as u64);
        self.charge(layer, pathway, during, Event::CellLoads, count);
        let others = self.copies_of(layer) - 1;
        self.charge(layer, pathway, during, Event::LoadsCopied, others * count);
        self.time(|schedule, cycles| schedule.load(cycles, layer));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chip::crossbar::kernel::Backend;
    use crate::chip::device::{Chance, Faults, ReadNoise};
    use crate::chip::engine::Side;
    use crate::chip::hardware::Hardware;
    use crate::chip::layer::{DrivenBy, Homeostasis, InitialLevels, Layer, LayerSpec, Pool, Taps};
    use crate::chip::population::{Stream, Wiring};
    use crate::num::fixed::rsh;
    use crate::num::tables::{Activation, DriftLaw, OfLogarithm};

    const ROWS: usize = 70;
    const UNITS: usize = 40;

    fn engine() -> Engine {
        let share = Chance::new(1 << 28).unwrap();
        let faults = Faults { floor: share, ceiling: share, any: share };
        let hardware = Hardware::reference().with(|h| h.faults = faults).unwrap();
        let spec = LayerSpec {
            inputs: ROWS,
            units: UNITS,
            wiring: Wiring::DualReadout,
            driven_by: DrivenBy::Shared,
            activation: Activation::Accumulator,
            weight_max_log2: 2,
            initial: InitialLevels::Uniform { gain_64ths: [64, 64] },
            constant_row: false,
            convolution: None,
            copies: 1,
            pool: Pool::None,
            homeostasis: Homeostasis::OFF,
        };
        let layer = Layer::new(0, spec, Taps::identity(UNITS), &hardware);
        Engine::new(hardware, Backend::best(), 1, vec![layer])
    }

    fn levels() -> AllLevels {
        let of =
            |salt: usize| (0..ROWS * UNITS).map(|at| ((at * 37 + salt) % 256) as u16).collect();
        AllLevels(vec![vec![of(1), of(90)]])
    }

    fn outputs(engine: &mut Engine) -> Vec<i64> {
        let codes: Vec<u8> = (0..3 * ROWS).map(|at| (at * 53 % 256) as u8).collect();
        engine.execute(&Operation::LoadDrives { codes: &codes });
        engine.execute(&Operation::Forward { layer: 0, side: Side::Rows });
        let all = (0..3).flat_map(|sample| (0..UNITS).map(move |unit| (sample, unit)));
        all.map(|(sample, unit)| engine.output(Stream::P, sample, unit).0).collect()
    }

    fn much_later() -> DriftTables {
        let of = |x| OfLogarithm { slope: 0.0, offset: x, least: x, most: x };
        let law = DriftLaw::Power { exponent: of(0.05), spread: of(0.01) };
        DriftTables::new(law, [255; 2], 1e6)
    }

    /// Fails when a stuck cell drifts, when a cell has another's words, or when drift is applied twice.
    #[test]
    fn every_free_cell_drifts_by_its_own_words_and_stuck_cells_stay() {
        let mut engine = engine();
        engine.set_chip_seed(9);
        engine.load_all(&levels());
        let tables = much_later();
        engine.age(&tables, false);
        let gaussian = Gaussian::new();
        let array = &engine.layers()[0].arrays[1];
        let stuck: Vec<_> = array.stuck().to_vec();
        assert!(stuck.len() > 300);
        let place = Place { seed: 9, site: Site::Drift, layer: 0, pathway: 1, sub: 0, count: 0 };
        for (row, column) in (0..ROWS).flat_map(|row| (0..UNITS).map(move |c| (row, c))) {
            let held = stuck
                .iter()
                .find(|cell| (cell.row as usize, cell.column as usize) == (row, column));
            let word = |sub| Place { sub, ..place }.half(ROWS, row, column);
            let old = levels().0[0][1][row * UNITS + column];
            let wanted = held.map_or_else(
                || tables.aged(&gaussian, old, [word(0), word(1)], 255),
                |cell| cell.level,
            );
            assert_eq!(array.level(row, column), wanted, "{row} {column}");
        }
    }

    #[test]
    fn a_factor_multiplies_what_comes_out_of_the_adders() {
        let (mut plain, mut made_up) = (engine(), engine());
        for (engine, on) in [(&mut plain, false), (&mut made_up, true)] {
            engine.load_all(&levels());
            engine.age(&much_later(), on);
        }
        let sum = |engine: &Engine| -> u64 {
            engine.layers()[0].arrays.iter().flat_map(Crossbar::levels).map(u64::from).sum()
        };
        let now = sum(&plain);
        let mut fresh = engine();
        fresh.load_all(&levels());
        let factor = ((sum(&fresh) << 12) + now / 2) / now;
        assert!((6000..12_000).contains(&factor), "{factor}");
        let wanted: Vec<i64> =
            outputs(&mut plain).into_iter().map(|acc| rsh(acc * factor as i64, 12)).collect();
        assert_eq!(outputs(&mut made_up), wanted);
        // loaded again, it is forgotten
        made_up.load_all(&levels());
        assert_eq!(outputs(&mut made_up), outputs(&mut fresh));
    }

    #[test]
    fn another_chip_has_other_cells_and_the_same_chip_the_same() {
        let mut engine = engine();
        let loads = Programming { coefficients: [1 << 20, 0, 0, 0] };
        let noisy = engine.hardware().with(|h| h.read_noise = Some(ReadNoise { sigma: 1 << 16 }));
        engine.set_device(&noisy.unwrap(), Some(loads)).unwrap();
        let read = |engine: &mut Engine, seed| {
            engine.set_chip_seed(seed);
            engine.load_all(&levels());
            engine.set_loaded([0; 3]);
            (engine.all_levels(), outputs(engine))
        };
        let (one, two) = (read(&mut engine, 1), read(&mut engine, 2));
        assert_ne!(one, two);
        assert_eq!(read(&mut engine, 1), one);
        // without flaws all chips are alike, and loads are exact
        engine.set_device(&Hardware::reference(), None).unwrap();
        assert_eq!(read(&mut engine, 1), read(&mut engine, 2));
        assert_eq!(read(&mut engine, 3).0, levels());
    }
}
