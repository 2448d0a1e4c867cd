//! Which rows are driven together with which slice of their drives.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::borrow::Cow;
use std::ops::Range;

use super::TileRead;
use crate::chip::crossbar::layout::BLOCK_ROWS;
use crate::chip::hardware::Hardware;
use crate::chip::layer::{CHUNK_BLOCKS, Layer};
use crate::chip::periphery;

/// How rows are taken together.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Tiles {
    /// All rows, in chunks whose sums fit 32 bits; the full code.
    Whole,
    /// Tiles one after the other in one read, where their edges allow it.
    Together,
    /// A read a tile.
    Apart,
}

/// Slices and tiles of a batch of drives.
pub(super) fn tile_reads<'a>(
    layer: &Layer,
    hardware: &Hardware,
    drives: &'a [u8],
    samples: usize,
    tiles: Tiles,
) -> Vec<TileRead<'a>> {
    let blocks = layer.layout.blocks();
    let size = samples * BLOCK_ROWS;
    let drives = &drives[..blocks * size];
    if tiles == Tiles::Whole {
        let starts = (0..blocks).step_by(CHUNK_BLOCKS);
        let chunk = |start: usize| start..(start + CHUNK_BLOCKS).min(blocks);
        return starts
            .map(chunk)
            .map(|blocks| TileRead {
                slice: 0,
                tile: 0,
                tile_blocks: blocks.len(),
                codes: Cow::Borrowed(&drives[blocks.start * size..blocks.end * size]),
                blocks,
                sums: vec![],
            })
            .collect();
    }
    let (dac_bits, slices) = (hardware.drive.dac_bits, hardware.slices());
    let aligned =
        hardware.tile.rows.is_multiple_of(BLOCK_ROWS) || layer.layout.rows <= hardware.tile.rows;
    let mut reads = Vec::new();
    for slice in 0..slices {
        let sliced = |codes: &'a [u8]| -> Cow<'a, [u8]> {
            if slices == 1 {
                Cow::Borrowed(codes)
            } else {
                codes.iter().map(|&x| periphery::slice(x, slice, dac_bits)).collect()
            }
        };
        if tiles == Tiles::Together && aligned {
            let tile_blocks = hardware.tile.rows.div_ceil(BLOCK_ROWS);
            let codes = sliced(drives);
            let (slice, sums) = (slice as usize, vec![]);
            let (tile, blocks) = (0, 0..blocks);
            reads.push(TileRead { slice, tile, blocks, tile_blocks, codes, sums });
            continue;
        }
        for (tile, rows) in layer.row_tiles(hardware).enumerate() {
            let blocks = rows.start / BLOCK_ROWS..rows.end.div_ceil(BLOCK_ROWS);
            let mut codes = sliced(&drives[blocks.start * size..blocks.end * size]);
            if !aligned {
                silence(codes.to_mut(), blocks.clone(), &rows, size);
            }
            debug_assert!(blocks.len() <= CHUNK_BLOCKS, "a converted tile is one chunk");
            let tile_blocks = blocks.len();
            let (slice, sums) = (slice as usize, vec![]);
            reads.push(TileRead { slice, tile, blocks, tile_blocks, codes, sums });
        }
    }
    reads
}

/// A tile's edge lies inside a block: drives of its neighbours' rows become 0.
fn silence(codes: &mut [u8], blocks: Range<usize>, rows: &Range<usize>, size: usize) {
    for (block, codes) in blocks.zip(codes.chunks_exact_mut(size)) {
        let first = block * BLOCK_ROWS;
        let from = rows.start.saturating_sub(first).min(BLOCK_ROWS);
        let to = (rows.end - first).min(BLOCK_ROWS);
        for codes in codes.chunks_exact_mut(BLOCK_ROWS) {
            codes[..from].fill(0);
            codes[to..].fill(0);
        }
    }
}
