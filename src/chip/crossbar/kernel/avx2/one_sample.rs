//! Writes of one sample, 8 columns a vector: the steps of [`super::super::avx512`]'s twin, told there.
//!
//! ```text
//! q        rsh( x * +-u, s )  =  mulhrs( x * +-u, 2^(15 - s) )              s = k - 8 in 1..=15, |x * u| <= 32,385
//! pulses   (q + word) >> 8                                                 within the bound by the shift
//! ```
//!
//! ChaCha runs for 8 live columns at a time, from wherever they lie in the strip; a permutation by the mask of live
//! lanes puts their words beside their cells. Lanes of columns that are not live take any word.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::x86_64::*;

use super::dither::drawn;
use super::units::peaks as fold_rows;
use super::{load, load_sums, store, total};
use crate::chip::crossbar::kernel::{Extremes, OneProduct, OneSample, WriteCounts};
use crate::chip::crossbar::layout::{BLOCK_CELLS, BLOCK_ROWS, HALF_CELLS, HALF_COLUMNS};

/// Columns of a vector.
const LANES: usize = 8;
/// Columns of the widest strip.
const COLUMNS: usize = OneSample::HALVES * HALF_COLUMNS;
/// And a vector more.
const ROOM: usize = COLUMNS + LANES;

/// Words of the live columns of a block, `[group][column]`: four rows a word.
#[repr(align(64))]
struct Words([[i32; ROOM]; 16]);

/// Where the word of each lane lies among those of the live lanes, by mask of live lanes.
static PLACES: [[u8; LANES]; 256] = {
    let mut places = [[0; LANES]; 256];
    let mut mask = 0;
    while mask < 256 {
        let (mut lane, mut live) = (0, 0);
        while lane < LANES {
            if mask >> lane & 1 == 1 {
                places[mask][lane] = live;
                live += 1;
            }
            lane += 1;
        }
        mask += 1;
    }
    places
};

/// The gates of 8 columns.
#[derive(Clone, Copy)]
struct Gates {
    /// Size of each.
    sizes: __m256i,
    /// With the sign of the pathway, twice in each lane; times the factor if `USUAL`.
    twice: __m256i,
    most: u32,
}

/// How sums become pulses.
#[derive(Clone, Copy)]
struct Rounding {
    factor: __m256i,
    /// Levels less 128, so that the signed saturating addition ends at 0 and 255.
    floor: __m256i,
    ceiling: __m256i,
    flip: __m256i,
}

/// See [`super::super::Kernel::one_sample`].
#[target_feature(enable = "avx2,popcnt")]
pub(super) fn one_sample(strip: OneSample<'_>) -> Option<WriteCounts> {
    let rounding = strip.one_product()?;
    Some(if rounding.usual {
        strip_of::<true>(strip, rounding)
    } else {
        strip_of::<false>(strip, rounding)
    })
}

