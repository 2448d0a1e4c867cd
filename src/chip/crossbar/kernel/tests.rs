//! Every back end of this machine gives the scalar bits, at every tail and every edge.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use proptest::prelude::*;

use super::*;
use crate::chip::crossbar::layout::{HALF_CELLS, HALF_COLUMNS, in_half};
use crate::num::draw::{BLOCK_BYTES, Place, Site};

mod answers;
mod reads;
mod steps;

/// Bytes from a seed, or only the greatest when the seed says so.
fn bytes(seed: u64, len: usize) -> Vec<u8> {
    let mut bytes = vec![255; len];
    if !seed.is_multiple_of(4) {
        Place::global(seed, Site::InitialLevels, 0).fill(0, &mut bytes);
    }
    bytes
}

fn half<T: Copy>(words: &[T]) -> Half<T> {
    words.try_into().expect("1024 words")
}

fn law() -> Kernel {
    Kernel::start(Backend::Scalar)
}

/// Every back end but the law, started one after the other.
fn others() -> impl Iterator<Item = (&'static str, Kernel)> {
    all().skip(1)
}

fn all() -> impl Iterator<Item = (&'static str, Kernel)> {
    Backend::available().into_iter().map(|backend| (backend.name(), Kernel::start(backend)))
}

fn gates(seed: u64, len: usize) -> Vec<i8> {
    let gates = bytes(seed, len).into_iter().map(|byte| byte.cast_signed().max(-127));
    if seed.is_multiple_of(8) { gates.map(|_| -127).collect() } else { gates.collect() }
}

/// Bytes of which, for some seeds, most are 0.
fn sparse(seed: u64, len: usize) -> Vec<u8> {
    let mut codes = bytes(seed, len);
    if seed % 4 == 1 {
        codes.iter_mut().for_each(|code| *code = code.saturating_sub(240));
    }
    codes
}

fn check_converted(
    blocks: usize,
    tile_blocks: usize,
    batch: usize,
    (live, shift, bits): (usize, u32, u32),
    seed: u64,
) {
    let cells = [0, 1].map(|bank| bytes(seed / 2 + bank, blocks * BLOCK_CELLS));
    let codes = [0, 1].map(|bank| sparse(seed / 4 + bank, blocks * batch * BLOCK_ROWS));
    let banks = Banks {
        cells: cells.each_ref().map(|cells| &cells[..]),
        drives: codes.each_ref().map(|codes| Drives::new(codes, batch)),
        tile_blocks,
        conversion: Conversion { shift, max: (1 << bits) - 1 },
        live,
    };
    let mut scratch = Scratch::new();
    let mut want = vec![3; batch * 32];
    let counted = law().read_converted(&banks, 0..batch, &mut scratch, &mut want);
    for (name, kernel) in others() {
        let mut out = vec![3; batch * 32];
        let counts = kernel.read_converted(&banks, 0..batch, &mut scratch, &mut out);
        assert_eq!(counts, counted, "{name} {blocks} {tile_blocks} {batch} {live} {shift} {bits}");
        assert_eq!(out, want, "{name} {blocks} {tile_blocks} {batch} {live} {shift} {bits}");
    }
}

fn check_look_up(samples: usize, live: usize, bits: u32, shift: u32, seed: u64) {
    let raw = bytes(seed | 1, samples * 32 * 4);
    let sums: Vec<_> = raw.as_chunks().0.iter().map(|word| i32::from_le_bytes(*word)).collect();
    let sums: Vec<_> = sums.iter().map(|sum| sum >> 2 >> (seed % 20)).collect();
    let entries = (0..1u32 << bits).map(|i| i.wrapping_mul(40_503) & 0xffff).collect();
    let table = LookUp { entries, shift };
    let run = |kernel: &Kernel| {
        let (mut values, mut slopes) = (vec![1; samples * 64], vec![2; samples * 64]);
        let at = if live.is_multiple_of(2) { 0 } else { 32 };
        let saturated = kernel.look_up(&sums, &table, live, &mut values[at..], &mut slopes[at..]);
        (values, slopes, saturated)
    };
    let want = run(&law());
    for (name, kernel) in others() {
        assert_eq!(run(&kernel), want, "{name} {samples} {live} {bits} {shift}");
    }
}

