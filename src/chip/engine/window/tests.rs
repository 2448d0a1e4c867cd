//! Convolutions against the dense layers that they unroll to, and against plain loops.

use proptest::prelude::*;

use super::super::error::packed_at;
use super::super::error::stride_of;
use super::super::{Engine, Operation, Phase, Side, Write};
use crate::chip::crossbar::kernel::{Backend, ConvShape};
use crate::chip::crossbar::layout::BLOCK_ROWS;
use crate::chip::hardware::{Adc, AdcRange, Hardware, Subtract};
use crate::chip::layer::{
    Delivery, DrivenBy, Homeostasis, InitialLevels, Layer, LayerSpec, Optimiser, Pool, Taps,
};
use crate::chip::population::{Stream, Wiring};
use crate::num::fixed::{AdcBits, DriveBits, LevelBits};
use crate::num::tables::Activation;

const OUTPUTS: usize = 3;

fn number(seed: u64, at: usize, below: usize) -> usize {
    let mixed = (seed ^ at as u64).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    (mixed ^ mixed >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9) as usize % (1 << 40) % below
}

/// A convolution, another one above it, and outputs.
#[derive(Debug, Clone)]
struct Net {
    seed: u64,
    shapes: [ConvShape; 2],
    pools: [Pool; 2],
    units: [usize; 2],
    constant_row: bool,
    samples: usize,
    optimiser: Optimiser,
    chip: Hardware,
}

fn shape(
    channels: usize,
    [height, width]: [usize; 2],
    side: usize,
    stride: usize,
    pad: usize,
) -> ConvShape {
    let side = side.min(height).min(width);
    ConvShape { channels, height, width, side, stride, pad: pad.min(side - 1) }
}

/// A pool that fits a map, of a side and a kind that are wished for.
fn pool([height, width]: [usize; 2], side: usize, greatest: bool) -> Pool {
    match height.is_multiple_of(side) && width.is_multiple_of(side) {
        true if side == 1 => Pool::None,
        true if greatest => Pool::Max { side },
        true => Pool::Average { side },
        false => Pool::None,
    }
}

fn chip() -> impl Strategy<Value = Hardware> {
    let ranges = prop_oneof![Just(AdcRange::Shift(2)), Just(AdcRange::Full)];
    let subtract = prop_oneof![Just(Subtract::Digital), Just(Subtract::Current)];
    let bits = 4i64..=9;
    let finite = (bits, subtract, ranges).prop_map(|(bits, subtract, range)| Adc::Finite {
        bits: AdcBits::new(bits).unwrap(),
        subtract,
        range,
    });
    let adc = prop_oneof![Just(Adc::Ideal), finite];
    let tile = [prop_oneof![Just(64usize), 5usize..90], prop_oneof![Just(32usize), 3usize..90]];
    (adc, tile, 1i64..=8, 1u32..=8, 1i64..=9).prop_map(|(adc, tile, drive, dac, level)| {
        let changed = Hardware::reference().with(|h| {
            h.adc = adc;
            [h.tile.rows, h.tile.columns] = tile;
            h.drive.bits = DriveBits::new(drive).unwrap();
            h.drive.dac_bits = dac.min(drive as u32);
            h.cell.level_bits = LevelBits::new(level).unwrap();
            h.cell.window = crate::chip::hardware::Window::new(
                0,
                (1 << level) - 1,
                LevelBits::new(level).unwrap(),
            )
            .unwrap();
            h.timing = None;
        });
        changed.expect("a chip")
    })
}

