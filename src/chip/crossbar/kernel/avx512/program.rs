//! Rounds, bounds and programs 64 cells at a time: 4 rows of 16 columns, in the order of levels.
//!
//! ```text
//! q       (sum * mantissa + half) >> right           half = 2^(right - 1), or 0
//! wanted  (q + (word >> less)) >> last               right, less, last: see `Scale`
//! pulses  clamp( wanted, -d_max, d_max );  level = clamp( level + pulses, floor, ceiling )
//! ```
//!
//! Sums are 32-bit: at most 4096 * 255 * 127 * 15 < 2^31 - 2^27 in size, so adding `half <= 2^22` or a word
//! cannot wrap. Where the law shifts left by `less = bits - shift`, it is
//! `(s * 2^less + word) >> bits = (s + (word >> less)) >> shift`, as `word >> less` is the floor.
//!
//! `BYTE` works on 16 bits from `q` on, all others from `wanted` on; both then pack to 8 bits.
//! Packing saturates and is monotone, so it can only matter where `wanted` lies outside -128..=127:
//!
//! ```text
//! q > 32767 or q + word > 32767    16-bit sum 32767, at least 127 after `last <= 8`; the law has 128 or more
//! q < -32768                       16-bit sum below -32768 + 256, -128 or less after the shift, as the law
//! ```
//!
//! [`usual_cells`] is the same with `d_max <= 15` and `last = 8`. With `d_max <= 126` both then count as bounded and give `+-d_max`. With `d_max = 127` a 128 must not pass
//! for a 127: `WIDE` takes the word in 32 bits, and a wanted 16-bit number above 127 is counted as bounded.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::x86_64::*;

use self::general::general;
use super::{load, load_sums, pulses, store};
use crate::chip::crossbar::kernel::{Cells, Dither, Half, Pulsed, Write, WriteCounts, scalar};

mod general;

/// Half-up.
const NEAREST: u8 = 0;
/// A byte a cell, bounds up to 126.
const BYTE: u8 = 1;
/// A byte a cell, any bound.
const WIDE: u8 = 2;
/// 16 bits a cell.
const WORD: u8 = 3;

/// `sum`.
const PLUS: u8 = 0;
/// `-sum`.
const MINUS: u8 = 1;
/// `sum * (+-mantissa)`.
const TIMES: u8 = 2;

#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt,bmi2")]
pub(super) fn program(
    cells: Cells<'_>,
    sums: &Half<i32>,
    write: &Write,
    dither: Dither<'_>,
) -> WriteCounts {
    let inside = cells.residual.is_some() == (write.residual_bits > 0)
        && write.residual_bits <= 15
        && write.shift <= 31
        && (1..=127).contains(&write.increment_max)
        && (1..=15).contains(&write.mantissa);
    if !inside {
        return scalar::program(cells, sums, write, dither);
    }
    let plain = cells.high.is_none() && cells.pruned.is_none() && cells.residual.is_none();
    let (true, Ok(floor), Ok(ceiling)) =
        (plain, u8::try_from(write.floor), u8::try_from(write.ceiling))
    else {
        return match dither {
            Dither::Nearest => general::<NEAREST>(cells, sums, write, &[0; _], &[0; _]),
            Dither::Byte(words) => general::<WIDE>(cells, sums, write, words, &[0; _]),
            Dither::Word(words) => general::<WORD>(cells, sums, write, &[0; _], words),
        };
    };
    let window = (floor, ceiling);
    let low = (cells.low, cells.pulses);
    match dither {
        Dither::Nearest => scaled::<NEAREST>(low, sums, write, window, &[0; _], &[0; _]),
        Dither::Byte(words) if write.shift >= 8 && write.increment_max <= 15 => {
            usual(low, sums, write, window, words)
        }
        Dither::Byte(words) if write.increment_max < 127 => {
            scaled::<BYTE>(low, sums, write, window, words, &[0; _])
        }
        Dither::Byte(words) => scaled::<WIDE>(low, sums, write, window, words, &[0; _]),
        Dither::Word(words) => scaled::<WORD>(low, sums, write, window, &[0; _], words),
    }
}

/// Levels, and where pulses go if they are wanted.
type Planes<'a> = (&'a mut Half<u8>, Option<Pulsed<'a>>);

