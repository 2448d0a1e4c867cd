//! `FWD` of a layer whose units are normalised: the accumulators of a stream first, then the codes of all its units.
//!
//! ```text
//! sums       as of any read, kept until all units of the stream have theirs
//! codes      as chip::periphery::normalise says, a sample and stream at a time
//! ```
//!
//! Samples are taken some at a time, so that their sums stay near. Beside a read, a sample and stream of N units count N
//! squares, a root and N scalings. Each accumulator (32 bits) goes into a memory and comes out twice, to be squared and to be
//! scaled; activity and derivative (16 bits) are stored. See docs/MODEL.md, 2.3 and 4.2.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;

#[cfg(test)]
mod tests;

use super::Engine;
use super::each::each;
use super::read::{Mode, PanelPart, Reader, Seen};
use crate::chip::crossbar::kernel::{HandOn, Kernel, SQUARED_MAX, Scratch, TOGETHER};
use crate::chip::crossbar::layout::{BLOCK_ROWS, PANEL_COLUMNS};
use crate::chip::ledger::Event;
use crate::chip::periphery::normalise;
use crate::chip::population::Stream;

/// Samples that are normalised together.
const NEAR: usize = 2 * TOGETHER;

/// Memory bits of an accumulator that is stored and fetched twice, of an activity and of a derivative.
const BITS: u64 = 3 * 32 + 16;

/// A block of 64 units for some samples, `[sample][64]`.
struct Block<'a> {
    sums: &'a mut [i32],
    values: &'a mut [u8],
    derivatives: &'a mut [u8],
}

/// All units of a stream for some samples.
struct Near<'a> {
    target: Stream,
    samples: Range<usize>,
    blocks: Vec<Block<'a>>,
}

