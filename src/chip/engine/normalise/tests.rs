//! Networks whose hidden layers are normalised and whose last one is read out, against plain loops and against Tick.

use super::super::tick::Network;
use super::super::{Engine, ErrorUnit, Operation, Phase, Side, Write};
use crate::chip::crossbar::kernel::Backend;
use crate::chip::crossbar::layout::BLOCK_ROWS;
use crate::chip::hardware::timing::{PulseCode, Timing};
use crate::chip::hardware::{Adc, AdcRange, Hardware, HardwareSpec, Subtract, Window};
use crate::chip::layer::{
    Delivery, DrivenBy, Homeostasis, InitialLevels, Layer, LayerSpec, Pool, Taps,
};
use crate::chip::ledger::{During, Event, Interval};
use crate::chip::population::{Polarity, Stream, Wiring};
use crate::num::fixed::{AdcBits, DriveBits, LevelBits};
use crate::num::tables::Activation;
use proptest::prelude::*;

/// The `at`-th of some numbers below `below`.
fn number(seed: u64, at: usize, below: usize) -> usize {
    let mixed = (seed ^ at as u64).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    (mixed ^ mixed >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9) as usize % (1 << 40) % below
}

#[derive(Debug, Clone)]
struct Net {
    seed: u64,
    sides: Vec<usize>,
    wiring: Wiring,
    rows: bool,
    samples: usize,
    hardware: Hardware,
}

const WORDS: usize = 3;

impl Net {
    fn codes(&self) -> Vec<u8> {
        let top = usize::from(self.hardware.drive.bits.code_max()) + 1;
        (0..self.samples * self.sides[0]).map(|at| number(self.seed, at, top) as u8).collect()
    }

    fn level(&self, layer: usize, array: usize, row: usize, column: usize) -> u16 {
        let window = self.hardware.cell.window;
        let span = usize::from(window.ceiling() - window.floor()) + 1;
        let place = ((layer * 8 + array) * 2000 + row) * 2000 + column;
        // mostly low, so that streams are not all alike
        let high = number(self.seed, 2 * place, 3) == 0;
        let offset = number(self.seed, 2 * place + 1, if high { span } else { span.div_ceil(9) });
        window.floor() + offset as u16
    }

    fn layers(&self) -> Vec<Layer> {
        let last = self.sides.len() - 2;
        let one = |at: usize| {
            let spec = LayerSpec {
                inputs: self.sides[at],
                units: self.sides[at + 1],
                wiring: self.wiring,
                driven_by: if at == 0 { DrivenBy::Shared } else { DrivenBy::Normalised },
                activation: if at == last { Activation::Accumulator } else { Activation::Rms },
                weight_max_log2: 0,
                initial: InitialLevels::Uniform { gain_64ths: [64, 64] },
                constant_row: self.rows,
                convolution: None,
                copies: 1,
                pool: Pool::None,
                homeostasis: Homeostasis::OFF,
            };
            let words = (0..spec.units).map(|unit| (unit % WORDS) as u16).collect();
            let taps = Taps { width: WORDS, per_unit: 1, words, shift: 0 };
            let delivery = if at == last { Delivery::output(spec.units) } else { taps.into() };
            let mut layer = Layer::new(at as u16, spec, delivery, &self.hardware);
            let (rows, columns) = (layer.layout.rows, layer.layout.columns);
            for array in 0..layer.arrays.len() {
                for row in 0..rows {
                    let levels: Vec<u16> =
                        (0..columns).map(|column| self.level(at, array, row, column)).collect();
                    layer.arrays[array].load_row(row, &levels);
                }
            }
            layer
        };
        (0..=last).map(one).collect()
    }

    fn engine(&self, backend: Backend, threads: usize) -> Engine {
        let mut engine = Engine::new(self.hardware.clone(), backend, self.seed, self.layers());
        engine.set_threads(threads).unwrap();
        engine.execute(&Operation::LoadDrives { codes: &self.codes() });
        for layer in 0..engine.layers().len() {
            engine.execute(&Operation::Forward { layer, side: Side::Rows });
        }
        engine
    }

