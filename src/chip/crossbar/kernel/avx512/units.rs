//! Converters, tables and gates, a row of units at a time.
//!
//! ```text
//! convert   two rows of 16 currents are shifted, packed to 32 16-bit steps, and bounded
//! look-up   16 entries a gather
//! gate      rsh(err * a', eb) = mulhrs(err << (15 - eb), a'),  mulhrs(a, b) = (a * b + 2^14) >> 15
//! ```
//!
//! Packing saturates at 65,535, which is at least the greatest code. `|err| < 2^(eb-1)`, so `err << (15 - eb)` fits
//! 16 bits, and the gate is at most 127 in size, for every width from 2 to 9: none saturates.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::x86_64::*;

use super::turn::interleave;
use super::{load_sums, store_sums};
use crate::chip::crossbar::kernel::{Conversion, LookUp, MiddleOf, Packed, Rails, Scratch, scalar};
use crate::chip::crossbar::layout::{BLOCK_ROWS, PANEL_COLUMNS};
use crate::num::fixed::ErrorBits;

/// Steps of a row of 32 currents, 16 bits each, in order.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn steps(currents: &[i32; 32], half: __m512i, shift: __m512i) -> __m512i {
    let [a, b] = currents.as_chunks::<16>().0 else { unreachable!("two vectors") };
    let [a, b] = [a, b].map(|v| _mm512_srlv_epi32(_mm512_add_epi32(load_sums(v), half), shift));
    _mm512_packus_epi32(a, b)
}

#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(super) fn convert(
    currents: [&[i32]; 2],
    conversion: Conversion,
    live: usize,
    codes: &mut [i16],
) -> Rails {
    if live == PANEL_COLUMNS {
        converted::<true>(currents, conversion, u32::MAX, codes)
    } else {
        converted::<false>(currents, conversion, packed_mask((1 << live) - 1), codes)
    }
}

#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn converted<const ALL: bool>(
    [e, i]: [&[i32]; 2],
    conversion: Conversion,
    alive: u32,
    codes: &mut [i16],
) -> Rails {
    let half = _mm512_set1_epi32(1 << conversion.shift >> 1);
    let shift = _mm512_set1_epi32(conversion.shift.cast_signed());
    let max = _mm512_set1_epi16(conversion.max.cast_signed());
    // packing leaves quarters of 8 bytes in the order 0 4 1 5 2 6 3 7
    let order = _mm512_setr_epi64(0, 2, 4, 6, 1, 3, 5, 7);
    // conversions by lane, counted downward: at most 32 rows of two banks
    let mut saturated = [_mm512_setzero_si512(); 2];
    let mut reached = _mm512_setzero_si512();
    let rows = e.as_chunks::<PANEL_COLUMNS>().0.iter().zip(i.as_chunks::<PANEL_COLUMNS>().0);
    for (codes, (e, i)) in codes.as_chunks_mut::<PANEL_COLUMNS>().0.iter_mut().zip(rows) {
        let banks = [steps(e, half, shift), steps(i, half, shift)];
        for (saturated, steps) in saturated.iter_mut().zip(banks) {
            let (above, at) = if ALL {
                (_mm512_cmpgt_epu16_mask(steps, max), _mm512_cmpge_epu16_mask(steps, max))
            } else {
                (
                    _mm512_mask_cmpgt_epu16_mask(alive, steps, max),
                    _mm512_mask_cmpge_epu16_mask(alive, steps, max),
                )
            };
            *saturated = _mm512_mask_sub_epi16(*saturated, above, *saturated, _mm512_set1_epi16(1));
            reached = _mm512_mask_sub_epi16(reached, at, reached, _mm512_set1_epi16(1));
        }
        let [e, i] = banks.map(|steps| _mm512_min_epu16(steps, max));
        let d = if ALL { _mm512_sub_epi16(e, i) } else { _mm512_maskz_sub_epi16(alive, e, i) };
        add_codes(codes, _mm512_permutexvar_epi64(order, d));
    }
    let sum = |lanes| {
        // pairs of 16-bit counts add up to 32 bits
        let pairs = _mm512_madd_epi16(lanes, _mm512_set1_epi16(-1));
        u64::from(_mm512_reduce_add_epi32(pairs).cast_unsigned())
    };
    Rails { saturated: saturated.map(sum), reached: sum(reached) }
}

