//! What the bytes at hand allow: products of pairs that fit a signed lane of 16 bits (`vpmaddubsw`) although the plan cannot
//! promise it, and vectors that are dark.
//!
//! ```text
//! gates     x0 g0 + x1 g1,      |.| <= (x0 + x1) max |g|  <=  32,767        x a stream's bytes, unsigned
//! levels    w = (w - 128) + 128:  |x0 (w0 - 128) + x1 (w1 - 128)| <= 128 (x0 + x1)  <=  32,767;   128 sum x is added at the end
//! dark      all bytes of the upper 8 columns, or of all 16, are 0
//! ```
//!
//! Gates are mostly small, and drives next to one another are seldom both at their end: never where two rows are a number
//! above 0 and below. Vectors are looked at once a product, streams once for 16 words of four of them; where pairs do not
//! fit, bytes are widened before.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::x86_64::*;

/// What is known of the vectors of a product.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Vectors {
    /// Greatest sum of two neighbours of a stream whose products with any vector add up inside 16 bits; 0 where none does.
    pub(super) pair_max: u16,
    /// How many of the two vectors of a quad are not dark: those before it are taken.
    pub(super) live: usize,
}

impl Vectors {
    /// Nothing is known.
    pub(super) const ANY: Self = Self { pair_max: 0, live: 2 };

    /// Of gates whose greatest sizes are these: of the first 8 columns, and of the others.
    pub(super) const fn of_gates(greatest: [u8; 2]) -> Self {
        let [left, right] = greatest;
        let most = if left > right { left } else { right };
        let pair_max = match most {
            0 => u16::MAX,
            1..=127 => 32_767 / most as u16,
            _ => 0,
        };
        Self { pair_max, live: live(greatest) }
    }

    /// Of levels.
    pub(super) const fn of_levels(greatest: [u8; 2]) -> Self {
        Self { pair_max: 32_767 / 128, live: live(greatest) }
    }
}

/// How many of two vectors are taken.
const fn live(greatest: [u8; 2]) -> usize {
    match greatest {
        [0, 0] => 0,
        [_, 0] => 1,
        _ => 2,
    }
}

/// Greatest bytes of runs of `quads` vectors of 64, of each 32.
#[target_feature(enable = "avx2,popcnt")]
pub(super) fn greatest<const SIGNED: bool>(
    vectors: &[u8],
    (runs, run, quads): (usize, usize, usize),
) -> [u8; 2] {
    let mut most = [_mm256_setzero_si256(); 2];
    for r in 0..runs {
        let quads = &vectors[r * run..][..quads * 64];
        for quad in quads.as_chunks::<32>().0.as_chunks::<2>().0 {
            for (most, bytes) in most.iter_mut().zip(quad) {
                let v = super::load(bytes);
                let v = if SIGNED { _mm256_abs_epi8(v) } else { v };
                *most = _mm256_max_epu8(*most, v);
            }
        }
    }
    most.map(|v| {
        let v = _mm_max_epu8(_mm256_castsi256_si128(v), _mm256_extracti128_si256::<1>(v));
        // the least of what is missing to 255, of eight pairs
        let v = _mm_max_epu8(v, _mm_srli_epi16::<8>(v));
        let v = _mm_andnot_si128(v, _mm_set1_epi16(0xff));
        255 - (_mm_cvtsi128_si32(_mm_minpos_epu16(v)) & 0xff) as u8
    })
}

/// Which of 16 words are not 0 in all of N streams, a bit each, and the greatest sum of two neighbours.
///
/// # Safety
/// Each stream, the first at `from` and the next `stride` bytes on, has 64 bytes there.
#[inline]
#[target_feature(enable = "avx2,popcnt")]
pub(super) unsafe fn look<const N: usize>(from: *const u8, stride: usize) -> (u32, u16) {
    let mut most = [_mm256_setzero_si256(); 2];
    for i in 0..N {
        for (h, most) in most.iter_mut().enumerate() {
            // SAFETY: the caller says that 64 bytes lie there; unaligned loads read half of them each.
            let v = unsafe { _mm256_loadu_si256(from.add(i * stride + h * 32).cast()) };
            *most = _mm256_max_epu16(*most, _mm256_maddubs_epi16(v, _mm256_set1_epi8(1)));
        }
    }
    let zero = _mm256_setzero_si256();
    let dark = |v| _mm256_movemask_ps(_mm256_castsi256_ps(_mm256_cmpeq_epi32(v, zero)));
    let lit = !(dark(most[0]) | dark(most[1]) << 8).cast_unsigned() & 0xffff;
    let v = _mm256_max_epu16(most[0], most[1]);
    let v = _mm_max_epu16(_mm256_castsi256_si128(v), _mm256_extracti128_si256::<1>(v));
    let least = _mm_minpos_epu16(_mm_xor_si128(v, _mm_set1_epi8(-1)));
    (lit, !(_mm_cvtsi128_si32(least) as u16))
}

