//! Last step of a write, of cells that are not ideal: pulse by pulse, and the window holds them after each.
//!
//! ```text
//! pulse      reached = level + move,   move: `chip::device`, of the words of the pulse
//! window     level = clamp( reached, floor, ceiling )  of the cell's own;   a gone cell stays where it was
//! remainder  0 where the last pulse reached below the floor, 2^F - 1 where above the ceiling
//! pruning    as of ideal cells, once all pulses are over
//! effective  sum over pulses of |level after - level before|
//! words      of the cell, site 4 (16 bits) and 14 (8 bits), sub: the pulse of the write, from 0
//! ```
//!
//! What cells remember beside their level is dealt with before all pulses and after them: `remembered`.
//!
//! Words that no cell of a column takes are not drawn. [`law`] goes cell by cell; where a back end has a twin of its pulse
//! and a device's numbers fit 32 bits, [`side_by_side`] does the same. See docs/MODEL.md, 3.11.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::{Cells, Draws, Ends, Half, Kernel, call};
use crate::chip::crossbar::CellsMade;
use crate::chip::crossbar::layout::{BLOCK_ROWS, HALF_CELLS, HALF_COLUMNS, in_half};
use crate::chip::device::{OwnCell, PulseWords};
use crate::num::draw::{Place, Site};
use crate::num::fixed::narrow;

mod lanes;
mod remembered;
mod verified;

pub(super) use lanes::{Sent, Words, pulse};
pub use remembered::Remembered;

/// So many columns with a pulse make it worth drawing the words of all sixteen at once.
const ALL_AT_ONCE: u32 = 4;

/// A pulse of the first so many cells: by how many levels it moved them.
type Pulse<'a> = dyn Fn(&mut Sent, Words<'_>, usize) -> u64 + 'a;

/// Where the words of a write's pulses come from, and scratch for those of a half block.
#[derive(Debug)]
#[repr(align(64))]
pub struct Answers {
    rounding: Half<u8>,
    noise: Half<u16>,
    /// The write; its site is another.
    place: Place,
    rows: usize,
    /// By pulse: words of rounding and of noise.
    draws: Vec<[Draws; 2]>,
    /// Words of what a write leaves beside a level, where it leaves something.
    beside: Vec<(Draws, Half<u16>)>,
    /// Cells with a pulse.
    sent: Sent,
    /// Pulses that were sent, where cells are looked at between them.
    pub verified: Option<u64>,
}

/// What cells of a half block answer to pulses with.
#[derive(Debug)]
pub struct Answering<'a> {
    /// What they are made of.
    pub made: CellsMade<'a>,
    /// Where words come from.
    pub words: &'a mut Answers,
    /// First column, and block of rows.
    pub at: (usize, usize),
}

impl Answers {
    /// Those of a write of an array of so many rows, at the place of its dither.
    #[must_use]
    pub const fn new(place: Place, rows: usize) -> Self {
        let (rounding, noise) = ([0; HALF_CELLS], [0; HALF_CELLS]);
        Self {
            rounding,
            noise,
            place,
            rows,
            draws: vec![],
            beside: vec![],
            sent: Sent::NONE,
            verified: None,
        }
    }

    /// Draws the words of a pulse for the columns of a mask.
    fn draw(
        &mut self,
        kernel: &Kernel,
        pulse: usize,
        (column, block): (usize, usize),
        (columns, [rounds, noisy]): (u16, [bool; 2]),
    ) {
        while self.draws.len() <= pulse {
            let sub = u32::try_from(self.draws.len()).expect("127 pulses at most");
            let of = |site| Draws::new(Place { site, sub, ..self.place }, self.rows);
            self.draws.push([of(Site::StepRounding), of(Site::PulseNoise)]);
        }
        let [rounding, noise] = &self.draws[pulse];
        if columns.count_ones() >= ALL_AT_ONCE {
            if rounds {
                kernel.dither(rounding, column, block, &mut self.rounding);
            }
            if noisy {
                kernel.dither_words(noise, column, block, &mut self.noise);
            }
            return;
        }
        for c in (0..HALF_COLUMNS).filter(|c| columns >> c & 1 == 1) {
            if rounds {
                let mut bytes = [0; BLOCK_ROWS];
                rounding.place().bytes(self.rows, column + c, block, &mut bytes);
                for (row, &byte) in bytes.iter().enumerate() {
                    self.rounding[in_half(row, c)] = byte;
                }
            }
            if noisy {
                column_halves(noise, self.rows, (column, c, block), &mut self.noise);
            }
        }
    }