/// Converts the last inhibitory sums and adds packed codes to `codes`, in order. Returns saturated conversions.
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(in crate::chip::crossbar::kernel) fn settle(
    last: &[i32; Scratch::SUMS],
    conversion: Conversion,
    live: usize,
    packed: &mut Packed,
    codes: &mut [i16; Scratch::SUMS],
) -> Rails {
    let half = _mm512_set1_epi32(1 << conversion.shift >> 1);
    let shift = _mm512_set1_epi32(conversion.shift.cast_signed());
    let max = _mm512_set1_epi16(conversion.max.cast_signed());
    let order = _mm512_setr_epi64(0, 2, 4, 6, 1, 3, 5, 7);
    let alive = packed_mask(u32::try_from((1u64 << live) - 1).expect("at most 32 columns"));
    let mut saturated = load_words(&packed.saturated[1]);
    let mut reached = load_words(&packed.reached[1]);
    let rows = codes.as_chunks_mut::<PANEL_COLUMNS>().0.iter_mut();
    let rows = rows.zip(packed.codes.as_chunks::<PANEL_COLUMNS>().0);
    for ((codes, packed), last) in rows.zip(last.as_chunks::<PANEL_COLUMNS>().0) {
        let i = steps(last, half, shift);
        let above = _mm512_cmpgt_epu16_mask(i, max);
        saturated = _mm512_mask_add_epi16(saturated, above, saturated, _mm512_set1_epi16(1));
        let at = _mm512_cmpge_epu16_mask(i, max);
        reached = _mm512_mask_add_epi16(reached, at, reached, _mm512_set1_epi16(1));
        let d = _mm512_sub_epi16(load_words(packed), _mm512_min_epu16(i, max));
        let d = _mm512_maskz_mov_epi16(alive, d);
        add_codes(codes, _mm512_permutexvar_epi64(order, d));
    }
    let sum = |lanes| {
        let lanes = _mm512_maskz_mov_epi16(alive, lanes);
        // pairs of 16-bit counts add up to 32 bits
        let pairs = _mm512_madd_epi16(lanes, _mm512_set1_epi16(1));
        u64::from(_mm512_reduce_add_epi32(pairs).cast_unsigned())
    };
    let saturated = [load_words(&packed.saturated[0]), saturated].map(sum);
    Rails { saturated, reached: sum(load_words(&packed.reached[0])) + sum(reached) }
}

#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn load_words(words: &[i16; 32]) -> __m512i {
    // SAFETY: the reference covers the 32 words, 64 bytes, that an unaligned load reads.
    unsafe { _mm512_loadu_si512(words.as_ptr().cast()) }
}

/// Bits of columns, in the order in which [`steps`] packs them.
fn packed_mask(alive: u32) -> u32 {
    (0..32).fold(0, |mask, lane| {
        let (quarter, at) = (lane / 8, lane % 8);
        let column = if at < 4 { quarter * 4 + at } else { 16 + quarter * 4 + at - 4 };
        mask | (alive >> column & 1) << lane
    })
}

#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn add_codes(codes: &mut [i16; 32], d: __m512i) {
    let before = load_words(codes);
    // SAFETY: the reference covers the 32 codes, 64 bytes, that an unaligned store writes.
    unsafe { _mm512_storeu_si512(codes.as_mut_ptr().cast(), _mm512_add_epi16(before, d)) }
}

