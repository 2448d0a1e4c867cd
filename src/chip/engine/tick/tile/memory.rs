//! What cells remember beside their level: pulses, what those left where noise stands beside it, what time takes. Only in
//! networks. See docs/MODEL.md, 3.16.
//!
//! Written from the equations alone, as `device` is.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::Tile;
use crate::chip::device::{Ageing, Endurance, Leakage, Worn};
use crate::chip::hardware::Hardware;
use crate::num::draw::{Place, Site};
use crate::num::fixed::{narrow, rsh};
use crate::num::tables::{DriftPace, DriftTables, Quantiles, SpreadLaw, half_gaussian};

/// Pulses a cell was sent, what they left, and in which write.
pub(in super::super) type Memories = (u32, u16, u64);

/// What the cells of a tile remember. Planes are by bank, as levels lie.
#[derive(Debug, Clone)]
pub(in super::super) struct TileMemory {
    endurance: Option<Worn>,
    limits: [Vec<u32>; 2],
    spent: [Vec<u32>; 2],
    /// Deviation of what writes leave beside a level, in 2^-8 of it, and half a Gaussian.
    noise: Option<(i128, Vec<u16>)>,
    left: [Vec<u16>; 2],
    leakage: Option<Leakage>,
    losses: [Vec<u32>; 2],
    /// How levels drift, and the tables of one doubling of time.
    ageing: Option<(Ageing, DriftPace)>,
    stamps: [Vec<u64>; 2],
    /// Rows of the logical array, and where the tile begins in it.
    rows: usize,
    first: [usize; 2],
    /// Columns of the tile.
    columns: usize,
    places: [Place; 2],
}

/// Factors of endurance and of leakage, where cells differ in them.
pub(in super::super) type Differing = [Option<Quantiles>; 2];

/// Those of a chip.
pub(in super::super) fn differing(hardware: &Hardware) -> Differing {
    let wear = hardware.endurance.map(|of| of.spread).filter(|by| by.0 != 0);
    let fade = hardware.leakage.map(|of| of.spread).filter(|by| by.0 != 0);
    [
        wear.map(|by| Quantiles::new(SpreadLaw::LogNormal, by)),
        fade.map(|by| Quantiles::new(SpreadLaw::Normal, by)),
    ]
}

impl TileMemory {
    /// That of a tile of so many rows and columns that begins at a row and a column of arrays of `rows` rows, if it has some.
    pub(in super::super) fn of(
        hardware: &Hardware,
        differing: &Differing,
        places: [Place; 2],
        (rows, first): (usize, [usize; 2]),
        [height, width]: [usize; 2],
    ) -> Option<Self> {
        let span = hardware.cell.window.ceiling() - hardware.cell.window.floor();
        let share = hardware.device.as_ref().map_or(0, |device| device.write_noise.0);
        let noise = (share != 0).then(|| {
            let sd =
                (2 * i128::from(share) * 256 * i128::from(span) + 1_000_000).div_euclid(2_000_000);
            (sd, half_gaussian())
        });
        let lasts = hardware.endurance.is_none() && hardware.leakage.is_none();
        if noise.is_none() && lasts && hardware.ageing.is_none() {
            return None;
        }
        let ends = [hardware.cell.window.ceiling(), hardware.level_greatest()];
        let plane = |mean: u32, sub: u32, law: &Option<Quantiles>, least: i128| {
            places.map(|place| {
                let cells = (0..height).flat_map(|row| (0..width).map(move |column| (row, column)));
                let of = |(row, column): (usize, usize)| {
                    let place = Place { site: Site::Variation, sub, count: 0, ..place };
                    let word = place.whole(rows, first[0] + row, first[1] + column);
                    let factor = law.as_ref().map_or(1 << 24, |law| law.factor(word));
                    let size = rsh(i128::from(mean) * i128::from(factor), 24);
                    narrow(size.clamp(least, u32::MAX.into()), "held to 32 bits")
                };
                cells.map(of).collect::<Vec<u32>>()
            })
        };
        let pulses = hardware.endurance.map_or(u32::MAX, |of| of.pulses);
        let lost = hardware.leakage.map_or(0, |of| of.lost);
        let [wear, fade] = differing;
        Some(Self {
            endurance: hardware.endurance.map(|of| of.worn),
            limits: plane(pulses, Endurance::SUB, wear, 1),
            spent: [0, 1].map(|_| vec![0; height * width]),
            noise,
            left: [0, 1].map(|_| vec![0; height * width]),
            leakage: hardware.leakage,
            losses: plane(lost, Leakage::SUB, fade, 0),
            ageing: hardware.ageing.map(|of| (of, DriftPace::new(&of.rates, ends))),
            stamps: [0, 1].map(|_| vec![0; height * width]),
            rows,
            first,
            columns: width,
            places,
        })
    }

