//! Every back end of this machine gives the scalar bits, at every tail and every edge.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use proptest::prelude::*;

use super::*;
use crate::chip::crossbar::layout::{HALF_COLUMNS, in_half};
use crate::num::draw::{BLOCK_BYTES, Site};

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

fn others() -> impl Iterator<Item = Backend> {
    Backend::available().into_iter().skip(1)
}

fn gates(seed: u64, len: usize) -> Vec<i8> {
    let gates = bytes(seed, len).into_iter().map(|byte| byte.cast_signed().max(-127));
    if seed.is_multiple_of(8) { gates.map(|_| -127).collect() } else { gates.collect() }
}

fn check_read(blocks: usize, range: Range<usize>, batch: usize, seed: u64) {
    let (stride, plane) = (blocks * 64, bytes(seed, blocks * BLOCK_CELLS));
    let drives = bytes(seed / 4, batch * stride);
    let mut law = vec![7; batch * 32];
    Backend::Scalar.read(&plane, range.clone(), &drives, stride, &mut law);
    for backend in others() {
        let mut out = vec![9; batch * 32];
        backend.read(&plane, range.clone(), &drives, stride, &mut out);
        assert_eq!(out, law, "{} {blocks} {range:?} {batch}", backend.name());
    }
}

fn check_read_columns(layout: Layout, batch: usize, seed: u64) {
    let plane = bytes(seed, layout.cells_padded());
    let mut gates = bytes(seed / 4, batch * layout.columns_padded());
    gates.iter_mut().for_each(|gate| *gate &= 127);
    let mut law = vec![7; batch * layout.rows_padded()];
    Backend::Scalar.read_columns(&plane, layout, &gates, &mut law);
    for backend in others() {
        let mut out = vec![9; law.len()];
        backend.read_columns(&plane, layout, &gates, &mut out);
        assert_eq!(out, law, "{} {layout:?} {batch}", backend.name());
    }
}

fn check_accumulate(stride: usize, seed: u64) {
    let (drives, gates) = (bytes(seed, 64 * stride), gates(seed / 4, 16 * stride));
    let mut law = [7; HALF_CELLS];
    Backend::Scalar.accumulate(&drives, stride, &gates, &mut law);
    for backend in others() {
        let mut sums = [9; HALF_CELLS];
        backend.accumulate(&drives, stride, &gates, &mut sums);
        assert!(sums == law, "{} {stride}", backend.name());
    }
}

/// Levels and remainders after a write, under one back end.
fn programmed(
    backend: Backend,
    levels: &Half<u8>,
    residual: &Half<u16>,
    sums: &Half<i32>,
    write: &Write,
    dither: Dither<'_>,
) -> (Half<u8>, Half<u16>, WriteCounts) {
    let (mut low, mut left) = (*levels, *residual);
    let residual = (write.residual_bits > 0).then_some(&mut left);
    let cells = Cells { low: &mut low, high: None, residual, pruned: None };
    let counts = backend.program(cells, sums, write, dither);
    (low, left, counts)
}

fn check_program(levels: &Half<u8>, sums: &Half<i32>, write: &Write, seed: u64) {
    let words = bytes(seed, 2 * HALF_CELLS);
    let byte_words = half(&words[..HALF_CELLS]);
    let words: Vec<_> = words.as_chunks().0.iter().map(|word| u16::from_le_bytes(*word)).collect();
    let words = half(&words);
    let mut residual = words;
    residual.reverse();
    residual.iter_mut().for_each(|left| *left &= (1 << write.residual_bits) - 1);
    for dither in [Dither::Nearest, Dither::Byte(&byte_words), Dither::Word(&words)] {
        let law = programmed(Backend::Scalar, levels, &residual, sums, write, dither);
        for backend in others() {
            let got = programmed(backend, levels, &residual, sums, write, dither);
            assert_eq!(got.2, law.2, "{} {write:?}", backend.name());
            assert!(got == law, "{} {write:?}", backend.name());
        }
    }
}

/// The greatest sum of an update.
const GREATEST: i64 = 4096 * 255 * 127;

const PLAIN: Write = Write {
    shift: 12,
    mantissa: 1,
    negate: false,
    increment_max: 127,
    floor: 0,
    ceiling: 255,
    residual_bits: 0,
};

#[test]
fn every_tail_of_a_batch_reads_the_same() {
    for batch in (0..=40).chain([128]) {
        check_read(3, 0..3, batch, 4 + batch as u64);
        check_read(2, 1..2, batch, 17);
        check_read_columns(Layout { rows: 65, columns: 33 }, batch, 5);
    }
    check_read(2, 1..1, 3, 1);
    check_read(2, 2..2, 3, 1);
}