#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(super) fn look_up(
    accumulators: &[i32],
    table: &LookUp,
    live: usize,
    values: &mut [u8],
    derivatives: &mut [u8],
) -> u64 {
    let half = i32::try_from(table.entries.len() / 2).expect("at most 2^13");
    let rounding = _mm512_set1_epi32(1 << table.shift >> 1);
    let shift = _mm512_set1_epi32(table.shift.cast_signed());
    let (most, least) = (_mm512_set1_epi32(half - 1), _mm512_set1_epi32(-half));
    let alive = u32::try_from((1u64 << live) - 1).expect("at most 32 columns");
    let alive = [alive as u16, (alive >> 16) as u16];
    let middle = _mm512_set1_epi32(half);
    let mut saturated = 0;
    let rows = accumulators.as_chunks::<PANEL_COLUMNS>().0.iter();
    let values = values.chunks_mut(BLOCK_ROWS).zip(derivatives.chunks_mut(BLOCK_ROWS));
    for (accumulators, (values, derivatives)) in rows.zip(values) {
        let values = values.as_chunks_mut::<16>().0.iter_mut();
        let derivatives = derivatives.as_chunks_mut::<16>().0.iter_mut();
        let halves = accumulators.as_chunks::<16>().0.iter().zip(alive);
        for ((accumulators, alive), (values, derivatives)) in halves.zip(values.zip(derivatives)) {
            let v = load_sums(accumulators);
            // rsh(v, s) = (v >> s) + bit s-1 of v: nothing is added to v itself
            let odd = _mm512_test_epi32_mask(v, rounding);
            let steps = _mm512_srav_epi32(v, shift);
            let steps = _mm512_mask_add_epi32(steps, odd, steps, _mm512_set1_epi32(1));
            let i = _mm512_max_epi32(_mm512_min_epi32(steps, most), least);
            saturated += _mm512_mask_cmpneq_epi32_mask(alive, i, steps).count_ones();
            // SAFETY: i lies in -half..half, so i + half indexes one of the 2 * half entries of the table.
            let entries = unsafe {
                _mm512_i32gather_epi32::<4>(
                    _mm512_add_epi32(i, middle),
                    table.entries.as_ptr().cast(),
                )
            };
            store_bytes(values, _mm512_maskz_cvtepi32_epi8(alive, entries));
            let slopes = _mm512_srli_epi32::<8>(entries);
            store_bytes(derivatives, _mm512_maskz_cvtepi32_epi8(alive, slopes));
        }
    }
    saturated.into()
}

#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(super) fn store_bytes(bytes: &mut [u8; 16], v: __m128i) {
    // SAFETY: the reference covers the 16 bytes that an unaligned store writes.
    unsafe { _mm_storeu_si128(bytes.as_mut_ptr().cast(), v) }
}

#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(super) fn difference(currents: [&[i32]; 2], sums: &mut [i32]) {
    scalar::difference(currents, sums);
}

/// Words of a sample fit one vector: a permutation taps them. Of wider buses, neighbours are copied, and other words
/// tapped one after the other.
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(super) fn latch(words: &[i16], width: usize, taps: &[u16], errors: &mut [i16]) {
    if width > 32 {
        let neighbours = taps.windows(2).all(|pair| pair[0] + 1 == pair[1]);
        let Some(&first) = taps.first().filter(|_| neighbours) else {
            return scalar::latch(words, width, taps, errors);
        };
        let rows = errors.as_chunks_mut::<64>().0.iter_mut();
        for (words, errors) in words.chunks_exact(width).zip(rows) {
            errors[..taps.len()].copy_from_slice(&words[usize::from(first)..][..taps.len()]);
            errors[taps.len()..].fill(0);
        }
        return;
    }
    let mut all = [0; 64];
    all.iter_mut().zip(taps).for_each(|(all, tap)| *all = tap.cast_signed());
    let taps_of = [0, 1].map(|half| load_words(&all.as_chunks::<32>().0[half]));
    let live = u64::MAX >> (64 - taps.len().max(1));
    let live = [live as u32, (live >> 32) as u32];
    let rows = errors.as_chunks_mut::<64>().0.iter_mut();
    for (words, errors) in words.chunks_exact(width).zip(rows) {
        // SAFETY: the mask has `width` bits, and the slice as many words: no other is read.
        let bus = unsafe { _mm512_maskz_loadu_epi16(u32::MAX >> (32 - width), words.as_ptr()) };
        for (half, errors) in errors.as_chunks_mut::<32>().0.iter_mut().enumerate() {
            let tapped = _mm512_maskz_permutexvar_epi16(live[half], taps_of[half], bus);
            store_words(errors, tapped);
        }
    }
}