    /// Draws the words of what a write leaves beside a level, for the columns of a mask.
    fn draw_beside(&mut self, kernel: &Kernel, (column, block): (usize, usize), columns: u16) {
        if self.beside.is_empty() {
            let of = |sub| Place { site: Site::WriteNoise, sub, ..self.place };
            let of = |sub| (Draws::new(of(sub), self.rows), [0; HALF_CELLS]);
            self.beside.extend([0, 1].map(of));
        }
        for (draws, words) in &mut self.beside {
            if columns.count_ones() >= ALL_AT_ONCE {
                kernel.dither_words(draws, column, block, words);
                continue;
            }
            for c in (0..HALF_COLUMNS).filter(|c| columns >> c & 1 == 1) {
                column_halves(draws, self.rows, (column, c, block), words);
            }
        }
    }

    /// Those of a cell.
    fn beside(&self, at: usize) -> [u16; 2] {
        [self.beside[0].1[at], self.beside[1].1[at]]
    }
}

/// Words of 16 bits of a column of a half block, of an array of so many rows.
fn column_halves(
    draws: &Draws,
    rows: usize,
    (column, c, block): (usize, usize, usize),
    out: &mut Half<u16>,
) {
    for group in 0..2 {
        let words = draws.place().halves(rows, column + c, 2 * block + group);
        for (row, word) in words.into_iter().enumerate() {
            out[in_half(32 * group + row, c)] = word;
        }
    }
}

/// What cells of a half block answer. Returns by how many levels pulses moved them.
pub(super) fn respond(
    kernel: &Kernel,
    cells: &mut Cells<'_>,
    answering: &mut Answering<'_>,
    (pulses, groups): (&Half<i8>, u16),
    ends: Ends,
) -> u64 {
    let verified = answering.made.device.verified();
    let Some(mut remembered) = cells.remembered.take() else {
        return match verified {
            Some(of) => verified::law(kernel, cells, None, answering, (pulses, groups), (of, ends)),
            None => answer(kernel, cells, answering, (pulses, groups), ends),
        };
    };
    let sending = remembered.before(cells, pulses, groups, verified.is_none());
    let effective = match verified {
        Some(of) => {
            let remembered = Some(&mut remembered);
            verified::law(kernel, cells, remembered, answering, (pulses, groups), (of, ends))
        }
        None => answer(kernel, cells, answering, (&sending.pulses, groups), ends),
    };
    remembered.after(kernel, cells, (pulses, groups, &sending), answering);
    effective
}

/// The same of cells that remember nothing else.
fn answer(
    kernel: &Kernel,
    cells: &mut Cells<'_>,
    answering: &mut Answering<'_>,
    (pulses, groups): (&Half<i8>, u16),
    ends: Ends,
) -> u64 {
    let device = answering.made.device;
    match (kernel.ops.pulse, device.lanes()) {
        (Some(pulse), Some(lanes)) => {
            // of the kernel's own table
            let pulse = |sent: &mut Sent, words: Words<'_>, active| {
                call!(pulse, (sent, &lanes, words, active))
            };
            side_by_side(kernel, cells, answering, (pulses, groups), (ends, &pulse))
        }
        _ => law(kernel, cells, answering, (pulses, groups), ends),
    }
}