    /// What networks of ideal converters come to, by plain loops.
    fn plain(&self) -> Plain {
        let bits = self.hardware.drive.bits;
        let mut plain = Plain::default();
        let codes = self.codes();
        let mut drives: [Vec<Vec<i64>>; 2] = [0; 2].map(|_| {
            codes.chunks(self.sides[0]).map(|x| x.iter().map(|&x| x.into()).collect()).collect()
        });
        for (at, layer) in self.layers().iter().enumerate() {
            if self.rows {
                let all = drives.iter_mut().flatten();
                all.for_each(|x| x.push(bits.code_max().into()));
            }
            let units = layer.layout.columns;
            let mut sums = [0; 2].map(|_| vec![vec![0; units]; self.samples]);
            for (array, pathway) in self.wiring.pathways().iter().enumerate() {
                let sign = if pathway.polarity == Polarity::Excites { 1 } else { -1 };
                for (sample, sums) in sums[pathway.target.index()].iter_mut().enumerate() {
                    for (row, &x) in drives[pathway.source.index()][sample].iter().enumerate() {
                        for (column, sum) in sums.iter_mut().enumerate() {
                            let level = self.level(at, array, row, column);
                            *sum += sign * x * i64::from(level);
                        }
                    }
                }
            }
            let last = at + 2 == self.sides.len();
            if last {
                plain.readouts = match self.wiring.targets().len() {
                    1 => sums[0].concat(),
                    _ => {
                        sums[0].concat().iter().zip(sums[1].concat()).map(|(p, n)| p - n).collect()
                    }
                };
            }
            for target in self.wiring.targets() {
                let sums = &sums[target.index()];
                let slope = |&sum: &i64| if last || sum > 0 { 255 } else { 0 };
                plain.slopes.push(sums.iter().flatten().map(slope).collect());
                if !last {
                    let of = sums.iter().map(|sums| normalised(sums, bits));
                    let (next, beyond): (_, Vec<u64>) = of.unzip();
                    drives[target.index()] = next;
                    plain.bounded.push(beyond.iter().sum());
                }
            }
        }
        plain
    }
}

#[derive(Debug, Default, PartialEq)]
struct Plain {
    /// `[sample][unit]`.
    readouts: Vec<i64>,
    /// `[sample][unit]`, layer after layer and stream after stream.
    slopes: Vec<Vec<u8>>,
    /// Codes that their bound changed, likewise.
    bounded: Vec<u64>,
}

/// Drives of the next layer, and how many codes were bounded.
fn normalised(sums: &[i64], bits: DriveBits) -> (Vec<i64>, u64) {
    let v: Vec<u128> = sums.iter().map(|&sum| sum.max(0) as u128).collect();
    let mean = v.iter().map(|v| v * v).sum::<u128>() / v.len() as u128;
    let reciprocal = (1u128 << 45) / mean.isqrt().max(1);
    let codes: Vec<i64> = v.iter().map(|v| ((v * reciprocal + (1 << 39)) >> 40) as i64).collect();
    let shift = 8 - bits.get();
    let drive =
        |code: &i64| (((*code).min(255) + (1 << shift >> 1)) >> shift).min(bits.code_max().into());
    (codes.iter().map(drive).collect(), codes.iter().filter(|&&code| code > 255).count() as u64)
}

/// The same of an engine that has read.
fn of_engine(engine: &Engine) -> Plain {
    let mut plain = Plain::default();
    engine.readouts(&mut plain.readouts);
    let last = engine.layers().len() - 1;
    for (at, layer) in engine.layers().iter().enumerate() {
        for &target in layer.spec.wiring.targets() {
            let slopes = &engine.registers[at].derivatives[target.index()];
            let mut mine = vec![];
            for sample in 0..engine.samples() {
                let unit = |unit| slopes[engine.register_at(sample, unit)];
                mine.extend((0..layer.spec.units).map(unit));
            }
            plain.slopes.push(mine);
            let beyond = slopes.chunks(engine.samples() * BLOCK_ROWS).last().unwrap();
            let padding = layer.spec.units.wrapping_sub(1) % BLOCK_ROWS + 1;
            let rows = beyond.chunks(BLOCK_ROWS);
            assert!(rows.into_iter().all(|row| row[padding..].iter().all(|&slope| slope == 0)));
            if at < last {
                let code = Engine::code_of(layer.spec.wiring, target);
                let ledger = engine.ledger(Phase::Training);
                let count = |event| ledger.get(at, code, During::ForwardRows, event);
                plain.bounded.push(count(Event::SaturatedLookUps));
                let (n, units) = (engine.samples() as u64, layer.spec.units as u64);
                let counts = [Event::Squares, Event::Roots, Event::Scalings, Event::LookUps];
                assert_eq!(counts.map(count), [n * units, n, n * units, 0]);
            }
        }
    }
    plain
}