fn net() -> impl Strategy<Value = Net> {
    let side = || 1usize..=3;
    let optimisers = vec![
        Optimiser::Plain,
        Optimiser::Sign { dead_zone: false },
        Optimiser::Sign { dead_zone: true },
        Optimiser::Rms,
    ];
    (
        any::<u64>(),
        (1usize..=70, [3usize..=7, 3usize..=7], side(), 1usize..=2, 0usize..=2),
        (side(), 1usize..=2, 0usize..=2),
        [1usize..=70, 1usize..=40],
        [(1usize..=3, any::<bool>()), (1usize..=3, any::<bool>())],
        (any::<bool>(), 1usize..=3),
        prop::sample::select(optimisers),
        chip(),
    )
        .prop_map(|(seed, first, second, units, pools, rest, optimiser, chip)| {
            let one = shape(first.0, first.1, first.2, first.3, first.4);
            let pool_one = pool(one.output(), pools[0].0, pools[0].1);
            let below = one.output().map(|size| size / pool_one.side());
            let two = shape(units[0], below, second.0, second.1, second.2);
            let pool_two = pool(two.output(), pools[1].0, pools[1].1);
            let (constant_row, samples) = rest;
            Net {
                seed,
                shapes: [one, two],
                pools: [pool_one, pool_two],
                units,
                constant_row,
                samples,
                optimiser,
                chip,
            }
        })
}

impl Net {
    fn spec(&self, at: usize) -> LayerSpec {
        let mut spec = LayerSpec {
            inputs: 0,
            units: 0,
            wiring: Wiring::Dual,
            driven_by: if at == 0 { DrivenBy::Shared } else { DrivenBy::Streams },
            activation: Activation::Relu,
            weight_max_log2: 1,
            initial: InitialLevels::Uniform { gain_64ths: [64, 64] },
            constant_row: self.constant_row,
            convolution: None,
            copies: 1,
            pool: Pool::None,
            homeostasis: Homeostasis::OFF,
        };
        if at < 2 {
            spec.convolution = Some(self.shapes[at]);
            (spec.inputs, spec.units) = (self.shapes[at].rows(), self.units[at]);
            spec.pool = self.pools[at];
        } else {
            (spec.inputs, spec.units) = (self.spec(1).sample_outputs(), OUTPUTS);
            spec.wiring = Wiring::DualReadout;
        }
        spec
    }

    fn taps(units: usize) -> Taps {
        let words = (0..units).map(|unit| (unit % OUTPUTS) as u16).collect();
        Taps { width: OUTPUTS, per_unit: 1, words, shift: 0 }
    }

    fn engine(&self, backend: Backend) -> Engine {
        let layers = (0..3).map(|at| {
            let spec = self.spec(at);
            let delivery = match at {
                2 => Delivery::output(OUTPUTS),
                _ => Self::taps(spec.units).into(),
            };
            Layer::new(at as u16, spec, delivery, &self.chip)
        });
        let mut engine = Engine::new(self.chip.clone(), backend, self.seed, layers.collect());
        engine.set_optimisers(&[self.optimiser; 3]);
        for layer in 0..3 {
            self.load(&mut engine, layer, layer);
        }
        engine
    }

    /// Gives a layer of an engine the levels of layer `of` of the net.
    fn load(&self, engine: &mut Engine, layer: usize, of: usize) {
        let this = &engine.layers()[layer];
        let (layout, arrays) = (this.layout, this.arrays.len());
        let top = usize::from(self.chip.cell.window.ceiling()) + 1;
        for array in 0..arrays {
            for row in 0..layout.rows {
                let at = |column: usize| ((of * 4 + array) * 1000 + row) * 1000 + column;
                let levels: Vec<_> =
                    (0..layout.columns).map(|c| number(self.seed, at(c), top) as u16).collect();
                engine.execute(&Operation::LoadWeights { layer, array, row, levels: &levels });
            }
        }
    }

    fn codes(&self) -> Vec<u8> {
        let top = usize::from(self.chip.drive.bits.code_max()) + 1;
        let count = self.samples * self.spec(0).sample_inputs();
        (0..count).map(|at| number(!self.seed, at, top) as u8).collect()
    }

    fn words(&self) -> Vec<i16> {
        let word = |at| number(self.seed ^ 77, at, 255) as i16 - 127;
        (0..self.samples * OUTPUTS).map(word).collect()
    }

