//! What a write changes of what cells remember: before its pulses, and after them. See docs/MODEL.md, 3.16.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::Answering;
use crate::chip::crossbar::kernel::{Cells, Half, Kernel};
use crate::chip::crossbar::layout::HALF_CELLS;
use crate::chip::crossbar::stamp_of;
use crate::chip::device::MemoryLaw;

/// What the cells of a half block remember.
#[derive(Debug)]
pub struct Remembered<'a> {
    /// By which law.
    pub law: &'a MemoryLaw,
    /// Whether the floor absorbs.
    pub absorbs: bool,
    /// Pulses that cells take, and those that they were sent.
    pub wear: Option<(&'a Half<u32>, &'a mut Half<u32>)>,
    /// What pulses left, where something else stands in the cell.
    pub left: Option<&'a mut Half<u16>>,
    /// When they did, of cells that drift.
    pub stamps: Option<&'a mut Half<u32>>,
}

/// Pulses that move cells, and which cells are free to move.
pub(super) struct Sending {
    pub(super) pulses: Half<i8>,
    free: [u64; HALF_CELLS / 64],
}

/// Places of cells of some groups of four rows, and their pulses.
fn pulsed(pulses: &Half<i8>, groups: u16) -> impl Iterator<Item = (usize, i8)> {
    let of = pulses.as_chunks::<64>().0.iter().enumerate();
    let of = of.filter(move |(group, _)| groups >> group & 1 == 1);
    let cells = of.flat_map(|(group, pulses)| {
        pulses.iter().enumerate().map(move |(at, &pulses)| (group * 64 + at, pulses))
    });
    cells.filter(|(_, pulses)| *pulses != 0)
}

fn level(cells: &Cells<'_>, at: usize) -> u16 {
    u16::from_le_bytes([cells.low[at], cells.high.as_ref().map_or(0, |high| high[at])])
}

fn put(cells: &mut Cells<'_>, at: usize, level: u16) {
    let [low, upper] = level.to_le_bytes();
    cells.low[at] = low;
    if let Some(high) = &mut cells.high {
        high[at] = upper;
    }
}

impl Remembered<'_> {
    /// Counts pulses, if they are not looked at one by one, cuts those off that move nothing any more, and brings cells to where pulses
    /// left them.
    pub(super) fn before(
        &mut self,
        cells: &mut Cells<'_>,
        pulses: &Half<i8>,
        groups: u16,
        counts: bool,
    ) -> Sending {
        let mut sending = Sending { pulses: *pulses, free: [0; _] };
        for (at, asked) in pulsed(pulses, groups) {
            if let Some((limits, spent)) = self.wear.as_mut().filter(|_| counts) {
                let all = u32::from(asked.unsigned_abs());
                let moving = limits[at].saturating_sub(spent[at]).min(all);
                spent[at] = spent[at].saturating_add(all);
                let moving = i8::try_from(moving).expect("no more than were asked for");
                sending.pulses[at] = if asked < 0 { -moving } else { moving };
            }
            if cells.pruned.as_ref().is_some_and(|pruned| pruned[at] != 0) {
                continue;
            }
            sending.free[at / 64] |= 1 << (at % 64);
            // a cell that drifted is pulsed where it is
            if let (Some(left), Some(_)) = (&self.left, &self.law.write_noise) {
                put(cells, at, left[at]);
            }
        }
        sending
    }

    /// Puts noise beside what pulses left, and marks cells that are worn out.
    pub(super) fn after(
        &mut self,
        kernel: &Kernel,
        cells: &mut Cells<'_>,
        (pulses, groups, sending): (&Half<i8>, u16, &Sending),
        answering: &mut Answering<'_>,
    ) {
        let Answering { made, words, at: place } = answering;
        let write = words.place.count + 1;
        if self.law.write_noise.is_some() {
            words.draw_beside(kernel, *place, super::columns_beyond(pulses, groups, 0));
        }
        for (at, _) in pulsed(pulses, groups) {
            if sending.free[at / 64] >> (at % 64) & 1 == 0 {
                continue;
            }
            let own = made.cell(at);
            let ends = [own.floor, own.ceiling];
            let reached = level(cells, at);
            if let Some(left) = &mut self.left {
                left[at] = reached;
            }
            if self.absorbs && reached == own.floor {
                continue;
            }
            if let Some(noise) = &self.law.write_noise {
                put(cells, at, noise.beside(reached, words.beside(at), ends));
            }
            if let Some(stamps) = &mut self.stamps {
                stamps[at] = stamp_of(write);
            }
            let (Some((worn, _)), Some((limits, spent))) = (&self.law.endurance, &self.wear) else {
                continue;
            };
            if spent[at] >= limits[at] {
                let stays = worn.level(level(cells, at), ends);
                put(cells, at, stays);
                if let Some(left) = &mut self.left {
                    left[at] = stays;
                }
                if let Some(pruned) = &mut cells.pruned {
                    pruned[at] = Cells::GONE;
                }
            }
        }
    }
}
