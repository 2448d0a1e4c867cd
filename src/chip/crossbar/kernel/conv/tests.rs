//! A convolution is its unrolled dense twin, on every back end of this machine.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use proptest::prelude::*;

use super::*;
use crate::chip::crossbar::kernel::{Backend, Drives};
use crate::chip::crossbar::layout::Layout;
use crate::num::draw::{Place, Site};

/// Bytes from a seed, or only the greatest when the seed says so.
fn bytes(seed: u64, len: usize) -> Vec<u8> {
    let mut bytes = vec![255; len];
    if !seed.is_multiple_of(4) {
        Place::global(seed, Site::InitialLevels, 0).fill(0, &mut bytes);
    }
    bytes
}

fn gates(seed: u64, len: usize) -> Vec<i8> {
    let gates = bytes(seed, len).into_iter().map(|byte| byte.cast_signed().max(-127));
    if seed.is_multiple_of(8) { gates.map(|_| -127).collect() } else { gates.collect() }
}

fn all() -> impl Iterator<Item = (&'static str, Kernel)> {
    Backend::available().into_iter().map(|backend| (backend.name(), Kernel::start(backend)))
}

/// A network's plain words: pixels without border, channels side by side; levels by row and column; gates by position
/// and column.
#[derive(Debug)]
struct Plain {
    shape: ConvShape,
    samples: usize,
    columns: usize,
    pixels: Vec<u8>,
    levels: Vec<u8>,
    gates: Vec<i8>,
}

impl Plain {
    fn new(shape: ConvShape, samples: usize, columns: usize, seed: u64) -> Self {
        Self {
            shape,
            samples,
            columns,
            pixels: bytes(seed, samples * shape.height * shape.width * shape.channels),
            levels: bytes(seed / 2, shape.rows() * columns),
            gates: gates(seed / 4, samples * shape.positions() * columns),
        }
    }

    fn positions(&self) -> usize {
        self.samples * self.shape.positions()
    }

    /// The drive of a sample's pixel, counted without border; 0 outside.
    fn pixel(&self, sample: usize, [y, x]: [usize; 2], channel: usize) -> u8 {
        let ConvShape { channels, height, width, pad, .. } = self.shape;
        let inside = (pad..pad + height).contains(&y) && (pad..pad + width).contains(&x);
        if !inside {
            return 0;
        }
        let at = (sample * height + y - pad) * width + x - pad;
        self.pixels[at * channels + channel]
    }

    /// Drives as a dense array with one sample a position takes them: `[position][row]`. Loops as one would write them.
    fn unrolled(&self) -> Vec<Vec<u8>> {
        let ConvShape { channels, height, width, side, stride, pad } = self.shape;
        let mut unrolled = Vec::new();
        for sample in 0..self.samples {
            for y in (0..=height + 2 * pad - side).step_by(stride) {
                for x in (0..=width + 2 * pad - side).step_by(stride) {
                    let mut rows = Vec::new();
                    for ky in 0..side {
                        for kx in 0..side {
                            let pixel = |channel| self.pixel(sample, [y + ky, x + kx], channel);
                            rows.extend((0..channels).map(pixel));
                        }
                    }
                    unrolled.push(rows);
                }
            }
        }
        assert_eq!(unrolled.len(), self.positions());
        unrolled
    }

