//! Networks whose hidden layers keep to a middle, against plain loops and against Tick; and the softmax of their outputs.

use super::super::tick::Network;
use super::super::{Centre, Engine, ErrorUnit, Operation, Phase, Side, Write, WritesDone};
use super::*;
use crate::chip::crossbar::kernel::{Backend, ConvShape};
use crate::chip::hardware::timing::{PulseCode, Timing};
use crate::chip::hardware::{Adc, AdcRange, Hardware, Subtract, Window};
use crate::chip::layer::{Delivery, DrivenBy, Homeostasis, InitialLevels, LayerSpec, Pool, Taps};
use crate::chip::population::Wiring;
use crate::chip::state::{Piece, Section, Seen as Told, State, Visitor};
use crate::num::fixed::{AdcBits, DriveBits, LevelBits, LutBits};
use crate::num::tables::{Activation, Positive, SoftmaxTables};
use bitvec::prelude::{BitVec, Lsb0};
use proptest::prelude::*;

mod plain;

use plain::{Plain, plain_read};

/// The `at`-th of some numbers below `below`.
fn number(seed: u64, at: usize, below: usize) -> usize {
    let mixed = (seed ^ at as u64).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    (mixed ^ mixed >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9) as usize % (1 << 40) % below
}

/// A net of hidden layers that keep to a middle, each in its way, below a layer that does not.
#[derive(Debug, Clone)]
struct Net {
    seed: u64,
    sides: Vec<usize>,
    laws: Vec<Homeostasis>,
    wiring: Wiring,
    samples: usize,
    hardware: Hardware,
    /// The window of the first layer and its channels, whose map is the second side.
    window: Option<(ConvShape, usize)>,
}

const WORDS: usize = 3;

impl Net {
    fn codes(&self, batch: usize) -> Vec<u8> {
        let top = usize::from(self.hardware.drive.bits.code_max()) + 1;
        let of = |at| number(self.seed ^ (batch as u64 * 77), at, top) as u8;
        (0..self.samples * self.sides[0]).map(of).collect()
    }

    fn level(&self, layer: usize, array: usize, row: usize, column: usize) -> u16 {
        let window = self.hardware.cell.window;
        let span = usize::from(window.ceiling() - window.floor()) + 1;
        let place = ((layer * 8 + array) * 2000 + row) * 2000 + column;
        let high = number(self.seed, 2 * place, 3) == 0;
        let offset = number(self.seed, 2 * place + 1, if high { span } else { span.div_ceil(9) });
        window.floor() + offset as u16
    }

