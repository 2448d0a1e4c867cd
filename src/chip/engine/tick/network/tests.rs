//! Convolutions cycle by cycle: small nets that read, hear and learn in every mode, against the engine's closed forms.

use proptest::prelude::*;

use super::Network;
use crate::chip::crossbar::kernel::{Backend, ConvShape};
use crate::chip::device::{Chance, Faults, ReadNoise};
use crate::chip::engine::{Engine, Operation, Phase, Side, Write, WritesDone};
use crate::chip::hardware::timing::{PulseCode, Timing};
use crate::chip::hardware::{Adc, AdcRange, Hardware, HardwareSpec, Subtract, Window};
use crate::chip::layer::{
    Delivery, DrivenBy, Gain, Homeostasis, InitialLevels, Layer, LayerSpec, Optimiser, Pool, Taps,
};
use crate::chip::ledger::{During, Event};
use crate::chip::population::{Stream, Wiring};
use crate::num::fixed::{AdcBits, DriveBits, LevelBits, ResidualBits};
use crate::num::tables::Activation;

const WORDS: usize = 3;

fn number(seed: u64, at: usize, below: usize) -> usize {
    let mixed = (seed ^ at as u64).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    (mixed ^ mixed >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9) as usize % (1 << 40) % below
}

/// How a batch is learnt from.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Mode {
    Accumulate,
    Replay,
    Online,
}

/// One or two convolutions, and outputs.
#[derive(Debug, Clone)]
struct Net {
    seed: u64,
    convolutions: Vec<LayerSpec>,
    wirings: [Wiring; 2],
    mode: Mode,
    optimiser: Optimiser,
    centred: bool,
    taps: usize,
    /// Whether errors come back through the layers.
    back: bool,
    batches: Vec<usize>,
    chip: Hardware,
}

/// What is wished for of a convolution: side, stride, border, units, side of the pool and whether it takes the greatest.
type Wish = (usize, usize, usize, usize, usize, bool);

fn wish() -> impl Strategy<Value = Wish> {
    (1usize..=3, 1usize..=2, 0usize..=2, 1usize..=4, 1usize..=2, any::<bool>())
}

fn law() -> impl Strategy<Value = Homeostasis> {
    let gain = prop_oneof![
        Just(Gain::Table),
        (0u32..=2).prop_map(|spread| Gain::Fixed { spread }),
        Just(Gain::Tracking),
    ];
    (any::<bool>(), gain, 2u32..=5).prop_map(|(threshold, gain, window_log2)| Homeostasis {
        threshold,
        gain,
        window_log2,
    })
}

/// A convolution of an image, as near to a wish as the image allows.
fn convolution(
    channels: usize,
    [height, width]: [usize; 2],
    (wish, law): (Wish, Homeostasis),
    rows: bool,
) -> LayerSpec {
    let (side, stride, pad, units, pool, greatest) = wish;
    let side = side.min(height).min(width);
    let shape = ConvShape { channels, height, width, side, stride, pad: pad.min(side - 1) };
    let fits = pool > 1 && shape.output().iter().all(|size| size.is_multiple_of(pool));
    LayerSpec {
        inputs: shape.rows(),
        units,
        wiring: Wiring::Dual,
        driven_by: DrivenBy::Streams,
        activation: if law.gain == Gain::Table { Activation::Relu } else { Activation::Ramp },
        weight_max_log2: 0,
        initial: InitialLevels::Uniform { gain_64ths: [64, 64] },
        constant_row: rows,
        convolution: Some(shape),
        copies: 1,
        pool: match (fits, greatest) {
            (false, _) => Pool::None,
            (true, true) => Pool::Max { side: pool },
            (true, false) => Pool::Average { side: pool },
        },
        homeostasis: law,
    }
}

fn timing() -> impl Strategy<Value = Timing> {
    (
        (1u64..=2, 1u64..=6, 1u64..=2, 1u64..=4, any::<bool>(), 1u64..=4),
        (0u64..=2, 1u64..=2, any::<bool>(), any::<bool>(), prop::option::of(1u64..=5)),
    )
        .prop_map(|((beat, settle, convert, share, overlapped, lanes), rest)| {
            let (hops, pulse, amplitude, verify, active_max) = rest;
            let pulse_code = if amplitude { PulseCode::Amplitude } else { PulseCode::Unary };
            Timing {
                clock_khz: 1,
                beat,
                settle,
                convert,
                share,
                overlapped,
                lanes,
                hops,
                pulse,
                pulse_code,
                verify,
                active_max,
                slices: None,
            }
        })
}