    /// The image as a kernel takes it.
    fn image(&self, plan: &ConvPlan) -> Vec<u8> {
        let mut codes = vec![0; plan.image_bytes()];
        let ConvShape { channels, height, width, pad, .. } = self.shape;
        for sample in 0..self.samples {
            for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y + pad, x + pad))) {
                for channel in 0..channels {
                    codes[plan.index(sample, y, x, channel)] = self.pixel(sample, [y, x], channel);
                }
            }
        }
        codes
    }

    fn layout(&self) -> Layout {
        Layout { rows: self.shape.rows(), columns: self.columns }
    }

    /// The levels as an array holds them.
    fn cells(&self) -> Vec<u8> {
        let layout = self.layout();
        let mut cells = vec![0; layout.cells_padded()];
        for row in 0..layout.rows {
            for column in 0..layout.columns {
                cells[layout.index(row, column)] = self.levels[row * layout.columns + column];
            }
        }
        cells
    }

    /// Gates of 16 columns of some positions: `[place / 4][16][4]`.
    fn packed(
        &self,
        half: usize,
        positions: Range<usize>,
        places: usize,
        place: impl Fn(usize) -> usize,
    ) -> Vec<i8> {
        let mut packed = vec![0; HALF_COLUMNS * places];
        for (at, position) in positions.enumerate() {
            let place = place(at);
            for column in half * HALF_COLUMNS..self.columns.min((half + 1) * HALF_COLUMNS) {
                packed[place / 4 * 64 + column % HALF_COLUMNS * 4 + place % 4] =
                    self.gates[position * self.columns + column];
            }
        }
        packed
    }
}

/// Everything at once: plain loops, the dense array on unrolled drives, and the convolution, on every back end.
fn check(plain: &Plain, pixels: Pixels, seed: u64) {
    let plan = ConvPlan::new(plain.shape, plain.samples, pixels);
    assert_eq!([plan.positions(), plan.shape().rows()], [plain.positions(), plain.shape.rows()]);
    let codes = plain.image(&plan);
    let image = Image::new(&plan, &codes);
    let unrolled = plain.unrolled();
    check_read(plain, image, &unrolled, seed);
    check_sums(plain, image, &unrolled, seed);
}

fn check_read(plain: &Plain, image: Image<'_>, unrolled: &[Vec<u8>], seed: u64) {
    let (layout, positions, columns) = (plain.layout(), plain.positions(), plain.columns);
    let cells = plain.cells();
    // the dense twin takes [block][sample][64]
    let mut drives = vec![0; layout.rows_padded() * positions];
    for (position, rows) in unrolled.iter().enumerate() {
        for (row, &drive) in rows.iter().enumerate() {
            drives[(row / 64 * positions + position) * 64 + row % 64] = drive;
        }
    }
    let drives = Drives::new(&drives, positions);
    let mut want = vec![0i64; positions * layout.columns_padded()];
    for (rows, want) in unrolled.iter().zip(want.chunks_mut(layout.columns_padded())) {
        for (levels, &drive) in plain.levels.chunks(columns).zip(rows) {
            for (want, &level) in want.iter_mut().zip(levels) {
                *want += i64::from(level) * i64::from(drive);
            }
        }
    }
    // some of the positions, and some of the blocks of rows, as a physical tile has them
    let from = seed as usize % positions;
    let some = from..from + 1 + (seed / 64) as usize % (positions - from);
    let first = (seed / 7) as usize % layout.blocks();
    let tile = first..first + 1 + (seed / 512) as usize % (layout.blocks() - first);
    let mut scratch = ConvScratch::default();
    for (name, kernel) in all() {
        for (panel, cells) in cells.chunks(layout.panel_cells()).enumerate() {
            let mut out = vec![7; positions * 32];
            kernel.read_conv(
                cells,
                image,
                0..layout.blocks(),
                0..positions,
                &mut scratch,
                &mut out,
            );
            for (out, want) in out.chunks(32).zip(want.chunks(layout.columns_padded())) {
                let want = &want[panel * 32..][..32];
                assert!(out.iter().map(|&sum| i64::from(sum)).eq(want.iter().copied()), "{name}");
            }
            let mut dense = vec![8; positions * 32];
            kernel.read(cells, drives, 0..positions, &mut dense);
            assert!(out == dense, "{name}: the dense twin");
            let mut part = vec![9; some.len() * 32];
            kernel.read_conv(
                cells,
                image,
                0..layout.blocks(),
                some.clone(),
                &mut scratch,
                &mut part,
            );
            assert!(part == out[some.start * 32..some.end * 32], "{name}: positions {some:?}");
            let cells = &cells[tile.start * BLOCK_CELLS..tile.end * BLOCK_CELLS];
            kernel.read(cells, drives.of_blocks(tile.clone()), 0..positions, &mut dense);
            kernel.read_conv(cells, image, tile.clone(), 0..positions, &mut scratch, &mut out);
            assert!(out == dense, "{name}: blocks {tile:?}");
        }
    }
}