    /// Windows of a map `[sample][y][x][channel]`: `[read][row]`, without a constant row.
    fn windows(&self, layer: usize, map: &[u8]) -> Vec<Vec<u8>> {
        let shape = self.shapes[layer];
        let [down, across] = shape.output();
        let mut reads = Vec::new();
        for sample in 0..self.samples {
            for (y, x) in (0..down).flat_map(|y| (0..across).map(move |x| (y, x))) {
                let mut rows = Vec::new();
                for ky in 0..shape.side {
                    for kx in 0..shape.side {
                        for channel in 0..shape.channels {
                            let at_y = (y * shape.stride + ky).checked_sub(shape.pad);
                            let at_x = (x * shape.stride + kx).checked_sub(shape.pad);
                            let inside = at_y
                                .zip(at_x)
                                .filter(|&(y, x)| y < shape.height && x < shape.width);
                            rows.push(inside.map_or(0, |(y, x)| {
                                let pixel = (sample * shape.height + y) * shape.width + x;
                                map[pixel * shape.channels + channel]
                            }));
                        }
                    }
                }
                reads.push(rows);
            }
        }
        reads
    }

    /// Pools codes `[read][channel]` of a layer: `[sample][y][x][channel]`.
    fn pooled(&self, layer: usize, reads: &[Vec<u8>]) -> Vec<u8> {
        let [down, across] = self.shapes[layer].output();
        let side = self.pools[layer].side();
        let mut map = Vec::new();
        for sample in 0..self.samples {
            for (y, x) in (0..down / side).flat_map(|y| (0..across / side).map(move |x| (y, x))) {
                let square: Vec<&Vec<u8>> = (0..side * side)
                    .map(|at| {
                        let (y, x) = (y * side + at / side, x * side + at % side);
                        &reads[(sample * down + y) * across + x]
                    })
                    .collect();
                for channel in 0..self.units[layer] {
                    let square = square.iter().map(|codes| usize::from(codes[channel]));
                    let pooled = match self.pools[layer] {
                        Pool::Max { .. } => square.max().unwrap(),
                        _ => (2 * square.sum::<usize>() + side * side) / (2 * side * side),
                    };
                    map.push(pooled as u8);
                }
            }
        }
        map
    }

    /// An engine in which a convolution is a dense layer: a layer of nothing below it, one above.
    fn twin(&self, layer: usize, windows: [&[Vec<u8>]; 2], backend: Backend) -> Engine {
        let own = self.spec(layer);
        let dense = LayerSpec { convolution: None, pool: Pool::None, ..own.clone() };
        let below = LayerSpec {
            inputs: 1,
            units: dense.inputs,
            driven_by: DrivenBy::Shared,
            constant_row: false,
            ..dense.clone()
        };
        let dense = LayerSpec { driven_by: DrivenBy::Streams, ..dense };
        let above = LayerSpec {
            inputs: dense.units,
            units: OUTPUTS,
            wiring: Wiring::DualReadout,
            driven_by: DrivenBy::Streams,
            ..dense.clone()
        };
        let layers = vec![
            Layer::new(90, below.clone(), Self::taps(below.units), &self.chip),
            Layer::new(layer as u16, dense.clone(), Self::taps(dense.units), &self.chip),
            Layer::new(91, above, Delivery::output(OUTPUTS), &self.chip),
        ];
        let mut twin = Engine::new(self.chip.clone(), backend, self.seed, layers);
        twin.set_optimisers(&[self.optimiser; 3]);
        self.load(&mut twin, 1, layer);
        let reads = windows[0].len();
        twin.execute(&Operation::LoadDrives { codes: &vec![0; reads] });
        twin.execute(&Operation::Forward { layer: 0, side: Side::Rows });
        for (drives, windows) in twin.registers[1].drives.iter_mut().zip(windows) {
            drives.fill(0);
            for (read, rows) in windows.iter().enumerate() {
                for (row, &code) in rows.iter().enumerate() {
                    let at = (row / BLOCK_ROWS * reads + read) * BLOCK_ROWS;
                    drives[at + row % BLOCK_ROWS] = code;
                }
            }
        }
        twin.load_constant(1);
        twin.execute(&Operation::Forward { layer: 1, side: Side::Rows });
        twin
    }
}

