//! 512-bit loops: four products a lane and instruction (`vpdpbusd`), exact for full bytes.
//!
//! ```text
//! lane += u0 * s0 + u1 * s1 + u2 * s2 + u3 * s3          u unsigned bytes, s signed bytes, i32 lane
//! read         u = drives,  s = level - 128;   v = sum + 128 * sum of drives
//! accumulate   u = drives,  s = gates
//! transposed   u = levels,  s = gates (0..=127)
//! ```
//!
//! All three are one loop, [`dots`]: a few streams of 4-byte words against vectors of 16 lanes x 4 bytes,
//! held in registers for up to 12 streams x 2 vectors, so that a loaded vector is used that often. The
//! four products of a lane add up to at most 4 * 255 * 128 in size, far inside the instruction's i32.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::x86_64::*;
use std::ops::Range;

use super::{Cells, Dither, Half, Write, WriteCounts};
use crate::chip::crossbar::layout::{BLOCK_CELLS, BLOCK_ROWS, HALF_CELLS, HALF_COLUMNS, Layout};
use crate::num::draw::Place;

mod dither;
mod program;

/// Proof that the processor has AVX-512 F, BW, VL, VNNI and VBMI, and counts bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Avx512(());

/// Panels whose levels are turned at a time by the transposed read.
const TURNED_PANELS: usize = 8;
/// Words of 4 columns in as many panels.
const TURNED_QUADS: usize = TURNED_PANELS * 8;

impl Avx512 {
    /// The token, where the processor and the system have the features.
    #[must_use]
    pub fn detect() -> Option<Self> {
        let there = is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512bw")
            && is_x86_feature_detected!("avx512vl")
            && is_x86_feature_detected!("avx512vnni")
            && is_x86_feature_detected!("avx512vbmi")
            && is_x86_feature_detected!("popcnt");
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

/// Levels against drives.
const READ: u8 = 0;
/// Gates against drives; overwrites the sums.
const GATES: u8 = 1;
/// Turned levels against gates.
const TURNED: u8 = 2;

/// Where the bytes of [`dots`] lie: streams of words, and vectors in runs.
#[derive(Clone, Copy)]
struct Walk {
    /// Runs of vectors.
    runs: usize,
    /// Vectors of a run, and words of a stream it meets.
    quads: usize,
    /// Bytes from a run to the next.
    run: usize,
    /// Bytes from a vector to the one beside it.
    half: usize,
    /// Bytes from a stream to the next.
    stride: usize,
    /// Sums from a stream to the next.
    out: usize,
}

#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn load(bytes: &[u8; 64]) -> __m512i {
    // SAFETY: the reference covers the 64 bytes that an unaligned load reads.
    unsafe { _mm512_loadu_si512(bytes.as_ptr().cast()) }
}

#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn store(bytes: &mut [u8; 64], v: __m512i) {
    // SAFETY: the reference covers the 64 bytes that an unaligned store writes.
    unsafe { _mm512_storeu_si512(bytes.as_mut_ptr().cast(), v) }
}

#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn load_sums(sums: &[i32; 16]) -> __m512i {
    // SAFETY: the reference covers the 16 sums, 64 bytes, that an unaligned load reads.
    unsafe { _mm512_loadu_si512(sums.as_ptr().cast()) }
}

