//! Convolutions: reads of a batch of images, sums of an update, and updates of whole networks.

use std::hint::black_box;

use super::net::Net;
use super::table::{BenchTable, Cell, Column, shown};
use super::time::{Arm, race};
use super::{BenchPlan, chance, giga, kernels, peak};
use crate::chip::crossbar::Crossbar;
use crate::chip::crossbar::kernel::{
    Backend, ConvPlan, ConvScratch, ConvShape, ConvTurned, Half, Image, Kernel, Pixels,
};
use crate::chip::crossbar::layout::{HALF_CELLS, HALF_COLUMNS, Layout, PANEL_COLUMNS};

/// Channels in and out, and rows and columns of pixels.
const SHAPES: [[usize; 3]; 4] = [[64, 64, 32], [64, 128, 32], [128, 256, 32], [128, 256, 8]];
const BATCH: usize = 8;
/// Images of an update of a whole network.
const STEP_BATCH: usize = 32;
/// Positions whose sums are used before the next are read.
const POSITIONS: usize = 128;

const COLUMNS: &[Column] = &[
    shown("channels", "channels", 0),
    shown("columns", "columns", 0),
    shown("pixels", "pixels", 0),
    shown("kernel", "kernel", 0),
    shown("operation", "operation", 0),
    shown("gmac_per_second_best", "GMAC/s", 1),
    shown("gmac_per_second_median", "median", 1),
    shown("peak_percent", "% of peak", 1),
];

pub(super) fn measure(plan: &BenchPlan) -> Vec<BenchTable> {
    let title =
        "conv: 3x3, stride 1, pad 1, batch 8; all panels, ideal converters; sums of an update";
    let mut table = BenchTable::new("conv", title, COLUMNS);
    for [channels, columns, pixels] in SHAPES {
        let shape =
            ConvShape { channels, height: pixels, width: pixels, side: 3, stride: 1, pad: 1 };
        for &backend in plan.backends.iter().filter(|&&backend| backend != Backend::Scalar) {
            measure_one(plan, backend, shape, columns, &mut table);
        }
    }
    table
        .notes
        .push("pixels: rows, and columns, of an image; sums are of all its positions".into());
    table.notes.push("peak: the kernel's own, in registers, in the same race".into());
    vec![table, steps(plan)]
}

/// Networks of convolutions and what they are made of: that of the paper's size, and that of `examples/cifar10_conv.toml`.
const NETS: [(&str, [&str; 6]); 2] = [
    (
        "3-64-128-256, 1800",
        [
            "network.channels=[64,128,256]",
            "network.hidden=[1800]",
            "network.input='raw'",
            "learning.rate=0.1",
            "learning.decay=constant",
            "learning.batch=32",
        ],
    ),
    (
        "6-60-40, 160",
        [
            "network.channels=[60,40]",
            "network.hidden=[160]",
            "network.input='white'",
            "learning.rate=0.1",
            "learning.decay=constant",
            "learning.batch=32",
        ],
    ),
];
/// Updates of a run.
const STEPS: usize = 2;

const STEP_COLUMNS: &[Column] = &[
    shown("net", "net", 0),
    shown("kernel", "kernel", 0),
    shown("batch", "batch", 0),
    shown("milliseconds_best", "ms/step", 2),
    shown("milliseconds_median", "median", 2),
    shown("milliseconds_image", "ms/image", 3),
    shown("gmac_per_second_best", "GMAC/s", 1),
    shown("peak_percent", "% of peak", 1),
];

