//! 256-bit loops: products of 16-bit numbers added in pairs to 32 bits (`vpmaddwd`), exact for full bytes.
//!
//! ```text
//! word        4 bytes b0 b1 b2 b3 of a lane:  even pair (b0, b2), odd pair (b1, b3), as 16-bit numbers
//! lane += x0 * y0 + x2 * y2;  lane += x1 * y1 + x3 * y3
//! ```
//!
//! Splitting even from odd bytes is a mask and a shift, so nothing is shuffled. `vpmaddubsw` would need half
//! the instructions but saturates its 16-bit pairs: 2 * 255 * 127 does not fit.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::x86_64::*;
use std::ops::Range;

use super::{Cells, Dither, Half, Write, WriteCounts};
use crate::chip::crossbar::layout::{BLOCK_CELLS, BLOCK_ROWS, HALF_CELLS, HALF_COLUMNS, Layout};
use crate::num::draw::Place;

mod dither;
mod program;

/// Proof that the processor has AVX2 and counts bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Avx2(());

/// Panels whose levels are turned at a time by the transposed read.
const TURNED_PANELS: usize = 8;
/// Words of 4 columns in as many panels.
const TURNED_QUADS: usize = TURNED_PANELS * 8;

impl Avx2 {
    /// The token, where the processor and the system have the features.
    #[must_use]
    pub fn detect() -> Option<Self> {
        let there = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("popcnt");
        there.then_some(Self(()))
    }

    pub(super) fn read(
        self,
        plane: &[u8],
        blocks: Range<usize>,
        drives: &[u8],
        stride: usize,
        out: &mut [i32],
    ) {
        // SAFETY: `self` exists only where `detect` found every feature the function is compiled for.
        unsafe { read(plane, blocks, drives, stride, out) }
    }

    pub(super) fn read_columns(self, plane: &[u8], layout: Layout, gates: &[u8], out: &mut [i32]) {
        // SAFETY: `self` exists only where `detect` found every feature the function is compiled for.
        unsafe { read_columns(plane, layout, gates, out) }
    }

    pub(super) fn accumulate(
        self,
        drives: &[u8],
        stride: usize,
        gates: &[i8],
        sums: &mut Half<i32>,
    ) {
        // SAFETY: `self` exists only where `detect` found every feature the function is compiled for.
        unsafe { accumulate(drives, stride, gates, sums) }
    }

    pub(super) fn dither(
        self,
        place: &Place,
        rows: usize,
        column: usize,
        block: usize,
        out: &mut Half<u8>,
    ) {
        // SAFETY: `self` exists only where `detect` found every feature the function is compiled for.
        unsafe { dither::dither(place, rows, column, block, out) }
    }

    pub(super) fn program(
        self,
        cells: Cells<'_>,
        sums: &Half<i32>,
        write: &Write,
        dither: Dither<'_>,
    ) -> WriteCounts {
        // SAFETY: `self` exists only where `detect` found every feature the function is compiled for.
        unsafe { program::program(cells, sums, write, dither) }
    }
}

#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn load(bytes: &[u8; 32]) -> __m256i {
    // SAFETY: the reference covers the 32 bytes that an unaligned load reads.
    unsafe { _mm256_loadu_si256(bytes.as_ptr().cast()) }
}

#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn store(bytes: &mut [u8; 32], v: __m256i) {
    // SAFETY: the reference covers the 32 bytes that an unaligned store writes.
    unsafe { _mm256_storeu_si256(bytes.as_mut_ptr().cast(), v) }
}

#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn load_sums(sums: &[i32; 8]) -> __m256i {
    // SAFETY: the reference covers the 8 sums, 32 bytes, that an unaligned load reads.
    unsafe { _mm256_loadu_si256(sums.as_ptr().cast()) }
}

/// Where the bytes of [`dots`] lie.
#[derive(Clone, Copy)]
struct Walk {
    /// Runs of vectors.
    runs: usize,
    /// Vectors of a run, and words of a stream it meets.
    quads: usize,
    /// Bytes from a run to the next.
    run: usize,
    /// Bytes from a stream to the next.
    stride: usize,
    /// Sums from a stream to the next.
    out: usize,
}

