//! Errors that come back through convolutions and pools, against the dense layers that these unroll to: a row a code of the
//! image, a column a position and unit, and the level of a tap wherever a window meets it.

use proptest::prelude::*;

use super::super::super::error::{packed_at, stride_of};
use super::super::super::{Engine, Operation, Side};
use crate::chip::crossbar::kernel::{Backend, ConvShape};
use crate::chip::crossbar::layout::BLOCK_ROWS;
use crate::chip::hardware::{Hardware, Window};
use crate::chip::layer::{Delivery, DrivenBy, Homeostasis, InitialLevels, Layer, LayerSpec, Pool};
use crate::chip::ledger::{During, Event};
use crate::chip::population::{Stream, Wiring};
use crate::num::fixed::{DriveBits, ErrorBits, LevelBits, rsh, sat};
use crate::num::tables::Activation;

const OUTPUTS: usize = 3;

fn number(seed: u64, at: usize, below: usize) -> usize {
    let mixed = (seed ^ at as u64).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    (mixed ^ mixed >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9) as usize % (1 << 40) % below
}

/// Two convolutions and outputs, all of differential pairs.
#[derive(Debug, Clone)]
struct Net {
    seed: u64,
    convolutions: Vec<LayerSpec>,
    samples: usize,
    chip: Hardware,
}

/// What is wished for of a convolution: side, stride, border, units, side of the pool and whether it takes the greatest.
type Wish = (usize, usize, usize, usize, usize, bool);

fn count() -> impl Strategy<Value = usize> {
    prop_oneof![8 => 1usize..=6, 1 => 30usize..=40, 1 => 63usize..=66]
}

fn wish() -> impl Strategy<Value = Wish> {
    (1usize..=3, 1usize..=3, 0usize..=2, count(), 1usize..=3, any::<bool>())
}

fn convolution(channels: usize, [height, width]: [usize; 2], wish: Wish) -> LayerSpec {
    let (side, stride, pad, units, pool, greatest) = wish;
    let side = side.min(height).min(width);
    let shape = ConvShape { channels, height, width, side, stride, pad: pad.min(side - 1) };
    let fits = shape.output().iter().all(|size| size.is_multiple_of(pool));
    LayerSpec {
        inputs: shape.rows(),
        units,
        wiring: Wiring::Single,
        driven_by: DrivenBy::Streams,
        activation: Activation::Relu,
        weight_max_log2: 1,
        initial: InitialLevels::Uniform { gain_64ths: [64, 64] },
        constant_row: false,
        convolution: Some(shape),
        copies: 1,
        pool: match (fits, greatest) {
            (false, _) => Pool::None,
            (true, true) => Pool::Max { side: pool },
            (true, false) => Pool::Average { side: pool },
        },
        homeostasis: Homeostasis::OFF,
    }
}

fn chip() -> impl Strategy<Value = Hardware> {
    (1i64..=8, 1i64..=9, 2i64..=9, 3usize..90).prop_map(|(drive, level, error, tile)| {
        let level_bits = LevelBits::new(level).unwrap();
        let changed = Hardware::reference().with(|h| {
            [h.tile.rows, h.tile.columns] = [tile, tile];
            h.tile.transposed_read = true;
            h.drive.bits = DriveBits::new(drive).unwrap();
            h.drive.dac_bits = 2.min(drive as u32);
            h.cell.level_bits = level_bits;
            h.cell.window = Window::new(0, (1 << level) - 1, level_bits).unwrap();
            h.digital.error_bits = ErrorBits::new(error).unwrap();
            h.timing = None;
        });
        changed.expect("a chip")
    })
}

fn net() -> impl Strategy<Value = Net> {
    let first = (count(), [2usize..=5, 2usize..=5]);
    (any::<u64>(), first, [wish(), wish()], 1usize..=3, any::<bool>(), chip()).prop_map(
        |(seed, (channels, image), wishes, samples, rows, chip)| {
            let mut convolutions: Vec<LayerSpec> = vec![];
            for wish in wishes {
                let (channels, image) =
                    convolutions.last().map_or((channels, image), |l| (l.units, l.pooled()));
                let spec = convolution(channels, image, wish);
                convolutions.push(LayerSpec { constant_row: rows, ..spec });
            }
            convolutions[0].driven_by = DrivenBy::Shared;
            Net { seed, convolutions, samples, chip }
        },
    )
}