/// Whole updates of networks with convolutions, beside the peak.
fn steps(plan: &BenchPlan) -> BenchTable {
    let title = "conv step: one update of a whole network of convolutions, 32 x 32 pixels, its epoch loop with it";
    let mut table = BenchTable::new("conv_step", title, STEP_COLUMNS);
    for (name, settings) in NETS {
        let settings: Vec<String> =
            std::iter::once("data.set=cifar10").chain(settings).map(String::from).collect();
        for &backend in plan.backends.iter().filter(|&&backend| backend != Backend::Scalar) {
            let kernels = kernels(&[backend]);
            let kernel = &kernels[0].1;
            let pictures = chance::pictures(STEPS * STEP_BATCH);
            let mut net = Net::of_images(&settings, [32, 32, 3], backend, &pictures);
            let products = net.products();
            let times = race(vec![Arm::new(|| net.epoch()), peak::arm(kernel)], plan.seconds(4.0));
            let [best, median] = [times[0].best, times[0].median].map(|t| t / STEPS as f64);
            let most = giga(peak::products(kernel), times[1].best);
            let rate = giga(products, best);
            table.row(vec![
                name.into(),
                backend.name().into(),
                STEP_BATCH.into(),
                (1e3 * best).into(),
                (1e3 * median).into(),
                (1e3 * best / STEP_BATCH as f64).into(),
                rate.into(),
                if most > 0.0 { (100.0 * rate / most).into() } else { Cell::Nothing },
            ]);
        }
    }
    table.notes.push(
        "pixels of chance; products: cells x positions x images, of each array read and written"
            .into(),
    );
    table
}

fn measure_one(
    plan: &BenchPlan,
    backend: Backend,
    shape: ConvShape,
    columns: usize,
    table: &mut BenchTable,
) {
    let kernels = kernels(&[backend]);
    let kernel = &kernels[0].1;
    let conv = ConvPlan::new(shape, BATCH, Pixels::Blocks);
    // a border of chance is as fast as one of zeros
    let codes = chance::bytes(1, conv.image_bytes());
    let image = Image::new(&conv, &codes);
    let layout = Layout { rows: shape.rows(), columns };
    let array = chance::array(2, layout, &chance::hardware(&[]));
    let gates = chance::gates(3, layout.columns_padded() * conv.places(BATCH));
    let products = (conv.positions() * layout.cells()) as f64;
    let arms = vec![read(kernel, image, &array), sums(kernel, image, &gates), peak::arm(kernel)];
    let times = race(arms, plan.seconds(1.2));
    let most = giga(peak::products(kernel), times[2].best);
    for (operation, times) in ["read", "accumulate"].iter().zip(&times) {
        let rate = giga(products, times.best);
        table.row(vec![
            shape.channels.into(),
            columns.into(),
            shape.width.into(),
            backend.name().into(),
            (*operation).into(),
            rate.into(),
            giga(products, times.median).into(),
            if most > 0.0 { (100.0 * rate / most).into() } else { Cell::Nothing },
        ]);
    }
}

/// Reads every panel, some positions at a time.
fn read<'a>(kernel: &'a Kernel, image: Image<'a>, array: &'a Crossbar) -> Arm<'a> {
    let positions = image.plan().positions();
    let mut scratch = ConvScratch::default();
    let mut out = aligned_vec::avec![0; POSITIONS * PANEL_COLUMNS];
    let Layout { columns, .. } = array.layout();
    let blocks = 0..image.plan().blocks();
    Arm::new(move || {
        for panel in 0..columns.div_ceil(PANEL_COLUMNS) {
            let cells = array.low(panel, blocks.clone());
            for start in (0..positions).step_by(POSITIONS) {
                let group = start..(start + POSITIONS).min(positions);
                let out = &mut out[..group.len() * PANEL_COLUMNS];
                kernel.read_conv(cells, image, blocks.clone(), group, &mut scratch, out);
                black_box(out);
            }
        }
    })
}

/// Turns the drives and adds up the sums of every half block.
fn sums<'a>(kernel: &'a Kernel, image: Image<'a>, gates: &'a [i8]) -> Arm<'a> {
    let mut turned = ConvTurned::default();
    let half = HALF_COLUMNS * image.plan().places(BATCH);
    let mut sums: Vec<Half<i64>> =
        vec![[0; HALF_CELLS]; image.plan().blocks() * (gates.len() / half)];
    Arm::new(move || {
        kernel.turn_conv(image, 0..BATCH, &mut turned);
        let mut sums = sums.iter_mut();
        for block in 0..image.plan().blocks() {
            for gates in gates.chunks_exact(half) {
                let sums = sums.next().expect("one a half block");
                kernel.accumulate_conv(&turned, block, gates, sums);
            }
        }
        black_box(&sums);
    })
}
