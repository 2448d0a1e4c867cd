//! What each back end's instruction reaches in registers.

use std::hint::black_box;

use super::table::{BenchTable, Column, shown};
use super::time::{Arm, race};
use super::{BenchPlan, giga, kernels};
use crate::chip::crossbar::kernel::Kernel;

/// Rounds of a run.
const ROUNDS: usize = 10_000;

const COLUMNS: &[Column] = &[
    shown("kernel", "kernel", 0),
    shown("instruction", "instruction", 0),
    shown("gmac_per_second_best", "GMAC/s", 0),
    shown("gmac_per_second_median", "median", 0),
];

/// Products of a run of [`arm`]; 0 where a back end has no such measure.
pub(super) fn products(kernel: &Kernel) -> f64 {
    ROUNDS as f64 * kernel.peak(1) as f64
}

/// The peak as an arm of a race.
pub(super) fn arm(kernel: &Kernel) -> Arm<'_> {
    Arm::new(|| {
        black_box(kernel.peak(ROUNDS));
    })
}

pub(super) fn measure(plan: &BenchPlan) -> Vec<BenchTable> {
    let kernels = kernels(&plan.backends);
    let able: Vec<_> = kernels.iter().filter(|(_, kernel)| products(kernel) > 0.0).collect();
    if able.is_empty() {
        return Vec::new();
    }
    let times = race(able.iter().map(|(_, kernel)| arm(kernel)).collect(), plan.seconds(3.0));
    let mut table =
        BenchTable::new("peak", "peak: products in registers, random operands", COLUMNS);
    for ((backend, kernel), time) in able.into_iter().zip(times) {
        let instruction = match backend.name() {
            "amx" => "tdpbuud",
            "avx512" => "vpdpbusd zmm",
            "avx2" => "vpmaddwd + vpaddd ymm",
            _ => "-",
        };
        let products = products(kernel);
        table.row(vec![
            backend.name().into(),
            instruction.into(),
            giga(products, time.best).into(),
            giga(products, time.median).into(),
        ]);
    }
    vec![table]
}
