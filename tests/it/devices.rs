//! Devices: every random quantity of cells and pulses against its definition, on 100,000 draws.
//!
//! A fault in any of these shows: a word of 16 bits where 32 are due (cells alike), a sub or a count left out of a place (correlation of
//! quantities, pulses or updates), a sign that hangs on the size of a Gaussian (mean), a deviation in the wrong unit (variance).

use dalean::chip::device::{CellSpread, Device, DeviceSpec, OwnCell, PulseNoise, PulseWords};
use dalean::num::draw::{Place, Site};
use dalean::num::fixed::Millionths;
use dalean::num::tables::{FACTOR_ONE, SpreadLaw};

fn millionths(value: f64) -> Millionths {
    Millionths((value * 1e6).round() as i64)
}

fn chip(bits: u32, ends: [u16; 2], device: &DeviceSpec) -> Device {
    assert_eq!(device.check(), Ok(()));
    Device::new(device, ends, (1 << bits) - 1)
}

/// Mean and variance.
fn moments(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n)
}

/// How far two rows of numbers are from independent, in standard errors.
fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let ((m, v), (n, w)) = (moments(a), moments(b));
    let both: f64 = a.iter().zip(b).map(|(a, b)| (a - m) * (b - n)).sum();
    both / (v * w).sqrt() / (a.len() as f64).sqrt()
}

const CELLS: usize = 100_000;

/// Words of 32 bits of cells of an array of 500 rows.
fn quads(place: Place) -> Vec<u32> {
    let cells = (0..CELLS).map(|cell| (cell % 500, cell / 500));
    cells.map(|(row, column)| place.quads(500, column, row / 16)[row % 16]).collect()
}

fn place(seed: u64) -> Place {
    Place { layer: 3, pathway: 1, ..Place::global(seed, Site::Variation, 0) }
}

#[test]
fn what_sets_cells_apart_has_the_law_it_is_named_by() {
    let spread = CellSpread {
        step: millionths(0.2),
        asymmetry: millionths(0.05),
        ceiling: millionths(0.1),
        floor: millionths(0.02),
        step_law: SpreadLaw::LogNormal,
    };
    let device = chip(12, [600, 2600], &DeviceSpec { spread, ..DeviceSpec::even(100) });
    let of = |seed: u64| {
        let words = [0, 1, 2, 3].map(|sub| quads(Device::place(place(seed), sub)));
        (0..CELLS).map(|at| device.cell([0, 1, 2, 3].map(|sub| words[sub][at]))).collect()
    };
    let cells: Vec<OwnCell> = of(5);
    let one = f64::from(FACTOR_ONE);
    let up = |cell: &OwnCell| f64::from(cell.factors[0]) / one;
    let down = |cell: &OwnCell| f64::from(cell.factors[1]) / one;
    let all = |of: &dyn Fn(&OwnCell) -> f64| -> Vec<f64> { cells.iter().map(of).collect() };
    let step = all(&|cell| ((up(cell) + down(cell)) / 2.0).ln());
    let asymmetry = all(&|cell| (up(cell) - down(cell)) / (up(cell) + down(cell)));
    let ceiling = all(&|cell| (f64::from(cell.ceiling) - 2600.0) / 2000.0);
    let floor = all(&|cell| (f64::from(cell.floor) - 600.0) / 2000.0);
    let four = [(&step, 0.2), (&asymmetry, 0.05), (&ceiling, 0.1), (&floor, 0.02)];
    // a mean of n draws lies within 5 s / sqrt(n), their variance within 5 sqrt(2 / n) of it
    let n = CELLS as f64;
    for (at, (values, deviation)) in four.iter().enumerate() {
        let (mean, variance) = moments(values);
        assert!(mean.abs() < 5.0 * deviation / n.sqrt() + 3e-5, "{at}: {mean}");
        let ratio = variance / (deviation * deviation);
        assert!((ratio - 1.0).abs() < 5.0 * (2.0 / n).sqrt(), "{at}: {ratio}");
        // tails: 2.275 % beyond 2 s on either side, 0.135 % beyond 3 s
        for (beyond, share) in [(2.0, 0.022_75), (3.0, 0.001_35)] {
            for sign in [-1.0, 1.0] {
                let count = values.iter().filter(|v| *v * sign > beyond * deviation).count();
                let error = (share * n).sqrt();
                assert!((count as f64 - share * n).abs() < 5.0 * error, "{at} {beyond}: {count}");
            }
        }
        // neighbours down and across, and the other quantities
        assert!(correlation(&values[1..], &values[..CELLS - 1]).abs() < 5.0);
        assert!(correlation(&values[500..], &values[..CELLS - 500]).abs() < 5.0);
        for (other, _) in &four[at + 1..] {
            assert!(correlation(values, other).abs() < 5.0, "{at}");
        }
    }
    // another seed, another chip
    let other: Vec<f64> = of(6).iter().map(|c| (f64::from(c.ceiling) - 2600.0) / 2000.0).collect();
    assert!(correlation(&ceiling, &other).abs() < 5.0);
    // 40,000 cells are 40,000 devices
    let sets: std::collections::BTreeSet<_> =
        cells[..40_000].iter().map(|c| (c.factors, c.floor, c.ceiling)).collect();
    assert_eq!(sets.len(), 40_000);
}

