//! ChaCha8 for 8 columns at a time, one block of 64 bytes a lane; two groups fill a half block.
//!
//! ```text
//! lane c      block `(column + c) * ceil(rows / 64) + block` of the place
//! word i      4 bytes: rows 4i .. 4i + 4 of column c
//! ```
//!
//! Three of the four quarter rounds of the first round are made once a write: see [`Draws`].
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

/// The words of 8 columns, from their word 12 of the start.
#[target_feature(enable = "avx2,popcnt")]
pub(super) fn drawn(draws: &Draws, counter: __m256i) -> [__m256i; 16] {
    let mut s = [_mm256_setzero_si256(); 16];
    for (s, word) in s.iter_mut().zip(draws.mixed()) {
        *s = _mm256_set1_epi32(*word);
    }
    s[12] = counter;
    quarter(&mut s, 0, 4, 8, 12);
    for round in 0..4 {
        if round > 0 {
            quarter(&mut s, 0, 4, 8, 12);
            quarter(&mut s, 1, 5, 9, 13);
            quarter(&mut s, 2, 6, 10, 14);
            quarter(&mut s, 3, 7, 11, 15);
        }
        quarter(&mut s, 0, 5, 10, 15);
        quarter(&mut s, 1, 6, 11, 12);
        quarter(&mut s, 2, 7, 8, 13);
        quarter(&mut s, 3, 4, 9, 14);
    }
    for (at, (s, start)) in s.iter_mut().zip(draws.start()).enumerate() {
        let start = if at == 12 { counter } else { _mm256_set1_epi32(*start) };
        *s = _mm256_add_epi32(*s, start);
    }
    s
}

#[target_feature(enable = "avx2,popcnt")]
pub(super) fn dither(draws: &Draws, column: usize, block: usize, out: &mut Half<u8>) {
    let counter = draws.counter(64, column, block);
    let mut lane = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    for group in 0..2 {
        let grown = _mm256_mullo_epi32(lane, _mm256_set1_epi32(counter.step));
        let counter = _mm256_add_epi32(_mm256_set1_epi32(counter.first), grown);
        for (out, v) in out.as_chunks_mut::<64>().0.iter_mut().zip(drawn(draws, counter)) {
            store(&mut out.as_chunks_mut().0[group], v);
        }
        lane = _mm256_add_epi32(lane, _mm256_set1_epi32(8));
    }
}
