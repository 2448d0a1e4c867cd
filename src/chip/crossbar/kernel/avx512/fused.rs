//! Writes as they usually are, at once: levels of 8 bits and nothing else, 64 cells at a time: 4 rows of 16 columns, in the
//! order of levels.
//!
//! ```text
//! q       (+-sum * mantissa + half) >> right         right = k - D, half = 2^(right - 1), or 0;  D = 8 or 16
//! wanted  (q + word) >> D
//! pulses  clamp( wanted, -d_max, d_max );  level = clamp( level + pulses, floor, ceiling )
//! ```
//!
//! Half-up is the word 128 and `half = 0`: see [`super::super::pulses`]. Sums are 32-bit: at most 4096 * 255 * 127 * 15 <
//! 2^31 - 2^27 in size, so adding `half <= 2^22` or a word cannot wrap. From 8 fractional bits on lanes have 16 bits.
//! Packing to them saturates, at pulses of 127 or -128, beyond bounds of at most 126: the pulses are the law's, and the
//! cell counts as bounded.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::x86_64::*;

use super::peaks::take;
use super::{load, load_sums, store};
use crate::chip::crossbar::kernel::pulses::HALVES;
use crate::chip::crossbar::kernel::{Cells, Dither, Half, Sums, WriteCounts, WriteLaw};

/// `sum`.
const PLUS: u8 = 0;
/// `-sum`.
const MINUS: u8 = 1;
/// `sum * (+-mantissa)`.
const TIMES: u8 = 2;

/// A window of all levels, which is where the addition saturates; bounds of at most 15, so that counts of 16 groups stay
/// in bytes.
const FULL: u8 = 0;
/// Any window; bounds of at most 15.
const FEW: u8 = 1;
/// Any window and bound.
const MANY: u8 = 2;
/// The same with words of 16 bits.
const WORDS: u8 = 3;

/// Loud groups of sums. Compilers make a loop of the twin that takes twice as long, and it is asked of most half blocks.
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(super) fn may_move(sums: Sums<'_>, write: &WriteLaw, bits: u32) -> u16 {
    match (sums, write.mantissa, write.negate) {
        (Sums::Wide(_), ..) => super::may_move(sums, write, bits),
        (Sums::Narrow(sums), 1, false) => moving_groups::<PLUS>(sums, write, bits),
        (Sums::Narrow(sums), 1, true) => moving_groups::<MINUS>(sums, write, bits),
        (Sums::Narrow(sums), ..) => moving_groups::<TIMES>(sums, write, bits),
    }
}

#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn moving_groups<const SCALE: u8>(sums: &Half<i32>, write: &WriteLaw, bits: u32) -> u16 {
    let by = write.shift.saturating_sub(write.residual_bits).saturating_sub(bits);
    // half of 2^31 beside the greatest sum wraps, and has the top bit as one that is too small
    let half = (1u32 << by >> 1).cast_signed();
    // the bits that a sum has which may move a cell, and no other
    let beyond = _mm512_set1_epi32((u32::MAX << by).cast_signed());
    let scale = Scale::new(write, half, 0);
    let mut moving = 0;
    for (group, sums) in sums.as_chunks::<64>().0.iter().enumerate() {
        let mut any = _mm512_setzero_si512();
        for sums in sums.as_chunks::<16>().0 {
            any = _mm512_or_si512(any, amount::<SCALE>(load_sums(sums), scale));
        }
        moving |= u16::from(_mm512_test_epi32_mask(any, beyond) != 0) << group;
    }
    moving
}

#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(super) fn fused(
    cells: &mut Cells<'_>,
    sums: &Half<i32>,
    write: &WriteLaw,
    dither: Dither<'_>,
) -> Option<WriteCounts> {
    let window = cells.plain_window(write)?;
    // words of another kind are not read
    let (bytes, words, bits) = match dither {
        Dither::Nearest => (&HALVES, None, 8),
        Dither::Byte(bytes) => (bytes, None, 8),
        Dither::Word(words) => (&HALVES, Some(words), 16),
    };
    if write.shift < bits || write.increment_max > 126 {
        return None;
    }
    let right = write.shift - bits;
    // half-up cuts off what lies below its words
    let half = if matches!(dither, Dither::Nearest) { 0 } else { 1 << right >> 1 };
    let by = (write, Scale::new(write, half, right));
    if let Some(words) = words {
        return Some(programmed::<TIMES, WORDS>(cells, sums, by, window, (bytes, words)));
    }
    let words = (bytes, &[0; _]);
    let few = write.increment_max <= 15;
    Some(match (few, write.mantissa, write.negate, window == (0, 255)) {
        (true, 1, false, true) => programmed::<PLUS, FULL>(cells, sums, by, window, words),
        (true, 1, false, false) => programmed::<PLUS, FEW>(cells, sums, by, window, words),
        (true, 1, true, true) => programmed::<MINUS, FULL>(cells, sums, by, window, words),
        (true, 1, true, false) => programmed::<MINUS, FEW>(cells, sums, by, window, words),
        (true, ..) => programmed::<TIMES, FEW>(cells, sums, by, window, words),
        (false, ..) => programmed::<TIMES, MANY>(cells, sums, by, window, words),
    })
}

