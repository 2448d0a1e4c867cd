//! 512-bit loops: four products a lane and instruction (`vpdpbusd`), exact for full bytes.
//!
//! ```text
//! lane += u0 * s0 + u1 * s1 + u2 * s2 + u3 * s3          u unsigned bytes, s signed bytes, i32 lane
//! read         u = drives,  s = level - 128;   v = sum + 128 * sum of drives
//! accumulate   u = drives,  s = gates
//! transposed   u = levels,  s = gates
//! ```
//!
//! All three are one loop, [`dots`]: a few streams of 4-byte words against vectors of 16 lanes x 4 bytes,
//! held in registers for up to 12 streams x 2 vectors, so that a loaded vector is used that often. The
//! four products of a lane add up to at most 4 * 255 * 128 in size, far inside the instruction's i32.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::x86_64::*;
use std::ops::Range;

use super::ops::{Ops, twins};
use super::{
    Cells, Dither, Drives, Ends, Half, SignLaw, Sums, WriteCounts, WriteLaw, peak, scalar,
};
use crate::chip::crossbar::layout::{BLOCK_CELLS, BLOCK_ROWS, HALF_CELLS, HALF_COLUMNS};

mod columns;
mod conv;
mod dither;
mod few_samples;
mod fused;
mod normalise;
mod one_sample;
mod peaks;
mod reads;
mod turn;
mod units;

pub(super) use columns::{Turned, pair, turn_columns};
pub(super) use units::settle;

/// Proof that the processor has AVX-512 F, BW, VL, VNNI and VBMI, and counts bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Avx512(());

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
}

/// Handed out by the token: functions compiled for its features.
pub(super) const OPS: Ops = Ops {
    read,
    drive_sums: Some(drive_sums),
    read_conv: conv::read,
    convert: units::convert,
    look_up: units::look_up,
    difference: units::difference,
    latch: units::latch,
    gate: units::gate,
    gate_shared: Some(units::gate_shared),
    put_out: Some(units::put_out),
    turn: turn::turn,
    read_columns: columns::read_columns,
    accumulate,
    accumulate_reads: Some(reads::accumulate),
    dither: dither::dither,
    dither_words: dither::dither_words,
    may_move: fused::may_move,
    pulses,
    levels,
    pulse: Some(pulse),
    offset,
    index_squares,
    stream_squares: normalise::stream_squares,
    scale: normalise::scale,
    centre: normalise::centre,
    gate_totals,
    drive_totals,
    squares: normalise::squares,
    loud,
    signs,
    fused: fused::fused,
    one_sample: one_sample::one_sample,
    peaks: peaks::peaks,
    peak: peak::avx512,
    ..scalar::OPS
};

twins!("avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt");

/// Levels against drives, from the sums of drives on.
const READ: u8 = 0;
/// The same, added to what is there.
const MORE: u8 = 3;
/// Gates against drives.
const GATES: u8 = 1;
/// Turned levels against gates.
const TURNED: u8 = 2;

/// Streams that lie as far from one another as a walk says. Where that is known beforehand, their places need no arithmetic.
const ANY: usize = 0;
/// Bytes by which cells are asked for before they are met: two blocks.
const AHEAD: usize = 2 * BLOCK_CELLS;

/// Where the bytes of [`dots`] lie: streams of words, and vectors in runs.
#[derive(Clone, Copy)]
struct Walk {
    /// Runs of vectors.
    runs: usize,
    /// Vectors of a run, and words of a stream it meets.
    quads: usize,
    /// Those of the last run.
    last: usize,
    /// Bytes from a run of vectors to the next.
    run: usize,
    /// Bytes from a vector to the one beside it.
    half: usize,
    /// Bytes from a stream's words of a run to those of the next run.
    words: usize,
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

#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn store_sums(sums: &mut [i32; 16], v: __m512i) {
    // SAFETY: the reference covers the 16 sums, 64 bytes, that an unaligned store writes.
    unsafe { _mm512_storeu_si512(sums.as_mut_ptr().cast(), v) }
}

/// `out[i][h] = sum over runs and quads of dot4(stream i, vector h)`, from `128 * sums[i]` on by `READ`, and added to what is
/// there by `MORE`.
///
/// `CHAINS` sums a lane hide the latency of the instruction where there are few streams; the quads
/// must divide by it.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn dots<
    const KIND: u8,
    const N: usize,
    const H: usize,
    const CHAINS: usize,
    const STRIDE: usize,
