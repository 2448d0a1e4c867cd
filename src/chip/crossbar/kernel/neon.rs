//! 128-bit loops: products of bytes added to 32-bit lanes, by dot products (`udot`, `sdot`) where the processor
//! has them, else by products of 16 bits added in pairs (`umull`, `uadalp`). Both are exact for full bytes.
//!
//! ```text
//! lane += x0 * y0 + x1 * y1 + x2 * y2 + x3 * y3          both sides unsigned bytes, or both signed; lane mod 2^32
//! read         level * drive               unsigned
//! accumulate   (drive - 128) * gate        signed;  sums start at 128 * sum of gates of the column
//! transposed   (level - 128) * gate        signed;  sums start at 128 * sum of gates of the sample
//! ```
//!
//! Lanes may wrap on the way; every sum itself fits, so what is left in the end is exact. Rust has no stable
//! name for the dot products, so they are written as assembly.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::aarch64::*;
use std::arch::{asm, is_aarch64_feature_detected};
use std::ops::Range;

use super::ops::Ops;
use super::{
    Drives, Extremes, Half, Peaks, lanes, levels, normalise, offsets, pulses, respond, scalar,
};
use crate::chip::crossbar::layout::{BLOCK_CELLS, BLOCK_ROWS, HALF_CELLS, HALF_COLUMNS, Layout};

mod dither;
#[cfg(test)]
mod tests;

/// Proof that the processor has NEON, and dot products where it multiplies by them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Neon(Products);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Products {
    Long(Long),
    Dot(Dot),
}

/// Products of 16 bits. Exists only where NEON does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Long(());

/// Dot products of four bytes. Exists only where NEON and the dot products do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Dot(());

impl Neon {
    /// The token, where the processor and the system have NEON and number the lanes from the low end.
    #[must_use]
    pub fn detect() -> Option<Self> {
        let there = cfg!(target_endian = "little") && is_aarch64_feature_detected!("neon");
        let products = if is_aarch64_feature_detected!("dotprod") {
            Products::Dot(Dot(()))
        } else {
            Products::Long(Long(()))
        };
        there.then_some(Self(products))
    }
}

impl Neon {
    /// Functions compiled for NEON, with the way to multiply that this processor has.
    pub(super) const fn ops(self) -> &'static Ops {
        match self.0 {
            Products::Long(_) => &const { table::<Long>() },
            Products::Dot(_) => &const { table::<Dot>() },
        }
    }
}

/// Handed out by the token alone.
const fn table<M: Multiply>() -> Ops {
    Ops {
        read: read::<M>,
        read_conv: |_, _, _, _| false,
        convert: lanes::convert,
        gate: lanes::gate,
        read_columns: read_columns::<M>,
        accumulate: accumulate::<M>,
        dither: dither::dither,
        dither_words: dither::dither_words,
        may_move: pulses::may_move_twin,
        pulses: pulses::twin,
        levels: levels::twin,
        pulse: Some(respond::pulse),
        offset: offsets::offset,
        index_squares: offsets::index_squares,
        stream_squares: normalise::stream_squares,
        scale: normalise::scale,
        peaks,
        ..scalar::OPS
    }
}

/// The law, a group of 4 rows and 16 columns at a time.
fn peaks(extremes: &Extremes) -> Peaks {
    let mut peaks = [[0; BLOCK_ROWS]; 2];
    for (peaks, cells) in peaks.iter_mut().zip([&extremes.most, &extremes.least]) {
        let groups = cells.as_chunks::<64>().0.iter().zip(peaks.as_chunks_mut::<4>().0);
        for (cells, peaks) in groups {
            for column in cells.as_chunks::<4>().0 {
                for (peak, pulses) in peaks.iter_mut().zip(column) {
                    *peak = (*peak).max(pulses.unsigned_abs());
                }
            }
        }
    }
    std::array::from_fn(|row| [peaks[0][row], peaks[1][row]])
}

#[inline]
#[target_feature(enable = "neon")]
fn load(bytes: &[u8; 16]) -> uint8x16_t {
    // SAFETY: the reference covers the 16 bytes that the load reads; it asks for no alignment.
    unsafe { vld1q_u8(bytes.as_ptr()) }
}