/// Writes as they usually are: bytes of dither, sums of at least 2^8 a pulse, and bounds whose pulses add up inside a
/// byte over 16 groups.
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn usual(
    low: Planes<'_>,
    sums: &Half<i32>,
    write: &Write,
    window: (u8, u8),
    words: &Half<u8>,
) -> WriteCounts {
    match (write.mantissa, write.negate, window == (0, 255)) {
        (1, false, true) => usual_cells::<PLUS, true>(low, sums, write, window, words),
        (1, false, false) => usual_cells::<PLUS, false>(low, sums, write, window, words),
        (1, true, true) => usual_cells::<MINUS, true>(low, sums, write, window, words),
        (1, true, false) => usual_cells::<MINUS, false>(low, sums, write, window, words),
        _ => usual_cells::<TIMES, false>(low, sums, write, window, words),
    }
}

/// `[4 columns][4 rows]` from bytes 2j: row 0 of column j, 2j + 1: row 2, 8 + 2j: row 1, 9 + 2j: row 3.
const MERGED: [u8; 16] = [0, 8, 1, 9, 2, 10, 3, 11, 4, 12, 5, 13, 6, 14, 7, 15];

/// As [`cells`], with fewer steps: the upper bytes of two 16-bit sums are taken at once, and counts stay in bytes. A
/// window of all levels (`FULL`) is where the addition saturates.
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn usual_cells<const SCALE: u8, const FULL: bool>(
    (low, mut out): Planes<'_>,
    sums: &Half<i32>,
    write: &Write,
    window: (u8, u8),
    words: &Half<u8>,
) -> WriteCounts {
    let scale = scale::<BYTE>(write, write.shift);
    let Tally { most, least, floor, ceiling, flip, .. } = tally(write, window);
    let less_one = _mm512_set1_epi8(-1);
    let zero = _mm512_setzero_si512();
    let (mut requested, mut attempted, mut effective, mut held) = (zero, zero, zero, zero);
    let (all_sums, all_words) = (sums.as_chunks::<64>().0, words.as_chunks::<64>().0);
    let low = low.as_chunks_mut::<64>().0;
    let mut groups = write.groups;
    while groups != 0 {
        let group = groups.trailing_zeros() as usize;
        groups &= groups - 1;
        let (sums, words, low) = (&all_sums[group], &all_words[group], &mut low[group]);
        let wanted = usual_wanted::<SCALE>(sums, words, scale);
        let pulses = _mm512_max_epi8(_mm512_min_epi8(wanted, most), least);
        let before = load(low);
        let mut level = _mm512_adds_epi8(_mm512_xor_si512(before, flip), pulses);
        if !FULL {
            level = _mm512_max_epi8(_mm512_min_epi8(level, ceiling), floor);
        }
        let level = _mm512_xor_si512(level, flip);
        store(low, level);
        if let Some(out) = &mut out {
            pulses::take(out, group, pulses);
        }
        let size = _mm512_abs_epi8(pulses);
        let some = _mm512_test_epi8_mask(pulses, pulses);
        requested = _mm512_mask_sub_epi8(requested, some, requested, less_one);
        attempted = _mm512_add_epi8(attempted, size);
        effective = _mm512_add_epi64(effective, _mm512_sad_epu8(level, before));
        // held | (wanted ^ pulses)
        held = _mm512_ternarylogic_epi32::<0xf6>(held, wanted, pulses);
    }
    // few writes meet their bound: only then is it asked which cells did
    let mut bounded = 0;
    if _mm512_test_epi8_mask(held, held) != 0 {
        for (sums, words) in sums.as_chunks::<64>().0.iter().zip(words.as_chunks::<64>().0) {
            let wanted = usual_wanted::<SCALE>(sums, words, scale);
            let pulses = _mm512_max_epi8(_mm512_min_epi8(wanted, most), least);
            bounded += _mm512_cmpneq_epi8_mask(wanted, pulses).count_ones();
        }
    }
    // none of the three reaches 2^20: added up as one number
    let [requested, attempted] = [requested, attempted].map(|bytes| _mm512_sad_epu8(bytes, zero));
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
fn usual_wanted<const SCALE: u8>(sums: &[i32; 64], words: &[u8; 64], scale: Scale) -> __m512i {
    let (rows_01, rows_23) = (quarters(ROWS_01), quarters(ROWS_23));
    let (merged, upper) = (quarters(MERGED), _mm512_set1_epi16(0xff00_u16.cast_signed()));
    let [s0, s1, s2, s3] = sums.as_chunks::<16>().0 else { unreachable!("four rows") };
    let [q0, q1, q2, q3] =
        [s0, s1, s2, s3].map(|sums| quotient::<BYTE, SCALE>(load_sums(sums), scale));
    let words = load(words);
    let a = _mm512_adds_epi16(_mm512_packs_epi32(q0, q1), _mm512_shuffle_epi8(words, rows_01));
    let b = _mm512_adds_epi16(_mm512_packs_epi32(q2, q3), _mm512_shuffle_epi8(words, rows_23));
    // a >> 8 | b & 0xff00
    let both = _mm512_ternarylogic_epi32::<0xf8>(_mm512_srli_epi16::<8>(a), b, upper);
    _mm512_shuffle_epi8(both, merged)
}

#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn scaled<const DITHER: u8>(
    low: Planes<'_>,
    sums: &Half<i32>,
    write: &Write,
    window: (u8, u8),
    bytes: &Half<u8>,
    words: &Half<u16>,
) -> WriteCounts {
    match (write.mantissa, write.negate) {
        (1, false) => cells::<DITHER, PLUS>(low, sums, write, window, bytes, words),
        (1, true) => cells::<DITHER, MINUS>(low, sums, write, window, bytes, words),
        _ => cells::<DITHER, TIMES>(low, sums, write, window, bytes, words),
    }
}

