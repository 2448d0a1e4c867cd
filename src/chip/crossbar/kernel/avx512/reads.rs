//! Sums of many reads: drives are the vectors, four reads of 16 rows each, and gates the words that meet them.
//!
//! ```text
//! quads     [4 reads][4 sixteens of rows][16 rows][4 reads]        of 256 reads, put together from [read][64 rows]
//! lane r    += code[b..b+4][r] . gate[b..b+4][c]                   a sum a row, a register a column and 16 rows
//! ```
//!
//! Both are met in the order in which they lie. Sums lie by column until all reads are taken, and are turned then.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::x86_64::*;

use super::turn::{dwords, interleave};
use super::{as_bytes, load, load_sums, store, store_sums};
use crate::chip::crossbar::kernel::Half;
use crate::chip::crossbar::layout::{BLOCK_ROWS, HALF_COLUMNS};

/// Words of four reads that are taken together.
const QUADS: usize = 64;

/// 64 rows of four reads, the reads of a row side by side.
type Quad = [[u8; 64]; 4];

#[repr(align(64))]
struct Quads([Quad; QUADS]);

/// See [`Kernel::accumulate_reads`](super::super::Kernel::accumulate_reads).
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(super) fn accumulate(
    (codes, rows): (&[u8], usize),
    (gates, stride, first): (&[i8], usize, usize),
    sums: &mut [Half<i32>],
) {
    sums.iter_mut().for_each(|sums| sums.fill(0));
    let mut quads = Quads([[[0; 64]; 4]; QUADS]);
    let gates = as_bytes(gates);
    for (at, codes) in codes.chunks(4 * QUADS * BLOCK_ROWS).enumerate() {
        let count = codes.len().div_ceil(4 * BLOCK_ROWS);
        let quads = &mut quads.0[..count];
        put_together(codes, quads);
        for (sums, gates) in sums.iter_mut().zip(gates.chunks_exact(HALF_COLUMNS * stride)) {
            let gates = &gates.as_chunks::<64>().0[first / 4 + at * QUADS..][..count];
            match rows.div_ceil(16) {
                1 => tile::<1, 16>(quads, gates, 0, sums),
                2 => (0..2).for_each(|part| tile::<2, 8>(quads, gates, part * 8, sums)),
                3 => (0..4).for_each(|part| tile::<3, 4>(quads, gates, part * 4, sums)),
                _ => (0..4).for_each(|part| tile::<4, 4>(quads, gates, part * 4, sums)),
            }
        }
    }
    sums.iter_mut().for_each(|sums| turn(sums));
}

/// Four reads of a row side by side; reads beyond the last drive nothing.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn put_together(codes: &[u8], quads: &mut [Quad]) {
    for (codes, quad) in codes.chunks(4 * BLOCK_ROWS).zip(quads) {
        let mut rows = [_mm512_setzero_si512(); 4];
        for (row, codes) in rows.iter_mut().zip(codes.as_chunks::<BLOCK_ROWS>().0) {
            *row = load(codes);
        }
        for (quad, v) in quad.iter_mut().zip(interleave(rows)) {
            store(quad, v);
        }
    }
}

/// Adds the products of the first R sixteens of rows and C columns from `first` on; sums lie `[16 columns][64 rows]`.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn tile<const R: usize, const C: usize>(
    quads: &[Quad],
    gates: &[[u8; 64]],
    first: usize,
    sums: &mut Half<i32>,
) {
    let mut acc = [[_mm512_setzero_si512(); R]; C];
    let columns = &mut sums.as_chunks_mut::<BLOCK_ROWS>().0[first..][..C];
    for (acc, column) in acc.iter_mut().zip(&*columns) {
        for (acc, sums) in acc.iter_mut().zip(column.as_chunks::<16>().0) {
            *acc = load_sums(sums);
        }
    }
    for (quad, gates) in quads.iter().zip(gates) {
        let mut x = [_mm512_setzero_si512(); R];
        for (x, quad) in x.iter_mut().zip(quad) {
            *x = load(quad);
        }
        let gates = &gates.as_chunks::<4>().0[first..][..C];
        for (acc, gate) in acc.iter_mut().zip(gates) {
            let gate = _mm512_set1_epi32(i32::from_le_bytes(*gate));
            for (acc, x) in acc.iter_mut().zip(x) {
                *acc = _mm512_dpbusd_epi32(*acc, x, gate);
            }
        }
    }
    for (acc, column) in acc.iter().zip(columns) {
        for (acc, sums) in acc.iter().zip(column.as_chunks_mut::<16>().0) {
            store_sums(sums, *acc);
        }
    }
}

/// `[16 columns][64 rows]` becomes `[64 rows][16 columns]`.
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn turn(sums: &mut Half<i32>) {
    let by_column = *sums;
    let columns = by_column.as_chunks::<BLOCK_ROWS>().0;
    for (sixteen, out) in sums.as_chunks_mut::<256>().0.iter_mut().enumerate() {
        let mut v = [_mm512_setzero_si512(); 16];
        for (v, column) in v.iter_mut().zip(columns) {
            *v = load_sums(&column.as_chunks::<16>().0[sixteen]);
        }
        dwords(&mut v);
        for (out, v) in out.as_chunks_mut::<16>().0.iter_mut().zip(v) {
            store_sums(out, v);
        }
    }
}