/// Codes of the units of a dense layer, by stream: `[read][unit]`.
fn codes_of(engine: &Engine, layer: usize, units: usize, reads: usize) -> [Vec<Vec<u8>>; 2] {
    engine.registers[layer + 1].drives.each_ref().map(|drives| {
        let of = |read: usize, unit: usize| {
            drives[(unit / BLOCK_ROWS * reads + read) * BLOCK_ROWS + unit % BLOCK_ROWS]
        };
        (0..reads).map(|read| (0..units).map(|unit| of(read, unit)).collect()).collect()
    })
}

fn levels(engine: &Engine, layer: usize) -> Vec<Vec<u16>> {
    engine.layers()[layer].arrays.iter().map(|array| array.levels().collect()).collect()
}

fn shift(optimiser: Optimiser) -> u32 {
    match optimiser {
        Optimiser::Sign { .. } => 1,
        Optimiser::Rms => (1 << 14) - 1800,
        _ => 11,
    }
}

fn learn(engine: &mut Engine, layer: usize, words: &[i16], now: bool, optimiser: Optimiser) {
    let (samples, shift) = (engine.samples(), shift(optimiser));
    let update = |write, samples| Operation::Update { layer, write, samples, shift };
    engine.execute(&Operation::Error { layer, samples: 0..samples, words, shared: false });
    if now {
        (0..samples).for_each(|b| engine.execute(&update(Write::Now, b..b + 1)));
    } else {
        engine.execute(&update(Write::Add, 0..samples));
        engine.execute(&update(Write::Program, 0..0));
    }
}

/// What a convolution hands on and what it learns, against a dense layer that is shown every window.
fn equals_its_twin(net: &Net) -> Result<(), TestCaseError> {
    for backend in Backend::available() {
        let mut engine = net.engine(backend);
        engine.set_phase(Phase::Training);
        engine.execute(&Operation::LoadDrives { codes: &net.codes() });
        for layer in 0..3 {
            engine.execute(&Operation::Forward { layer, side: Side::Rows });
        }
        let mut maps = [net.codes(), net.codes()];
        for layer in 0..2 {
            let windows = maps.each_ref().map(|map| net.windows(layer, map));
            let reads = windows[0].len();
            let mut twin = net.twin(layer, [&windows[0], &windows[1]], backend);
            let words = net.words();
            let positions = net.shapes[layer].positions();
            let repeated: Vec<i16> =
                words.chunks(OUTPUTS).flat_map(|words| words.repeat(positions)).collect();
            let said = codes_of(&twin, 1, net.units[layer], reads);
            learn(&mut engine, layer, &words, false, net.optimiser);
            learn(&mut twin, 1, &repeated, false, net.optimiser);
            prop_assert_eq!(levels(&engine, layer), levels(&twin, 1), "layer {}", layer);
            maps = said.each_ref().map(|reads| net.pooled(layer, reads));
        }
        // what the last layer is driven with
        let inputs = net.spec(2).inputs;
        for (drives, map) in engine.registers[2].drives.iter().zip(&maps) {
            for (sample, codes) in map.chunks(inputs).enumerate() {
                for (row, &code) in codes.iter().enumerate() {
                    let at = (row / BLOCK_ROWS * net.samples + sample) * BLOCK_ROWS;
                    prop_assert_eq!(drives[at + row % BLOCK_ROWS], code);
                }
            }
        }
    }
    Ok(())
}