fn check_gate(samples: usize, stride: usize, bits: i64, seed: u64) {
    let bits = ErrorBits::new(bits).unwrap();
    let rail = (1i16 << (bits.get() - 1)) - 1;
    let errors: Vec<i16> = bytes(seed, samples * 128)
        .as_chunks()
        .0
        .iter()
        .map(|word| i16::from_le_bytes(*word))
        .map(|error| if seed % 8 == 1 { rail * error.signum() } else { error % (rail + 1) })
        .collect();
    let slopes = bytes(seed / 4, samples * 64);
    for negate in [false, true] {
        let run = |kernel: &Kernel| {
            let mut gates = vec![5; stride * 64];
            let saturated = kernel.gate(&errors, &slopes, negate, bits, stride, &mut gates);
            (gates, saturated)
        };
        let want = run(&law());
        assert_eq!(want.1, 0, "no gate of {bits:?} saturates");
        for (name, kernel) in others() {
            assert_eq!(run(&kernel), want, "{name} {samples} {stride} {bits:?}");
        }
    }
}

fn check_latch(samples: usize, width: usize, units: usize, seed: u64) {
    let raw = bytes(seed | 1, samples * width * 2);
    let words: Vec<_> = raw.as_chunks().0.iter().map(|word| i16::from_le_bytes(*word)).collect();
    let step = if seed.is_multiple_of(2) { 1 } else { 7 };
    let taps: Vec<_> = (0..units).map(|unit| ((unit + 3) * step % width) as u16).collect();
    let mut want = vec![3; samples * 64];
    law().latch(&words, width, &taps, &mut want);
    for (name, kernel) in others() {
        let mut out = vec![5; samples * 64];
        kernel.latch(&words, width, &taps, &mut out);
        assert_eq!(out, want, "{name} {samples} {width} {units}");
    }
}

fn check_turn(samples: usize, stride: usize, seed: u64) {
    let codes = bytes(seed, samples * 64);
    let mut want = vec![1; stride * 64];
    law().turn(&codes, stride, &mut want);
    for (name, kernel) in others() {
        let mut out = vec![2; stride * 64];
        kernel.turn(&codes, stride, &mut out);
        assert_eq!(out, want, "{name} {samples} {stride}");
    }
}

fn check_read_columns(layout: Layout, batch: usize, seed: u64) {
    let plane = bytes(seed, layout.cells_padded());
    let blocks = layout.columns.div_ceil(BLOCK_ROWS);
    let mut codes = bytes(seed / 4, batch * blocks * BLOCK_ROWS);
    for (at, gate) in codes.iter_mut().enumerate() {
        let column = at / (batch * BLOCK_ROWS) * BLOCK_ROWS + at % BLOCK_ROWS;
        *gate = match *gate {
            _ if column >= layout.columns => 0,
            255 => 127,
            128 => 129,
            gate => gate,
        };
    }
    let gates = Drives::new(&codes, batch);
    let mut want = vec![7; batch * layout.rows_padded()];
    law().read_columns(&plane, layout, gates, &mut want);
    for (name, kernel) in others() {
        let mut out = vec![9; want.len()];
        kernel.read_columns(&plane, layout, gates, &mut out);
        assert_eq!(out, want, "{name} {layout:?} {batch}");
    }
}

fn check_accumulate(stride: usize, seed: u64) {
    let (turned, gates) = (bytes(seed, 64 * stride), gates(seed / 4, 16 * stride));
    let mut want = [7; HALF_CELLS];
    law().accumulate(&turned, stride, &gates, &mut want);
    for (name, kernel) in others() {
        let mut sums = [9; HALF_CELLS];
        kernel.accumulate(&turned, stride, &gates, &mut sums);
        assert!(sums == want, "{name} {stride}");
        let place = Place::global(seed, Site::WriteDither, 3);
        let (mut sums, mut words, mut bytes) = ([9; HALF_CELLS], [3; HALF_CELLS], [4; HALF_CELLS]);
        let draws = Draws::new(place, 70 + seed as usize % 200);
        let (turned, prefetch) = ((&turned[..], stride), [0; HALF_CELLS]);
        kernel.accumulate_drawn(
            turned,
            &gates,
            &mut sums,
            (&draws, (16, 1)),
            &mut words,
            &prefetch,
        );
        law().dither(&draws, 16, 1, &mut bytes);
        assert!(sums == want && words == bytes, "{name} {stride} drawn");
    }
}

