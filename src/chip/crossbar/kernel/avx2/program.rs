//! Rounds, bounds and programs 32 cells at a time: 4 rows of 8 columns, in the order of levels.
//!
//! ```text
//! v       sum * (+-mantissa)
//! nearest wanted = ((v >> (shift - 1)) + 1) >> 1, or v
//! dither  wanted = (((v + half) >> right) + (word >> less)) >> last      half = 2^(right - 1), or 0
//! pulses  clamp( wanted, -d_max, d_max );  level = clamp( level + pulses, floor, ceiling )
//! ```
//!
//! Sums are 32-bit: at most 4096 * 255 * 127 * 15 < 2^31 - 2^27 in size, so adding `half <= 2^22` or a word
//! cannot wrap. Where the law shifts left by `less = bits - shift`, it is
//! `(s * 2^less + word) >> bits = (s + (word >> less)) >> shift`, as `word >> less` is the floor.
//!
//! With a remainder of `F` bits, `shift` is `k - F`, and
//!
//! ```text
//! total   residual + rounded;  wanted = total >> F;  residual = clamp( total - (pulses << F), 0, 2^F - 1 ),
//!           0 below the floor, 2^F - 1 above the ceiling
//! ```
//!
//! For `k < F` the law shifts left by `n = F - k` and no word matters: `(s * 2^(D+n) + word) >> D = s * 2^n`.
//! The product is first held to `+-2^(30-n)`: beyond `+-2^30` pulses and residual rest at their ends anyway,
//! as `2^30` is above `128 * 2^15`. Otherwise `rounded` is at most the sum, and a residual of 16 bits fits above it.
//! Packing to 16 bits saturates far outside the bounds, so it moves no comparison with them.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::x86_64::*;

use super::dither::store_columns;
use super::{load, load_sums, store, total};
use crate::chip::crossbar::kernel::{Cells, Dither, Half, Pulsed, Write, WriteCounts, lanes};

/// Half-up.
const NEAREST: u8 = 0;
/// A byte a cell.
const BYTE: u8 = 1;
/// 16 bits a cell.
const WORD: u8 = 2;

#[target_feature(enable = "avx2,popcnt")]
pub(super) fn program(
    cells: Cells<'_>,
    sums: &Half<i32>,
    write: &Write,
    dither: Dither<'_>,
) -> WriteCounts {
    let plain = cells.high.is_none()
        && cells.pruned.is_none()
        && cells.residual.is_some() == (write.residual_bits > 0)
        && write.residual_bits <= 15
        && write.shift <= 31
        && (1..=127).contains(&write.increment_max)
        && (1..=15).contains(&write.mantissa);
    let (true, Ok(floor), Ok(ceiling)) =
        (plain, u8::try_from(write.floor), u8::try_from(write.ceiling))
    else {
        return lanes::program(cells, sums, write, dither);
    };
    let window = (floor, ceiling);
    // Without a remainder nothing reads or keeps these words.
    let mut none = [0; _];
    let (low, left) = ((cells.low, cells.pulses), cells.residual);
    match (dither, left) {
        (Dither::Nearest, None) => {
            self::cells::<NEAREST, false>(low, &mut none, sums, write, window, &[0; _], &[0; _])
        }
        (Dither::Byte(words), None) => {
            self::cells::<BYTE, false>(low, &mut none, sums, write, window, words, &[0; _])
        }
        (Dither::Word(words), None) => {
            self::cells::<WORD, false>(low, &mut none, sums, write, window, &[0; _], words)
        }
        (Dither::Nearest, Some(left)) => {
            self::cells::<NEAREST, true>(low, left, sums, write, window, &[0; _], &[0; _])
        }
        (Dither::Byte(words), Some(left)) => {
            self::cells::<BYTE, true>(low, left, sums, write, window, words, &[0; _])
        }
        (Dither::Word(words), Some(left)) => {
            self::cells::<WORD, true>(low, left, sums, write, window, &[0; _], words)
        }
    }
}

