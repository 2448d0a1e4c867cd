//! Layers of cells that are not ideal: Fast against Tick, against ideal cells where they are the same, and their windows.

use proptest::prelude::*;

use super::tick::Network;
use super::{Engine, Operation, Phase, Side, Write};
use crate::chip::crossbar::kernel::Backend;
use crate::chip::device::{
    Ageing, CellSpread, Chance, DeviceSpec, Endurance, Faults, Leakage, PulseNoise, Worn,
};
use crate::chip::hardware::timing::{PulseCode, Timing};
use crate::chip::hardware::{DitherBits, FloorKind, Hardware, Window, WriteScheme};
use crate::chip::layer::{
    Delivery, DrivenBy, Homeostasis, InitialLevels, Layer, LayerSpec, Optimiser, Pool,
};
use crate::chip::population::Wiring;
use crate::num::fixed::{IncrementMax, LevelBits, Millionths, ResidualBits};
use crate::num::tables::{
    Activation, DriftRates, ExponentialSteps, LinearSteps, MeasuredSteps, NeurosimSteps, Response,
    SoftBoundSteps, SpreadLaw, TableSteps,
};

fn number(seed: u64, at: usize, below: usize) -> usize {
    let mixed = (seed ^ at as u64).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    (mixed ^ mixed >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9) as usize % (1 << 40) % below
}

/// How a batch is written.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Mode {
    Accumulate,
    Now,
    Trains,
}

#[derive(Debug, Clone)]
struct Case {
    seed: u64,
    sizes: [usize; 2],
    wiring: Wiring,
    mode: Mode,
    optimiser: Optimiser,
    centred: bool,
    samples: usize,
    chip: Hardware,
}

fn response() -> impl Strategy<Value = Response> {
    let part = |most: i64| (0..=most).prop_map(|of| Millionths(of * 100_000));
    let signed = (-60i64..=60).prop_map(|of| Millionths(of * 100_000));
    prop_oneof![
        [part(30), part(30), part(30), part(30)].prop_map(|[a, b, c, d]| {
            Response::Linear(LinearSteps { up: [a, b], down: [c, d] })
        }),
        [part(40), part(40)]
            .prop_map(|[up, down]| Response::SoftBounds(SoftBoundSteps { up, down })),
        [signed.clone(), signed.clone(), signed.clone(), signed.clone()].prop_map(
            |[a, b, c, d]| {
                let z = [Millionths(0), Millionths(-1_000_000)];
                Response::Exponential(ExponentialSteps { amplitude: [a, b], growth: [c, d], z })
            }
        ),
        [signed.clone(), signed]
            .prop_map(|labels| { Response::Neurosim(NeurosimSteps { labels }) }),
        prop::collection::vec([part(30), part(30)], 2..=20).prop_map(|rows| {
            let row = |of: usize| rows.iter().map(|both| both[of]).collect();
            Response::Table(TableSteps { up: row(0), down: row(1) })
        }),
        [part(10), part(10), part(10), part(10)].prop_map(|[a, b, c, d]| {
            let rows = [(0, a, b), (300_000, c, d), (1_000_000, b, c)];
            let points = rows.map(|(x, up, down)| [Millionths(x), up, down]).into();
            Response::Measured(MeasuredSteps { points })
        }),
    ]
}

fn device() -> impl Strategy<Value = DeviceSpec> {
    let share = |most: i64| {
        prop_oneof![Just(Millionths(0)), (1..=most).prop_map(|of| Millionths(of * 10_000))]
    };
    let noise = prop_oneof![
        Just(PulseNoise::Off),
        (1i64..=500).prop_map(|of| PulseNoise::OfStep(Millionths(of * 10_000))),
        (1i64..=20).prop_map(|of| PulseNoise::OfWindow(Millionths(of * 10_000))),
    ];
    let spread = (share(80), share(30), share(40), share(40), any::<bool>());
    let noise = (noise, share(30), 1u32..=5);
    (response(), 1u32..=200, -30i64..=30, noise, spread).prop_map(
        |(response, states, asymmetry, noise, (step, lean, ceiling, floor, log))| DeviceSpec {
            response,
            states,
            asymmetry: Millionths(asymmetry * 10_000),
            noise: noise.0,
            write_noise: noise.1,
            tries: noise.2,
            spread: CellSpread {
                step_law: if log { SpreadLaw::LogNormal } else { SpreadLaw::Normal },
                step,
                asymmetry: lean,
                ceiling,
                floor,
            },
        },
    )
}

