//! Cells with a pulse side by side, most pulses first: those that get one more are the first so many, always.
//!
//! The arithmetic is that of `chip::device`, without a number below 0: of what noise takes away, `-rsh(-x, 12)` is
//! `(x + 2^11 - 1) >> 12`. Compilers make vectors of it; tables are looked up cell by cell.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::super::{Cells, Ends, Half};
use crate::chip::crossbar::CellsMade;
use crate::chip::crossbar::layout::{HALF_CELLS, HALF_COLUMNS};
use crate::chip::device::{DeviceLanes, PLACES};

/// Cells that are met at once.
const LANES: usize = 16;
/// Most pulses of a cell, and none.
const COUNTS: usize = 128;

/// A number a cell.
type Each<T> = [T; HALF_CELLS];

/// Cells of a half block with a pulse, most pulses first.
#[derive(Debug)]
#[repr(align(64))]
pub(in super::super) struct Sent {
    /// Cells with a pulse, in the order of levels.
    list: Each<u16>,
    /// Place in the half block.
    at: Each<u16>,
    level: Each<i32>,
    /// Ends of the cell's window.
    floor: Each<i32>,
    ceiling: Each<i32>,
    reach: Each<u32>,
    /// That of the cell's polarity.
    factor: Each<u32>,
    /// 0 of pulses up, all ones of pulses down.
    falls: Each<i32>,
    /// All ones, or 0 of a cell that is gone.
    free: Each<i32>,
    /// Where the last pulse would have brought it.
    reached: Each<i32>,
    /// Cells with more than so many pulses.
    more: [u16; COUNTS],
    /// Most pulses of a column.
    most: [u8; HALF_COLUMNS],
}

/// Words of a pulse, in the order of levels.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct Words<'a> {
    /// Of rounding.
    pub(super) rounding: &'a Half<u8>,
    /// Of noise.
    pub(super) noise: &'a Half<u16>,
}

impl Sent {
    /// No cell.
    pub(super) const NONE: Self = Self {
        list: [0; HALF_CELLS],
        at: [0; HALF_CELLS],
        level: [0; HALF_CELLS],
        floor: [0; HALF_CELLS],
        ceiling: [0; HALF_CELLS],
        reach: [0; HALF_CELLS],
        factor: [0; HALF_CELLS],
        falls: [0; HALF_CELLS],
        free: [0; HALF_CELLS],
        reached: [0; HALF_CELLS],
        more: [0; COUNTS],
        most: [0; HALF_COLUMNS],
    };

    /// Collects the cells of some groups that have a pulse.
    pub(super) fn collect(
        &mut self,
        cells: &Cells<'_>,
        made: &CellsMade<'_>,
        pulses: &Half<i8>,
        groups: u16,
    ) {
        let mut count = 0;
        for (group, pulses) in pulses.as_chunks::<64>().0.iter().enumerate() {
            let any = pulses.iter().fold(0, |any, pulses| any | pulses) != 0;
            if groups >> group & 1 == 0 || !any {
                continue;
            }
            for (at, pulses) in (64 * group as u16..).zip(pulses) {
                // what has no pulse is overwritten by the next
                self.list[count % HALF_CELLS] = at;
                count += usize::from(*pulses != 0);
            }
        }
        let mut with: [u16; COUNTS] = [0; COUNTS];
        self.most.fill(0);
        for &at in &self.list[..count] {
            let size = pulses[usize::from(at) % HALF_CELLS].unsigned_abs();
            let most = &mut self.most[usize::from(at) / 4 % HALF_COLUMNS];
            *most = size.max(*most);
            with[usize::from(size) % COUNTS] += 1;
        }
        // cells with more pulses lie before those with fewer
        let mut next = [0; COUNTS];
        let mut before = 0;
        for size in (1..COUNTS).rev() {
            next[size] = before;
            before += with[size];
            self.more[size - 1] = before;
        }
        let nominal = made.device.nominal();
        for &at in &self.list[..count] {
            let at = usize::from(at) % HALF_CELLS;
            let all = pulses[at];
            let place = &mut next[usize::from(all.unsigned_abs()) % COUNTS];
            let to = usize::from(*place) % HALF_CELLS;
            *place += 1;
            self.at[to] = at as u16;
            let high = cells.high.as_ref().map_or(0, |high| high[at]);
            self.level[to] = u16::from_le_bytes([cells.low[at], high]).into();
            let falls = usize::from(all < 0);
            self.falls[to] = -i32::from(all < 0);
            self.factor[to] = made.factors.map_or(nominal.factors[falls], |of| of[falls][at]);
            let gone = cells.pruned.as_ref().is_some_and(|pruned| pruned[at] != 0);
            self.free[to] = i32::from(gone) - 1;
            if let Some([floor, ceiling]) = made.windows {
                let [floor, ceiling] = [floor[at], ceiling[at]];
                (self.floor[to], self.ceiling[to]) = (floor.into(), ceiling.into());
                self.reach[to] = made.device.reach(ceiling - floor);
            }
        }
        if made.windows.is_none() {
            self.floor[..count].fill(nominal.floor.into());
            self.ceiling[..count].fill(nominal.ceiling.into());
            self.reach[..count].fill(nominal.reach);
        }
    }

