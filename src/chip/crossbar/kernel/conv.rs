//! Convolutions on the same arrays: reads and sums of a batch of images, without unrolling it.
//!
//! ```text
//! read    v[p][c] = sum_r level[r][c] * x[r][p]        p position, c column (output channel), r row (tap and channel)
//! sums    s[r][c] = sum_p x[r][p] * u[p][c]
//! x[r][p]           the drive that row r meets at position p, see [`Image::drive`]
//! ```
//!
//! The array of a convolution is a dense one, `side^2 * channels` rows by as many columns as there are output channels;
//! a position is to it what a sample is to a dense layer. Only where drives lie is another matter.
//!
//! How a layer uses this. It makes a [`ConvPlan`] for its shape and batch, and keeps one [`Image`] a stream. A read
//! takes panels as a dense layer does, [`Kernel::read_conv`] instead of [`Kernel::read`], for all blocks of rows or for
//! those of one physical tile. Look-up of `[position][32]` sums writes the next image, row of positions by row of
//! positions. An update turns the drives of some samples once, [`Kernel::turn_conv`]: 8 to 16 samples, so that they
//! stay in the second cache. Then for each block of rows and half panel it adds the sums of these samples,
//! [`Kernel::accumulate_conv`]. Gates lie `[half][place / 4][16 columns][4 places]` with zeros where no position is:
//! [`ConvPlan::place`] says where a position's gate lies, so latched errors that lie `[place][64]` become gates by
//! [`Kernel::gate`]. Sums of a batch are `i64`, as one cell meets every position of every sample: 65,536 of them fit 32
//! bits, which is what one call adds.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;

use aligned_vec::{AVec, avec};

use super::{Half, Kernel, TOGETHER, call};
use crate::chip::crossbar::layout::{
    BLOCK_CELLS, BLOCK_ROWS, HALF_CELLS, HALF_COLUMNS, PANEL_COLUMNS, in_half,
};

mod assemble;
mod image;
#[cfg(test)]
mod tests;

pub use assemble::Windows;
#[cfg(target_arch = "x86_64")]
pub(super) use image::Steps;
pub use image::{ConvPlan, ConvShape, Image, Pixels};

/// Most blocks of rows of a read: 33,024 products of two bytes fit 32 bits.
const READ_BLOCKS_MAX: usize = 516;
/// Most positions of one update: products of a drive and a gate of -127..=127 fit 32 bits.
const POSITIONS_MAX: usize = 65_536;

/// What reads put together on the way; kept from one to the next.
#[derive(Debug, Clone)]
pub struct ConvScratch {
    /// `[block][position][64]`, aligned as tiles are loaded fastest.
    codes: AVec<u8>,
    /// The rows of one position.
    line: Vec<u8>,
}

impl Default for ConvScratch {
    fn default() -> Self {
        Self { codes: avec![], line: Vec::new() }
    }
}

/// Drives of some samples as an update takes them.
#[derive(Debug, Clone)]
pub struct ConvTurned {
    /// `[block][64][stride]`: blocks of channels by pixels, or blocks of rows by positions.
    codes: AVec<u8>,
    /// Bytes from a row to the next.
    stride: usize,
    /// Places of a gate.
    places: usize,
    /// Channel block and pixels from the first tap, by block of rows; empty where blocks are those of rows.
    taps: Vec<(usize, usize)>,
    scratch: ConvScratch,
}

impl Default for ConvTurned {
    fn default() -> Self {
        let scratch = ConvScratch::default();
        Self { codes: avec![], stride: 0, places: 0, taps: Vec::new(), scratch }
    }
}

/// A half block of sums, where tiles are stored fastest.
#[repr(align(64))]
struct Sums(Half<i32>);

impl Kernel {
    /// Reads one panel at some positions: `out[p][c] = sum of level[r][c] * drive[r][p]`, for the 32 columns of the
    /// panel and the rows of some blocks. `cells` are these blocks of one byte plane.
    ///
    /// # Panics
    /// When the sizes do not match.
    pub fn read_conv(
        &self,
        cells: &[u8],
        image: Image<'_>,
        blocks: Range<usize>,
        positions: Range<usize>,
        scratch: &mut ConvScratch,
        out: &mut [i32],
    ) {
        let plan = image.plan();
        assert!(!blocks.is_empty() && blocks.end <= plan.blocks(), "the blocks are there");
        assert!(blocks.len() <= READ_BLOCKS_MAX, "sums fit 32 bits");
        assert_eq!(cells.len(), blocks.len() * BLOCK_CELLS, "every block has cells");
        assert!(positions.end <= plan.positions(), "the positions are there");
        assert_eq!(positions.len() * PANEL_COLUMNS, out.len(), "32 sums a position");
        if !out.is_empty() {
            let part = (blocks.clone(), positions.clone());
            if !call!(self, read_conv(cells, image, part, out)) {
                self.read_assembled(cells, image, (blocks, positions), scratch, out);
            }
        }
    }