/// Adds the 64 bytes of each of N streams to its sum, which lies in four lanes of 64 bits.
///
/// # Safety
/// As [`look`].
#[inline]
#[target_feature(enable = "avx2,popcnt")]
pub(super) unsafe fn add_up<const N: usize>(
    sums: &mut [__m256i; N],
    from: *const u8,
    stride: usize,
) {
    for (i, sum) in sums.iter_mut().enumerate() {
        for h in 0..2 {
            // SAFETY: the caller says that 64 bytes lie there; unaligned loads read half of them each.
            let v = unsafe { _mm256_loadu_si256(from.add(i * stride + h * 32).cast()) };
            *sum = _mm256_add_epi64(*sum, _mm256_sad_epu8(v, _mm256_setzero_si256()));
        }
    }
}

/// 128 times what [`add_up`] gave, in every lane of 32 bits; it fits.
#[inline]
#[target_feature(enable = "avx2,popcnt")]
pub(super) fn raised(sum: __m256i) -> __m256i {
    let v = _mm_add_epi64(_mm256_castsi256_si128(sum), _mm256_extracti128_si256::<1>(sum));
    let v = _mm_add_epi64(v, _mm_unpackhi_epi64(v, v));
    _mm256_broadcastd_epi32(_mm_slli_epi64::<7>(v))
}

/// [`super::dot`] of pairs that fit; of levels, 128 below what they are.
///
/// # Safety
/// As [`super::dot`].
#[inline]
#[target_feature(enable = "avx2,popcnt")]
pub(super) unsafe fn dot<const LEVELS: bool, const N: usize, const H: usize>(
    acc: &mut [[__m256i; H]; N],
    x: *const u8,
    stride: usize,
    v: *const u8,
    quad: usize,
) {
    let mut w = [_mm256_setzero_si256(); H];
    for (h, w) in w.iter_mut().enumerate() {
        // SAFETY: the caller says that 64 bytes lie there; each load reads half of them.
        *w = unsafe { _mm256_loadu_si256(v.add(quad * 64 + h * 32).cast()) };
        if LEVELS {
            *w = _mm256_xor_si256(*w, _mm256_set1_epi8(i8::MIN));
        }
    }
    for (i, acc) in acc.iter_mut().enumerate() {
        // SAFETY: the caller says that this word lies there; the read asks for no alignment.
        let word = unsafe { x.add(i * stride + quad * 4).cast::<i32>().read_unaligned() };
        let x = _mm256_set1_epi32(word);
        for (acc, w) in acc.iter_mut().zip(w) {
            let pairs = _mm256_maddubs_epi16(x, w);
            *acc = _mm256_add_epi32(*acc, _mm256_madd_epi16(pairs, _mm256_set1_epi16(1)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chip::crossbar::kernel::Avx2;

    #[test]
    fn pairs_fit_up_to_the_greatest_lane_and_no_further() {
        let of = |greatest| {
            let Vectors { pair_max, live } = Vectors::of_gates(greatest);
            (pair_max, live)
        };
        assert_eq!(of([0, 0]), (u16::MAX, 0));
        assert_eq!(of([3, 0]), (10_922, 1));
        // a dark vector before a bright one is taken along
        assert_eq!(of([0, 64]), (511, 2));
        assert_eq!(of([65, 64]), (504, 2));
        assert_eq!(of([127, 1]), (258, 2));
        assert_eq!(of([128, 1]), (0, 2));
        assert_eq!(Vectors::of_levels([255, 0]), Vectors { pair_max: 255, live: 1 });
    }

    #[test]
    fn the_greatest_byte_is_found_wherever_it_lies() {
        if Avx2::detect().is_none() {
            return;
        }
        for at in 0..256 {
            // two runs of a quad, and what lies between them
            let mut vectors = [0x80; 192];
            vectors[64..128].fill(0xff);
            let place = at % 64 + at / 128 * 128;
            vectors[place] = if at % 128 < 64 { 0x90 } else { 0x81 };
            let mut want = [[0x80; 2], [128; 2]];
            let half = at % 64 / 32;
            (want[0][half], want[1][half]) = (vectors[place], 128);
            // SAFETY: the token was there, so the features are.
            let found = unsafe {
                [greatest::<false>(&vectors, (2, 128, 1)), greatest::<true>(&vectors, (2, 128, 1))]
            };
            assert_eq!(found, want, "{at}");
        }
    }

    #[test]
    fn lit_words_and_the_greatest_pair_are_found_wherever_they_lie() {
        if Avx2::detect().is_none() {
            return;
        }
        for at in 0..128 {
            let mut streams = [0; 128];
            streams[at] = 255;
            // SAFETY: the token was there, so the features are; two streams of 64 bytes lie there.
            let seen = unsafe { look::<2>(streams.as_ptr(), 64) };
            assert_eq!(seen, (1 << (at % 64 / 4), 255));
            streams[at ^ 1] = 250;
            streams[at ^ 2] = 255;
            // SAFETY: as above.
            let seen = unsafe { look::<2>(streams.as_ptr(), 64) };
            assert_eq!(seen, (1 << (at % 64 / 4), 505));
        }
    }
}