    /// How many cells have more than so many pulses, and their columns.
    pub(super) fn beyond(&self, pulses: usize) -> (usize, u16) {
        let Some(&active) = self.more.get(pulses) else { return (0, 0) };
        let columns = self.most.iter().enumerate();
        let columns = columns.filter(|&(_, &most)| usize::from(most) > pulses);
        (active.into(), columns.fold(0, |all, (column, _)| all | 1 << column))
    }

    /// Levels go back where they came from, and what lies behind them is settled.
    pub(super) fn settle(&self, cells: &mut Cells<'_>, made: &CellsMade<'_>, ends: Ends) {
        let count = usize::from(self.more[0]);
        for (to, &at) in self.at[..count].iter().enumerate() {
            let at = usize::from(at) % HALF_CELLS;
            let [low, upper, ..] = self.level[to].to_le_bytes();
            cells.low[at] = low;
            if let Some(high) = &mut cells.high {
                high[at] = upper;
            }
        }
        if cells.residual.is_none() && cells.pruned.is_none() {
            return;
        }
        for (to, &at) in self.at[..count].iter().enumerate() {
            let at = usize::from(at) % HALF_CELLS;
            if let Some(residual) = &mut cells.residual {
                if self.reached[to] < self.floor[to] {
                    residual[at] = 0;
                } else if self.reached[to] > self.ceiling[to] {
                    residual[at] = ends.most_left();
                }
            }
            if let Some(pruned) = &mut cells.pruned {
                let floor = i32::from(made.cell(at).floor);
                let absorbed = self.free[to] == 0 || self.level[to] == floor;
                pruned[at] = if absorbed { Cells::GONE } else { 0 };
            }
        }
    }
}

/// A pulse of the first so many cells. Returns by how many levels they moved.
#[inline(always)]
pub(in super::super) fn pulse(
    sent: &mut Sent,
    device: &DeviceLanes<'_>,
    words: Words<'_>,
    active: usize,
) -> u64 {
    if device.noise == [0, 0] {
        all::<false>(sent, device, words, active)
    } else {
        all::<true>(sent, device, words, active)
    }
}

#[inline(always)]
fn all<const NOISY: bool>(
    sent: &mut Sent,
    device: &DeviceLanes<'_>,
    words: Words<'_>,
    active: usize,
) -> u64 {
    let mut effective = [0u32; LANES];
    for chunk in 0..active.div_ceil(LANES).min(HALF_CELLS / LANES) {
        let at = &sent.at.as_chunks::<LANES>().0[chunk];
        let level = &mut sent.level.as_chunks_mut::<LANES>().0[chunk];
        let floor = &sent.floor.as_chunks::<LANES>().0[chunk];
        let ceiling = &sent.ceiling.as_chunks::<LANES>().0[chunk];
        let reach = &sent.reach.as_chunks::<LANES>().0[chunk];
        let factor = &sent.factor.as_chunks::<LANES>().0[chunk];
        let falls = &sent.falls.as_chunks::<LANES>().0[chunk];
        let free = &sent.free.as_chunks::<LANES>().0[chunk];
        let reached = &mut sent.reached.as_chunks_mut::<LANES>().0[chunk];
        let (mut place, mut step) = ([0u32; LANES], [0u32; LANES]);
        for k in 0..LANES {
            let above = (level[k] - floor[k]).max(0).cast_unsigned();
            let fine = u64::from(above) * u64::from(reach[k]) + (1 << 15);
            let down = falls[k].cast_unsigned() & PLACES as u32;
            place[k] = ((fine >> 16) as u32).min(device.last) | down;
        }
        for k in 0..LANES {
            step[k] = device.steps[place[k] as usize % (2 * PLACES)];
        }
        for k in 0..LANES {
            step[k] = ((u64::from(step[k]) * u64::from(factor[k]) + (1 << 23)) >> 24) as u32;
        }
        if NOISY {
            let (mut size, mut less) = ([0u32; LANES], [0u32; LANES]);
            for k in 0..LANES {
                let word = words.noise[usize::from(at[k]) % HALF_CELLS];
                size[k] = device.gaussian[usize::from(word >> 4)].into();
                less[k] = u32::from(word & 1);
            }
            let [share, whole] = device.noise;
            for k in 0..LANES {
                let of_step = u64::from(step[k]) * u64::from(share) + (1 << 15);
                let deviation = (of_step >> 16) as u32 + whole;
                let fine = u64::from(size[k]) * u64::from(deviation);
                let off = ((fine + (1 << 11) - u64::from(less[k])) >> 12) as u32;
                let sign = 0u32.wrapping_sub(less[k]);
                step[k] = step[k].wrapping_add((off ^ sign).wrapping_sub(sign));
            }
        }
        let mut rounding = [0i32; LANES];
        for k in 0..LANES {
            rounding[k] = words.rounding[usize::from(at[k]) % HALF_CELLS].into();
        }
        for k in 0..LANES {
            let signed = (step[k].cast_signed() ^ falls[k]) - falls[k];
            let to = level[k] + ((signed + rounding[k]) >> 8);
            // lanes behind the last cell have had all their pulses
            let live = -i32::from(chunk * LANES + k < active);
            reached[k] = to & live | reached[k] & !live;
            let held = to.max(floor[k]).min(ceiling[k]);
            let moved = (held - level[k]) & live & free[k];
            level[k] += moved;
            effective[k] += moved.unsigned_abs();
        }
    }
    effective.into_iter().map(u64::from).sum()
}
