//! Writes of one sample: a sum is one product, so it is never stored, and words are drawn for live columns only.
//!
//! ```text
//! q        rsh( x * +-u, s )  =  mulhrs( x * +-u, 2^(15 - s) )              s = k - 8 in 1..=15, |x * u| <= 32,385
//! pulses   (q + word) >> 8                                                 at most 15 and the bound: none is bounded
//! quiet    |x * u| < 2^(s - 1):  q = 0, and no word makes a pulse of it
//! ```
//!
//! From `s = 7` on a pulse is at most one, and the gate times `2^(15 - s)` fits 16 bits: one product gives `q`. With a
//! window of all levels, where the addition saturates, this is the usual case (`USUAL`).
//!
//! A column whose gate times the greatest drive of the block is quiet needs no words, and a group of four rows whose
//! greatest drive times the greatest gate is quiet is passed over. ChaCha runs for 16 live columns at a time, from
//! wherever they lie in the strip; a permutation puts their words beside their cells. Lanes of columns that are not live
//! take any word.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::x86_64::*;

use super::dither::drawn;
use super::peaks::{peaks as fold_rows, take};
use super::units::store_bytes;
use super::{as_bytes, load, load_sums, store, store_sums};
use crate::chip::crossbar::kernel::{Extremes, OneProduct, OneSample, Pulsed, WriteCounts};
use crate::chip::crossbar::layout::{BLOCK_CELLS, BLOCK_ROWS, HALF_CELLS, HALF_COLUMNS};

/// Half blocks side by side of the widest strip taken.
const HALVES: usize = OneSample::HALVES;
/// Columns of the widest strip, and a vector more.
const ROOM: usize = HALVES * HALF_COLUMNS + 16;

/// Words of the live columns of a block, `[group][column]`: four rows a word.
#[repr(align(64))]
struct Words([[i32; ROOM]; 16]);

/// The gates of a half block.
#[derive(Clone, Copy)]
struct Gates {
    /// Size of each.
    sizes: __m512i,
    /// With the sign of the pathway, twice in each lane; times the factor if `USUAL`.
    twice: __m512i,
    most: u32,
}

/// How sums become pulses.
#[derive(Clone, Copy)]
struct Rounding {
    factor: __m512i,
    /// Levels less 128, so that the signed saturating addition ends at 0 and 255.
    floor: __m512i,
    ceiling: __m512i,
    flip: __m512i,
}

/// See [`super::super::Kernel::one_sample`].
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(super) fn one_sample(strip: OneSample<'_>) -> Option<WriteCounts> {
    let rounding = strip.one_product()?;
    Some(if rounding.usual {
        strip_of::<true>(strip, rounding)
    } else {
        strip_of::<false>(strip, rounding)
    })
}

#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn strip_of<const USUAL: bool>(
    strip: OneSample<'_>,
    OneProduct { right, window: (floor, ceiling), .. }: OneProduct,
) -> WriteCounts {
    let OneSample { low, blocks, turned, gates, column, draws, write, mut peaks } = strip;
    let halves = gates.len() / 64;
    let zero = _mm512_setzero_si512();
    let least_moving = 1u32 << (right - 1);
    let rounding = Rounding {
        factor: _mm512_set1_epi16(1 << (15 - right)),
        floor: _mm512_set1_epi8((floor ^ 0x80).cast_signed()),
        ceiling: _mm512_set1_epi8((ceiling ^ 0x80).cast_signed()),
        flip: _mm512_set1_epi8(i8::MIN),
    };
    let mut all = [Gates { sizes: zero, twice: zero, most: 0 }; HALVES];
    for (all, gates) in all.iter_mut().zip(as_bytes(gates).as_chunks::<64>().0) {
        *all = gates_of(gates, write.negate, if USUAL { 15 - right } else { 0 });
    }
    let all = &all[..halves];
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
        let least = _mm512_set1_epi32(least_moving.div_ceil(drives.most).cast_signed());
        let (mut live, mut starts, mut columns) = ([0u16; HALVES], [0; HALVES], 0);
        for (half, gates) in all.iter().enumerate() {
            live[half] = _mm512_cmpge_epi32_mask(gates.sizes, least);
            starts[half] = columns;
            if live[half] != 0 {
                let counter = draws.counter(64, column + half * HALF_COLUMNS, block);
                let lane = _mm512_mullo_epi32(lanes(), _mm512_set1_epi32(counter.step));
                let all = _mm512_add_epi32(_mm512_set1_epi32(counter.first), lane);
                let to = counters[columns..].first_chunk_mut().expect("a vector of room");
                store_sums(to, _mm512_maskz_compress_epi32(live[half], all));
                columns += live[half].count_ones() as usize;
            }
        }
        for first in (0..columns).step_by(16) {
            let counter = load_sums(counters[first..].first_chunk().expect("a vector of room"));
            drawn(draws, counter, |i, v| {
                store_sums(words.0[i][first..].first_chunk_mut().expect("a vector of room"), v);
            });
        }
        for (half, gates) in all.iter().enumerate().filter(|(half, _)| live[*half] != 0) {
            let least = _mm512_set1_epi32(least_moving.div_ceil(gates.most).cast_signed());
            let mut groups = _mm512_cmpge_epi32_mask(drives.groups, least);
            let places = _mm512_maskz_expand_epi32(live[half], lanes());
            let at = half / 2 * blocks * BLOCK_CELLS + block * BLOCK_CELLS + half % 2 * HALF_CELLS;
            let low = low[at..at + HALF_CELLS].as_chunks_mut::<64>().0;
            let (mut sizes, mut pulsed) = (zero, zero);
            while groups != 0 {
                let group = groups.trailing_zeros() as usize;
                groups &= groups - 1;
                let row: &[i32; 16] = words.0[group][starts[half]..].first_chunk().expect("room");
                let word = _mm512_permutexvar_epi32(places, load_sums(row));
                let drives = [drives.even[group], drives.odd[group]];
                let pulses = pulses::<USUAL>(drives, gates.twice, word, rounding);
                let before = load(&low[group]);
                if let Some(extremes) = &mut extremes {
                    take(&mut Pulsed::Most(extremes), group, pulses);
                }
                let mut level = _mm512_adds_epi8(_mm512_xor_si512(before, rounding.flip), pulses);
                if !USUAL {
                    level =
                        _mm512_max_epi8(_mm512_min_epi8(level, rounding.ceiling), rounding.floor);
                }
                let level = _mm512_xor_si512(level, rounding.flip);
                store(&mut low[group], level);
                let size = _mm512_abs_epi8(pulses);
                sizes = _mm512_add_epi8(sizes, size);
                if !USUAL {
                    pulsed = _mm512_add_epi8(pulsed, _mm512_min_epu8(size, _mm512_set1_epi8(1)));
                }
                effective = _mm512_add_epi64(effective, _mm512_sad_epu8(level, before));
            }
            // 16 groups of pulses up to 15 fit a byte
            attempted = _mm512_add_epi64(attempted, _mm512_sad_epu8(sizes, zero));
            let pulsed = if USUAL { sizes } else { pulsed };
            requested = _mm512_add_epi64(requested, _mm512_sad_epu8(pulsed, zero));
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
    let [requested, attempted, effective] = [requested, attempted, effective]
        .map(|lanes| _mm512_reduce_add_epi64(lanes).cast_unsigned());
    WriteCounts { requested, bounded: 0, attempted, effective }
}

/// The number of each lane.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn lanes() -> __m512i {
    _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15)
}