/// What cells do beside answering: some are stuck, some wear out after a few pulses, all forget.
fn lasting() -> impl Strategy<Value = (Faults, Option<Endurance>, Option<Leakage>, Option<Ageing>)>
{
    let part = |most: i64| (0..=most).prop_map(|of| Millionths(of * 100_000));
    let share = Chance::new(1 << 28).unwrap();
    let faults = Faults { floor: share, ceiling: share, any: share };
    let faults = prop_oneof![2 => Just(Faults::NONE), 1 => Just(faults)];
    let worn = prop_oneof![Just(Worn::Level), Just(Worn::Floor), Just(Worn::Ceiling)];
    let endurance = (1u32..=20, part(9), worn).prop_map(|(pulses, spread, worn)| Endurance {
        pulses,
        spread,
        worn,
    });
    let leakage = (1u32..=u32::MAX, 0u32..=30, 1u32..=3, part(10), part(9)).prop_map(
        |(lost, less, every, rest, spread)| Leakage {
            lost: (lost >> less).max(1),
            every,
            rest,
            spread,
        },
    );
    let signed = |most: i64| (-most..=most).prop_map(|of| Millionths(of * 10_000));
    let exponent = (signed(30), signed(60), part(2), part(9))
        .prop_map(|(slope, offset, a, b)| [slope, offset, a.min(b), a.max(b)]);
    let power = (exponent.clone(), exponent).prop_map(|(a, b)| DriftRates::Power([a, b]));
    let log = (signed(20), part(1)).prop_map(|(change, spread)| DriftRates::Log([change, spread]));
    let ageing = (prop_oneof![power, log], -3i64 << 16..=9 << 16, 1u32..=3)
        .prop_map(|(rates, since, every)| Ageing { rates, since, every });
    let forgets = prop_oneof![
        Just((None, None)),
        leakage.prop_map(|leakage| (Some(leakage), None)),
        ageing.prop_map(|ageing| (None, Some(ageing))),
    ];
    (faults, prop::option::of(endurance), forgets)
        .prop_map(|(faults, endurance, (leakage, ageing))| (faults, endurance, leakage, ageing))
}

fn chip() -> impl Strategy<Value = Hardware> {
    let bits = prop_oneof![Just(4i64), Just(8), Just(8), Just(11)];
    let active = prop::option::of(1u64..=4);
    let dither =
        prop_oneof![Just(DitherBits::Zero), Just(DitherBits::Eight), Just(DitherBits::Sixteen)];
    let looks = any::<[bool; 2]>();
    (bits, 0u32..=4, looks, active, (5usize..=80, 3usize..=40), 1i64..=12, dither).prop_map(
        |(bits, residual, [absorbs, verify], active_max, tile, most, dither)| {
            let level_bits = LevelBits::new(bits).unwrap();
            let top = i64::from(level_bits.level_max());
            let chip = Hardware::reference().with(|h| {
                h.cell.level_bits = level_bits;
                h.cell.window = Window::new(top / 5, top - top / 6, level_bits).unwrap();
                if absorbs {
                    h.cell.floor_kind = FloorKind::Absorbing;
                }
                (h.tile.rows, h.tile.columns) = tile;
                h.write.residual_bits = ResidualBits::new(residual.into()).unwrap();
                h.write.increment_max = IncrementMax::new(most).unwrap();
                h.write.dither_bits = dither;
                h.timing = Some(Timing {
                    clock_khz: 1,
                    beat: 1,
                    settle: 2,
                    convert: 1,
                    share: 2,
                    overlapped: true,
                    lanes: 8,
                    hops: 1,
                    pulse: 2,
                    pulse_code: PulseCode::Unary,
                    verify,
                    active_max,
                    slices: None,
                });
            });
            chip.unwrap()
        },
    )
}

