//! Requests of whole batches: against a plain recomputation on every back end, and cycle by cycle.

use proptest::prelude::*;

use super::super::error::packed_at;
use super::super::tick::Network;
use super::*;
use crate::chip::crossbar::kernel::Backend;
use crate::chip::engine::error::stride_of;
use crate::chip::engine::{Operation, Phase, Side, Write};
use crate::chip::hardware::{
    DitherBits, DitherPattern, FloorKind, Hardware, PulseCode, Timing, Window,
};
use crate::chip::layer::{
    Delivery, DrivenBy, Homeostasis, InitialLevels, Layer, LayerSpec, Pool, Taps,
};
use crate::chip::population::{Polarity, Stream, Wiring};
use crate::chip::state::State;
use crate::num::draw::{Place, Site};
use crate::num::fixed::{ErrorBits, LevelBits, ResidualBits};
use crate::num::tables::Activation;
use crate::num::tables::Scales;

mod kept;
mod plain;

use kept::Copy;
use plain::Plain;

/// Numbers from a seed.
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, bound: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        (z ^ (z >> 27)) % bound
    }
}

/// A net of two layers that learns in some way, and how many samples each batch has.
#[derive(Debug, Clone)]
struct Case {
    sides: [usize; 3],
    wirings: [Wiring; 2],
    optimisers: [Optimiser; 2],
    windows: [Option<u32>; 2],
    shift: u32,
    batches: Vec<usize>,
    dither: (DitherBits, DitherPattern),
    tile: [usize; 2],
    absorbs: bool,
    mantissa: u32,
    residual: u32,
    /// Whether data have a sign.
    signed: bool,
    seed: u64,
}

fn optimiser() -> impl Strategy<Value = Optimiser> {
    prop::sample::select(vec![
        Optimiser::Plain,
        Optimiser::Sign { dead_zone: false },
        Optimiser::Sign { dead_zone: true },
        Optimiser::Rms,
        Optimiser::Momentum { decay: 1 },
        Optimiser::Momentum { decay: 5 },
        Optimiser::AdamFx { first_decay: 3, second_decay: 8 },
        Optimiser::AdamFx { first_decay: 1, second_decay: 2 },
    ])
}

fn case(side: impl Strategy<Value = usize> + Clone) -> impl Strategy<Value = Case> {
    use Wiring::{Dual, DualPairs, DualReadout, Single};
    let wirings = [[Dual, Dual], [Dual, DualReadout], [Single, Single], [DualPairs, DualPairs]];
    let window = || prop::option::of(7u32..=9);
    let bits = [DitherBits::Zero, DitherBits::Eight, DitherBits::Sixteen];
    let patterns = [DitherPattern::PerCell, DitherPattern::Separable];
    (
        [side.clone(), side.clone(), side],
        prop::sample::select(wirings.to_vec()),
        [optimiser(), optimiser()],
        [window(), window()],
        prop_oneof![4 => 0u32..=4, 1 => 5u32..=18],
        prop::collection::vec(1usize..=9, 1..=3),
        (prop::sample::select(bits.to_vec()), prop::sample::select(patterns.to_vec())),
        (
            [3usize..=80, 2usize..=40],
            any::<bool>(),
            1u32..=15,
            prop_oneof![Just(0), 1u32..=9],
            any::<bool>(),
            any::<u64>(),
        ),
    )
        .prop_map(|(sides, wirings, optimisers, windows, shift, batches, dither, rest)| {
            let (tile, absorbs, mantissa, residual, signed, seed) = rest;
            // pulses by chance leave none
            let rounds = optimisers.iter().all(|optimiser| !optimiser.is_sign());
            let residual = if rounds { residual } else { 0 };
            Case {
                sides,
                wirings,
                optimisers,
                windows,
                shift,
                batches,
                dither,
                tile,
                absorbs,
                mantissa,
                residual,
                signed,
                seed,
            }
        })
}

impl Case {
    fn chip(&self, timing: Option<Timing>) -> Hardware {
        let bits = LevelBits::new(6).unwrap();
        let chip = Hardware::reference().with(|h| {
            h.cell.level_bits = bits;
            h.cell.window = Window::new(3, 50, bits).unwrap();
            h.cell.floor_kind =
                if self.absorbs { FloorKind::Absorbing } else { FloorKind::Recoverable };
            [h.tile.rows, h.tile.columns] = self.tile;
            (h.write.dither_bits, h.write.dither_pattern) = self.dither;
            h.write.residual_bits = ResidualBits::new(self.residual.into()).unwrap();
            h.digital.error_bits = ErrorBits::new(8).unwrap();
            h.timing = timing;
        });
        chip.unwrap()
    }

