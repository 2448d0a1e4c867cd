//! Writes of every kind, in 32-bit lanes: 4 rows of 16 columns at a time. Levels of two bytes, remainders of `F` bits
//! behind each cell, cells gone for good.
//!
//! ```text
//! rounded   SR(sum * mantissa, k - F)
//! total     residual + rounded;  wanted = total >> F;  pulses = clamp(wanted, -d_max, d_max)
//! level     clamp(level + pulses, floor, ceiling), or as it was where the cell is gone
//! residual  clamp( total - (pulses << F), 0, 2^F - 1 );  0 below the floor, 2^F - 1 above the ceiling
//! ```
//!
//! For `k < F` the law shifts left by `n = F - k` and no word matters: `(s * 2^(D+n) + word) >> D = s * 2^n`.
//! The product is first held to `+-2^(30-n)`: beyond `+-2^30` pulses and residual rest at their ends anyway,
//! as `2^30` is above `128 * 2^15`. Otherwise `rounded` is at most the sum, and a residual of 16 bits fits above it.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::x86_64::*;

use super::{NEAREST, PLUS, WIDE, WORD, dither_rows, quotient, scale};
use crate::chip::crossbar::kernel::avx512::{load_sums, pulses, store};
use crate::chip::crossbar::kernel::{Cells, Half, Write, WriteCounts};
use crate::chip::crossbar::layout::HALF_CELLS;

/// The bits of row 0 of a group, column by column.
const ROW_0: u64 = 0x1111_1111_1111_1111;

#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt,bmi2")]
pub(super) fn general<const DITHER: u8>(
    cells: Cells<'_>,
    sums: &Half<i32>,
    write: &Write,
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
    let floor = _mm512_set1_epi32(write.floor.into());
    let ceiling = _mm512_set1_epi32(write.ceiling.into());
    // What a write does not have is nowhere: it is neither read nor stored.
    let Cells { low, mut high, mut residual, mut pruned, pulses: mut out } = cells;
    let (mut requested, mut bounded) = (0, 0);
    let (mut attempted, mut effective) = (zero, zero);
    for group in 0..HALF_CELLS / 64 {
        let low = &mut low.as_chunks_mut::<64>().0[group];
        let high = high.as_mut().map(|high| &mut high.as_chunks_mut::<64>().0[group]);
        let left = residual.as_mut().map(|left| &mut left.as_chunks_mut::<64>().0[group]);
        let bits = pruned.as_mut().map(|bits| &mut bits[group]);
        let dither = if DITHER == NEAREST {
            [zero; 4]
        } else {
            let words = &words.as_chunks::<64>().0[group];
            dither_rows::<DITHER>(&bytes.as_chunks::<64>().0[group], words)
        };
        let mut levels = dither_rows::<WIDE>(low, &[0; 64]);
        if let Some(high) = &high {
            for (level, high) in levels.iter_mut().zip(dither_rows::<WIDE>(high, &[0; 64])) {
                *level = _mm512_or_si512(*level, _mm512_slli_epi32::<8>(high));
            }
        }
        let mut remainder =
            left.as_ref().map_or([zero; 4], |left| dither_rows::<WORD>(&[0; 64], left));
        let mut gone = bits.as_ref().map_or(0, |bits| **bits);
        let sums = sums[group * 64..].as_chunks::<16>().0;
        let mut given = [zero; 4];
        for row in 0..4 {
            let sum = _mm512_mullo_epi32(load_sums(&sums[row]), scale.mantissa);
            let sum = _mm512_max_epi32(_mm512_min_epi32(sum, reach), least_reach);
            let q = quotient::<DITHER, PLUS>(_mm512_sllv_epi32(sum, up), scale);
            let rounded = if DITHER == NEAREST {
                q
            } else {
                let word = _mm512_srlv_epi32(dither[row], less);
                _mm512_srav_epi32(_mm512_add_epi32(q, word), scale.last)
            };
            let total = _mm512_add_epi32(remainder[row], rounded);
            let wanted = _mm512_srav_epi32(total, fraction);
            let pulses = _mm512_max_epi32(_mm512_min_epi32(wanted, most), least);
            given[row] = pulses;
            let before = levels[row];
            let reached = _mm512_add_epi32(before, pulses);
            let held = _mm512_max_epi32(_mm512_min_epi32(reached, ceiling), floor);
            let still = _pext_u64(gone, ROW_0 << row) as u16;
            let level = _mm512_mask_mov_epi32(held, still, before);
            let rest = _mm512_sub_epi32(total, _mm512_sllv_epi32(pulses, fraction));
            let rest = _mm512_max_epi32(_mm512_min_epi32(rest, most_left), zero);
            // a level that its window held puts the remainder at the same end
            let under = _mm512_cmplt_epi32_mask(reached, floor);
            let over = _mm512_cmpgt_epi32_mask(reached, ceiling);
            let rest = _mm512_mask_mov_epi32(rest, under, zero);
            remainder[row] = _mm512_mask_mov_epi32(rest, over, most_left);
            levels[row] = level;
            let pulsed = _mm512_test_epi32_mask(pulses, pulses);
            let absorbed = _mm512_mask_cmpeq_epi32_mask(pulsed, level, floor);
            gone |= _pdep_u64(absorbed.into(), ROW_0 << row);
            requested += _mm512_test_epi32_mask(wanted, wanted).count_ones();
            bounded += _mm512_cmpneq_epi32_mask(wanted, pulses).count_ones();
            attempted = _mm512_add_epi32(attempted, _mm512_abs_epi32(pulses));
            let moved = _mm512_abs_epi32(_mm512_sub_epi32(level, before));
            effective = _mm512_add_epi32(effective, moved);
        }
        store(low, bytes_of(levels));
        if let Some(high) = high {
            store(high, bytes_of(levels.map(|level| _mm512_srli_epi32::<8>(level))));
        }
        if let Some(left) = left {
            store_rows(left, remainder);
        }
        if let Some(bits) = bits {
            *bits = gone;
        }
        if let Some(out) = &mut out {
            pulses::take(out, group, bytes_of(given));
        }
    }
    WriteCounts {
        requested: requested.into(),
        bounded: bounded.into(),
        attempted: u64::from(_mm512_reduce_add_epi32(attempted).cast_unsigned()),
        effective: u64::from(_mm512_reduce_add_epi32(effective).cast_unsigned()),
    }
}

/// The low bytes of four rows, in the order of levels.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn bytes_of(rows: [__m512i; 4]) -> __m512i {
    let low = _mm512_set1_epi32(0xff);
    let [a, b, c] = [rows[0], rows[1], rows[2]].map(|row| _mm512_and_si512(row, low));
    let ab = _mm512_or_si512(a, _mm512_slli_epi32::<8>(b));
    let cd = _mm512_or_si512(_mm512_slli_epi32::<16>(c), _mm512_slli_epi32::<24>(rows[3]));
    _mm512_or_si512(ab, cd)
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