#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn store_words(words: &mut [i16; 32], v: __m512i) {
    // SAFETY: the reference covers the 32 words, 64 bytes, that an unaligned store writes.
    unsafe { _mm512_storeu_si512(words.as_mut_ptr().cast(), v) }
}

/// Gates of 64 columns of one sample.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn gates_of(errors: &[i16; 64], slopes: &[u8; 64], up: __m512i, sign: __m512i) -> __m512i {
    let mut rows = [_mm256_setzero_si256(); 2];
    let halves = errors.as_chunks::<32>().0.iter().zip(slopes.as_chunks::<32>().0);
    for (row, (errors, slopes)) in rows.iter_mut().zip(halves) {
        // SAFETY: the reference covers the 32 words, 64 bytes, that an unaligned load reads.
        let errors = unsafe { _mm512_loadu_si512(errors.as_ptr().cast()) };
        // SAFETY: the reference covers the 32 bytes that an unaligned load reads.
        let slopes = unsafe { _mm256_loadu_si256(slopes.as_ptr().cast()) };
        let errors = _mm512_sub_epi16(_mm512_xor_si512(errors, sign), sign);
        let errors = _mm512_sllv_epi16(errors, up);
        let gates = _mm512_mulhrs_epi16(errors, _mm512_cvtepu8_epi16(slopes));
        *row = _mm512_cvtepi16_epi8(gates);
    }
    _mm512_inserti64x4::<1>(_mm512_castsi256_si512(rows[0]), rows[1])
}

#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(super) fn gate(
    errors: &[i16],
    derivatives: &[u8],
    negate: bool,
    bits: ErrorBits,
    stride: usize,
    gates: &mut [i8],
) -> u64 {
    gate_shared((errors, 1), derivatives, negate, bits, stride, gates)
}

#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(super) fn gate_shared(
    (errors, shared): (&[i16], usize),
    derivatives: &[u8],
    negate: bool,
    bits: ErrorBits,
    stride: usize,
    gates: &mut [i8],
) -> u64 {
    let up = _mm512_set1_epi16(15 - i16::try_from(bits.get()).expect("at most 9 bits"));
    let sign = _mm512_set1_epi16(if negate { -1 } else { 0 });
    let mut errors = errors.as_chunks::<64>().0.iter();
    let mut slopes = derivatives.as_chunks::<64>().0.iter();
    let (mut error, mut left) = (&[0; 64], 0);
    for quad in 0..stride / 4 {
        let mut rows = [_mm512_setzero_si512(); 4];
        for row in &mut rows {
            let Some(slopes) = slopes.next() else { break };
            if left == 0 {
                error = errors.next().expect("checked: every unit has an error");
                left = shared;
            }
            left -= 1;
            *row = gates_of(error, slopes, up, sign);
        }
        for (half, v) in interleave(rows).into_iter().enumerate() {
            let at = half * 16 * stride + quad * 64;
            store_gates(&mut gates[at..], v);
        }
    }
    0
}

