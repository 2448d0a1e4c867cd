//! Any valid chip, any small network on it, any list of choices.

use dalean::chip::device::{
    Chance, Conductance, FaultMap, Faults, ListedCell, Programming, ReadNoise, Reference, StuckAt,
    Wires,
};
use dalean::chip::hardware::{
    Adc, AdcRange, ConverterKind, DitherBits, DitherPattern, FloorKind, Hardware, HardwareSpec,
    PulseCode, SliceTime, SliceTimes, Subtract, Timing, Window, WriteScheme, converter,
};
use dalean::chip::layer::{
    Delivery, DrivenBy, Homeostasis, InitialLevels, LayerSpec, Pool, Taps, WordSource,
};
use dalean::chip::population::Wiring;
use dalean::learn::error::Centre;
use dalean::num::fixed::*;
use dalean::num::tables::{Activation, Positive};
use proptest::prelude::*;

/// Numbers from a seed; the tests' own, so that no draw of the chip is tested with itself.
#[derive(Debug, Clone)]
pub(crate) struct Numbers(pub(crate) u64);

impl Numbers {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number in `from..=to`.
    pub(crate) fn within(&mut self, from: i64, to: i64) -> i64 {
        from + (self.next() % (to - from + 1) as u64) as i64
    }
}

/// A network on a chip, before any level is loaded.
#[derive(Debug, Clone)]
pub(crate) struct Net {
    pub(crate) seed: u64,
    pub(crate) hardware: Hardware,
    pub(crate) specs: Vec<LayerSpec>,
    pub(crate) deliveries: Vec<Delivery>,
    pub(crate) centre: Centre,
    /// Shift with which converters that track begin: often so small that many codes lie on the rail.
    pub(crate) tracks_from: u32,
    pub(crate) mantissa: u32,
    pub(crate) potentiation_only: bool,
}

impl Net {
    /// Small factor of the rate, another one in every layer.
    pub(crate) fn mantissa_of(&self, layer: usize) -> u32 {
        1 + (self.mantissa - 1 + 4 * u32::try_from(layer).unwrap()) % 15
    }

    /// Changes parts of the chip.
    pub(crate) fn change(&mut self, change: impl FnOnce(&mut HardwareSpec)) {
        self.hardware = self.hardware.with(change).unwrap();
    }

    /// Cells, the measure of how long a case takes.
    pub(crate) fn cells(&self) -> usize {
        self.specs.iter().map(|s| s.inputs * s.units * s.wiring.pathways().len()).sum()
    }
}

/// Sides of arrays: mostly small, often beside the edge of a half, a panel, a block or two.
pub(crate) fn side() -> impl Strategy<Value = usize> {
    prop_oneof![
        5 => 1usize..=12,
        3 => prop::sample::select(vec![15, 16, 17, 31, 32, 33, 63, 64, 65, 70]),
        1 => prop::sample::select(vec![96, 127, 128, 129, 140]),
    ]
}

fn window(bits: LevelBits, ends: Option<[u16; 2]>) -> Window {
    let max = i64::from(bits.level_max());
    let (mut floor, mut ceiling) = (0, max);
    if let Some(ends) = ends {
        let [a, b] = ends.map(|end| i64::from(end) % (max + 1));
        (floor, ceiling) = (a.min(b), a.max(b));
        if floor == ceiling {
            (floor, ceiling) = if ceiling < max { (floor, ceiling + 1) } else { (floor - 1, max) };
        }
    }
    Window::new(floor, ceiling, bits).unwrap()
}

fn adc() -> impl Strategy<Value = Adc> {
    let range = prop_oneof![
        1 => (0u32..=12).prop_map(AdcRange::Shift),
        1 => Just(AdcRange::Full),
        2 => Just(AdcRange::Tracking),
        2 => (0u32..=3, any::<bool>())
            .prop_map(|(headroom, every_epoch)| AdcRange::Calibrated { headroom, every_epoch }),
    ];
    let subtract = prop::sample::select(vec![Subtract::Digital, Subtract::Current]);
    let finite = (2i64..=16, subtract, range).prop_map(|(bits, subtract, range)| Adc::Finite {
        bits: AdcBits::new(bits).unwrap(),
        subtract,
        range,
    });
    prop_oneof![2 => Just(Adc::Ideal), 3 => finite]
}