/// Everything a write may change, and what it counted.
#[derive(Debug, Clone, PartialEq)]
struct State {
    low: Half<u8>,
    high: Half<u8>,
    residual: Half<u16>,
    pruned: Half<u8>,
    pulses: Half<i8>,
    counts: WriteCounts,
}

/// The state after a write. `wide` levels have a high byte; with `absorbs` the floor keeps cells.
fn programmed<'a>(
    kernel: &Kernel,
    mut state: State,
    sums: impl Into<Sums<'a>>,
    write: &WriteLaw,
    dither: Dither<'_>,
    [wide, absorbs]: [bool; 2],
) -> State {
    let cells = Cells {
        answering: None,
        remembered: None,
        low: &mut state.low,
        high: wide.then_some(&mut state.high),
        residual: (write.residual_bits > 0).then_some(&mut state.residual),
        pruned: absorbs.then_some(&mut state.pruned),
        pulses: (write.increment_max % 5 != 0).then_some(Pulsed::Every(&mut state.pulses)),
    };
    state.counts = kernel.program(cells, sums, write, dither);
    state
}

fn check_program(levels: &Half<u8>, sums: &Half<i32>, write: &WriteLaw, seed: u64) {
    let words = bytes(seed, 2 * HALF_CELLS);
    let byte_words = half(&words[..HALF_CELLS]);
    let words: Vec<_> = words.as_chunks().0.iter().map(|word| u16::from_le_bytes(*word)).collect();
    let words = half(&words);
    let mut residual = words;
    residual.reverse();
    residual.iter_mut().for_each(|left| *left &= (1 << write.residual_bits) - 1);
    let high = levels.map(|level| level.rotate_left(3) & 15);
    let gone = |at: usize| (u64::from(words[at / 64]) * 0x8000_4000_2001) >> (at % 64) & 1 == 1;
    let pruned = std::array::from_fn(|at| if gone(at) { Cells::GONE } else { 0 });
    let (pulses, counts) = ([0; HALF_CELLS], WriteCounts::default());
    let fresh = State { low: *levels, high, residual, pruned, pulses, counts };
    for dither in [Dither::Nearest, Dither::Byte(&byte_words), Dither::Word(&words)] {
        for modes in [[false, false], [false, true], [true, false], [true, true]] {
            if modes[0] && write.ceiling == 0 {
                continue;
            }
            let write = if modes[0] { &WriteLaw { ceiling: 4095, ..*write } } else { write };
            let want = programmed(&law(), fresh.clone(), sums, write, dither, modes);
            for (name, kernel) in others() {
                let got = programmed(&kernel, fresh.clone(), sums, write, dither, modes);
                assert_eq!(got.counts, want.counts, "{name} {write:?} {modes:?}");
                assert!(got == want, "{name} {write:?} {modes:?}");
            }
        }
        let bits = match dither {
            Dither::Nearest => 0,
            Dither::Byte(_) => 8,
            Dither::Word(_) => 16,
        };
        let groups = law().may_move(sums, write, bits);
        for (name, kernel) in all() {
            assert_eq!(kernel.may_move(sums, write, bits), groups, "{name} {write:?}");
            if (write.floor, write.ceiling) == (0, 255) {
                // what cannot move may be passed over
                let some = WriteLaw { groups, ..*write };
                for modes in [[false, false], [false, true]] {
                    let want = programmed(&law(), fresh.clone(), sums, write, dither, modes);
                    let got = programmed(&kernel, fresh.clone(), sums, &some, dither, modes);
                    assert!(got == want, "{name} {write:?} {modes:?}");
                }
            }
        }
    }
}

/// The greatest sum of an update.
const GREATEST: i64 = 4096 * 255 * 127;

const PLAIN: WriteLaw = WriteLaw {
    shift: 12,
    mantissa: 1,
    negate: false,
    increment_max: 127,
    groups: u16::MAX,
    floor: 0,
    ceiling: 255,
    residual_bits: 0,
};

#[test]
fn every_tail_of_a_batch_gives_the_same() {
    for batch in (1..=66).chain([128]) {
        check_read_columns(Layout { rows: 65, columns: 33 }, batch, 5);
        check_converted(3, 2, batch, (32, 9, 6), 21);
        check_look_up(batch, 31, 10, 7, 3);
        check_gate(batch, batch.next_multiple_of(4), 8, 9);
        check_turn(batch, batch.next_multiple_of(64), 3);
        check_turn(batch, batch.next_multiple_of(4), 5);
    }
}

