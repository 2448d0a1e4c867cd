//! 256-bit loops: products of 16-bit numbers added in pairs to 32 bits (`vpmaddwd`), exact for full bytes.
//!
//! ```text
//! word        4 bytes b0 b1 b2 b3 of a lane:  even pair (b0, b2), odd pair (b1, b3), as 16-bit numbers
//! lane += x0 * y0 + x2 * y2;  lane += x1 * y1 + x3 * y3
//! ```
//!
//! Splitting even from odd bytes is a mask and a shift, so nothing is shuffled. `vpmaddubsw` needs half the
//! instructions but saturates its 16-bit pairs, and 2 * 255 * 127 does not fit: it serves where levels or drives have
//! few bits (`pairs`).
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::x86_64::*;
use std::ops::Range;

use self::narrow::Vectors;
use super::ops::{Ops, twins};
use super::{
    Cells, Conversion, Dither, Drives, Ends, Half, Rails, SignLaw, Sums, WriteCounts, WriteLaw,
    lanes, peak, scalar,
};
use crate::chip::crossbar::layout::{BLOCK_CELLS, BLOCK_ROWS, HALF_CELLS, HALF_COLUMNS, Layout};

mod dither;
mod fused;
mod gates;
mod narrow;
mod normalise;
mod one_sample;
mod pairs;
mod units;

/// Proof that the processor has AVX2 and counts bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Avx2(());

impl Avx2 {
    /// The token, where the processor and the system have the features.
    #[must_use]
    pub fn detect() -> Option<Self> {
        let there = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("popcnt");
        there.then_some(Self(()))
    }
}

/// Handed out by the token: functions compiled for its features.
pub(super) const OPS: Ops = Ops {
    read,
    read_conv: |_, _, _, _| false,
    convert,
    look_up: units::look_up,
    difference,
    stream_squares: normalise::stream_squares,
    scale: normalise::scale,
    latch: gates::latch,
    gate: gates::gate,
    turn: units::turn,
    read_columns,
    accumulate,
    dither: dither::dither,
    dither_words: dither::dither_words,
    may_move: fused::may_move,
    pulses,
    levels,
    pulse: Some(pulse),
    offset,
    index_squares,
    centre: normalise::centre,
    gate_totals,
    drive_totals,
    squares: normalise::squares,
    loud,
    signs,
    fused: fused::fused,
    one_sample: one_sample::one_sample,
    peaks: units::peaks,
    peak: peak::avx2,
    ..scalar::OPS
};

twins!("avx2,popcnt");

#[target_feature(enable = "avx2,popcnt")]
fn convert(currents: [&[i32]; 2], conversion: Conversion, live: usize, codes: &mut [i16]) -> Rails {
    lanes::convert(currents, conversion, live, codes)
}

#[target_feature(enable = "avx2,popcnt")]
fn difference(currents: [&[i32]; 2], sums: &mut [i32]) {
    scalar::difference(currents, sums);
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

/// Sum of the four 64-bit lanes.
#[target_feature(enable = "avx2,popcnt")]
fn total(v: __m256i) -> u64 {
    let v = _mm_add_epi64(_mm256_castsi256_si128(v), _mm256_extracti128_si256::<1>(v));
    let v = _mm_add_epi64(v, _mm_unpackhi_epi64(v, v));
    _mm_cvtsi128_si64(v).cast_unsigned()
}

/// Where the bytes of [`dots`] lie.
#[derive(Clone, Copy)]
struct Walk {
    /// Runs of vectors.
    runs: usize,
    /// Vectors of a run, and words of a stream it meets.
    quads: usize,
    /// Bytes from a run of vectors to the next.
    run: usize,
    /// Bytes from a stream's words of a run to those of the next run.
    words: usize,
    /// Bytes from a stream to the next.
    stride: usize,
    /// Sums from a stream to the next.
    out: usize,
}

/// Levels against drives: both unsigned.
const READ: u8 = 0;
/// Gates against drives: vectors are signed.
const GATES: u8 = 1;
/// Turned levels against gates: streams are signed.
const TURNED: u8 = 2;

/// Even and odd bytes as 16-bit numbers.
#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn split<const SIGNED: bool>(v: __m256i) -> [__m256i; 2] {
    if SIGNED {
        [_mm256_srai_epi16::<8>(_mm256_slli_epi16::<8>(v)), _mm256_srai_epi16::<8>(v)]
    } else {
        [_mm256_and_si256(v, _mm256_set1_epi16(0xff)), _mm256_srli_epi16::<8>(v)]
    }
}

