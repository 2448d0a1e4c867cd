//! Table look-ups, drives as an update takes them, pulses of rows.
//!
//! ```text
//! look-up   8 entries a gather; value and derivative lie in the low bytes of an entry
//! turn      16 samples x 16 rows -> 16 rows x 16 samples
//! peaks     four rows a word: the greatest of 16 words
//! ```
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::x86_64::*;

use super::load_sums;
use crate::chip::crossbar::kernel::{Extremes, Half, LookUp, Peaks, scalar};
use crate::chip::crossbar::layout::{BLOCK_ROWS, PANEL_COLUMNS};

#[target_feature(enable = "avx2,popcnt")]
pub(super) fn look_up(
    accumulators: &[i32],
    table: &LookUp,
    live: usize,
    values: &mut [u8],
    derivatives: &mut [u8],
) -> u64 {
    let half = i32::try_from(table.entries.len() / 2).expect("at most 2^30 entries");
    let step_half = _mm256_set1_epi32((1u32 << table.shift >> 1).cast_signed());
    let shift = _mm256_set1_epi32(table.shift.cast_signed());
    let (least, most) = (_mm256_set1_epi32(-half), _mm256_set1_epi32(half - 1));
    let offset = _mm256_set1_epi32(half);
    let lanes = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    let alive: [__m256i; 4] = std::array::from_fn(|at| {
        let live = i32::try_from(live).expect("at most 32") - 8 * at as i32;
        _mm256_cmpgt_epi32(_mm256_set1_epi32(live), lanes)
    });
    // entries of lanes that are not alive are not read and stay 0
    let entries = table.entries.as_ptr().cast::<i32>();
    let mut saturated = 0;
    for (sample, accumulators) in accumulators.as_chunks::<PANEL_COLUMNS>().0.iter().enumerate() {
        let mut found = [_mm256_setzero_si256(); 4];
        for ((found, alive), sums) in
            found.iter_mut().zip(alive).zip(accumulators.as_chunks::<8>().0)
        {
            let sums = load_sums(sums);
            // the rounding carry is added after the shift: half a step beside the greatest sum would wrap
            let carry = _mm256_and_si256(sums, step_half);
            let carry = _mm256_andnot_si256(
                _mm256_cmpeq_epi32(carry, _mm256_setzero_si256()),
                _mm256_set1_epi32(1),
            );
            let steps = _mm256_add_epi32(_mm256_srav_epi32(sums, shift), carry);
            let held = _mm256_max_epi32(_mm256_min_epi32(steps, most), least);
            let changed = _mm256_andnot_si256(_mm256_cmpeq_epi32(held, steps), alive);
            saturated += _mm256_movemask_ps(_mm256_castsi256_ps(changed)).count_ones();
            let index = _mm256_add_epi32(held, offset);
            // SAFETY: an index is 0 ..= 2 * half - 1 by the clamp, and the table has 2 * half entries of four bytes.
            *found = unsafe {
                _mm256_mask_i32gather_epi32::<4>(_mm256_setzero_si256(), entries, index, alive)
            };
        }
        // value and derivative of 16 columns a vector, in quarters 0 2 1 3 of 4 columns
        let low = _mm256_set1_epi32(0xffff);
        for found in &mut found {
            *found = _mm256_and_si256(*found, low);
        }
        let [a, b, c, d] = found;
        let (ab, cd) = (_mm256_packus_epi32(a, b), _mm256_packus_epi32(c, d));
        let byte = _mm256_set1_epi16(0xff);
        let value = _mm256_packus_epi16(_mm256_and_si256(ab, byte), _mm256_and_si256(cd, byte));
        let slope = _mm256_packus_epi16(_mm256_srli_epi16::<8>(ab), _mm256_srli_epi16::<8>(cd));
        // dwords lie as 0 2 4 6 | 1 3 5 7
        let order = _mm256_setr_epi32(0, 4, 1, 5, 2, 6, 3, 7);
        let at = sample * BLOCK_ROWS;
        for (out, v) in [(&mut *values, value), (&mut *derivatives, slope)] {
            let out: &mut [u8; 32] = out[at..].first_chunk_mut().expect("32 columns");
            super::store(out, _mm256_permutevar8x32_epi32(v, order));
        }
    }
    saturated.into()
}

