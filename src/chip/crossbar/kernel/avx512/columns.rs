//! The transposed read: levels are turned, 4 columns of a row to a word, once for all samples.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::x86_64::*;
use std::ops::Range;

use super::{ANY, TURNED, Walk, dots_batch, load, store};
use crate::chip::crossbar::kernel::{Drives, Half};
use crate::chip::crossbar::layout::{BLOCK_CELLS, BLOCK_ROWS, HALF_CELLS, Layout};

/// Levels of one block of rows, columns side by side: `[4 groups of 16 rows][words of 4 columns][16 rows][4 columns]`.
pub(in crate::chip::crossbar::kernel) struct Turned {
    words: aligned_vec::AVec<u8>,
    blocks: usize,
}

impl Turned {
    /// Room for so many blocks of 64 columns.
    pub(in crate::chip::crossbar::kernel) fn new(blocks: usize) -> Self {
        Self { words: aligned_vec::avec![0; blocks * BLOCK_ROWS * 64], blocks }
    }

    /// Bytes of a group of 16 rows.
    pub(in crate::chip::crossbar::kernel) const fn group_bytes(&self) -> usize {
        self.blocks * 16 * 64
    }

    /// The groups from one on.
    pub(in crate::chip::crossbar::kernel) fn groups(&self, first: usize) -> &[u8] {
        &self.words[first * self.group_bytes()..]
    }
}

#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(super) fn read_columns(plane: &[u8], layout: Layout, gates: Drives<'_>, out: &mut [i32]) {
    let rows = layout.rows_padded();
    let mut turned = Turned::new(gates.blocks());
    for block in 0..layout.blocks() {
        turn_columns(plane, layout, block, &mut turned);
        for half in 0..2 {
            let out = &mut out[block * BLOCK_ROWS + 32 * half..];
            pair(gates, 0..gates.samples(), rows, &turned, half, out);
        }
    }
}

/// Sums of 32 rows for some samples.
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(in crate::chip::crossbar::kernel) fn pair(
    gates: Drives<'_>,
    samples: Range<usize>,
    rows: usize,
    turned: &Turned,
    pair: usize,
    out: &mut [i32],
) {
    let walk = Walk {
        runs: gates.blocks(),
        quads: 16,
        last: 16,
        run: 16 * 64,
        half: turned.group_bytes(),
        words: gates.samples() * BLOCK_ROWS,
        stride: BLOCK_ROWS,
        out: rows,
    };
    let streams = &gates.codes()[samples.start * BLOCK_ROWS..];
    dots_batch::<TURNED, ANY>(walk, samples.len(), streams, turned.groups(2 * pair), &[], out);
}

/// Turns one block of rows. Columns of a panel that does not exist become 0.
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(in crate::chip::crossbar::kernel) fn turn_columns(
    plane: &[u8],
    layout: Layout,
    block: usize,
    turned: &mut Turned,
) {
    let group = turned.group_bytes();
    for panel in 0..2 * turned.blocks {
        if panel < layout.panels() {
            let cells = &plane[(panel * layout.blocks() + block) * BLOCK_CELLS..][..BLOCK_CELLS];
            for (h, cells) in cells.as_chunks::<HALF_CELLS>().0.iter().enumerate() {
                turn(cells, (panel * 8 + h * 4) * 64, group, &mut turned.words);
            }
        } else {
            for words in turned.words.chunks_exact_mut(group) {
                words[panel * 8 * 64..][..8 * 64].fill(0);
            }
        }
    }
}

/// Turns a half block: `[4 rows, 4 columns each]` of four vectors become 16 rows of 4 columns.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn turn(cells: &Half<u8>, at: usize, group: usize, words: &mut [u8]) {
    // Byte [quarter of 4 columns][row][column] of a vector comes from its byte [column][row].
    let mut order = [0u8; 64];
    for (to, from) in (0u8..).zip(order.iter_mut()) {
        *from = (to / 16 * 4 + to % 4) * 4 + to / 4 % 4;
    }
    let order = load(&order);
    let (cells, _) = cells.as_chunks::<64>();
    for (cells, words) in cells.chunks_exact(4).zip(words.chunks_exact_mut(group)) {
        let to = words[at..].as_chunks_mut::<64>().0;
        let a = _mm512_permutexvar_epi8(order, load(&cells[0]));
        let b = _mm512_permutexvar_epi8(order, load(&cells[1]));
        let c = _mm512_permutexvar_epi8(order, load(&cells[2]));
        let d = _mm512_permutexvar_epi8(order, load(&cells[3]));
        // A 4 x 4 transposition of 128-bit quarters.
        let (ab, cd) = (_mm512_shuffle_i32x4::<0x44>(a, b), _mm512_shuffle_i32x4::<0x44>(c, d));
        store(&mut to[0], _mm512_shuffle_i32x4::<0x88>(ab, cd));
        store(&mut to[1], _mm512_shuffle_i32x4::<0xdd>(ab, cd));
        let (ab, cd) = (_mm512_shuffle_i32x4::<0xee>(a, b), _mm512_shuffle_i32x4::<0xee>(c, d));
        store(&mut to[2], _mm512_shuffle_i32x4::<0x88>(ab, cd));
        store(&mut to[3], _mm512_shuffle_i32x4::<0xdd>(ab, cd));
    }
}