/// Moves of cells that all lie in the middle, of a pulse of a write.
fn moves(device: &Device, rises: bool, (seed, pulse, count): (u64, u32, u64)) -> Vec<f64> {
    let from = |site| Place { site, sub: pulse, count, ..place(seed) };
    let (rounding, noise) = (from(Site::StepRounding), from(Site::PulseNoise));
    let cell = device.nominal();
    let middle = (cell.floor + cell.ceiling) / 2;
    let one = |at: usize| {
        let (row, column) = (at % 500, at / 500);
        let mut words = [0; 64];
        rounding.bytes(500, column, row / 64, &mut words);
        let noise = noise.half(500, row, column);
        let words = PulseWords { rounding: words[row % 64], noise };
        device.moves(&cell, middle, rises, words) as f64
    };
    (0..CELLS).map(one).collect()
}

#[test]
fn noise_and_rounding_have_their_mean_and_variance_at_every_pulse() {
    let n = CELLS as f64;
    // 200 pulses over 255 levels: 1.2734 a pulse, as 326 / 256
    let mean = 326.0 / 256.0;
    for (noise, deviation) in [
        (PulseNoise::Off, 0.0),
        (PulseNoise::OfStep(millionths(0.6)), 0.6 * mean),
        (PulseNoise::OfWindow(millionths(0.05)), 0.05 * 255.0),
    ] {
        let device = chip(8, [0, 255], &DeviceSpec { noise, ..DeviceSpec::even(200) });
        for rises in [true, false] {
            let sign = if rises { 1.0 } else { -1.0 };
            let draws = [(1, 0, 0), (1, 1, 0), (1, 0, 1), (2, 0, 0)];
            let all = draws.map(|draw| moves(&device, rises, draw));
            for values in &all {
                let (m, v) = moments(values);
                // a rounding with an even word has the mean of what it rounds, and f (1 - f) where nothing else is random,
                // about 1/6 on top of noise that is wide
                let alone = 0.273_4 * (1.0 - 0.273_4);
                let want = deviation * deviation
                    + if deviation == 0.0 {
                        alone
                    } else {
                        (v - deviation * deviation).clamp(0.0, 0.25)
                    };
                assert!((m * sign - mean).abs() < 5.0 * want.sqrt() / n.sqrt() + 1e-3, "{m}");
                assert!((v / want - 1.0).abs() < 5.0 * (2.0 / n).sqrt() + 3e-3, "{v} for {want}");
            }
            for other in &all[1..] {
                assert!(correlation(&all[0], other).abs() < 5.0, "pulses, updates and seeds");
            }
            assert!(correlation(&all[0][1..], &all[0][..CELLS - 1]).abs() < 5.0);
        }
    }
}