/// The shifts and the factor of a write.
#[derive(Clone, Copy)]
struct Scale {
    mantissa: __m512i,
    half: __m512i,
    right: __m512i,
    /// Of 32-bit or 16-bit lanes, as the dither goes.
    less: __m512i,
    /// Of 32-bit or 16-bit lanes, as the dither goes.
    last: __m512i,
}

/// Rounding to units of `2^shift`.
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn scale<const DITHER: u8>(write: &Write, shift: u32) -> Scale {
    let shift = i32::try_from(shift).expect("checked: at most 31");
    let bits = match DITHER {
        NEAREST => 0,
        WORD => 16,
        _ => 8,
    };
    // Half-up needs all of `right`: half of it would be 2^30. There the rounding bit is added in between.
    let (right, half, last) = match (DITHER, shift) {
        (NEAREST, 0) => (0, 0, 0),
        (NEAREST, _) => (shift - 1, 1, 1),
        _ if shift > bits => (shift - bits, 1 << (shift - bits - 1), bits),
        _ => (0, 0, shift),
    };
    let less = (bits - shift).max(0);
    let splat = |v: i32| match DITHER {
        BYTE => _mm512_set1_epi16(i16::try_from(v).expect("a shift of at most 8")),
        _ => _mm512_set1_epi32(v),
    };
    Scale {
        mantissa: _mm512_set1_epi32(if write.negate { -write.mantissa } else { write.mantissa }),
        half: _mm512_set1_epi32(half),
        right: _mm512_set1_epi32(right),
        less: splat(less),
        last: splat(last),
    }
}

/// `q` of one row.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn quotient<const DITHER: u8, const SCALE: u8>(sums: __m512i, scale: Scale) -> __m512i {
    if DITHER == NEAREST {
        let sums = match SCALE {
            PLUS => sums,
            MINUS => _mm512_sub_epi32(_mm512_setzero_si512(), sums),
            _ => _mm512_mullo_epi32(sums, scale.mantissa),
        };
        let twice = _mm512_add_epi32(_mm512_srav_epi32(sums, scale.right), scale.half);
        return _mm512_srav_epi32(twice, scale.last);
    }
    let sums = match SCALE {
        PLUS => _mm512_add_epi32(scale.half, sums),
        MINUS => _mm512_sub_epi32(scale.half, sums),
        _ => _mm512_add_epi32(_mm512_mullo_epi32(sums, scale.mantissa), scale.half),
    };
    _mm512_srav_epi32(sums, scale.right)
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

/// `[4 columns][4 rows]` from `[4 rows][4 columns]`.
const LEVELS: [u8; 16] = [0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15];

#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn quarters(bytes: [u8; 16]) -> __m512i {
    let mut all = [[0; 16]; 4];
    all.fill(bytes);
    load(all.as_flattened().try_into().expect("four times 16 bytes"))
}