/// The shifts and the factor of a write, in 32-bit lanes.
#[derive(Clone, Copy)]
struct Scale {
    mantissa: __m256i,
    half: __m256i,
    right: __m256i,
    less: __m256i,
    last: __m256i,
    /// Left shift of the product, for remainders finer than the shift.
    up: __m256i,
    /// The product is held to this on both sides.
    reach: __m256i,
}

#[target_feature(enable = "avx2,popcnt")]
fn scale<const DITHER: u8>(write: &Write) -> Scale {
    let up = write.residual_bits.saturating_sub(write.shift);
    let reach = if up == 0 { i32::MAX } else { 1 << (30 - up) };
    let shift = write.shift.saturating_sub(write.residual_bits).cast_signed();
    let bits = match DITHER {
        NEAREST => 0,
        BYTE => 8,
        _ => 16,
    };
    // Half-up needs all of `right`: half of it would be 2^30. There the rounding bit is added in between.
    let (right, half, last) = match (DITHER, shift) {
        (NEAREST, 0) => (0, 0, 0),
        (NEAREST, _) => (shift - 1, 1, 1),
        _ if shift > bits => (shift - bits, 1 << (shift - bits - 1), bits),
        _ => (0, 0, shift),
    };
    Scale {
        mantissa: _mm256_set1_epi32(if write.negate { -write.mantissa } else { write.mantissa }),
        half: _mm256_set1_epi32(half),
        right: _mm256_set1_epi32(right),
        // Where the product is shifted left, no word matters: all its bits go.
        less: _mm256_set1_epi32(if up > 0 { 31 } else { (bits - shift).max(0) }),
        last: _mm256_set1_epi32(last),
        up: _mm256_set1_epi32(up.cast_signed()),
        reach: _mm256_set1_epi32(reach),
    }
}

/// The dither words of the four rows of a group of 8 columns.
#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn dither_rows<const DITHER: u8>(bytes: &[u8; 32], words: &[u16; 32]) -> [__m256i; 4] {
    if DITHER == WORD {
        // SAFETY: the reference covers 32 words, 64 bytes; this reads the first 32.
        let left = unsafe { _mm256_loadu_si256(words.as_ptr().cast()) };
        // SAFETY: the reference covers 32 words, 64 bytes; this reads the last 32.
        let right = unsafe { _mm256_loadu_si256(words[16..].as_ptr().cast()) };
        // Columns 0 1 4 5 | 2 3 6 7 of rows 0 and 1, then of rows 2 and 3; then the columns in order.
        let a = _mm256_unpacklo_epi64(
            _mm256_shuffle_epi32::<0b11_01_10_00>(left),
            _mm256_shuffle_epi32::<0b11_01_10_00>(right),
        );
        let b = _mm256_unpackhi_epi64(
            _mm256_shuffle_epi32::<0b11_01_10_00>(left),
            _mm256_shuffle_epi32::<0b11_01_10_00>(right),
        );
        let a = _mm256_permute4x64_epi64::<0b11_01_10_00>(a);
        let b = _mm256_permute4x64_epi64::<0b11_01_10_00>(b);
        let low = _mm256_set1_epi32(0xffff);
        [
            _mm256_and_si256(a, low),
            _mm256_srli_epi32::<16>(a),
            _mm256_and_si256(b, low),
            _mm256_srli_epi32::<16>(b),
        ]
    } else {
        let v = load(bytes);
        let low = _mm256_set1_epi32(0xff);
        [
            _mm256_and_si256(v, low),
            _mm256_and_si256(_mm256_srli_epi32::<8>(v), low),
            _mm256_and_si256(_mm256_srli_epi32::<16>(v), low),
            _mm256_srli_epi32::<24>(v),
        ]
    }
}

/// Writes four rows of 16-bit numbers in the order of levels.
#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn store_rows(words: &mut [u16; 32], rows: [__m256i; 4]) {
    let a = _mm256_or_si256(rows[0], _mm256_slli_epi32::<16>(rows[1]));
    let b = _mm256_or_si256(rows[2], _mm256_slli_epi32::<16>(rows[3]));
    store_columns(words, [a, b]);
}

