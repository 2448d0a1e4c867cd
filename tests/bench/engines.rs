//! Fast, Tick and RTL on one program: simulated cycles and products a second, in one table.
//!
//! ```text
//! cargo bench --features rtl --bench engines
//! ```
//!
//! One tile of 64 x 64 with lossless converters learns from batches of four samples: four reads, four times words and
//! `UPD(add)`, one `UPD(write)`. All three must end with the same levels after the same number of cycles; only then
//! are they timed.
#![expect(
    clippy::disallowed_types,
    clippy::unwrap_used,
    reason = "a race needs a clock, and what cannot be built ends it"
)]

use std::time::Instant;

use dalean::chip::crossbar::kernel::Backend;
use dalean::chip::engine::tick::{Command, More, Network, TileAdc, TileConfig};
use dalean::chip::engine::{Engine, Operation, Phase, Side, Write};
use dalean::chip::hardware::{Hardware, PulseCode, Timing};
use dalean::chip::layer::{DrivenBy, Homeostasis, InitialLevels, Layer, LayerSpec, Pool, Taps};
use dalean::chip::population::Wiring;
use dalean::num::draw::{Place, Site};
use dalean::num::fixed::*;
use dalean::num::tables::Activation;

#[path = "../rtl/model.rs"]
mod model;

use model::Rtl;

const SIDE: usize = 64;
const SAMPLES: usize = 4;
const WORDS: usize = 10;
const SHIFT: u32 = 13;
const SEED: u64 = 1;

fn timing() -> Timing {
    Timing {
        clock_khz: 1_000_000,
        beat: 1,
        settle: 10,
        convert: 1,
        share: 8,
        overlapped: true,
        lanes: 16,
        hops: 2,
        pulse: 10,
        pulse_code: PulseCode::Unary,
        verify: false,
        active_max: None,
        slices: None,
    }
}

fn hardware() -> Hardware {
    Hardware::reference()
        .with(|h| {
            h.tile.rows = SIDE;
            h.tile.columns = SIDE;
            h.tile.transposed_read = false;
            h.drive.dac_bits = 2;
            h.digital.lut_bits = LutBits::new(6).unwrap();
            h.timing = Some(timing());
        })
        .unwrap()
}

fn layer(hardware: &Hardware) -> Layer {
    let spec = LayerSpec {
        inputs: SIDE,
        units: SIDE,
        wiring: Wiring::DualReadout,
        driven_by: DrivenBy::Shared,
        activation: Activation::Identity,
        weight_max_log2: 2,
        initial: InitialLevels::Uniform { gain_64ths: [64, 64] },
        constant_row: false,
        convolution: None,
        copies: 1,
        pool: Pool::None,
        homeostasis: Homeostasis::OFF,
    };
    let words = (0..SIDE).map(|unit| u16::try_from(unit % WORDS).unwrap()).collect();
    Layer::new(0, spec, Taps { width: WORDS, per_unit: 1, words, shift: 0 }, hardware)
}

/// Numbers from nowhere in particular, the same every time.
fn number(at: usize) -> usize {
    (at.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) & 0xffff
}

fn levels(array: usize, row: usize) -> Vec<u16> {
    (0..SIDE).map(|c| (number((array * SIDE + row) * SIDE + c) % 256) as u16).collect()
}

/// Drive codes and words of a batch.
fn batch(at: usize) -> (Vec<u8>, Vec<i16>) {
    let codes = (0..SAMPLES * SIDE).map(|i| (number(at * 7919 + i) % 256) as u8).collect();
    let words = (0..SAMPLES * WORDS).map(|i| (number(at * 104_729 + i) % 255) as i16 - 127);
    (codes, words.collect())
}

fn operations<'a>(codes: &'a [u8], words: &'a [i16]) -> [Operation<'a>; 5] {
    let update = |write, samples| Operation::Update { layer: 0, write, samples, shift: SHIFT };
    [
        Operation::LoadDrives { codes },
        Operation::Forward { layer: 0, side: Side::Rows },
        Operation::Error { layer: 0, samples: 0..SAMPLES, words, shared: false },
        update(Write::Add, 0..SAMPLES),
        update(Write::Program, 0..0),
    ]
}

