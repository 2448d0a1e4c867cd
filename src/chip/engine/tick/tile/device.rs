//! Cells that are not ideal: each looks up its step, pulse by pulse. Only in networks. See docs/MODEL.md, 3.11.
//!
//! Written from the equations alone, so that it is compared with `chip::device` and `chip::crossbar` and shares nothing with
//! them but tables and addresses of words.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::Tile;
use crate::chip::device::{DeviceSpec, PulseNoise};
use crate::chip::hardware::Hardware;
use crate::num::draw::{Place, Site};
use crate::num::fixed::{Millionths, narrow, rsh};
use crate::num::tables::{Quantiles, SpreadLaw, half_gaussian};

/// A cell: its window and its factors, in 2^-24.
#[derive(Debug, Clone)]
struct Cell {
    floor: i64,
    ceiling: i64,
    factors: [i128; 2],
}

/// What the cells of a tile are made of.
#[derive(Debug, Clone)]
pub(in super::super) struct TileDevice {
    tables: [Vec<u32>; 2],
    gaussian: Vec<u16>,
    /// By bank, as levels lie.
    cells: [Vec<Cell>; 2],
    given: [Vec<u32>; 2],
    /// Of verified pulses: how many are given at most for each that is asked for, and the mean step in 2^-8 of a level.
    verified: Option<[i64; 2]>,
    /// Where cells were when their write began.
    began: [Vec<u16>; 2],
    /// Of the chip's window.
    span: i64,
    /// In 2^-16 of a step, and in 2^-8 of a level.
    noise: [i128; 2],
    /// Rows of the logical array, and where the tile begins in it.
    rows: usize,
    first: [usize; 2],
    /// Of the writes of each bank.
    places: [Place; 2],
}

/// Factors by what cells differ in: steps, asymmetry, ceiling, floor.
pub(in super::super) type Laws = [Option<Quantiles>; 4];

/// Those of a device.
pub(in super::super) fn laws(spec: &DeviceSpec) -> Laws {
    let spread = &spec.spread;
    let laws = [
        (spread.step_law, spread.step),
        (SpreadLaw::Normal, spread.asymmetry),
        (SpreadLaw::Normal, spread.ceiling),
        (SpreadLaw::Normal, spread.floor),
    ];
    laws.map(|(law, by)| (by.0 != 0).then(|| Quantiles::new(law, by)))
}

/// `floor(share scale + 1/2)`.
fn nearest(share: Millionths, scale: i128) -> i128 {
    (2 * i128::from(share.0) * scale + 1_000_000).div_euclid(2_000_000)
}

impl TileDevice {
    /// Of a tile of so many rows and columns that begins at a row and a column of arrays of `rows` rows.
    pub(in super::super) fn new(
        hardware: &Hardware,
        (spec, laws): (&DeviceSpec, &Laws),
        places: [Place; 2],
        (rows, first): (usize, [usize; 2]),
        size: [usize; 2],
    ) -> Self {
        let window = hardware.cell.window;
        let (floor, ceiling) = (i64::from(window.floor()), i64::from(window.ceiling()));
        let span = ceiling - floor;
        let one = 1i128 << 24;
        let cell = |place: &Place, row: usize, column: usize| {
            let factor = |sub: usize| match &laws[sub] {
                None => one,
                Some(law) => {
                    let sub = u32::try_from(sub).expect("four");
                    let place = Place { site: Site::Variation, sub, count: 0, ..*place };
                    law.factor(place.quads(rows, column, row / 16)[row % 16]).into()
                }
            };
            let up = factor(1).min(2 * one);
            let factors = [up, 2 * one - up];
            let factors = factors.map(|side| rsh(factor(0) * side, 24).min(u32::MAX.into()));
            let off = |sub: usize| {
                narrow::<i64>(rsh((factor(sub) - one) * i128::from(span), 24), "few windows")
            };
            let most = i64::from(hardware.cell.level_bits.level_max());
            let ceiling = (ceiling + off(2)).clamp(1, most);
            Cell { floor: (floor + off(3)).clamp(0, ceiling - 1), ceiling, factors }
        };
        let cells = |place: &Place| {
            let all = (0..size[0]).flat_map(|row| (0..size[1]).map(move |column| (row, column)));
            all.map(|(row, column)| cell(place, first[0] + row, first[1] + column)).collect()
        };
        Self {
            tables: spec.response.table(narrow(span, "a level"), spec.states, spec.asymmetry),
            gaussian: half_gaussian(),
            cells: places.each_ref().map(cells),
            given: [0, 1].map(|_| vec![0; size[0] * size[1]]),
            verified: hardware.timing.filter(|timing| timing.verify).map(|_| {
                let states = i64::from(spec.states);
                [i64::from(spec.tries), (2 * 256 * span + states).div_euclid(2 * states)]
            }),
            began: [0, 1].map(|_| vec![0; size[0] * size[1]]),
            span,
            noise: match spec.noise {
                PulseNoise::Off => [0, 0],
                PulseNoise::OfStep(share) => [nearest(share, 1 << 16), 0],
                PulseNoise::OfWindow(share) => [0, nearest(share, i128::from(span) << 8)],
            },
            rows,
            first,
            places,
        }
    }

