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
    /// `[group of samples][2 panels][sample][32]`.
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
        let beside = self.beside(layer);
        let (head, tail) = self.registers.split_at_mut(layer + 1);
        let (own, next) = (&mut head[layer], tail.first_mut().expect("a layer is driven"));
        let this = &self.layers[layer];
        let wiring = this.spec.wiring;
        let drives = |source: Stream| &own.drives[this.spec.drives_of(source).index()][..];
        let readers: Vec<_> = wiring
            .targets()
            .iter()
            .map(|&target| {
                let mode = (mode, beside.clone());
                Reader::new(this, &self.hardware, target, samples, mode, drives)
            })
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
    let mut total = [0u128; NEAR];
    let mut scratch = Scratch::new();
    for (block, out) in near.blocks.iter_mut().enumerate() {
        let mut squares = [0; NEAR];
        for (sums, part) in panels(reader, block, &near.samples, out.sums) {
            if part.live > 0 {
                reader.read_narrow(kernel, &part, &mut scratch, sums, &mut seen);
            }
            silence(sums, part.live);
            let group =
                part.samples.start - near.samples.start..part.samples.end - near.samples.start;
            kernel.stream_squares(sums, &mut squares[group]);
        }
        total.iter_mut().zip(squares).for_each(|(total, more)| *total += u128::from(more));
    }
    let mut rc = [0; NEAR];
    for (rc, squares) in rc[..near.samples.len()].iter_mut().zip(total) {
        *rc = normalise::reciprocal(squares, units);
    }
    for (block, Block { sums, values, derivatives }) in near.blocks.into_iter().enumerate() {
        for (sums, part) in panels(reader, block, &near.samples, sums) {
            let group =
                part.samples.start - near.samples.start..part.samples.end - near.samples.start;
            let at = group.start * BLOCK_ROWS + part.panel % 2 * PANEL_COLUMNS;
            let (values, derivatives) = (&mut values[at..], &mut derivatives[at..]);
            seen.look_ups += kernel.scale(sums, &rc[group], hand_on, values, derivatives);
        }
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
    // `[block][sample][64]`
    let mut all = vec![0i64; near.blocks.len() * size];
    let mut scratch = Scratch::new();
    let mut wide = [0; Scratch::SUMS];
    for ((block, out), all) in near.blocks.iter_mut().enumerate().zip(all.chunks_mut(size)) {
        for (sums, part) in panels(reader, block, &near.samples, out.sums) {
            let wide = &mut wide[..sums.len()];
            if part.live > 0 && reader.is_narrow() {
                reader.read_narrow(kernel, &part, &mut scratch, sums, seen);
                wide.iter_mut().zip(sums).for_each(|(wide, sum)| *wide = i64::from(*sum));
            } else if part.live > 0 {
                reader.read_wide(kernel, &part, wide, seen);
            }
            silence(wide, part.live);
            let at = (part.samples.start - near.samples.start) * BLOCK_ROWS;
            let rows = all[at + part.panel % 2 * PANEL_COLUMNS..].chunks_mut(BLOCK_ROWS);
            for (row, wide) in rows.zip(wide.as_chunks::<PANEL_COLUMNS>().0) {
                row[..PANEL_COLUMNS].copy_from_slice(wide);
            }
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

/// Both panels of a block for some samples, a group of them at a time, each with its place among `sums`.
fn panels<'a>(
    reader: &'a Reader<'_>,
    block: usize,
    samples: &'a Range<usize>,
    mut sums: &'a mut [i32],
) -> impl Iterator<Item = (&'a mut [i32], PanelPart)> {
    let groups = samples.clone().step_by(TOGETHER);
    let halves = groups.flat_map(move |start| [(start, 2 * block), (start, 2 * block + 1)]);
    halves.map(move |(start, panel)| {
        let group = start..(start + TOGETHER).min(samples.end);
        let live = reader.columns.saturating_sub(panel * PANEL_COLUMNS).min(PANEL_COLUMNS);
        let (own, rest) = std::mem::take(&mut sums).split_at_mut(group.len() * PANEL_COLUMNS);
        sums = rest;
        (own, PanelPart { panel, live, samples: group })
    })
}

/// Sums of a panel, `[sample][32]`, become 0 where there is no unit.
fn silence<T: Copy + Default>(sums: &mut [T], live: usize) {
    if live < PANEL_COLUMNS {
        let rows = sums.as_chunks_mut::<PANEL_COLUMNS>().0;
        rows.iter_mut().for_each(|row| row[live..].fill(T::default()));
    }
}