/// `[4 columns][4 rows]` from bytes 2j: row 0 of column j, 2j + 1: row 2, 8 + 2j: row 1, 9 + 2j: row 3.
const MERGED: [u8; 16] = [0, 8, 1, 9, 2, 10, 3, 11, 4, 12, 5, 13, 6, 14, 7, 15];

/// The upper bytes of two 16-bit sums are taken at once.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn programmed<const SCALE: u8, const KIND: u8>(
    cells: &mut Cells<'_>,
    sums: &Half<i32>,
    (write, scale): (&WriteLaw, Scale),
    (floor, ceiling): (u8, u8),
    (bytes, words): (&Half<u8>, &Half<u16>),
) -> WriteCounts {
    let (low, mut out) = (&mut *cells.low, cells.pulses.as_mut());
    let bound = i8::try_from(write.increment_max).expect("checked: at most 126");
    let (most, least) = (_mm512_set1_epi8(bound), _mm512_set1_epi8(-bound));
    // levels less 128, so that the signed saturating addition ends at 0 and 255
    let flip = _mm512_set1_epi8(i8::MIN);
    let floor = _mm512_set1_epi8((floor ^ 0x80).cast_signed());
    let ceiling = _mm512_set1_epi8((ceiling ^ 0x80).cast_signed());
    let less_one = _mm512_set1_epi8(-1);
    let zero = _mm512_setzero_si512();
    let (mut requested, mut attempted, mut effective, mut held) = (zero, zero, zero, zero);
    let (sums, bytes) = (sums.as_chunks::<64>().0, bytes.as_chunks::<64>().0);
    let words = words.as_chunks::<64>().0;
    let low = low.as_chunks_mut::<64>().0;
    let mut bounded = 0;
    let mut groups = write.groups;
    while groups != 0 {
        let group = groups.trailing_zeros() as usize;
        groups &= groups - 1;
        let low = &mut low[group];
        let words = (&bytes[group], &words[group]);
        let wanted = wanted_of::<SCALE, KIND>(&sums[group], words, scale);
        let pulses = _mm512_max_epi8(_mm512_min_epi8(wanted, most), least);
        let before = load(low);
        let mut level = _mm512_adds_epi8(_mm512_xor_si512(before, flip), pulses);
        if KIND != FULL {
            level = _mm512_max_epi8(_mm512_min_epi8(level, ceiling), floor);
        }
        let level = _mm512_xor_si512(level, flip);
        store(low, level);
        if let Some(out) = &mut out {
            take(out, group, pulses);
        }
        let size = _mm512_abs_epi8(pulses);
        let some = _mm512_test_epi8_mask(pulses, pulses);
        requested = _mm512_mask_sub_epi8(requested, some, requested, less_one);
        attempted = if KIND == FULL || KIND == FEW {
            _mm512_add_epi8(attempted, size)
        } else {
            _mm512_add_epi64(attempted, _mm512_sad_epu8(size, zero))
        };
        effective = _mm512_add_epi64(effective, _mm512_sad_epu8(level, before));
        if KIND == FULL || KIND == FEW {
            // held | (wanted ^ pulses)
            held = _mm512_ternarylogic_epi32::<0xf6>(held, wanted, pulses);
        } else {
            bounded += _mm512_cmpneq_epi8_mask(wanted, pulses).count_ones();
        }
    }
    // few writes meet their bound: only then is it asked which cells did
    if _mm512_test_epi8_mask(held, held) != 0 {
        for (sums, words) in sums.iter().zip(bytes.iter().zip(words)) {
            let wanted = wanted_of::<SCALE, KIND>(sums, words, scale);
            let pulses = _mm512_max_epi8(_mm512_min_epi8(wanted, most), least);
            bounded += _mm512_cmpneq_epi8_mask(wanted, pulses).count_ones();
        }
    }
    // none of the three reaches 2^20: added up as one number
    let requested = _mm512_sad_epu8(requested, zero);
    if KIND == FULL || KIND == FEW {
        attempted = _mm512_sad_epu8(attempted, zero);
    }
    let upper = _mm512_add_epi64(_mm512_slli_epi64::<20>(effective), attempted);
    let all = _mm512_add_epi64(_mm512_slli_epi64::<20>(upper), requested);
    let all = _mm512_reduce_add_epi64(all).cast_unsigned();
    let part = |at: u32| all >> (20 * at) & 0xf_ffff;
    WriteCounts {
        requested: part(0),
        bounded: bounded.into(),
        attempted: part(1),
        effective: part(2),
    }
}

