//! The greatest sums a plan allows: reached exactly, by every back end. And how many codes a converter that tracks lets
//! lie on its rail, on both sides of that number.

use std::ops::Range;

use dalean::chip::crossbar::kernel::Backend;
use dalean::chip::engine::{Engine, Operation, Side, Write, WritesDone};
use dalean::chip::hardware::{Adc, AdcRange, DitherBits, Hardware, Subtract, Window};
use dalean::chip::layer::{
    CHUNK_BLOCKS, DrivenBy, Homeostasis, InitialLevels, Layer, LayerSpec, Pool, SIDE_MAX, Taps,
};
use dalean::chip::population::Wiring;
use dalean::num::fixed::*;
use dalean::num::tables::Activation;

fn hardware(level_bits: i64, residual_bits: i64) -> Hardware {
    let level_bits = LevelBits::new(level_bits).unwrap();
    Hardware::reference()
        .with(|h| {
            h.cell.level_bits = level_bits;
            h.cell.window = Window::new(0, i64::from(level_bits.level_max()), level_bits).unwrap();
            h.write.increment_max = IncrementMax::new(127).unwrap();
            h.write.dither_bits = DitherBits::Zero;
            h.write.residual_bits = ResidualBits::new(residual_bits).unwrap();
        })
        .unwrap()
}

/// One layer whose units have the derivative 255 everywhere.
fn engine(hardware: Hardware, backend: Backend, inputs: usize, units: usize) -> Engine {
    let spec = LayerSpec {
        inputs,
        units,
        wiring: Wiring::Single,
        driven_by: DrivenBy::Shared,
        activation: Activation::Identity,
        weight_max_log2: 2,
        initial: InitialLevels::Uniform { gain_64ths: [64, 64] },
        constant_row: false,
        convolution: None,
        copies: 1,
        pool: Pool::None,
        homeostasis: Homeostasis::OFF,
    };
    let taps = Taps { width: 1, per_unit: 1, words: vec![0; units], shift: 0 };
    let layer = Layer::new(0, spec, taps, &hardware);
    Engine::new(hardware, backend, 1, vec![layer])
}

/// Puts every cell of an array at its ceiling.
fn fill(engine: &mut Engine, array: usize, rows: Range<usize>) {
    let ceiling = engine.hardware().cell.window.ceiling();
    let levels = vec![ceiling; engine.layers()[0].layout.columns];
    for row in rows {
        engine.execute(&Operation::LoadWeights { layer: 0, array, row, levels: &levels });
    }
}

fn forward(engine: &mut Engine, codes: &[u8]) {
    engine.execute(&Operation::LoadDrives { codes });
    engine.execute(&Operation::Forward { layer: 0, side: Side::Rows });
}

#[test]
fn a_read_reaches_its_bound_and_never_passes_it() {
    // one row below, at and above what one 32-bit sum takes, and the tallest array there is
    let chunk = CHUNK_BLOCKS * 64;
    for (backend, rows, level_bits) in Backend::available().into_iter().flat_map(|b| {
        let tall = [chunk - 1, chunk, chunk + 1, SIDE_MAX].map(|rows| (b, rows, 8));
        tall.into_iter().chain([(b, SIDE_MAX, 12)])
    }) {
        for (array, sign) in [(0, 1), (1, -1)] {
            let mut engine = engine(hardware(level_bits, 0), backend, rows, 1);
            fill(&mut engine, array, 0..rows);
            forward(&mut engine, &vec![255; 2 * rows]);
            let ceiling = i64::from(engine.hardware().cell.window.ceiling());
            let want = sign * rows as i64 * ceiling * 255;
            let got = [0, 1].map(|sample| engine.output_accumulator(sample, 0));
            assert_eq!(got, [want; 2], "{} {rows} {level_bits}", backend.name());
        }
    }
}

#[test]
fn a_transposed_read_reaches_its_bound() {
    for backend in Backend::available() {
        for level_bits in [8, 12] {
            let mut engine = engine(hardware(level_bits, 0), backend, 1, SIDE_MAX);
            fill(&mut engine, 0, 0..1);
            forward(&mut engine, &[0, 0]);
            let words = [127, -127];
            engine.execute(&Operation::Error {
                layer: 0,
                samples: 0..2,
                words: &words,
                shared: false,
            });
            engine.execute(&Operation::Forward { layer: 0, side: Side::Columns });
            let want = SIDE_MAX as i64 * i64::from(engine.hardware().cell.window.ceiling()) * 127;
            assert_eq!(engine.backward(0), [want, -want], "{}", backend.name());
        }
    }
}

#[test]
fn a_write_reaches_its_bound_with_the_greatest_batch_and_mantissa() {
    let batch = Batch::MAX as usize;
    let sum = batch as i64 * 255 * 127 * 15;
    assert!(sum < 1 << 31, "a sum times its mantissa fits 32 bits");
    for backend in Backend::available() {
        for (word, array) in [(127, 0), (-127, 1)] {
            let mut engine = engine(hardware(12, 15), backend, 1, 1);
            engine.set_mantissas(&vec![15; engine.layers().len()]);
            forward(&mut engine, &vec![255; batch]);
            let words = vec![word; batch];
            engine.execute(&Operation::Error {
                layer: 0,
                samples: 0..batch,
                words: &words,
                shared: false,
            });
            for (write, samples, shift) in [(Write::Add, 0..batch, 0), (Write::Program, 0..0, 23)] {
                engine.execute(&Operation::Update { layer: 0, write, samples, shift });
            }
            // a pair moves at k + 1 = 24; 15 bits behind the cell keep what is below a pulse
            let cell = &engine.layers()[0].arrays[array];
            let total = i64::from(cell.level(0, 0)) << 15;
            let total = total + i64::from(cell.residuals().unwrap()[0]);
            assert_eq!(total << 9, sum, "{}", backend.name());
            let other = &engine.layers()[0].arrays[1 - array];
            let left = i64::from(other.residuals().unwrap()[0]);
            assert_eq!((other.level(0, 0), left), (0, 0), "nothing waits below the floor");
        }
    }
}

#[test]
fn one_code_in_64_may_lie_on_the_rail() {
    let bits = AdcBits::new(8).unwrap();
    let tracking = Adc::Finite { bits, subtract: Subtract::Digital, range: AdcRange::Tracking };
    let chip = hardware(8, 0).with(|h| h.adc = tracking).unwrap();
    let grown = |rails: [u64; 2], writes: u32| {
        let mut engine = engine(chip.clone(), Backend::Scalar, 1, 1);
        let before = engine.layers()[0].adc_shifts[0][0];
        engine.layers_mut()[0].rails[0][0] = rails;
        (0..writes).for_each(|_| engine.written(WritesDone::Sample));
        engine.layers()[0].adc_shifts[0][0] - before
    };
    let rails = [[1, 65], [1, 64], [1, 63], [2, 128], [2, 127], [0, 0]];
    assert_eq!(rails.map(|rails| grown(rails, 64)), [0, 0, 1, 0, 1, 0]);
    assert_eq!([63, 64, 65].map(|writes| grown([1, 1], writes)), [0, 1, 1]);
}
