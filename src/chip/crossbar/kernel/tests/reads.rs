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

/// Where neighbours' products with one size of levels, or gates, stop fitting 16 bits.
fn edges() -> impl Iterator<Item = (u8, [u8; 2])> {
    [1u8, 2, 63, 64, 65, 100, 126, 127, 128, 255].into_iter().flat_map(|size| {
        let fits = (32_767 / u32::from(size)).min(510);
        [fits - 1, fits, (fits + 1).min(510)].map(|pair| {
            let one = pair.min(255) as u8;
            (size, [one, (pair - u32::from(one)) as u8])
        })
    })
}

#[test]
fn pairs_at_the_edge_of_16_bits_read_the_same() {
    for (size, pair) in edges() {
        for (batch, dark) in [(9, 0), (4, 8), (4, 16), (1, 0)] {
            let mut cells = vec![size; 2 * BLOCK_CELLS];
            for (half, cells) in cells.chunks_exact_mut(HALF_CELLS).enumerate() {
                // the columns from one on are dark, in both halves or in the second
                let dark = if half % 2 == 0 && dark == 16 { 0 } else { dark };
                for quad in cells.chunks_exact_mut(64) {
                    quad[64 - 4 * dark..].fill(0);
                }
            }
            let codes = pair.repeat(batch * BLOCK_ROWS);
            let drives = Drives::new(&codes, batch);
            let mut want = vec![7; batch * 32];
            law().read(&cells, drives, 0..batch, &mut want);
            for (name, kernel) in others() {
                let mut out = vec![9; want.len()];
                kernel.read(&cells, drives, 0..batch, &mut out);
                assert_eq!(out, want, "{name} {size} {pair:?} {batch} {dark}");
            }
        }
    }
}

#[test]
fn pairs_at_the_edge_of_16_bits_are_summed_the_same() {
    for (size, pair) in edges().filter(|&(size, _)| size <= 127) {
        for sign in [-1, 1] {
            let (turned, stride) = (pair.repeat(64 * 132 / 2), 132);
            let mut gates = vec![sign * size.cast_signed(); 16 * stride];
            // the second half of the columns is dark
            if sign < 0 {
                gates.chunks_exact_mut(64).for_each(|quad| quad[32..].fill(0));
            }
            let (mut want, mut sums) = ([7; HALF_CELLS], [9; HALF_CELLS]);
            law().accumulate(&turned, stride, &gates, &mut want);
            for (name, kernel) in others() {
                kernel.accumulate(&turned, stride, &gates, &mut sums);
                assert!(sums == want, "{name} {size} {pair:?}");
            }
        }
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
        // levels and codes that stay small although nobody said so
        let [level, code] = bits.map(|bits| u8::MAX >> (8 - bits));
        let cells: Vec<_> = bytes(seed, blocks * BLOCK_CELLS).iter().map(|cell| cell & level).collect();
        let codes: Vec<_> = sparse(seed / 4, blocks * batch * BLOCK_ROWS).iter().map(|x| x & code).collect();
        let drives = Drives::new(&codes, batch);
        let mut want = vec![7; batch * 32];
        law().read(&cells, drives, 0..batch, &mut want);
        for (name, kernel) in others() {
            let mut out = vec![9; want.len()];
            kernel.read(&cells, drives, 0..batch, &mut out);
            prop_assert_eq!(&out, &want, "{}", name);
        }
    }
}
