//! Convolution on the matrix unit: tiles of drives are loaded from the image as it lies.
//!
//! ```text
//! C[16 positions][16 columns] += A[16 pixels][64 channels]  B[64 rows][16 columns]        for each tap and 64 channels
//! ```
//!
//! Sixteen pixels, `stride` apart, are the rows of A. A tile begins at a position and runs on along the pixels,
//! over the border into the next row of positions; sums of pixels that are no positions are dropped. So no group
//! is cut at the end of a row, and a tap is one step along the pixels for all 16.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::asm;
use std::ops::Range;

use super::Tiles;
use crate::chip::crossbar::kernel::Scratch;
use crate::chip::crossbar::kernel::conv::{Image, Steps};
use crate::chip::crossbar::layout::{BLOCK_CELLS, BLOCK_ROWS, PANEL_COLUMNS};

/// Rows of a tile.
const TILE: usize = 16;

/// Sums of two tiles, some of them of no position.
#[repr(align(64))]
struct Aside([i32; Scratch::SUMS]);

/// Sixteen pixels that begin at `pixel`, and which of them are positions: a bit each.
#[derive(Debug, Clone, Copy)]
struct Run {
    pixel: usize,
    rows: u16,
}

impl Run {
    /// The run for the next of at most `left` positions, taking those it holds. It begins at `last` at the latest, which
    /// leaves 16 pixels; none where that is before the first pixel.
    fn take(steps: &mut Steps, stride: usize, left: usize, last: usize) -> Option<Self> {
        let from = steps.pixel();
        if from <= last && left >= TILE && steps.pass(TILE) {
            return Some(Self { pixel: from, rows: u16::MAX });
        }
        let back = from.saturating_sub(last).div_ceil(stride) * stride;
        let mut run = Self { pixel: from.checked_sub(back)?, rows: 0 };
        let mut pixel = run.pixel;
        for row in 0..TILE {
            if steps.pixel() == pixel && run.count() < left {
                run.rows |= 1 << row;
                steps.pass(1);
            }
            pixel += stride;
        }
        Some(run)
    }

    /// All runs of some positions, from the first on.
    fn all(steps: &mut Steps, stride: usize, positions: usize, last: usize) -> Option<Vec<Self>> {
        let mut runs = Vec::with_capacity(positions.div_ceil(TILE) + 1);
        let mut left = positions;
        while left > 0 {
            let run = Self::take(steps, stride, left, last)?;
            left -= run.count();
            runs.push(run);
        }
        Some(runs)
    }

    /// Positions it holds.
    const fn count(self) -> usize {
        self.rows.count_ones() as usize
    }
}

/// Reads positions; `false` where an image has too few pixels for a tile.
pub(super) fn read(
    tiles: &Tiles,
    cells: &[u8],
    image: Image<'_>,
    offsets: &[usize],
    positions: Range<usize>,
    out: &mut [i32],
) -> bool {
    let shape = image.plan().shape();
    let walk = Walk::new(offsets, shape.stride);
    let Some(last) = image.codes().len().checked_sub(walk.reach).map(|last| last / BLOCK_ROWS)
    else {
        return false;
    };
    // all runs first: what is put together behind tiles that are being stored waits for them
    let steps = &mut shape.steps(positions.start);
    let Some(runs) = Run::all(steps, shape.stride, positions.len(), last) else { return false };
    let mut aside = Aside([0; Scratch::SUMS]);
    let mut out = out;
    for runs in runs.chunks(2) {
        let [first, second] = [runs[0], runs[runs.len() - 1]];
        let a = [first, second].map(|run| &image.codes()[run.pixel * BLOCK_ROWS..]);
        let count = runs.iter().map(|run| run.count()).sum::<usize>();
        let (these, rest) = out.split_at_mut(count * PANEL_COLUMNS);
        out = rest;
        if count == 2 * TILE {
            // every row of both tiles is one
            quad(tiles, &walk, a, cells, these);
            continue;
        }
        quad(tiles, &walk, a, cells, &mut aside.0);
        let mut these = these.as_chunks_mut::<PANEL_COLUMNS>().0.iter_mut();
        for (run, sums) in runs.iter().zip(aside.0.as_chunks::<{ TILE * PANEL_COLUMNS }>().0) {
            for (row, sums) in sums.as_chunks::<PANEL_COLUMNS>().0.iter().enumerate() {
                if run.rows >> row & 1 == 1 {
                    *these.next().expect("a place for each position") = *sums;
                }
            }
        }
    }
    true
}