    fn layers(&self) -> Vec<Layer> {
        let last = self.sides.len() - 2;
        let one = |at: usize| {
            let law = self.laws.get(at).copied().unwrap_or(Homeostasis::OFF);
            let window = self.window.filter(|_| at == 0);
            let dense = (self.sides[at], self.sides[at + 1]);
            let (inputs, units) = window.map_or(dense, |(shape, units)| (shape.rows(), units));
            let spec = LayerSpec {
                inputs,
                units,
                wiring: self.wiring,
                driven_by: if at == 0 { DrivenBy::Shared } else { DrivenBy::Streams },
                activation: match law.gain {
                    _ if at == last => Activation::Accumulator,
                    Gain::Table => Activation::Relu,
                    _ => Activation::Ramp,
                },
                weight_max_log2: 0,
                initial: InitialLevels::Uniform { gain_64ths: [64, 64] },
                constant_row: false,
                convolution: window.map(|(shape, _)| shape),
                copies: 1,
                pool: Pool::None,
                homeostasis: law,
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

    fn read(&self, engine: &mut Engine, codes: &[u8]) {
        engine.execute(&Operation::LoadDrives { codes });
        for layer in 0..engine.layers().len() {
            engine.execute(&Operation::Forward { layer, side: Side::Rows });
        }
    }
}

fn law() -> impl Strategy<Value = Homeostasis> {
    let gain = prop_oneof![
        1 => Just(Gain::Table),
        1 => (0u32..=2).prop_map(|spread| Gain::Fixed { spread }),
        2 => Just(Gain::Tracking),
    ];
    (prop::bool::weighted(0.8), gain, 4u32..=9)
        .prop_map(|(threshold, gain, window_log2)| Homeostasis { threshold, gain, window_log2 })
}

fn side() -> impl Strategy<Value = usize> {
    prop_oneof![4 => 1usize..=12, 3 => prop::sample::select(vec![31, 32, 33, 63, 64, 65]), 1 => 96usize..=140]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn fast_is_the_law(
        seed: u64,
        sides in prop::collection::vec(side(), 3..=4),
        laws in [law(), law()],
        wiring in prop::sample::select(vec![Wiring::Dual, Wiring::DualPairs, Wiring::Single]),
        samples in prop_oneof![1usize..=5, 14usize..=16],
        level_bits in prop_oneof![2 => Just(8i64), 1 => 1i64..=12],
        drive_bits in prop_oneof![2 => Just(8i64), 1 => 1i64..=8],
        lut_bits in prop_oneof![2 => Just(10i64), 1 => 2i64..=14],
    ) {
        let hardware = Hardware::reference().with(|h| {
            h.cell.level_bits = LevelBits::new(level_bits).unwrap();
            let top = i64::from(h.cell.level_bits.level_max());
            h.cell.window = Window::new(0, top, h.cell.level_bits).unwrap();
            h.drive.bits = DriveBits::new(drive_bits).unwrap();
            h.drive.dac_bits = 1;
            h.digital.lut_bits = LutBits::new(lut_bits).unwrap();
        }).unwrap();
        let laws = laws[..sides.len() - 2].to_vec();
        let net = Net { seed, sides, laws, wiring, samples, hardware, window: None };
        for (backend, threads) in Backend::available().into_iter().zip([1, 2, 1, 2]) {
            let layers = net.layers();
            let mut states: Vec<_> = layers[..net.laws.len()].iter().map(Plain::of).collect();
            let mut engine = Engine::new(net.hardware.clone(), backend, seed, net.layers());
            engine.set_threads(threads).unwrap();
            let first = net.codes(0);
            prop_assert_eq!(engine.calibrate(&first), None);
            let _ = plain_read(&net, &layers, &first, &mut states, true);
            let now = |engine: &Engine| -> Vec<Plain> {
                engine.layers()[..states.len()].iter().map(Plain::of).collect()
            };
            let on = net.laws.iter().any(|law| law.is_on());
            if on {
                let want: Vec<_> = states.iter().enumerate().map(|(at, state)| {
                    // nothing above the last one is looked at
                    if states[at..].iter().any(|s| s.law.is_on()) { state.clone() } else { Plain::of(&layers[at]) }
                }).collect();
                prop_assert_eq!(&now(&engine), &want);
            }
            for batch in 1..=3 {
                let codes = net.codes(batch);
                let wanted = plain_read(&net, &layers, &codes, &mut states, false);
                let before = engine.ledger(Phase::Training).total(Event::SaturatedLookUps);
                net.read(&mut engine, &codes);
                let ends = engine.ledger(Phase::Training).total(Event::SaturatedLookUps) - before;
                prop_assert_eq!(ends, wanted.iter().map(|of| of.1).sum::<u64>());
                for (at, (slopes, _, sums)) in wanted.iter().enumerate() {
                    for &target in wiring.targets() {
                        let got = &engine.registers[at].derivatives[target.index()];
                        for (sample, row) in slopes[target.index()].iter().enumerate() {
                            for (unit, &slope) in row.iter().enumerate() {
                                prop_assert_eq!(got[engine.register_at(sample, unit)], slope);
                            }
                        }
                    }
                    if net.laws[at].is_on() {
                        states[at].written(sums, samples);
                    }
                }
                // evaluations between read and write change nothing
                engine.set_phase(Phase::Evaluation);
                net.read(&mut engine, &first);
                engine.set_phase(Phase::Training);
                engine.written(if batch == 2 { WritesDone::Sample } else { WritesDone::Batch });
                let now: Vec<Plain> = engine.layers()[..states.len()].iter().map(Plain::of).collect();
                prop_assert_eq!(&now, &states);
            }
            let ledger = engine.ledger(Phase::Training);
            for (at, law) in net.laws.iter().enumerate() {
                let code = Engine::code_of(wiring, Stream::P);
                let count = |during, event| ledger.get(at, code, during, event);
                let reads = (3 * samples * net.sides[at + 1]) as u64;
                let adds = u64::from(law.threshold) + u64::from(law.gain == Gain::Tracking);
                prop_assert_eq!(count(During::ForwardRows, Event::StatisticAdds), adds * reads);
                let off = if law.threshold { reads } else { 0 };
                prop_assert_eq!(count(During::ForwardRows, Event::ThresholdSubtractions), off);
                let bits = if law.threshold { 3 * 128 * net.sides[at + 1] as u64 } else { 0 };
                prop_assert_eq!(count(During::Update, Event::SramBits), bits);
            }
        }
    }
}

/// When a batch is written.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Mode {
    Accumulate,
    Replay,
    Online,
}

/// Reads some samples and writes what their errors ask for. What outputs share of the last ones, by softmax.
fn learn(net: &Net, engine: &mut Engine, codes: &[u8], mode: Mode, salt: usize) -> Vec<Vec<u8>> {
    net.read(engine, codes);
    let (layers, samples) = (engine.layers().len(), engine.samples());
    let mut shares = vec![];
    let mut errors = vec![];
    for sample in 0..samples {
        let label = number(net.seed, 5000 + salt + sample, WORDS);
        let out = |unit| engine.output_accumulator(sample, unit);
        let sums: Vec<i64> = (0..WORDS).map(out).collect();
        let mut own = vec![0; WORDS];
        if let Some(tables) = engine.error_unit().softmax() {
            tables.share_out(&sums, &mut own);
        }
        let error =
            |(at, &share): (usize, &u8)| if at == label { 255 } else { 0 } - i32::from(share);
        errors.extend(own.iter().enumerate().map(error));
        shares.push(own);
    }
    let words = engine.output_words(&errors);
    for layer in 0..layers {
        let samples = 0..samples;
        engine.execute(&Operation::Error { layer, samples, words: &words, shared: false });
    }
    let mut update = |write, samples: std::ops::Range<usize>| {
        for layer in 0..layers {
            engine.execute(&Operation::Update { layer, write, samples: samples.clone(), shift: 7 });
        }
    };
    if mode == Mode::Accumulate {
        update(Write::Add, 0..samples);
        update(Write::Program, 0..0);
    } else {
        (0..samples).for_each(|sample| update(Write::Now, sample..sample + 1));
    }
    engine.settle();
    engine.written(if mode == Mode::Online { WritesDone::Sample } else { WritesDone::Batch });
    shares
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn tick_agrees_cycle_by_cycle(
        seed: u64,
        sides in prop::collection::vec(1usize..=11, 2..=3),
        laws in [law(), law()],
        wiring in prop::sample::select(vec![Wiring::Dual, Wiring::DualPairs, Wiring::Single]),
        samples in 1usize..=4,
        bits in (1i64..=8, 3i64..=12),
        tile in (1usize..=12, 1usize..=12),
        adc in 0usize..5,
        mode in prop::sample::select(vec![Mode::Accumulate, Mode::Replay, Mode::Online]),
        unit in (any::<bool>(), prop::sample::select(vec![Centre::None, Centre::Batch, Centre::Running])),
        times in (1u64..=9, 1u64..=3, 1u64..=6, any::<bool>(), 1u64..=12, 1u64..=3),
        window in prop::option::weighted(
            0.4, (1usize..=2, [2usize..=4, 2usize..=4], 1usize..=2, 1usize..=2, 0usize..=1, 1usize..=4),
        ),
    ) {
        let (settle, convert, share, overlapped, lanes, beat) = times;
        let timing = Timing {
            clock_khz: 1, beat, settle, convert, share, overlapped, lanes, hops: 1, pulse: 2,
            pulse_code: PulseCode::Unary, verify: false, active_max: None, slices: None,
        };
        let finite = |subtract, range| {
            Adc::Finite { bits: AdcBits::new(5).unwrap(), subtract, range }
        };
        let (drive_bits, lut_bits) = bits;
        let hardware = Hardware::reference().with(|h| {
            h.drive.bits = DriveBits::new(drive_bits).unwrap();
            h.drive.dac_bits = 1;
            h.digital.lut_bits = LutBits::new(lut_bits).unwrap();
            (h.tile.rows, h.tile.columns) = tile;
            h.adc = [
                Adc::Ideal,
                finite(Subtract::Digital, AdcRange::Shift(3)),
                finite(Subtract::Current, AdcRange::Shift(3)),
                finite(Subtract::Digital, AdcRange::Tracking),
                finite(Subtract::Current, AdcRange::Tracking),
            ][adc];
            h.timing = Some(timing);
        }).unwrap();
        let mut sides: Vec<usize> = sides.into_iter().chain([WORDS]).collect();
        let laws = laws[..sides.len() - 2].to_vec();
        let window = window.map(|(channels, [height, width], side, stride, pad, units)| {
            let pad = pad.min(side - 1);
            let shape = ConvShape { channels, height, width, side, stride, pad };
            sides[0] = height * width * channels;
            sides[1] = shape.positions() * units;
            (shape, units)
        });
        let net = Net { seed, sides, laws, wiring, samples, hardware, window };
        let mut engine = Engine::new(net.hardware.clone(), Backend::best(), seed, net.layers());
        let _ = engine.calibrate(&net.codes(0));
        let (softmax, centre) = unit;
        let mut unit = ErrorUnit::new(centre, net.hardware.digital.error_bits, WORDS);
        if softmax {
            let tables = SoftmaxTables::new(engine.readout_unit(), Positive::ONE, WORDS);
            unit = unit.with_softmax(tables);
        }
        let mut tick = Network::new(&net.hardware, seed, engine.layers(), samples);
        tick.set_error_unit(&unit);
        engine.set_error_unit(unit);
        engine.record(true);
        for batch in 1..=3 {
            let codes = net.codes(batch);
            let per = if mode == Mode::Online { net.sides[0] } else { codes.len() };
            for (at, codes) in codes.chunks(per).enumerate() {
                let shares = learn(&net, &mut engine, codes, mode, 100 * batch + at);
                let tape = engine.record(true);
                tick.play_tape(&tape);
                if softmax {
                    for (sample, shares) in shares.iter().enumerate() {
                        prop_assert_eq!(&tick.shares(sample), shares);
                    }
                }
            }
            for (at, layer) in engine.layers().iter().enumerate() {
                let balance = &layer.balance;
                for &target in wiring.targets() {
                    prop_assert_eq!(balance.thresholds(target), tick.thresholds(at, target));
                }
                if balance.law().is_on() {
                    let variance = balance.tracks().then_some(balance.variance());
                    prop_assert_eq!((balance.shift(), variance), tick.table_step(at));
                }
                for (array, cells) in layer.arrays.iter().enumerate() {
                    prop_assert!(cells.levels().eq(tick.levels(at, array)), "{} {}", at, array);
                }
                prop_assert_eq!(&layer.adc_shifts[..], tick.adc_shifts(at));
            }
            prop_assert_eq!(engine.error_unit().means(), tick.means());
            prop_assert_eq!(engine.ledger(Phase::Training), tick.ledger(Phase::Training));
        }
    }
}

/// Looks at thresholds and steps alone, or tells them again.
#[derive(Default)]
struct Balances {
    told: Vec<(String, Option<Section>, Vec<i64>)>,
    again: bool,
}

impl Visitor for Balances {
    fn halves(&mut self, _: &Piece<'_>, _: [usize; 2], _: &dyn Fn() -> Vec<u16>) -> Told<Vec<u16>> {
        Ok(None)
    }

    fn bits(
        &mut self,
        _: &Piece<'_>,
        _: [usize; 2],
        _: &dyn Fn() -> BitVec<u8, Lsb0>,
    ) -> Told<BitVec<u8, Lsb0>> {
        Ok(None)
    }

    fn numbers(&mut self, piece: &Piece<'_>, values: &[i64]) -> Told<Vec<i64>> {
        if !matches!(piece.section, Some(Section::Thresholds | Section::TableShifts)) {
            return Ok(None);
        }
        assert!(values.iter().all(|value| piece.within.contains(value)), "{}", piece.name);
        if self.again {
            return Ok(Some(self.told.remove(0).2));
        }
        self.told.push((piece.name.to_owned(), piece.section, values.to_vec()));
        Ok(None)
    }

    fn rows(&mut self, _: &Piece<'_>, _: usize, _: &dyn Fn() -> Vec<i64>) -> Told<Vec<i64>> {
        Ok(None)
    }
}

#[test]
fn what_units_keep_to_is_state_and_may_be_told_again() {
    let law = |threshold, gain| Homeostasis { threshold, gain, window_log2: 5 };
    let laws = vec![
        law(true, Gain::Tracking),
        law(false, Gain::Fixed { spread: 1 }),
        law(true, Gain::Table),
    ];
    let net = Net {
        seed: 4,
        sides: vec![6, 5, 4, 3, WORDS],
        laws,
        wiring: Wiring::Dual,
        samples: 8,
        hardware: Hardware::reference(),
        window: None,
    };
    let engine = || Engine::new(net.hardware.clone(), Backend::best(), 4, net.layers());
    let mut one = engine();
    let _ = one.calibrate(&net.codes(0));
    learn(&net, &mut one, &net.codes(1), Mode::Accumulate, 0);
    let mut said = Balances::default();
    one.visit(&mut said).unwrap();
    let names: Vec<_> =
        said.told.iter().map(|(name, _, values)| (&name[..], values.len())).collect();
    assert_eq!(
        names,
        [
            ("layer0.thresholds.p", 5),
            ("layer0.thresholds.n", 5),
            ("layer0.table_shift", 1),
            ("layer0.variance", 1),
            ("layer1.table_shift", 1),
            ("layer2.thresholds.p", 3),
            ("layer2.thresholds.n", 3),
        ]
    );
    let mut other = engine();
    said.again = true;
    other.visit(&mut said).unwrap();
    assert!(said.told.is_empty());
    for (one, other) in one.layers().iter().zip(other.layers()) {
        let both = [one, other].map(|layer| {
            let balance = &layer.balance;
            let variance = balance.tracks().then_some(balance.variance());
            let thresholds =
                [Stream::P, Stream::N].map(|stream| balance.thresholds(stream).to_vec());
            (thresholds, balance.shift(), variance)
        });
        assert_eq!(both[0], both[1]);
    }
}
