//! Reads, of levels and drives of any number of bits.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::*;

/// Checks a read of levels and codes that have so many bits.
fn check(blocks: usize, batch: usize, samples: Range<usize>, bits: [u32; 2], seed: u64) {
    let [level, code] = bits.map(|bits| u8::MAX >> (8 - bits));
    let mut cells = bytes(seed, blocks * BLOCK_CELLS);
    let mut codes = sparse(seed / 4, blocks * batch * BLOCK_ROWS);
    cells.iter_mut().for_each(|cell| *cell &= level);
    codes.iter_mut().for_each(|drive| *drive &= code);
    let drives = Drives::new(&codes, batch).within(Greatest { level, code });
    let mut want = vec![7; samples.len() * 32];
    law().read(&cells, drives, samples.clone(), &mut want);
    for (name, kernel) in others() {
        let mut out = vec![9; want.len()];
        kernel.read(&cells, drives, samples.clone(), &mut out);
        assert_eq!(out, want, "{name} {blocks} {batch} {samples:?} {bits:?}");
    }
}

#[test]
fn every_tail_of_a_batch_reads_the_same() {
    for batch in (1..=66).chain([128]) {
        for bits in [[8, 8], [8, 1], [3, 8]] {
            check(3, batch, 0..batch, bits, 4 + batch as u64);
            check(1, batch, batch / 3..batch, bits, 5);
        }
    }
    check(2, 3, 1..1, [8, 8], 1);
}

#[test]
fn the_longest_column_does_not_wrap() {
    // the greatest levels and codes of every number of bits
    for bits in (1..=8).flat_map(|level| (1..=8).map(move |code| [level, code])) {
        check(9, 5, 0..5, bits, 0);
    }
    for batch in [1, 5, 16, 32] {
        check(512, batch, 0..batch, [8, 8], 0);
        check(512, batch, 0..batch, [1, 8], 0);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn reads_are_the_law(
        blocks in 1usize..6, batch in 1usize..70, ends in [0usize..70, 0usize..70], bits in [1u32..=8, 1u32..=8], seed: u64,
    ) {
        let [a, b] = ends.map(|end| end.min(batch));
        check(blocks, batch, a.min(b)..a.max(b), bits, seed);
    }
}
