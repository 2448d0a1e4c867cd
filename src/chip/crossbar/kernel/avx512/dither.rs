//! ChaCha8 for 16 columns at once, one block of 64 bytes a lane.
//!
//! ```text
//! lane c      block `(column + c) * ceil(rows / 64) + block` of the place
//! word i      4 bytes: rows 4i .. 4i + 4 of column c
//! ```
//!
//! Word `i` of all lanes is 4 rows x 16 columns in the order of a half block, so nothing is shuffled.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::x86_64::*;

use super::{load, store};
use crate::chip::crossbar::kernel::chacha::Counter;
use crate::chip::crossbar::kernel::{Draws, Half};

#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn quarter(s: &mut [__m512i; 16], a: usize, b: usize, c: usize, d: usize) {
    s[a] = _mm512_add_epi32(s[a], s[b]);
    s[d] = _mm512_rol_epi32::<16>(_mm512_xor_si512(s[d], s[a]));
    s[c] = _mm512_add_epi32(s[c], s[d]);
    s[b] = _mm512_rol_epi32::<12>(_mm512_xor_si512(s[b], s[c]));
    s[a] = _mm512_add_epi32(s[a], s[b]);
    s[d] = _mm512_rol_epi32::<8>(_mm512_xor_si512(s[d], s[a]));
    s[c] = _mm512_add_epi32(s[c], s[d]);
    s[b] = _mm512_rol_epi32::<7>(_mm512_xor_si512(s[b], s[c]));
}

#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn diagonals(s: &mut [__m512i; 16]) {
    quarter(s, 0, 5, 10, 15);
    quarter(s, 1, 6, 11, 12);
    quarter(s, 2, 7, 8, 13);
    quarter(s, 3, 4, 9, 14);
}

/// One block of 64 bytes of 16 columns: word i of lane c.
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn blocks(draws: &Draws, counter: Counter, words: &mut Half<u8>) {
    let lane = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    let grown = _mm512_mullo_epi32(lane, _mm512_set1_epi32(counter.step));
    let counter = _mm512_add_epi32(_mm512_set1_epi32(counter.first), grown);
    let words = words.as_chunks_mut().0;
    drawn(draws, counter, |i, v| store(&mut words[i], v));
}

/// The blocks whose word 12 starts as `counter` says: word i of each is handed on. Were they returned, they would take the
/// way through memory.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(super) fn drawn(draws: &Draws, counter: __m512i, mut take: impl FnMut(usize, __m512i)) {
    let mut first = [_mm512_setzero_si512(); 16];
    for (first, word) in first.iter_mut().zip(draws.mixed()) {
        *first = _mm512_set1_epi32(*word);
    }
    first[12] = counter;
    let mut s = first;
    quarter(&mut s, 0, 4, 8, 12);
    diagonals(&mut s);
    for _ in 0..3 {
        quarter(&mut s, 0, 4, 8, 12);
        quarter(&mut s, 1, 5, 9, 13);
        quarter(&mut s, 2, 6, 10, 14);
        quarter(&mut s, 3, 7, 11, 15);
        diagonals(&mut s);
    }
    for (i, (s, word)) in s.into_iter().zip(draws.start()).enumerate() {
        let first = if i == 12 { counter } else { _mm512_set1_epi32(*word) };
        take(i, _mm512_add_epi32(s, first));
    }
}

#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(super) fn dither(draws: &Draws, column: usize, block: usize, words: &mut Half<u8>) {
    blocks(draws, draws.counter(64, column, block), words);
}

/// A 64-byte block holds the 16-bit words of 32 rows: two a block of levels.
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(super) fn dither_words(draws: &Draws, column: usize, block: usize, words: &mut Half<u16>) {
    let mut drawn = [0; _];
    for half in 0..2 {
        if (2 * block + half) * 32 >= draws.rows() {
            return;
        }
        let groups = &mut words.as_chunks_mut::<64>().0[8 * half..][..8];
        blocks(draws, draws.counter(32, column, 2 * block + half), &mut drawn);
        for (words, drawn) in groups.iter_mut().zip(drawn.as_chunks::<128>().0) {
            let v = [0, 1].map(|i| load(&drawn.as_chunks().0[i]));
            // lane c of v[0] holds rows 0 and 1 of a group, of v[1] rows 2 and 3
            let first = _mm512_setr_epi32(0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
            let second = _mm512_add_epi32(first, _mm512_set1_epi32(8));
            store_words(words, [first, second].map(|at| _mm512_permutex2var_epi32(v[0], at, v[1])));
        }
    }
}

#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn store_words(words: &mut [u16; 64], v: [__m512i; 2]) {
    for (words, v) in words.as_chunks_mut::<32>().0.iter_mut().zip(v) {
        // SAFETY: the reference covers the 32 words, 64 bytes, that an unaligned store writes.
        unsafe { _mm512_storeu_si512(words.as_mut_ptr().cast(), v) }
    }
}