/// Places of a square of a pixel: `[sample][y][x]` of the map before the pool.
fn square(spec: &LayerSpec, pixel: usize) -> Vec<usize> {
    let ([down, across], side) = (spec.convolution.unwrap().output(), spec.pool.side());
    let [height, width] = spec.pooled();
    let (sample, pixel) = (pixel / (height * width), pixel % (height * width));
    let (top, left) = (pixel / width * side, pixel % width * side);
    (0..side * side).map(|k| (sample * down + top + k / side) * across + left + k % side).collect()
}

/// Pools codes `[sample][position][unit]`.
fn pooled(spec: &LayerSpec, codes: &[u8]) -> Vec<u8> {
    let (units, size) = (spec.units, spec.pool.side().pow(2));
    let count = codes.len() / size;
    let code = |i: usize| {
        let square = square(spec, i / units);
        let square = square.iter().map(|at| usize::from(codes[at * units + i % units]));
        match spec.pool {
            Pool::Max { .. } => square.max().unwrap() as u8,
            _ => ((2 * square.sum::<usize>() + size) / (2 * size)) as u8,
        }
    };
    (0..count).map(code).collect()
}

impl Net {
    fn engine(&self, backend: Backend) -> Engine {
        let last = &self.convolutions[1];
        let output = LayerSpec {
            inputs: last.sample_outputs(),
            units: OUTPUTS,
            convolution: None,
            copies: 1,
            pool: Pool::None,
            ..last.clone()
        };
        let specs = self.convolutions.iter().cloned().chain([output]);
        let layers = specs.enumerate().map(|(at, spec)| {
            let delivery = match at {
                2 => Delivery::output(OUTPUTS),
                _ => Delivery::above(spec.units),
            };
            Layer::new(at as u16, spec, delivery, &self.chip)
        });
        let mut engine = Engine::new(self.chip.clone(), backend, self.seed, layers.collect());
        for layer in 0..3 {
            let layout = engine.layers()[layer].layout;
            for (array, row) in (0..2).flat_map(|a| (0..layout.rows).map(move |r| (a, r))) {
                let level = |column| self.level(layer, array, row, column);
                let levels: Vec<_> = (0..layout.columns).map(level).collect();
                engine.execute(&Operation::LoadWeights { layer, array, row, levels: &levels });
            }
        }
        engine
    }

    fn level(&self, layer: usize, array: usize, row: usize, column: usize) -> u16 {
        let top = usize::from(self.chip.cell.window.ceiling()) + 1;
        number(self.seed, ((layer * 2 + array) * 10_000 + row) * 1000 + column, top) as u16
    }

    fn codes(&self) -> Vec<u8> {
        let top = usize::from(self.chip.drive.bits.code_max()) + 1;
        let count = self.samples * self.convolutions[0].sample_inputs();
        (0..count).map(|at| number(!self.seed, at, top) as u8).collect()
    }

    fn words(&self) -> Vec<i16> {
        let rail = (1 << (self.chip.digital.error_bits.get() - 1)) - 1;
        let word = |at| number(self.seed ^ 77, at, 2 * rail + 1) as i16 - rail as i16;
        (0..self.samples * OUTPUTS).map(word).collect()
    }

    /// Row sums of a transposed read as words.
    fn scaled(&self, sums: &[i64]) -> Vec<i16> {
        let (levels, bits) = (self.chip.cell.level_bits.get(), self.chip.digital.error_bits.get());
        let shift = i64::from(levels + 8) - 1 - i64::from(bits);
        let word = |&d: &i64| match u32::try_from(shift) {
            Ok(shift) => sat(rsh(d, shift), bits).0 as i16,
            Err(_) => sat(d << -shift, bits).0 as i16,
        };
        sums.iter().map(word).collect()
    }