/// `out[i][h] = sum over runs and quads of dot4(stream i, vector h)`, added to what is there unless `GATES`.
///
/// `CHAINS` sums a lane hide the latency of the instruction where there are few streams; the quads
/// must divide by it.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn dots<const KIND: u8, const N: usize, const H: usize, const CHAINS: usize>(
    walk: Walk,
    streams: &[u8],
    vectors: &[u8],
    out: &mut [i32],
) {
    let Walk { runs, quads, run, half, stride, out: out_stride } = walk;
    if runs * quads == 0 {
        if KIND == GATES {
            out.fill(0);
        }
        return;
    }
    assert!(quads.is_multiple_of(CHAINS), "no vector is left over");
    assert!(streams.len() >= (N - 1) * stride + runs * quads * 4, "every stream has its words");
    assert!(vectors.len() >= (runs - 1) * run + (H - 1) * half + quads * 64, "vectors lie inside");
    assert!(out.len() >= (N - 1) * out_stride + H * 16, "every sum has its place");
    let flip = _mm512_set1_epi8(i8::MIN);
    let mut acc = [[[_mm512_setzero_si512(); H]; N]; CHAINS];
    for r in 0..runs {
        for step in 0..quads / CHAINS {
            for (chain, acc) in acc.iter_mut().enumerate() {
                let quad = step * CHAINS + chain;
                let mut w = [flip; H];
                for (h, w) in w.iter_mut().enumerate() {
                    // SAFETY: r < runs, h < H and quad < quads, so the second assertion above bounds the
                    // last of these 64 bytes.
                    *w = unsafe {
                        _mm512_loadu_si512(
                            vectors.as_ptr().add(r * run + h * half + quad * 64).cast(),
                        )
                    };
                    if KIND == READ {
                        *w = _mm512_xor_si512(*w, flip);
                    }
                }
                for (i, acc) in acc.iter_mut().enumerate() {
                    let at = i * stride + (r * quads + quad) * 4;
                    // SAFETY: i < N and r * quads + quad < runs * quads, so the first assertion above bounds
                    // the last of these 4 bytes; the read asks for no alignment.
                    let word = unsafe { streams.as_ptr().add(at).cast::<i32>().read_unaligned() };
                    let x = _mm512_set1_epi32(word);
                    for (acc, w) in acc.iter_mut().zip(w) {
                        *acc = if KIND == TURNED {
                            _mm512_dpbusd_epi32(*acc, w, x)
                        } else {
                            _mm512_dpbusd_epi32(*acc, x, w)
                        };
                    }
                }
            }
        }
    }
    for i in 0..N {
        for h in 0..H {
            let mut sum = acc[0][i][h];
            for acc in &acc[1..] {
                sum = _mm512_add_epi32(sum, acc[i][h]);
            }
            // SAFETY: i < N and h < H, so the third assertion above bounds these 16 sums.
            let at = unsafe { out.as_mut_ptr().add(i * out_stride + h * 16) };
            if KIND != GATES {
                // SAFETY: the 16 sums at `at` lie inside `out`, as above.
                sum = _mm512_add_epi32(sum, unsafe { _mm512_loadu_si512(at.cast()) });
            }
            // SAFETY: the 16 sums at `at` lie inside `out`, which is borrowed for writing.
            unsafe { _mm512_storeu_si512(at.cast(), sum) }
        }
    }
}

/// [`dots`] with two vectors side by side for any number of samples, in even groups of at most 12.
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn dots_batch<const KIND: u8>(
    walk: Walk,
    samples: usize,
    streams: &[u8],
    vectors: &[u8],
    out: &mut [i32],
) {
    let groups = samples.div_ceil(12);
    for group in 0..groups {
        let (from, to) = (samples * group / groups, samples * (group + 1) / groups);
        let x = &streams[from * walk.stride..];
        let out = &mut out[from * walk.out..];
        match to - from {
            1 => dots::<KIND, 1, 2, 4>(walk, x, vectors, out),
            2 => dots::<KIND, 2, 2, 4>(walk, x, vectors, out),
            3 => dots::<KIND, 3, 2, 2>(walk, x, vectors, out),
            4 => dots::<KIND, 4, 2, 2>(walk, x, vectors, out),
            5 => dots::<KIND, 5, 2, 1>(walk, x, vectors, out),
            6 => dots::<KIND, 6, 2, 1>(walk, x, vectors, out),
            7 => dots::<KIND, 7, 2, 1>(walk, x, vectors, out),
            8 => dots::<KIND, 8, 2, 1>(walk, x, vectors, out),
            9 => dots::<KIND, 9, 2, 1>(walk, x, vectors, out),
            10 => dots::<KIND, 10, 2, 1>(walk, x, vectors, out),
            11 => dots::<KIND, 11, 2, 1>(walk, x, vectors, out),
            12 => dots::<KIND, 12, 2, 1>(walk, x, vectors, out),
            _ => unreachable!("a group has 1 to 12 samples"),
        }
    }
}