fn side() -> impl Strategy<Value = usize> {
    prop_oneof![4 => 1usize..=12, 3 => prop::sample::select(vec![31, 32, 33, 63, 64, 65]), 1 => 96usize..=140]
}

fn wiring() -> impl Strategy<Value = Wiring> {
    prop::sample::select(vec![Wiring::Dual, Wiring::DualPairs, Wiring::Single])
}

fn chip(level_bits: i64, drive_bits: i64, change: impl FnOnce(&mut HardwareSpec)) -> Hardware {
    let chip = Hardware::reference().with(|h| {
        h.cell.level_bits = LevelBits::new(level_bits).unwrap();
        let top = i64::from(h.cell.level_bits.level_max());
        h.cell.window = Window::new(0, top, h.cell.level_bits).unwrap();
        h.drive.bits = DriveBits::new(drive_bits).unwrap();
        h.drive.dac_bits = 1;
        change(h);
    });
    chip.unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn fast_is_the_law(
        seed: u64,
        sides in prop::collection::vec(side(), 2..=4),
        wiring in wiring(),
        rows: bool,
        samples in prop_oneof![1usize..=5, 30usize..=35, 62usize..=70],
        level_bits in prop_oneof![2 => Just(8i64), 1 => 1i64..=12],
        drive_bits in prop_oneof![2 => Just(8i64), 1 => 1i64..=8],
    ) {
        let hardware = chip(level_bits, drive_bits, |_| {});
        let net = Net { seed, sides, wiring, rows, samples, hardware };
        let want = net.plain();
        for backend in Backend::available() {
            prop_assert_eq!(&of_engine(&net.engine(backend, 1)), &want, "{}", backend.name());
        }
    }

    #[test]
    fn tick_agrees_cycle_by_cycle(
        seed: u64,
        sides in prop::collection::vec(1usize..=11, 3..=4),
        wiring in wiring(),
        rows: bool,
        samples in 1usize..=5,
        drive_bits in 1i64..=8,
        tile in (1usize..=12, 1usize..=12),
        adc in 0u8..3,
        times in (1u64..=9, 1u64..=3, 1u64..=6, any::<bool>(), 1u64..=12, 1u64..=3),
    ) {
        let (settle, convert, share, overlapped, lanes, beat) = times;
        let timing = Timing {
            clock_khz: 1, beat, settle, convert, share, overlapped, lanes, hops: 1, pulse: 2,
            pulse_code: PulseCode::Unary, verify: false, active_max: None, slices: None,
        };
        let bits = AdcBits::new(7).unwrap();
        let finite = |subtract| Adc::Finite { bits, subtract, range: AdcRange::Shift(2) };
        let hardware = chip(8, drive_bits, |h| {
            (h.tile.rows, h.tile.columns) = tile;
            h.adc = [Adc::Ideal, finite(Subtract::Digital), finite(Subtract::Current)][usize::from(adc)];
            h.timing = Some(timing);
        });
        let net = Net { seed, sides, wiring, rows, samples, hardware };
        let last = net.sides.len() - 2;
        let codes = net.codes();
        let mut engine = Engine::new(net.hardware.clone(), Backend::best(), seed, net.layers());
        let mut tick = Network::new(&net.hardware, seed, engine.layers(), samples);
        let outputs = net.sides[last + 1];
        let words: Vec<i16> =
            (0..samples * outputs.max(WORDS)).map(|at| number(seed, at, 255) as i16 - 127).collect();
        let mut operations = vec![Operation::LoadDrives { codes: &codes }];
        for layer in 0..=last {
            operations.push(Operation::Forward { layer, side: Side::Rows });
        }
        for layer in 0..=last {
            let width = if layer == last { outputs } else { WORDS };
            let words = &words[..samples * width];
            operations.push(Operation::Error { layer, samples: 0..samples, words, shared: false });
        }
        for (write, samples) in [(Write::Add, 0..samples), (Write::Program, 0..0)] {
            for layer in 0..=last {
                operations.push(Operation::Update { layer, write, samples: samples.clone(), shift: 7 });
            }
        }
        operations.iter().for_each(|operation| engine.execute(operation));
        engine.settle();
        tick.run(&operations);
        let unit = ErrorUnit::handed(net.hardware.digital.error_bits);
        tick.set_error_unit(&unit);
        engine.set_error_unit(unit);
        let errors: Vec<i32> =
            (0..samples * outputs).map(|at| number(seed, at, 10 << 20) as i32 - (5 << 20)).collect();
        prop_assert_eq!(engine.output_words(&errors), tick.output_words(&errors));
        prop_assert_eq!(engine.ledger(Phase::Training), tick.ledger(Phase::Training));
        for (layer, of) in engine.layers().iter().enumerate() {
            for (array, cells) in of.arrays.iter().enumerate() {
                prop_assert!(cells.levels().eq(tick.levels(layer, array)), "{} {}", layer, array);
            }
        }
        for &stream in wiring.targets() {
            for (sample, unit) in (0..samples).flat_map(|s| (0..outputs).map(move |u| (s, u))) {
                let got = engine.output(stream, sample, unit);
                prop_assert_eq!(got, tick.output(stream, sample, unit));
            }
        }
    }
}

