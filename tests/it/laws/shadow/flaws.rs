//! The shadow's stuck cells and noisy conversions.

use dalean::chip::device::StuckAt;
use dalean::num::draw::{Place, Site};

use super::{Array, Fault, Net, Shadow, rsh};

impl Array {
    /// Cells that are stuck hold their levels from the start.
    pub(super) fn stick(&mut self, net: &Net, layer: usize, pathway: u8) {
        let (faults, window) = (net.hardware.faults, net.hardware.cell.window);
        if !net.hardware.has_stuck_cells() {
            return;
        }
        let (floor, ceiling) = (i64::from(window.floor()), i64::from(window.ceiling()));
        let rows = self.level.len();
        for (row, cells) in self.stuck.iter_mut().enumerate() {
            for (column, cell) in cells.iter_mut().enumerate() {
                let word = |sub| {
                    let layer = u16::try_from(layer).unwrap();
                    let (seed, site) = (net.seed, Site::StuckCell);
                    let place = Place { seed, site, layer, pathway, sub, count: 0 };
                    i64::from(place.whole(rows, row, column))
                };
                let [a, b, c] = [faults.floor, faults.ceiling, faults.any]
                    .map(|chance| i64::try_from(chance.get()).unwrap());
                let levels = ceiling - floor + 1;
                *cell = match word(0) {
                    w if w < a => Some(floor),
                    w if w - a < b => Some(ceiling),
                    w if w - a - b < c => Some(floor + word(1) * levels / (1 << 32)),
                    _ => None,
                };
                let listed = net.hardware.fault_map.cells().iter().find(|listed| {
                    (usize::from(listed.layer), listed.pathway) == (layer, pathway)
                        && [listed.row, listed.column].map(|at| at as usize) == [row, column]
                });
                if let Some(listed) = listed {
                    *cell = Some(match listed.at {
                        StuckAt::Floor => floor,
                        StuckAt::Ceiling => ceiling,
                        StuckAt::Level(level) => level.into(),
                    });
                }
                if let Some(level) = *cell {
                    self.level[row][column] = level;
                }
            }
        }
    }
}

impl Shadow {
    /// What a load leaves of a row of levels.
    pub(super) fn left(&self, layer: usize, array: usize, row: usize, levels: &[u16]) -> Vec<u16> {
        let hw = &self.net.hardware;
        let Some(programming) = hw.programming.filter(|_| !self.is(Fault::LoadIsExact)) else {
            return levels.to_vec();
        };
        let window = hw.cell.window;
        let (floor, ceiling) = (i64::from(window.floor()), i64::from(window.ceiling()));
        let left = levels.iter().enumerate().map(|(column, &level)| {
            let word = |sub| {
                let place = Place {
                    seed: self.net.seed,
                    site: Site::ProgrammingNoise,
                    layer: u16::try_from(layer).unwrap(),
                    pathway: self.code(layer, array),
                    sub,
                    count: 0,
                };
                place.half(self.layers[layer].rows, row, column)
            };
            let level = i64::from(level);
            let share = |c: i64| (c * level * 2 + ceiling).div_euclid(ceiling * 2);
            let [a, b, c, d] = programming.coefficients;
            let sd = rsh((a + share(b + share(c + share(d)))).max(0) * ceiling, 16);
            let size = i64::from(self.half_gaussian[usize::from(word(0) / 16)]);
            let g = if word(0) % 2 == 0 { size } else { -size };
            let left = ((level << 20) + g * sd + 16 * i64::from(word(1))).div_euclid(1 << 20);
            u16::try_from(left.clamp(floor, ceiling)).unwrap()
        });
        left.collect()
    }

    /// What the conversion of a line is off by: of so many tiles above one another, in one of them.
    pub(crate) fn noise(
        &self,
        (layer, pathway, sub): (usize, u8, u32),
        sample: usize,
        [tiles, tile, line]: [usize; 3],
    ) -> i64 {
        let hw = &self.net.hardware;
        let Some(noise) = hw.read_noise else { return 0 };
        let slice_max = (1i64 << hw.drive.dac_bits.min(hw.drive.bits.get())) - 1;
        let ceiling = i64::from(hw.cell.window.ceiling());
        let sd = rsh(i64::from(noise.sigma) * ceiling * slice_max, 8);
        let (phase, before) = self.came;
        let stale = self.is(Fault::NoiseOfFirstSample);
        let place = Place {
            seed: self.net.seed,
            site: Site::ReadNoise,
            layer: u16::try_from(layer).unwrap(),
            pathway,
            sub: sub + ((phase as u32) << 16),
            count: before + if stale { 0 } else { sample as u64 },
        };
        let word = if self.is(Fault::NoiseOfNeighbour) {
            place.half(tiles, tile, line + 1)
        } else {
            place.half(tiles, tile, line)
        };
        let size = i64::from(self.half_gaussian[usize::from(word / 16)]);
        rsh(if word % 2 == 0 { size } else { -size } * sd, 20)
    }

    /// What the conversions of a row are off by when a layer is read from its columns: all slices of both phases, in every tile
    /// beside one another.
    pub(super) fn backward_noise(
        &self,
        layer: usize,
        banks: &[usize],
        sample: usize,
        row: usize,
    ) -> i64 {
        let hw = &self.net.hardware;
        if hw.read_noise.is_none() || self.is(Fault::BackwardIsQuiet) {
            return 0;
        }
        let across = self.layers[layer].spec.units.div_ceil(hw.tile.columns);
        let mut sum = 0;
        for (tile, phase, bank) in (0..across).flat_map(|tile| {
            (0..2).flat_map(move |phase| (0..2).map(move |bank| (tile, phase, bank)))
        }) {
            for slice in 0..hw.drive.bits.get().div_ceil(hw.drive.dac_bits) {
                let sub = slice + (phase << 8) + (1 << 20);
                let place = (layer, self.code(layer, banks[bank]), sub);
                let off = self.noise(place, sample, [across, tile, row]);
                let weighed = off * (1i64 << (slice * hw.drive.dac_bits));
                sum += if (phase == 1) != (bank == 1) { -weighed } else { weighed };
            }
        }
        sum
    }
}
