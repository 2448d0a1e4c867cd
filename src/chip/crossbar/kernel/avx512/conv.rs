//! Convolution in 512-bit loops: one row of taps at a time, whose pixels lie side by side.
//!
//! ```text
//! stream    the pixels below the taps of row ky, of one position and 64 channels
//! out       128 * sum of drives, then + sum of dot4(stream, level - 128) for each ky and 64 channels
//! ```
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::x86_64::*;
use std::ops::Range;

use super::{ANY, MORE, Walk, dots_batch, load};
use crate::chip::crossbar::kernel::conv::Image;
use crate::chip::crossbar::layout::{BLOCK_CELLS, BLOCK_ROWS, HALF_CELLS, PANEL_COLUMNS};

/// Reads positions with all blocks of rows, where rows of positions are wide enough.
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(super) fn read(
    cells: &[u8],
    image: Image<'_>,
    (blocks, positions): (Range<usize>, Range<usize>),
    out: &mut [i32],
) -> bool {
    let plan = image.plan();
    let (shape, channels) = (plan.shape(), plan.channel_blocks());
    let [_, across] = shape.output();
    let offsets = plan.offsets().filter(|offsets| blocks.len() == offsets.len() && across > 4);
    let Some(offsets) = offsets else { return false };
    let walk = Walk {
        runs: shape.side,
        quads: 16,
        last: 16,
        run: channels * BLOCK_CELLS,
        half: HALF_CELLS,
        words: BLOCK_ROWS,
        stride: shape.stride * BLOCK_ROWS,
        out: PANEL_COLUMNS,
    };
    let (mut at, mut out) = (positions.start, out);
    while at < positions.end {
        // positions of one row of pixels
        let count = (across - at % across).min(positions.end - at);
        let (these, rest) = out.split_at_mut(count * PANEL_COLUMNS);
        let pixels = shape.steps(at).take(count);
        for (pixel, out) in pixels.clone().zip(these.as_chunks_mut::<PANEL_COLUMNS>().0) {
            out.fill(128 * drive_sum(image.codes(), pixel * BLOCK_ROWS, offsets));
        }
        let first = pixels.clone().next().expect("a row has positions") * BLOCK_ROWS;
        for ky in 0..shape.side {
            for block in 0..channels {
                let block = ky * shape.side * channels + block;
                let streams = &image.codes()[first + offsets[block]..];
                let cells = &cells[block * BLOCK_CELLS..];
                dots_batch::<MORE, ANY>(walk, count, streams, cells, &[], these);
            }
        }
        (at, out) = (at + count, rest);
    }
    true
}

/// Sum of the drives of all rows at a position.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn drive_sum(codes: &[u8], first: usize, offsets: &[usize]) -> i32 {
    let mut sum = _mm512_setzero_si512();
    for offset in offsets {
        let codes = codes[first + offset..].first_chunk().expect("64 channels of a pixel");
        sum = _mm512_add_epi64(sum, _mm512_sad_epu8(load(codes), _mm512_setzero_si512()));
    }
    i32::try_from(_mm512_reduce_add_epi64(sum)).expect("at most 33,025 drives of a byte")
}
