//! Taps and gates of 64 units.
//!
//! ```text
//! latch    a bus of at most 8 words lies in one vector: a shuffle taps them
//! gate     rsh(err slope, bits) = ((err << (15 - bits)) slope + 2^14) >> 15                  vpmulhrsw; |err| < 2^(bits - 1)
//! packed   words a | b << 8 and c | d << 8 of four samples, interleaved: bytes a b c d of a column
//! ```
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::x86_64::*;

use crate::chip::crossbar::kernel::scalar;
use crate::chip::crossbar::layout::{BLOCK_ROWS, HALF_COLUMNS};
use crate::num::fixed::ErrorBits;

#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn load_words(words: &[i16; 16]) -> __m256i {
    // SAFETY: the reference covers the 16 words, 32 bytes, that an unaligned load reads.
    unsafe { _mm256_loadu_si256(words.as_ptr().cast()) }
}

#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn store_words(words: &mut [i16; 16], v: __m256i) {
    // SAFETY: the reference covers the 16 words, 32 bytes, that an unaligned store writes.
    unsafe { _mm256_storeu_si256(words.as_mut_ptr().cast(), v) }
}

/// See [`super::super::Kernel::latch`].
#[target_feature(enable = "avx2,popcnt")]
pub(super) fn latch(words: &[i16], width: usize, taps: &[u16], errors: &mut [i16]) {
    if width > 8 {
        return scalar::latch(words, width, taps, errors);
    }
    // bytes of the tapped word; of units that do not exist, a place that gives 0
    let mut order = [i16::MIN | 0x80; BLOCK_ROWS];
    for (order, tap) in order.iter_mut().zip(taps) {
        let low = 2 * tap.cast_signed();
        *order = low | (low + 1) << 8;
    }
    let order: [__m256i; 4] = std::array::from_fn(|at| load_words(&order.as_chunks::<16>().0[at]));
    let rows = errors.as_chunks_mut::<BLOCK_ROWS>().0.iter_mut();
    for (sample, errors) in (0..words.len() / width).zip(rows) {
        let rest = &words[sample * width..];
        let bus = match rest.first_chunk::<8>() {
            Some(bus) => *bus,
            None => std::array::from_fn(|at| rest.get(at).copied().unwrap_or(0)),
        };
        // SAFETY: the array has the 16 bytes that an unaligned load reads.
        let bus = unsafe { _mm_loadu_si128(bus.as_ptr().cast()) };
        let bus = _mm256_broadcastsi128_si256(bus);
        for (errors, order) in errors.as_chunks_mut::<16>().0.iter_mut().zip(order) {
            store_words(errors, _mm256_shuffle_epi8(bus, order));
        }
    }
}

/// See [`super::super::Kernel::gate`].
#[target_feature(enable = "avx2,popcnt")]
pub(super) fn gate(
    errors: &[i16],
    derivatives: &[u8],
    negate: bool,
    bits: ErrorBits,
    stride: usize,
    gates: &mut [i8],
) -> u64 {
    let up = _mm_cvtsi32_si128(15 - bits.get().cast_signed());
    let sign = _mm256_set1_epi16(if negate { -1 } else { 1 });
    let errors = errors.as_chunks::<BLOCK_ROWS>().0;
    let slopes = derivatives.as_chunks::<BLOCK_ROWS>().0;
    for (half, gates) in gates.chunks_exact_mut(HALF_COLUMNS * stride).enumerate() {
        for (quad, gates) in gates.as_chunks_mut::<64>().0.iter_mut().enumerate() {
            let mut rows = [_mm256_setzero_si256(); 4];
            let samples = errors.iter().zip(slopes).skip(4 * quad);
            for (row, (errors, slopes)) in rows.iter_mut().zip(samples) {
                let errors = load_words(&errors.as_chunks().0[half]);
                let slopes: &[u8; 16] = &slopes.as_chunks().0[half];
                // SAFETY: the reference covers the 16 bytes that an unaligned load reads.
                let slopes = unsafe { _mm_loadu_si128(slopes.as_ptr().cast()) };
                let errors = _mm256_sll_epi16(_mm256_sign_epi16(errors, sign), up);
                *row = _mm256_mulhrs_epi16(errors, _mm256_cvtepu8_epi16(slopes));
            }
            let [a, b, c, d] = rows;
            let (ab, cd) = (beside(a, b), beside(c, d));
            // columns 0 .. 4 and 8 .. 12, then 4 .. 8 and 12 .. 16
            let (left, right) = (_mm256_unpacklo_epi16(ab, cd), _mm256_unpackhi_epi16(ab, cd));
            let [low, high] = gates.as_chunks_mut::<32>().0 else { unreachable!("two of 32") };
            store_gates(low, _mm256_permute2x128_si256::<0x20>(left, right));
            store_gates(high, _mm256_permute2x128_si256::<0x31>(left, right));
        }
    }
    0
}

/// Low bytes of words of two samples, side by side.
#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn beside(a: __m256i, b: __m256i) -> __m256i {
    let a = _mm256_and_si256(a, _mm256_set1_epi16(0xff));
    _mm256_or_si256(a, _mm256_slli_epi16::<8>(b))
}

#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn store_gates(gates: &mut [i8; 32], v: __m256i) {
    // SAFETY: the reference covers the 32 bytes that an unaligned store writes.
    unsafe { _mm256_storeu_si256(gates.as_mut_ptr().cast(), v) }
}
