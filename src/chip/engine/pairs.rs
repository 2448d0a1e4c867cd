//! A target of more than two banks: read, written and timed like any other.

use super::tick::Network;
use super::{Engine, Operation, Phase, Recorded, Side, Write};
use crate::chip::crossbar::kernel::Backend;
use crate::chip::hardware::timing::{PulseCode, Timing};
use crate::chip::hardware::{Adc, AdcRange, Hardware, Subtract};
use crate::chip::layer::{
    Delivery, DrivenBy, Homeostasis, InitialLevels, Layer, LayerSpec, Pool, Taps,
};
use crate::chip::population::{Stream, Wiring};
use crate::num::fixed::AdcBits;
use crate::num::tables::Activation;

const INPUTS: usize = 70;
const UNITS: usize = 40;
const SAMPLES: usize = 3;

fn number(at: usize) -> usize {
    (at.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) & 0xffff
}

fn level(layer: usize, array: usize, row: usize, column: usize) -> u16 {
    (number(((layer * 8 + array) * 100 + row) * 100 + column) % 256) as u16
}

/// Two layers of differential pairs in both streams.
fn engine(adc: Adc, backend: Backend) -> Engine {
    let timing = Timing {
        clock_khz: 1,
        beat: 1,
        settle: 3,
        convert: 2,
        share: 4,
        overlapped: true,
        lanes: 8,
        hops: 1,
        pulse: 2,
        pulse_code: PulseCode::Unary,
        verify: false,
        active_max: None,
        slices: None,
    };
    let chip = Hardware::reference().with(|h| {
        (h.tile.rows, h.tile.columns) = (64, 32);
        h.drive.dac_bits = 3;
        h.adc = adc;
        h.timing = Some(timing);
    });
    let chip = chip.unwrap();
    let spec = |inputs, driven_by| LayerSpec {
        inputs,
        units: UNITS,
        wiring: Wiring::DualPairs,
        driven_by,
        activation: Activation::Identity,
        weight_max_log2: 2,
        initial: InitialLevels::Uniform { gain_64ths: [64, 64] },
        constant_row: false,
        convolution: None,
        copies: 1,
        pool: Pool::None,
        homeostasis: Homeostasis::OFF,
    };
    let words = (0..UNITS).map(|unit| (unit % 5) as u16).collect();
    let taps = Taps { width: 5, per_unit: 1, words, shift: 0 };
    let layers = vec![
        Layer::new(0, spec(INPUTS, DrivenBy::Shared), taps, &chip),
        Layer::new(1, spec(UNITS, DrivenBy::Streams), Delivery::output(UNITS), &chip),
    ];
    Engine::new(chip, backend, 1, layers)
}

#[test]
fn what_all_pairs_read_adds_up_and_tick_agrees() {
    let bits = AdcBits::new(9).unwrap();
    let finite = |subtract| Adc::Finite { bits, subtract, range: AdcRange::Shift(3) };
    for adc in [Adc::Ideal, finite(Subtract::Digital), finite(Subtract::Current)] {
        for backend in Backend::available() {
            let mut engine = engine(adc, backend);
            let mut tick = {
                for layer in 0..2 {
                    for array in 0..8 {
                        for row in 0..engine.layers()[layer].layout.rows {
                            let levels: Vec<u16> =
                                (0..UNITS).map(|column| level(layer, array, row, column)).collect();
                            let load =
                                Operation::LoadWeights { layer, array, row, levels: &levels };
                            engine.execute(&load);
                        }
                    }
                }
                let chip = engine.hardware().clone();
                Network::new(&chip, 1, engine.layers(), SAMPLES)
            };
            engine.set_phase(Phase::Evaluation);
            tick.set_phase(Phase::Evaluation);
            let codes: Vec<u8> = (0..SAMPLES * INPUTS).map(|at| number(at) as u8).collect();
            let words: Vec<i16> =
                (0..SAMPLES * UNITS).map(|at| (number(at) % 255) as i16 - 127).collect();
            let update =
                |layer, write, samples| Operation::Update { layer, write, samples, shift: 9 };
            let error = |layer, words| Operation::Error {
                layer,
                samples: 0..SAMPLES,
                words,
                shared: false,
            };
            let operations = [
                Operation::LoadDrives { codes: &codes },
                Operation::Forward { layer: 0, side: Side::Rows },
                Operation::Forward { layer: 1, side: Side::Rows },
                error(0, &words[..SAMPLES * 5]),
                error(1, &words),
                update(0, Write::Add, 0..SAMPLES),
                update(1, Write::Add, 0..SAMPLES),
                update(0, Write::Program, 0..0),
                update(1, Write::Program, 0..0),
            ];
            operations.iter().for_each(|operation| engine.execute(operation));
            engine.settle();
            tick.run(&operations);
            let phase = Phase::Evaluation;
            assert_eq!(engine.ledger(phase), tick.ledger(phase), "{adc:?} {}", backend.name());
            for (layer, of) in engine.layers().iter().enumerate() {
                for (array, cells) in of.arrays.iter().enumerate() {
                    assert!(cells.levels().eq(tick.levels(layer, array)), "{layer} {array}");
                }
            }
            for stream in [Stream::P, Stream::N] {
                for (sample, unit) in (0..SAMPLES).flat_map(|s| (0..UNITS).map(move |u| (s, u))) {
                    let got = engine.output(stream, sample, unit);
                    assert_eq!(
                        got,
                        tick.output(stream, sample, unit),
                        "{stream:?} {sample} {unit}"
                    );
                }
            }
        }
    }
}

