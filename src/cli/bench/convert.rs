//! Reads with a converter on every column of every row tile.

use std::hint::black_box;

use aligned_vec::AVec;

use super::read::read_panel;
use super::table::{BenchTable, Cell, Column, shown};
use super::time::{Arm, Time, race};
use super::{BenchPlan, chance, giga, groups, kernels, panels_timed};
use crate::chip::crossbar::Crossbar;
use crate::chip::crossbar::kernel::{
    Backend, Banks, Conversion, Drives, Greatest, Kernel, Scratch,
};
use crate::chip::crossbar::layout::{BLOCK_ROWS, Layout, PANEL_COLUMNS};

const SHAPES: [[usize; 2]; 2] = [[784, 256], [1024, 1024]];
const BATCH: usize = 128;
/// Blocks of 64 rows of a tile.
const TILES: [usize; 3] = [1, 2, 4];
const ADC_BITS: u32 = 8;
/// One-bit slices of a drive.
const PLANES: usize = 8;

const COLUMNS: &[Column] = &[
    shown("rows", "rows", 0),
    shown("columns", "columns", 0),
    shown("kernel", "kernel", 0),
    shown("read", "read", 0),
    shown("tile_rows", "tile rows", 0),
    shown("microseconds_best", "us", 1),
    shown("microseconds_median", "median", 1),
    shown("gmac_per_second_best", "GMAC/s", 1),
    shown("times_ideal", "x ideal", 2),
    shown("times_one_shot", "x one-shot", 2),
];

pub(super) fn measure(plan: &BenchPlan) -> Vec<BenchTable> {
    let title = "convert: both banks of an array, 8-bit converters, batch 128";
    let mut table = BenchTable::new("convert", title, COLUMNS);
    for [rows, columns] in SHAPES {
        measure_one(plan, Layout { rows, columns }, &mut table);
    }
    table.notes.push("ideal: two reads without converters, in the same race".into());
    table
        .notes
        .push("bit-serial: 8 one-bit slices of each drive, each with its own conversions".into());
    if plan.best == Backend::Scalar {
        table.notes.push(super::SCALAR_NOTE.into());
    }
    vec![table]
}

fn measure_one(plan: &BenchPlan, layout: Layout, table: &mut BenchTable) {
    let hardware = chance::hardware(&[]);
    let arrays = [1, 2].map(|number| chance::array(number, layout, &hardware));
    let codes = [3, 4].map(|number| chance::drives(number, layout, BATCH));
    let planes: Vec<[AVec<u8>; 2]> =
        (0..PLANES).map(|plane| codes.each_ref().map(|codes| sliced(codes, plane))).collect();
    let kernels = kernels(&[plan.best]);
    let kernel = &kernels[0].1;
    let panels = panels_timed(plan.best, layout);
    let drives = codes.each_ref().map(|codes| Drives::new(codes, BATCH));

    let mut scratch = Scratch::new();
    let arrays = &arrays;
    let mut arms = vec![Arm::new(move || {
        for panel in 0..panels {
            for (array, drives) in arrays.iter().zip(drives) {
                read_panel(kernel, array, panel, drives, &mut scratch);
            }
        }
    })];
    for tile_blocks in TILES {
        arms.push(converted(kernel, arrays, vec![drives], tile_blocks, 8, panels));
    }
    for tile_blocks in TILES {
        let one_bit = Greatest { level: u8::MAX, code: 1 };
        let planes = planes
            .iter()
            .map(|codes| codes.each_ref().map(|codes| Drives::new(codes, BATCH).within(one_bit)));
        arms.push(converted(kernel, arrays, planes.collect(), tile_blocks, 1, panels));
    }
    let times = race(arms, plan.seconds(4.0));

    let Layout { rows, columns } = layout;
    let products = (2 * rows * BATCH * columns * panels) as f64 / layout.panels() as f64;
    let mut row = |read: &str, tile: Option<usize>, time: Time, one_shot: Option<Time>| {
        table.row(vec![
            rows.into(),
            columns.into(),
            plan.best.name().into(),
            read.into(),
            tile.map_or(Cell::Nothing, |blocks| (blocks * BLOCK_ROWS).into()),
            (1e6 * time.best).into(),
            (1e6 * time.median).into(),
            giga(products, time.best).into(),
            (time.best / times[0].best).into(),
            one_shot.map(|one| time.best / one.best).into(),
        ]);
    };
    row("ideal", None, times[0], None);
    for (tile, time) in TILES.iter().zip(&times[1..]) {
        row("one-shot", Some(*tile), *time, None);
    }
    for (tile, pair) in TILES.iter().zip(times[1..].windows(TILES.len() + 1)) {
        row("bit-serial", Some(*tile), pair[TILES.len()], Some(pair[0]));
    }
}

/// One bit of each code.
fn sliced(codes: &AVec<u8>, plane: usize) -> AVec<u8> {
    let mut sliced = codes.clone();
    sliced.iter_mut().for_each(|code| *code = *code >> plane & 1);
    sliced
}

/// Reads of both banks by converters of full range, once for each slice of the drives.
fn converted<'a>(
    kernel: &'a Kernel,
    arrays: &'a [Crossbar; 2],
    slices: Vec<[Drives<'a>; 2]>,
    tile_blocks: usize,
    drive_bits: u32,
    panels: usize,
) -> Arm<'a> {
    let layout = arrays[0].layout();
    let most = (tile_blocks * BLOCK_ROWS * 255) as u32 * ((1 << drive_bits) - 1);
    let shift = (32 - most.leading_zeros()).saturating_sub(ADC_BITS);
    let mut scratch = Scratch::new();
    let all: Vec<usize> = (0..panels).collect();
    Arm::new(move || {
        // as the engine reads: some samples, the panels of 64 units, or of 256 with many slices, and then the slices
        let units = if slices.len() > 2 { 256 } else { 64 };
        for panels in all.chunks(units / PANEL_COLUMNS) {
            for (group, &panel) in
                groups(BATCH).flat_map(|g| panels.iter().map(move |p| (g.clone(), p)))
            {
                let live = layout.columns.saturating_sub(panel * PANEL_COLUMNS).min(PANEL_COLUMNS);
                for drives in &slices {
                    let banks = Banks {
                        cells: arrays.each_ref().map(|array| array.low(panel, 0..layout.blocks())),
                        drives: *drives,
                        tile_blocks,
                        conversion: Conversion { shift, max: (1 << ADC_BITS) - 1 },
                        live,
                    };
                    let mut codes = [0i16; Scratch::SUMS];
                    let codes = &mut codes[..group.len() * PANEL_COLUMNS];
                    black_box(kernel.read_converted(&banks, group.clone(), &mut scratch, codes));
                    black_box(codes);
                }
            }
        }
    })
}
