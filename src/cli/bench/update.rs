//! Writes: outer-product sums alone, and with all that follows them.

use std::hint::black_box;

use super::table::{BenchTable, Column, shown};
use super::time::{Arm, race};
use super::{BenchPlan, chance, kernels, panels_timed};
use crate::chip::crossbar::kernel::{Backend, Half, Kernel, WriteLaw};
use crate::chip::crossbar::layout::{BLOCK_ROWS, HALF_CELLS, HALF_COLUMNS, Layout, PANEL_COLUMNS};
use crate::chip::crossbar::{Collect, Crossbar, Met, WriteRequest};
use crate::chip::hardware::Hardware;
use crate::num::draw::{Place, Site};

const SHAPES: [[usize; 2]; 2] = [[1024, 1024], [784, 256]];
/// Samples of a write; a multiple of 64, so that none is padding.
const BATCH: usize = 128;
/// A pulse for about every other cell: sums of random products have a deviation near 2^17.
const SHIFT: u32 = 17;

/// Writes by name, with the settings of their chip.
const WRITES: [(&str, &[&str]); 7] = [
    ("write, no dither", &["hw.write.dither_bits=0"]),
    ("write, 8-bit dither", &["hw.write.dither_bits=8"]),
    ("write, 8-bit separable dither", &["hw.write.dither_bits=8", "hw.write.dither=separable"]),
    ("write, 16-bit dither", &["hw.write.dither_bits=16"]),
    ("write, 8-bit dither, 8-bit remainder", &["hw.write.residual_bits=8"]),
    ("write, 8-bit dither, 12-bit levels", &["hw.cell.level_bits=12"]),
    ("write, 8-bit dither, absorbing floor", &["hw.cell.floor_kind=absorbing"]),
];

const COLUMNS: &[Column] = &[
    shown("rows", "rows", 0),
    shown("columns", "columns", 0),
    shown("kernel", "kernel", 0),
    shown("update", "update", 0),
    shown("microseconds_best", "us", 1),
    shown("microseconds_median", "median", 1),
    shown("nanoseconds_per_64_cells", "ns / 64 cells", 2),
    shown("times_accumulate", "x accumulate", 2),
];

pub(super) fn measure(plan: &BenchPlan) -> Vec<BenchTable> {
    let title = "update: an array, batch 128, dense random drives and gates";
    let mut table = BenchTable::new("update", title, COLUMNS);
    for [rows, columns] in SHAPES {
        measure_one(plan, Layout { rows, columns }, &mut table);
    }
    if plan.best == Backend::Scalar {
        table.notes.push(super::SCALAR_NOTE.into());
    }
    vec![table]
}

fn measure_one(plan: &BenchPlan, layout: Layout, table: &mut BenchTable) {
    let kernels = kernels(&[plan.best]);
    let kernel = &kernels[0].1;
    let panels = panels_timed(plan.best, layout);
    let turned = chance::bytes(1, layout.blocks() * BLOCK_ROWS * BATCH);
    let blocks: Vec<_> = turned.chunks_exact(BLOCK_ROWS * BATCH).map(Some).collect();
    let gates = chance::gates(2, layout.columns_padded() * BATCH);

    let mut arms = vec![accumulated(kernel, &blocks, &gates, panels)];
    for (_, settings) in WRITES {
        let hardware = chance::hardware(settings);
        arms.push(written(kernel, layout, &hardware, &blocks, &gates, panels));
    }
    let times = race(arms, plan.seconds(5.0));
    let Layout { rows, columns } = layout;
    let cells = (rows * columns * panels) as f64 / layout.panels() as f64;
    let names = ["accumulate"].into_iter().chain(WRITES.map(|(name, _)| name));
    for (name, time) in names.zip(&times) {
        table.row(vec![
            rows.into(),
            columns.into(),
            plan.best.name().into(),
            name.into(),
            (1e6 * time.best).into(),
            (1e6 * time.median).into(),
            (64e9 * time.best / cells).into(),
            (time.best / times[0].best).into(),
        ]);
    }
}

/// Sums of every half block.
fn accumulated<'a>(
    kernel: &'a Kernel,
    blocks: &'a [Option<&'a [u8]>],
    gates: &'a [i8],
    panels: usize,
) -> Arm<'a> {
    /// Where matrix tiles are stored fastest.
    #[repr(align(64))]
    struct Sums(Half<i32>);
    let mut sums = Sums([0; HALF_CELLS]);
    Arm::new(move || {
        let strip = PANEL_COLUMNS * BATCH * Crossbar::STRIP_PANELS.min(panels);
        for gates in gates.chunks_exact(strip).take(panels.div_ceil(Crossbar::STRIP_PANELS)) {
            for turned in blocks.iter().flatten() {
                for gates in gates.chunks_exact(HALF_COLUMNS * BATCH) {
                    kernel.accumulate(turned, BATCH, gates, &mut sums.0);
                    black_box(&sums.0);
                }
            }
        }
    })
}

/// Whole writes of an array of its own. Every other one is negated, so that levels wander and do not all end at an edge.
fn written<'a>(
    kernel: &'a Kernel,
    layout: Layout,
    hardware: &Hardware,
    blocks: &'a [Option<&'a [u8]>],
    gates: &'a [i8],
    panels: usize,
) -> Arm<'a> {
    let mut array = chance::array(3, layout, hardware);
    let mut request = WriteRequest {
        met: Met::Turned(blocks),
        stride: BATCH,
        write: WriteLaw {
            shift: SHIFT,
            mantissa: 1,
            negate: false,
            increment_max: i32::try_from(hardware.write.increment_max.get()).expect("1..=127"),
            groups: u16::MAX,
            floor: hardware.cell.window.floor(),
            ceiling: hardware.cell.window.ceiling(),
            residual_bits: hardware.write.residual_bits.get(),
        },
        dither_bits: hardware.write.dither_bits,
        dither_pattern: hardware.write.dither_pattern,
        place: Place::global(4, Site::WriteDither, 0),
        collect: Collect::Nothing,
    };
    Arm::new(move || {
        request.place.count += 1;
        request.write.negate = !request.write.negate;
        let strip = Crossbar::STRIP_PANELS.min(panels);
        let gates = gates.chunks_exact(strip * PANEL_COLUMNS * BATCH);
        let strips = array.strips_mut(strip).zip(gates);
        for (mut strip, gates) in strips.take(panels.div_ceil(Crossbar::STRIP_PANELS)) {
            black_box(strip.write(kernel, &request, gates));
        }
    })
}