#[inline]
#[target_feature(enable = "neon")]
fn store(bytes: &mut [u8; 16], v: uint8x16_t) {
    // SAFETY: the reference covers the 16 bytes that the store writes; it asks for no alignment.
    unsafe { vst1q_u8(bytes.as_mut_ptr(), v) }
}

/// A way to multiply 4 lanes of 4 bytes.
trait Multiply: Copy {
    /// Streams that [`dots`] takes at a time: their sums and one vector of 64 bytes fit the registers.
    const STREAMS: usize;
    /// Whether the sums of a lane lie in two halves, side by side; else the first vector holds all of them.
    const HALVED: bool;

    /// The proof that the processor multiplies so.
    ///
    /// # Safety
    /// It does.
    unsafe fn here() -> Self;

    /// Adds products of signed or unsigned bytes, modulo 2^32.
    fn add<const SIGNED: bool>(self, sums: Sums, x: uint8x16_t, y: uint8x16_t) -> Sums;
}

type Sums = [uint32x4_t; 2];

impl Multiply for Long {
    const STREAMS: usize = 2;
    const HALVED: bool = true;

    unsafe fn here() -> Self {
        Self(())
    }

    #[inline(always)]
    fn add<const SIGNED: bool>(self, sums: Sums, x: uint8x16_t, y: uint8x16_t) -> Sums {
        // SAFETY: `self` exists only where `detect` found NEON, all that the function is compiled for.
        unsafe { long::<SIGNED>(sums, x, y) }
    }
}

/// The products of one byte fit 16 bits, a pair of them does not: it is added to 32 bits.
#[inline]
#[target_feature(enable = "neon")]
fn long<const SIGNED: bool>([low, high]: Sums, x: uint8x16_t, y: uint8x16_t) -> Sums {
    if SIGNED {
        let (x, y) = (vreinterpretq_s8_u8(x), vreinterpretq_s8_u8(y));
        let products = [vmull_s8(vget_low_s8(x), vget_low_s8(y)), vmull_high_s8(x, y)];
        let low = vpadalq_s16(vreinterpretq_s32_u32(low), products[0]);
        let high = vpadalq_s16(vreinterpretq_s32_u32(high), products[1]);
        [vreinterpretq_u32_s32(low), vreinterpretq_u32_s32(high)]
    } else {
        let products = [vmull_u8(vget_low_u8(x), vget_low_u8(y)), vmull_high_u8(x, y)];
        [vpadalq_u16(low, products[0]), vpadalq_u16(high, products[1])]
    }
}

impl Multiply for Dot {
    const STREAMS: usize = 4;
    const HALVED: bool = false;

    unsafe fn here() -> Self {
        Self(())
    }

    #[inline(always)]
    fn add<const SIGNED: bool>(self, [mut sums, none]: Sums, x: uint8x16_t, y: uint8x16_t) -> Sums {
        // The assembler is told of the feature here, as the loop around it is compiled for NEON alone.
        if SIGNED {
            // SAFETY: `self` exists only where `detect` found the instruction; it touches these registers alone.
            unsafe {
                asm!(
                    ".arch_extension dotprod",
                    "sdot {sums:v}.4s, {x:v}.16b, {y:v}.16b",
                    sums = inout(vreg) sums, x = in(vreg) x, y = in(vreg) y,
                    options(pure, nomem, nostack, preserves_flags),
                );
            }
        } else {
            // SAFETY: `self` exists only where `detect` found the instruction; it touches these registers alone.
            unsafe {
                asm!(
                    ".arch_extension dotprod",
                    "udot {sums:v}.4s, {x:v}.16b, {y:v}.16b",
                    sums = inout(vreg) sums, x = in(vreg) x, y = in(vreg) y,
                    options(pure, nomem, nostack, preserves_flags),
                );
            }
        }
        [sums, none]
    }
}

/// Where the words of [`dots`] lie.
#[derive(Clone, Copy)]
struct Walk {
    /// Runs of vectors.
    runs: usize,
    /// Vectors of a run, and words of a stream it meets.
    quads: usize,
    /// Vectors from a run to the next.
    run: usize,
    /// Words from a stream's words of a run to those of the next run.
    words: usize,
    /// Words from a stream to the next.
    stride: usize,
    /// Sums from a stream to the next.
    out: usize,
}

/// Levels against drives: both unsigned.
const READ: u8 = 0;
/// Gates against drives: drives become signed.
const GATES: u8 = 1;
/// Turned levels, which are signed already, against gates.
const TURNED: u8 = 2;