#[target_feature(enable = "avx2,popcnt")]
fn strip_of<const USUAL: bool>(
    strip: OneSample<'_>,
    OneProduct { right, window: (floor, ceiling), .. }: OneProduct,
) -> WriteCounts {
    let OneSample { low, blocks, turned, gates, column, draws, write, mut peaks } = strip;
    let vectors = gates.len() / (4 * LANES);
    let zero = _mm256_setzero_si256();
    let least_moving = 1u32 << (right - 1);
    let rounding = Rounding {
        factor: _mm256_set1_epi16(1 << (15 - right)),
        floor: _mm256_set1_epi8((floor ^ 0x80).cast_signed()),
        ceiling: _mm256_set1_epi8((ceiling ^ 0x80).cast_signed()),
        flip: _mm256_set1_epi8(i8::MIN),
    };
    let mut all = [Gates { sizes: zero, twice: zero, most: 0 }; COLUMNS / LANES];
    for (all, gates) in all.iter_mut().zip(gates.as_chunks::<32>().0) {
        let gates = gates.map(i8::cast_unsigned);
        *all = gates_of(&gates, write.negate, if USUAL { 15 - right } else { 0 });
    }
    let all = &all[..vectors];
    let mut words = Words([[0; ROOM]; 16]);
    let mut counters = [0i32; ROOM];
    let (mut requested, mut attempted, mut effective) = (zero, zero, zero);
    let mut extremes = peaks.is_some().then(Extremes::new);
    for (block, turned) in turned.iter().enumerate() {
        let Some(turned) = turned else { continue };
        let drives = Drives::new(turned);
        if drives.most == 0 {
            continue;
        }
        let least = at_least(least_moving.div_ceil(drives.most));
        let mut live = [0u8; COLUMNS / LANES];
        let (mut starts, mut columns) = ([0; COLUMNS / LANES], 0);
        for (vector, gates) in all.iter().enumerate() {
            live[vector] = lanes_above(gates.sizes, least);
            starts[vector] = columns;
            if live[vector] != 0 {
                let first = vector / 2 * HALF_COLUMNS;
                let counter = draws.counter(64, column + first, block);
                for lane in (0..LANES).filter(|lane| live[vector] >> lane & 1 == 1) {
                    let place = (vector % 2 * LANES + lane) as i32;
                    counters[columns] =
                        counter.first.wrapping_add(counter.step.wrapping_mul(place));
                    columns += 1;
                }
            }
        }
        for first in (0..columns).step_by(LANES) {
            let counter = load_sums(counters[first..].first_chunk().expect("a vector of room"));
            for (row, v) in words.0.iter_mut().zip(drawn(draws, counter)) {
                store_sums(row[first..].first_chunk_mut().expect("a vector of room"), v);
            }
        }
        for (vector, gates) in all.iter().enumerate().filter(|(vector, _)| live[*vector] != 0) {
            let mut groups = drives.groups_above(at_least(least_moving.div_ceil(gates.most)));
            let places = place_lanes(live[vector]);
            let panel = vector / 4 * blocks * BLOCK_CELLS + block * BLOCK_CELLS;
            let at = panel + vector / 2 % 2 * HALF_CELLS;
            let low = low[at..at + HALF_CELLS].as_chunks_mut::<64>().0;
            let (mut sizes, mut pulsed) = (zero, zero);
            while groups != 0 {
                let group = groups.trailing_zeros() as usize;
                groups &= groups - 1;
                let row: &[i32; LANES] =
                    words.0[group][starts[vector]..].first_chunk().expect("room");
                let word = _mm256_permutevar8x32_epi32(load_sums(row), places);
                let drives = [drives.even[group], drives.odd[group]];
                let pulses = pulses::<USUAL>(drives, gates.twice, word, rounding);
                let low = &mut low[group].as_chunks_mut::<32>().0[vector % 2];
                let before = load(low);
                if let Some(extremes) = &mut extremes {
                    take(extremes, 2 * group + vector % 2, pulses);
                }
                let mut level = _mm256_adds_epi8(_mm256_xor_si256(before, rounding.flip), pulses);
                if !USUAL {
                    level =
                        _mm256_max_epi8(_mm256_min_epi8(level, rounding.ceiling), rounding.floor);
                }
                let level = _mm256_xor_si256(level, rounding.flip);
                store(low, level);
                let size = _mm256_abs_epi8(pulses);
                sizes = _mm256_add_epi8(sizes, size);
                if !USUAL {
                    pulsed = _mm256_add_epi8(pulsed, _mm256_min_epu8(size, _mm256_set1_epi8(1)));
                }
                effective = _mm256_add_epi64(effective, _mm256_sad_epu8(level, before));
            }
            // 16 groups of pulses up to 15 fit a byte
            attempted = _mm256_add_epi64(attempted, _mm256_sad_epu8(sizes, zero));
            let pulsed = if USUAL { sizes } else { pulsed };
            requested = _mm256_add_epi64(requested, _mm256_sad_epu8(pulsed, zero));
        }
        if let (Some(rows), Some(extremes)) = (&mut peaks, &mut extremes)
            && columns > 0
        {
            let rows = rows.chunks_mut(BLOCK_ROWS).nth(block).expect("blocks hold the rows");
            let most = fold_rows(extremes);
            rows.copy_from_slice(&most[..rows.len()]);
            *extremes = Extremes::new();
        }
    }
    WriteCounts {
        requested: total(requested),
        bounded: 0,
        attempted: total(attempted),
        effective: total(effective),
    }
}

#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn store_sums(sums: &mut [i32; LANES], v: __m256i) {
    // SAFETY: the reference covers the 8 sums, 32 bytes, that an unaligned store writes.
    unsafe { _mm256_storeu_si256(sums.as_mut_ptr().cast(), v) }
}

/// What [`lanes_above`] compares with: sizes are at most 255, so a greater bound is as good as 256.
#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn at_least(bound: u32) -> __m256i {
    _mm256_set1_epi32(bound.min(256).cast_signed() - 1)
}

/// Lanes of a vector whose numbers are above a bound, a bit each.
#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn lanes_above(sizes: __m256i, bound: __m256i) -> u8 {
    _mm256_movemask_ps(_mm256_castsi256_ps(_mm256_cmpgt_epi32(sizes, bound))) as u8
}