/// Words of four bytes that are looked at together.
const QUADS: usize = 16;
/// Of which so many, at most, are taken one by one; otherwise all are.
const FEW: u32 = 12;

/// Which of 16 words are not 0 in all of N streams, a bit each: images have margins, and whole rows that are dark.
///
/// # Safety
/// Each stream, the first at `from` and the next `stride` bytes on, has 64 bytes there.
#[inline]
#[target_feature(enable = "avx2,popcnt")]
unsafe fn lit_quads<const N: usize>(from: *const u8, stride: usize) -> u32 {
    let mut any = [_mm256_setzero_si256(); 2];
    for i in 0..N {
        for (h, any) in any.iter_mut().enumerate() {
            // SAFETY: the caller says that 64 bytes lie there; unaligned loads read half of them each.
            let v = unsafe { _mm256_loadu_si256(from.add(i * stride + h * 32).cast()) };
            *any = _mm256_or_si256(*any, v);
        }
    }
    let zero = _mm256_setzero_si256();
    let dark = |v| _mm256_movemask_ps(_mm256_castsi256_ps(_mm256_cmpeq_epi32(v, zero)));
    !(dark(any[0]) | dark(any[1]) << 8).cast_unsigned() & 0xffff
}

/// Adds the products of one quad: a word of each of N streams, and H vectors.
///
/// # Safety
/// The word `quad` of each stream, the first at `x` and the next `stride` bytes on, and the 64 bytes `quad` at `v` lie
/// there.
#[inline]
#[target_feature(enable = "avx2,popcnt")]
unsafe fn dot<const KIND: u8, const N: usize, const H: usize>(
    acc: &mut [[__m256i; H]; N],
    x: *const u8,
    stride: usize,
    v: *const u8,
    quad: usize,
) {
    let mut w = [[_mm256_setzero_si256(); 2]; H];
    for (h, w) in w.iter_mut().enumerate() {
        // SAFETY: the caller says that 64 bytes lie there; each load reads half of them.
        let v = unsafe { _mm256_loadu_si256(v.add(quad * 64 + h * 32).cast()) };
        *w = if KIND == GATES { split::<true>(v) } else { split::<false>(v) };
    }
    for (i, acc) in acc.iter_mut().enumerate() {
        // SAFETY: the caller says that this word lies there; the read asks for no alignment.
        let word = unsafe { x.add(i * stride + quad * 4).cast::<i32>().read_unaligned() };
        let x = _mm256_set1_epi32(word);
        let x = if KIND == TURNED { split::<true>(x) } else { split::<false>(x) };
        for (acc, w) in acc.iter_mut().zip(w) {
            *acc = _mm256_add_epi32(*acc, _mm256_madd_epi16(x[0], w[0]));
            *acc = _mm256_add_epi32(*acc, _mm256_madd_epi16(x[1], w[1]));
        }
    }
}

/// [`dot`], or that of pairs that fit.
///
/// # Safety
/// As [`dot`].
#[inline]
#[target_feature(enable = "avx2,popcnt")]
unsafe fn either<const KIND: u8, const N: usize, const H: usize>(
    fits: bool,
    acc: &mut [[__m256i; H]; N],
    x: *const u8,
    stride: usize,
    v: *const u8,
    quad: usize,
) {
    match (fits, KIND) {
        // SAFETY: what the caller says.
        (false, _) => unsafe { dot::<KIND, N, H>(acc, x, stride, v, quad) },
        // SAFETY: what the caller says.
        (true, READ) => unsafe { narrow::dot::<true, N, H>(acc, x, stride, v, quad) },
        // SAFETY: what the caller says.
        (true, _) => unsafe { narrow::dot::<false, N, H>(acc, x, stride, v, quad) },
    }
}