/// `out[i] += sum over runs and quads of dot4(stream i, vector)`, 16 lanes a vector and up to 4 streams.
/// The bytes of vectors are gates when `SIGNED`, levels otherwise.
#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn dots<const SIGNED: bool, const N: usize>(
    walk: Walk,
    streams: &[u8],
    vectors: &[u8],
    out: &mut [i32],
) {
    let Walk { runs, quads, run, stride, out: out_stride } = walk;
    if runs * quads == 0 {
        return;
    }
    assert!(streams.len() >= (N - 1) * stride + runs * quads * 4, "every stream has its words");
    assert!(vectors.len() >= (runs - 1) * run + quads * 64, "every vector lies inside");
    assert!(out.len() >= (N - 1) * out_stride + 16, "every sum has its place");
    let low = _mm256_set1_epi16(0xff);
    let mut acc = [[_mm256_setzero_si256(); 2]; N];
    for r in 0..runs {
        for quad in 0..quads {
            let (mut even, mut odd) = ([low; 2], [low; 2]);
            for h in 0..2 {
                // SAFETY: r < runs, quad < quads and h < 2, so the second assertion above bounds the last of
                // these 32 bytes.
                let w = unsafe {
                    _mm256_loadu_si256(vectors.as_ptr().add(r * run + quad * 64 + h * 32).cast())
                };
                (even[h], odd[h]) = if SIGNED {
                    (_mm256_srai_epi16::<8>(_mm256_slli_epi16::<8>(w)), _mm256_srai_epi16::<8>(w))
                } else {
                    (_mm256_and_si256(w, low), _mm256_srli_epi16::<8>(w))
                };
            }
            for (i, acc) in acc.iter_mut().enumerate() {
                let at = i * stride + (r * quads + quad) * 4;
                // SAFETY: i < N and r * quads + quad < runs * quads, so the first assertion above bounds the
                // last of these 4 bytes; the read asks for no alignment.
                let word = unsafe { streams.as_ptr().add(at).cast::<i32>().read_unaligned() };
                let x = _mm256_set1_epi32(word);
                let (x_even, x_odd) = (_mm256_and_si256(x, low), _mm256_srli_epi16::<8>(x));
                for h in 0..2 {
                    acc[h] = _mm256_add_epi32(acc[h], _mm256_madd_epi16(x_even, even[h]));
                    acc[h] = _mm256_add_epi32(acc[h], _mm256_madd_epi16(x_odd, odd[h]));
                }
            }
        }
    }
    for (i, acc) in acc.iter().enumerate() {
        for (h, sum) in acc.iter().enumerate() {
            // SAFETY: i < N and h < 2, so the third assertion above bounds these 8 sums.
            let at = unsafe { out.as_mut_ptr().add(i * out_stride + h * 8) };
            // SAFETY: the 8 sums at `at` lie inside `out`, as above.
            let before = unsafe { _mm256_loadu_si256(at.cast()) };
            // SAFETY: the 8 sums at `at` lie inside `out`, which is borrowed for writing.
            unsafe { _mm256_storeu_si256(at.cast(), _mm256_add_epi32(before, *sum)) }
        }
    }
}

/// [`dots`] for any number of streams.
#[target_feature(enable = "avx2,popcnt")]
fn dots_batch<const SIGNED: bool>(
    walk: Walk,
    samples: usize,
    streams: &[u8],
    vectors: &[u8],
    out: &mut [i32],
) {
    for from in (0..samples).step_by(4) {
        let x = &streams[from * walk.stride..];
        let out = &mut out[from * walk.out..];
        match samples - from {
            1 => dots::<SIGNED, 1>(walk, x, vectors, out),
            2 => dots::<SIGNED, 2>(walk, x, vectors, out),
            3 => dots::<SIGNED, 3>(walk, x, vectors, out),
            _ => dots::<SIGNED, 4>(walk, x, vectors, out),
        }
    }
}

