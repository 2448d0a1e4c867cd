//! Writes as they usually are, at once: levels of 8 bits and nothing else, 32 cells at a time: 4 rows of
//! 8 columns, in the order of levels.
//!
//! ```text
//! wanted  (((+-sum * mantissa + half) >> right) + (word >> less)) >> last          half = 2^(right - 1), or 0
//! pulses  clamp( wanted, -d_max, d_max );  level = clamp( level + pulses, floor, ceiling )
//! ```
//!
//! Shifts and half-up are those of [`super::super::pulses`]. Sums are 32-bit: at most 4096 * 255 * 127 * 15 < 2^31 - 2^27
//! in size, so adding `half <= 2^22` or a word cannot wrap. Packing to 16 bits saturates far outside the bounds, so it
//! moves no comparison with them.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::x86_64::*;

use super::{load, load_sums, store, total};
use crate::chip::crossbar::kernel::pulses::HALVES;
use crate::chip::crossbar::kernel::{Cells, Dither, Half, Sums, WriteCounts, WriteLaw};

/// The shifts and the factor of a write, in 32-bit lanes.
#[derive(Clone, Copy)]
struct Scale {
    mantissa: __m256i,
    half: __m256i,
    right: __m256i,
    less: __m256i,
    last: __m256i,
}

impl Scale {
    /// Of words of so many bits; half-up (`nearest`) cuts off what lies below them.
    #[target_feature(enable = "avx2,popcnt")]
    fn new(write: &WriteLaw, bits: u32, nearest: bool) -> Self {
        let (shift, right) = (write.shift, write.shift.saturating_sub(bits));
        let half = if nearest { 0 } else { 1 << right >> 1 };
        Self {
            mantissa: _mm256_set1_epi32(if write.negate {
                -write.mantissa
            } else {
                write.mantissa
            }),
            half: _mm256_set1_epi32(half),
            right: _mm256_set1_epi32(right.cast_signed()),
            less: _mm256_set1_epi32(bits.saturating_sub(shift).cast_signed()),
            last: _mm256_set1_epi32(shift.min(bits).cast_signed()),
        }
    }
}

/// The 16-bit words of the four rows of a group of 8 columns.
#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn word_rows(words: &[u16; 32]) -> [__m256i; 4] {
    // SAFETY: the reference covers 32 words, 64 bytes; this reads the first 32.
    let left = unsafe { _mm256_loadu_si256(words.as_ptr().cast()) };
    // SAFETY: the reference covers 32 words, 64 bytes; this reads the last 32.
    let right = unsafe { _mm256_loadu_si256(words[16..].as_ptr().cast()) };
    // columns 0 1 4 5 | 2 3 6 7 of rows 0 and 1, then of rows 2 and 3; then the columns in order
    let left = _mm256_shuffle_epi32::<0b11_01_10_00>(left);
    let right = _mm256_shuffle_epi32::<0b11_01_10_00>(right);
    let a = _mm256_permute4x64_epi64::<0b11_01_10_00>(_mm256_unpacklo_epi64(left, right));
    let b = _mm256_permute4x64_epi64::<0b11_01_10_00>(_mm256_unpackhi_epi64(left, right));
    let low = _mm256_set1_epi32(0xffff);
    [
        _mm256_and_si256(a, low),
        _mm256_srli_epi32::<16>(a),
        _mm256_and_si256(b, low),
        _mm256_srli_epi32::<16>(b),
    ]
}

/// The words of a byte of the four rows of a group of 8 columns.
#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn byte_rows(bytes: &[u8; 32]) -> [__m256i; 4] {
    let v = load(bytes);
    let low = _mm256_set1_epi32(0xff);
    [
        _mm256_and_si256(v, low),
        _mm256_and_si256(_mm256_srli_epi32::<8>(v), low),
        _mm256_and_si256(_mm256_srli_epi32::<16>(v), low),
        _mm256_srli_epi32::<24>(v),
    ]
}

/// The rounded product of 8 cells.
#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn rounded(sums: &[i32; 8], word: __m256i, scale: Scale) -> __m256i {
    let v = _mm256_mullo_epi32(load_sums(sums), scale.mantissa);
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

