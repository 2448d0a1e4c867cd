//! Drives of some positions, put together as a dense array takes them.
//!
//! ```text
//! image -> [block of 64 rows][position][64]
//! ```
//!
//! Where channels lie side by side, the taps of one row of the kernel do too: `side` copies a position. Copies are of 16
//! bytes; what one writes too much, the next one or the padding overwrites.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;

use super::{ConvPlan, ConvScratch, Image, Pixels};
use crate::chip::crossbar::kernel::Drives;
use crate::chip::crossbar::layout::BLOCK_ROWS;

/// Bytes of a copy.
const COPY: usize = 16;

impl ConvScratch {
    /// Puts together the drives of some blocks of rows at some positions. A layer with several panels does this once
    /// and reads every panel from it.
    ///
    /// # Panics
    /// When there are no such blocks or positions.
    pub fn assemble(
        &mut self,
        image: Image<'_>,
        blocks: Range<usize>,
        positions: Range<usize>,
    ) -> Drives<'_> {
        let plan = image.plan();
        assert!(!blocks.is_empty() && blocks.end <= plan.blocks(), "the blocks are there");
        assert!(!positions.is_empty() && positions.end <= plan.positions(), "positions are there");
        let count = positions.len();
        let bytes = blocks.len() * count * BLOCK_ROWS;
        if self.codes.len() < bytes {
            self.codes.resize(bytes, 0);
        }
        let codes = &mut self.codes[..bytes];
        let mut rows: Vec<_> = codes.chunks_exact_mut(count * BLOCK_ROWS).collect();
        assemble(image, blocks, positions, &mut self.line, &mut rows);
        Drives::new(&self.codes[..bytes], count)
    }
}

/// What the windows of a convolution meet, put together where it is wanted: read by read, as the drives of a dense layer lie.
#[derive(Debug, Clone, Copy)]
pub struct Windows<'a> {
    image: Image<'a>,
    constant: Option<(usize, u8)>,
}

impl<'a> Windows<'a> {
    /// Those over an image, and beside them a row that is driven with a constant.
    #[must_use]
    pub const fn new(image: Image<'a>, constant: Option<(usize, u8)>) -> Self {
        Self { image, constant }
    }

    /// What they move over.
    #[must_use]
    pub const fn image(&self) -> Image<'a> {
        self.image
    }

    /// Reads of all samples.
    #[must_use]
    pub const fn reads(&self) -> usize {
        self.image.plan().positions()
    }

    /// Puts together some blocks of rows of some reads, `[block][read][64]`. `line` is kept from one call to the next.
    ///
    /// # Panics
    /// When there are no such reads or the size is another.
    pub fn assemble(
        &self,
        blocks: Range<usize>,
        reads: Range<usize>,
        line: &mut Vec<u8>,
        codes: &mut [u8],
    ) {
        let (plan, count) = (self.image.plan(), reads.len());
        assert!(count > 0 && reads.end <= plan.positions(), "reads are there");
        assert_eq!(codes.len(), blocks.len() * count * BLOCK_ROWS, "64 rows a block and read");
        let mut rows: Vec<_> = codes.chunks_exact_mut(count * BLOCK_ROWS).collect();
        // a constant row may begin a block of its own
        let windows = blocks.start..blocks.end.min(plan.blocks());
        rows.iter_mut().skip(windows.len()).for_each(|rows| rows.fill(0));
        assemble(self.image, windows, reads, line, &mut rows);
        if let Some((row, code)) = self.constant
            && blocks.contains(&(row / BLOCK_ROWS))
        {
            let rows = &mut rows[row / BLOCK_ROWS - blocks.start];
            let drives = rows.as_chunks_mut::<BLOCK_ROWS>().0.iter_mut();
            drives.for_each(|drives| drives[row % BLOCK_ROWS] = code);
        }
    }
}

