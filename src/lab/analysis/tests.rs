//! The gradient against what a change of one level does to the outputs, followed forwards.

use super::*;
use crate::chip::crossbar::kernel::{Backend, ConvShape};
use crate::chip::hardware::Hardware;
use crate::chip::layer::{DrivenBy, Homeostasis, InitialLevels, LayerSpec, Optimiser, Pool};
use crate::chip::population::{Stream, Wiring};
use crate::learn::driver::Driver;
use crate::learn::error::{Centre, OutputError};
use crate::learn::network::{NetworkPlace, NetworkSpec};
use crate::learn::rule::{Control, Rule, UpdateMode};
use crate::num::fixed::{Batch, RateMantissa};
use crate::num::tables::{Activation, Decay, Positive};

const SAMPLES: usize = 3;

fn dense(inputs: usize, units: usize, wiring: Wiring) -> LayerSpec {
    LayerSpec {
        inputs,
        units,
        wiring,
        driven_by: DrivenBy::Streams,
        activation: Activation::Sigmoid(Positive::new(4.0).unwrap()),
        weight_max_log2: 1,
        initial: InitialLevels::Uniform { gain_64ths: [96, 64] },
        constant_row: false,
        convolution: None,
        copies: 1,
        pool: Pool::None,
        homeostasis: Homeostasis::OFF,
    }
}

fn window(shape: ConvShape, units: usize, pool: Pool) -> LayerSpec {
    let convolution = Some(shape);
    LayerSpec { convolution, pool, ..dense(shape.rows(), units, Wiring::Dual) }
}

/// Learns by error diffusion, over one word a unit; a single stream by feedback at random.
fn network(mut layers: Vec<LayerSpec>, centred: bool) -> Driver {
    layers[0].driven_by = DrivenBy::Shared;
    let count = layers.len();
    let (rule, route) = match layers[0].wiring {
        Wiring::Single => (Rule::Dfa, Route::RandomDense { shift: None }),
        Wiring::DualPairs => (Rule::EdNonDalean, Route::Modulo { taps: 1, shift: None }),
        _ => (Rule::Ed, Route::Modulo { taps: 1, shift: None }),
    };
    let spec = NetworkSpec {
        layers,
        rule,
        mode: UpdateMode::Accumulate,
        error: OutputError::OneVsAll,
        centre: Centre::Batch,
        route: Some(route),
        batch: Batch::new(4).unwrap(),
        mantissas: vec![RateMantissa::new(1).unwrap(); count],
        rates: vec![Positive::new(0.1).unwrap(); count],
        decay: Decay::Constant,
        optimisers: vec![Optimiser::Rms; count],
        centred: vec![centred; count],
        control: Control::None,
        refresh: None,
    };
    let place = NetworkPlace { seed: 3, first_layer: 0, updates: 10 };
    spec.build(&Hardware::reference(), Backend::Scalar, place).unwrap()
}

/// Numbers without a pattern.
fn some(count: usize, below: u64) -> Vec<u64> {
    let next = |state: &mut u64, ()| {
        *state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        Some((*state >> 33) % below)
    };
    std::iter::repeat_n((), count).scan(41u64, next).collect()
}

/// A network that has read something, and words of its errors.
fn read(driver: &mut Driver) -> Vec<i16> {
    let inputs = driver.engine().layers()[0].spec.sample_inputs();
    let codes: Vec<u8> = some(SAMPLES * inputs, 256).iter().map(|&code| code as u8).collect();
    driver.read(&codes);
    let outputs = driver.engine().layers().last().unwrap().spec.units;
    some(SAMPLES * outputs, 255).iter().map(|&word| word as i16 - 127).collect()
}

fn stages(driver: &Driver) -> Vec<Stage> {
    (0..driver.engine().layers().len()).map(|at| Stage::of(driver.engine(), at)).collect()
}

/// What units of a stage hand on of their accumulators, `[sample][code]`, each times its slope: the sum of a square, or the
/// place in it that had the greatest code.
fn handed_on(driver: &Driver, layer: usize, target: Stream, sums: &[f64]) -> Vec<f64> {
    let spec = &driver.engine().layers()[layer].spec;
    let slopes = driver.engine().unit_slopes(layer, target);
    let maps = driver.engine().unit_maps(layer, target);
    let [_, across] = spec.convolution.map_or([1, 1], ConvShape::output);
    let ([height, width], side) = (spec.pooled(), spec.pool.side());
    let mut out = Vec::new();
    for sample in 0..SAMPLES {
        for y in 0..height {
            for x in 0..width {
                for unit in 0..spec.units {
                    let place = |dy: usize, dx: usize| {
                        let read =
                            sample * spec.positions() + (y * side + dy) * across + x * side + dx;
                        read * spec.units + unit
                    };
                    let all: Vec<usize> =
                        (0..side).flat_map(|dy| (0..side).map(move |dx| place(dy, dx))).collect();
                    let value = |place: usize| sums[place] * f64::from(slopes[place]);
                    out.push(match spec.pool {
                        Pool::Max { .. } => {
                            let best = all.iter().rev().max_by_key(|place| maps[**place]).unwrap();
                            value(*best)
                        }
                        _ => all.iter().map(|&place| value(place)).sum(),
                    });
                }
            }
        }
    }
    out
}