#[test]
fn a_refresh_takes_what_both_cells_hold_off_both() {
    let mut engine = engine(Adc::Ideal, Backend::Scalar);
    let pathways = engine.layers()[0].arrays.len();
    for (layer, array) in (0..2).flat_map(|layer| (0..pathways).map(move |array| (layer, array))) {
        for row in 0..engine.layers()[layer].layout.rows {
            let levels: Vec<u16> =
                (0..UNITS).map(|column| level(layer, array, row, column)).collect();
            engine.execute(&Operation::LoadWeights { layer, array, row, levels: &levels });
        }
    }
    let chip = engine.hardware().clone();
    let mut tick = Network::new(&chip, 1, engine.layers(), SAMPLES);
    let levels = |layers: &[Layer], layer: usize, array: usize| -> Vec<u16> {
        layers[layer].arrays[array].levels().collect()
    };
    let before = engine.layers().to_vec();
    engine.set_phase(Phase::Evaluation);
    tick.set_phase(Phase::Evaluation);
    engine.record(true);
    engine.refresh();
    engine.settle();
    let floor = chip.cell.window.floor();
    let mut moved = 0;
    for (layer, of) in before.iter().enumerate() {
        for (_, [e, i]) in of.spec.wiring.planes() {
            let was = [e, i].map(|array| levels(&before, layer, array));
            let is = [e, i].map(|array| levels(engine.layers(), layer, array));
            for cell in 0..was[0].len() {
                let off = was.each_ref().map(|of| i32::from(of[cell]));
                let now = is.each_ref().map(|of| i32::from(of[cell]));
                assert_eq!(off[0] - off[1], now[0] - now[1], "{layer} {e} {i} {cell}");
                assert_eq!(now[0].min(now[1]), i32::from(floor));
                moved += u64::from(off != now);
            }
        }
    }
    assert!(moved > 100, "{moved}");
    // what was done is a list of loads, of every cell, and Tick does the same
    let tape = engine.record(false);
    assert!(tape.iter().all(|of| matches!(of, Recorded::LoadWeights { .. })), "{}", tape.len());
    tick.play_tape(&tape);
    assert_eq!(engine.ledger(Phase::Evaluation), tick.ledger(Phase::Evaluation));
    for (layer, array) in (0..2).flat_map(|layer| (0..pathways).map(move |array| (layer, array))) {
        assert!(levels(engine.layers(), layer, array).into_iter().eq(tick.levels(layer, array)));
    }
}

#[test]
fn each_bank_counts_with_its_polarity() {
    let mut engine = engine(Adc::Ideal, Backend::Scalar);
    for (array, level) in [(0, 9), (4, 4), (1, 7), (5, 5), (2, 3), (6, 1)] {
        engine.execute(&Operation::LoadWeights {
            layer: 0,
            array,
            row: 0,
            levels: &[level; UNITS],
        });
    }
    for (layer, array, level) in [(1, 0, 1), (1, 5, 2)] {
        engine.execute(&Operation::LoadWeights { layer, array, row: 0, levels: &[level; UNITS] });
    }
    engine.execute(&Operation::LoadDrives { codes: &[vec![100], vec![0; INPUTS - 1]].concat() });
    engine.execute(&Operation::Forward { layer: 0, side: Side::Rows });
    engine.execute(&Operation::Forward { layer: 1, side: Side::Rows });
    // layer 0: p has 100 (9 - 4 + 7 - 5) = 700, n has 100 (3 - 1); layer 1: p has a_p of unit 0 less twice a_n of it
    let lut = &engine.layers()[0].lut;
    let half = lut.activity.len() as i64 / 2;
    let step = |acc: i64| (acc + (1 << lut.shift >> 1)) >> lut.shift;
    let activity = |acc| i64::from(lut.activity[(step(acc) + half) as usize]);
    let want = activity(700) - 2 * activity(200);
    assert_eq!(engine.output(Stream::P, 0, 0).0, want);
    assert!(want != 0, "the case is none");
    let hardware = engine.hardware().with(|h| h.tile.count_max = Some(1)).unwrap();
    let specs: Vec<_> = engine.layers().iter().map(|layer| layer.spec.clone()).collect();
    let needed = crate::chip::layer::check(&specs, &hardware).unwrap_err().to_string();
    // two targets of two pairs: 2 x 2 tiles each, then 1 x 2
    assert!(needed.contains("16 + 8"), "{needed}");
}