#[target_feature(enable = "avx2,popcnt")]
fn read(plane: &[u8], blocks: Range<usize>, drives: &[u8], stride: usize, out: &mut [i32]) {
    let (from, to) = (blocks.start.min(blocks.end), blocks.end);
    let samples = out.len() / 32;
    out.fill(0);
    let walk = Walk { runs: to - from, quads: 16, run: BLOCK_CELLS, stride, out: 32 };
    for half in 0..2 {
        let plane = &plane[from * BLOCK_CELLS..];
        let plane = if plane.is_empty() { plane } else { &plane[half * HALF_CELLS..] };
        let out = &mut out[half * HALF_COLUMNS..];
        if samples > 0 {
            dots_batch::<false>(walk, samples, &drives[from * BLOCK_ROWS..], plane, out);
        }
    }
}

#[target_feature(enable = "avx2,popcnt")]
fn accumulate(drives: &[u8], stride: usize, gates: &[i8], sums: &mut Half<i32>) {
    sums.fill(0);
    let walk = Walk { runs: 1, quads: stride / 4, run: 0, stride, out: HALF_COLUMNS };
    // SAFETY: i8 and u8 have the same size and every bit pattern is valid for both.
    let gates = unsafe { std::slice::from_raw_parts(gates.as_ptr().cast::<u8>(), gates.len()) };
    dots_batch::<true>(walk, BLOCK_ROWS, drives, gates, sums);
}

/// The transposed read: levels are turned, 4 columns of a row to a word, once for all samples.
#[target_feature(enable = "avx2,popcnt")]
fn read_columns(plane: &[u8], layout: Layout, gates: &[u8], out: &mut [i32]) {
    out.fill(0);
    let samples = gates.len() / layout.columns_padded();
    // [4 groups of 16 rows][words of 4 columns][16 rows][4 columns]
    let mut turned = [[[0; 64]; TURNED_QUADS]; 4];
    for first in (0..layout.panels()).step_by(TURNED_PANELS) {
        let panels = first..layout.panels().min(first + TURNED_PANELS);
        let walk = Walk {
            runs: 1,
            quads: panels.len() * 8,
            run: 0,
            stride: layout.columns_padded(),
            out: layout.rows_padded(),
        };
        for block in 0..layout.blocks() {
            for (p, panel) in panels.clone().enumerate() {
                let cells =
                    &plane[(panel * layout.blocks() + block) * BLOCK_CELLS..][..BLOCK_CELLS];
                for (h, cells) in cells.as_chunks::<HALF_CELLS>().0.iter().enumerate() {
                    turn(cells, p * 8 + h * 4, &mut turned);
                }
            }
            for (group, vectors) in turned.iter().enumerate() {
                let out = &mut out[block * BLOCK_ROWS + 16 * group..];
                let gates = &gates[first * 32..];
                dots_batch::<false>(walk, samples, gates, vectors.as_flattened(), out);
            }
        }
    }
}

/// Turns a half block: 4 columns x 4 rows at a time.
#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn turn(cells: &Half<u8>, quad: usize, turned: &mut [[[u8; 64]; TURNED_QUADS]; 4]) {
    let order = _mm_setr_epi8(0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15);
    for (group, cells) in cells.as_chunks::<64>().0.iter().enumerate() {
        for (q, cells) in cells.as_chunks::<16>().0.iter().enumerate() {
            let to = &mut turned[group / 4][quad + q].as_chunks_mut::<16>().0[group % 4];
            // SAFETY: the reference covers the 16 bytes that an unaligned load reads.
            let v = unsafe { _mm_loadu_si128(cells.as_ptr().cast()) };
            // SAFETY: the reference covers the 16 bytes that an unaligned store writes.
            unsafe { _mm_storeu_si128(to.as_mut_ptr().cast(), _mm_shuffle_epi8(v, order)) }
        }
    }
}