>(
    walk: Walk,
    streams: &[u8],
    vectors: &[u8],
    sums: &[i32],
    out: &mut [i32],
) {
    let Walk { runs, quads, last, run, half, words, stride, out: out_stride } = walk;
    let stride = if STRIDE == ANY { stride } else { STRIDE };
    if runs * quads == 0 {
        if KIND != MORE {
            out.fill(0);
        }
        return;
    }
    assert!(quads.is_multiple_of(CHAINS) && last.is_multiple_of(CHAINS), "no vector is left over");
    assert!(last <= quads, "the last run is no longer than others");
    assert!(
        streams.len() >= (runs - 1) * words + (N - 1) * stride + quads * 4,
        "every stream has its words"
    );
    assert!(vectors.len() >= (runs - 1) * run + (H - 1) * half + quads * 64, "vectors lie inside");
    assert!(out.len() >= (N - 1) * out_stride + H * 16, "every sum has its place");
    let flip = _mm512_set1_epi8(i8::MIN);
    let mut acc = [[[_mm512_setzero_si512(); H]; N]; CHAINS];
    if KIND == READ {
        for (acc, &sum) in acc[0].iter_mut().zip(&sums[..N]) {
            *acc = [_mm512_set1_epi32(128 * sum); H];
        }
    }
    for r in 0..runs {
        let quads = if r + 1 == runs { last } else { quads };
        for step in 0..quads / CHAINS {
            for (chain, acc) in acc.iter_mut().enumerate() {
                let quad = step * CHAINS + chain;
                let mut w = [flip; H];
                for (h, w) in w.iter_mut().enumerate() {
                    // SAFETY: r < runs, h < H and quad < quads, so the third assertion above bounds the
                    // last of these 64 bytes.
                    let at = unsafe { vectors.as_ptr().add(r * run + h * half + quad * 64) };
                    // SAFETY: the 64 bytes at `at` lie inside `vectors`, as above.
                    *w = unsafe { _mm512_loadu_si512(at.cast()) };
                    if KIND == READ || KIND == MORE {
                        *w = _mm512_xor_si512(*w, flip);
                        // cells of large arrays come from far away, and are met in the order in which they lie
                        _mm_prefetch::<_MM_HINT_T0>(at.wrapping_add(AHEAD).cast());
                    }
                }
                // SAFETY: r < runs and quad < quads, so the second assertion above says that bytes lie there.
                let first = unsafe { streams.as_ptr().add(r * words + quad * 4) };
                for (i, acc) in acc.iter_mut().enumerate() {
                    // SAFETY: i < N, so the second assertion above bounds the last of these 4 bytes; the read asks for
                    // no alignment.
                    let word = unsafe { first.add(i * stride).cast::<i32>().read_unaligned() };
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
            // SAFETY: i < N and h < H, so the fourth assertion above bounds these 16 sums.
            let at = unsafe { out.as_mut_ptr().add(i * out_stride + h * 16) };
            if KIND == MORE {
                // SAFETY: the 16 sums at `at` lie inside `out`, as above.
                sum = _mm512_add_epi32(sum, unsafe { _mm512_loadu_si512(at.cast()) });
            }
            // SAFETY: the 16 sums at `at` lie inside `out`, which is borrowed for writing.
            unsafe { _mm512_storeu_si512(at.cast(), sum) }
        }
    }
}

/// [`dots`] with two vectors side by side for any number of samples, in even groups of at most 12. `sums` are those of all
/// samples by `READ`, and nothing otherwise.
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn dots_batch<const KIND: u8, const STRIDE: usize>(
    walk: Walk,
    samples: usize,
    streams: &[u8],
    vectors: &[u8],
    sums: &[i32],
    out: &mut [i32],
) {
    let groups = samples.div_ceil(12);
    for group in 0..groups {
        let (from, to) = (samples * group / groups, samples * (group + 1) / groups);
        let x = &streams[from * walk.stride..];
        let sums = sums.get(from..to).unwrap_or_default();
        let out = &mut out[from * walk.out..];
        match to - from {
            1 => dots::<KIND, 1, 2, 4, STRIDE>(walk, x, vectors, sums, out),
            2 => dots::<KIND, 2, 2, 4, STRIDE>(walk, x, vectors, sums, out),
            3 => dots::<KIND, 3, 2, 2, STRIDE>(walk, x, vectors, sums, out),
            4 => dots::<KIND, 4, 2, 2, STRIDE>(walk, x, vectors, sums, out),
            5 => dots::<KIND, 5, 2, 1, STRIDE>(walk, x, vectors, sums, out),
            6 => dots::<KIND, 6, 2, 1, STRIDE>(walk, x, vectors, sums, out),
            7 => dots::<KIND, 7, 2, 1, STRIDE>(walk, x, vectors, sums, out),
            8 => dots::<KIND, 8, 2, 1, STRIDE>(walk, x, vectors, sums, out),
            9 => dots::<KIND, 9, 2, 1, STRIDE>(walk, x, vectors, sums, out),
            10 => dots::<KIND, 10, 2, 1, STRIDE>(walk, x, vectors, sums, out),
            11 => dots::<KIND, 11, 2, 1, STRIDE>(walk, x, vectors, sums, out),
            12 => dots::<KIND, 12, 2, 1, STRIDE>(walk, x, vectors, sums, out),
            _ => unreachable!("a group has 1 to 12 samples"),
        }
    }
}

/// Sum of the drives of a sample.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn drive_sum(drives: Drives<'_>, sample: usize) -> i32 {
    let mut sum = _mm512_setzero_si512();
    for block in 0..drives.blocks() {
        let codes = load(drives.row(block, sample));
        sum = _mm512_add_epi64(sum, _mm512_sad_epu8(codes, _mm512_setzero_si512()));
    }
    i32::try_from(_mm512_reduce_add_epi64(sum)).expect("at most 33,025 drives of a byte")
}

#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn drive_sums(drives: Drives<'_>, sums: &mut [i32]) {
    sums.iter_mut().enumerate().for_each(|(sample, sum)| *sum = drive_sum(drives, sample));
}

