//! Sums of an update that meets many reads, as the positions of a convolution are: taken some reads at a time, so that what
//! they are made of stays close to the processor while every column takes it.
//!
//! ```text
//! sums[h][r][c] = sum over reads b of codes[b][r] * gates[h][b][c]        of all half blocks h beside one block of 64 rows
//! ```
//!
//! Codes lie as a read takes them, `[read][64 rows]`: nothing is turned for all reads at once. Products are added in 32 bits
//! in whatever order, which is exact: 65,536 of them fit.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use aligned_vec::{AVec, avec};

use super::{Half, Kernel, call};
use crate::chip::crossbar::layout::{BLOCK_ROWS, HALF_CELLS, HALF_COLUMNS};

/// Most reads of one update: products of a drive and a gate of -127..=127 fit 32 bits.
const READS_MAX: usize = 65_536;
/// Reads whose drives are turned together, where a back end takes them turned.
const TURNED: usize = 1024;

/// What is put together on the way; kept from one call to the next.
#[derive(Debug)]
pub struct ReadsScratch {
    /// `[64 rows][reads of a part]`.
    turned: AVec<u8>,
    part: Box<Part>,
}

/// A half block of sums, where tiles are stored fastest.
#[derive(Debug)]
#[repr(align(64))]
struct Part(Half<i32>);

impl Default for ReadsScratch {
    fn default() -> Self {
        Self { turned: avec![], part: Box::new(Part([0; HALF_CELLS])) }
    }
}

impl Kernel {
    /// Sums of half blocks side by side, of one block of rows: `sums[h][r][c] = sum over b of codes[b][r] * gates[h][first + b][c]`.
    /// `codes` lies `[read][64 rows]`, of which the first `rows` exist; `gates` `[half][stride / 4][16 columns][4 reads]`, and
    /// `first` is a whole word of them. What lies in rows that do not exist means nothing.
    ///
    /// # Panics
    /// When the sizes do not match, or sums may not fit 32 bits.
    pub fn accumulate_reads(
        &self,
        (codes, rows): (&[u8], usize),
        (gates, stride, first): (&[i8], usize, usize),
        scratch: &mut ReadsScratch,
        sums: &mut [Half<i32>],
    ) {
        let reads = codes.len() / BLOCK_ROWS;
        assert!(codes.len().is_multiple_of(BLOCK_ROWS), "64 rows a read");
        assert!((1..=BLOCK_ROWS).contains(&rows), "a block has rows");
        assert!(stride.is_multiple_of(4) && first.is_multiple_of(4), "reads come in words of four");
        assert!(first + reads <= stride && reads <= READS_MAX, "reads have gates, and sums fit");
        assert_eq!(gates.len(), sums.len() * HALF_COLUMNS * stride, "16 columns a half block");
        if let Some(all) = self.ops.accumulate_reads {
            return call!(all, ((codes, rows), (gates, stride, first), sums));
        }
        sums.iter_mut().for_each(|sums| sums.fill(0));
        let ReadsScratch { turned, part } = scratch;
        for start in (0..reads).step_by(TURNED) {
            // padded as gates are
            let padded = (reads - start).next_multiple_of(BLOCK_ROWS).min(stride - first - start);
            let count = TURNED.min(padded);
            turned.resize(BLOCK_ROWS * count, 0);
            let codes = &codes[start * BLOCK_ROWS..(start + count).min(reads) * BLOCK_ROWS];
            self.turn(codes, count, turned);
            for (sums, gates) in sums.iter_mut().zip(gates.chunks_exact(HALF_COLUMNS * stride)) {
                let gates = &gates[(first + start) * HALF_COLUMNS..][..count * HALF_COLUMNS];
                self.accumulate(turned, count, gates, &mut part.0);
                sums.iter_mut().zip(&part.0).for_each(|(sum, &part)| *sum += part);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Backend;
    use super::*;
    use crate::num::draw::{Place, Site};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn sums_of_many_reads_are_those_of_all_at_once(
            seed in 0u64..1000,
            reads in prop_oneof![1usize..20, 250usize..262, 1000usize..1100],
            rows in 1usize..=64,
            halves in 1usize..=3,
            first in prop_oneof![Just(0usize), Just(4), Just(2048)],
            whole in any::<bool>(),
        ) {
            let stride = (first + reads).next_multiple_of(if whole { 64 } else { 4 });
            let mut codes = vec![0; reads * 64];
            Place::global(seed, Site::InitialLevels, 0).fill(0, &mut codes);
            codes.chunks_exact_mut(64).for_each(|row| row[rows..].fill(0));
            let mut bytes = vec![0; halves * 16 * stride];
            Place::global(seed, Site::InitialLevels, 1).fill(0, &mut bytes);
            // places beyond the last read hold what they hold
            let gates: Vec<i8> = bytes.iter().map(|byte| byte.cast_signed().max(-127)).collect();
            let mut want = vec![[0i32; HALF_CELLS]; halves];
            for (half, want) in want.iter_mut().enumerate() {
                for (at, sum) in want.iter_mut().enumerate() {
                    let (row, column) = (at / 16, at % 16);
                    let at = |b: usize| b / 4 * 64 + column * 4 + b % 4;
                    let gate = |b: usize| gates[half * 16 * stride + at(first + b)];
                    *sum = (0..reads).map(|b| i32::from(codes[b * 64 + row]) * i32::from(gate(b))).sum();
                }
            }
            for backend in Backend::available() {
                let mut sums = vec![[7; HALF_CELLS]; halves];
                let mut scratch = ReadsScratch::default();
                let kernel = Kernel::start(backend);
                let gates = (&gates[..], stride, first);
                kernel.accumulate_reads((&codes, rows), gates, &mut scratch, &mut sums);
                prop_assert_eq!(&sums, &want, "{}", backend.name());
            }
        }
    }
}
