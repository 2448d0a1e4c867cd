//! ChaCha8 for 4 columns at a time, one block of 64 bytes a lane; four groups fill a half block.
//!
//! ```text
//! lane c      block `(column + c) * ceil(rows / 64) + block` of the place
//! word i      4 bytes: rows 4i .. 4i + 4 of column c
//! ```
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::aarch64::*;

use super::{load, store};
use crate::chip::crossbar::kernel::chacha::Counter;
use crate::chip::crossbar::kernel::{Draws, Half};

/// Turns the 32-bit lanes left; `LEFT + RIGHT` is 32.
#[inline]
#[target_feature(enable = "neon")]
fn rotate<const LEFT: i32, const RIGHT: i32>(v: uint32x4_t) -> uint32x4_t {
    vsriq_n_u32::<RIGHT>(vshlq_n_u32::<LEFT>(v), v)
}

#[inline]
#[target_feature(enable = "neon")]
fn rotate_16(v: uint32x4_t) -> uint32x4_t {
    vreinterpretq_u32_u16(vrev32q_u16(vreinterpretq_u16_u32(v)))
}

/// Turning by a whole byte is one look-up.
#[inline]
#[target_feature(enable = "neon")]
fn rotate_8(v: uint32x4_t) -> uint32x4_t {
    let by_8 = load(&[3, 0, 1, 2, 7, 4, 5, 6, 11, 8, 9, 10, 15, 12, 13, 14]);
    vreinterpretq_u32_u8(vqtbl1q_u8(vreinterpretq_u8_u32(v), by_8))
}

#[inline]
#[target_feature(enable = "neon")]
fn quarter(s: &mut [uint32x4_t; 16], a: usize, b: usize, c: usize, d: usize) {
    s[a] = vaddq_u32(s[a], s[b]);
    s[d] = rotate_16(veorq_u32(s[d], s[a]));
    s[c] = vaddq_u32(s[c], s[d]);
    s[b] = rotate::<12, 20>(veorq_u32(s[b], s[c]));
    s[a] = vaddq_u32(s[a], s[b]);
    s[d] = rotate_8(veorq_u32(s[d], s[a]));
    s[c] = vaddq_u32(s[c], s[d]);
    s[b] = rotate::<7, 25>(veorq_u32(s[b], s[c]));
}

/// One block of 64 bytes of the columns `4 * group .. 4 * group + 4`: word i of lane c.
#[inline]
#[target_feature(enable = "neon")]
fn blocks(draws: &Draws, counter: Counter, group: u32) -> [uint32x4_t; 16] {
    let start = draws.start().map(i32::cast_unsigned);
    let mut first = [vdupq_n_u32(0); 16];
    for (first, word) in first.iter_mut().zip(start) {
        *first = vdupq_n_u32(word);
    }
    // Lanes hold 0, 1, 2, 3.
    let lane = vreinterpretq_u32_u8(load(&[0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0]));
    let column = vaddq_u32(lane, vdupq_n_u32(4 * group));
    let step = vdupq_n_u32(counter.step.cast_unsigned());
    first[12] = vmlaq_u32(vdupq_n_u32(counter.first.cast_unsigned()), column, step);
    let mut s = first;
    for _ in 0..4 {
        quarter(&mut s, 0, 4, 8, 12);
        quarter(&mut s, 1, 5, 9, 13);
        quarter(&mut s, 2, 6, 10, 14);
        quarter(&mut s, 3, 7, 11, 15);
        quarter(&mut s, 0, 5, 10, 15);
        quarter(&mut s, 1, 6, 11, 12);
        quarter(&mut s, 2, 7, 8, 13);
        quarter(&mut s, 3, 4, 9, 14);
    }
    for (s, first) in s.iter_mut().zip(first) {
        *s = vaddq_u32(*s, first);
    }
    s
}

#[target_feature(enable = "neon")]
pub(super) fn dither(draws: &Draws, column: usize, block: usize, out: &mut Half<u8>) {
    let counter = draws.counter(64, column, block);
    for group in 0..4 {
        for (out, v) in out.as_chunks_mut::<64>().0.iter_mut().zip(blocks(draws, counter, group)) {
            store(&mut out.as_chunks_mut().0[group as usize], vreinterpretq_u8_u32(v));
        }
    }
}

/// A 64-byte block holds the 16-bit words of 32 rows: two a block of levels.
#[target_feature(enable = "neon")]
pub(super) fn dither_words(draws: &Draws, column: usize, block: usize, out: &mut Half<u16>) {
    for (half, out) in out.as_chunks_mut::<512>().0.iter_mut().enumerate() {
        if (2 * block + half) * 32 >= draws.rows() {
            return;
        }
        let counter = draws.counter(32, column, 2 * block + half);
        for group in 0..4 {
            let words = blocks(draws, counter, group);
            for (out, v) in out.as_chunks_mut::<64>().0.iter_mut().zip(words.as_chunks().0) {
                let out = &mut out.as_chunks_mut::<16>().0[group as usize];
                store_words(out, *v);
            }
        }
    }
}

/// Four rows of 4 columns: lane c of `first` holds rows 0 and 1 of a group, of `second` rows 2 and 3.
#[inline]
#[target_feature(enable = "neon")]
fn store_words(out: &mut [u16; 16], [first, second]: [uint32x4_t; 2]) {
    let pairs = [vzip1q_u32(first, second), vzip2q_u32(first, second)];
    for (out, v) in out.as_chunks_mut::<8>().0.iter_mut().zip(pairs) {
        // SAFETY: the reference covers the 8 words, 16 bytes, that the store writes.
        unsafe { vst1q_u16(out.as_mut_ptr(), vreinterpretq_u16_u32(v)) }
    }
}