/// Puts together the drives of some blocks of rows at some positions, `[position][64]` of each block. `line` is kept from
/// one call to the next.
fn assemble(
    image: Image<'_>,
    blocks: Range<usize>,
    positions: Range<usize>,
    line: &mut Vec<u8>,
    rows: &mut [&mut [u8]],
) {
    let plan = image.plan();
    if plan.form() == Pixels::Packed {
        for (block, codes) in blocks.zip(rows) {
            packed(image, block, positions.start, codes);
        }
        return;
    }
    if let Some(offsets) = plan.offsets() {
        for (offset, codes) in offsets[blocks].iter().zip(rows) {
            let (codes, _) = codes.as_chunks_mut::<BLOCK_ROWS>();
            for (pixel, codes) in plan.shape().steps(positions.start).zip(codes) {
                let at = offset + pixel * BLOCK_ROWS;
                codes.copy_from_slice(&image.codes()[at..at + BLOCK_ROWS]);
            }
        }
        return;
    }
    line.resize(plan.blocks() * BLOCK_ROWS + COPY, 0);
    for (i, pixel) in plan.shape().steps(positions.start).take(positions.len()).enumerate() {
        rows_of(plan, image.codes(), pixel, line);
        for (codes, block) in rows.iter_mut().zip(blocks.clone()) {
            codes[i * BLOCK_ROWS..][..BLOCK_ROWS]
                .copy_from_slice(&line[block * BLOCK_ROWS..][..BLOCK_ROWS]);
        }
    }
}

/// The drives of a block of rows at some positions, of packed pixels: those of a row of taps lie together.
fn packed(image: Image<'_>, block: usize, first: usize, codes: &mut [u8]) {
    let shape = image.plan().shape();
    let ([_, width], line) = (shape.padded(), shape.side * shape.channels);
    let (start, end) = (block * BLOCK_ROWS, ((block + 1) * BLOCK_ROWS).min(shape.rows()));
    // where a run begins, from the first tap on and in the block, and how long it is
    let mut runs = Vec::new();
    let mut row = start;
    while row < end {
        let (ky, along) = (row / line, row % line);
        let run = (line - along).min(end - row);
        runs.push((ky * width * shape.channels + along, row - start, run));
        row += run;
    }
    let live = end - start;
    for (i, pixel) in shape.steps(first).take(codes.len() / BLOCK_ROWS).enumerate() {
        let (from, to) = (&image.codes()[pixel * shape.channels..], &mut codes[i * BLOCK_ROWS..]);
        for &(at, row, run) in &runs {
            copy_block(&from[at..], &mut to[row..], run);
        }
        to[live..BLOCK_ROWS].fill(0);
    }
}

/// Copies at least `run` bytes of a block, and at most 64 where there are so many: what lies behind is written afterwards.
#[inline]
fn copy_block(from: &[u8], to: &mut [u8], run: usize) {
    match (from.first_chunk::<BLOCK_ROWS>(), to.first_chunk_mut::<BLOCK_ROWS>()) {
        (Some(from), Some(to)) => *to = *from,
        _ => to[..run].copy_from_slice(&from[..run]),
    }
}

/// The drives of all rows at the position whose first tap is `pixel`.
fn rows_of(plan: &ConvPlan, codes: &[u8], pixel: usize, line: &mut [u8]) {
    let shape = plan.shape();
    let [_, width] = shape.padded();
    for ky in 0..shape.side {
        let (from, to) = (pixel + ky * width, ky * shape.side * shape.channels);
        match plan.form() {
            Pixels::Packed => {
                let from = from * shape.channels;
                copy(&codes[from..], &mut line[to..], shape.side * shape.channels);
            }
            Pixels::Blocks => {
                for kx in 0..shape.side {
                    for (block, first) in (0..shape.channels).step_by(BLOCK_ROWS).enumerate() {
                        let at = block * plan.samples() * shape.pixels() + from + kx;
                        let run = (shape.channels - first).min(BLOCK_ROWS);
                        let to = to + kx * shape.channels + first;
                        copy(&codes[at * BLOCK_ROWS..], &mut line[to..], run);
                    }
                }
            }
        }
    }
    line[shape.rows()..].fill(0);
}

/// Copies at least `run` bytes, and fewer than 16 more.
#[inline]
fn copy(from: &[u8], to: &mut [u8], run: usize) {
    let rounded = run.next_multiple_of(COPY);
    match (from.get(..rounded), to.get_mut(..rounded)) {
        (Some(from), Some(to)) => {
            for (from, to) in from.as_chunks::<COPY>().0.iter().zip(to.as_chunks_mut::<COPY>().0) {
                *to = *from;
            }
        }
        _ => to[..run].copy_from_slice(&from[..run]),
    }
}
