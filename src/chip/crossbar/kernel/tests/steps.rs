//! The steps of a write, of sums of 64 bits and of pulses alone.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::*;

/// The greatest wide sum.
const GREATEST_WIDE: i64 = 1 << 58;

/// A state from a seed, in the window of the write.
fn fresh(write: &WriteLaw, seed: u64) -> State {
    let words = bytes(seed | 1, 2 * HALF_CELLS);
    let words =
        half(&words.as_chunks().0.iter().map(|w| u16::from_le_bytes(*w)).collect::<Vec<_>>());
    let level = |at: usize| (words[at] % 4096).clamp(write.floor, write.ceiling);
    State {
        low: std::array::from_fn(|at| (level(at) & 0xff) as u8),
        high: std::array::from_fn(|at| (level(at) >> 8) as u8),
        residual: words.map(|word| word.rotate_left(5) & ((1 << write.residual_bits) - 1)),
        pruned: words.map(|word| if word % 7 == 0 { Cells::GONE } else { 0 }),
        pulses: [0; HALF_CELLS],
        counts: WriteCounts::default(),
    }
}

/// Programs wide sums by the law and by all others, and gives what the law made of it.
fn check_wide(sums: &Half<i64>, write: &WriteLaw, modes: [bool; 2], seed: u64) -> Vec<State> {
    let fresh = fresh(write, seed);
    let words = bytes((seed / 3) | 1, 2 * HALF_CELLS);
    let byte_words = half(&words[..HALF_CELLS]);
    let words: Vec<_> = words.as_chunks().0.iter().map(|word| u16::from_le_bytes(*word)).collect();
    let words = half(&words);
    let kinds = [(Dither::Nearest, 0), (Dither::Byte(&byte_words), 8), (Dither::Word(&words), 16)];
    let all = kinds.map(|(dither, bits)| {
        let want = programmed(&law(), fresh.clone(), sums, write, dither, modes);
        let groups = law().may_move(sums, write, bits);
        for (name, kernel) in others() {
            assert_eq!(kernel.may_move(sums, write, bits), groups, "{name} {write:?}");
            for groups in [u16::MAX, groups] {
                let some = WriteLaw { groups, ..*write };
                let got = programmed(&kernel, fresh.clone(), sums, &some, dither, modes);
                assert_eq!(got.counts, want.counts, "{name} {write:?} {modes:?}");
                assert!(got == want, "{name} {write:?} {modes:?}");
            }
        }
        want
    });
    all.into()
}

/// A window that levels of the modes fit.
fn within(write: WriteLaw, wide: bool) -> WriteLaw {
    WriteLaw { ceiling: if wide { 4095 } else { write.ceiling.min(255) }, ..write }
}

#[test]
fn the_largest_wide_sums_saturate_alike() {
    let sums = std::array::from_fn(|i| {
        if i % 3 == 0 { GREATEST_WIDE } else { (i % 3) as i64 - GREATEST_WIDE }
    });
    for shift in 0..=31 {
        for (mantissa, residual_bits) in [(1, 0), (15, 0), (15, 15), (2, 6)] {
            for negate in [false, true] {
                let write = WriteLaw { shift, mantissa, negate, residual_bits, ..PLAIN };
                check_wide(&sums, &write, [false, false], u64::from(shift));
            }
        }
    }
}

#[test]
fn squares_of_sums_are_the_law() {
    for (seed, wide) in (0..40).flat_map(|seed| [(seed, false), (seed, true)]) {
        let raw = bytes(seed, HALF_CELLS * 4);
        let most = 4096 * 255 * 127 * if wide { 16 } else { 1 };
        let sums: Vec<i32> =
            raw.as_chunks().0.iter().map(|word| i32::from_le_bytes(*word)).collect();
        let sums: Vec<i32> =
            sums.iter().map(|&sum| (sum >> (seed % 20)).clamp(-most, most)).collect();
        let sums = half(&sums);
        let want = law().squares(&sums, wide);
        for (name, kernel) in others() {
            assert_eq!(kernel.squares(&sums, wide), want, "{name} {seed} {wide}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn wide_sums_are_written_as_the_law(write in write(), modes: [bool; 2], seed: u64, narrow in 0u32..62) {
        let raw = bytes(seed | 1, 8 * HALF_CELLS);
        let sums = raw.as_chunks().0.iter().map(|word| i64::from_le_bytes(*word) >> narrow);
        let sums: Vec<_> = sums.map(|sum| sum.clamp(-GREATEST_WIDE, GREATEST_WIDE)).collect();
        check_wide(&half(&sums), &within(write, modes[0]), modes, seed / 5);
    }

    #[test]
    fn sums_that_fit_32_bits_are_written_alike_at_either_width(write in write(), modes: [bool; 2], seed: u64, narrow in 0u32..32) {
        let raw = bytes(seed | 1, 4 * HALF_CELLS);
        let sums = raw.as_chunks().0.iter().map(|word| i32::from_le_bytes(*word) >> narrow);
        let sums: Vec<_> = sums.map(|sum| sum % (4096 * 255 * 127 + 1)).collect();
        let (sums, write) = (half(&sums), within(write, modes[0]));
        let wide = check_wide(&sums.map(i64::from), &write, modes, seed / 5);
        let fresh = fresh(&write, seed / 5);
        let got = programmed(&law(), fresh, &sums, &write, Dither::Nearest, modes);
        prop_assert!(got == wide[0]);
    }

    #[test]
    fn pulses_reach_levels_as_the_law(write in write(), wide: bool, absorbs: bool, groups: u16, seed: u64) {
        let write = within(write, wide);
        let pulses = half(&gates(seed, HALF_CELLS));
        let fresh = fresh(&write, seed / 7);
        let run = |kernel: &Kernel| {
            let mut state = fresh.clone();
            let cells = Cells {
                answering: None,
                remembered: None,
                low: &mut state.low,
                high: wide.then_some(&mut state.high),
                residual: (write.residual_bits > 0).then_some(&mut state.residual),
                pruned: absorbs.then_some(&mut state.pruned),
                pulses: None,
            };
            state.counts.effective = kernel.levels(cells, &pulses, write.ends(), groups);
            state
        };
        let want = run(&law());
        for (name, kernel) in others() {
            prop_assert!(run(&kernel) == want, "{} {:?}", name, write);
        }
        // what a window is for
        for (low, high) in want.low.iter().zip(want.high) {
            let level = u16::from(*low) | if wide { u16::from(high) << 8 } else { 0 };
            prop_assert!((write.floor..=write.ceiling).contains(&level));
        }
    }
}
