//! Writing: sums are formed, rounded, bounded and programmed, a strip of panels at a time.
//!
//! What cannot move a cell is passed over without a draw: blocks that are not driven, columns without a gate, and sums
//! that round to 0 whatever their words. See docs/MODEL.md, 3.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;

use super::StripMut;
use super::form::{Form, Met};
use super::kernel::{
    Answering, Answers, Cells, Dither, Draws, Half, Kernel, OneSample, WriteCounts, WriteLaw,
    is_driven,
};
use super::layout::{BLOCK_CELLS, HALF_CELLS, HALF_COLUMNS, PANEL_COLUMNS};
use super::optimise::Asks;
use super::pulses::{Collect, Collected, Collector, RowPeaks};
use super::words::Words;
use crate::chip::hardware::{DitherBits, DitherPattern};
use crate::num::draw::Place;

/// Loud groups of a half block, at least, that let the next [`UNASKED`] be written without asking which of theirs are.
const LOUD: u32 = 14;
const UNASKED: usize = 7;

/// Everything a write needs beside the cells and gates.
#[derive(Debug, Clone, Copy)]
pub struct WriteRequest<'a> {
    /// Drives of the written samples.
    pub met: Met<'a>,
    /// Samples, padded with zero drives.
    pub stride: usize,
    /// Rounding, bound and window.
    pub write: WriteLaw,
    /// Kind of dither.
    pub dither_bits: DitherBits,
    /// Where dither words come from.
    pub dither_pattern: DitherPattern,
    /// Address of this write's dither.
    pub place: Place,
    /// What is told of the pulses.
    pub collect: Collect,
}

/// What a write did.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Written {
    /// Summed over cells.
    pub counts: WriteCounts,
    /// What the request asked for.
    pub collected: Collected,
}

