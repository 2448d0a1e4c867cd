//! Normalised activities, and squares of sums: products of 32 bits, sixteen numbers a vector. The equation is that of `avx2/normalise.rs`.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::x86_64::*;

use super::units::store_bytes;
use super::{load_sums, store_sums};
use crate::chip::crossbar::kernel::{Half, HandOn, MEAN_BITS, Squares};
use crate::chip::crossbar::layout::{BLOCK_ROWS, HALF_COLUMNS, PANEL_COLUMNS};

#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(super) fn stream_squares(sums: &[i32], squares: &mut [u64]) {
    for (square, sums) in squares.iter_mut().zip(sums.as_chunks::<PANEL_COLUMNS>().0) {
        let mut sum = _mm512_setzero_si512();
        for sums in sums.as_chunks::<16>().0 {
            let v = _mm512_max_epi32(load_sums(sums), _mm512_setzero_si512());
            let odd = _mm512_srli_epi64::<32>(v);
            let both = _mm512_add_epi64(_mm512_mul_epu32(v, v), _mm512_mul_epu32(odd, odd));
            sum = _mm512_add_epi64(sum, both);
        }
        *square += _mm512_reduce_add_epi64(sum).cast_unsigned();
    }
}

/// See [`super::super::Kernel::squares`].
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(super) fn squares(sums: &Half<i32>, wide: bool) -> Squares {
    let zero = _mm512_setzero_si512();
    let below = _mm512_set1_epi64(0xffff_ffff);
    let (mut low, mut high) = (zero, zero);
    for sums in sums.as_chunks::<16>().0 {
        let even = load_sums(sums);
        let odd = _mm512_srli_epi64::<32>(even);
        for square in [_mm512_mul_epi32(even, even), _mm512_mul_epi32(odd, odd)] {
            if wide {
                low = _mm512_add_epi64(low, _mm512_and_si512(square, below));
                high = _mm512_add_epi64(high, _mm512_srli_epi64::<32>(square));
            } else {
                low = _mm512_add_epi64(low, square);
            }
        }
    }
    [low, high].map(|sums| _mm512_reduce_add_epi64(sums).cast_unsigned())
}

#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(super) fn scale(
    sums: &[i32],
    reciprocals: &[u64],
    hand_on: HandOn,
    values: &mut [u8],
    derivatives: &mut [u8],
) -> u64 {
    let zero = _mm512_setzero_si512();
    let rounding = _mm512_set1_epi64(1 << 39);
    let code_max = _mm512_set1_epi32(255);
    let shift = _mm_cvtsi32_si128(hand_on.shift.cast_signed());
    let half = _mm512_set1_epi32((1i32 << hand_on.shift) >> 1);
    let most = _mm512_set1_epi32(hand_on.max.cast_signed());
    let mut saturated = 0;
    let rows = values.chunks_mut(BLOCK_ROWS).zip(derivatives.chunks_mut(BLOCK_ROWS));
    let sums = sums.as_chunks::<PANEL_COLUMNS>().0.iter().zip(reciprocals);
    for ((sums, &rc), (values, derivatives)) in sums.zip(rows) {
        let low = _mm512_set1_epi64((rc & 0xffff_ffff).cast_signed());
        let high = _mm512_set1_epi32((rc >> 32) as i32);
        let values = values.as_chunks_mut::<16>().0.iter_mut();
        let derivatives = derivatives.as_chunks_mut::<16>().0.iter_mut();
        let sums = sums.as_chunks::<16>().0.iter();
        for (sums, (values, derivatives)) in sums.zip(values.zip(derivatives)) {
            let sum = load_sums(sums);
            let v = _mm512_max_epi32(sum, zero);
            let even = _mm512_add_epi64(_mm512_mul_epu32(v, low), rounding);
            let odd = _mm512_mul_epu32(_mm512_srli_epi64::<32>(v), low);
            let odd = _mm512_add_epi64(odd, rounding);
            let even = _mm512_srli_epi64::<32>(even);
            let product = _mm512_mask_blend_epi32(0b1010_1010_1010_1010, even, odd);
            let product = _mm512_add_epi32(product, _mm512_mullo_epi32(v, high));
            let code = _mm512_srli_epi32::<8>(product);
            saturated += _mm512_cmpgt_epu32_mask(code, code_max).count_ones();
            let held = _mm512_min_epi32(code, code_max);
            let rounded = _mm512_srl_epi32(_mm512_add_epi32(held, half), shift);
            let value = _mm512_min_epi32(rounded, most);
            store_bytes(values, _mm512_cvtepi32_epi8(value));
            store_bytes(derivatives, _mm_movm_epi8(_mm512_cmpgt_epi32_mask(sum, zero)));
        }
    }
    saturated.into()
}

/// Rows one after the other: compilers gather means of several at once.
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(super) fn centre(
    sums: &mut Half<i32>,
    means: &[i32; BLOCK_ROWS],
    totals: &[i32; HALF_COLUMNS],
) {
    let totals = load_sums(totals);
    for (sums, &mean) in sums.as_chunks_mut::<HALF_COLUMNS>().0.iter_mut().zip(means) {
        let raised = _mm512_slli_epi32::<MEAN_BITS>(load_sums(sums));
        let off = _mm512_mullo_epi32(_mm512_set1_epi32(mean), totals);
        store_sums(sums, _mm512_sub_epi32(raised, off));
    }
}