/// See [`super::super::Kernel::turn`].
#[target_feature(enable = "avx2,popcnt")]
pub(super) fn turn(codes: &[u8], stride: usize, turned: &mut [u8]) {
    let samples = codes.len() / BLOCK_ROWS;
    if !stride.is_multiple_of(16) {
        return scalar::turn(codes, stride, turned);
    }
    for first in (0..stride).step_by(16) {
        let mut some = [[0; BLOCK_ROWS]; 16];
        for (row, codes) in
            some.iter_mut().zip((first..samples).map(|at| &codes[at * BLOCK_ROWS..]))
        {
            row.copy_from_slice(&codes[..BLOCK_ROWS]);
        }
        for rows in 0..BLOCK_ROWS / 16 {
            let v: [__m128i; 16] = std::array::from_fn(|sample| {
                let row: &[u8; 16] = some[sample][16 * rows..].first_chunk().expect("64 rows");
                // SAFETY: the reference covers the 16 bytes that an unaligned load reads.
                unsafe { _mm_loadu_si128(row.as_ptr().cast()) }
            });
            for (row, v) in turn_square(v).into_iter().enumerate() {
                let at = (16 * rows + row) * stride + first;
                let out: &mut [u8; 16] = turned[at..].first_chunk_mut().expect("16 samples");
                // SAFETY: the reference covers the 16 bytes that an unaligned store writes.
                unsafe { _mm_storeu_si128(out.as_mut_ptr().cast(), v) }
            }
        }
    }
}

/// A 16 x 16 transposition of bytes: four rounds of interleaving vector i with vector i + 8.
#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn turn_square(mut v: [__m128i; 16]) -> [__m128i; 16] {
    for _ in 0..4 {
        let from = v;
        for (pair, to) in v.as_chunks_mut::<2>().0.iter_mut().enumerate() {
            let (a, b) = (from[pair], from[pair + 8]);
            *to = [_mm_unpacklo_epi8(a, b), _mm_unpackhi_epi8(a, b)];
        }
    }
    v
}

/// See [`super::super::Kernel::peaks`].
#[target_feature(enable = "avx2,popcnt")]
pub(super) fn peaks(extremes: &Extremes) -> Peaks {
    let mut peaks = [[0; 2]; BLOCK_ROWS];
    for (end, cells) in [&extremes.most, &extremes.least].into_iter().enumerate() {
        for (group, peaks) in peaks.as_chunks_mut::<4>().0.iter_mut().enumerate() {
            for (peak, size) in peaks.iter_mut().zip(greatest(cells, group).to_le_bytes()) {
                peak[end] = size;
            }
        }
    }
    peaks
}

/// Greatest size of four rows over 16 columns, a byte a row.
#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn greatest(cells: &Half<i8>, group: usize) -> u32 {
    let cells: &[i8; 64] = cells[64 * group..].first_chunk().expect("16 groups");
    // SAFETY: the reference covers the 64 bytes that two unaligned loads read.
    let (a, b) = unsafe {
        let at = cells.as_ptr().cast::<__m256i>();
        (_mm256_loadu_si256(at), _mm256_loadu_si256(at.add(1)))
    };
    let v = _mm256_max_epu8(_mm256_abs_epi8(a), _mm256_abs_epi8(b));
    let v = _mm_max_epu8(_mm256_castsi256_si128(v), _mm256_extracti128_si256::<1>(v));
    let v = _mm_max_epu8(v, _mm_shuffle_epi32::<0b01_00_11_10>(v));
    let v = _mm_max_epu8(v, _mm_shuffle_epi32::<0b10_11_00_01>(v));
    _mm_cvtsi128_si32(v).cast_unsigned()
}