/// The rounded product of 8 cells.
#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn rounded<const DITHER: u8, const RESIDUAL: bool>(
    sums: &[i32; 8],
    word: __m256i,
    scale: Scale,
) -> __m256i {
    let mut v = _mm256_mullo_epi32(load_sums(sums), scale.mantissa);
    if RESIDUAL {
        let least = _mm256_sub_epi32(_mm256_setzero_si256(), scale.reach);
        v = _mm256_max_epi32(_mm256_min_epi32(v, scale.reach), least);
        v = _mm256_sllv_epi32(v, scale.up);
    }
    if DITHER == NEAREST {
        let twice = _mm256_add_epi32(_mm256_srav_epi32(v, scale.right), scale.half);
        return _mm256_srav_epi32(twice, scale.last);
    }
    let q = _mm256_srav_epi32(_mm256_add_epi32(v, scale.half), scale.right);
    let word = _mm256_srlv_epi32(word, scale.less);
    _mm256_srav_epi32(_mm256_add_epi32(q, word), scale.last)
}

/// Zeros among the 32 bytes.
#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn zeros(v: __m256i) -> u32 {
    _mm256_movemask_epi8(_mm256_cmpeq_epi8(v, _mm256_setzero_si256())).count_ones()
}

/// Groups of four rows with a sum that does not round to 0 whatever its word: see [`super::super::Kernel::loud`].
#[target_feature(enable = "avx2,popcnt")]
pub(super) fn loud(sums: &Half<i32>, write: &Write, bits: u32) -> u16 {
    let by = write.shift.saturating_sub(write.residual_bits).saturating_sub(bits);
    if by > 31 {
        return 0; // every sum rounds to 0
    }
    // at 31 a sum that is too large wraps, and has the top bit as one that is too small
    let half = _mm256_set1_epi32((1u32 << by >> 1).cast_signed());
    // all bits of a loud sum that a quiet one does not have
    let beyond = _mm256_set1_epi32(u32::MAX.wrapping_shl(by).cast_signed());
    let mantissa = if write.negate { -write.mantissa } else { write.mantissa };
    let mantissa = _mm256_set1_epi32(mantissa);
    let mut loud = 0;
    for (group, sums) in sums.as_chunks::<64>().0.iter().enumerate() {
        let mut any = _mm256_setzero_si256();
        for sums in sums.as_chunks::<8>().0 {
            let v = _mm256_mullo_epi32(load_sums(sums), mantissa);
            any = _mm256_or_si256(any, _mm256_add_epi32(v, half));
        }
        loud |= u16::from(_mm256_testz_si256(any, beyond) == 0) << group;
    }
    loud
}