/// Sums of a layer whose rows are driven with these numbers, `[read][unit]` by target.
fn sums_of(stage: &Stage, drives: &[Vec<f64>; 2]) -> [Vec<f64>; 2] {
    let (spec, units) = (&stage.spec, stage.spec.units);
    let mut sums = [Stream::P, Stream::N].map(|_| vec![0.0; SAMPLES * spec.positions() * units]);
    for (way, sign, levels) in stage.arrays() {
        let drives = &drives[way.source.index()];
        for read in 0..SAMPLES * spec.positions() {
            let (sample, position) = (read / spec.positions(), read % spec.positions());
            for row in 0..spec.inputs {
                let drive = match spec.convolution {
                    None => drives[sample * spec.inputs + row],
                    Some(shape) => {
                        let [_, across] = shape.output();
                        let (tap, channel) = (row / shape.channels, row % shape.channels);
                        let y = position / across * shape.stride + tap / shape.side;
                        let x = position % across * shape.stride + tap % shape.side;
                        let y = y.checked_sub(shape.pad).filter(|y| *y < shape.height);
                        let x = x.checked_sub(shape.pad).filter(|x| *x < shape.width);
                        let (Some(y), Some(x)) = (y, x) else { continue };
                        let pixel = (sample * shape.height + y) * shape.width + x;
                        drives[pixel * shape.channels + channel]
                    }
                };
                for unit in 0..units {
                    let level = f64::from(levels[row * units + unit]);
                    sums[way.target.index()][read * units + unit] += sign * level * drive;
                }
            }
        }
    }
    sums
}

/// What one level more in one cell adds to the words times the outputs, by the slopes that were read.
fn moved(driver: &Driver, layer: usize, cell: (usize, usize, usize), words: &[i16]) -> f64 {
    let all = stages(driver);
    let engine = driver.engine();
    let (array, row, unit) = cell;
    let units = all[layer].spec.units;
    let mut one = Stage::of(engine, layer);
    one.levels.iter_mut().for_each(|levels| levels.fill(0));
    one.levels[array][row * units + unit] = 1;
    let codes = |source: Stream| -> Vec<f64> {
        let set = one.spec.drives_of(source);
        engine.drive_codes(layer, set).into_iter().map(f64::from).collect()
    };
    let mut sums = sums_of(&one, &[codes(Stream::P), codes(Stream::N)]);
    for above in layer + 1..all.len() {
        let drives = [Stream::P, Stream::N].map(|target| {
            let there = all[above - 1].spec.wiring.targets().contains(&target);
            if there { handed_on(driver, above - 1, target, &sums[target.index()]) } else { vec![] }
        });
        sums = sums_of(&all[above], &drives);
    }
    let last = all.len() - 1;
    let out = handed_on(driver, last, Stream::P, &sums[0]);
    out.iter().zip(words).map(|(out, &word)| out * f64::from(word)).sum()
}

fn deep() -> Vec<LayerSpec> {
    let first = ConvShape { channels: 2, height: 16, width: 16, side: 3, stride: 2, pad: 1 };
    let second = ConvShape { channels: 5, height: 4, width: 4, side: 3, stride: 1, pad: 1 };
    vec![
        window(first, 5, Pool::Average { side: 2 }),
        window(second, 3, Pool::Max { side: 2 }),
        dense(3 * 2 * 2, 7, Wiring::Dual),
        dense(7, 4, Wiring::DualReadout),
    ]
}

fn pairs() -> Vec<LayerSpec> {
    vec![
        dense(9, 6, Wiring::DualPairs),
        dense(6, 5, Wiring::DualPairs),
        dense(5, 3, Wiring::DualReadoutPairs),
    ]
}

fn single() -> Vec<LayerSpec> {
    vec![dense(9, 6, Wiring::Single), dense(6, 5, Wiring::Single), dense(5, 3, Wiring::Single)]
}

