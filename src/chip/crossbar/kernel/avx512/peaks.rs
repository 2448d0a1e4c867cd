//! Where pulses go, 64 cells at a time, and the peaks of 64 rows.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::x86_64::*;

use super::store;
use crate::chip::crossbar::kernel::{Extremes, Half, Peaks, Pulsed};
use crate::chip::crossbar::layout::BLOCK_ROWS;

#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn load(cells: &[i8; 64]) -> __m512i {
    // SAFETY: the reference covers the 64 bytes that an unaligned load reads.
    unsafe { _mm512_loadu_si512(cells.as_ptr().cast()) }
}

#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn keep(cells: &mut [i8; 64], pulses: __m512i) {
    // SAFETY: the reference covers the 64 bytes that an unaligned store writes.
    unsafe { _mm512_storeu_si512(cells.as_mut_ptr().cast(), pulses) }
}

/// Puts the pulses of a group where they go.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(super) fn take(out: &mut Pulsed<'_>, group: usize, pulses: __m512i) {
    match out {
        Pulsed::Every(plane) => keep(&mut plane.as_chunks_mut().0[group], pulses),
        Pulsed::Most(extremes) => {
            let most = &mut extremes.most.as_chunks_mut().0[group];
            keep(most, _mm512_max_epi8(load(most), pulses));
            let least = &mut extremes.least.as_chunks_mut().0[group];
            keep(least, _mm512_min_epi8(load(least), pulses));
        }
    }
}

#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(super) fn peaks(extremes: &Extremes) -> Peaks {
    let mut peaks = [[0; 2]; BLOCK_ROWS];
    let (most, least) = (fold(&extremes.most), fold(&extremes.least));
    let [first, second] = peaks.as_flattened_mut().as_chunks_mut().0 else {
        unreachable!("128 bytes")
    };
    store(first, side_by_side(_mm512_castsi512_si256(most), _mm512_castsi512_si256(least)));
    let [most, least] = [most, least].map(|v| _mm512_extracti64x4_epi64::<1>(v));
    store(second, side_by_side(most, least));
    peaks
}

/// The greatest size of 16 columns: `[16 groups][16 columns][4 rows]` becomes `[64 rows]`. Pulses are at least -127.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn fold(cells: &Half<i8>) -> __m512i {
    let mut fours = [_mm512_setzero_si512(); 4];
    for (four, groups) in fours.iter_mut().zip(cells.as_chunks::<256>().0) {
        let [a, b, c, d] = groups.as_chunks().0 else { unreachable!("four groups") };
        let [a, b, c, d] = [a, b, c, d].map(|group| _mm512_abs_epi8(load(group)));
        // each quarter of 16 bytes: two groups, twice
        let two = _mm512_max_epu8(_mm512_unpacklo_epi32(a, b), _mm512_unpackhi_epi32(a, b));
        let next = _mm512_max_epu8(_mm512_unpacklo_epi32(c, d), _mm512_unpackhi_epi32(c, d));
        // each quarter: four groups
        let (low, high) = (_mm512_unpacklo_epi64(two, next), _mm512_unpackhi_epi64(two, next));
        *four = _mm512_max_epu8(low, high);
    }
    let [a, b, c, d] = fours;
    quarters(quarters(a, b), quarters(c, d))
}

/// Bytes in turn from `a` and `b`.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn side_by_side(a: __m256i, b: __m256i) -> __m512i {
    _mm512_or_si512(_mm512_cvtepu8_epi16(a), _mm512_slli_epi16::<8>(_mm512_cvtepu8_epi16(b)))
}

/// Neighbouring quarters of `a`, then of `b`.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn quarters(a: __m512i, b: __m512i) -> __m512i {
    let even = _mm512_shuffle_i64x2::<0b10_00_10_00>(a, b);
    _mm512_max_epu8(even, _mm512_shuffle_i64x2::<0b11_01_11_01>(a, b))
}