    /// Words of the pixels of a map, `[sample][y][x][unit]`, as its positions hear them. `codes` are those of the positions.
    fn heard(&self, layer: usize, words: &[i16], codes: &[u8]) -> Vec<i16> {
        let spec = &self.convolutions[layer];
        let units = spec.units;
        let mut heard = vec![0; codes.len()];
        for (i, &word) in words.iter().enumerate() {
            let mut square = square(spec, i / units);
            square.iter_mut().for_each(|at| *at = *at * units + i % units);
            if let Pool::Max { .. } = spec.pool {
                let most = square.iter().map(|&at| codes[at]).max().unwrap();
                heard[*square.iter().find(|&&at| codes[at] == most).unwrap()] = word;
            } else {
                square.iter().for_each(|&at| heard[at] = word);
            }
        }
        heard
    }

    /// The dense net that a convolution unrolls to, driven by what drives it: nothing below it, and one output above.
    fn twin(&self, layer: usize, image: &[u8], backend: Backend) -> Engine {
        let own = &self.convolutions[layer];
        let shape = own.convolution.unwrap();
        let dense = LayerSpec {
            inputs: own.sample_inputs(),
            units: shape.positions() * own.units,
            driven_by: DrivenBy::Streams,
            convolution: None,
            copies: 1,
            pool: Pool::None,
            ..own.clone()
        };
        let below = LayerSpec {
            inputs: 1,
            units: dense.inputs,
            driven_by: DrivenBy::Shared,
            constant_row: false,
            ..dense.clone()
        };
        let above = LayerSpec { inputs: dense.units, units: 1, ..dense.clone() };
        let layers = vec![
            Layer::new(90, below.clone(), Delivery::output(below.units), &self.chip),
            Layer::new(91, dense.clone(), Delivery::output(dense.units), &self.chip),
            Layer::new(92, above, Delivery::output(1), &self.chip),
        ];
        let mut twin = Engine::new(self.chip.clone(), backend, self.seed, layers);
        let rows = dense.inputs + usize::from(own.constant_row);
        for (array, row) in (0..2).flat_map(|array| (0..rows).map(move |row| (array, row))) {
            let level = |column: usize| {
                let (position, unit) = (column / own.units, column % own.units);
                if row == dense.inputs {
                    return self.level(layer, array, own.inputs, unit);
                }
                let (pixel, channel) = (row / shape.channels, row % shape.channels);
                let (y, x) = (pixel / shape.width + shape.pad, pixel % shape.width + shape.pad);
                let across = shape.output()[1];
                let ky = y.checked_sub(position / across * shape.stride);
                let kx = x.checked_sub(position % across * shape.stride);
                match (ky.filter(|&k| k < shape.side), kx.filter(|&k| k < shape.side)) {
                    (Some(ky), Some(kx)) => {
                        let tap = (ky * shape.side + kx) * shape.channels + channel;
                        self.level(layer, array, tap, unit)
                    }
                    _ => 0,
                }
            };
            let levels: Vec<_> = (0..dense.units).map(level).collect();
            twin.execute(&Operation::LoadWeights { layer: 1, array, row, levels: &levels });
        }
        twin.execute(&Operation::LoadDrives { codes: &vec![0; self.samples] });
        twin.execute(&Operation::Forward { layer: 0, side: Side::Rows });
        let drives = &mut twin.registers[1].drives[0];
        for (i, &code) in image.iter().enumerate() {
            let (sample, row) = (i / dense.inputs, i % dense.inputs);
            let at = (row / BLOCK_ROWS * self.samples + sample) * BLOCK_ROWS + row % BLOCK_ROWS;
            drives[at] = code;
        }
        twin.load_constant(1);
        twin.execute(&Operation::Forward { layer: 1, side: Side::Rows });
        twin
    }

    /// Rows of all positions of a sample that meet a pixel.
    fn taps_on_image(&self, layer: usize) -> u64 {
        let shape = self.convolutions[layer].convolution.unwrap();
        let [down, across] = shape.output();
        let mut count = 0;
        for (y, x) in (0..down).flat_map(|y| (0..across).map(move |x| (y, x))) {
            for (ky, kx) in (0..shape.side).flat_map(|ky| (0..shape.side).map(move |kx| (ky, kx))) {
                let (py, px) = (y * shape.stride + ky, x * shape.stride + kx);
                let on = (shape.pad..shape.pad + shape.height).contains(&py)
                    && (shape.pad..shape.pad + shape.width).contains(&px);
                count += if on { shape.channels as u64 } else { 0 };
            }
        }
        count
    }
}

