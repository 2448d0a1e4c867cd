//! Requests of whole batches: against a plain recomputation on every back end, and cycle by cycle.

use bitvec::prelude::*;
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
use crate::chip::layer::{Delivery, DrivenBy, InitialLevels, Layer, LayerSpec, Taps};
use crate::chip::population::{Polarity, Stream, Wiring};
use crate::chip::state::{Piece, Seen, State, Visitor};
use crate::num::draw::{Place, Site};
use crate::num::fixed::{ErrorBits, LevelBits};
use crate::num::tables::Activation;
use crate::num::tables::Scales;

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
        ([3usize..=80, 2usize..=40], any::<bool>(), 1u32..=15, any::<u64>()),
    )
        .prop_map(|(sides, wirings, optimisers, windows, shift, batches, dither, rest)| {
            let (tile, absorbs, mantissa, seed) = rest;
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
            driven_by: [DrivenBy::Shared, DrivenBy::Streams][at],
            activation: Activation::Relu,
            weight_max_log2: 0,
            initial: InitialLevels::Uniform { gain_64ths: [64, 64] },
            constant_row: self.seed.is_multiple_of(2),
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
        let codes = (0..samples * self.sides[0]).map(|at| code(at, numbers.below(256))).collect();
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

/// A layer before a write, as plain numbers.
struct Plain {
    /// By array, `[row][column]`.
    sums: Vec<Vec<i64>>,
    levels: Vec<Vec<u16>>,
    gone: Vec<Vec<bool>>,
    /// By array: sums of the codes of rows, and of the gates of columns.
    codes: Vec<Vec<i64>>,
    totals: Vec<Vec<i64>>,
}

impl Plain {
    fn of(engine: &Engine, layer: usize) -> Self {
        let this = &engine.layers[layer];
        let (rows, columns, samples) = (this.layout.rows, this.layout.columns, engine.samples);
        let mut plain =
            Self { sums: vec![], levels: vec![], gone: vec![], codes: vec![], totals: vec![] };
        for (array, pathway) in this.arrays.iter().zip(this.spec.wiring.pathways()) {
            let drives = engine.drives(layer, pathway.source);
            let drive = |row, sample| i64::from(drives[engine.register_at(sample, row)]);
            let gates = &engine.registers[layer].gates[pathway.target.index()];
            let gate =
                |column, sample| i64::from(gates[packed_at(stride_of(samples), sample, column)]);
            let sum = |cell: usize| {
                let (row, column) = (cell / columns, cell % columns);
                (0..samples).map(|b| drive(row, b) * gate(column, b)).sum()
            };
            plain.sums.push((0..rows * columns).map(sum).collect());
            plain.levels.push(array.levels().collect());
            let gone = array.pruned().map(|bits| bits.iter().by_vals().collect());
            plain.gone.push(gone.unwrap_or_else(|| vec![false; rows * columns]));
            let over =
                |of: &dyn Fn(usize, usize) -> i64, line| (0..samples).map(|b| of(line, b)).sum();
            plain.codes.push((0..rows).map(|row| over(&drive, row)).collect());
            plain.totals.push((0..columns).map(|column| over(&gate, column)).collect());
        }
        plain
    }

    /// Executes the write by its equations and holds the engine against it.
    fn check(self, engine: &mut Engine, case: &Case, layer: usize) -> Result<(), TestCaseError> {
        let before = engine.layers[layer].clone();
        let (rows, columns, samples) = (before.layout.rows, before.layout.columns, engine.samples);
        let wiring = before.spec.wiring;
        let window = case.windows[layer];
        let first = before.writes[0] == 0;
        let centred = |array: usize, cell: usize| {
            let sum = self.sums[array][cell];
            if window.is_none() {
                return (i128::from(sum), 1i128);
            }
            let (row, column) = (cell / columns, cell % columns);
            let set = before.spec.drives_of(wiring.pathways()[array].source);
            let n = samples as i64;
            let mean = match first {
                true => (32 * self.codes[array][row] + n).div_euclid(2 * n),
                false => before.requests.means(set)[row].into(),
            };
            (i128::from(16 * sum - mean * self.totals[array][column]), 16)
        };
        let cells: Vec<(usize, usize)> = (0..self.sums.len())
            .flat_map(|array| (0..rows * columns).map(move |cell| (array, cell)))
            .collect();
        let counts_in = |array: usize| match case.optimisers[layer] {
            Optimiser::Rms => wiring.pathways()[array].polarity == Polarity::Excites,
            _ => true,
        };
        let squared = cells.iter().filter(|(array, _)| counts_in(*array));
        let squares: i128 = squared.map(|&(a, c)| centred(a, c).0.pow(2)).sum();
        // what is asked of a cell, in units of a power of two of a pulse, and words that are kept
        let memory = &before.requests;
        let word_of = |array, word, cell: usize| {
            let words = memory.words(array, word, before.layout);
            i128::from(words.get(cell).copied().unwrap_or(0))
        };
        let halves_up = |top: i128, bottom: i128| (2 * top + bottom).div_euclid(2 * bottom);
        let mut power = i128::from(memory.followed().power);
        if case.optimisers[layer] == Optimiser::Rms && squares > 0 {
            let now = (0..126).find(|place| squares >> place == 1).unwrap() * 256;
            power = if power < 0 { now } else { power + halves_up(now - power, 16) };
        }
        let least = match case.optimisers[layer] {
            Optimiser::Sign { dead_zone: true } => {
                let n = cells.len() as i128;
                let t = (0..).find(|t| squares < n * (1 << (2 * t + 1))).unwrap();
                1i128 << t
            }
            _ => 1,
        };
        let ledger = |engine: &Engine, event| engine.ledger(Phase::Training).total(event);
        let counted = [
            Event::Requested,
            Event::Bounded,
            Event::PulsesAttempted,
            Event::PulsesEffective,
            Event::SumSquares,
            Event::OptimiserSteps,
            Event::RowMeans,
        ];
        let counts = counted.map(|event| ledger(engine, event));
        engine.execute(&case.write(layer));
        let mut want = [0u64; 7];
        let shift = case.shift(layer) + wiring.shift_extra();
        for &(array, cell) in &cells {
            let pathway = wiring.pathways()[array];
            let (row, column) = (cell / columns, cell % columns);
            let place = Place {
                seed: case.seed,
                site: Site::WriteDither,
                layer: before.index,
                pathway: pathway.code,
                sub: 0,
                count: before.writes[array],
            };
            let sign = case.optimisers[layer].is_sign();
            let bits = if sign { 16 } else { case.dither.0.get() };
            let word = |place: Place, rows, row: usize, column| match bits {
                8 => {
                    let mut bytes = [0; 64];
                    place.bytes(rows, column, row / 64, &mut bytes);
                    u16::from(bytes[row % 64])
                }
                _ => place.half(rows, row, column),
            };
            let word = i128::from(match case.dither.1 {
                DitherPattern::PerCell => word(place, rows, row, column),
                DitherPattern::Separable => {
                    let across = word(Place { sub: 2, ..place }, columns, column, 0);
                    word(Place { sub: 1, ..place }, rows, row, 0) ^ across
                }
            });
            let (sum, unit) = centred(array, cell);
            let polarity = if pathway.polarity == Polarity::Inhibits { -1 } else { 1 };
            let mut kept = vec![];
            // request, mantissa and units in a pulse
            let scaled = |sum, unit: i128| (sum, i128::from(case.mantissa), unit << shift);
            let (request, mantissa, pulse) = match case.optimisers[layer] {
                Optimiser::Momentum { decay } => {
                    let was = word_of(array, 0, cell);
                    kept = vec![was - halves_up(was, 1 << decay) + sum];
                    scaled(kept[0], unit << decay)
                }
                Optimiser::AdamFx { first_decay: a, second_decay: b } => {
                    let s = halves_up(sum, unit);
                    let (m, v) = (word_of(array, 0, cell), word_of(array, 1, cell));
                    kept = match first {
                        true => vec![s << a, s * s << b],
                        false => vec![m + s - halves_up(m, 1 << a), v + s * s - (v >> b)],
                    };
                    let root = ((kept[1] >> b) as u128).isqrt() as i128;
                    let request = halves_up(kept[0] << 12, root.max(1) << a);
                    scaled(request.clamp(-32767, 32767), 1)
                }
                Optimiser::Rms => {
                    let x = ((power + 128) >> 1) + i128::from(case.shift(layer)) - 16_384;
                    let factor = Scales::new().at(x as i64);
                    (sum, factor.mantissa.into(), 1 << (factor.shift + wiring.shift_extra()))
                }
                _ => scaled(sum, unit),
            };
            let request = polarity * request;
            let (wanted, pulses) = if sign {
                let lucky = shift <= 16 && word < 1 << (16 - shift);
                let pulse = if lucky && request.abs() >= least { request.signum() } else { 0 };
                (pulse, pulse)
            } else if case.optimisers[layer] == Optimiser::Rms && squares == 0 {
                (0, 0)
            } else {
                // rounded to units of 2^-D of a pulse, half up; then a word on top
                let q = halves_up((request * mantissa) << bits, pulse);
                let wanted = (q + if bits == 0 { 0 } else { word }) >> bits;
                (wanted, wanted.clamp(-7, 7))
            };
            for (word, kept) in kept.into_iter().enumerate() {
                let now = engine.layers[layer].requests.words(array, word, before.layout);
                prop_assert_eq!(i128::from(now[cell]), kept, "word {} of {}", word, cell);
            }
            let level = i128::from(self.levels[array][cell]);
            let gone = self.gone[array][cell];
            let held = if gone { level } else { (level + pulses).clamp(3, 50) };
            let now = engine.layers[layer].arrays[array].level(row, column);
            prop_assert_eq!(i128::from(now), held, "{} {} {}", array, row, column);
            want[0] += u64::from(wanted != 0);
            want[1] += u64::from(wanted != pulses);
            want[2] += pulses.unsigned_abs() as u64;
            want[3] += (held - level).unsigned_abs() as u64;
            let looks = case.optimisers[layer].looks_at_layer() && counts_in(array);
            want[4] += u64::from(looks);
            want[5] += u64::from(case.optimisers[layer] != Optimiser::Plain);
        }
        if window.is_some() {
            let looks =
                |array: &usize| case.optimisers[layer].looks_at_layer() && counts_in(*array);
            let passes = self.sums.len() + (0..self.sums.len()).filter(looks).count();
            want[6] = (rows * (passes + before.spec.drive_sets().len())) as u64;
        }
        for ((event, before), want) in counted.into_iter().zip(counts).zip(want) {
            prop_assert_eq!(ledger(engine, event) - before, want, "{}", event.name());
        }
        let now = &engine.layers[layer].requests;
        prop_assert_eq!(i128::from(now.followed().power), power);
        for (array, pathway) in wiring.pathways().iter().enumerate() {
            let set = before.spec.drives_of(pathway.source);
            let Some(window) = window else {
                prop_assert!(now.means(set).is_empty());
                continue;
            };
            for (row, &codes) in self.codes[array].iter().enumerate() {
                let (n, was) = (samples as i64, i64::from(before.requests.means(set)[row]));
                let want = match first {
                    true => (32 * codes + n).div_euclid(2 * n),
                    false => was + (16 * codes - n * was + (1 << (window - 1)) >> window),
                };
                prop_assert_eq!(i64::from(now.means(set)[row]), want, "mean of {}", row);
            }
        }
        Ok(())
    }
}

fn side() -> impl Strategy<Value = usize> + Clone {
    prop_oneof![3 => 1usize..=20, 2 => prop::sample::select(vec![31, 32, 33, 63, 64, 65, 70, 130])]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

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
        case in case(1usize..=9), beat in 1u64..=3, lanes in 1u64..=5, empty: bool,
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
            pulse_code: PulseCode::Unary,
            verify: false,
            active_max: None,
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

/// Everything that a state says, by name, and to be told again.
#[derive(Default)]
struct Copy {
    numbers: std::collections::BTreeMap<String, Vec<i64>>,
    given: bool,
}

impl Copy {
    fn seen(&mut self, piece: &Piece<'_>, now: Vec<i64>) -> Option<Vec<i64>> {
        if self.given {
            return Some(self.numbers[piece.name].clone());
        }
        assert!(now.iter().all(|number| piece.within.contains(number)), "{}", piece.name);
        assert!(self.numbers.insert(piece.name.to_owned(), now).is_none(), "{}", piece.name);
        None
    }
}

impl Visitor for Copy {
    fn halves(
        &mut self,
        piece: &Piece<'_>,
        _shape: [usize; 2],
        values: &dyn Fn() -> Vec<u16>,
    ) -> Seen<Vec<u16>> {
        let seen = self.seen(piece, values().into_iter().map(i64::from).collect());
        Ok(seen.map(|seen| seen.into_iter().map(|number| number as u16).collect()))
    }

    fn bits(
        &mut self,
        piece: &Piece<'_>,
        _shape: [usize; 2],
        values: &dyn Fn() -> BitVec<u8, Lsb0>,
    ) -> Seen<BitVec<u8, Lsb0>> {
        let seen = self.seen(piece, values().into_iter().map(i64::from).collect());
        Ok(seen.map(|seen| seen.into_iter().map(|number| number != 0).collect()))
    }

    fn numbers(&mut self, piece: &Piece<'_>, values: &[i64]) -> Seen<Vec<i64>> {
        Ok(self.seen(piece, values.to_vec()))
    }

    fn rows(
        &mut self,
        piece: &Piece<'_>,
        _width: usize,
        values: &dyn Fn() -> Vec<i64>,
    ) -> Seen<Vec<i64>> {
        Ok(self.seen(piece, values()))
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