fn check_sums(plain: &Plain, image: Image<'_>, unrolled: &[Vec<u8>], seed: u64) {
    let (layout, columns, each) = (plain.layout(), plain.columns, plain.shape.positions());
    let plan = image.plan();
    // turned in two lots of samples, which add up
    let cut = seed as usize % plain.samples;
    let lots = [0..cut, cut..plain.samples].into_iter().filter(|lot| !lot.is_empty());
    let lots: Vec<_> = lots.collect();
    let mut want = vec![0i64; layout.rows_padded() * layout.columns_padded()];
    for (rows, gates) in unrolled.iter().zip(plain.gates.chunks(columns)) {
        for (&drive, want) in rows.iter().zip(want.chunks_mut(layout.columns_padded())) {
            for (want, &gate) in want.iter_mut().zip(gates) {
                *want += i64::from(drive) * i64::from(gate);
            }
        }
    }
    // the dense twin, [64][stride] by block
    let stride = plain.positions().next_multiple_of(4);
    let mut turned = vec![0; layout.rows_padded() * stride];
    for (position, rows) in unrolled.iter().enumerate() {
        for (row, &drive) in rows.iter().enumerate() {
            turned[row * stride + position] = drive;
        }
    }
    for (name, kernel) in all() {
        let mut drives = ConvTurned::default();
        let halves = 2 * layout.panels();
        let mut sums = vec![[0i64; HALF_CELLS]; layout.blocks() * halves];
        for lot in &lots {
            kernel.turn_conv(image, lot.clone(), &mut drives);
            let positions = lot.start * each..lot.end * each;
            for half in 0..halves {
                let gates = plain
                    .packed(half, positions.clone(), plan.places(lot.len()), |p| plan.place(p));
                for block in 0..layout.blocks() {
                    kernel.accumulate_conv(
                        &drives,
                        block,
                        &gates,
                        &mut sums[block * halves + half],
                    );
                }
            }
        }
        for (at, sums) in sums.iter().enumerate() {
            let (block, half) = (at / halves, at % halves);
            for (row, sums) in sums.chunks(HALF_COLUMNS).enumerate() {
                let at = (block * 64 + row) * layout.columns_padded() + half * HALF_COLUMNS;
                assert!(*sums == want[at..at + HALF_COLUMNS], "{name}: row {row} of {block}");
            }
            let mut dense = [3; HALF_CELLS];
            let gates = plain.packed(half, 0..plain.positions(), stride, |position| position);
            let rows = &turned[block * 64 * stride..][..64 * stride];
            kernel.accumulate(rows, stride, &gates, &mut dense);
            assert!(
                dense.iter().map(|&sum| i64::from(sum)).eq(sums.iter().copied()),
                "{name}: twin"
            );
        }
    }
}

fn shape() -> impl Strategy<Value = ConvShape> {
    let channels = prop_oneof![3 => 1..=130usize, 1 => Just(64), 1 => Just(128)];
    (channels, 1..=12usize, 1..=12usize, 1..=5usize, 1..=2usize, 0..=2usize)
        .prop_map(|(channels, height, width, side, stride, pad)| ConvShape {
            channels,
            height,
            width,
            side,
            stride,
            pad,
        })
        .prop_filter("the kernel fits", |shape| {
            let [height, width] = shape.padded();
            shape.side <= height && shape.side <= width
        })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn a_convolution_is_its_unrolled_dense_twin(
        shape in shape(),
        samples in 1..=5usize,
        columns in 1..=70usize,
        packed: bool,
        seed: u64,
    ) {
        let plain = Plain::new(shape, samples, columns, seed);
        check(&plain, if packed { Pixels::Packed } else { Pixels::Blocks }, seed);
    }

    #[test]
    fn whole_blocks_of_channels_are_read_where_they_lie(
        shape in shape(),
        blocks in 1..=2usize,
        samples in 1..=5usize,
        columns in 1..=40usize,
        seed: u64,
    ) {
        let shape = ConvShape { channels: 64 * blocks, ..shape };
        check(&Plain::new(shape, samples, columns, seed), Pixels::Blocks, seed);
    }
}