/// `out[i] = sum over runs and quads of dot4(stream i, vector)`, 16 lanes a vector and up to 4 streams. Of the 16, the upper 8
/// are dark where H is 1.
#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn dots<const KIND: u8, const N: usize, const H: usize>(
    walk: Walk,
    pair_max: u16,
    streams: &[u8],
    vectors: &[u8],
    out: &mut [i32],
) {
    let Walk { runs, quads, run, words, stride, out: out_stride } = walk;
    assert!(runs * quads > 0, "there is something to multiply");
    assert!(
        streams.len() >= (runs - 1) * words + (N - 1) * stride + quads * 4,
        "every stream has its words"
    );
    assert!(vectors.len() >= (runs - 1) * run + quads * 64, "every vector lies inside");
    assert!(out.len() >= (N - 1) * out_stride + 16, "every sum has its place");
    let mut acc = [[_mm256_setzero_si256(); H]; N];
    // of what met levels that were taken 128 below what they are
    let mut below = [_mm256_setzero_si256(); N];
    for r in 0..runs {
        for first in (0..quads).step_by(QUADS) {
            let count = (quads - first).min(QUADS);
            let (x, v) = (r * words + first * 4, r * run + first * 64);
            // SAFETY: r < runs and first + count <= quads, so the first assertion above bounds 4 * count bytes of each
            // of the N streams, and the second 64 * count bytes of the vectors.
            let (x, v) = unsafe { (streams.as_ptr().add(x), vectors.as_ptr().add(v)) };
            if KIND != TURNED && count == QUADS {
                let (lit, pair) = if pair_max > 0 {
                    // SAFETY: 64 bytes of each stream lie there, as above.
                    unsafe { narrow::look::<N>(x, stride) }
                } else {
                    // SAFETY: 64 bytes of each stream lie there, as above.
                    (unsafe { lit_quads::<N>(x, stride) }, u16::MAX)
                };
                let fits = pair <= pair_max;
                if fits && KIND == READ {
                    // SAFETY: 64 bytes of each stream lie there, as above.
                    unsafe { narrow::add_up::<N>(&mut below, x, stride) };
                }
                if lit.count_ones() <= FEW {
                    let mut lit = lit;
                    while lit != 0 {
                        let quad = lit.trailing_zeros() as usize;
                        // SAFETY: a quad below 16, whose bytes lie there, as above; pairs fit where that is said.
                        unsafe { either::<KIND, N, H>(fits, &mut acc, x, stride, v, quad) };
                        lit &= lit - 1;
                    }
                    continue;
                }
                if fits {
                    for quad in 0..QUADS {
                        // SAFETY: as above.
                        unsafe { either::<KIND, N, H>(true, &mut acc, x, stride, v, quad) };
                    }
                    continue;
                }
            }
            for quad in 0..count {
                // SAFETY: a quad below `count`, whose bytes lie there, as above.
                unsafe { dot::<KIND, N, H>(&mut acc, x, stride, v, quad) };
            }
        }
    }
    for (i, (acc, below)) in acc.iter().zip(below).enumerate() {
        for h in 0..2 {
            let sum = match acc.get(h) {
                Some(&sum) if KIND == READ => _mm256_add_epi32(sum, narrow::raised(below)),
                Some(&sum) => sum,
                None => _mm256_setzero_si256(),
            };
            // SAFETY: i < N and h < 2, so the third assertion above bounds these 8 sums, and `out` is borrowed for
            // writing.
            unsafe {
                _mm256_storeu_si256(out.as_mut_ptr().add(i * out_stride + h * 8).cast(), sum);
            }
        }
    }
}

/// [`dots`] for any number of streams.
#[target_feature(enable = "avx2,popcnt")]
fn dots_batch<const KIND: u8>(
    walk: Walk,
    samples: usize,
    Vectors { pair_max, live }: Vectors,
    streams: &[u8],
    vectors: &[u8],
    out: &mut [i32],
) {
    if live == 0 {
        for out in out.chunks_mut(walk.out).take(samples) {
            out[..HALF_COLUMNS].fill(0);
        }
        return;
    }
    for from in (0..samples).step_by(4) {
        let x = &streams[from * walk.stride..];
        let out = &mut out[from * walk.out..];
        match ((samples - from).min(4), live) {
            (1, 1) => dots::<KIND, 1, 1>(walk, pair_max, x, vectors, out),
            (2, 1) => dots::<KIND, 2, 1>(walk, pair_max, x, vectors, out),
            (3, 1) => dots::<KIND, 3, 1>(walk, pair_max, x, vectors, out),
            (_, 1) => dots::<KIND, 4, 1>(walk, pair_max, x, vectors, out),
            (1, _) => dots::<KIND, 1, 2>(walk, pair_max, x, vectors, out),
            (2, _) => dots::<KIND, 2, 2>(walk, pair_max, x, vectors, out),
            (3, _) => dots::<KIND, 3, 2>(walk, pair_max, x, vectors, out),
            (_, _) => dots::<KIND, 4, 2>(walk, pair_max, x, vectors, out),
        }
    }
}