fn chip() -> impl Strategy<Value = Hardware> {
    let range = prop_oneof![Just(AdcRange::Tracking), Just(AdcRange::Shift(1))];
    let subtract = prop_oneof![Just(Subtract::Digital), Just(Subtract::Current)];
    let finite = (4i64..=7, subtract, range).prop_map(|(bits, subtract, range)| Adc::Finite {
        bits: AdcBits::new(bits).unwrap(),
        subtract,
        range,
    });
    let adc = prop_oneof![1 => Just(Adc::Ideal), 2 => finite];
    let tile = [prop_oneof![Just(64usize), 2usize..=9], prop_oneof![Just(32usize), 1usize..=3]];
    (adc, tile, 1i64..=8, 2u32..=8, 0i64..=4, timing()).prop_map(
        |(adc, tile, drive, dac, residual, timing)| {
            let bits = LevelBits::new(6).unwrap();
            let chip = Hardware::reference().with(|h| {
                h.cell.level_bits = bits;
                h.cell.window = Window::new(3, 50, bits).unwrap();
                h.adc = adc;
                [h.tile.rows, h.tile.columns] = tile;
                h.drive.bits = DriveBits::new(drive).unwrap();
                h.drive.dac_bits = dac.min(drive as u32);
                h.write.residual_bits = ResidualBits::new(residual).unwrap();
                h.timing = Some(timing);
            });
            chip.expect("a chip")
        },
    )
}

fn net() -> impl Strategy<Value = Net> {
    let wirings = vec![
        [Wiring::Dual, Wiring::DualReadout],
        [Wiring::Dual, Wiring::Dual],
        [Wiring::Single, Wiring::Single],
        [Wiring::DualPairs, Wiring::DualPairs],
    ];
    let optimisers = vec![
        Optimiser::Plain,
        Optimiser::Plain,
        Optimiser::Sign { dead_zone: true },
        Optimiser::Rms,
        Optimiser::Momentum { decay: 2 },
        Optimiser::AdamFx { first_decay: 2, second_decay: 3 },
    ];
    let modes = prop_oneof![
        2 => Just(Mode::Accumulate), 1 => Just(Mode::Replay), 1 => Just(Mode::Online)
    ];
    (
        any::<u64>(),
        (1usize..=3, [2usize..=6, 2usize..=6]),
        prop::collection::vec((wish(), law()), 1..=2),
        prop::sample::select(wirings),
        (modes, prop::sample::select(optimisers), any::<bool>()),
        (1usize..=2, prop::collection::vec(1usize..=3, 1..=2), any::<bool>(), any::<bool>()),
        chip(),
    )
        .prop_map(|(seed, (channels, image), wishes, wirings, learning, rest, chip)| {
            let (mode, optimiser, centred) = learning;
            let (taps, batches, rows, back) = rest;
            let back = back && wirings[0] == Wiring::Single;
            let mut convolutions: Vec<LayerSpec> = vec![];
            for wish in wishes {
                let (channels, image) =
                    convolutions.last().map_or((channels, image), |l| (l.units, l.pooled()));
                let spec = convolution(channels, image, wish, rows);
                let most = spec.positions().min(7);
                let copies =
                    1 + number(seed, 31 + convolutions.len(), 2 * most).saturating_sub(most);
                convolutions.push(LayerSpec { wiring: wirings[0], copies, ..spec });
            }
            convolutions[0].driven_by = DrivenBy::Shared;
            let (optimiser, centred) = match mode {
                Mode::Accumulate => (optimiser, centred),
                _ => (Optimiser::Plain, false),
            };
            let sign = optimiser.is_sign();
            let whole = |h: &mut crate::chip::hardware::HardwareSpec| {
                h.write.residual_bits = ResidualBits::new(0).unwrap();
            };
            let chip = if sign { chip.with(whole).unwrap() } else { chip };
            let ideal = |h: &mut crate::chip::hardware::HardwareSpec| {
                (h.adc, h.tile.transposed_read) = (Adc::Ideal, true);
            };
            let chip = if back { chip.with(ideal).unwrap() } else { chip };
            Net { seed, convolutions, wirings, mode, optimiser, centred, taps, back, batches, chip }
        })
}

impl Net {
    /// The same on arrays that stand once.
    fn alone(&self) -> Self {
        let mut alone = self.clone();
        alone.convolutions.iter_mut().for_each(|one| one.copies = 1);
        alone
    }

