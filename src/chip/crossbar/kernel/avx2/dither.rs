//! ChaCha8 for 8 columns at a time, one block of 64 bytes a lane; two groups fill a half block.
//!
//! ```text
//! lane c      block `(column + c) * ceil(rows / 64) + block` of the place
//! word i      4 bytes: rows 4i .. 4i + 4 of column c
//! ```
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::x86_64::*;

use super::store;
use crate::chip::crossbar::kernel::{Draws, Half};

/// Turns the 32-bit lanes left; `LEFT + RIGHT` is 32.
#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn rotate<const LEFT: i32, const RIGHT: i32>(v: __m256i) -> __m256i {
    _mm256_or_si256(_mm256_slli_epi32::<LEFT>(v), _mm256_srli_epi32::<RIGHT>(v))
}

#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn quarter(s: &mut [__m256i; 16], a: usize, b: usize, c: usize, d: usize) {
    // Turning by whole bytes is one shuffle.
    let by_16 = _mm256_setr_epi8(
        2, 3, 0, 1, 6, 7, 4, 5, 10, 11, 8, 9, 14, 15, 12, 13, //
        2, 3, 0, 1, 6, 7, 4, 5, 10, 11, 8, 9, 14, 15, 12, 13,
    );
    let by_8 = _mm256_setr_epi8(
        3, 0, 1, 2, 7, 4, 5, 6, 11, 8, 9, 10, 15, 12, 13, 14, //
        3, 0, 1, 2, 7, 4, 5, 6, 11, 8, 9, 10, 15, 12, 13, 14,
    );
    s[a] = _mm256_add_epi32(s[a], s[b]);
    s[d] = _mm256_shuffle_epi8(_mm256_xor_si256(s[d], s[a]), by_16);
    s[c] = _mm256_add_epi32(s[c], s[d]);
    s[b] = rotate::<12, 20>(_mm256_xor_si256(s[b], s[c]));
    s[a] = _mm256_add_epi32(s[a], s[b]);
    s[d] = _mm256_shuffle_epi8(_mm256_xor_si256(s[d], s[a]), by_8);
    s[c] = _mm256_add_epi32(s[c], s[d]);
    s[b] = rotate::<7, 25>(_mm256_xor_si256(s[b], s[c]));
}

#[target_feature(enable = "avx2,popcnt")]
pub(super) fn dither(draws: &Draws, column: usize, block: usize, out: &mut Half<u8>) {
    let (start, counter) = (draws.start(), draws.counter(64, column, block));
    let mut lane = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    for group in 0..2 {
        let mut first = [_mm256_setzero_si256(); 16];
        for (first, word) in first.iter_mut().zip(start) {
            *first = _mm256_set1_epi32(*word);
        }
        let grown = _mm256_mullo_epi32(lane, _mm256_set1_epi32(counter.step));
        first[12] = _mm256_add_epi32(_mm256_set1_epi32(counter.first), grown);
        let mut s = first;
        for _ in 0..4 {
            quarter(&mut s, 0, 4, 8, 12);
            quarter(&mut s, 1, 5, 9, 13);
            quarter(&mut s, 2, 6, 10, 14);
            quarter(&mut s, 3, 7, 11, 15);
            quarter(&mut s, 0, 5, 10, 15);
            quarter(&mut s, 1, 6, 11, 12);
            quarter(&mut s, 2, 7, 8, 13);
            quarter(&mut s, 3, 4, 9, 14);
        }
        for ((out, s), first) in out.as_chunks_mut::<64>().0.iter_mut().zip(s).zip(first) {
            store(&mut out.as_chunks_mut().0[group], _mm256_add_epi32(s, first));
        }
        lane = _mm256_add_epi32(lane, _mm256_set1_epi32(8));
    }
}