#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(super) fn read(cells: &[u8], drives: Drives<'_>, samples: Range<usize>, out: &mut [i32]) {
    if samples.len() <= 4 {
        return few_samples::read(cells, drives, samples, out);
    }
    let walk = Walk {
        runs: drives.blocks(),
        quads: 16,
        // what no row of the last block drives is passed over
        last: drives.last_quads(),
        run: BLOCK_CELLS,
        half: HALF_CELLS,
        words: drives.samples() * BLOCK_ROWS,
        stride: BLOCK_ROWS,
        out: 32,
    };
    let streams = &drives.codes()[samples.start * BLOCK_ROWS..];
    if let Some(sums) = drives.sums() {
        let sums = &sums[samples.clone()];
        return dots_batch::<READ, BLOCK_ROWS>(walk, samples.len(), streams, cells, sums, out);
    }
    let (mut few, mut many) = ([0; 32], Vec::new());
    let sums = match few.get_mut(..samples.len()) {
        Some(few) => few,
        None => {
            many.resize(samples.len(), 0);
            &mut many[..]
        }
    };
    for (sum, sample) in sums.iter_mut().zip(samples.clone()) {
        *sum = drive_sum(drives, sample);
    }
    dots_batch::<READ, BLOCK_ROWS>(walk, samples.len(), streams, cells, sums, out);
}

#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(super) fn accumulate(turned: &[u8], stride: usize, gates: &[i8], sums: &mut Half<i32>) {
    let walk = Walk {
        runs: 1,
        quads: gates.len() / 64,
        last: gates.len() / 64,
        run: 0,
        half: 0,
        words: 0,
        stride,
        out: HALF_COLUMNS,
    };
    let gates = as_bytes(gates);
    for row in (0..BLOCK_ROWS).step_by(16) {
        let sums = &mut sums[row * HALF_COLUMNS..][..16 * HALF_COLUMNS];
        dots::<GATES, 16, 1, 1, ANY>(walk, &turned[row * stride..], gates, &[], sums);
    }
}

/// The same bytes without their sign.
pub(super) fn as_bytes(bytes: &[i8]) -> &[u8] {
    // SAFETY: i8 and u8 have the same size and every bit pattern is valid for both.
    unsafe { std::slice::from_raw_parts(bytes.as_ptr().cast::<u8>(), bytes.len()) }
}
