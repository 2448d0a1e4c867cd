//! Reads of few-bit levels or drives: pairs of products in 16-bit lanes (`vpmaddubsw`), some of them added there.
//!
//! ```text
//! pair      x0 * w0 + x1 * w1  <=  2 * level * code                  one factor a signed byte: at most 127
//! together  32,767 / pair      pairs add up in 16 bits before they are widened
//! ```
//!
//! One-bit slices against full bytes let 64 of them add up, so half the multiplications and hardly any widening is left.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::x86_64::*;

use super::{FEW, QUADS, Walk, lit_quads};
use crate::chip::crossbar::kernel::Greatest;

/// How a read adds up pairs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Together {
    /// Pairs that fit a signed lane of 16 bits together, at least 2.
    pairs: u32,
    /// Whether levels are the signed factor, else drives.
    levels: bool,
}

/// How pairs of such products add up; nothing where they hardly do, and widening each would cost more.
pub(super) const fn together(greatest: Greatest) -> Option<Together> {
    let Greatest { level, code } = greatest;
    let pair = 2 * level as u32 * code as u32;
    // a pair of 0 is possible: then nothing adds up
    let pairs = 32_767 / if pair == 0 { 1 } else { pair };
    let levels = level <= 127;
    if (levels || code <= 127) && pairs >= 2 { Some(Together { pairs, levels }) } else { None }
}

/// [`super::dots_batch`] of such a read.
#[target_feature(enable = "avx2,popcnt")]
pub(super) fn batch(
    together: Together,
    walk: Walk,
    samples: usize,
    streams: &[u8],
    vectors: &[u8],
    out: &mut [i32],
) {
    for from in (0..samples).step_by(4) {
        let x = &streams[from * walk.stride..];
        let out = &mut out[from * walk.out..];
        match (samples - from, together.levels) {
            (1, true) => dots::<true, 1>(together.pairs, walk, x, vectors, out),
            (2, true) => dots::<true, 2>(together.pairs, walk, x, vectors, out),
            (3, true) => dots::<true, 3>(together.pairs, walk, x, vectors, out),
            (_, true) => dots::<true, 4>(together.pairs, walk, x, vectors, out),
            (1, false) => dots::<false, 1>(together.pairs, walk, x, vectors, out),
            (2, false) => dots::<false, 2>(together.pairs, walk, x, vectors, out),
            (3, false) => dots::<false, 3>(together.pairs, walk, x, vectors, out),
            (_, false) => dots::<false, 4>(together.pairs, walk, x, vectors, out),
        }
    }
}

/// `out[i] = sum over runs and quads of dot4(stream i, vector)`, 16 lanes a vector.
#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn dots<const LEVELS: bool, const N: usize>(
    together: u32,
    walk: Walk,
    streams: &[u8],
    vectors: &[u8],
    out: &mut [i32],
) {
    let Walk { runs, quads, run, words, stride, out: out_stride } = walk;
    assert!(runs > 0 && quads == QUADS, "blocks of 64 rows are read");
    assert!(
        streams.len() >= (runs - 1) * words + (N - 1) * stride + quads * 4,
        "every stream has its words"
    );
    assert!(vectors.len() >= (runs - 1) * run + quads * 64, "every vector lies inside");
    assert!(out.len() >= (N - 1) * out_stride + 16, "every sum has its place");
    let zero = _mm256_setzero_si256();
    let (mut wide, mut narrow) = ([[zero; 2]; N], [[zero; 2]; N]);
    let mut left = together;
    for r in 0..runs {
        // SAFETY: r < runs, so the first assertion above bounds 64 bytes of each of the N streams, and the second 1,024
        // bytes of the vectors.
        let (x, v) = unsafe { (streams.as_ptr().add(r * words), vectors.as_ptr().add(r * run)) };
        // SAFETY: 64 bytes of each stream lie there, as above.
        let lit = unsafe { lit_quads::<N>(x, stride) };
        let mut these = if lit.count_ones() <= FEW { lit } else { 0xffff };
        while these != 0 {
            // SAFETY: a quad below 16, whose bytes lie there, as above.
            unsafe { dot::<LEVELS, N>(&mut narrow, x, stride, v, these.trailing_zeros() as usize) };
            these &= these - 1;
            left -= 1;
            if left == 0 {
                widen(&mut wide, &mut narrow);
                left = together;
            }
        }
    }
    widen(&mut wide, &mut narrow);
    for (i, sums) in wide.iter().enumerate() {
        for (h, sum) in sums.iter().enumerate() {
            // SAFETY: i < N and h < 2, so the third assertion above bounds these 8 sums, and `out` is borrowed for
            // writing.
            unsafe {
                _mm256_storeu_si256(out.as_mut_ptr().add(i * out_stride + h * 8).cast(), *sum);
            }
        }
    }
}

/// Adds the pairs of one quad: a word of each of N streams, and two vectors.
///
/// # Safety
/// As [`super::dot`].
#[inline]
#[target_feature(enable = "avx2,popcnt")]
unsafe fn dot<const LEVELS: bool, const N: usize>(
    narrow: &mut [[__m256i; 2]; N],
    x: *const u8,
    stride: usize,
    v: *const u8,
    quad: usize,
) {
    let mut w = [_mm256_setzero_si256(); 2];
    for (h, w) in w.iter_mut().enumerate() {
        // SAFETY: the caller says that 64 bytes lie there; each load reads half of them.
        *w = unsafe { _mm256_loadu_si256(v.add(quad * 64 + h * 32).cast()) };
    }
    for (i, narrow) in narrow.iter_mut().enumerate() {
        // SAFETY: the caller says that this word lies there; the read asks for no alignment.
        let word = unsafe { x.add(i * stride + quad * 4).cast::<i32>().read_unaligned() };
        let x = _mm256_set1_epi32(word);
        for (narrow, w) in narrow.iter_mut().zip(w) {
            let pairs =
                if LEVELS { _mm256_maddubs_epi16(x, w) } else { _mm256_maddubs_epi16(w, x) };
            *narrow = _mm256_add_epi16(*narrow, pairs);
        }
    }
}

/// Adds the two 16-bit sums of a lane to its 32-bit sum, and starts over.
#[inline]
#[target_feature(enable = "avx2,popcnt")]
fn widen<const N: usize>(wide: &mut [[__m256i; 2]; N], narrow: &mut [[__m256i; 2]; N]) {
    for (wide, narrow) in wide.as_flattened_mut().iter_mut().zip(narrow.as_flattened_mut()) {
        *wide = _mm256_add_epi32(*wide, _mm256_madd_epi16(*narrow, _mm256_set1_epi16(1)));
        *narrow = _mm256_setzero_si256();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_pairs_add_up_as_fit() {
        let of = |level, code| together(Greatest { level, code });
        assert_eq!(of(255, 255), None);
        assert_eq!(of(255, 1), Some(Together { pairs: 64, levels: false }));
        assert_eq!(of(1, 255), Some(Together { pairs: 64, levels: true }));
        // 2 * 32 * 255 = 16,320 fits twice, 2 * 33 * 255 does not
        assert_eq!(of(32, 255), Some(Together { pairs: 2, levels: true }));
        assert_eq!(of(33, 255), None);
        assert_eq!(of(128, 64), None);
        assert_eq!(of(0, 255), Some(Together { pairs: 32_767, levels: true }));
    }
}