fn case() -> impl Strategy<Value = Case> {
    let wiring = prop_oneof![Just(Wiring::Dual), Just(Wiring::DualPairs), Just(Wiring::Single)];
    let mode =
        prop_oneof![3 => Just(Mode::Accumulate), 1 => Just(Mode::Now), 1 => Just(Mode::Trains)];
    let optimiser = prop_oneof![
        3 => Just(Optimiser::Plain),
        1 => Just(Optimiser::Sign { dead_zone: true }),
        1 => Just(Optimiser::Rms),
        1 => Just(Optimiser::AdamFx { first_decay: 2, second_decay: 3 }),
    ];
    let sizes = (3usize..=150, 1usize..=50);
    let learning = (mode, optimiser, any::<bool>(), 1usize..=5);
    let cells = (prop::option::weighted(0.9, device()), lasting());
    (any::<u64>(), sizes, wiring, learning, chip(), cells).prop_map(
        |(seed, (rows, units), wiring, learning, chip, (device, lasting))| {
            let (mode, optimiser, centred, samples) = learning;
            let plain = mode != Mode::Accumulate;
            let optimiser = if plain { Optimiser::Plain } else { optimiser };
            let chip = chip.with(|h| {
                h.device = device;
                (h.faults, h.endurance, h.leakage, h.ageing) = lasting;
                if let (Some(device), Some(_)) = (&mut h.device, h.ageing) {
                    device.write_noise = Millionths(0);
                }
                if optimiser.is_sign() || mode == Mode::Trains {
                    h.write.residual_bits = ResidualBits::new(0).unwrap();
                }
                if mode == Mode::Trains {
                    h.write.scheme = WriteScheme::Trains { slots_log2: 2 };
                    h.write.increment_max = IncrementMax::new(7).unwrap();
                    if let Some(timing) = &mut h.timing {
                        timing.verify = false;
                        timing.active_max = None;
                    }
                }
            });
            let (chip, centred) = (chip.unwrap(), centred && !plain);
            Case { seed, sizes: [rows, units], wiring, mode, optimiser, centred, samples, chip }
        },
    )
}

impl Case {
    fn engine(&self, backend: Backend) -> Engine {
        let [inputs, units] = self.sizes;
        let spec = LayerSpec {
            inputs,
            units,
            wiring: self.wiring,
            driven_by: DrivenBy::Shared,
            activation: Activation::Identity,
            weight_max_log2: 0,
            initial: InitialLevels::Uniform { gain_64ths: [64, 64] },
            constant_row: false,
            convolution: None,
            copies: 1,
            pool: Pool::None,
            homeostasis: Homeostasis::OFF,
        };
        let layers = vec![Layer::new(2, spec, Delivery::output(units), &self.chip)];
        let mut engine = Engine::new(self.chip.clone(), backend, self.seed, layers);
        engine.set_optimisers(&[self.optimiser]);
        engine.set_centred(&[self.centred.then_some(3)]);
        // Tick counts from the first batch on
        engine.set_phase(Phase::Evaluation);
        let window = self.chip.cell.window;
        let span = usize::from(window.ceiling() - window.floor()) + 1;
        for array in 0..engine.layers()[0].arrays.len() {
            for row in 0..inputs {
                let level = |column| {
                    let at = (array * 1000 + row) * 1000 + column;
                    window.floor() + number(self.seed, at, span) as u16
                };
                let levels: Vec<u16> = (0..units).map(level).collect();
                engine.execute(&Operation::LoadWeights { layer: 0, array, row, levels: &levels });
            }
        }
        engine.settle();
        engine.set_phase(Phase::Training);
        engine
    }