impl Engine {
    /// Reads a layer and normalises its streams. What was seen, by target.
    pub(super) fn normalised(&mut self, layer: usize, mode: Mode, hand_on: HandOn) -> Vec<Seen> {
        let samples = self.samples;
        let (head, tail) = self.registers.split_at_mut(layer + 1);
        let (own, next) = (&mut head[layer], tail.first_mut().expect("a layer is driven"));
        let this = &self.layers[layer];
        let wiring = this.spec.wiring;
        let drives = |source: Stream| &own.drives[this.spec.drives_of(source).index()][..];
        let readers: Vec<_> = wiring
            .targets()
            .iter()
            .map(|&target| Reader::new(this, &self.hardware, target, samples, mode, drives))
            .collect();
        let blocks = this.layout.columns.div_ceil(BLOCK_ROWS);
        let mut parts: Vec<(usize, Near<'_>)> = Vec::new();
        let streams = own.unscaled.iter_mut().zip(&mut next.drives).zip(&mut own.derivatives);
        for (&target, ((sums, values), derivatives)) in wiring.targets().iter().zip(streams) {
            let first = parts.len();
            for start in (0..samples).step_by(NEAR) {
                let samples = start..(start + NEAR).min(samples);
                let near = Near { target, samples, blocks: Vec::with_capacity(blocks) };
                parts.push((start / NEAR, near));
            }
            let values = values.chunks_mut(samples * BLOCK_ROWS);
            let derivatives = derivatives.chunks_mut(samples * BLOCK_ROWS);
            let of_blocks = sums.chunks_mut(samples * BLOCK_ROWS).zip(values.zip(derivatives));
            for (sums, (values, derivatives)) in of_blocks {
                let values = values.chunks_mut(NEAR * BLOCK_ROWS);
                let derivatives = derivatives.chunks_mut(NEAR * BLOCK_ROWS);
                let outs = sums.chunks_mut(NEAR * BLOCK_ROWS).zip(values.zip(derivatives));
                for ((_, near), (sums, (values, derivatives))) in
                    parts[first..].iter_mut().zip(outs)
                {
                    near.blocks.push(Block { sums, values, derivatives });
                }
            }
        }
        let units = this.layout.columns as u64;
        let work = samples * this.layout.cells() * wiring.pathways().len();
        let seen = each(&mut self.team, work, samples.div_ceil(NEAR), parts, |kernel, near| {
            let target = near.target.index();
            (target, put_out(kernel, &readers[target], near, units, hand_on))
        });
        Seen::by_target(wiring, seen)
    }

    /// Charges what normalising a stream of so many units takes beside its read.
    pub(super) fn charge_normalised(&mut self, layer: usize, code: u8, samples: u64, units: u64) {
        self.charge_read(layer, code, Event::Squares, samples * units);
        self.charge_read(layer, code, Event::Roots, samples);
        self.charge_read(layer, code, Event::Scalings, samples * units);
        self.charge_read(layer, code, Event::SramBits, samples * units * BITS);
    }
}

/// Reads all units of a stream for some samples, and normalises them.
fn put_out(
    kernel: &Kernel,
    reader: &Reader<'_>,
    mut near: Near<'_>,
    units: u64,
    hand_on: HandOn,
) -> Seen {
    let mut seen = Seen::new(reader);
    if !reader.is_below(SQUARED_MAX) {
        put_out_wide(kernel, reader, &mut near, units, hand_on, &mut seen);
        return seen;
    }
    let count = near.samples.len();
    let mut total = [0u128; NEAR];
    let mut scratch = Scratch::new();
    let mut panel = [0; Scratch::SUMS];
    for (block, out) in near.blocks.iter_mut().enumerate() {
        for (from, part) in panels(reader, block, &near.samples) {
            let sums = &mut panel[..part.samples.len() * PANEL_COLUMNS];
            if part.live > 0 {
                reader.read_narrow(kernel, &part, &mut scratch, sums, &mut seen);
            }
            place(sums, part.live, &mut out.sums[from..]);
        }
        let mut squares = [0; NEAR];
        kernel.stream_squares(out.sums, &mut squares[..count]);
        total.iter_mut().zip(squares).for_each(|(total, more)| *total += u128::from(more));
    }
    let mut rc = [0; NEAR];
    for (rc, squares) in rc[..count].iter_mut().zip(total) {
        *rc = normalise::reciprocal(squares, units);
    }
    for Block { sums, values, derivatives } in near.blocks {
        seen.look_ups += kernel.scale(sums, &rc[..count], hand_on, values, derivatives);
    }
    seen
}

/// The same where sums or their squares may not fit: one number after the other.
fn put_out_wide(
    kernel: &Kernel,
    reader: &Reader<'_>,
    near: &mut Near<'_>,
    units: u64,
    hand_on: HandOn,
    seen: &mut Seen,
) {
    let size = near.samples.len() * BLOCK_ROWS;
    let mut all = vec![0i64; near.blocks.len() * size];
    let mut scratch = Scratch::new();
    let (mut narrow, mut wide) = ([0; Scratch::SUMS], [0; Scratch::SUMS]);
    for (block, all) in all.chunks_mut(size).enumerate() {
        for (from, part) in panels(reader, block, &near.samples) {
            let cells = part.samples.len() * PANEL_COLUMNS;
            let (sums, wide) = (&mut narrow[..cells], &mut wide[..cells]);
            if part.live > 0 && reader.is_narrow() {
                reader.read_narrow(kernel, &part, &mut scratch, sums, seen);
                wide.iter_mut().zip(sums).for_each(|(wide, sum)| *wide = i64::from(*sum));
            } else if part.live > 0 {
                reader.read_wide(kernel, &part, wide, seen);
            }
            place(wide, part.live, &mut all[from..]);
        }
    }
    for sample in 0..near.samples.len() {
        let of_sample = || all.chunks(size).map(|all| &all[sample * BLOCK_ROWS..][..BLOCK_ROWS]);
        let squares = normalise::squares(of_sample().flatten().copied());
        let rc = normalise::reciprocal(squares, units);
        for (sums, out) in of_sample().zip(&mut near.blocks) {
            let at = sample * BLOCK_ROWS;
            for (unit, &sum) in sums.iter().enumerate() {
                let (code, beyond) = normalise::code(sum, rc);
                out.values[at + unit] = hand_on.value(code);
                out.derivatives[at + unit] = normalise::slope(sum);
                seen.look_ups += u64::from(beyond);
            }
        }
    }
}

/// Both panels of a block for some samples, a group of them at a time, and where a group's sums begin.
fn panels<'a>(
    reader: &'a Reader<'_>,
    block: usize,
    samples: &'a Range<usize>,
) -> impl Iterator<Item = (usize, PanelPart)> + 'a {
    samples.clone().step_by(TOGETHER).flat_map(move |start| {
        let group = start..(start + TOGETHER).min(samples.end);
        (0..2).map(move |half| {
            let panel = 2 * block + half;
            let live = reader.columns.saturating_sub(panel * PANEL_COLUMNS).min(PANEL_COLUMNS);
            let from = (group.start - samples.start) * BLOCK_ROWS + half * PANEL_COLUMNS;
            (from, PanelPart { panel, live, samples: group.clone() })
        })
    })
}

/// Puts the sums of a panel, `[sample][32]`, to those of its block, `[sample][64]`; 0 where there is no unit.
fn place<T: Copy + Default>(sums: &[T], live: usize, block: &mut [T]) {
    let rows = block.chunks_mut(BLOCK_ROWS).zip(sums.as_chunks::<PANEL_COLUMNS>().0);
    for (row, sums) in rows {
        row[..live].copy_from_slice(&sums[..live]);
        row[live..PANEL_COLUMNS].fill(T::default());
    }
}
