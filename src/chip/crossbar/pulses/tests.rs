//! Peaks and pulses of whole writes: every back end, shape, cut and mode gives those of the law.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use proptest::prelude::*;

use super::*;
use crate::chip::crossbar::kernel::{Backend, WriteLaw};
use crate::chip::crossbar::layout::PANEL_COLUMNS;
use crate::chip::crossbar::{Crossbar, Met, WriteRequest, Written};
use crate::chip::hardware::{DitherBits, DitherPattern, FloorKind, Hardware, Window};
use crate::num::draw::{Place, Site};
use crate::num::fixed::{IncrementMax, LevelBits, ResidualBits};

/// What is written, and how.
#[derive(Debug, Clone, Copy)]
struct Case {
    layout: Layout,
    samples: usize,
    /// Panels of a strip.
    strip: usize,
    level_bits: i64,
    residual_bits: i64,
    absorbs: bool,
    increment_max: i64,
    dither: (DitherBits, DitherPattern),
    shift: u32,
    mantissa: i32,
    negate: bool,
    seed: u64,
}

fn bytes(seed: u64, len: usize) -> Vec<u8> {
    let mut bytes = vec![0; len];
    Place::global(seed, Site::InitialLevels, 0).fill(0, &mut bytes);
    bytes
}

fn hardware(case: &Case) -> Hardware {
    let level_bits = LevelBits::new(case.level_bits).unwrap();
    Hardware::reference()
        .with(|h| {
            h.cell.level_bits = level_bits;
            h.cell.window = Window::new(1, level_bits.level_max().into(), level_bits).unwrap();
            h.cell.floor_kind =
                if case.absorbs { FloorKind::Absorbing } else { FloorKind::Recoverable };
            h.tile.rows = 64;
            h.tile.columns = 64;
            h.tile.transposed_read = false;
            h.write.increment_max = IncrementMax::new(case.increment_max).unwrap();
            h.write.dither_bits = case.dither.0;
            h.write.dither_pattern = case.dither.1;
            h.write.residual_bits = ResidualBits::new(case.residual_bits).unwrap();
        })
        .unwrap()
}

/// Writes a fresh array, strip by strip. Gates and drives are sparse for some seeds, beyond the array always 0.
fn written(backend: Backend, case: &Case, collect: Collect) -> (Crossbar, Vec<Written>) {
    let (hardware, layout) = (hardware(case), case.layout);
    let stride = case.samples.next_multiple_of(4);
    let mut codes = bytes(case.seed, layout.rows_padded() * stride);
    for (at, code) in codes.iter_mut().enumerate() {
        let (row, sample) = (at / stride, at % stride);
        let quiet = case.seed.is_multiple_of(3) && row / 4 % 3 != 0;
        if row >= layout.rows || sample >= case.samples || quiet {
            *code = 0;
        }
    }
    let gates: Vec<i8> = bytes(case.seed + 1, layout.columns_padded() * stride)
        .into_iter()
        .enumerate()
        .map(|(at, gate)| {
            let column = at / (HALF_COLUMNS * stride) * HALF_COLUMNS + at % 64 / 4;
            let live = column < layout.columns && !(case.seed % 4 == 1 && column % 5 < 3);
            if live { gate.cast_signed().max(-127) } else { 0 }
        })
        .collect();
    let blocks = codes.chunks_exact(BLOCK_ROWS * stride);
    let turned: Vec<_> =
        blocks.map(|block| block.iter().any(|&x| x != 0).then_some(block)).collect();
    let mut array = Crossbar::new(layout, &hardware);
    for row in 0..layout.rows {
        let levels = bytes(case.seed + 2 + row as u64, 2 * layout.columns);
        let window = hardware.cell.window.floor()..=hardware.cell.window.ceiling();
        let words = levels.as_chunks::<2>().0.iter().map(|word| u16::from_le_bytes(*word));
        let row_levels: Vec<_> =
            words.map(|word| (word % *window.end()).max(*window.start())).collect();
        array.load_row(row, &row_levels);
    }
    let request = WriteRequest {
        met: Met::Turned(&turned),
        stride,
        write: WriteLaw {
            shift: case.shift,
            mantissa: case.mantissa,
            negate: case.negate,
            increment_max: i32::try_from(case.increment_max).unwrap(),
            groups: u16::MAX,
            floor: hardware.cell.window.floor(),
            ceiling: hardware.cell.window.ceiling(),
            residual_bits: hardware.write.residual_bits.get(),
        },
        dither_bits: case.dither.0,
        dither_pattern: case.dither.1,
        place: Place::global(case.seed, Site::WriteDither, 0),
        collect,
    };
    let kernel = Kernel::start(backend);
    let written = array
        .strips_mut(case.strip)
        .map(|mut strip| {
            let panels = strip.panels();
            let of = panels.start * PANEL_COLUMNS * stride..panels.end * PANEL_COLUMNS * stride;
            strip.write(&kernel, &request, &gates[of])
        })
        .collect();
    (array, written)
}

