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

use super::store;
use crate::chip::crossbar::kernel::{Half, chacha};
use crate::num::draw::Place;

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

#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(super) fn dither(place: &Place, rows: usize, column: usize, block: usize, out: &mut Half<u8>) {
    let (start, step) = chacha::start(place, rows, column, block);
    let mut first = [_mm512_setzero_si512(); 16];
    for (first, word) in first.iter_mut().zip(start) {
        *first = _mm512_set1_epi32(word);
    }
    let lane = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    first[12] = _mm512_add_epi32(first[12], _mm512_mullo_epi32(lane, _mm512_set1_epi32(step)));
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
    for ((out, s), first) in out.as_chunks_mut().0.iter_mut().zip(s).zip(first) {
        store(out, _mm512_add_epi32(s, first));
    }
}