    /// Places of the writes of its banks.
    pub(super) const fn places_mut(&mut self) -> &mut [Place; 2] {
        &mut self.places
    }

    fn is_worn(&self, bank: usize, at: usize) -> bool {
        self.endurance.is_some() && self.spent[bank][at] >= self.limits[bank][at]
    }

    /// Place of a cell in the logical array.
    fn logical(&self, at: usize) -> [usize; 2] {
        [self.first[0] + at / self.columns, self.first[1] + at % self.columns]
    }
}

impl Tile {
    /// Its cells remember from now on.
    pub(in super::super) fn set_memory(&mut self, memory: Option<TileMemory>) {
        self.memory = memory.map(Box::new);
    }

    /// What a cell remembers, from outside: pulses, and what those left.
    pub(in super::super) fn recall(
        &mut self,
        bank: usize,
        [row, column]: [usize; 2],
        (spent, left, stamp): (Option<u32>, Option<u16>, Option<u32>),
    ) {
        let at = row * self.size.columns + column;
        let Some(memory) = &mut self.memory else { return };
        memory.spent[bank][at] = spent.unwrap_or(memory.spent[bank][at]);
        memory.left[bank][at] = left.unwrap_or(memory.left[bank][at]);
        memory.stamps[bank][at] = stamp.map_or(memory.stamps[bank][at], u64::from);
    }

    /// Pulses a cell was sent, what they left, and in which write.
    pub(in super::super) fn remembers(&self, bank: usize, row: usize, column: usize) -> Memories {
        let at = row * self.size.columns + column;
        self.memory.as_ref().map_or((0, 0, 0), |memory| {
            (memory.spent[bank][at], memory.left[bank][at], memory.stamps[bank][at])
        })
    }

    /// Whether a cell is worn out.
    pub(super) fn is_worn(&self, bank: usize, at: usize) -> bool {
        self.memory.as_ref().is_some_and(|memory| memory.is_worn(bank, at))
    }

    /// A level was put into a cell from outside.
    pub(super) fn leaves(&mut self, bank: usize, at: usize) {
        if let Some(memory) = &mut self.memory {
            memory.left[bank][at] = self.level[bank][at];
        }
    }

    /// An operation has loaded a cell after so many writes: that is a pulse.
    pub(in super::super) fn count_load(
        &mut self,
        bank: usize,
        [row, column]: [usize; 2],
        writes: u64,
    ) {
        let at = row * self.size.columns + column;
        if let Some(memory) = &mut self.memory {
            memory.stamps[bank][at] = writes;
        }
        if self.is_worn(bank, at) {
            let memory = self.memory.as_mut().expect("it is worn out");
            memory.spent[bank][at] = memory.spent[bank][at].saturating_add(1);
            return;
        }
        let Some(memory) = &mut self.memory else { return };
        if memory.endurance.is_some() {
            memory.spent[bank][at] += 1;
            self.wear_out(bank, at);
        }
    }

    /// Takes a cell to where it stays, if it is worn out.
    fn wear_out(&mut self, bank: usize, at: usize) {
        if !self.is_worn(bank, at) || self.stuck[bank][at] {
            return;
        }
        let [floor, ceiling] = self.ends(bank, at);
        let memory = self.memory.as_ref().expect("it is worn out");
        match memory.endurance {
            Some(Worn::Floor) => self.level[bank][at] = narrow(floor, "a level"),
            Some(Worn::Ceiling) => self.level[bank][at] = narrow(ceiling, "a level"),
            _ => {}
        }
        self.leaves(bank, at);
    }

    /// The first pulse of a write of a cell is about to come.
    pub(super) fn recollect(&mut self, bank: usize, at: usize) {
        let still = self.stuck[bank][at] || self.pruned[bank][at] || self.is_worn(bank, at);
        if let Some(memory) = &self.memory
            && memory.noise.is_some()
            && !still
        {
            self.level[bank][at] = memory.left[bank][at];
        }
    }

    /// A pulse is sent to a cell. Whether it moves it, and whether it is the last that does.
    pub(super) fn spend(&mut self, bank: usize, at: usize) -> [bool; 2] {
        let moves = !self.is_worn(bank, at);
        if let Some(memory) = &mut self.memory {
            memory.spent[bank][at] = memory.spent[bank][at].saturating_add(1);
        }
        [moves, moves && self.is_worn(bank, at)]
    }