#[test]
fn every_width_of_an_image_ends_its_rows_alike() {
    for width in 1..=36 {
        for (stride, pad) in [(1, 1), (2, 1), (1, 0), (3, 2)] {
            let side = if pad == 0 { 1 } else { 3 };
            let shape = ConvShape { channels: 64, height: 3, width, side, stride, pad };
            check(&Plain::new(shape, 2, 3, 4 + width as u64), Pixels::Blocks, width as u64);
        }
    }
}

#[test]
fn the_longest_column_of_full_bytes_does_not_wrap() {
    // 129 * 256 = 33,024 rows of the greatest bytes
    for (channels, side) in [(129 * 64, 2), (129 * 256, 1)] {
        let shape = ConvShape { channels, height: 2, width: 17, side, stride: 1, pad: 0 };
        let plain = Plain::new(shape, 1, 1, 0);
        let plan = ConvPlan::new(shape, 1, Pixels::Blocks);
        let codes = plain.image(&plan);
        check_read(&plain, Image::new(&plan, &codes), &plain.unrolled(), 0);
    }
}

#[test]
fn the_most_positions_of_full_bytes_do_not_wrap() {
    let shape = ConvShape { channels: 1, height: 128, width: 128, side: 1, stride: 1, pad: 0 };
    for channels in [1, 64] {
        let shape = ConvShape { channels, ..shape };
        let plan = ConvPlan::new(shape, 4, Pixels::Blocks);
        let codes = vec![255; plan.image_bytes()];
        let image = Image::new(&plan, &codes);
        let gates = vec![-127; HALF_COLUMNS * plan.places(4)];
        for (name, kernel) in all() {
            let (mut turned, mut sums) = (ConvTurned::default(), [0; HALF_CELLS]);
            kernel.turn_conv(image, 0..4, &mut turned);
            for _ in 0..2 {
                kernel.accumulate_conv(&turned, 0, &gates, &mut sums);
            }
            assert_eq!(sums[..16], [2 * -65_536 * 255 * 127i64; 16], "{name}");
        }
    }
}

#[test]
fn what_does_not_fit_is_refused() {
    let shape = ConvShape { channels: 1, height: 2, width: 4, side: 3, stride: 1, pad: 0 };
    let plan = |shape, samples| {
        std::panic::catch_unwind(move || ConvPlan::new(shape, samples, Pixels::Packed)).is_err()
    };
    assert!(plan(shape, 1) && !plan(ConvShape { height: 3, ..shape }, 1));
    assert!(plan(ConvShape { height: 3, ..shape }, 0));
    assert!(plan(ConvShape { height: 3, stride: 0, ..shape }, 1));
    let wide = ConvShape { channels: 129 * 64 + 16, height: 2, width: 2, side: 2, ..shape };
    let plan = ConvPlan::new(wide, 1, Pixels::Packed);
    let codes = vec![0; plan.image_bytes()];
    let cells = vec![0; plan.blocks() * BLOCK_CELLS];
    let read = || {
        let kernel = Kernel::start(Backend::Scalar);
        let (image, scratch) = (Image::new(&plan, &codes), &mut ConvScratch::default());
        kernel.read_conv(&cells, image, 0..plan.blocks(), 0..1, scratch, &mut [0; 32]);
    };
    assert!(std::panic::catch_unwind(read).is_err(), "517 blocks of rows may not fit 32 bits");
}