/// The 32-bit dither words of the four rows of a group.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn dither_rows<const DITHER: u8>(bytes: &[u8; 64], words: &[u16; 64]) -> [__m512i; 4] {
    if DITHER == WORD {
        // SAFETY: the reference covers 64 words, 128 bytes; this reads the first 64.
        let left = unsafe { _mm512_loadu_si512(words.as_ptr().cast()) };
        // SAFETY: the reference covers 64 words, 128 bytes; this reads the last 64.
        let right = unsafe { _mm512_loadu_si512(words[32..].as_ptr().cast()) };
        let even = _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
        let odd = _mm512_add_epi32(even, _mm512_set1_epi32(1));
        let low = _mm512_set1_epi32(0xffff);
        let (a, b) = (
            _mm512_permutex2var_epi32(left, even, right),
            _mm512_permutex2var_epi32(left, odd, right),
        );
        [
            _mm512_and_si512(a, low),
            _mm512_srli_epi32::<16>(a),
            _mm512_and_si512(b, low),
            _mm512_srli_epi32::<16>(b),
        ]
    } else {
        let v = load(bytes);
        let low = _mm512_set1_epi32(0xff);
        [
            _mm512_and_si512(v, low),
            _mm512_and_si512(_mm512_srli_epi32::<8>(v), low),
            _mm512_and_si512(_mm512_srli_epi32::<16>(v), low),
            _mm512_srli_epi32::<24>(v),
        ]
    }
}

/// The bounds of a write, and what has been counted of it.
struct Tally {
    most: __m512i,
    least: __m512i,
    /// Levels less 128, so that the signed saturating addition ends at 0 and 255.
    floor: __m512i,
    ceiling: __m512i,
    /// A wanted 16-bit number above is bounded where 8 bits cannot tell.
    over: __m512i,
    levels: __m512i,
    flip: __m512i,
    requested: u32,
    bounded: u32,
    attempted: __m512i,
    effective: __m512i,
}

#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn tally(write: &Write, (floor, ceiling): (u8, u8)) -> Tally {
    let bound = i8::try_from(write.increment_max).expect("checked: at most 127");
    Tally {
        most: _mm512_set1_epi8(bound),
        least: _mm512_set1_epi8(-bound),
        floor: _mm512_set1_epi8((floor ^ 0x80).cast_signed()),
        ceiling: _mm512_set1_epi8((ceiling ^ 0x80).cast_signed()),
        // Below 127 the packed bytes tell; nothing is above the greatest number.
        over: _mm512_set1_epi16(if bound == 127 { 127 } else { i16::MAX }),
        levels: quarters(LEVELS),
        flip: _mm512_set1_epi8(i8::MIN),
        requested: 0,
        bounded: 0,
        attempted: _mm512_setzero_si512(),
        effective: _mm512_setzero_si512(),
    }
}

/// Bounds and programs 64 cells that want `a` (rows 0 and 1) and `b` (rows 2 and 3), of 16 bits. Returns the pulses.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn settle<const BYTES_TELL: bool>(
    a: __m512i,
    b: __m512i,
    low: &mut [u8; 64],
    t: &mut Tally,
) -> __m512i {
    if !BYTES_TELL {
        t.bounded += _mm512_cmpgt_epi16_mask(a, t.over).count_ones();
        t.bounded += _mm512_cmpgt_epi16_mask(b, t.over).count_ones();
    }
    let wanted = _mm512_shuffle_epi8(_mm512_packs_epi16(a, b), t.levels);
    let pulses = _mm512_max_epi8(_mm512_min_epi8(wanted, t.most), t.least);
    let before = load(low);
    let level = _mm512_adds_epi8(_mm512_xor_si512(before, t.flip), pulses);
    let level = _mm512_max_epi8(_mm512_min_epi8(level, t.ceiling), t.floor);
    let level = _mm512_xor_si512(level, t.flip);
    store(low, level);
    t.requested += _mm512_test_epi8_mask(wanted, wanted).count_ones();
    t.bounded += _mm512_cmpneq_epi8_mask(wanted, pulses).count_ones();
    let size = _mm512_sad_epu8(_mm512_xor_si512(pulses, t.flip), t.flip);
    t.attempted = _mm512_add_epi64(t.attempted, size);
    t.effective = _mm512_add_epi64(t.effective, _mm512_sad_epu8(level, before));
    pulses
}