#[target_feature(enable = "avx2,popcnt")]
fn read(cells: &[u8], drives: Drives<'_>, samples: Range<usize>, out: &mut [i32]) {
    if cells.is_empty() {
        return out.fill(0);
    }
    let walk = Walk {
        runs: drives.blocks(),
        quads: QUADS,
        run: BLOCK_CELLS,
        words: drives.samples() * BLOCK_ROWS,
        stride: BLOCK_ROWS,
        out: 32,
    };
    let streams = &drives.codes()[samples.start * BLOCK_ROWS..];
    let together = pairs::together(drives.greatest());
    for half in 0..2 {
        let (out, vectors) = (&mut out[half * HALF_COLUMNS..], &cells[half * HALF_CELLS..]);
        if let Some(together) = together {
            pairs::batch(together, walk, samples.len(), streams, vectors, out);
            continue;
        }
        // looked at once for all samples: of few, that would take longer than it saves
        let known = if samples.len() < 4 {
            Vectors::ANY
        } else {
            Vectors::of_levels(narrow::greatest::<false>(
                vectors,
                (walk.runs, walk.run, walk.quads),
            ))
        };
        dots_batch::<READ>(walk, samples.len(), known, streams, vectors, out);
    }
}

#[target_feature(enable = "avx2,popcnt")]
fn accumulate(turned: &[u8], stride: usize, gates: &[i8], sums: &mut Half<i32>) {
    let walk =
        Walk { runs: 1, quads: gates.len() / 64, run: 0, words: 0, stride, out: HALF_COLUMNS };
    // SAFETY: i8 and u8 have the same size and every bit pattern is valid for both.
    let gates = unsafe { std::slice::from_raw_parts(gates.as_ptr().cast::<u8>(), gates.len()) };
    let known = Vectors::of_gates(narrow::greatest::<true>(gates, (1, 0, walk.quads)));
    dots_batch::<GATES>(walk, BLOCK_ROWS, known, turned, gates, sums);
}

/// The transposed read: levels are turned, 4 columns of a row to a word, once for all samples.
#[target_feature(enable = "avx2,popcnt")]
fn read_columns(plane: &[u8], layout: Layout, gates: Drives<'_>, out: &mut [i32]) {
    // [4 groups of 16 rows][words of 4 columns][16 rows][4 columns]
    let quads = gates.blocks() * 16;
    let mut turned = vec![[0; 64]; 4 * quads];
    let walk = Walk {
        runs: gates.blocks(),
        quads: 16,
        run: 16 * 64,
        words: gates.samples() * BLOCK_ROWS,
        stride: BLOCK_ROWS,
        out: layout.rows_padded(),
    };
    for block in 0..layout.blocks() {
        for panel in 0..layout.panels() {
            let cells = &plane[(panel * layout.blocks() + block) * BLOCK_CELLS..][..BLOCK_CELLS];
            for (h, cells) in cells.as_chunks::<HALF_CELLS>().0.iter().enumerate() {
                turn(cells, panel * 8 + h * 4, quads, &mut turned);
            }
        }
        for (group, vectors) in turned.chunks_exact(quads).enumerate() {
            let out = &mut out[block * BLOCK_ROWS + 16 * group..];
            let gates = (gates.samples(), gates.codes());
            let turned = vectors.as_flattened();
            dots_batch::<TURNED>(walk, gates.0, Vectors::ANY, gates.1, turned, out);
        }
    }
}

/// Turns a half block: 4 columns x 4 rows at a time.
#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn turn(cells: &Half<u8>, quad: usize, quads: usize, turned: &mut [[u8; 64]]) {
    let order = _mm_setr_epi8(0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15);
    for (group, cells) in cells.as_chunks::<64>().0.iter().enumerate() {
        for (q, cells) in cells.as_chunks::<16>().0.iter().enumerate() {
            let to = &mut turned[group / 4 * quads + quad + q];
            let to = &mut to.as_chunks_mut::<16>().0[group % 4];
            // SAFETY: the reference covers the 16 bytes that an unaligned load reads.
            let v = unsafe { _mm_loadu_si128(cells.as_ptr().cast()) };
            // SAFETY: the reference covers the 16 bytes that an unaligned store writes.
            unsafe { _mm_storeu_si128(to.as_mut_ptr().cast(), _mm_shuffle_epi8(v, order)) }
        }
    }
}