#[target_feature(enable = "avx2,popcnt")]
fn cells<const DITHER: u8, const RESIDUAL: bool>(
    (low, mut out): (&mut Half<u8>, Option<Pulsed<'_>>),
    left: &mut Half<u16>,
    sums: &Half<i32>,
    write: &Write,
    (floor, ceiling): (u8, u8),
    bytes: &Half<u8>,
    words: &Half<u16>,
) -> WriteCounts {
    let scale = scale::<DITHER>(write);
    // [4 columns][4 rows] from [4 rows][4 columns], in both halves.
    let levels = _mm256_setr_epi8(
        0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15, //
        0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15,
    );
    let zero = _mm256_setzero_si256();
    let flip = _mm256_set1_epi8(i8::MIN);
    let bound = i16::try_from(write.increment_max).expect("checked: at most 127");
    let (most, least) = (_mm256_set1_epi16(bound), _mm256_set1_epi16(-bound));
    let (floor_wide, ceiling_wide) =
        (_mm256_set1_epi32(floor.into()), _mm256_set1_epi32(ceiling.into()));
    // Levels less 128, so that the signed saturating addition ends at 0 and 255.
    let floor = _mm256_set1_epi8((floor ^ 0x80).cast_signed());
    let ceiling = _mm256_set1_epi8((ceiling ^ 0x80).cast_signed());
    let fraction = _mm256_set1_epi32(write.residual_bits.cast_signed());
    let most_left = _mm256_set1_epi32((1 << write.residual_bits) - 1);
    let most_wide = _mm256_set1_epi32(write.increment_max);
    let least_wide = _mm256_set1_epi32(-write.increment_max);
    let (mut quiet, mut held) = (0, 0);
    let (mut attempted, mut effective) = (zero, zero);
    let groups = sums.as_chunks::<64>().0.iter().zip(low.as_chunks_mut::<64>().0);
    let dithers = bytes.as_chunks::<64>().0.iter().zip(words.as_chunks::<64>().0);
    let groups = groups.zip(left.as_chunks_mut::<64>().0);
    for (group, (((sums, low), left), (bytes, words))) in groups.zip(dithers).enumerate() {
        let (sums, _) = sums.as_chunks::<8>();
        let dithers = bytes.as_chunks::<32>().0.iter().zip(words.as_chunks::<32>().0);
        let halves = low.as_chunks_mut::<32>().0.iter_mut().zip(left.as_chunks_mut::<32>().0);
        for (h, ((low, left), (bytes, words))) in halves.zip(dithers).enumerate() {
            let mut w = dither_rows::<DITHER>(bytes, words);
            for (row, w) in w.iter_mut().enumerate() {
                *w = rounded::<DITHER, RESIDUAL>(&sums[2 * row + h], *w, scale);
            }
            if RESIDUAL {
                let mut remainder = dither_rows::<WORD>(&[0; 32], left);
                let levels = dither_rows::<BYTE>(low, &[0; 32]);
                for ((w, remainder), level) in w.iter_mut().zip(&mut remainder).zip(&levels) {
                    let total = _mm256_add_epi32(*remainder, *w);
                    *w = _mm256_srav_epi32(total, fraction);
                    let pulses = _mm256_max_epi32(_mm256_min_epi32(*w, most_wide), least_wide);
                    let rest = _mm256_sub_epi32(total, _mm256_sllv_epi32(pulses, fraction));
                    let rest = _mm256_max_epi32(_mm256_min_epi32(rest, most_left), zero);
                    // a level that its window held puts the remainder at the same end
                    let reached = _mm256_add_epi32(*level, pulses);
                    let under = _mm256_cmpgt_epi32(floor_wide, reached);
                    let over = _mm256_cmpgt_epi32(reached, ceiling_wide);
                    let rest = _mm256_andnot_si256(under, rest);
                    *remainder = _mm256_blendv_epi8(rest, most_left, over);
                }
                store_rows(left, remainder);
            }
            let (a, b) = (_mm256_packs_epi32(w[0], w[1]), _mm256_packs_epi32(w[2], w[3]));
            let pulses_a = _mm256_max_epi16(_mm256_min_epi16(a, most), least);
            let pulses_b = _mm256_max_epi16(_mm256_min_epi16(b, most), least);
            let same = _mm256_packs_epi16(
                _mm256_cmpeq_epi16(a, pulses_a),
                _mm256_cmpeq_epi16(b, pulses_b),
            );
            held += _mm256_movemask_epi8(same).count_ones();
            let pulses = _mm256_shuffle_epi8(_mm256_packs_epi16(pulses_a, pulses_b), levels);
            // The bound is at least 1, so pulses are 0 exactly where none were wanted.
            quiet += zeros(pulses);
            if let Some(out) = &mut out {
                let mut given = [0; 32];
                store(&mut given, pulses);
                out.take(64 * group + 32 * h, &given.map(u8::cast_signed));
            }
            let before = load(low);
            let level = _mm256_adds_epi8(_mm256_xor_si256(before, flip), pulses);
            let level = _mm256_max_epi8(_mm256_min_epi8(level, ceiling), floor);
            let level = _mm256_xor_si256(level, flip);
            store(low, level);
            let size = _mm256_sad_epu8(_mm256_xor_si256(pulses, flip), flip);
            attempted = _mm256_add_epi64(attempted, size);
            effective = _mm256_add_epi64(effective, _mm256_sad_epu8(level, before));
        }
    }
    WriteCounts {
        requested: (1024 - quiet).into(),
        bounded: (1024 - held).into(),
        attempted: total(attempted),
        effective: total(effective),
    }
}