/// Every pulse of an array, `[row][column]`, from its strips.
fn every_pulse(case: &Case, written: &[Written]) -> Vec<i8> {
    let columns = case.layout.columns;
    let mut all = vec![0; case.layout.cells()];
    for (strip, written) in written.iter().enumerate() {
        let Collected::Pulses(part) = &written.collected else { panic!("pulses were asked for") };
        let first = strip * case.strip * PANEL_COLUMNS;
        let width = part.len() / case.layout.rows;
        for (to, from) in all.chunks_exact_mut(columns).zip(part.chunks_exact(width)) {
            to[first..first + width].copy_from_slice(from);
        }
        let given: u64 = part.iter().map(|pulses| u64::from(pulses.unsigned_abs())).sum();
        assert_eq!(given, written.counts.attempted, "every pulse is counted");
    }
    all
}

/// Peaks of every tile by their definition.
fn peaks_of(case: &Case, pulses: &[i8], tile_columns: usize) -> Vec<RowPeaks> {
    let Layout { rows, columns } = case.layout;
    let mut tiles: Vec<_> =
        (0..columns.div_ceil(tile_columns)).map(|tile| RowPeaks::new(tile, rows)).collect();
    for (at, &pulses) in pulses.iter().enumerate() {
        let peak = &mut tiles[at % columns / tile_columns].rows[at / columns];
        let peak = &mut peak[usize::from(pulses < 0)];
        *peak = (*peak).max(pulses.unsigned_abs());
    }
    tiles
}

fn check(case: &Case) {
    let (silent, counted) = written(Backend::Scalar, case, Collect::Nothing);
    assert!(counted.iter().all(|written| written.collected == Collected::Nothing));
    let (array, law) = written(Backend::Scalar, case, Collect::Pulses);
    assert!(array == silent, "telling changes nothing");
    let pulses = every_pulse(case, &law);
    for backend in Backend::available() {
        let (array, got) = written(backend, case, Collect::Pulses);
        assert!(array == silent, "{} {case:?}", backend.name());
        assert!(got == law, "{} {case:?}", backend.name());
        for tile_columns in [1, 7, 16, 17, 40, 128, 256] {
            let (array, got) = written(backend, case, Collect::Peaks { tile_columns });
            assert!(array == silent, "{} {case:?}", backend.name());
            let mut all: Vec<_> = (0..case.layout.columns.div_ceil(tile_columns))
                .map(|tile| RowPeaks::new(tile, case.layout.rows))
                .collect();
            for (written, law) in got.iter().zip(&law) {
                assert_eq!(written.counts, law.counts, "{} {case:?}", backend.name());
                let Collected::Peaks(part) = &written.collected else { panic!("peaks") };
                assert!(part.is_sorted_by_key(|part| part.tile));
                part.iter().for_each(|part| all[part.tile].merge(part));
            }
            let want = peaks_of(case, &pulses, tile_columns);
            assert!(all == want, "{} {tile_columns} {case:?}", backend.name());
        }
    }
}