/// Loud groups of sums. Compilers make a loop of the twin that is slower, and it is asked of most half blocks.
#[target_feature(enable = "avx2,popcnt")]
pub(super) fn may_move(sums: Sums<'_>, write: &WriteLaw, bits: u32) -> u16 {
    let Sums::Narrow(sums) = sums else { return super::may_move(sums, write, bits) };
    let by = write.shift.saturating_sub(write.residual_bits).saturating_sub(bits);
    // half of 2^31 beside the greatest sum wraps, and has the top bit as one that is too small
    let half = _mm256_set1_epi32((1u32 << by >> 1).cast_signed());
    // the bits that a sum has which may move a cell, and no other
    let beyond = _mm256_set1_epi32((u32::MAX << by).cast_signed());
    let mantissa = _mm256_set1_epi32(if write.negate { -write.mantissa } else { write.mantissa });
    let mut moving = 0;
    for (group, sums) in sums.as_chunks::<64>().0.iter().enumerate() {
        let mut any = _mm256_setzero_si256();
        for sums in sums.as_chunks::<8>().0 {
            let v = _mm256_mullo_epi32(load_sums(sums), mantissa);
            any = _mm256_or_si256(any, _mm256_add_epi32(v, half));
        }
        moving |= u16::from(_mm256_testz_si256(any, beyond) == 0) << group;
    }
    moving
}

#[target_feature(enable = "avx2,popcnt")]
pub(super) fn fused(
    cells: &mut Cells<'_>,
    sums: &Half<i32>,
    write: &WriteLaw,
    dither: Dither<'_>,
) -> Option<WriteCounts> {
    let window = cells.plain_window(write)?;
    // words of another kind are not read
    Some(match dither {
        Dither::Nearest => programmed::<false>(
            cells,
            sums,
            (write, Scale::new(write, 8, true)),
            window,
            (&HALVES, &[0; _]),
        ),
        Dither::Byte(bytes) => programmed::<false>(
            cells,
            sums,
            (write, Scale::new(write, 8, false)),
            window,
            (bytes, &[0; _]),
        ),
        Dither::Word(words) => programmed::<true>(
            cells,
            sums,
            (write, Scale::new(write, 16, false)),
            window,
            (&HALVES, words),
        ),
    })
}

#[target_feature(enable = "avx2,popcnt")]
fn programmed<const WORDS: bool>(
    cells: &mut Cells<'_>,
    sums: &Half<i32>,
    (write, scale): (&WriteLaw, Scale),
    (floor, ceiling): (u8, u8),
    (bytes, words): (&Half<u8>, &Half<u16>),
) -> WriteCounts {
    let (low, mut out) = (&mut *cells.low, cells.pulses.as_mut());
    // [4 columns][4 rows] from [4 rows][4 columns], in both halves.
    let levels = _mm256_setr_epi8(
        0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15, //
        0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15,
    );
    let zero = _mm256_setzero_si256();
    let bound = i16::try_from(write.increment_max).expect("checked: at most 127");
    let (most, least) = (_mm256_set1_epi16(bound), _mm256_set1_epi16(-bound));
    // levels less 128, so that the signed saturating addition ends at 0 and 255
    let flip = _mm256_set1_epi8(i8::MIN);
    let floor = _mm256_set1_epi8((floor ^ 0x80).cast_signed());
    let ceiling = _mm256_set1_epi8((ceiling ^ 0x80).cast_signed());
    let (mut quiet, mut held) = (0, 0);
    let (mut attempted, mut effective) = (zero, zero);
    let groups = sums.as_chunks::<64>().0.iter().zip(low.as_chunks_mut::<64>().0);
    let dithers = bytes.as_chunks::<64>().0.iter().zip(words.as_chunks::<64>().0);
    for (group, ((sums, low), (bytes, words))) in groups.zip(dithers).enumerate() {
        let (sums, _) = sums.as_chunks::<8>();
        for (h, low) in low.as_chunks_mut::<32>().0.iter_mut().enumerate() {
            let mut w = if WORDS {
                word_rows(&words.as_chunks().0[h])
            } else {
                byte_rows(&bytes.as_chunks().0[h])
            };
            for (row, w) in w.iter_mut().enumerate() {
                *w = rounded(&sums[2 * row + h], *w, scale);
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