/// Where the bytes of A lie.
struct Walk<'a> {
    /// Bytes to the A of each block.
    offsets: &'a [usize],
    /// Bytes from a row of A to the next.
    step: usize,
    /// Bytes from the first row of the first A to the end of the last.
    reach: usize,
}

impl<'a> Walk<'a> {
    fn new(offsets: &'a [usize], stride: usize) -> Self {
        let step = stride * BLOCK_ROWS;
        let greatest = offsets.iter().max().expect("there is something to multiply");
        Self { offsets, step, reach: greatest + (TILE - 1) * step + BLOCK_ROWS }
    }
}

/// Two by two tiles: twice 16 pixels, 32 columns, all blocks.
fn quad(_: &Tiles, walk: &Walk<'_>, pixels: [&[u8]; 2], cells: &[u8], c: &mut [i32]) {
    let &Walk { offsets, step, reach } = walk;
    assert_eq!(cells.len(), offsets.len() * BLOCK_CELLS, "every block has its cells");
    assert!(pixels.iter().all(|pixels| pixels.len() >= reach), "every row of A is there");
    assert!(c.len() >= Scratch::SUMS, "every sum has its place");
    // SAFETY: a `Tiles` says that tiles of this thread have 16 rows of 64 bytes. Tile rows read at
    // pixels + offset + row * step (row < 16) end within `reach`, and those at cells + 2048 * block + 64 * row (row < 32)
    // within the cells; offsets read are those of the slice, which is not empty: it has a greatest; 32 rows of 128 bytes of `c` are written. All of
    // this lies inside the slices by the assertions. All tiles used are named.
    unsafe {
        asm!(
            zero_sums!(),
            "2:",
            "mov {a}, [{offset}]",
            "lea {a2}, [{pixels2} + {a}]",
            "add {a}, {pixels}",
            "tileloadd tmm4, [{a} + {step}]",
            "tileloadd tmm6, [{b} + {row}]",
            "tdpbuud tmm0, tmm4, tmm6",
            "tileloadd tmm7, [{b} + {row} + 1024]",
            "tdpbuud tmm1, tmm4, tmm7",
            "tileloadd tmm5, [{a2} + {step}]",
            "tdpbuud tmm2, tmm5, tmm6",
            "tdpbuud tmm3, tmm5, tmm7",
            "add {offset}, 8",
            "add {b}, 2048",
            "dec {steps}",
            "jnz 2b",
            "tilestored [{c} + {row2}], tmm0",
            "tilestored [{c} + {row2} + 64], tmm1",
            "tilestored [{c} + {row2} + 2048], tmm2",
            "tilestored [{c} + {row2} + 2112], tmm3",
            a = out(reg) _,
            a2 = out(reg) _,
            steps = inout(reg) offsets.len() => _,
            offset = inout(reg) offsets.as_ptr() => _,
            pixels = in(reg) pixels[0].as_ptr(),
            pixels2 = in(reg) pixels[1].as_ptr(),
            step = in(reg) step,
            b = inout(reg) cells.as_ptr() => _,
            row = in(reg) 64usize,
            row2 = in(reg) 128usize,
            c = in(reg) c.as_mut_ptr(),
            out("tmm0") _, out("tmm1") _, out("tmm2") _, out("tmm3") _,
            out("tmm4") _, out("tmm5") _, out("tmm6") _, out("tmm7") _,
            options(nostack),
        );
    }
}