impl StripMut<'_> {
    /// Its panels.
    #[must_use]
    pub fn panels(&self) -> Range<usize> {
        self.first..self.first + self.low.len() / self.layout.panel_cells()
    }

    /// Its columns, of whole panels.
    pub(super) fn columns(&self) -> Range<usize> {
        let Range { start, end } = self.panels();
        start * PANEL_COLUMNS..end * PANEL_COLUMNS
    }

    /// Accumulates, rounds, bounds and programs these panels. `gates` lies
    /// `[half][stride / 4][16 columns][4 samples]`.
    ///
    /// Passed over without a draw: blocks that are not driven, columns without a gate, and sums that round to 0
    /// whatever their words. A remainder alone is less than a pulse.
    pub fn write(&mut self, kernel: &Kernel, request: &WriteRequest<'_>, gates: &[i8]) -> Written {
        let turned = match request.met {
            Met::Turned(turned) if self.own.is_none() => turned,
            _ => {
                return self.write_formed(kernel, request, (gates, Form::PLAIN), Asks::Narrow);
            }
        };
        let stride = request.stride;
        let mut counts = WriteCounts::default();
        let draws = Draws::new(request.place, self.layout.rows);
        if let Some(written) = self.write_single(kernel, request, (turned, gates), &draws) {
            return written;
        }
        let mut sums = Sums([0; HALF_CELLS]);
        let columns = self.columns();
        let mut collector = Collector::new(request.collect, self.layout, columns.clone());
        let mut words = Words::new(request, draws, columns);
        let live: Vec<_> = gates
            .chunks_exact(HALF_COLUMNS * stride)
            .enumerate()
            .filter(|(_, gates)| is_driven(gates))
            .collect();
        // words are drawn beside the sums while sums are may_move: then they are rarely drawn for nothing
        let bytes = (request.dither_bits, request.dither_pattern);
        let mut ahead = bytes == (DitherBits::Eight, DitherPattern::PerCell);
        let may_be_ahead = ahead;
        let mut unasked = 0;
        let mut write = request.write;
        for (block, turned) in turned.iter().enumerate() {
            let Some(turned) = turned else { continue };
            for &(half, gates) in &live {
                let column = self.first * PANEL_COLUMNS + half * HALF_COLUMNS;
                // made before the sums: what is put together behind tiles that are being stored waits for them
                let mut cells = self.half(half, block);
                cells.pulses = collector.half(kernel, (column, block));
                let drawn = ahead;
                if drawn {
                    let turned = (*turned, stride);
                    let Words { bytes, draws, .. } = &mut words;
                    let (from, prefetch) = ((&*draws, (column, block)), &*cells.low);
                    kernel.accumulate_drawn(turned, gates, &mut sums.0, from, bytes, prefetch);
                } else {
                    kernel.accumulate(turned, stride, gates, &mut sums.0);
                }
                write.groups = if drawn && unasked > 0 {
                    unasked -= 1;
                    u16::MAX
                } else {
                    kernel.may_move(&sums.0, &write, request.dither_bits.get())
                };
                if unasked == 0 && write.groups.count_ones() >= LOUD {
                    unasked = UNASKED;
                }
                ahead = may_be_ahead && write.groups != 0;
                if write.groups == 0 {
                    continue;
                }
                let dither = if drawn {
                    Dither::Byte(&words.bytes)
                } else {
                    words.draw(kernel, column, block)
                };
                counts += kernel.program(cells, &sums.0, &write, dither);
                collector.take(kernel, (column, block), write.groups);
            }
        }
        Written { counts, collected: collector.finish(kernel) }
    }

    /// No peaks yet of the tile that all columns of the strip lie in, if they lie in one.
    fn one_tile(&self, tile_columns: usize) -> Option<RowPeaks> {
        let Range { start, end } = self.panels();
        let last = (end * PANEL_COLUMNS).min(self.layout.columns) - 1;
        let tile = start * PANEL_COLUMNS / tile_columns;
        (last / tile_columns == tile).then(|| RowPeaks::new(tile, self.layout.rows))
    }

    /// Writes one sample at once, where that is usual.
    fn write_single(
        &mut self,
        kernel: &Kernel,
        request: &WriteRequest<'_>,
        (turned, gates): (&[Option<&[u8]>], &[i8]),
        draws: &Draws,
    ) -> Option<Written> {
        let plain = self.high.is_none() && self.residual.is_none() && self.pruned.is_none();
        let bytes = (request.dither_bits, request.dither_pattern);
        let usual = plain
            && request.stride == 4
            && bytes == (DitherBits::Eight, DitherPattern::PerCell)
            && gates.as_chunks::<4>().0.iter().all(|of| of[1..] == [0; 3]);
        if !usual {
            return None;
        }
        let mut peaks = match request.collect {
            Collect::Nothing => None,
            Collect::Peaks { tile_columns } => Some(self.one_tile(tile_columns)?),
            Collect::Pulses => return None,
        };
        let counts = kernel.one_sample(OneSample {
            low: self.low,
            blocks: self.layout.blocks(),
            turned,
            gates,
            column: self.first * PANEL_COLUMNS,
            draws,
            write: &request.write,
            peaks: peaks.as_mut().map(|peaks| &mut peaks.rows[..]),
        })?;
        let collected = peaks.map_or(Collected::Nothing, |peaks| Collected::Peaks(vec![peaks]));
        Some(Written { counts, collected })
    }

    pub(super) fn half(&mut self, half: usize, block: usize) -> Cells<'_> {
        let panel = half / 2 * self.layout.panel_cells();
        let at = panel + block * BLOCK_CELLS + half % 2 * HALF_CELLS;
        Cells {
            low: half_mut(self.low, at),
            high: self.high.as_deref_mut().map(|plane| half_mut(plane, at)),
            residual: self.residual.as_deref_mut().map(|plane| half_mut(plane, at)),
            pruned: self.pruned.as_deref_mut().map(|plane| half_mut(plane, at)),
            pulses: None,
            answering: None,
            remembered: self.memory.as_mut().map(|memory| memory.half(at)),
        }
    }

    /// What cells of a half block answer to pulses with, if they are not ideal.
    pub(super) fn answering<'w>(
        &self,
        half: usize,
        block: usize,
        words: Option<&'w mut Answers>,
    ) -> Option<Answering<'w>>
    where
        Self: 'w,
    {
        let (own, words) = (self.own?, words?);
        let panel = (self.first + half / 2) * self.layout.panel_cells();
        let made = own.half(panel + block * BLOCK_CELLS + half % 2 * HALF_CELLS);
        let column = self.first * PANEL_COLUMNS + half * HALF_COLUMNS;
        Some(Answering { made, words, at: (column, block) })
    }

    /// Where words of pulses come from, if cells are not ideal.
    pub(super) fn answers(&self, place: Place) -> Option<Box<Answers>> {
        self.own.map(|_| Box::new(Answers::new(place, self.layout.rows)))
    }
}

/// Sums of a half block, where tiles are stored fastest.
#[repr(align(64))]
struct Sums(Half<i32>);

fn half_mut<T>(plane: &mut [T], at: usize) -> &mut Half<T> {
    (&mut plane[at..at + HALF_CELLS]).try_into().expect("a half block has 1024 cells")
}