/// `out[i] += sum over runs and quads of dot4(stream i, vector)`, 16 lanes a vector and up to 4 streams.
#[inline]
#[target_feature(enable = "neon")]
fn dots<M: Multiply, const KIND: u8, const N: usize>(
    products: M,
    walk: Walk,
    streams: &[[u8; 4]],
    vectors: &[[u8; 64]],
    out: &mut [i32],
) {
    let mut sums = [[[vdupq_n_u32(0); 2]; 4]; N];
    for run in 0..walk.runs {
        let vectors = &vectors[run * walk.run..][..walk.quads];
        let mut words: [&[[u8; 4]]; N] = [&[]; N];
        for (i, words) in words.iter_mut().enumerate() {
            *words = &streams[run * walk.words + i * walk.stride..][..walk.quads];
        }
        for (quad, vector) in vectors.iter().enumerate() {
            let mut w = [vdupq_n_u8(0); 4];
            for (w, bytes) in w.iter_mut().zip(vector.as_chunks().0) {
                *w = load(bytes);
            }
            for (sums, words) in sums.iter_mut().zip(words) {
                let x = vreinterpretq_u8_u32(vdupq_n_u32(u32::from_le_bytes(words[quad])));
                let x = if KIND == GATES { veorq_u8(x, vdupq_n_u8(0x80)) } else { x };
                for (sums, w) in sums.iter_mut().zip(w) {
                    *sums = if KIND == READ {
                        products.add::<false>(*sums, x, w)
                    } else {
                        products.add::<true>(*sums, x, w)
                    };
                }
            }
        }
    }
    for (i, sums) in sums.iter().enumerate() {
        let out = out[i * walk.out..][..HALF_COLUMNS].as_chunks_mut::<4>().0;
        for (out, [low, high]) in out.iter_mut().zip(sums) {
            let sum = if M::HALVED { vpaddq_u32(*low, *high) } else { *low };
            // SAFETY: the reference covers the 4 sums, 16 bytes, that the load reads.
            let start = unsafe { vld1q_s32(out.as_ptr()) };
            let sum = vaddq_s32(start, vreinterpretq_s32_u32(sum));
            // SAFETY: the reference covers the 4 sums, 16 bytes, that the store writes.
            unsafe { vst1q_s32(out.as_mut_ptr(), sum) }
        }
    }
}

/// [`dots`] for any number of streams.
#[inline]
#[target_feature(enable = "neon")]
fn dots_batch<M: Multiply, const KIND: u8>(
    products: M,
    walk: Walk,
    samples: usize,
    streams: &[[u8; 4]],
    vectors: &[[u8; 64]],
    out: &mut [i32],
) {
    for from in (0..samples).step_by(M::STREAMS) {
        let x = &streams[from * walk.stride..];
        let out = &mut out[from * walk.out..];
        match (samples - from).min(M::STREAMS) {
            1 => dots::<M, KIND, 1>(products, walk, x, vectors, out),
            2 => dots::<M, KIND, 2>(products, walk, x, vectors, out),
            3 => dots::<M, KIND, 3>(products, walk, x, vectors, out),
            _ => dots::<M, KIND, 4>(products, walk, x, vectors, out),
        }
    }
}

/// # Safety
/// The processor has what `M` multiplies by.
#[target_feature(enable = "neon")]
unsafe fn read<M: Multiply>(
    cells: &[u8],
    drives: Drives<'_>,
    samples: Range<usize>,
    out: &mut [i32],
) {
    // SAFETY: the caller says that the processor has what `M` multiplies by.
    let products = unsafe { M::here() };
    out.fill(0);
    let walk = Walk {
        runs: drives.blocks(),
        quads: HALF_VECTORS,
        run: 2 * HALF_VECTORS,
        words: drives.samples() * BLOCK_WORDS,
        stride: BLOCK_WORDS,
        out: 2 * HALF_COLUMNS,
    };
    if walk.runs == 0 {
        return;
    }
    let streams = &drives.codes().as_chunks().0[samples.start * BLOCK_WORDS..];
    let vectors = cells.as_chunks().0;
    for half in 0..2 {
        let (vectors, out) = (&vectors[half * HALF_VECTORS..], &mut out[half * HALF_COLUMNS..]);
        dots_batch::<M, READ>(products, walk, samples.len(), streams, vectors, out);
    }
}