#[test]
fn threads_change_nothing_and_samples_may_be_few_afterwards() {
    let hardware = chip(8, 8, |_| {});
    let (sides, wiring) = (vec![130, 140, 140, 3], Wiring::Dual);
    let net = Net { seed: 5, sides, wiring, rows: true, samples: 130, hardware };
    let mut all: Vec<Engine> = [1, 3].map(|threads| net.engine(Backend::best(), threads)).into();
    assert_eq!(of_engine(&all[0]), of_engine(&all[1]));
    // a smaller batch after a larger one sees nothing of it
    let few = Net { samples: 2, ..net };
    let codes = few.codes();
    all[0].execute(&Operation::LoadDrives { codes: &codes });
    (0..3).for_each(|layer| all[0].execute(&Operation::Forward { layer, side: Side::Rows }));
    let mut readouts = vec![];
    all[0].readouts(&mut readouts);
    assert_eq!(readouts, few.plain().readouts);
}

#[test]
fn sums_whose_squares_need_more_than_64_bits_are_normalised_alike() {
    // 12-bit levels: 600 rows stay narrow, 1,100 do not
    for inputs in [600, 1100] {
        let hardware = chip(12, 8, |_| {});
        let (sides, wiring) = (vec![inputs, 33, 2], Wiring::Dual);
        let net = Net { seed: 9, sides, wiring, rows: false, samples: 3, hardware };
        assert_eq!(of_engine(&net.engine(Backend::best(), 1)), net.plain());
    }
}

/// The closed form by hand: a stage is a step of the pipeline.
#[test]
fn a_stage_adds_its_beats_and_may_be_the_slowest_of_all() {
    let timing = Timing {
        clock_khz: 1,
        beat: 1,
        settle: 10,
        convert: 1,
        share: 1,
        overlapped: true,
        lanes: 4,
        hops: 1,
        pulse: 2,
        pulse_code: PulseCode::Unary,
        verify: false,
        active_max: None,
        slices: None,
    };
    let hardware = chip(8, 1, |h| h.timing = Some(timing));
    let net = Net {
        seed: 1,
        sides: vec![5, 9, 2],
        wiring: Wiring::Single,
        rows: false,
        samples: 4,
        hardware,
    };
    let mut engine = net.engine(Backend::best(), 1);
    engine.settle();
    let cycles = engine.ledger(Phase::Training).cycles().unwrap();
    // reads of 10 + 1 + NG, each accepted; a stage of 2 x 3 + 32 behind the first; then its 38 for each sample more
    let latency = (1 + 11 + 3) + (2 * 3 + 32) + (1 + 11 + 1);
    assert_eq!(cycles.interval(Interval::Forward), latency + 3 * 38);
}

#[test]
fn a_readout_is_mute_when_its_accumulators_never_differ() {
    let hardware = chip(8, 8, |_| {});
    let net = Net {
        seed: 3,
        sides: vec![4, 5, 2],
        wiring: Wiring::Dual,
        rows: false,
        samples: 1,
        hardware,
    };
    let mut engine = Engine::new(net.hardware.clone(), Backend::best(), 3, net.layers());
    engine.set_phase(Phase::Evaluation);
    let mut read = |codes: &[u8]| {
        engine.execute(&Operation::LoadDrives { codes });
        (0..2).for_each(|layer| engine.execute(&Operation::Forward { layer, side: Side::Rows }));
        engine.take_mute()
    };
    assert_eq!(read(&[9; 8]), [true, true]);
    assert_eq!(read(&[9, 9, 9, 9, 0, 9, 0, 9]), [false, false]);
    assert!(matches!(engine.output(Stream::N, 0, 1), (_, 0)));
}