    /// Reads a batch, hears words, writes.
    fn learn(&self, engine: &mut Engine, batch: usize) {
        let ([inputs, units], samples) = (self.sizes, self.samples);
        let at = |of: usize, at: usize| (batch * 3 + of) * 100_000 + at;
        let codes: Vec<u8> =
            (0..samples * inputs).map(|i| number(!self.seed, at(1, i), 256) as u8).collect();
        let words: Vec<i16> =
            (0..samples * units).map(|i| number(self.seed, at(2, i), 255) as i16 - 127).collect();
        let shift = match self.optimiser {
            Optimiser::Sign { .. } => 1,
            Optimiser::AdamFx { .. } => 10,
            Optimiser::Rms => (1 << 14) - 1800,
            _ => 11,
        };
        engine.execute(&Operation::LoadDrives { codes: &codes });
        engine.execute(&Operation::Forward { layer: 0, side: Side::Rows });
        engine.execute(&Operation::Error {
            layer: 0,
            samples: 0..samples,
            words: &words,
            shared: false,
        });
        let mut update = |write, samples| {
            engine.execute(&Operation::Update { layer: 0, write, samples, shift });
        };
        if self.mode == Mode::Accumulate {
            update(Write::Add, 0..samples);
            update(Write::Program, 0..0);
        } else {
            (0..samples).for_each(|sample| update(Write::Now, sample..sample + 1));
        }
    }
}

/// Everything of an array that a write changes: levels, remainders, pruned cells, what cells remember.
type CellsOf = (Vec<u16>, Option<Vec<u16>>, Vec<bool>, Remembered);

/// Pulses sent and their limits, what they left, and when.
type Remembered = (Option<Vec<[u32; 2]>>, Option<Vec<u16>>, Option<Vec<u32>>);

fn cells(engine: &Engine) -> Vec<CellsOf> {
    let arrays = engine.layers()[0].arrays.iter();
    let of = |array: &crate::chip::crossbar::Crossbar| {
        let pruned = array.pruned().map(|bits| bits.iter().by_vals().collect());
        let (levels, pruned) = (array.levels().collect(), pruned.unwrap_or_default());
        (levels, array.residuals(), pruned, (array.wear(), array.left(), array.stamps()))
    };
    arrays.map(of).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    /// Faults this is made for: words of the pulse before, a remainder held by any pulse but the last, the window
    /// of the chip in place of the cell's, a column drawn alone from its neighbour's block; a worn cell that moves, a pulse
    /// that begins at what is read, a stuck cell that forgets.
    #[test]
    fn a_device_answers_in_tick_as_in_every_kernel(case in case()) {
        let mut engines: Vec<_> =
            Backend::available().into_iter().map(|backend| case.engine(backend)).collect();
        let mut tick = Network::new(&case.chip, case.seed, engines[0].layers(), case.samples);
        for batch in 0..2 {
            for (at, engine) in engines.iter_mut().enumerate() {
                if at == 0 {
                    engine.record(true);
                }
                case.learn(engine, batch);
                engine.settle();
            }
            tick.play_tape(&engines[0].record(false));
            let phase = Phase::Training;
            let want = cells(&engines[0]);
            for engine in &engines[1..] {
                prop_assert_eq!(&cells(engine), &want, "{}", engine.backend().name());
                let ledgers = [engine, &engines[0]].map(|e| e.ledger(phase));
                prop_assert_eq!(ledgers[0], ledgers[1]);
            }
            let [fast, slow] = [engines[0].ledger(phase), tick.ledger(phase)];
            prop_assert_eq!(fast.cycles(), slow.cycles());
            let [fast, slow] = [fast, slow].map(|ledger| ledger.entries().collect::<Vec<_>>());
            prop_assert_eq!(fast, slow);
            for (array, (levels, residuals, pruned, (wear, left, stamps))) in want.iter().enumerate() {
                prop_assert_eq!(levels, &tick.levels(0, array), "levels of {}", array);
                if let Some(left) = residuals {
                    let left: Vec<_> = left.iter().map(|&left| i64::from(left)).collect();
                    prop_assert_eq!(left, tick.residuals(0, array), "remainders of {}", array);
                }
                if !pruned.is_empty() {
                    prop_assert_eq!(pruned, &tick.pruned(0, array));
                }
                let memories = tick.memories(0, array);
                for (at, &(spent, beside, when)) in memories.iter().enumerate() {
                    if let Some(wear) = wear {
                        prop_assert_eq!(wear[at][0], spent, "pulses of {} in {}", at, array);
                    }
                    if let Some(left) = left {
                        prop_assert_eq!(left[at], beside, "what was left in {} of {}", at, array);
                    }
                    if let Some(stamps) = stamps {
                        prop_assert_eq!(u64::from(stamps[at]), when, "when, in {} of {}", at, array);
                    }
                }
                // every cell that is not stuck in its own window
                let of = &engines[0].layers()[0].arrays[array];
                let stuck = |at: usize| of.stuck().iter().any(|cell| {
                    (cell.row as usize, cell.column as usize)
                        == (at / case.sizes[1], at % case.sizes[1])
                });
                for (at, &level) in levels.iter().enumerate() {
                    let own = of.own(at / case.sizes[1], at % case.sizes[1]);
                    let inside = own.is_none_or(|own| (own.floor..=own.ceiling).contains(&level));
                    prop_assert!(inside || stuck(at));
                }
            }
        }
    }

    /// A device whose pulses are levels is no device: the same cells, counts and cycles, with the fused kernels on one side.
    #[test]
    fn pulses_of_one_level_are_ideal_cells(mut case in case()) {
        // remainders of cells that do not move follow the level that each law expects: docs/MODEL.md, 3.12
        let plain = case.chip.with(|h| {
            (h.endurance, h.ageing, h.faults) = (None, None, Faults::NONE);
            // verified pulses of ideal cells always arrive, and are no more than asked for
            if let Some(timing) = &mut h.timing {
                timing.verify = false;
            }
            if h.write.residual_bits.get() > 0 {
                h.cell.floor_kind = FloorKind::Recoverable;
            }
        });
        case.chip = plain.unwrap();
        let window = case.chip.cell.window;
        let device = DeviceSpec {
            response: Response::Linear(LinearSteps::default()),
            states: u32::from(window.ceiling() - window.floor()),
            asymmetry: Millionths(0),
            noise: PulseNoise::Off,
            write_noise: Millionths(0),
            tries: DeviceSpec::TRIES,
            spread: CellSpread::default(),
        };
        let with = |device: Option<DeviceSpec>| {
            let chip = case.chip.with(|h| h.device = device.clone()).unwrap();
            let case = Case { chip, ..case.clone() };
            let mut engine = case.engine(Backend::best());
            (0..2).for_each(|batch| case.learn(&mut engine, batch));
            engine.settle();
            (cells(&engine), engine.ledger(Phase::Training).clone())
        };
        prop_assert_eq!(with(Some(device)), with(None));
    }
}

