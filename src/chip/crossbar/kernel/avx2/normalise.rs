//! Normalised activities, and squares of sums: products of 32 bits, eight numbers a vector, even lanes apart from odd ones.
//!
//! ```text
//! v rc >> 32   = ((v (rc mod 2^32) + 2^39) >> 32) + v (rc >> 32)       the carry of rounding lies in the first term
//! code         = that >> 8                                             v rc < 2^55: it has at most 23 bits
//! ```
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::x86_64::*;

use super::{load_sums, store, total};
use crate::chip::crossbar::kernel::{Half, HandOn, MEAN_BITS, Squares};
use crate::chip::crossbar::layout::{BLOCK_ROWS, HALF_COLUMNS, PANEL_COLUMNS};

#[target_feature(enable = "avx2,popcnt")]
pub(super) fn stream_squares(sums: &[i32], squares: &mut [u64]) {
    for (square, sums) in squares.iter_mut().zip(sums.as_chunks::<PANEL_COLUMNS>().0) {
        let mut sum = [_mm256_setzero_si256(); 2];
        for sums in sums.as_chunks::<8>().0 {
            let v = _mm256_max_epi32(load_sums(sums), _mm256_setzero_si256());
            let odd = _mm256_srli_epi64::<32>(v);
            sum[0] = _mm256_add_epi64(sum[0], _mm256_mul_epu32(v, v));
            sum[1] = _mm256_add_epi64(sum[1], _mm256_mul_epu32(odd, odd));
        }
        *square += total(_mm256_add_epi64(sum[0], sum[1]));
    }
}

/// See [`super::super::Kernel::squares`].
#[target_feature(enable = "avx2,popcnt")]
pub(super) fn squares(sums: &Half<i32>, wide: bool) -> Squares {
    let zero = _mm256_setzero_si256();
    let below = _mm256_set1_epi64x(0xffff_ffff);
    let (mut low, mut high) = (zero, zero);
    for sums in sums.as_chunks::<8>().0 {
        let even = load_sums(sums);
        let odd = _mm256_srli_epi64::<32>(even);
        for square in [_mm256_mul_epi32(even, even), _mm256_mul_epi32(odd, odd)] {
            if wide {
                low = _mm256_add_epi64(low, _mm256_and_si256(square, below));
                high = _mm256_add_epi64(high, _mm256_srli_epi64::<32>(square));
            } else {
                low = _mm256_add_epi64(low, square);
            }
        }
    }
    [low, high].map(|sums| total(sums))
}

#[target_feature(enable = "avx2,popcnt")]
pub(super) fn scale(
    sums: &[i32],
    reciprocals: &[u64],
    hand_on: HandOn,
    values: &mut [u8],
    derivatives: &mut [u8],
) -> u64 {
    let zero = _mm256_setzero_si256();
    let rounding = _mm256_set1_epi64x(1 << 39);
    let most = _mm256_set1_epi32(255);
    // dwords lie as 0 2 4 6 | 1 3 5 7 once packed
    let order = _mm256_setr_epi32(0, 4, 1, 5, 2, 6, 3, 7);
    let mut beyond = zero;
    let rows = values.chunks_mut(BLOCK_ROWS).zip(derivatives.chunks_mut(BLOCK_ROWS));
    let sums = sums.as_chunks::<PANEL_COLUMNS>().0.iter().zip(reciprocals);
    for ((sums, &rc), (values, derivatives)) in sums.zip(rows) {
        let low = _mm256_set1_epi64x((rc & 0xffff_ffff).cast_signed());
        let high = _mm256_set1_epi32((rc >> 32) as i32);
        let (mut codes, mut up) = ([zero; 4], [zero; 4]);
        for (at, sums) in sums.as_chunks::<8>().0.iter().enumerate() {
            let sum = load_sums(sums);
            let v = _mm256_max_epi32(sum, zero);
            let even = _mm256_add_epi64(_mm256_mul_epu32(v, low), rounding);
            let odd = _mm256_mul_epu32(_mm256_srli_epi64::<32>(v), low);
            let odd = _mm256_add_epi64(odd, rounding);
            let product = _mm256_blend_epi32::<0b1010_1010>(_mm256_srli_epi64::<32>(even), odd);
            let product = _mm256_add_epi32(product, _mm256_mullo_epi32(v, high));
            codes[at] = _mm256_srli_epi32::<8>(product);
            beyond = _mm256_sub_epi32(beyond, _mm256_cmpgt_epi32(codes[at], most));
            up[at] = _mm256_cmpgt_epi32(sum, zero);
        }
        let handed = |a, b| handed(_mm256_packs_epi32(a, b), hand_on);
        let value = _mm256_packus_epi16(handed(codes[0], codes[1]), handed(codes[2], codes[3]));
        let slope =
            _mm256_packs_epi16(_mm256_packs_epi32(up[0], up[1]), _mm256_packs_epi32(up[2], up[3]));
        for (out, v) in [(values, value), (derivatives, slope)] {
            let out: &mut [u8; 32] = out.first_chunk_mut().expect("every unit has its place");
            store(out, _mm256_permutevar8x32_epi32(v, order));
        }
    }
    // of each pair of counts one word: both are far below 2^31
    let pairs = _mm256_add_epi64(
        _mm256_and_si256(beyond, _mm256_set1_epi64x(0xffff_ffff)),
        _mm256_srli_epi64::<32>(beyond),
    );
    total(pairs)
}

/// What units hand on whose codes, not held yet, these 16 words are.
#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn handed(codes: __m256i, hand_on: HandOn) -> __m256i {
    let shift = _mm_cvtsi32_si128(hand_on.shift.cast_signed());
    let half = _mm256_set1_epi16((1i16 << hand_on.shift) >> 1);
    let codes = _mm256_min_epi16(codes, _mm256_set1_epi16(255));
    let rounded = _mm256_srl_epi16(_mm256_add_epi16(codes, half), shift);
    _mm256_min_epi16(rounded, _mm256_set1_epi16(hand_on.max as i16))
}

/// Rows one after the other: compilers gather means of several at once.
#[target_feature(enable = "avx2,popcnt")]
pub(super) fn centre(
    sums: &mut Half<i32>,
    means: &[i32; BLOCK_ROWS],
    totals: &[i32; HALF_COLUMNS],
) {
    let totals = [0, 8].map(|at| load_sums(totals[at..].first_chunk().expect("16 columns")));
    for (sums, &mean) in sums.as_chunks_mut::<HALF_COLUMNS>().0.iter_mut().zip(means) {
        for (sums, totals) in sums.as_chunks_mut::<8>().0.iter_mut().zip(totals) {
            let raised = _mm256_slli_epi32::<{ MEAN_BITS.cast_signed() }>(load_sums(sums));
            let off = _mm256_mullo_epi32(_mm256_set1_epi32(mean), totals);
            let centred = _mm256_sub_epi32(raised, off);
            // SAFETY: the reference covers the 8 sums, 32 bytes, that an unaligned store writes.
            unsafe { _mm256_storeu_si256(sums.as_mut_ptr().cast(), centred) }
        }
    }
}