    fn layers(&self) -> Vec<Layer> {
        let last = self.convolutions.last().expect("there is one");
        let output = LayerSpec {
            inputs: last.sample_outputs(),
            units: WORDS,
            wiring: self.wirings[1],
            driven_by: DrivenBy::Streams,
            convolution: None,
            copies: 1,
            pool: Pool::None,
            activation: Activation::Relu,
            homeostasis: Homeostasis::OFF,
            ..last.clone()
        };
        let specs = self.convolutions.iter().cloned().chain([output]);
        let layers = specs.enumerate().map(|(at, spec)| {
            let delivery = if at == self.convolutions.len() {
                Delivery::output(WORDS)
            } else if self.back {
                Delivery::above(spec.units)
            } else {
                let tap = |at: usize| number(self.seed, at, WORDS) as u16;
                let words = (0..spec.units * self.taps).map(tap).collect();
                Taps { width: WORDS, per_unit: self.taps, words, shift: 0 }.into()
            };
            let mut layer = Layer::new(at as u16, spec, delivery, &self.chip);
            let layout = layer.layout;
            for (array, cells) in layer.arrays.iter_mut().enumerate() {
                for row in 0..layout.rows {
                    let place = |column| ((at * 8 + array) * 1000 + row) * 1000 + column;
                    let level = |column| 3 + number(self.seed, place(column), 48) as u16;
                    cells.load_row(row, &(0..layout.columns).map(level).collect::<Vec<_>>());
                }
            }
            layer
        });
        layers.collect()
    }

    fn engine(&self) -> Engine {
        let layers = self.layers();
        let count = layers.len();
        let mut engine = Engine::new(self.chip.clone(), Backend::best(), self.seed, layers);
        engine.set_optimisers(&vec![self.optimiser; count]);
        engine.set_centred(&vec![self.centred.then_some(3); count]);
        engine
    }

    fn shift(&self) -> u32 {
        match self.optimiser {
            Optimiser::Sign { .. } => 1,
            Optimiser::AdamFx { .. } => 10,
            Optimiser::Rms => (1 << 14) - 1800,
            _ => 9,
        }
    }

    /// Learns from some samples of a batch, which are loaded.
    fn learn(&self, engine: &mut Engine, batch: usize, samples: usize) {
        let layers = engine.layers().len();
        let word = |at| number(self.seed ^ 77, batch * 1000 + at, 255) as i16 - 127;
        let words: Vec<i16> = (0..samples * WORDS).map(word).collect();
        let (words, all) = (&words[..], 0..samples);
        for layer in 0..layers {
            engine.execute(&Operation::Forward { layer, side: Side::Rows });
        }
        let shift = self.shift();
        if self.back {
            for layer in (0..layers).rev() {
                let words = if layer + 1 == layers { words } else { &[] };
                let samples = all.clone();
                engine.execute(&Operation::Error { layer, samples, words, shared: false });
                if layer > 0 {
                    engine.execute(&Operation::Forward { layer, side: Side::Columns });
                }
            }
        } else {
            for layer in 0..layers {
                let (samples, shared) = (all.clone(), layer > 0);
                engine.execute(&Operation::Error { layer, samples, words, shared });
            }
        }
        if self.mode == Mode::Accumulate {
            for (write, samples) in [(Write::Add, all), (Write::Program, 0..0)] {
                for layer in 0..layers {
                    let samples = samples.clone();
                    engine.execute(&Operation::Update { layer, write, samples, shift });
                }
            }
            engine.written(WritesDone::Batch);
            return;
        }
        for sample in all {
            for layer in 0..layers {
                let samples = sample..sample + 1;
                engine.execute(&Operation::Update { layer, write: Write::Now, samples, shift });
            }
        }
        let online = self.mode == Mode::Online;
        engine.written(if online { WritesDone::Sample } else { WritesDone::Batch });
    }

    fn codes(&self, batch: usize, samples: usize) -> Vec<u8> {
        let top = usize::from(self.chip.drive.bits.code_max()) + 1;
        let code = |at| number(!self.seed, batch * 10_000 + at, top) as u8;
        (0..samples * self.convolutions[0].sample_inputs()).map(code).collect()
    }