#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn counts(t: &Tally) -> WriteCounts {
    WriteCounts {
        requested: t.requested.into(),
        bounded: t.bounded.into(),
        attempted: _mm512_reduce_add_epi64(t.attempted).cast_unsigned(),
        effective: _mm512_reduce_add_epi64(t.effective).cast_unsigned(),
    }
}

#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn cells<const DITHER: u8, const SCALE: u8>(
    (low, mut out): Planes<'_>,
    sums: &Half<i32>,
    write: &Write,
    window: (u8, u8),
    bytes: &Half<u8>,
    words: &Half<u16>,
) -> WriteCounts {
    let scale = scale::<DITHER>(write, write.shift);
    let (rows_01, rows_23) = (quarters(ROWS_01), quarters(ROWS_23));
    let mut tally = tally(write, window);
    let groups = sums.as_chunks::<64>().0.iter().zip(low.as_chunks_mut::<64>().0);
    let dithers = bytes.as_chunks::<64>().0.iter().zip(words.as_chunks::<64>().0);
    for (group, ((sums, low), (bytes, words))) in groups.zip(dithers).enumerate() {
        let (sums, _) = sums.as_chunks::<16>();
        let mut q = [_mm512_setzero_si512(); 4];
        for (q, sums) in q.iter_mut().zip(sums) {
            *q = quotient::<DITHER, SCALE>(load_sums(sums), scale);
        }
        if DITHER == WIDE || DITHER == WORD {
            for (q, word) in q.iter_mut().zip(dither_rows::<DITHER>(bytes, words)) {
                let word = _mm512_srlv_epi32(word, scale.less);
                *q = _mm512_srav_epi32(_mm512_add_epi32(*q, word), scale.last);
            }
        }
        let mut a = _mm512_packs_epi32(q[0], q[1]);
        let mut b = _mm512_packs_epi32(q[2], q[3]);
        let pulses = if DITHER == BYTE {
            let words = load(bytes);
            let word = _mm512_srlv_epi16(_mm512_shuffle_epi8(words, rows_01), scale.less);
            a = _mm512_srav_epi16(_mm512_adds_epi16(a, word), scale.last);
            let word = _mm512_srlv_epi16(_mm512_shuffle_epi8(words, rows_23), scale.less);
            b = _mm512_srav_epi16(_mm512_adds_epi16(b, word), scale.last);
            settle::<true>(a, b, low, &mut tally)
        } else {
            settle::<false>(a, b, low, &mut tally)
        };
        if let Some(out) = &mut out {
            pulses::take(out, group, pulses);
        }
    }
    counts(&tally)
}

/// See [`super::super::Kernel::loud`]: `q` is 0 exactly where `-2^(s-1) <= v < 2^(s-1)`, `s = shift - bits`.
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(super) fn loud(sums: &Half<i32>, write: &Write, bits: u32) -> u16 {
    match (write.mantissa, write.negate) {
        (1, false) => loud_groups::<PLUS>(sums, write, bits),
        (1, true) => loud_groups::<MINUS>(sums, write, bits),
        _ => loud_groups::<TIMES>(sums, write, bits),
    }
}

#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn loud_groups<const SCALE: u8>(sums: &Half<i32>, write: &Write, bits: u32) -> u16 {
    let by = write.shift.saturating_sub(write.residual_bits).saturating_sub(bits);
    if by > 31 {
        return 0; // every sum rounds to 0
    }
    // at 31 a sum that is too large wraps, and has the top bit as one that is too small
    let half = _mm512_set1_epi32((1u32 << by >> 1).cast_signed());
    // all bits of a loud sum that a quiet one does not have
    let beyond = _mm512_set1_epi32(u32::MAX.wrapping_shl(by).cast_signed());
    let mantissa = if write.negate { -write.mantissa } else { write.mantissa };
    let mantissa = _mm512_set1_epi32(mantissa);
    let mut loud = 0;
    for (group, sums) in sums.as_chunks::<64>().0.iter().enumerate() {
        let mut any = _mm512_setzero_si512();
        for sums in sums.as_chunks::<16>().0 {
            let sums = load_sums(sums);
            let v = match SCALE {
                PLUS => _mm512_add_epi32(half, sums),
                MINUS => _mm512_sub_epi32(half, sums),
                _ => _mm512_add_epi32(_mm512_mullo_epi32(sums, mantissa), half),
            };
            any = _mm512_or_si512(any, v);
        }
        loud |= u16::from(_mm512_test_epi32_mask(any, beyond) != 0) << group;
    }
    loud
}