fn engine() -> Engine {
    let hardware = hardware();
    let layers = vec![layer(&hardware)];
    let mut engine = Engine::new(hardware, Backend::best(), SEED, layers);
    for (array, row) in (0..2).flat_map(|array| (0..SIDE).map(move |row| (array, row))) {
        let levels = levels(array, row);
        engine.execute(&Operation::LoadWeights { layer: 0, array, row, levels: &levels });
    }
    engine
}

/// The verilated tile and what drives it.
struct Driver {
    rtl: Rtl,
    cycles: u64,
    count: u64,
}

impl Driver {
    fn new(engine: &Engine) -> Self {
        let hardware = hardware();
        let t = timing();
        let lut = &engine.layers()[0].lut;
        let config = TileConfig {
            rows: SIDE,
            columns: SIDE,
            settle: t.settle,
            convert: t.convert,
            share: 8,
            overlap: t.overlapped,
            slices: hardware.slices(),
            dac_bits: hardware.drive.dac_bits,
            tree: 0,
            lanes: 16,
            hops: 2,
            words: WORDS,
            tap_base: 0,
            pulse: t.pulse,
            adc: TileAdc::Ideal,
            lut_bits: 6,
            lut_shift: lut.shift,
            error_bits: 8,
            negate: false,
            mantissa: 1,
            dither_bits: 8,
            increment_max: 7,
            floor: 0,
            ceiling: 255,
            absorbing: false,
            more: More::default(),
        };
        let table = lut.activity.iter().zip(&lut.derivative).map(|(&a, &d)| [a, d]);
        let mut rtl = Rtl::new(SIDE).expect("the bench builds a tile of its size");
        rtl.configure(&config, &table.collect::<Vec<_>>());
        rtl.reset();
        assert_eq!(rtl.layout[0].0, "level_e", "levels come first");
        let mut driver = Self { rtl, cycles: 0, count: 0 };
        for row in 0..SIDE {
            let levels = [levels(0, row), levels(1, row)];
            driver.command(&Command::LoadWeights { row, levels: [&levels[0], &levels[1]] }, &[]);
        }
        driver.cycles = 0;
        driver
    }

    fn cycle(&mut self, command: Option<&Command<'_>>, words: &[i16]) -> bool {
        let zeros = [0; SIDE];
        let out = self.rtl.set_inputs(command, 0, [&zeros, &zeros]);
        if out.dither_wanted == 1 {
            let row = out.dither_row as usize;
            let draws = [0, 1].map(|pathway| {
                let place = Place {
                    seed: SEED,
                    site: Site::WriteDither,
                    layer: 0,
                    pathway,
                    sub: 0,
                    count: self.count,
                };
                let draw = |column| {
                    let mut bytes = [0; 64];
                    place.bytes(SIDE, column, 0, &mut bytes);
                    u16::from(bytes[row])
                };
                (0..SIDE).map(draw).collect::<Vec<_>>()
            });
            self.rtl.set_inputs(command, 0, [&draws[0], &draws[1]]);
        } else if let Some(&word) = words.get(out.bus_index as usize) {
            self.rtl.set_inputs(command, word, [&zeros, &zeros]);
        }
        self.rtl.edge();
        self.cycles += 1;
        out.ready == 1
    }

    fn command(&mut self, command: &Command<'_>, words: &[i16]) {
        while !self.cycle(Some(command), words) {}
    }

    /// Offers a command until it is taken; words are those of the `ERR` before, while it lasts.
    fn batch(&mut self, codes: &[u8], words: &[i16]) {
        for (slot, codes) in codes.chunks_exact(SIDE).enumerate() {
            for (row, &code) in codes.iter().enumerate() {
                self.command(&Command::LoadDrives { row, slot, codes: [code; 2] }, &[]);
            }
        }
        for slot in 0..SAMPLES {
            self.command(&Command::Forward { slot }, &[]);
        }
        for (slot, words) in words.chunks_exact(WORDS).enumerate() {
            self.command(&Command::Error { slot }, &[]);
            self.command(&Command::Add { slot }, words);
        }
        self.command(&Command::Write { shift: SHIFT }, &[]);
    }