    /// The net, with levels.
    fn engine(&self, backend: Backend, timing: Option<Timing>) -> Engine {
        let chip = self.chip(timing);
        let [inputs, hidden, outputs] = self.sides;
        let spec = |at: usize| LayerSpec {
            inputs: [inputs, hidden][at],
            units: [hidden, outputs][at],
            wiring: self.wirings[at],
            driven_by: match at {
                0 if self.signed => DrivenBy::Signed,
                0 => DrivenBy::Shared,
                _ => DrivenBy::Streams,
            },
            activation: Activation::Relu,
            weight_max_log2: 0,
            initial: InitialLevels::Uniform { gain_64ths: [64, 64] },
            constant_row: self.seed.is_multiple_of(2),
            convolution: None,
            copies: 1,
            pool: Pool::None,
            homeostasis: Homeostasis::OFF,
        };
        let words = (0..hidden).map(|unit| (unit % outputs) as u16).collect();
        let taps = Taps { width: outputs, per_unit: 1, words, shift: 0 };
        let layers = vec![
            Layer::new(3, spec(0), taps, &chip),
            Layer::new(4, spec(1), Delivery::output(outputs), &chip),
        ];
        let mut engine = Engine::new(chip, backend, self.seed, layers);
        engine.set_optimisers(&self.optimisers);
        engine.set_centred(&self.windows);
        // a pulse by chance has no scale
        let scale = |at: usize| match self.optimisers[at] {
            Optimiser::Sign { .. } | Optimiser::Rms => 1,
            _ => self.mantissa,
        };
        engine.set_mantissas(&[scale(0), scale(1)]);
        let mut numbers = Numbers(self.seed);
        for layer in 0..2 {
            for array in 0..self.wirings[layer].pathways().len() {
                for row in 0..engine.layers()[layer].layout.rows {
                    let units = engine.layers()[layer].spec.units;
                    let levels: Vec<_> = (0..units).map(|_| 3 + numbers.below(48) as u16).collect();
                    engine.execute(&Operation::LoadWeights { layer, array, row, levels: &levels });
                }
            }
        }
        engine
    }

    /// The shift of a write of a layer.
    fn shift(&self, layer: usize) -> u32 {
        match self.optimisers[layer] {
            Optimiser::Sign { .. } => self.shift,
            Optimiser::AdamFx { .. } => 8 + self.shift,
            // half a level to four in the root mean square of these sizes
            Optimiser::Rms => (1 << 14) - 2000 + 300 * self.shift,
            _ => 9 + self.shift,
        }
    }

    /// What happens in a batch, with its numbers.
    fn batch(&self, at: usize) -> (Vec<u8>, Vec<i16>) {
        let mut numbers = Numbers(self.seed ^ (at as u64 + 1) << 32);
        let (samples, kind) = (self.batches[at], numbers.below(4));
        let code = |at: usize, word: u64| match kind {
            // rows and whole blocks that are dark
            0 if at % self.sides[0] % 64 < 40 => 0,
            1 => 255,
            _ => word as u8,
        };
        let all = (0..samples * self.sides[0]).map(|at| code(at, numbers.below(256)));
        let mut codes: Vec<u8> = all.collect();
        if self.signed {
            let side = |rows: &[u8]| {
                let below: Vec<_> = rows.iter().map(|_| numbers.below(2) > 0).collect();
                let of = |wanted| {
                    rows.iter().zip(&below).map(move |(&x, &b)| if b == wanted { x } else { 0 })
                };
                of(false).chain(of(true)).collect::<Vec<_>>()
            };
            codes = codes.chunks(self.sides[0]).flat_map(side).collect();
        }
        let words = (0..samples * self.sides[2]).map(|_| match kind {
            1 => 127,
            2 if numbers.below(3) > 0 => 0,
            _ => numbers.below(255) as i16 - 127,
        });
        (codes, words.collect())
    }

    /// The operations of a batch up to its writes.
    fn operations<'a>(
        &self,
        codes: &'a [u8],
        words: &'a [i16],
        samples: usize,
    ) -> Vec<Operation<'a>> {
        let forward = |layer| Operation::Forward { layer, side: Side::Rows };
        let error =
            |layer| Operation::Error { layer, samples: 0..samples, words, shared: layer > 0 };
        let add =
            |layer| Operation::Update { layer, write: Write::Add, samples: 0..samples, shift: 0 };
        let mut list = vec![Operation::LoadDrives { codes }];
        list.extend([forward(0), forward(1), error(0), error(1), add(0), add(1)]);
        list
    }

    fn write<'a>(&self, layer: usize) -> Operation<'a> {
        let shift = self.shift(layer);
        Operation::Update { layer, write: Write::Program, samples: 0..0, shift }
    }
}