/// Codes of units, `[sample][unit]`, from where a dense layer above is driven.
fn codes_of(engine: &Engine, layer: usize) -> Vec<u8> {
    let (drives, samples) = (&engine.registers[layer + 1].drives[0], engine.samples());
    let units = engine.layers()[layer].spec.units;
    let places = (0..samples).flat_map(|sample| (0..units).map(move |unit| (sample, unit)));
    let at = |(s, unit): (usize, usize)| (unit / BLOCK_ROWS * samples + s) * BLOCK_ROWS;
    places.map(|place| drives[at(place) + place.1 % BLOCK_ROWS]).collect()
}

/// Gates of a layer, `[read][unit]`.
fn gates_of(engine: &Engine, layer: usize) -> Vec<i8> {
    let (reads, units) = (engine.reads(layer), engine.layers()[layer].spec.units);
    let gates = &engine.registers[layer].gates[Stream::P.index()];
    let places = (0..reads).flat_map(|read| (0..units).map(move |unit| (read, unit)));
    places.map(|(read, unit)| gates[packed_at(stride_of(reads), read, unit)]).collect()
}

fn hear(engine: &mut Engine, layer: usize, words: &[i16]) {
    let samples = 0..engine.samples();
    engine.execute(&Operation::Error { layer, samples, words, shared: false });
}

/// Sums that were added to those of pixels, by the ledger.
fn added(engine: &Engine, layer: usize) -> u64 {
    let ledger = engine.ledger(engine.phase());
    let of = |event| -> u64 {
        (0..8).map(|code| ledger.get(layer, code, During::ForwardColumns, event)).sum()
    };
    of(Event::ShiftAdds) - of(Event::Conversions)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn errors_come_back_as_through_unrolled_dense_layers(net in net()) {
        for backend in Backend::available() {
            let mut engine = net.engine(backend);
            engine.execute(&Operation::LoadDrives { codes: &net.codes() });
            for layer in 0..3 {
                engine.execute(&Operation::Forward { layer, side: Side::Rows });
            }
            hear(&mut engine, 2, &net.words());
            for layer in [1, 0] {
                let side = Side::Columns;
                engine.execute(&Operation::Forward { layer: layer + 1, side });
                hear(&mut engine, layer, &[]);
            }
            // what the outputs hand down
            let (gates, inputs) = (gates_of(&engine, 2), engine.layers()[2].spec.inputs);
            let down = (0..net.samples * inputs).map(|at| {
                let weight = |unit: usize| {
                    let [e, i] = [0, 1].map(|array| net.level(2, array, at % inputs, unit));
                    i64::from(e) - i64::from(i)
                };
                let gate = |unit: usize| i64::from(gates[at / inputs * OUTPUTS + unit]);
                (0..OUTPUTS).map(|unit| weight(unit) * gate(unit)).sum::<i64>()
            });
            let mut sums: Vec<i64> = down.collect();
            prop_assert_eq!(&sums, engine.backward(2));
            // what drives each convolution is the map below, in the order y, x, channel
            let mut twins = vec![net.twin(0, &net.codes(), backend)];
            let map = pooled(&net.convolutions[0], &codes_of(&twins[0], 1));
            twins.push(net.twin(1, &map, backend));
            for layer in [1, 0] {
                let twin = &mut twins[layer];
                let words = net.heard(layer, &net.scaled(&sums), &codes_of(twin, 1));
                hear(twin, 1, &words);
                prop_assert_eq!(gates_of(&engine, layer), gates_of(twin, 1), "gates of {}", layer);
                if layer > 0 {
                    twin.execute(&Operation::Forward { layer: 1, side: Side::Columns });
                    sums = twin.backward(1).to_vec();
                    prop_assert_eq!(&sums, engine.backward(layer), "sums of {}", layer);
                }
            }
            let folded = net.taps_on_image(1) * net.samples as u64;
            prop_assert_eq!([added(&engine, 1), added(&engine, 2)], [folded, 0]);
        }
    }
}