/// Any chip. Tiles are at least an eighth of `widest`, so that a case ends soon.
pub(crate) fn hardware(widest: usize) -> impl Strategy<Value = Hardware> {
    let ends = prop::option::weighted(0.5, any::<[u16; 2]>());
    // what most chips are comes often enough to reach the fast loops of every back end
    let level_bits = prop_oneof![1 => Just(8i64), 2 => 1i64..=12];
    let residual_bits = prop_oneof![3 => Just(0i64), 2 => 1i64..=15];
    let cells = (level_bits, ends, prop::bool::weighted(0.3), residual_bits);
    let least = (widest / 8).max(1);
    let tile_rows = prop_oneof![least..=200, least..=widest];
    let tiles = (tile_rows, 1usize..=200, any::<bool>());
    let words = (1i64..=8, any::<u32>(), adc(), 2i64..=14, 2i64..=9);
    let dither = (
        prop_oneof![
            1 => Just(DitherBits::Zero),
            3 => Just(DitherBits::Eight),
            1 => Just(DitherBits::Sixteen)
        ],
        prop::sample::select(vec![DitherPattern::PerCell, DitherPattern::Separable]),
        prop_oneof![1i64..=7, 1i64..=127],
    );
    (cells, tiles, words, dither).prop_map(
        |(
            (level_bits, ends, absorbs, residual_bits),
            (tile_rows, tile_columns, transposed_read),
            (drive_bits, dac_bits, adc, lut_bits, error_bits),
            (dither_bits, dither_pattern, increment_max),
        )| {
            let level_bits = LevelBits::new(level_bits).unwrap();
            let drive_bits = DriveBits::new(drive_bits).unwrap();
            Hardware::reference()
                .with(|h| {
                    h.cell.level_bits = level_bits;
                    h.cell.window = window(level_bits, ends);
                    h.cell.floor_kind =
                        if absorbs { FloorKind::Absorbing } else { FloorKind::Recoverable };
                    h.tile.rows = tile_rows;
                    h.tile.columns = tile_columns;
                    h.tile.transposed_read = transposed_read;
                    h.drive.bits = drive_bits;
                    h.drive.dac_bits = 1 + dac_bits % drive_bits.get();
                    h.adc = adc;
                    h.digital.lut_bits = LutBits::new(lut_bits).unwrap();
                    h.digital.error_bits = ErrorBits::new(error_bits).unwrap();
                    h.write.increment_max = IncrementMax::new(increment_max).unwrap();
                    h.write.dither_bits = dither_bits;
                    h.write.dither_pattern = dither_pattern;
                    h.write.residual_bits = ResidualBits::new(residual_bits).unwrap();
                })
                .unwrap()
        },
    )
}

pub(crate) fn activation() -> impl Strategy<Value = Activation> {
    let alpha = prop::sample::select(vec![0.5, 1.0, 4.0, 6.0]);
    prop_oneof![
        3 => alpha.prop_map(|alpha| Activation::Sigmoid(Positive::new(alpha).unwrap())),
        1 => Just(Activation::Relu),
        1 => Just(Activation::Identity),
    ]
}

/// How the arrays of all layers are wired: `(hidden, last)`.
pub(crate) fn wiring() -> impl Strategy<Value = (Wiring, Wiring)> {
    prop::sample::select(vec![
        (Wiring::Dual, Wiring::DualReadout),
        (Wiring::Dual, Wiring::Dual),
        (Wiring::Single, Wiring::Single),
        (Wiring::DualPairs, Wiring::DualReadoutPairs),
        (Wiring::DualPairs, Wiring::DualPairs),
    ])
}

/// Any way for errors to reach a layer; `above`: also from what the layer above reads from its columns.
fn delivery(numbers: &mut Numbers, units: usize, above: bool) -> Delivery {
    let shift = numbers.within(0, 3) as u32;
    match numbers.within(0, 9) {
        0..=4 if above => Delivery::above(units),
        5 => {
            let taps = Taps { width: 1, per_unit: 1, words: vec![0; units], shift: 0 };
            let outputs = numbers.within(1, 17) as usize;
            Delivery { source: WordSource::Sum { outputs, shift }, taps, alike: false }
        }
        6 | 7 => {
            let signs = units * numbers.within(1, 17) as usize;
            let signs = (0..signs).map(|_| 1 - 2 * numbers.within(0, 1) as i16).collect();
            let source = WordSource::Signed { signs, shift };
            Delivery { source, taps: Taps::identity(units), alike: false }
        }
        _ => {
            let width = numbers.within(1, 17);
            let per_unit = numbers.within(1, width.min(4)) as usize;
            let words = (0..units * per_unit).map(|_| numbers.within(0, width - 1) as u16);
            let words = words.collect();
            Taps { width: width as usize, per_unit, words, shift: shift.min(2) }.into()
        }
    }
}