    fn batch(&self, engine: &mut Engine, batch: usize) {
        let (samples, inputs) = (self.batches[batch], self.convolutions[0].sample_inputs());
        let codes = self.codes(batch, samples);
        let together = if self.mode == Mode::Online { 1 } else { samples };
        for codes in codes.chunks(together * inputs) {
            engine.execute(&Operation::LoadDrives { codes });
            self.learn(engine, batch, together);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_convolution_takes_the_cycles_of_its_closed_form(mut net in net()) {
        // one chip in three has noisy conversions, one in three stuck cells, which no two copies would share
        let share = Chance::new(1 << 29).unwrap();
        let faults = Faults { floor: share, ceiling: share, any: share };
        let flaws = |h: &mut HardwareSpec| {
            h.faults = if net.seed % 3 == 0 { faults } else { Faults::NONE };
            h.read_noise = (net.seed / 3 % 3 == 0).then_some(ReadNoise { sigma: 1 << 14 });
        };
        net.chip = net.chip.with(flaws).unwrap();
        if net.chip.differs_by_cell().is_some() {
            net.convolutions.iter_mut().for_each(|one| one.copies = 1);
        }
        let mut engine = net.engine();
        let _ = engine.calibrate(&net.codes(9, 3));
        let slots = *net.batches.iter().max().unwrap();
        let mut tick = Network::new(&net.chip, net.seed, engine.layers(), slots);
        for batch in 0..net.batches.len() {
            engine.record(true);
            net.batch(&mut engine, batch);
            engine.settle();
            tick.play_tape(&engine.record(false));
            let phase = Phase::Training;
            prop_assert_eq!(engine.ledger(phase).cycles(), tick.ledger(phase).cycles());
            let counts = [engine.ledger(phase), tick.ledger(phase)];
            let [fast, slow] = counts.map(|ledger| ledger.entries().collect::<Vec<_>>());
            prop_assert_eq!(fast, slow);
            for (at, layer) in engine.layers().iter().enumerate() {
                for (array, cells) in layer.arrays.iter().enumerate() {
                    prop_assert!(cells.levels().eq(tick.levels(at, array)), "{} {}", at, array);
                    let left = cells.residuals().unwrap_or_default();
                    let left: Vec<_> = left.into_iter().map(i64::from).collect();
                    prop_assert!(left.is_empty() || left == tick.residuals(at, array));
                }
                prop_assert_eq!(&layer.adc_shifts[..], tick.adc_shifts(at));
                prop_assert_eq!(engine.backward(at), tick.backward(at), "sums of {}", at);
                let balance = &layer.balance;
                for &target in layer.spec.wiring.targets() {
                    prop_assert_eq!(balance.thresholds(target), tick.thresholds(at, target));
                }
                if balance.law().is_on() {
                    let variance = balance.tracks().then_some(balance.variance());
                    prop_assert_eq!((balance.shift(), variance), tick.table_step(at));
                }
                let followed = layer.requests.followed();
                prop_assert_eq!([followed.power, followed.ends], tick.followed(at));
                for set in [Stream::P, Stream::N] {
                    let (means, own) = (layer.requests.means(set), tick.row_means(at, set));
                    let means = means.iter().map(|&mean| i64::from(mean)).take(own.len());
                    prop_assert!(means.eq(own.iter().copied()), "means of {}", at);
                }
            }
            let outputs = (0..engine.samples()).flat_map(|s| (0..WORDS).map(move |u| (s, u)));
            for (sample, unit) in outputs {
                let got = tick.output(Stream::P, sample, unit);
                prop_assert_eq!(engine.output(Stream::P, sample, unit), got);
            }
        }
    }

    #[test]
    fn copies_move_no_result_and_multiply_what_writes_take(net in net()) {
        let both = [&net, &net.alone()].map(|net| {
            let mut engine = net.engine();
            let _ = engine.calibrate(&net.codes(9, 3));
            let levels = vec![5; net.convolutions[0].units];
            engine.execute(&Operation::LoadWeights { layer: 0, array: 0, row: 0, levels: &levels });
            (0..net.batches.len()).for_each(|batch| net.batch(&mut engine, batch));
            engine.settle();
            engine
        });
        let [shared, alone] = &both;
        let ledgers = [shared, alone].map(|engine| engine.ledger(Phase::Training));
        for (at, layer) in shared.layers().iter().enumerate() {
            let copies = layer.spec.copies as u64;
            let own = alone.layers()[at].arrays.iter();
            for (array, own) in layer.arrays.iter().zip(own) {
                prop_assert!(array.levels().eq(own.levels()), "levels of {}", at);
            }
            for pathway in layer.spec.wiring.pathways() {
                let [this, that] =
                    ledgers.map(|ledger| |event| ledger.of_pathway(at, pathway.code, event));
                for event in Event::ALL {
                    let wanted = match event {
                        Event::RowPulses | Event::VerifyReads => copies * that(event),
                        Event::PulsesCopied => (copies - 1) * that(Event::PulsesAttempted),
                        Event::LoadsCopied => (copies - 1) * that(Event::CellLoads),
                        // sums of thresholds beside, of every copy
                        Event::SramBits if layer.balance.law().threshold => continue,
                        _ => that(event),
                    };
                    prop_assert_eq!(this(event), wanted, "{} of {}", event.name(), at);
                }
            }
            let turns = layer.spec.positions().div_ceil(layer.spec.copies);
            let [this, that] = ledgers.map(|ledger| {
                let cycles = ledger.cycles().unwrap();
                [During::ForwardRows, During::ForwardColumns].map(|during| cycles.busy(at, during))
            });
            for (this, that) in this.into_iter().zip(that) {
                let wanted = that / layer.spec.positions() as u64 * turns as u64;
                prop_assert_eq!(this, wanted, "cycles of reads of {}", at);
            }
        }
    }
}