    /// Reads positions put together: what back ends do where an image cannot be read as it lies.
    fn read_assembled(
        &self,
        cells: &[u8],
        image: Image<'_>,
        (blocks, positions): (Range<usize>, Range<usize>),
        scratch: &mut ConvScratch,
        out: &mut [i32],
    ) {
        let groups = positions.clone().step_by(TOGETHER);
        for (start, out) in groups.zip(out.chunks_mut(TOGETHER * PANEL_COLUMNS)) {
            let group = start..(start + TOGETHER).min(positions.end);
            let drives = scratch.assemble(image, blocks.clone(), group);
            self.read(cells, drives, 0..drives.samples(), out);
        }
    }

    /// Turns the drives of some samples, for [`Kernel::accumulate_conv`].
    ///
    /// # Panics
    /// When there are no such samples, or too many for sums of 32 bits.
    pub fn turn_conv(&self, image: Image<'_>, samples: Range<usize>, turned: &mut ConvTurned) {
        let plan = image.plan();
        let shape = plan.shape();
        assert!(!samples.is_empty() && samples.end <= plan.samples(), "the samples are there");
        assert!(samples.len() * shape.positions() <= POSITIONS_MAX, "sums fit 32 bits");
        turned.places = plan.places(samples.len());
        turned.taps.clear();
        if plan.steps_along() {
            let pixels = samples.len() * shape.pixels();
            turned.stride = pixels.max(turned.places + plan.reach()).next_multiple_of(64);
            if turned.stride.is_multiple_of(2048) {
                turned.stride += 64; // rows of a tile do not meet in one set of a cache
            }
            let block_bytes = plan.samples() * shape.pixels() * BLOCK_ROWS;
            let offsets = plan.offsets().expect("blocks of rows lie together").iter();
            let taps = offsets.map(|at| (at / block_bytes, at % block_bytes / BLOCK_ROWS));
            turned.taps.extend(taps);
            let block = turned.stride * BLOCK_ROWS;
            turned.codes.resize(plan.channel_blocks() * block, 0);
            let from = image.codes().chunks_exact(block_bytes);
            for (codes, to) in from.zip(turned.codes.chunks_exact_mut(block)) {
                let first = samples.start * shape.pixels() * BLOCK_ROWS;
                self.turn(&codes[first..][..pixels * BLOCK_ROWS], turned.stride, to);
            }
        } else {
            turned.stride = turned.places;
            let block = turned.stride * BLOCK_ROWS;
            turned.codes.resize(plan.blocks() * block, 0);
            let positions = samples.start * shape.positions()..samples.end * shape.positions();
            for (at, to) in turned.codes.chunks_exact_mut(block).enumerate() {
                let drives = turned.scratch.assemble(image, at..at + 1, positions.clone());
                self.turn(drives.codes(), turned.stride, to);
            }
        }
    }

    /// Adds the sums of a half block: `sums[r][c] += sum over p of drive[r][p] * gates[p][c]`, over the positions of
    /// the samples that were turned. `block` is the block of 64 rows; `gates` lies `[place / 4][16 columns][4 places]`.
    ///
    /// # Panics
    /// When the sizes do not match.
    pub fn accumulate_conv(
        &self,
        turned: &ConvTurned,
        block: usize,
        gates: &[i8],
        sums: &mut Half<i64>,
    ) {
        let ConvTurned { codes, stride, places, taps, .. } = turned;
        assert!(*places > 0, "drives were turned");
        assert_eq!(gates.len(), HALF_COLUMNS * places, "16 columns");
        let (block, along) = if taps.is_empty() { (block, 0) } else { taps[block] };
        let rows = &codes[block * BLOCK_ROWS * stride..][..BLOCK_ROWS * stride][along..];
        let mut part = Sums([0; HALF_CELLS]);
        call!(self, accumulate(rows, *stride, gates, &mut part.0));
        sums.iter_mut().zip(&part.0).for_each(|(sum, &part)| *sum += i64::from(part));
    }
}

/// The law.
pub(super) fn read(
    cells: &[u8],
    image: Image<'_>,
    (blocks, positions): (Range<usize>, Range<usize>),
    out: &mut [i32],
) -> bool {
    for (position, out) in positions.zip(out.chunks_exact_mut(PANEL_COLUMNS)) {
        out.fill(0);
        for row in blocks.start * BLOCK_ROWS..blocks.end * BLOCK_ROWS {
            let drive = i32::from(image.drive(row, position));
            for (column, out) in out.iter_mut().enumerate() {
                let half = (row / BLOCK_ROWS - blocks.start) * 2 + column / HALF_COLUMNS;
                let at = half * HALF_CELLS + in_half(row % BLOCK_ROWS, column % HALF_COLUMNS);
                *out += i32::from(cells[at]) * drive;
            }
        }
    }
    true
}