/// Sum of bytes, a multiple of 64 of them.
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn byte_sum(bytes: &[u8]) -> i32 {
    let mut sum = _mm512_setzero_si512();
    for bytes in bytes.as_chunks().0 {
        sum = _mm512_add_epi64(sum, _mm512_sad_epu8(load(bytes), _mm512_setzero_si512()));
    }
    i32::try_from(_mm512_reduce_add_epi64(sum)).expect("at most 33,025 drives of a byte")
}

#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn read(plane: &[u8], blocks: Range<usize>, drives: &[u8], stride: usize, out: &mut [i32]) {
    let (from, to) = (blocks.start.min(blocks.end), blocks.end);
    let samples = out.len() / 32;
    for (x, out) in drives.chunks_exact(stride).zip(out.chunks_exact_mut(32)) {
        out.fill(128 * byte_sum(&x[from * BLOCK_ROWS..to * BLOCK_ROWS]));
    }
    let walk =
        Walk { runs: to - from, quads: 16, run: BLOCK_CELLS, half: HALF_CELLS, stride, out: 32 };
    dots_batch::<READ>(
        walk,
        samples,
        &drives[from * BLOCK_ROWS..],
        &plane[from * BLOCK_CELLS..],
        out,
    );
}

#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn accumulate(drives: &[u8], stride: usize, gates: &[i8], sums: &mut Half<i32>) {
    let walk = Walk { runs: 1, quads: stride / 4, run: 0, half: 0, stride, out: HALF_COLUMNS };
    // SAFETY: i8 and u8 have the same size and every bit pattern is valid for both.
    let gates = unsafe { std::slice::from_raw_parts(gates.as_ptr().cast::<u8>(), gates.len()) };
    for row in (0..BLOCK_ROWS).step_by(16) {
        let sums = &mut sums[row * HALF_COLUMNS..][..16 * HALF_COLUMNS];
        dots::<GATES, 16, 1, 1>(walk, &drives[row * stride..], gates, sums);
    }
}

/// The transposed read: levels are turned, 4 columns of a row to a word, once for all samples.
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
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
            half: TURNED_QUADS * 64,
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
            let gates = &gates[first * 32..];
            for pair in 0..2 {
                let vectors = turned[2 * pair..].as_flattened().as_flattened();
                let out = &mut out[block * BLOCK_ROWS + 32 * pair..];
                dots_batch::<TURNED>(walk, samples, gates, vectors, out);
            }
        }
    }
}

/// Turns a half block: `[4 rows, 4 columns each]` of four vectors become 16 rows of 4 columns.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn turn(cells: &Half<u8>, quad: usize, turned: &mut [[[u8; 64]; TURNED_QUADS]; 4]) {
    // Byte [quarter of 4 columns][row][column] of a vector comes from its byte [column][row].
    let mut order = [0u8; 64];
    for (to, from) in (0u8..).zip(order.iter_mut()) {
        *from = (to / 16 * 4 + to % 4) * 4 + to / 4 % 4;
    }
    let order = load(&order);
    let (cells, _) = cells.as_chunks::<64>();
    for (cells, turned) in cells.chunks_exact(4).zip(turned) {
        let a = _mm512_permutexvar_epi8(order, load(&cells[0]));
        let b = _mm512_permutexvar_epi8(order, load(&cells[1]));
        let c = _mm512_permutexvar_epi8(order, load(&cells[2]));
        let d = _mm512_permutexvar_epi8(order, load(&cells[3]));
        // A 4 x 4 transposition of 128-bit quarters.
        let (ab, cd) = (_mm512_shuffle_i32x4::<0x44>(a, b), _mm512_shuffle_i32x4::<0x44>(c, d));
        store(&mut turned[quad], _mm512_shuffle_i32x4::<0x88>(ab, cd));
        store(&mut turned[quad + 1], _mm512_shuffle_i32x4::<0xdd>(ab, cd));
        let (ab, cd) = (_mm512_shuffle_i32x4::<0xee>(a, b), _mm512_shuffle_i32x4::<0xee>(c, d));
        store(&mut turned[quad + 2], _mm512_shuffle_i32x4::<0x88>(ab, cd));
        store(&mut turned[quad + 3], _mm512_shuffle_i32x4::<0xdd>(ab, cd));
    }
}