fn side() -> impl Strategy<Value = usize> + Clone {
    prop_oneof![3 => 1usize..=20, 2 => prop::sample::select(vec![31, 32, 33, 63, 64, 65, 70, 130])]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn a_write_in_two_passes_is_its_equations_on_every_back_end(case in case(side())) {
        for backend in Backend::available() {
            let mut engine = case.engine(backend, None);
            for (at, &samples) in case.batches.iter().enumerate() {
                let (codes, words) = case.batch(at);
                let operations = case.operations(&codes, &words, samples);
                operations.iter().for_each(|operation| engine.execute(operation));
                for layer in 0..2 {
                    Plain::of(&engine, layer).check(&mut engine, &case, layer)?;
                }
            }
        }
    }

    #[test]
    fn tick_makes_the_same_requests_in_the_same_time(
        case in case(1usize..=9), beat in 1u64..=3, lanes in 1u64..=5, empty: bool, amplitude: bool,
        verify: bool, active_max in prop::option::of(1u64..=5),
    ) {
        let timing = Timing {
            clock_khz: 1,
            beat,
            settle: 3,
            convert: 2,
            share: 4,
            overlapped: true,
            lanes,
            hops: 1,
            pulse: 2,
            pulse_code: if amplitude { PulseCode::Amplitude } else { PulseCode::Unary },
            verify,
            active_max,
            slices: None,
        };
        let mut engine = case.engine(Backend::best(), Some(timing));
        let chip = engine.hardware().clone();
        let slots = *case.batches.iter().max().unwrap();
        let mut tick = Network::new(&chip, case.seed, engine.layers(), slots);
        tick.set_learning(engine.mantissas(), false);
        engine.set_phase(Phase::Evaluation);
        tick.set_phase(Phase::Evaluation);
        for (at, &samples) in case.batches.iter().enumerate() {
            let (codes, words) = case.batch(at);
            let mut operations = case.operations(&codes, &words, samples);
            operations.extend([case.write(0), case.write(1)]);
            if empty {
                // a write of nothing, and one layer after the other
                operations.push(case.write(1));
            }
            operations.iter().for_each(|operation| engine.execute(operation));
            engine.settle();
            tick.run(&operations);
            let phase = Phase::Evaluation;
            prop_assert_eq!(engine.ledger(phase).cycles(), tick.ledger(phase).cycles());
            prop_assert!(engine.ledger(phase).entries().eq(tick.ledger(phase).entries()));
            for (at, layer) in engine.layers().iter().enumerate() {
                for (array, cells) in layer.arrays.iter().enumerate() {
                    prop_assert!(cells.levels().eq(tick.levels(at, array)), "{} {}", at, array);
                    let left = cells.residuals().unwrap_or_default();
                    let left: Vec<_> = left.into_iter().map(i64::from).collect();
                    prop_assert!(left.is_empty() || left == tick.residuals(at, array));
                }
                let followed = layer.requests.followed();
                prop_assert_eq!([followed.power, followed.ends], tick.followed(at));
                for (array, word) in (0..layer.arrays.len()).flat_map(|a| [(a, 0), (a, 1)]) {
                    let words = layer.requests.words(array, word, layer.layout);
                    prop_assert!(words.is_empty() || words == tick.words(at, array, word));
                }
                for set in [Stream::P, Stream::N] {
                    let means = layer.requests.means(set).iter().map(|&mean| i64::from(mean));
                    let rows = tick.row_means(at, set).len();
                    prop_assert!(means.take(layer.layout.rows).eq(tick.row_means(at, set).iter().copied()));
                    prop_assert!(rows == 0 || rows == layer.layout.rows);
                }
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn what_is_kept_goes_on_elsewhere(case in case(1usize..=40), threads in 1usize..=2) {
        let learn = |engine: &mut Engine, at: usize| {
            let (codes, words) = case.batch(at);
            let operations = case.operations(&codes, &words, case.batches[at]);
            operations.iter().for_each(|operation| engine.execute(operation));
            (0..2).for_each(|layer| engine.execute(&case.write(layer)));
        };
        let mut engine = case.engine(Backend::best(), None);
        learn(&mut engine, 0);
        let mut copy = Copy::default();
        engine.visit(&mut copy).unwrap();
        copy.given = true;
        // an engine that was made alike, and has nothing of its own left
        let mut other = Case { seed: case.seed ^ 2, ..case.clone() }.engine(Backend::Scalar, None);
        other.seed = case.seed;
        other.set_threads(threads).unwrap();
        other.visit(&mut copy).unwrap();
        for at in 0..case.batches.len() {
            learn(&mut engine, at);
            learn(&mut other, at);
        }
        let (mut one, mut two) = (Copy::default(), Copy::default());
        engine.visit(&mut one).unwrap();
        other.visit(&mut two).unwrap();
        prop_assert_eq!(&one.numbers, &two.numbers);
        let kept = |name: &str| one.numbers.keys().filter(|key| key.ends_with(name)).count();
        let means = |at: usize| {
            let sets = engine.layers()[at].spec.drive_sets().len();
            if case.windows[at].is_some() { sets } else { 0 }
        };
        let sets = kept(".row_means.p") + kept(".row_means.n");
        prop_assert_eq!(sets, means(0) + means(1));
        let words = |at: usize| case.optimisers[at].memory().0 * case.wirings[at].pathways().len();
        prop_assert_eq!(kept(".moment") + kept(".square"), words(0) + words(1));
        let rms = case.optimisers.iter().filter(|&&optimiser| optimiser == Optimiser::Rms).count();
        prop_assert_eq!(kept(".rms"), rms);
    }
}