/// Vectors of 16 lanes in a half block, four rows each.
const HALF_VECTORS: usize = HALF_CELLS / 64;
/// Words of a block of a stream.
const BLOCK_WORDS: usize = BLOCK_ROWS / 4;

/// # Safety
/// The processor has what `M` multiplies by.
#[target_feature(enable = "neon")]
unsafe fn accumulate<M: Multiply>(
    turned: &[u8],
    stride: usize,
    gates: &[i8],
    sums: &mut Half<i32>,
) {
    // SAFETY: the caller says that the processor has what `M` multiplies by.
    let products = unsafe { M::here() };
    let mut starts = [0; HALF_COLUMNS];
    for gates in gates.as_chunks::<64>().0 {
        for (start, gates) in starts.iter_mut().zip(gates.as_chunks::<4>().0) {
            *start += gates.iter().map(|&gate| 128 * i32::from(gate)).sum::<i32>();
        }
    }
    sums.as_chunks_mut().0.fill(starts);
    // SAFETY: i8 and u8 have the same size and every bit pattern is valid for both.
    let gates = unsafe { std::slice::from_raw_parts(gates.as_ptr().cast::<u8>(), gates.len()) };
    let (quads, stride) = (gates.len() / 64, stride / 4);
    let walk = Walk { runs: 1, quads, run: 0, words: 0, stride, out: HALF_COLUMNS };
    let (streams, vectors) = (turned.as_chunks().0, gates.as_chunks().0);
    dots_batch::<M, GATES>(products, walk, BLOCK_ROWS, streams, vectors, sums);
}

/// The transposed read: levels are turned, 4 columns of a row to a word, once for all samples.
///
/// # Safety
/// The processor has what `M` multiplies by.
#[target_feature(enable = "neon")]
unsafe fn read_columns<M: Multiply>(
    plane: &[u8],
    layout: Layout,
    gates: Drives<'_>,
    out: &mut [i32],
) {
    // SAFETY: the caller says that the processor has what `M` multiplies by.
    let products = unsafe { M::here() };
    for (sample, out) in out.chunks_exact_mut(layout.rows_padded()).enumerate() {
        let gates = (0..gates.blocks()).flat_map(|block| gates.row(block, sample));
        out.fill(gates.map(|&gate| 128 * i32::from(gate.cast_signed())).sum());
    }
    // [4 groups of 16 rows][words of 4 columns][16 rows][4 columns]
    let quads = gates.blocks() * BLOCK_WORDS;
    let mut turned = vec![[0; 64]; 4 * quads];
    let walk = Walk {
        runs: gates.blocks(),
        quads: BLOCK_WORDS,
        run: BLOCK_WORDS,
        words: gates.samples() * BLOCK_WORDS,
        stride: BLOCK_WORDS,
        out: layout.rows_padded(),
    };
    let streams = gates.codes().as_chunks().0;
    for block in 0..layout.blocks() {
        for panel in 0..layout.panels() {
            let cells = &plane[(panel * layout.blocks() + block) * BLOCK_CELLS..][..BLOCK_CELLS];
            for (h, cells) in cells.as_chunks::<HALF_CELLS>().0.iter().enumerate() {
                turn(cells, panel * 8 + h * 4, quads, &mut turned);
            }
        }
        for (group, vectors) in turned.chunks_exact(quads).enumerate() {
            let out = &mut out[block * BLOCK_ROWS + 16 * group..];
            dots_batch::<M, TURNED>(products, walk, gates.samples(), streams, vectors, out);
        }
    }
}

/// Turns a half block, 4 columns x 4 rows at a time, and makes its levels signed: `level - 128`.
#[inline]
#[target_feature(enable = "neon")]
fn turn(cells: &Half<u8>, quad: usize, quads: usize, turned: &mut [[u8; 64]]) {
    let order = load(&[0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15]);
    for (group, cells) in cells.as_chunks::<64>().0.iter().enumerate() {
        for (q, cells) in cells.as_chunks().0.iter().enumerate() {
            let to = &mut turned[group / 4 * quads + quad + q];
            let signed = veorq_u8(vqtbl1q_u8(load(cells), order), vdupq_n_u8(0x80));
            store(&mut to.as_chunks_mut().0[group % 4], signed);
        }
    }
}