#[test]
fn the_longest_column_of_full_bytes_does_not_wrap() {
    for batch in [1, 5] {
        check_read(516, 0..516, batch, 0);
    }
    check_read_columns(Layout { rows: 3, columns: 33_000 }, 1, 0);
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
    for backend in Backend::available() {
        let mut out = [0; HALF_CELLS];
        backend.dither(&place, 70, 16, 1, &mut out);
        for column in 0..16 {
            let mut words = [0; BLOCK_BYTES];
            place.bytes(70, 16 + column, 1, &mut words);
            for (row, word) in words.iter().enumerate() {
                assert_eq!(out[in_half(row, column)], *word);
            }
        }
    }
}

#[test]
fn the_last_block_of_random_words_is_drawn_and_the_next_refused() {
    let place = Place::global(7, Site::WriteDither, (1 << 36) - 1);
    for backend in Backend::available() {
        let (mut law, mut out) = ([0; HALF_CELLS], [0; HALF_CELLS]);
        let (column, block) = ((1 << 28) - 16, 0);
        Backend::Scalar.dither(&place, 64, column, block, &mut law);
        backend.dither(&place, 64, column, block, &mut out);
        assert!(out == law);
        let beyond = || backend.dither(&place, 64, column + 1, block, &mut [0; HALF_CELLS]);
        assert!(std::panic::catch_unwind(beyond).is_err());
    }
}

#[test]
fn a_zero_sum_moves_nothing_whatever_the_word() {
    let levels = half(&bytes(1, HALF_CELLS));
    let (greatest, words) = ([255; HALF_CELLS], [u16::MAX; HALF_CELLS]);
    for backend in Backend::available() {
        for shift in 0..=31 {
            for negate in [false, true] {
                let write = Write { shift, negate, ..PLAIN };
                for dither in [Dither::Nearest, Dither::Byte(&greatest), Dither::Word(&words)] {
                    let (none, sums) = ([0; HALF_CELLS], [0; HALF_CELLS]);
                    let got = programmed(backend, &levels, &none, &sums, &write, dither);
                    let still = (levels, none, WriteCounts::default());
                    assert!(got == still, "{} {shift}", backend.name());
                }
            }
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
                let write = Write { shift, increment_max, negate, ..PLAIN };
                check_program(&half(&bytes(3, HALF_CELLS)), &sums, &write, 3);
                let write = Write { residual_bits: 1 + shift % 15, ..write };
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
                        Write { shift, mantissa, negate, increment_max, residual_bits, ..PLAIN };
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
        assert!(NAMES.contains(&backend.name()));
    }
    let unknown = Backend::named("neon").unwrap_err().to_string();
    assert_eq!(unknown, "there is no kernel `neon`; say one of scalar, avx2, avx512");
    let absent = UnknownBackend::Absent { name: "avx512".into(), there: vec!["scalar", "avx2"] };
    assert_eq!(
        absent.to_string(),
        "this processor cannot run the kernel `avx512`; it has scalar, avx2"
    );
}

fn write() -> impl Strategy<Value = Write> {
    let window = (0u16..=255, 0u16..=255);
    (0u32..=31, 1i32..=15, any::<bool>(), 1i32..=127, window, 0..4, 0u32..=15).prop_map(
        |(shift, mantissa, negate, increment_max, (a, b), kind, residual_bits)| Write {
            shift,
            mantissa: if kind < 2 { 1 } else { mantissa },
            negate,
            increment_max,
            floor: if kind == 0 { 0 } else { a.min(b) },
            ceiling: if kind == 0 { 255 } else { a.max(b) },
            residual_bits: if kind % 2 == 0 { 0 } else { residual_bits },
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn reads_are_the_law(blocks in 1usize..6, a in 0usize..6, b in 0usize..6, batch in 0usize..40, seed: u64) {
        let (a, b) = (a.min(blocks), b.min(blocks));
        check_read(blocks, a.min(b)..a.max(b), batch, seed);
    }

    #[test]
    fn transposed_reads_are_the_law(rows in 1usize..200, columns in 1usize..600, batch in 0usize..16, seed: u64) {
        check_read_columns(Layout { rows, columns }, batch, seed);
    }

    #[test]
    fn sums_are_the_law(stride in 1usize..34, seed: u64) {
        check_accumulate(4 * stride, seed);
    }

    #[test]
    fn dither_is_the_law(
        seed: u64, layer: u16, pathway: u8, sub: u32, count in 0u64..1 << 36,
        rows in 1usize..5000, column in 0usize..5000, block in 0usize..80,
    ) {
        let place = Place { seed, site: Site::WriteDither, layer, pathway, sub, count };
        let mut law = [0; HALF_CELLS];
        Backend::Scalar.dither(&place, rows, column, block, &mut law);
        for backend in others() {
            let mut out = [1; HALF_CELLS];
            backend.dither(&place, rows, column, block, &mut out);
            prop_assert!(out == law, "{}", backend.name());
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