    /// Until the write is done: idle tiles take a load.
    fn finish(&mut self) {
        self.command(&Command::LoadDrives { row: 0, slot: 0, codes: [0; 2] }, &[]);
        self.count += 1;
    }

    fn levels(&mut self) -> Vec<u16> {
        self.rtl.read_registers();
        let levels = &self.rtl.registers[..2 * SIDE * SIDE];
        levels.iter().map(|&level| u16::try_from(level).unwrap()).collect()
    }
}

/// Batches a second, in about a second and a half.
fn rate(mut one: impl FnMut(usize)) -> f64 {
    let start = Instant::now();
    let mut done = 0;
    while start.elapsed().as_secs_f64() < 1.5 || done < 3 {
        one(done);
        done += 1;
    }
    done as f64 / start.elapsed().as_secs_f64()
}

fn main() {
    let mut fast = engine();
    let mut tick = Network::new(&hardware(), SEED, fast.layers(), SAMPLES);
    let mut rtl = Driver::new(&fast);
    let elapsed = |engine: &Engine| {
        let cycles = engine.ledger(Phase::Training).cycles().unwrap();
        cycles.elapsed() - cycles.interval(dalean::chip::ledger::Interval::Load)
    };

    // the same levels after the same number of cycles
    for at in 0..5 {
        let (codes, words) = batch(at);
        let list = operations(&codes, &words);
        let before = (elapsed(&fast), rtl.cycles);
        list.iter().for_each(|operation| fast.execute(operation));
        fast.settle();
        tick.run(&list);
        rtl.batch(&codes, &words);
        rtl.finish();
        // loads are cycles of the RTL alone; the last one is accepted in the cycle after the write
        let loads = (SAMPLES * SIDE) as u64 + 1;
        assert_eq!(
            elapsed(&fast) - before.0 + loads,
            rtl.cycles - before.1,
            "cycles of batch {at}"
        );
        let arrays = &fast.layers()[0].arrays;
        let now: Vec<u16> = arrays.iter().flat_map(|array| array.levels()).collect();
        assert_eq!([tick.levels(0, 0), tick.levels(0, 1)].concat(), now, "Tick, batch {at}");
        assert_eq!(rtl.levels(), now, "RTL, batch {at}");
    }

    let cycles = {
        let (codes, words) = batch(0);
        let before = elapsed(&fast);
        operations(&codes, &words).iter().for_each(|operation| fast.execute(operation));
        fast.settle();
        (elapsed(&fast) - before) as f64
    };
    let macs = (2 * 2 * SAMPLES * SIDE * SIDE) as f64;
    let batches: Vec<_> = (0..16).map(batch).collect();
    let rates = [
        (
            "Fast",
            rate(|at| {
                let (codes, words) = &batches[at % 16];
                operations(codes, words).iter().for_each(|operation| fast.execute(operation));
                fast.settle();
            }),
        ),
        (
            "Tick",
            rate(|at| {
                let (codes, words) = &batches[at % 16];
                tick.run(&operations(codes, words));
            }),
        ),
        (
            "RTL, Verilator",
            rate(|at| {
                let (codes, words) = &batches[at % 16];
                rtl.batch(codes, words);
                rtl.finish();
            }),
        ),
    ];
    println!(
        "one tile of {SIDE} x {SIDE}, lossless converters, batches of {SAMPLES}: about {cycles} cycles each"
    );
    println!(
        "{:16} {:>12} {:>14} {:>12} {:>10}",
        "engine", "batches / s", "cycles / s", "MAC / s", "x RTL"
    );
    let slowest = rates[2].1;
    for (name, rate) in rates {
        println!(
            "{name:16} {rate:12.1} {:14.3e} {:12.3e} {:10.1}",
            rate * cycles,
            rate * macs,
            rate / slowest
        );
    }
}