#[test]
fn a_window_that_covers_its_map_has_one_position() {
    let optimisers = [Optimiser::Plain, Optimiser::Sign { dead_zone: true }, Optimiser::Rms];
    for (at, optimiser) in (0..).zip(optimisers) {
        let net = Net {
            seed: at,
            shapes: [shape(7, [3, 3], 3, 1, 0), shape(20, [1, 1], 1, 1, 0)],
            pools: [Pool::None, Pool::None],
            units: [20, 5],
            constant_row: at == 1,
            samples: 2,
            optimiser,
            chip: Hardware::reference(),
        };
        equals_its_twin(&net).unwrap();
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn a_convolution_is_its_unrolled_dense_twin(net in net()) {
        equals_its_twin(&net)?;
    }

    #[test]
    fn a_sample_that_is_written_at_once_adds_up_over_its_positions(net in net()) {
        prop_assume!(net.optimiser == Optimiser::Plain);
        let mut one = net.clone();
        one.samples = 1;
        let mut now = one.engine(Backend::Scalar);
        let mut later = one.engine(Backend::Scalar);
        for (engine, at_once) in [(&mut now, true), (&mut later, false)] {
            engine.execute(&Operation::LoadDrives { codes: &one.codes() });
            for layer in 0..3 {
                engine.execute(&Operation::Forward { layer, side: Side::Rows });
            }
            for layer in 0..2 {
                learn(engine, layer, &one.words(), at_once, Optimiser::Plain);
            }
        }
        for layer in 0..2 {
            prop_assert_eq!(levels(&now, layer), levels(&later, layer));
        }
    }

    #[test]
    fn centred_sums_of_many_reads_are_exact(net in net(), loud: bool) {
        let mut net = net;
        net.optimiser = Optimiser::Sign { dead_zone: true };
        let mut engine = net.engine(Backend::available()[0]);
        engine.set_centred(&[Some(9); 3]);
        let mut codes = net.codes();
        if loud {
            codes.fill(net.chip.drive.bits.code_max());
        }
        engine.execute(&Operation::LoadDrives { codes: &codes });
        for layer in 0..3 {
            engine.execute(&Operation::Forward { layer, side: Side::Rows });
        }
        let windows = net.windows(0, &codes);
        let words = net.words();
        learn(&mut engine, 0, &words, false, net.optimiser);
        let shape = net.shapes[0];
        let registers = &engine.registers[0];
        let stride = stride_of(windows.len());
        let pixels = (net.samples * shape.height * shape.width) as i64;
        for (array, stream) in [(0, Stream::P), (2, Stream::N)] {
            // the row behind those of the window is driven everywhere, with the greatest code
            let constant = net.constant_row.then_some((0, shape.rows()));
            let cells = [(0, 0), (net.units[0] - 1, shape.rows() - 1)];
            for (unit, row) in cells.into_iter().chain(constant) {
                let gates: Vec<i64> = (0..windows.len())
                    .map(|read| registers.gates[stream.index()][packed_at(stride, read, unit)].into())
                    .collect();
                let most = net.chip.drive.bits.code_max();
                let drive = |rows: &[u8]| rows.get(row).copied().unwrap_or(most);
                let products = windows.iter().zip(&gates).map(|(r, u)| i64::from(drive(r)) * u);
                let sum = if row < shape.rows() {
                    let all = codes.iter().skip(row % shape.channels).step_by(shape.channels);
                    all.map(|&code| i64::from(code)).sum()
                } else {
                    pixels * i64::from(most)
                };
                let mean = (2 * (sum << 4) + pixels) / (2 * pixels);
                let want = (products.sum::<i64>() << 4) - mean * gates.iter().sum::<i64>();
                let layout = engine.layers()[0].layout;
                let half = layout.index(row, unit) / 1024;
                let at = half * 1024 + row % BLOCK_ROWS * 16 + unit % 16;
                let got = registers.sums[array * layout.cells_padded() + at];
                prop_assert_eq!(i64::from(got), want, "{} {} {}", array, unit, row);
            }
        }
    }
}