    /// How far the next pulse of a cell at a level takes it.
    fn step(&self, bank: usize, (row, column): (usize, usize), at: usize, up: (i64, bool)) -> i64 {
        let (level, rises) = up;
        let cell = &self.cells[bank][at];
        let own = cell.ceiling - cell.floor;
        // as far up its own window as this is up that of the chip, in steps of 2^-16 of its levels
        let reach = ((self.span << 16) + own / 2) / own;
        // a stuck cell may rest outside the window of its own
        let place = rsh((level - cell.floor).max(0) * reach, 16).min(self.span);
        let side = usize::from(!rises);
        let mean = i128::from(self.tables[side][usize::try_from(place).expect("inside")]);
        let mean = rsh(mean * cell.factors[side], 24);
        let (row, column) = (self.first[0] + row, self.first[1] + column);
        let sub = self.given[bank][at];
        let word = |site| Place { site, sub, ..self.places[bank] };
        let noise = word(Site::PulseNoise).half(self.rows, row, column);
        let size = i128::from(self.gaussian[usize::from(noise / 16)]);
        let gaussian = if noise % 2 == 0 { size } else { -size };
        let deviation = rsh(mean * self.noise[0], 16) + self.noise[1];
        let step = mean + rsh(gaussian * deviation, 12);
        let mut words = [0; 64];
        word(Site::StepRounding).bytes(self.rows, column, row / 64, &mut words);
        let signed = if rises { step } else { -step };
        let moved = (signed + i128::from(words[row % 64])).div_euclid(256);
        i64::try_from(moved).expect("few windows")
    }
}

impl Tile {
    /// Its cells are of a device from now on.
    pub(in super::super) fn set_device(&mut self, device: TileDevice) {
        self.device = Some(Box::new(device));
    }

    /// How often every array has been written before.
    pub(in super::super) fn set_writes(&mut self, writes: u64) {
        let device = self.device.iter_mut().flat_map(|device| &mut device.places);
        let memory = self.memory.iter_mut().flat_map(|memory| memory.places_mut());
        device.chain(memory).for_each(|place| place.count = writes);
    }

    /// A level as a cell takes it.
    pub(super) fn taken(&self, bank: usize, at: usize, level: u16) -> u16 {
        let [floor, ceiling] = self.ends(bank, at);
        narrow(i64::from(level).clamp(floor, ceiling), "inside the window")
    }

    /// Floor and ceiling of a cell.
    pub(super) fn ends(&self, bank: usize, at: usize) -> [i64; 2] {
        match &self.device {
            Some(device) => [device.cells[bank][at].floor, device.cells[bank][at].ceiling],
            None => [self.config.floor, self.config.ceiling].map(i64::from),
        }
    }

    /// A pulse of a cell that is not ideal. Whether it has one.
    pub(super) fn answers(&mut self, bank: usize, column: usize, rises: bool) -> bool {
        let row = self.upd.row;
        let at = row * self.size.columns + column;
        match &self.device {
            None => return false,
            Some(device) if device.given[bank][at] == 0 => {
                self.recollect(bank, at);
                let level = self.level[bank][at];
                self.device.as_mut().expect("just seen").began[bank][at] = level;
            }
            Some(_) => {}
        }
        let [moves, last_ever] = self.spend(bank, at);
        let before = i64::from(self.level[bank][at]);
        let device = self.device.as_mut().expect("just seen");
        let reached = before + device.step(bank, (row, column), at, (before, rises));
        device.given[bank][at] += 1;
        let last = i64::from(device.given[bank][at]) == self.pulse[bank][column].abs();
        let [floor, ceiling] = self.ends(bank, at);
        let still = self.pruned[bank][at] || self.stuck[bank][at] || !moves;
        let after = if still { before } else { reached.clamp(floor, ceiling) };
        self.level[bank][at] = narrow(after, "a level");
        let last = last || last_ever || self.has_arrived(bank, column);
        if moves && last && self.config.more.residual_bits > 0 {
            let rest = (1 << self.config.more.residual_bits) - 1;
            let left = &mut self.residual[bank][at];
            *left = match reached {
                reached if reached < floor => 0,
                reached if reached > ceiling => rest,
                _ => *left,
            };
        }
        let events = &mut self.bank_events[bank];
        events.pulses_attempted += 1;
        events.pulses_effective += after.abs_diff(before);
        events.verify_reads += u64::from(self.config.more.verify);
        true
    }

    /// Slots for the pulses that are asked of a cell.
    pub(super) fn slots(&self, asked: i64) -> i64 {
        let verified = self.device.as_ref().and_then(|device| device.verified);
        verified.map_or(asked, |[tries, _]| tries * asked)
    }

    /// Whether a cell of the row was looked at and has moved as far as it should.
    pub(super) fn has_arrived(&self, bank: usize, column: usize) -> bool {
        let at = self.upd.row * self.size.columns + column;
        let Some(device) = &self.device else { return false };
        let Some([tries, mean]) = device.verified else { return false };
        let asked = self.pulse[bank][column] / tries;
        let moved = i64::from(self.level[bank][at]) - i64::from(device.began[bank][at]);
        let far = 2 * 256 * moved * asked.signum();
        device.given[bank][at] > 0 && far >= (2 * asked.abs() - 1) * mean
    }

    /// A write of these cells is over.
    pub(super) fn forget_pulses(&mut self, cells: std::ops::Range<usize>) {
        let Some(device) = &mut self.device else { return };
        let mut sent = Vec::new();
        for (bank, given) in device.given.iter_mut().enumerate() {
            let pulsed = given[cells.clone()].iter_mut().zip(cells.clone());
            let pulsed = pulsed.filter(|(given, _)| **given > 0);
            sent.extend(pulsed.map(|(given, at)| (bank, at, std::mem::take(given))));
        }
        for (bank, at, given) in sent {
            self.end_memory(bank, at, given);
        }
    }
}