#[test]
fn a_kernel_that_ends_leaves_others_of_its_thread_at_work() {
    for backend in Backend::available() {
        let (first, second) = (Kernel::start(backend), Kernel::start(backend));
        let (cells, codes) = (bytes(1, BLOCK_CELLS), bytes(2, 32 * BLOCK_ROWS));
        let read = |kernel: &Kernel| {
            let mut out = vec![0; 32 * 32];
            kernel.read(&cells, Drives::new(&codes, 32), 0..32, &mut out);
            out
        };
        let want = read(&second);
        drop(first);
        assert_eq!(read(&second), want, "{}", backend.name());
    }
}

#[test]
fn the_longest_row_of_full_bytes_does_not_wrap() {
    check_read_columns(Layout { rows: 3, columns: 65_535 }, 1, 0);
    check_read_columns(Layout { rows: 3, columns: 65_535 }, 32, 0);
}

#[test]
fn every_shift_of_a_converter_and_every_width_converts_the_same() {
    for shift in 0..=30 {
        for bits in [1, 2, 7, 8, 12, 14] {
            check_converted(4, 2, 33, (17, shift, bits), 0);
            check_converted(4, 2, 33, (32, shift, bits), 5);
        }
    }
}

#[test]
fn accumulators_at_the_ends_of_32_bits_are_looked_up_alike() {
    for shift in 0..=30 {
        let ends = [i32::MIN, i32::MIN + 1, -1, 0, 1, i32::MAX - 1, i32::MAX, 1 << shift];
        let sums: Vec<_> = ends.iter().copied().cycle().take(64).collect();
        let table = LookUp { entries: (0..1024).collect(), shift };
        let run = |kernel: &Kernel| {
            let (mut values, mut slopes) = (vec![0; 128], vec![0; 128]);
            (kernel.look_up(&sums, &table, 32, &mut values, &mut slopes), values, slopes)
        };
        let want = run(&law());
        others().for_each(|(name, kernel)| assert_eq!(run(&kernel), want, "{name} {shift}"));
    }
}

#[test]
fn every_stride_accumulates_the_same() {
    for stride in (4..=132).step_by(4).chain([1000, 4096]) {
        check_accumulate(stride, 0);
        check_accumulate(stride, 1 + stride as u64);
    }
}

#[test]
fn the_order_of_levels_is_the_order_of_dither() {
    let place = Place::global(7, Site::WriteDither, 3);
    for (_, kernel) in all() {
        let (mut out, mut wide) = ([0; HALF_CELLS], [0; HALF_CELLS]);
        kernel.dither(&Draws::new(place, 70), 16, 1, &mut out);
        kernel.dither_words(&Draws::new(place, 170), 16, 1, &mut wide);
        for column in 0..16 {
            let mut words = [0; BLOCK_BYTES];
            place.bytes(70, 16 + column, 1, &mut words);
            for (row, word) in words.iter().enumerate() {
                assert_eq!(out[in_half(row, column)], *word);
                assert_eq!(wide[in_half(row, column)], place.half(170, 64 + row, 16 + column));
            }
        }
    }
}

#[test]
fn the_last_block_of_random_words_is_drawn_and_the_next_refused() {
    let place = Place::global(7, Site::WriteDither, (1 << 36) - 1);
    for backend in Backend::available() {
        let (mut want, mut out) = ([0; HALF_CELLS], [0; HALF_CELLS]);
        let (column, block) = ((1 << 28) - 16, 0);
        let draws = Draws::new(place, 64);
        law().dither(&draws, column, block, &mut want);
        Kernel::start(backend).dither(&draws, column, block, &mut out);
        assert!(out == want);
        let beyond = || {
            let kernel = Kernel::start(backend);
            kernel.dither(&Draws::new(place, 64), column + 1, block, &mut [0; HALF_CELLS]);
        };
        assert!(std::panic::catch_unwind(beyond).is_err());
    }
}