/// Increments of 64 cells before the bound, in the order of levels.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn wanted_of<const SCALE: u8, const KIND: u8>(
    sums: &[i32; 64],
    (bytes, words): (&[u8; 64], &[u16; 64]),
    scale: Scale,
) -> __m512i {
    let (rows_01, rows_23) = (quarters(ROWS_01), quarters(ROWS_23));
    let (merged, upper) = (quarters(MERGED), _mm512_set1_epi16(0xff00_u16.cast_signed()));
    let [s0, s1, s2, s3] = sums.as_chunks::<16>().0 else { unreachable!("four rows") };
    let q0 = quotient::<SCALE>(load_sums(s0), scale);
    let q1 = quotient::<SCALE>(load_sums(s1), scale);
    let q2 = quotient::<SCALE>(load_sums(s2), scale);
    let q3 = quotient::<SCALE>(load_sums(s3), scale);
    let (a, b) = if KIND == WORDS {
        let words = word_rows(words);
        // what is above 16 bits is kept, where bytes of words would have put it
        let a = _mm512_packs_epi32(wide(q0, words[0]), wide(q1, words[1]));
        let b = _mm512_packs_epi32(wide(q2, words[2]), wide(q3, words[3]));
        (a, b)
    } else {
        let words = load(bytes);
        let a = _mm512_adds_epi16(_mm512_packs_epi32(q0, q1), _mm512_shuffle_epi8(words, rows_01));
        let b = _mm512_adds_epi16(_mm512_packs_epi32(q2, q3), _mm512_shuffle_epi8(words, rows_23));
        (a, b)
    };
    // a >> 8 | b & 0xff00
    let both = _mm512_ternarylogic_epi32::<0xf8>(_mm512_srli_epi16::<8>(a), b, upper);
    _mm512_shuffle_epi8(both, merged)
}

/// A quotient of 16 fractional bits with its word, and 8 of these bits.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn wide(quotient: __m512i, word: __m512i) -> __m512i {
    _mm512_srai_epi32::<8>(_mm512_add_epi32(quotient, word))
}

/// The 16-bit words of the four rows of a group.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn word_rows(words: &[u16; 64]) -> [__m512i; 4] {
    // SAFETY: the reference covers 64 words, 128 bytes; this reads the first 64.
    let left = unsafe { _mm512_loadu_si512(words.as_ptr().cast()) };
    // SAFETY: the reference covers 64 words, 128 bytes; this reads the last 64.
    let right = unsafe { _mm512_loadu_si512(words[32..].as_ptr().cast()) };
    let even = _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
    let odd = _mm512_add_epi32(even, _mm512_set1_epi32(1));
    let low = _mm512_set1_epi32(0xffff);
    let a = _mm512_permutex2var_epi32(left, even, right);
    let b = _mm512_permutex2var_epi32(left, odd, right);
    [
        _mm512_and_si512(a, low),
        _mm512_srli_epi32::<16>(a),
        _mm512_and_si512(b, low),
        _mm512_srli_epi32::<16>(b),
    ]
}

/// The shift and the factor of a write.
#[derive(Clone, Copy)]
struct Scale {
    mantissa: __m512i,
    half: __m512i,
    right: __m512i,
}

impl Scale {
    #[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
    fn new(write: &WriteLaw, half: i32, right: u32) -> Self {
        Self {
            mantissa: _mm512_set1_epi32(if write.negate {
                -write.mantissa
            } else {
                write.mantissa
            }),
            half: _mm512_set1_epi32(half),
            right: _mm512_set1_epi32(right.cast_signed()),
        }
    }
}

/// A request and the half.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn amount<const SCALE: u8>(sums: __m512i, scale: Scale) -> __m512i {
    match SCALE {
        PLUS => _mm512_add_epi32(scale.half, sums),
        MINUS => _mm512_sub_epi32(scale.half, sums),
        _ => _mm512_add_epi32(_mm512_mullo_epi32(sums, scale.mantissa), scale.half),
    }
}

/// `q` of one row.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn quotient<const SCALE: u8>(sums: __m512i, scale: Scale) -> __m512i {
    _mm512_srav_epi32(amount::<SCALE>(sums, scale), scale.right)
}

/// 16-bit numbers of two rows x 4 columns, as packing leaves them, from bytes `[4 columns][4 rows]`; a position
/// with the top bit set gives 0.
const ROWS_01: [u8; 16] = pairs(0);
const ROWS_23: [u8; 16] = pairs(2);

const fn pairs(row: u8) -> [u8; 16] {
    let z = 0x80;
    let r = row;
    [r, z, 4 + r, z, 8 + r, z, 12 + r, z, r + 1, z, 5 + r, z, 9 + r, z, 13 + r, z]
}

#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn quarters(bytes: [u8; 16]) -> __m512i {
    let mut all = [[0; 16]; 4];
    all.fill(bytes);
    load(all.as_flattened().try_into().expect("four times 16 bytes"))
}