/// See [`super::super::Kernel::put_out`].
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(super) fn put_out(
    accumulators: &[i32],
    (middle, table): (MiddleOf<'_>, &LookUp),
    live: usize,
    totals: &mut [i64; PANEL_COLUMNS],
    (values, derivatives): (&mut [u8], &mut [u8]),
) -> Option<[u64; 2]> {
    // squares of indices of 32 samples fit 32 bits
    if table.entries.len() > 1 << 13 || accumulators.len() > 32 * PANEL_COLUMNS {
        return None;
    }
    let half = i32::try_from(table.entries.len() / 2).expect("at most 2^12");
    let rounding = _mm512_set1_epi32(1 << table.shift >> 1);
    let shift = _mm512_set1_epi32(table.shift.cast_signed());
    let raise = _mm512_set1_epi32(middle.raise.cast_signed());
    let (most, least) = (_mm512_set1_epi32(half - 1), _mm512_set1_epi32(-half));
    let (entry, short) = (_mm512_set1_epi32(half), _mm512_set1_epi32(0xffff));
    let zero = _mm512_setzero_si512();
    let alive = u32::try_from((1u64 << live) - 1).expect("at most 32 columns");
    let (mut saturated, mut all_squares) = (0, 0);
    for column in 0..2 {
        let alive = (alive >> (16 * column)) as u16;
        let offsets = load_sums(&middle.offsets.as_chunks::<16>().0[column]);
        // sums of 32 numbers, by their lower and upper 16 bits
        let (mut lower, mut upper, mut squares) = (zero, zero, zero);
        let rows = accumulators.as_chunks::<PANEL_COLUMNS>().0.iter();
        let rows = rows.zip(values.chunks_mut(BLOCK_ROWS).zip(derivatives.chunks_mut(BLOCK_ROWS)));
        for (accumulators, (values, derivatives)) in rows {
            let v = load_sums(&accumulators.as_chunks::<16>().0[column]);
            lower = _mm512_add_epi32(lower, _mm512_and_si512(v, short));
            upper = _mm512_add_epi32(upper, _mm512_srai_epi32::<16>(v));
            let v = _mm512_sllv_epi32(_mm512_sub_epi32(v, offsets), raise);
            // as in `look_up`
            let odd = _mm512_test_epi32_mask(v, rounding);
            let steps = _mm512_srav_epi32(v, shift);
            let steps = _mm512_mask_add_epi32(steps, odd, steps, _mm512_set1_epi32(1));
            let i = _mm512_max_epi32(_mm512_min_epi32(steps, most), least);
            saturated += _mm512_mask_cmpneq_epi32_mask(alive, i, steps).count_ones();
            // the upper halves of lanes are 0, and lower ones numbers of 13 bits
            let low = _mm512_and_si512(i, short);
            squares = _mm512_add_epi32(squares, _mm512_madd_epi16(low, low));
            // SAFETY: i lies in -half..half, so i + half indexes one of the 2 * half entries of the table.
            let entries = unsafe {
                _mm512_i32gather_epi32::<4>(
                    _mm512_add_epi32(i, entry),
                    table.entries.as_ptr().cast(),
                )
            };
            let values = &mut values.as_chunks_mut::<16>().0[column];
            store_bytes(values, _mm512_maskz_cvtepi32_epi8(alive, entries));
            let slopes = _mm512_srli_epi32::<8>(entries);
            let derivatives = &mut derivatives.as_chunks_mut::<16>().0[column];
            store_bytes(derivatives, _mm512_maskz_cvtepi32_epi8(alive, slopes));
        }
        let (mut low, mut high) = ([0; 16], [0; 16]);
        store_sums(&mut low, lower);
        store_sums(&mut high, upper);
        for (total, (low, high)) in totals[16 * column..].iter_mut().zip(low.into_iter().zip(high))
        {
            *total += i64::from(low) + (i64::from(high) << 16);
        }
        let mut by_lane = [0; 16];
        store_sums(&mut by_lane, _mm512_maskz_mov_epi32(alive, squares));
        all_squares += by_lane.iter().map(|&sum| u64::from(sum.cast_unsigned())).sum::<u64>();
    }
    Some([all_squares, saturated.into()])
}

#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn store_gates(gates: &mut [i8], v: __m512i) {
    let gates: &mut [i8; 64] = gates.first_chunk_mut().expect("64 gates a vector");
    // SAFETY: the reference covers the 64 bytes that an unaligned store writes.
    unsafe { _mm512_storeu_si512(gates.as_mut_ptr().cast(), v) }
}