/// A network whose layers have these sides, on any chip.
pub(crate) fn net(sides: impl Strategy<Value = Vec<usize>>) -> impl Strategy<Value = Net> {
    let chip = sides.prop_flat_map(|sides| {
        let widest = *sides.iter().max().unwrap();
        let layers =
            prop::collection::vec((activation(), -1i32..=4, any::<bool>()), sides.len() - 1);
        (Just(sides), hardware(widest), layers, wiring())
    });
    let learning = (any::<u64>(), prop_oneof![Just(1u32), 1u32..=15], prop::bool::weighted(0.2));
    (chip, learning).prop_map(
        |((sides, hardware, layers, (hidden, last)), (seed, mantissa, potentiation_only))| {
            let mut numbers = Numbers(seed);
            let count = layers.len();
            // now and then, stream p drives both
            let shared: Vec<_> = (0..count).map(|_| numbers.within(0, 9) == 0).collect();
            let centres = [Centre::None, Centre::Batch, Centre::Running];
            let centre = centres[numbers.within(0, 2) as usize];
            let tracks_from = numbers.within(0, 6) as u32;
            let reads_backwards = hardware.tile.transposed_read && hardware.adc == Adc::Ideal;
            let (mut specs, mut deliveries) = (vec![], vec![]);
            for (at, (activation, weight_max_log2, constant_row)) in layers.into_iter().enumerate()
            {
                // trains, and rules that only potentiate, take drives of one sign
                let rounded = hardware.write.scheme == WriteScheme::Rounded;
                let signed = at == 0 && rounded && !potentiation_only && seed % 5 == 0;
                specs.push(LayerSpec {
                    inputs: sides[at],
                    units: sides[at + 1],
                    wiring: if at + 1 == count { last } else { hidden },
                    driven_by: match at == 0 || shared[at] {
                        _ if signed => DrivenBy::Signed,
                        true => DrivenBy::Shared,
                        false => DrivenBy::Streams,
                    },
                    activation,
                    weight_max_log2,
                    initial: InitialLevels::Uniform { gain_64ths: [96, 32] },
                    constant_row,
                    convolution: None,
                    copies: 1,
                    pool: Pool::None,
                    homeostasis: Homeostasis::OFF,
                });
                let above = reads_backwards && last == Wiring::Single && at + 1 < count;
                deliveries.push(delivery(&mut numbers, sides[at + 1], above));
            }
            for at in 0..count {
                if numbers.within(0, 2) > 0 {
                    continue;
                }
                if at + 1 == count {
                    specs[at].activation = Activation::Accumulator;
                } else {
                    specs[at].activation = Activation::Rms;
                    if specs[at + 1].driven_by == DrivenBy::Streams {
                        specs[at + 1].driven_by = DrivenBy::Normalised;
                    }
                }
            }
            // now and then, stream n hears what stream p does
            deliveries.iter_mut().for_each(|made| made.alike = numbers.within(0, 5) == 0);
            Net {
                seed,
                hardware,
                specs,
                deliveries,
                centre,
                tracks_from,
                mantissa,
                potentiation_only,
            }
        },
    )
}

/// Any network of one to three layers.
pub(crate) fn any_net() -> impl Strategy<Value = Net> {
    net(prop::collection::vec(side(), 2..=4))
}

/// Any timing, short enough to be counted cycle by cycle.
pub(crate) fn timing() -> impl Strategy<Value = Timing> {
    let read = (1u64..=9, 1u64..=3, 1u64..=6, any::<bool>(), 1u64..=12);
    let write = (
        1u64..=4,
        prop::sample::select(vec![PulseCode::Unary, PulseCode::Amplitude]),
        prop::bool::weighted(0.3),
        prop::option::weighted(0.3, 1u64..=9),
    );
    let digital = (prop_oneof![3 => Just(1u64), 1 => 2u64..=3], 0u64..=3);
    (read, write, digital).prop_map(
        |(
            (settle, convert, share, overlapped, lanes),
            (pulse, pulse_code, verify, active_max),
            (beat, hops),
        )| Timing {
            clock_khz: 1_000_000,
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
        },
    )
}