    /// The write of a cell that was sent so many pulses is over.
    pub(super) fn end_memory(&mut self, bank: usize, at: usize, sent: u32) {
        let Some(memory) = &self.memory else { return };
        let before = memory.spent[bank][at].saturating_sub(sent);
        let was_worn = memory.endurance.is_some() && before >= memory.limits[bank][at];
        let reached = self.level[bank][at];
        if self.stuck[bank][at] || self.pruned[bank][at] || was_worn {
            self.leaves(bank, at);
            return;
        }
        if let Some((sd, gaussian)) = &memory.noise {
            let [row, column] = memory.logical(at);
            let word = |sub| {
                let place = Place { site: Site::WriteNoise, sub, ..memory.places[bank] };
                i128::from(place.half(memory.rows, row, column))
            };
            let [g, r] = [word(0), word(1)];
            let size = i128::from(gaussian[usize::try_from(g / 16).expect("a word")]);
            let off = if g % 2 == 0 { size * sd } else { -size * sd };
            let level = (i128::from(reached) * (1 << 20) + off + r * 16).div_euclid(1 << 20);
            let [floor, ceiling] = self.ends(bank, at).map(i128::from);
            self.level[bank][at] = narrow(level.clamp(floor, ceiling), "inside the window");
        }
        let memory = self.memory.as_mut().expect("just seen");
        memory.left[bank][at] = reached;
        memory.stamps[bank][at] = memory.places[bank].count + 1;
        self.wear_out(bank, at);
    }

    /// The arrays were written so often: cells forget or drift, if it is time.
    pub(in super::super) fn forget(&mut self, writes: u64) {
        self.leak(writes);
        self.drift(writes);
    }

    fn drift(&mut self, writes: u64) {
        let Some(memory) = &self.memory else { return };
        let Some((ageing, pace)) = &memory.ageing else { return };
        if !writes.is_multiple_of(ageing.every.into()) {
            return;
        }
        let (ageing, pace, gaussian) = (*ageing, pace.clone(), half_gaussian());
        for bank in 0..2 {
            for at in 0..self.level[bank].len() {
                let memory = self.memory.as_ref().expect("just seen");
                let passed = writes - memory.stamps[bank][at];
                let still = self.stuck[bank][at] || self.pruned[bank][at] || self.is_worn(bank, at);
                if still || passed == 0 {
                    continue;
                }
                let [row, column] = memory.logical(at);
                let word = |sub| {
                    let place = Place { site: Site::Drift, sub, count: 0, ..memory.places[bank] };
                    i128::from(place.half(memory.rows, row, column))
                };
                let [g, r] = [word(0), word(1)];
                let size = i128::from(gaussian[usize::try_from(g / 16).expect("a word")]);
                let g = if g % 2 == 0 { size } else { -size };
                let times = i128::from(ageing.since + pace.doublings(passed));
                let left = memory.left[bank][at];
                let old = i128::from(left);
                let aged = match &pace.tables {
                    _ if times <= 0 => old,
                    DriftTables::Power { exponents, powers, .. } => {
                        let [mean, sd] = exponents[usize::from(left)].map(i128::from);
                        let exponent = (mean + rsh(g * sd, 12)).max(0);
                        let halvings = rsh(exponent * times, 16);
                        let part = usize::try_from(rsh(halvings % 65_536, 4)).expect("a fraction");
                        let whole = u32::try_from((halvings >> 16).min(31)).expect("few");
                        (old * (i128::from(powers[part]) >> whole) + r).div_euclid(65_536)
                    }
                    DriftTables::Log([mean, sd]) => {
                        let change = i128::from(*mean) + rsh(g * i128::from(*sd), 12);
                        (old * 65_536 + rsh(change * times, 16) + r).div_euclid(65_536)
                    }
                };
                let [floor, ceiling] = self.ends(bank, at).map(i128::from);
                let aged = if times <= 0 { aged } else { aged.clamp(floor, ceiling) };
                self.level[bank][at] = narrow(aged, "inside the window");
            }
        }
    }

    fn leak(&mut self, writes: u64) {
        let Some(leakage) = self.memory.as_ref().and_then(|memory| memory.leakage) else { return };
        if !writes.is_multiple_of(leakage.every.into()) {
            return;
        }
        for bank in 0..2 {
            for at in 0..self.level[bank].len() {
                if self.stuck[bank][at] || self.pruned[bank][at] || self.is_worn(bank, at) {
                    continue;
                }
                let memory = self.memory.as_ref().expect("just seen");
                let [row, column] = memory.logical(at);
                let place =
                    Place { site: Site::Leakage, sub: 0, count: writes, ..memory.places[bank] };
                let word = i128::from(place.whole(memory.rows, row, column));
                let lost = i128::from(memory.losses[bank][at]);
                let [floor, ceiling] = self.ends(bank, at).map(i128::from);
                let share = (2 * i128::from(leakage.rest.0) * 65_536 + 1_000_000) / 2_000_000;
                let rest = floor + rsh(share * (ceiling - floor), 16);
                let after = |level: u16| {
                    let level = i128::from(level);
                    let gone = ((level - rest) * lost + word).div_euclid(1 << 32);
                    narrow(level - gone, "between both")
                };
                let [level, left] = [self.level[bank][at], memory.left[bank][at]].map(after);
                self.level[bank][at] = level;
                self.memory.as_mut().expect("just seen").left[bank][at] = left;
            }
        }
    }
}