/// [`law`] with all cells of a pulse beside one another.
fn side_by_side(
    kernel: &Kernel,
    cells: &mut Cells<'_>,
    answering: &mut Answering<'_>,
    (pulses, groups): (&Half<i8>, u16),
    (ends, pulse): (Ends, &Pulse<'_>),
) -> u64 {
    let Answering { made, words, at: place } = answering;
    let wants = made.device.wants();
    words.sent.collect(cells, made, pulses, groups);
    let mut effective = 0;
    for number in 0.. {
        let (active, columns) = words.sent.beyond(number);
        if active == 0 {
            break;
        }
        words.draw(kernel, number, *place, (columns, wants));
        let Answers { rounding, noise, sent, .. } = &mut **words;
        effective += pulse(sent, Words { rounding, noise }, active);
    }
    words.sent.settle(cells, made, ends);
    effective
}

/// Columns of a half block with a cell of more than so many pulses in some groups, a bit each.
fn columns_beyond(pulses: &Half<i8>, groups: u16, beyond: u8) -> u16 {
    let mut columns = 0;
    for (group, pulses) in pulses.as_chunks::<64>().0.iter().enumerate() {
        if groups >> group & 1 == 1 {
            for (column, pulses) in pulses.as_chunks::<4>().0.iter().enumerate() {
                let more = pulses.iter().any(|pulses| pulses.unsigned_abs() > beyond);
                columns |= u16::from(more) << column;
            }
        }
    }
    columns
}

/// The law for a half block. Returns by how many levels pulses moved cells.
pub(super) fn law(
    kernel: &Kernel,
    cells: &mut Cells<'_>,
    answering: &mut Answering<'_>,
    (pulses, groups): (&Half<i8>, u16),
    ends: Ends,
) -> u64 {
    let Answering { made, words, at: place } = answering;
    let wants = made.device.wants();
    let mut effective = 0;
    for pulse in 0..usize::from(i8::MAX.unsigned_abs()) {
        let beyond = u8::try_from(pulse).expect("127 pulses at most");
        let columns = columns_beyond(pulses, groups, beyond);
        if columns == 0 {
            break;
        }
        words.draw(kernel, pulse, *place, (columns, wants));
        for group in (0..HALF_CELLS / 64).filter(|group| groups >> group & 1 == 1) {
            let here = pulses.iter().enumerate().skip(group * 64).take(64);
            for (at, &all) in here {
                if all.unsigned_abs() <= beyond {
                    continue;
                }
                let of = PulseWords { rounding: words.rounding[at], noise: words.noise[at] };
                let last = all.unsigned_abs() == beyond + 1;
                effective += one(cells, made, at, (all > 0, last, of), ends);
            }
        }
    }
    effective
}

/// A pulse of a cell. Returns by how many levels it moved.
fn one(
    cells: &mut Cells<'_>,
    made: &CellsMade<'_>,
    at: usize,
    (rises, last, words): (bool, bool, PulseWords),
    ends: Ends,
) -> u64 {
    let cell = made.cell(at);
    let [before, level, reached] = pulse_of(cells, made, (at, &cell), (rises, words));
    if last {
        settle(cells, (at, &cell), (level, reached), ends);
    }
    level.abs_diff(before)
}

/// A pulse of a cell, whatever comes after it: its level before it and after it, and the one that it led to.
fn pulse_of(
    cells: &mut Cells<'_>,
    made: &CellsMade<'_>,
    (at, cell): (usize, &OwnCell),
    (rises, words): (bool, PulseWords),
) -> [i64; 3] {
    let high = cells.high.as_ref().map_or(0, |high| high[at]);
    let before = u16::from_le_bytes([cells.low[at], high]);
    let reached = i64::from(before) + made.device.moves(cell, before, rises, words);
    let (floor, ceiling) = (i64::from(cell.floor), i64::from(cell.ceiling));
    let gone = cells.pruned.as_ref().is_some_and(|pruned| pruned[at] != 0);
    let held = narrow::<u16>(reached.clamp(floor, ceiling), "in the window");
    let level = if gone { before } else { held };
    let [low, upper] = level.to_le_bytes();
    cells.low[at] = low;
    if let Some(high) = &mut cells.high {
        high[at] = upper;
    }
    [before.into(), level.into(), reached]
}

/// The last pulse of a cell is over.
fn settle(
    cells: &mut Cells<'_>,
    (at, cell): (usize, &OwnCell),
    (level, reached): (i64, i64),
    ends: Ends,
) {
    if let Some(residual) = &mut cells.residual {
        if reached < i64::from(cell.floor) {
            residual[at] = 0;
        } else if reached > i64::from(cell.ceiling) {
            residual[at] = ends.most_left();
        }
    }
    if let Some(pruned) = &mut cells.pruned {
        let absorbed = pruned[at] != 0 || level == i64::from(cell.floor);
        pruned[at] = if absorbed { Cells::GONE } else { 0 };
    }
}
