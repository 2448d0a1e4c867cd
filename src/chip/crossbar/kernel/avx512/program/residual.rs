//! Writes that keep a remainder of `F` bits behind each cell, in 32-bit lanes, 4 rows of 16 columns at a time.
//!
//! ```text
//! rounded   SR(sum * mantissa, k - F)
//! total     residual + rounded;  wanted = total >> F;  pulses = clamp(wanted, -d_max, d_max)
//! residual  clamp( total - (pulses << F), 0, 2^F - 1 );  0 below the floor, 2^F - 1 above the ceiling
//! ```
//!
//! For `k < F` the law shifts left by `n = F - k` and no word matters: `(s * 2^(D+n) + word) >> D = s * 2^n`.
//! The product is first held to `+-2^(30-n)`: beyond `+-2^30` pulses and residual rest at their ends anyway,
//! as `2^30` is above `128 * 2^15`. Otherwise `rounded` is at most the sum, and a residual of 16 bits fits above it.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::x86_64::*;

use super::{NEAREST, PLUS, WIDE, WORD, counts, dither_rows, quotient, scale, settle, tally};
use crate::chip::crossbar::kernel::avx512::load_sums;
use crate::chip::crossbar::kernel::{Half, Write, WriteCounts};

#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(super) fn residual<const DITHER: u8>(
    low: &mut Half<u8>,
    left: &mut Half<u16>,
    sums: &Half<i32>,
    write: &Write,
    window: (u8, u8),
    bytes: &Half<u8>,
    words: &Half<u16>,
) -> WriteCounts {
    let scale = scale::<DITHER>(write, write.shift.saturating_sub(write.residual_bits));
    let up = write.residual_bits.saturating_sub(write.shift);
    let reach = if up == 0 { i32::MAX } else { 1 << (30 - up) };
    let (reach, least_reach) = (_mm512_set1_epi32(reach), _mm512_set1_epi32(-reach));
    let up = _mm512_set1_epi32(up.cast_signed());
    // Shifted out of all 16 bits where no word matters.
    let less = if write.shift < write.residual_bits { _mm512_set1_epi32(31) } else { scale.less };
    let fraction = _mm512_set1_epi32(write.residual_bits.cast_signed());
    let most_left = _mm512_set1_epi32((1 << write.residual_bits) - 1);
    let most = _mm512_set1_epi32(write.increment_max);
    let least = _mm512_set1_epi32(-write.increment_max);
    let zero = _mm512_setzero_si512();
    let (floor, ceiling) = (_mm512_set1_epi32(window.0.into()), _mm512_set1_epi32(window.1.into()));
    let mut tally = tally(write, window);
    let groups = sums.as_chunks::<64>().0.iter().zip(low.as_chunks_mut::<64>().0);
    let groups = groups.zip(left.as_chunks_mut::<64>().0);
    let dithers = bytes.as_chunks::<64>().0.iter().zip(words.as_chunks::<64>().0);
    for (((sums, low), left), (bytes, words)) in groups.zip(dithers) {
        let dither =
            if DITHER == NEAREST { [zero; 4] } else { dither_rows::<DITHER>(bytes, words) };
        let mut remainder = dither_rows::<WORD>(&[0; 64], left);
        let levels = dither_rows::<WIDE>(low, &[0; 64]);
        let mut wanted = [zero; 4];
        for (row, sums) in sums.as_chunks::<16>().0.iter().enumerate() {
            let sum = _mm512_mullo_epi32(load_sums(sums), scale.mantissa);
            let sum = _mm512_max_epi32(_mm512_min_epi32(sum, reach), least_reach);
            let q = quotient::<DITHER, PLUS>(_mm512_sllv_epi32(sum, up), scale);
            let rounded = if DITHER == NEAREST {
                q
            } else {
                let word = _mm512_srlv_epi32(dither[row], less);
                _mm512_srav_epi32(_mm512_add_epi32(q, word), scale.last)
            };
            let total = _mm512_add_epi32(remainder[row], rounded);
            wanted[row] = _mm512_srav_epi32(total, fraction);
            let pulses = _mm512_max_epi32(_mm512_min_epi32(wanted[row], most), least);
            let rest = _mm512_sub_epi32(total, _mm512_sllv_epi32(pulses, fraction));
            let rest = _mm512_max_epi32(_mm512_min_epi32(rest, most_left), zero);
            // a level that its window held puts the remainder at the same end
            let reached = _mm512_add_epi32(levels[row], pulses);
            let under = _mm512_cmplt_epi32_mask(reached, floor);
            let over = _mm512_cmpgt_epi32_mask(reached, ceiling);
            let rest = _mm512_mask_mov_epi32(rest, under, zero);
            remainder[row] = _mm512_mask_mov_epi32(rest, over, most_left);
        }
        store_rows(left, remainder);
        let a = _mm512_packs_epi32(wanted[0], wanted[1]);
        let b = _mm512_packs_epi32(wanted[2], wanted[3]);
        settle::<false>(a, b, low, &mut tally);
    }
    counts(&tally)
}

/// Writes four rows of 16-bit numbers in the order of levels.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn store_rows(words: &mut [u16; 64], rows: [__m512i; 4]) {
    let a = _mm512_or_si512(rows[0], _mm512_slli_epi32::<16>(rows[1]));
    let b = _mm512_or_si512(rows[2], _mm512_slli_epi32::<16>(rows[3]));
    let first = _mm512_setr_epi32(0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
    let second = _mm512_add_epi32(first, _mm512_set1_epi32(8));
    let (left, right) =
        (_mm512_permutex2var_epi32(a, first, b), _mm512_permutex2var_epi32(a, second, b));
    // SAFETY: the reference covers 64 words, 128 bytes; this writes the first 64.
    unsafe { _mm512_storeu_si512(words.as_mut_ptr().cast(), left) }
    // SAFETY: the reference covers 64 words, 128 bytes; this writes the last 64.
    unsafe { _mm512_storeu_si512(words[32..].as_mut_ptr().cast(), right) }
}