/// Gates of 16 columns: the first byte of four. What products take is times `2^by`.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn gates_of(gates: &[u8; 64], negate: bool, by: u32) -> Gates {
    let u = _mm512_srai_epi32::<24>(_mm512_slli_epi32::<24>(load(gates)));
    let sizes = _mm512_abs_epi32(u);
    let signed = if negate { _mm512_sub_epi32(_mm512_setzero_si512(), u) } else { u };
    let signed = _mm512_sllv_epi32(signed, _mm512_set1_epi32(by.cast_signed()));
    let lower = _mm512_and_si512(signed, _mm512_set1_epi32(0xffff));
    let twice = _mm512_or_si512(lower, _mm512_slli_epi32::<16>(signed));
    Gates { sizes, twice, most: _mm512_reduce_max_epi32(sizes).cast_unsigned() }
}

/// Drives of a block.
struct Drives {
    /// Greatest of each group of four rows.
    groups: __m512i,
    /// Of the block.
    most: u32,
    /// Rows 0 and 2 of each group, 16 bits each; rows 1 and 3.
    even: [i32; 16],
    odd: [i32; 16],
}

impl Drives {
    /// Drives of the first of four samples.
    #[inline]
    #[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
    fn new(turned: &[u8]) -> Self {
        let mut codes = [0; BLOCK_ROWS];
        for (codes, rows) in codes.as_chunks_mut().0.iter_mut().zip(turned.as_chunks::<64>().0) {
            store_bytes(codes, _mm512_cvtepi32_epi8(load(rows)));
        }
        let codes = load(&codes);
        let pairs = _mm512_max_epu8(codes, _mm512_srli_epi32::<8>(codes));
        let fours = _mm512_max_epu8(pairs, _mm512_srli_epi32::<16>(pairs));
        let groups = _mm512_and_si512(fours, _mm512_set1_epi32(0xff));
        let (mut even, mut odd) = ([0; 16], [0; 16]);
        let byte = _mm512_set1_epi16(0xff);
        store_sums(&mut even, _mm512_and_si512(codes, byte));
        store_sums(&mut odd, _mm512_srli_epi16::<8>(codes));
        let most = _mm512_reduce_max_epi32(groups).cast_unsigned();
        Self { groups, most, even, odd }
    }
}

/// Pulses of four rows (the even and the odd) and 16 columns, in the order of levels.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn pulses<const USUAL: bool>(
    drives: [i32; 2],
    gates: __m512i,
    word: __m512i,
    rounding: Rounding,
) -> __m512i {
    let [a, b] = drives.map(|drives| {
        let drives = _mm512_set1_epi32(drives);
        if USUAL {
            _mm512_mulhrs_epi16(drives, gates)
        } else {
            _mm512_mulhrs_epi16(_mm512_mullo_epi16(drives, gates), rounding.factor)
        }
    });
    let a = _mm512_add_epi16(a, _mm512_and_si512(word, _mm512_set1_epi16(0xff)));
    let b = _mm512_add_epi16(b, _mm512_srli_epi16::<8>(word));
    // a >> 8 | b & 0xff00
    let upper = _mm512_set1_epi16(0xff00_u16.cast_signed());
    _mm512_ternarylogic_epi32::<0xf8>(_mm512_srli_epi16::<8>(a), b, upper)
}