#[test]
fn the_gradient_is_what_a_level_more_does() {
    for layers in [deep(), pairs(), single()] {
        let mut driver = network(layers, false);
        let words = read(&mut driver);
        let all = stages(&driver);
        let mut truth =
            all.last().unwrap().deltas(&words.iter().map(|&w| f64::from(w)).collect::<Vec<_>>());
        for layer in (0..all.len()).rev() {
            let stage = &all[layer];
            let sums = stage.sums(&truth);
            let mut seen = 0.0f64;
            for (array, way) in stage.spec.wiring.pathways().iter().enumerate() {
                let part = stage.spec.drive_sets().iter().flat_map(|&set| {
                    stage.spec.wiring.targets().iter().map(move |&target| (set, target))
                });
                let kinds: Vec<_> = part
                    .filter(|&(set, target)| {
                        stage.spec.wiring.pathways().iter().any(|way| {
                            stage.spec.drives_of(way.source) == set && way.target == target
                        })
                    })
                    .collect();
                let here = (stage.spec.drives_of(way.source), way.target);
                let at = kinds.iter().position(|kind| *kind == here).unwrap();
                let sign = if way.polarity == crate::chip::population::Polarity::Excites {
                    1.0
                } else {
                    -1.0
                };
                for (row, unit) in [(0, 0), (stage.spec.inputs - 1, stage.spec.units - 1), (3, 1)] {
                    let wanted = moved(&driver, layer, (array, row, unit), &words);
                    let found = sign * sums.0[at].1[row * stage.spec.units + unit];
                    assert!(
                        (wanted - found).abs() <= 1e-9 * wanted.abs(),
                        "layer {layer} {} row {row} unit {unit}: {found}, wanted {wanted}",
                        way.name
                    );
                    seen += wanted.abs();
                }
            }
            assert!(seen > 0.0, "layer {layer} was never asked for anything");
            if let Some(below) = layer.checked_sub(1) {
                truth = all[below].through(&gradient::back(stage, &truth));
            }
        }
    }
}

#[test]
fn a_route_of_its_own_is_the_route_of_that_name_and_outputs_agree() {
    let mut driver = network(deep(), false);
    let words = read(&mut driver);
    let found = analyse(driver.engine(), &words, 3);
    assert_eq!(found.iter().map(|one| one.layer).collect::<Vec<_>>(), [0, 1, 2, 3]);
    let last = found.last().unwrap();
    assert!((last.agreement.unwrap() - 1.0).abs() < 1e-12 && last.routes.is_empty());
    for one in &found[..3] {
        assert_eq!(
            one.routes.iter().map(|(name, _)| *name).collect::<Vec<_>>(),
            ROUTES.map(|(name, _)| name)
        );
        assert_eq!(one.agreement, one.routes[0].1);
        let all = one.routes.iter().map(|(_, agreement)| agreement.unwrap());
        assert!(all.clone().all(|cos| cos.abs() <= 1.0));
        assert!(all.clone().any(|cos| cos != one.agreement.unwrap()), "every route is the same");
        assert!(one.gate.unwrap() > 0.0 && one.update.unwrap() > 0.0 && one.gradient_gate > 0.0);
    }
    assert_eq!(found[0].cells, 4 * 18 * 5);
}

/// Every unit of one output hears the sign of its own effect: an update on one tap goes uphill.
#[test]
fn with_one_output_updates_go_along_the_gradient() {
    let layers = vec![dense(9, 6, Wiring::Dual), dense(6, 1, Wiring::DualReadout)];
    let mut driver = network(layers, false);
    let words = read(&mut driver);
    let found = analyse(driver.engine(), &words, 3);
    assert!(found[0].agreement.unwrap() > 0.5, "{:?}", found[0]);
}

#[test]
fn centred_sums_are_of_drives_less_their_mean() {
    let layers = || vec![dense(9, 6, Wiring::Dual), dense(6, 3, Wiring::DualReadout)];
    let (mut plain, mut centred) = (network(layers(), false), network(layers(), true));
    let words = read(&mut plain);
    assert_eq!(words, read(&mut centred));
    let stage = Stage::of(centred.engine(), 1);
    let gates = stage.deltas(&words.iter().map(|&w| f64::from(w)).collect::<Vec<_>>());
    let sums = stage.sums(&gates);
    for (at, set) in [Stream::P, Stream::N].into_iter().enumerate() {
        let codes = centred.engine().drive_codes(1, set);
        for row in 0..6 {
            let code = |sample: usize| f64::from(codes[sample * 6 + row]);
            let mean = (0..SAMPLES).map(code).sum::<f64>() / SAMPLES as f64;
            for unit in 0..3 {
                let of = |sample: usize| (code(sample) - mean) * gates[0][sample * 3 + unit];
                let wanted: f64 = (0..SAMPLES).map(of).sum();
                let found = sums.0[at].1[row * 3 + unit];
                assert!((wanted - found).abs() < 1e-6, "{found}, wanted {wanted}");
            }
        }
    }
    let agreement = |driver: &Driver| analyse(driver.engine(), &words, 3)[0].agreement;
    assert_ne!(agreement(&plain), agreement(&centred));
}