fn case() -> impl Strategy<Value = Case> {
    let layout = (1usize..150, 1usize..300).prop_map(|(rows, columns)| Layout { rows, columns });
    let cell = (prop_oneof![Just(8), Just(12), 2i64..=8], prop_oneof![Just(0), 1i64..=8]);
    let bits =
        prop_oneof![Just(DitherBits::Zero), Just(DitherBits::Eight), Just(DitherBits::Sixteen)];
    let dither = (
        bits,
        any::<bool>().prop_map(|separable| {
            if separable { DitherPattern::Separable } else { DitherPattern::PerCell }
        }),
    );
    let rate = (8u32..22, prop_oneof![Just(1), 1i32..=15], any::<bool>(), any::<bool>());
    let bound = prop_oneof![Just(7), 1i64..=127];
    (layout, 1usize..70, 1usize..5, cell, dither, rate, bound, 0u64..1 << 40).prop_map(
        |(layout, samples, strip, (level_bits, residual_bits), dither, rate, bound, seed)| Case {
            layout,
            samples,
            strip,
            level_bits,
            residual_bits,
            absorbs: rate.3,
            increment_max: bound,
            dither,
            shift: rate.0,
            mantissa: rate.1,
            negate: rate.2,
            seed,
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn pulses_and_peaks_are_the_law(case in case()) {
        check(&case);
    }

    #[test]
    fn one_sample_is_written_as_the_law(case in case(), usual: bool) {
        let plain = Case { samples: 1, residual_bits: 0, absorbs: false, mantissa: 1, ..case };
        let dither = (DitherBits::Eight, DitherPattern::PerCell);
        let plain = Case { dither, level_bits: case.level_bits.min(8), ..plain };
        for shift in 8..=24 {
            let case = if usual { Case { shift, increment_max: 7, ..plain } } else { Case { shift, ..plain } };
            for collect in [Collect::Nothing, Collect::Peaks { tile_columns: 256 }, Collect::Peaks { tile_columns: 40 }] {
                let law = written(Backend::Scalar, &case, collect);
                for backend in Backend::available() {
                    let got = written(backend, &case, collect);
                    prop_assert!(got == law, "{} {:?} {:?}", backend.name(), collect, case);
                }
            }
        }
    }

    #[test]
    fn peaks_of_rows_are_the_law(dense: bool, seed: u64) {
        let mut extremes = Extremes::new();
        for part in 0..2 {
            let given = bytes(seed.wrapping_add(part), HALF_CELLS).into_iter();
            let given = given.map(|byte| byte.cast_signed().max(-127));
            // most are 0, and peaks are rare
            let given: Vec<_> = given.map(|p| if dense || p % 16 == 0 { p } else { 0 }).collect();
            extremes.take(0, &given);
        }
        let want = Kernel::start(Backend::Scalar).peaks(&extremes);
        for backend in Backend::available() {
            let got = Kernel::start(backend).peaks(&extremes);
            prop_assert!(got == want, "{}", backend.name());
        }
    }
}

#[test]
fn a_usual_write_of_whole_tiles_has_the_peaks_of_the_law() {
    for (rows, columns, samples) in [(784, 256, 128), (256, 10, 1), (65, 129, 5)] {
        for seed in [3, 5, 6] {
            check(&Case {
                layout: Layout { rows, columns },
                samples,
                strip: Crossbar::STRIP_PANELS,
                level_bits: 8,
                residual_bits: 0,
                absorbs: false,
                increment_max: 7,
                dither: (DitherBits::Eight, DitherPattern::PerCell),
                shift: 14,
                mantissa: 1,
                negate: seed == 5,
                seed,
            });
        }
    }
}