/// Where the lanes of live columns find their words.
#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn place_lanes(live: u8) -> __m256i {
    let places = i64::from_le_bytes(PLACES[usize::from(live)]);
    _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(places))
}

/// Gates of 8 columns: the first byte of four. What products take is times `2^by`.
#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn gates_of(gates: &[u8; 32], negate: bool, by: u32) -> Gates {
    let u = _mm256_srai_epi32::<24>(_mm256_slli_epi32::<24>(load(gates)));
    let sizes = _mm256_abs_epi32(u);
    let signed = if negate { _mm256_sub_epi32(_mm256_setzero_si256(), u) } else { u };
    let signed = _mm256_sllv_epi32(signed, _mm256_set1_epi32(by.cast_signed()));
    let lower = _mm256_and_si256(signed, _mm256_set1_epi32(0xffff));
    let twice = _mm256_or_si256(lower, _mm256_slli_epi32::<16>(signed));
    let mut each = [0; LANES];
    store_sums(&mut each, sizes);
    Gates { sizes, twice, most: each.into_iter().fold(0, i32::max).cast_unsigned() }
}

/// Drives of a block.
struct Drives {
    /// Greatest of each group of four rows.
    groups: [i32; 16],
    /// Of the block.
    most: u32,
    /// Rows 0 and 2 of each group, 16 bits each; rows 1 and 3.
    even: [i32; 16],
    odd: [i32; 16],
}

impl Drives {
    /// Drives of the first of four samples.
    #[inline]
    #[target_feature(enable = "avx2,popcnt")]
    fn new(turned: &[u8]) -> Self {
        let mut this = Self { groups: [0; 16], most: 0, even: [0; 16], odd: [0; 16] };
        for (group, rows) in turned.as_chunks::<16>().0.iter().enumerate().take(16) {
            let [a, b, c, d] = [rows[0], rows[4], rows[8], rows[12]].map(i32::from);
            this.groups[group] = a.max(b).max(c.max(d));
            (this.even[group], this.odd[group]) = (a | c << 16, b | d << 16);
        }
        this.most = this.groups.into_iter().fold(0, i32::max).cast_unsigned();
        this
    }

    /// Groups whose greatest drive is above a bound, a bit each.
    #[inline]
    #[target_feature(enable = "avx2,popcnt")]
    fn groups_above(&self, bound: __m256i) -> u32 {
        let [low, high] = self.groups.as_chunks::<8>().0 else { unreachable!("two vectors") };
        let low = u32::from(lanes_above(load_sums(low), bound));
        low | u32::from(lanes_above(load_sums(high), bound)) << 8
    }
}

/// Takes the pulses of 32 cells along.
#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn take(extremes: &mut Extremes, vector: usize, pulses: __m256i) {
    let most = &mut extremes.most.as_chunks_mut::<32>().0[vector];
    let least = &mut extremes.least.as_chunks_mut::<32>().0[vector];
    // SAFETY: both references cover the 32 bytes that unaligned loads and stores reach.
    unsafe {
        let above = _mm256_max_epi8(_mm256_loadu_si256(most.as_ptr().cast()), pulses);
        _mm256_storeu_si256(most.as_mut_ptr().cast(), above);
        let below = _mm256_min_epi8(_mm256_loadu_si256(least.as_ptr().cast()), pulses);
        _mm256_storeu_si256(least.as_mut_ptr().cast(), below);
    }
}

/// Rounded products of two rows and 8 columns.
#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn quotient<const USUAL: bool>(drives: i32, gates: __m256i, rounding: Rounding) -> __m256i {
    let drives = _mm256_set1_epi32(drives);
    if USUAL {
        _mm256_mulhrs_epi16(drives, gates)
    } else {
        _mm256_mulhrs_epi16(_mm256_mullo_epi16(drives, gates), rounding.factor)
    }
}

/// Pulses of four rows (the even and the odd) and 8 columns, in the order of levels.
#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn pulses<const USUAL: bool>(
    drives: [i32; 2],
    gates: __m256i,
    word: __m256i,
    rounding: Rounding,
) -> __m256i {
    let a = quotient::<USUAL>(drives[0], gates, rounding);
    let b = quotient::<USUAL>(drives[1], gates, rounding);
    let a = _mm256_add_epi16(a, _mm256_and_si256(word, _mm256_set1_epi16(0xff)));
    let b = _mm256_add_epi16(b, _mm256_srli_epi16::<8>(word));
    let upper = _mm256_set1_epi16(0xff00_u16.cast_signed());
    _mm256_or_si256(_mm256_srli_epi16::<8>(a), _mm256_and_si256(b, upper))
}
