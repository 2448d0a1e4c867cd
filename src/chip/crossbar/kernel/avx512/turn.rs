//! Bytes of samples side by side: what an update multiplies lies `[row][sample]`, what a read takes `[sample][row]`.
//!
//! ```text
//! interleave   4 samples x 64 bytes        -> 4 vectors of [16 bytes][4 samples]
//! turn         16 such, 16 dwords a vector -> 16 rows of 64 samples
//! ```
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::x86_64::*;

use super::{load, store};

/// Bytes 16h .. 16h + 16 of four samples, the samples of a byte side by side, in vector h.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(super) fn interleave(rows: [__m512i; 4]) -> [__m512i; 4] {
    let [a, b, c, d] = rows;
    // 128-bit lane h holds bytes 16h .. 16h + 16 of its sample
    let (ab_low, ab_high) = (_mm512_unpacklo_epi8(a, b), _mm512_unpackhi_epi8(a, b));
    let (cd_low, cd_high) = (_mm512_unpacklo_epi8(c, d), _mm512_unpackhi_epi8(c, d));
    lanes([
        _mm512_unpacklo_epi16(ab_low, cd_low),
        _mm512_unpackhi_epi16(ab_low, cd_low),
        _mm512_unpacklo_epi16(ab_high, cd_high),
        _mm512_unpackhi_epi16(ab_high, cd_high),
    ])
}

/// A 4 x 4 transposition of 128-bit lanes.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn lanes([a, b, c, d]: [__m512i; 4]) -> [__m512i; 4] {
    let (ab, cd) = (_mm512_shuffle_i32x4::<0x44>(a, b), _mm512_shuffle_i32x4::<0x44>(c, d));
    let (ef, gh) = (_mm512_shuffle_i32x4::<0xee>(a, b), _mm512_shuffle_i32x4::<0xee>(c, d));
    [
        _mm512_shuffle_i32x4::<0x88>(ab, cd),
        _mm512_shuffle_i32x4::<0xdd>(ab, cd),
        _mm512_shuffle_i32x4::<0x88>(ef, gh),
        _mm512_shuffle_i32x4::<0xdd>(ef, gh),
    ]
}

/// A 16 x 16 transposition of dwords.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(super) fn dwords(v: &mut [__m512i; 16]) {
    for four in v.as_chunks_mut::<4>().0 {
        let [a, b, c, d] = *four;
        let (ab_low, ab_high) = (_mm512_unpacklo_epi32(a, b), _mm512_unpackhi_epi32(a, b));
        let (cd_low, cd_high) = (_mm512_unpacklo_epi32(c, d), _mm512_unpackhi_epi32(c, d));
        *four = [
            _mm512_unpacklo_epi64(ab_low, cd_low),
            _mm512_unpackhi_epi64(ab_low, cd_low),
            _mm512_unpacklo_epi64(ab_high, cd_high),
            _mm512_unpackhi_epi64(ab_high, cd_high),
        ];
    }
    // lane l of v[4 q + i] now holds rows 4 q .. 4 q + 4 of column 4 l + i
    for i in 0..4 {
        let turned = lanes([v[i], v[4 + i], v[8 + i], v[12 + i]]);
        for (l, turned) in turned.into_iter().enumerate() {
            v[4 * l + i] = turned;
        }
    }
    // v[4 l + i] is column 4 l + i of rows 0 .. 16
}

/// See [`super::super::Kernel::turn`].
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(super) fn turn(codes: &[u8], stride: usize, turned: &mut [u8]) {
    if let (4, Ok(codes)) = (stride, <&[u8; 64]>::try_from(codes)) {
        return one(codes, turned);
    }
    let codes = codes.as_chunks::<64>().0;
    for first in (0..stride).step_by(64) {
        // [16 rows of codes][sample quad]
        let mut quads = [[_mm512_setzero_si512(); 16]; 4];
        for quad in 0..16 {
            let mut rows = [_mm512_setzero_si512(); 4];
            for (s, row) in rows.iter_mut().enumerate() {
                if let Some(codes) = codes.get(first + quad * 4 + s) {
                    *row = load(codes);
                }
            }
            for (quads, v) in quads.iter_mut().zip(interleave(rows)) {
                quads[quad] = v;
            }
        }
        let samples = (stride - first).min(64);
        for (sixteen, quads) in quads.iter_mut().enumerate() {
            dwords(quads);
            for (row, &v) in quads.iter().enumerate() {
                let to = &mut turned[(sixteen * 16 + row) * stride + first..][..samples];
                if let Ok(to) = <&mut [u8; 64]>::try_from(&mut *to) {
                    store(to, v);
                } else {
                    let mut all = [0; 64];
                    store(&mut all, v);
                    to.copy_from_slice(&all[..samples]);
                }
            }
        }
    }
}

/// One sample: each code is the first of four bytes.
#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn one(codes: &[u8; 64], turned: &mut [u8]) {
    let v = load(codes);
    let sixteens = [
        _mm512_castsi512_si128(v),
        _mm512_extracti32x4_epi32::<1>(v),
        _mm512_extracti32x4_epi32::<2>(v),
        _mm512_extracti32x4_epi32::<3>(v),
    ];
    for (turned, codes) in turned.as_chunks_mut().0.iter_mut().zip(sixteens) {
        store(turned, _mm512_cvtepu8_epi32(codes));
    }
}
