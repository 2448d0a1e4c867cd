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
use crate::chip::crossbar::kernel::chacha::Counter;
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

/// Word 12 of 8 of the 16 columns: the first 8, or the last.
#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn counters(counter: Counter, eight: usize) -> __m256i {
    let lane = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    let lane = _mm256_add_epi32(lane, _mm256_set1_epi32(if eight == 0 { 0 } else { 8 }));
    let grown = _mm256_mullo_epi32(lane, _mm256_set1_epi32(counter.step));
    _mm256_add_epi32(_mm256_set1_epi32(counter.first), grown)
}

#[target_feature(enable = "avx2,popcnt")]
pub(super) fn dither(draws: &Draws, column: usize, block: usize, out: &mut Half<u8>) {
    let counter = draws.counter(64, column, block);
    for eight in 0..2 {
        let words = drawn(draws, counters(counter, eight));
        for (out, v) in out.as_chunks_mut::<64>().0.iter_mut().zip(words) {
            store(&mut out.as_chunks_mut().0[eight], v);
        }
    }
}

/// A 64-byte block holds the 16-bit words of 32 rows: two a block of levels.
#[target_feature(enable = "avx2,popcnt")]
pub(super) fn dither_words(draws: &Draws, column: usize, block: usize, words: &mut Half<u16>) {
    for half in 0..2 {
        if (2 * block + half) * 32 >= draws.rows() {
            return;
        }
        let counter = draws.counter(32, column, 2 * block + half);
        let groups = &mut words.as_chunks_mut::<64>().0[8 * half..][..8];
        for eight in 0..2 {
            let drawn = drawn(draws, counters(counter, eight));
            for (words, v) in groups.iter_mut().zip(drawn.as_chunks::<2>().0) {
                store_columns(&mut words.as_chunks_mut().0[eight], *v);
            }
        }
    }
}

/// Stores four rows of 8 columns: of each column the word of rows 0 and 1, then that of rows 2 and 3.
#[inline]
#[target_feature(enable = "avx2,popcnt")]
pub(super) fn store_columns(words: &mut [u16; 32], [a, b]: [__m256i; 2]) {
    // Columns 0 1 4 5 and 2 3 6 7.
    let (outer, inner) = (_mm256_unpacklo_epi32(a, b), _mm256_unpackhi_epi32(a, b));
    let left = _mm256_permute2x128_si256::<0x20>(outer, inner);
    let right = _mm256_permute2x128_si256::<0x31>(outer, inner);
    // SAFETY: the reference covers 32 words, 64 bytes; this writes the first 32.
    unsafe { _mm256_storeu_si256(words.as_mut_ptr().cast(), left) }
    // SAFETY: the reference covers 32 words, 64 bytes; this writes the last 32.
    unsafe { _mm256_storeu_si256(words[16..].as_mut_ptr().cast(), right) }
}