#[test]
fn a_zero_sum_moves_nothing_whatever_the_word() {
    let levels = half(&bytes(1, HALF_CELLS));
    let (greatest, words) = ([255; HALF_CELLS], [u16::MAX; HALF_CELLS]);
    for (name, kernel) in all() {
        for shift in 0..=31 {
            for negate in [false, true] {
                let write = WriteLaw { shift, negate, ..PLAIN };
                for dither in [Dither::Nearest, Dither::Byte(&greatest), Dither::Word(&words)] {
                    let still = State {
                        low: levels,
                        high: [0; HALF_CELLS],
                        residual: [0; HALF_CELLS],
                        pruned: [0; HALF_CELLS],
                        pulses: [0; HALF_CELLS],
                        counts: WriteCounts::default(),
                    };
                    let sums = [0; HALF_CELLS];
                    let modes = [false, true];
                    let got = programmed(&kernel, still.clone(), &sums, &write, dither, modes);
                    assert!(got == still, "{name} {shift}");
                    assert_eq!(kernel.may_move(&sums, &write, 8), 0);
                }
            }
        }
    }
}

#[test]
fn sums_at_the_edge_of_rounding_to_nothing_are_loud_on_one_side() {
    for (shift, bits) in (0..=31u32).flat_map(|k| [0, 8, 16].map(|bits| (k, bits))) {
        let half = 1i64 << shift.saturating_sub(bits) >> 1;
        let edges = [-half - 1, -half, half - 1, half].map(|edge| edge as i32);
        let sums = std::array::from_fn(|i| if i % 64 == 17 { edges[i / 64 % 4] } else { 0 });
        let write = WriteLaw { shift, ..PLAIN };
        let want = law().may_move(&sums, &write, bits);
        for (name, kernel) in others() {
            assert_eq!(kernel.may_move(&sums, &write, bits), want, "{name} {shift}");
        }
    }
}

#[test]
fn the_edges_of_the_bounds_round_and_count_the_same() {
    // Sums whose pulses lie at and beside every power of two, 127, 128 and the ends of 16 bits.
    for shift in [0, 1, 7, 8, 9, 10, 15, 16, 17, 24, 31] {
        let sums = std::array::from_fn(|i| {
            let (near, by) = (i / 8, i as i64 % 8 - 4);
            let edge = [0, 1, 125, 126, 127, 128, 129, 254, 255, 256, 32767, 32768];
            let at = (edge[near % 12] << shift >> (near / 12 % 2)) + by * (1 << shift >> 2);
            let at = at.clamp(-GREATEST + 4, GREATEST - 4) + by;
            i32::try_from(if near / 24 % 2 == 0 { at } else { -at }).expect("fits")
        });
        for increment_max in [1, 2, 64, 125, 126, 127] {
            for negate in [false, true] {
                let write = WriteLaw { shift, increment_max, negate, ..PLAIN };
                check_program(&half(&bytes(3, HALF_CELLS)), &sums, &write, 3);
                let write = WriteLaw { residual_bits: 1 + shift % 15, ..write };
                check_program(&half(&bytes(1, HALF_CELLS)), &sums, &write, 4);
                check_program(&half(&bytes(2, HALF_CELLS)), &sums, &write, 5);
            }
        }
    }
}

#[test]
fn the_largest_sums_saturate_alike() {
    let greatest = 4096 * 255 * 127;
    let sums =
        std::array::from_fn(|i| if i % 3 == 0 { greatest } else { -greatest + (i % 3) as i32 });
    for shift in 0..=31 {
        for mantissa in [1, 2, 15] {
            for negate in [false, true] {
                for (increment_max, residual_bits) in
                    [(1, 0), (126, 0), (127, 0), (127, 15), (2, 6)]
                {
                    let write =
                        WriteLaw { shift, mantissa, negate, increment_max, residual_bits, ..PLAIN };
                    check_program(&[128; HALF_CELLS], &sums, &write, 1 + u64::from(shift));
                }
            }
        }
    }
}

#[test]
fn a_name_says_whether_it_is_unknown_or_absent() {
    for backend in Backend::available() {
        assert_eq!(Backend::named(backend.name()), Ok(backend));
        assert!(Backend::NAMES.contains(&backend.name()));
    }
    let unknown = Backend::named("fast").unwrap_err().to_string();
    assert_eq!(unknown, "there is no kernel `fast`; say one of scalar, neon, avx2, avx512, amx");
    let elsewhere = if cfg!(target_arch = "aarch64") { "avx2" } else { "neon" };
    let absent = Backend::named(elsewhere).unwrap_err();
    assert!(matches!(absent, UnknownBackend::Absent { name, .. } if name == elsewhere));
    let absent = UnknownBackend::Absent { name: "avx512".into(), there: vec!["scalar", "avx2"] };
    assert_eq!(
        absent.to_string(),
        "this processor cannot run the kernel `avx512`; it has scalar, avx2"
    );
}

