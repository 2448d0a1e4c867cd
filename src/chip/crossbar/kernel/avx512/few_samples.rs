//! Reads of one to four samples. Weights are used once or little more, so words of four drives that are 0 in every
//! sample are passed over: a zero drive adds nothing.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::x86_64::*;
use std::ops::Range;

use super::{drive_sum, load, store_sums};
use crate::chip::crossbar::kernel::Drives;
use crate::chip::crossbar::layout::{BLOCK_CELLS, HALF_CELLS};

#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
pub(super) fn read(cells: &[u8], drives: Drives<'_>, samples: Range<usize>, out: &mut [i32]) {
    match samples.len() {
        1 => few_samples::<1>(cells, drives, samples.start, out),
        2 => few_samples::<2>(cells, drives, samples.start, out),
        3 => few_samples::<3>(cells, drives, samples.start, out),
        4 => few_samples::<4>(cells, drives, samples.start, out),
        _ => unreachable!("a few samples are 1 to 4"),
    }
}

#[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi,popcnt")]
fn few_samples<const N: usize>(cells: &[u8], drives: Drives<'_>, first: usize, out: &mut [i32]) {
    let flip = _mm512_set1_epi8(i8::MIN);
    // two sums a lane: a product waits for the one before it in the same sum
    let mut sums = [[[_mm512_setzero_si512(); 2]; N]; 2];
    for (block, cells) in cells.as_chunks::<BLOCK_CELLS>().0.iter().enumerate() {
        let x: [&[u8; 64]; N] = std::array::from_fn(|i| drives.row(block, first + i));
        let mut any = _mm512_setzero_si512();
        for x in x {
            any = _mm512_or_si512(any, load(x));
        }
        let mut words = _mm512_test_epi32_mask(any, any);
        let [left, right] = [0, 1].map(|half| cells[half * HALF_CELLS..].as_chunks::<64>().0);
        while words != 0 {
            for sums in &mut sums {
                if words == 0 {
                    break;
                }
                let quad = words.trailing_zeros() as usize;
                words &= words - 1;
                let w = [
                    _mm512_xor_si512(load(&left[quad]), flip),
                    _mm512_xor_si512(load(&right[quad]), flip),
                ];
                for (x, sums) in x.iter().zip(sums) {
                    let word = *x.as_chunks::<4>().0[quad].first_chunk().expect("4 drives a word");
                    let x = _mm512_set1_epi32(i32::from_le_bytes(word));
                    sums[0] = _mm512_dpbusd_epi32(sums[0], x, w[0]);
                    sums[1] = _mm512_dpbusd_epi32(sums[1], x, w[1]);
                }
            }
        }
    }
    let rows = out.as_chunks_mut::<32>().0;
    for (i, out) in rows.iter_mut().enumerate().take(N) {
        let flipped = _mm512_set1_epi32(128 * drive_sum(drives, first + i));
        for (half, out) in out.as_chunks_mut::<16>().0.iter_mut().enumerate() {
            let sum = _mm512_add_epi32(sums[0][i][half], sums[1][i][half]);
            store_sums(out, _mm512_add_epi32(sum, flipped));
        }
    }
}