/// The same on a chip whose converters are of any kind, whose phases are as long as their bits, or both; or whose slices
/// take any times at all.
fn by_kind(hardware: &Hardware, timing: Timing, numbers: &mut Numbers) -> Timing {
    let slices = hardware.slices();
    let any = numbers.within(0, 3) == 0;
    let kind = ConverterKind::NAMES[numbers.within(0, 4) as usize].1;
    let (slot, owes) = (numbers.within(0, 2) as u64, numbers.within(0, 1) == 1);
    let times = (0..slices).map(|slice| {
        let first = slice * hardware.drive.dac_bits;
        if any {
            let [settle, convert] = [9, 3].map(|most| numbers.within(1, most) as u64);
            return SliceTime { settle, convert };
        }
        let driven = hardware.drive.dac_bits.min(hardware.drive.bits.get() - first);
        let convert = match hardware.adc {
            Adc::Finite { bits, .. } => {
                // counters of 16 bits would be played for days
                let bits = bits.get().min(5);
                let bits = if owes { converter::owed(bits, first) } else { bits };
                kind.steps(bits).map_or(timing.convert, |steps| steps * timing.convert.min(2))
            }
            _ => timing.convert,
        };
        SliceTime { settle: timing.settle + slot * ((1 << driven.min(5)) - 1), convert }
    });
    let times: Vec<SliceTime> = times.collect();
    let SliceTime { settle, convert } = times[0];
    Timing { settle, convert, slices: Some(SliceTimes::new(&times).unwrap()), ..timing }
}

/// A small network of one to three layers on a chip that counts cycles.
pub(crate) fn timed_net() -> impl Strategy<Value = Net> {
    let side = || prop_oneof![4 => 1usize..=9, 1 => 10usize..=18];
    let sides = prop::collection::vec(side(), 2..=4);
    let trains = prop::option::weighted(0.15, 0u32..=5);
    let kinds = prop::option::weighted(0.6, any::<u64>());
    (net(sides), timing(), trains, kinds).prop_map(|(mut net, mut timing, trains, kinds)| {
        if let Some(seed) = kinds {
            timing = by_kind(&net.hardware, timing, &mut Numbers(seed));
        }
        net.change(|h| {
            if let Some(slots_log2) = trains {
                h.write.scheme = WriteScheme::Trains { slots_log2 };
                h.write.residual_bits = ResidualBits::new(0).unwrap();
                let most = i64::from(h.write.increment_max.get()).max(1 << slots_log2);
                h.write.increment_max = IncrementMax::new(most).unwrap();
                timing.verify = false;
                timing.active_max = None;
                timing.pulse_code = PulseCode::Unary;
            }
            h.timing = Some(timing);
        });
        if trains.is_some() {
            // trains are of drives of one sign
            net.specs[0].driven_by = DrivenBy::Shared;
        }
        net
    })
}

/// A network of which one in three has stuck cells, one in three noisy reads, one in three noisy loads; one in three has cells that conduct
/// at level 0, one in three wires that resist, and one in three a listed cell.
pub(crate) fn flawed(mut net: Net) -> Net {
    let flaw = flaws(net.seed);
    net.change(flaw);
    net
}

/// The flaws of a chip of this seed: of their own, so that nothing else depends on them.
pub(crate) fn flaws(seed: u64) -> impl Fn(&mut HardwareSpec) {
    let mut numbers = Numbers(seed ^ 0x5bd1_e995);
    let mut share = || Chance::new(1 << numbers.within(20, 30)).unwrap();
    let faults = Faults { floor: share(), ceiling: share(), any: share() };
    let sigma = 1 << numbers.within(0, 19);
    let [stuck, noisy, loads] = [0; 3].map(|_| numbers.within(0, 2) == 0);
    let coefficients = [0; 4].map(|_| numbers.within(-(1 << 22), 1 << 23));
    let [conducts, resists, listed] = [0; 3].map(|_| numbers.within(0, 2) == 0);
    let least = 1 << numbers.within(0, 20);
    let reference = if numbers.within(0, 1) == 0 { Reference::None } else { Reference::Column };
    let segment = 1 << numbers.within(16, 47);
    // the corner of an array that every wiring has
    let pathway = 0;
    let at = [StuckAt::Floor, StuckAt::Ceiling][numbers.within(0, 1) as usize];
    let cell = ListedCell { layer: 0, pathway, row: 0, column: 0, at };
    let map = FaultMap::new(vec![cell]).unwrap();
    move |h| {
        h.conductance = conducts.then_some(Conductance { least, reference });
        h.wires = resists.then_some(Wires { segment });
        h.fault_map = if listed { map.clone() } else { FaultMap::default() };
        h.faults = if stuck { faults } else { Faults::NONE };
        h.read_noise = noisy.then_some(ReadNoise { sigma });
        h.programming = loads.then_some(Programming { coefficients });
    }
}

/// One decision: what to do, and with which numbers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Choice {
    pub(crate) kind: u8,
    pub(crate) seed: u64,
}

pub(crate) fn choices() -> impl Strategy<Value = Vec<Choice>> {
    let one = (any::<u8>(), any::<u64>()).prop_map(|(kind, seed)| Choice { kind, seed });
    prop::collection::vec(one, 2..=14)
}
