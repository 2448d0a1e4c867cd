//! Writing: sums are formed, rounded, bounded and programmed, a strip of panels at a time.
//!
//! What cannot move a cell is passed over without a draw: blocks that are not driven, columns without a gate, and sums
//! that round to 0 whatever their words. See docs/MODEL.md, 3.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;

use super::StripMut;
use super::kernel::{Cells, Dither, Draws, Half, Kernel, Single, Write, WriteCounts, is_driven};
use super::layout::{BLOCK_CELLS, HALF_CELLS, HALF_COLUMNS, PANEL_COLUMNS};
use super::pulses::{Collect, Collected, Collector, RowPeaks};
use crate::chip::hardware::{DitherBits, DitherPattern};
use crate::num::draw::Place;

/// 64-bit words of pruned bits in a half block.
const HALF_WORDS: usize = HALF_CELLS / 64;

/// Loud groups of a half block, at least, that let the next [`UNASKED`] be written without asking which of theirs are.
const LOUD: u32 = 14;
const UNASKED: usize = 7;

/// Everything a write needs beside the cells and gates.
#[derive(Debug, Clone, Copy)]
pub struct WriteRequest<'a> {
    /// Drives of the written samples, `[block][64 rows][stride]`; `None` where all are 0.
    pub turned: &'a [Option<&'a [u8]>],
    /// Samples, padded with zero drives.
    pub stride: usize,
    /// Rounding, bound and window.
    pub write: Write,
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

    /// Accumulates, rounds, bounds and programs these panels. `gates` lies
    /// `[half][stride / 4][16 columns][4 samples]`.
    ///
    /// Passed over without a draw: blocks that are not driven, columns without a gate, and sums that round to 0
    /// whatever their words. A remainder alone is less than a pulse.
    pub fn write(&mut self, kernel: &Kernel, request: &WriteRequest<'_>, gates: &[i8]) -> Written {
        let stride = request.stride;
        let mut counts = WriteCounts::default();
        let Range { start, end } = self.panels();
        let draws = Draws::new(request.place, self.layout.rows);
        if let Some(written) = self.write_single(kernel, request, gates, &draws) {
            return written;
        }
        let mut sums = Sums([0; HALF_CELLS]);
        let columns = start * PANEL_COLUMNS..end * PANEL_COLUMNS;
        let mut collector = Collector::new(request.collect, self.layout, columns.clone());
        let mut words = Words::new(draws, columns);
        let live: Vec<_> = gates
            .chunks_exact(HALF_COLUMNS * stride)
            .enumerate()
            .filter(|(_, gates)| is_driven(gates))
            .collect();
        // words are drawn beside the sums while sums are loud: then they are rarely drawn for nothing
        let bytes = (request.dither_bits, request.dither_pattern);
        let mut ahead = bytes == (DitherBits::Eight, DitherPattern::PerCell);
        let may_be_ahead = ahead;
        let mut unasked = 0;
        let mut write = request.write;
        for (block, turned) in request.turned.iter().enumerate() {
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
                    let (from, soon) = ((&*draws, (column, block)), &*cells.low);
                    kernel.accumulate_drawn(turned, gates, &mut sums.0, from, bytes, soon);
                } else {
                    kernel.accumulate(turned, stride, gates, &mut sums.0);
                }
                write.groups = if drawn && unasked > 0 {
                    unasked -= 1;
                    u16::MAX
                } else {
                    kernel.loud(&sums.0, &write, request.dither_bits.get())
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
                    words.draw(kernel, request, column, block)
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
        gates: &[i8],
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
        let counts = kernel.single(Single {
            low: self.low,
            blocks: self.layout.blocks(),
            turned: request.turned,
            gates,
            column: self.first * PANEL_COLUMNS,
            draws,
            write: &request.write,
            peaks: peaks.as_mut().map(|peaks| &mut peaks.rows[..]),
        })?;
        let collected = peaks.map_or(Collected::Nothing, |peaks| Collected::Peaks(vec![peaks]));
        Some(Written { counts, collected })
    }

    fn half(&mut self, half: usize, block: usize) -> Cells<'_> {
        let panel = half / 2 * self.layout.panel_cells();
        let at = panel + block * BLOCK_CELLS + half % 2 * HALF_CELLS;
        let pruned = self.pruned.as_deref_mut().map(|bits| &mut bits[at / 64..][..HALF_WORDS]);
        Cells {
            low: half_mut(self.low, at),
            high: self.high.as_deref_mut().map(|plane| half_mut(plane, at)),
            residual: self.residual.as_deref_mut().map(|plane| half_mut(plane, at)),
            pruned: pruned.map(|bits| bits.try_into().expect("16 words a half block")),
            pulses: None,
        }
    }
}