fn write() -> impl Strategy<Value = WriteLaw> {
    let window = (0u16..=255, 0u16..=255);
    (0u32..=31, 1i32..=15, any::<bool>(), 1i32..=127, window, 0..4, 0u32..=15).prop_map(
        |(shift, mantissa, negate, increment_max, (a, b), kind, residual_bits)| WriteLaw {
            shift,
            mantissa: if kind < 2 { 1 } else { mantissa },
            negate,
            increment_max,
            groups: u16::MAX,
            floor: if kind == 0 { 0 } else { a.min(b) },
            ceiling: if kind == 0 { 255 } else { a.max(b) },
            residual_bits: if kind % 2 == 0 { 0 } else { residual_bits },
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn transposed_reads_are_the_law(rows in 1usize..200, columns in 1usize..600, batch in 1usize..70, seed: u64) {
        check_read_columns(Layout { rows, columns }, batch, seed);
    }

    #[test]
    fn conversions_are_the_law(
        blocks in 1usize..6, tile_blocks in 1usize..6, batch in 1usize..70,
        live in 1usize..=32, shift in 0u32..=30, bits in 1u32..=12, seed: u64,
    ) {
        check_converted(blocks, tile_blocks, batch, (live, shift, bits), seed);
    }

    #[test]
    fn look_ups_are_the_law(samples in 1usize..70, live in 1usize..=32, bits in 1u32..=14, shift in 0u32..=30, seed: u64) {
        check_look_up(samples, live, bits, shift, seed);
    }

    #[test]
    fn gates_and_turned_drives_are_the_law(samples in 1usize..140, beyond in 0usize..20, bits in 2i64..=9, seed: u64) {
        let stride = samples.next_multiple_of(4) + 4 * beyond;
        check_gate(samples, stride, bits, seed);
        check_turn(samples, stride, seed);
        check_latch(samples, 1 + beyond * 9, 1 + samples % 64, seed);
    }

    #[test]
    fn sums_are_the_law(stride in 1usize..34, seed: u64) {
        check_accumulate(4 * stride, seed);
    }

    #[test]
    fn dither_is_the_law(
        seed: u64, layer: u16, pathway: u8, sub: u32, count in 0u64..1 << 36,
        rows in 1usize..5000, exact: bool, column in 0usize..5000, block in 0usize..80,
    ) {
        // every other array ends where a block of words does
        let rows = if exact { rows.next_multiple_of(32) } else { rows };
        let place = Place { seed, site: Site::WriteDither, layer, pathway, sub, count };
        let (mut want, mut wide) = ([0; HALF_CELLS], [0; HALF_CELLS]);
        let draws = Draws::new(place, rows);
        law().dither(&draws, column, block, &mut want);
        law().dither_words(&draws, column, block, &mut wide);
        for (name, kernel) in others() {
            let (mut out, mut words) = ([1; HALF_CELLS], [0; HALF_CELLS]);
            kernel.dither(&draws, column, block, &mut out);
            kernel.dither_words(&draws, column, block, &mut words);
            prop_assert!(out == want && words == wide, "{}", name);
        }
    }

    #[test]
    fn writes_are_the_law(write in write(), seed: u64, narrow in 0u32..32) {
        let sums: Vec<_> = bytes(seed | 1, 4 * HALF_CELLS)
            .as_chunks()
            .0
            .iter()
            .map(|word| (i32::from_le_bytes(*word) >> narrow) % (4096 * 255 * 127 + 1))
            .collect();
        let levels = half(&bytes(seed / 2, HALF_CELLS));
        check_program(&levels, &half(&sums), &write, seed / 3);
        // Padding: cells on the floor, with a sum of 0, stay and are not counted.
        let mut padded = half(&sums);
        let mut levels = levels;
        for column in 10..HALF_COLUMNS {
            for row in 0..64 {
                padded[row * HALF_COLUMNS + column] = 0;
                levels[in_half(row, column)] = write.floor as u8;
            }
        }
        check_program(&levels, &padded, &write, seed / 5);
    }
}
