//! Reads of whole arrays, without converters.

use std::hint::black_box;

use ndarray::Array2;
use ndarray::linalg::general_mat_mul;

use super::table::{BenchTable, Cell, Column, shown};
use super::time::{Arm, race};
use super::{BenchPlan, chance, giga, groups, kernels, panels_timed, peak};
use crate::chip::crossbar::Crossbar;
use crate::chip::crossbar::kernel::{Drives, Kernel, Scratch};
use crate::chip::crossbar::layout::{Layout, PANEL_COLUMNS};

const SHAPES: [[usize; 2]; 3] = [[256, 256], [784, 256], [1024, 1024]];
const BATCHES: [usize; 5] = [128, 64, 16, 4, 1];

const COLUMNS: &[Column] = &[
    shown("rows", "rows", 0),
    shown("columns", "columns", 0),
    shown("batch", "batch", 0),
    shown("kernel", "kernel", 0),
    shown("gmac_per_second_best", "GMAC/s", 1),
    shown("gmac_per_second_median", "median", 1),
    shown("peak_percent", "% of peak", 1),
    shown("times_scalar", "x scalar", 1),
    shown("times_float", "x f32", 1),
];

pub(super) fn measure(plan: &BenchPlan) -> Vec<BenchTable> {
    let hardware = chance::hardware(&[]);
    let title = "read: all panels of an array, ideal converters";
    let mut table = BenchTable::new("read", title, COLUMNS);
    for [rows, columns] in SHAPES {
        let array = chance::array(1, Layout { rows, columns }, &hardware);
        for batch in BATCHES {
            measure_one(plan, &array, batch, &mut table);
        }
    }
    table.notes.push("peak: the kernel's own, in registers, in the same race".into());
    table.notes.push("f32: matrix product of the same shape by ndarray (matrixmultiply)".into());
    table.notes.push(super::SCALAR_NOTE.into());
    vec![table]
}

fn measure_one(plan: &BenchPlan, array: &Crossbar, batch: usize, table: &mut BenchTable) {
    let layout = array.layout();
    let Layout { rows, columns } = layout;
    let kernels = kernels(&plan.backends);
    let codes = chance::drives(2, layout, batch);
    let drives = Drives::new(&codes, batch);
    let products = (rows * columns * batch) as f64;

    let a = Array2::from_shape_fn((batch, rows), |(b, r)| f32::from(codes[(b + r) % codes.len()]));
    let b = Array2::from_shape_fn((rows, columns), |(r, c)| f32::from(array.level(r, c)));
    let mut c = Array2::zeros((batch, columns));
    let mut arms = vec![Arm::new(move || {
        general_mat_mul(1.0f32, &a, &b, 0.0, &mut c);
        black_box(&c);
    })];
    for (backend, kernel) in &kernels {
        let panels = panels_timed(*backend, layout);
        let mut scratch = Scratch::new();
        arms.push(Arm::new(move || {
            for panel in 0..panels {
                read_panel(kernel, array, panel, drives, &mut scratch);
            }
        }));
        arms.push(peak::arm(kernel));
    }
    let times = race(arms, plan.seconds(1.2));
    let float = giga(products, times[0].best);
    let mut scalar = None;
    for ((backend, kernel), times) in kernels.iter().zip(times[1..].as_chunks::<2>().0) {
        let products = products * panels_timed(*backend, layout) as f64 / layout.panels() as f64;
        let rate = giga(products, times[0].best);
        let most = giga(peak::products(kernel), times[1].best);
        let reference = *scalar.get_or_insert(rate);
        table.row(vec![
            rows.into(),
            columns.into(),
            batch.into(),
            backend.name().into(),
            rate.into(),
            giga(products, times[0].median).into(),
            if most > 0.0 { (100.0 * rate / most).into() } else { Cell::Nothing },
            (rate / reference).into(),
            (rate / float).into(),
        ]);
    }
    table.row(vec![
        rows.into(),
        columns.into(),
        batch.into(),
        "f32".into(),
        float.into(),
        giga(products, times[0].median).into(),
        Cell::Nothing,
        scalar.map(|scalar| float / scalar).into(),
        1.0.into(),
    ]);
}

/// Reads a panel as the engine does, some samples at a time.
pub(super) fn read_panel(
    kernel: &Kernel,
    array: &Crossbar,
    panel: usize,
    drives: Drives<'_>,
    scratch: &mut Scratch,
) {
    let cells = array.low(panel, 0..drives.blocks());
    for group in groups(drives.samples()) {
        let out = &mut scratch.currents[0][..group.len() * PANEL_COLUMNS];
        kernel.read(cells, drives, group, out);
        black_box(out);
    }
}