/// Sums of a half block, where tiles are stored fastest.
#[repr(align(64))]
struct Sums(Half<i32>);

fn half_mut<T>(plane: &mut [T], at: usize) -> &mut Half<T> {
    (&mut plane[at..at + HALF_CELLS]).try_into().expect("a half block has 1024 cells")
}

/// Scratch for the dither words of a half block.
#[repr(align(64))]
struct Words {
    bytes: Half<u8>,
    halves: Half<u16>,
    draws: Draws,
    /// Columns of the strip.
    columns: Range<usize>,
    /// Separable words of all rows, and of the columns of the strip; made when first drawn.
    down: Vec<u16>,
    across: Vec<u16>,
}

impl Words {
    fn new(draws: Draws, columns: Range<usize>) -> Self {
        let (bytes, halves) = ([0; HALF_CELLS], [0; HALF_CELLS]);
        Self { bytes, halves, draws, columns, down: vec![], across: vec![] }
    }

    fn draw(
        &mut self,
        kernel: &Kernel,
        request: &WriteRequest<'_>,
        column: usize,
        block: usize,
    ) -> Dither<'_> {
        let place = request.place;
        match (request.dither_bits, request.dither_pattern) {
            (DitherBits::Zero, _) => return Dither::Nearest,
            (DitherBits::Eight, DitherPattern::PerCell) => {
                kernel.dither(&self.draws, column, block, &mut self.bytes);
            }
            (DitherBits::Sixteen, DitherPattern::PerCell) => {
                kernel.dither_words(&self.draws, column, block, &mut self.halves);
            }
            (bits, DitherPattern::Separable) => {
                // numbered as one column each: rows at sub 1, columns at sub 2; all rows once, columns once a strip
                if self.down.is_empty() {
                    let blocks = self.draws.rows().div_ceil(64);
                    self.down = separable_words(&Place { sub: 1, ..place }, bits, 0, blocks * 64);
                    let (first, count) = (self.columns.start, self.columns.len());
                    self.across = separable_words(&Place { sub: 2, ..place }, bits, first, count);
                }
                let across = &self.across[column - self.columns.start..][..HALF_COLUMNS];
                let down = self.down[block * 64..].as_chunks::<4>().0;
                for (group, down) in down.iter().take(16).enumerate() {
                    let to = group * 64..group * 64 + 64;
                    let words = self.halves[to.clone()].as_chunks_mut::<4>().0.iter_mut();
                    for (words, across) in words.zip(across) {
                        *words = down.map(|down| down ^ across);
                    }
                    if bits == DitherBits::Eight {
                        let words = self.halves[to.clone()].iter();
                        self.bytes[to].iter_mut().zip(words).for_each(|(b, &w)| *b = w as u8);
                    }
                }
            }
        }
        match request.dither_bits {
            DitherBits::Sixteen => Dither::Word(&self.halves),
            _ => Dither::Byte(&self.bytes),
        }
    }
}

/// Words `first ..` of an array of one column, 8 or 16 bits wide.
fn separable_words(place: &Place, bits: DitherBits, first: usize, count: usize) -> Vec<u16> {
    // an array of one column has its blocks one after the other, however many rows it has
    let wide = bits == DitherBits::Sixteen;
    let in_block = if wide { 32 } else { 64 };
    let mut bytes = vec![0; (first % in_block + count).div_ceil(in_block) * 64];
    place.fill((first / in_block) as u64, &mut bytes);
    if wide {
        let words = bytes[first % in_block * 2..].as_chunks::<2>().0;
        words.iter().take(count).map(|word| u16::from_le_bytes(*word)).collect()
    } else {
        bytes[first % in_block..].iter().take(count).map(|&byte| u16::from(byte)).collect()
    }
}