/// The same cells of a device for every number of threads: strips of many panels are written side by side.
#[test]
fn threads_and_back_ends_have_the_same_devices() {
    let spread = CellSpread {
        step: Millionths(300_000),
        asymmetry: Millionths(50_000),
        ceiling: Millionths(50_000),
        floor: Millionths(50_000),
        step_law: SpreadLaw::LogNormal,
    };
    let device = DeviceSpec {
        response: Response::SoftBounds(SoftBoundSteps::default()),
        states: 40,
        asymmetry: Millionths(0),
        noise: PulseNoise::OfStep(Millionths(500_000)),
        write_noise: Millionths(20_000),
        tries: DeviceSpec::TRIES,
        spread,
    };
    let bits = LevelBits::new(8).unwrap();
    let chip = Hardware::reference().with(|h| {
        h.cell.window = Window::new(20, 220, bits).unwrap();
        h.device = Some(device);
        let (spread, worn) = (Millionths(500_000), Worn::Ceiling);
        h.endurance = Some(Endurance { pulses: 6, spread, worn });
        let (rest, spread) = (Millionths(500_000), Millionths(300_000));
        h.leakage = Some(Leakage { lost: 1 << 24, every: 1, rest, spread });
    });
    let case = Case {
        seed: 3,
        sizes: [300, 640],
        wiring: Wiring::Dual,
        mode: Mode::Accumulate,
        optimiser: Optimiser::Plain,
        centred: false,
        samples: 4,
        chip: chip.unwrap(),
    };
    let run = |backend, threads| {
        let mut engine = case.engine(backend);
        engine.set_threads(threads).unwrap();
        (0..2).for_each(|batch| case.learn(&mut engine, batch));
        cells(&engine)
    };
    let want = run(Backend::Scalar, 1);
    for backend in Backend::available() {
        for threads in [1, 2, 3] {
            assert!(run(backend, threads) == want, "{} on {threads}", backend.name());
        }
    }
    let moved = case.engine(Backend::Scalar);
    assert!(cells(&moved) != want, "the case is none");
}
