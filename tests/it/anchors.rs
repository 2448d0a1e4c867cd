//! Published chips: throughput from their own parameters, by the formulas of the engine.
//!
//! Only reading is anchored. No published chip says how long an in-place update of an unsigned crossbar takes.

use dalean::chip::ledger::Event;
use dalean::lab::config::{Config, Sources, load};
use dalean::lab::price::{Convention, Peak, peak};

fn chip(model: &str, settings: &[String]) -> Config {
    load(&Sources { hardware: Some(model), settings, ..Sources::default() }).unwrap()
}

fn peak_of(config: &Config) -> Peak {
    let hardware = config.hardware();
    let tiles = hardware.tile.count_max.unwrap() as u64;
    peak(hardware, tiles, u64::from(hardware.slices()), Convention::PAIRS).unwrap()
}

/// How far `found` lies from `published`.
#[track_caller]
fn within(what: &str, found: f64, published: f64, tolerance: f64) {
    let error = found / published - 1.0;
    println!("{what}: {found:.4}, published {published}, {:+.2} %", 100.0 * error);
    assert!(error.abs() <= tolerance, "{what}: {found} instead of {published}");
}

/// NeuRRAM (Wan et al., Nature 2022) at pairs of input and output bits. Inputs are signed on the chip: `n` bits have
/// `n - 1` of magnitude, but at least 1; above 3 they are read in two phases.
fn neurram(input_bits: u32, output_bits: u32) -> Config {
    let magnitude = (input_bits - 1).max(1);
    let phases = if magnitude > 3 { 2 } else { 1 };
    let settings = [
        format!("hw.drive.bits={magnitude}"),
        format!("hw.drive.phases={phases}"),
        format!("hw.adc.bits={output_bits}"),
    ];
    chip("neurram", &settings)
}

#[test]
fn neurram_reads_as_fast_as_published() {
    for (input_bits, output_bits, published) in [(1, 3, 2.122), (4, 6, 0.744), (8, 10, 0.264)] {
        let config = neurram(input_bits, output_bits);
        let timing = config.hardware().timing.unwrap();
        assert_eq!(timing.clock_khz, 100_000, "0.01 us a cycle");
        let tops = peak_of(&config).alone.1 / 1e12;
        let name = format!("NeuRRAM ({input_bits}, {output_bits}) TOPS");
        within(&name, tops, published, 0.06);
    }
    // the model file is the last of these modes
    assert_eq!(neurram(8, 10).hardware(), chip("neurram", &[]).hardware());
}

/// Each phase is converted after it, to the bits that it still owes: microseconds of a read, by hand.
#[test]
fn neurram_takes_the_steps_of_each_phase() {
    let read = |magnitude: &[u32], owed: &[u32]| {
        let pulses: f64 = magnitude.iter().map(|&bits| 0.27 * f64::from((1 << bits) - 1)).sum();
        let steps: f64 = owed.iter().map(|&bits| 0.30 * f64::from(bits + 1)).sum();
        pulses + steps
    };
    for (bits, magnitude, owed) in [
        ((1, 3), &[1][..], &[3][..]),
        ((3, 5), &[2], &[5]),
        ((4, 6), &[3], &[6]),
        ((5, 7), &[2, 2], &[7, 5]),
        ((6, 8), &[3, 2], &[8, 5]),
        ((7, 9), &[3, 3], &[9, 6]),
        ((8, 10), &[4, 3], &[10, 6]),
        ((8, 4), &[4, 3], &[4, 1]),
    ] {
        let found = peak_of(&neurram(bits.0, bits.1)).alone.0.seconds;
        // two cycles more: the command that is accepted, and one group of lanes
        let wanted = 1e-6 * read(magnitude, owed) + 2e-8;
        assert!((found / wanted - 1.0).abs() < 1e-9, "{bits:?}: {found} instead of {wanted}");
    }
}

/// HERMES (Le Gallo et al., Nature Electronics 2023), one phase.
#[test]
fn hermes_reads_as_fast_as_published() {
    let config = chip("hermes", &[]);
    let peak = peak_of(&config);
    within("HERMES one-phase read, ns", 1e9 * peak.alone.0.seconds, 132.9, 0.01);
    within("HERMES one-phase TOPS", peak.alone.1 / 1e12, 63.1, 0.01);
}

/// The energy of a read of a whole tile: fitted to this point, so that it shows the fit and predicts nothing.
#[test]
fn hermes_takes_the_power_it_was_fitted_to() {
    let config = chip("hermes", &[]);
    let (rows, columns) = (256.0, 256.0);
    let counts = [
        (Event::DacSlices, 2.0 * rows),
        (Event::CellReads, 2.0 * rows * columns),
        (Event::Holds, 2.0 * columns),
        (Event::Conversions, columns),
        (Event::ShiftAdds, columns),
        (Event::LookUps, columns),
        (Event::SramBits, 2.0 * rows * 7.0 + columns * 32.0),
    ];
    let joules =
        counts.map(|(event, count)| count * config.constants().of(event).unwrap().value[1]);
    let operations = 2.0 * rows * columns;
    let tops_per_watt = operations / joules.iter().sum::<f64>() / 1e12;
    within("HERMES one-phase TOPS/W", tops_per_watt, 9.76, 0.01);
}

/// ISAAC-CE (Shafiee et al., ISCA 2016): a design study, and its figure is remembered. 16,128 arrays, two of which
/// are a tile here; eight cells make one of its weights; inputs have 16 bits, more than a drive code here.
#[test]
fn isaac_reads_as_fast_as_designed() {
    let config = chip("isaac", &[]);
    let peak = peak(config.hardware(), 16_128 / 2, 16, Convention::with_cells(8)).unwrap();
    within("ISAAC-CE TOPS (assumed)", peak.back_to_back.1 / 1e12, 40.9, 0.02);
}

/// Jia et al., JSSC 2020, brought as a user brings a chip: at one-bit operands, array and converters alone, as published.
/// The time of a read is fitted to this point; the energies are those of the chip's own table.
#[test]
fn a_chip_of_ones_own_meets_what_was_published_of_it() {
    let config = chip(concat!(env!("CARGO_MANIFEST_DIR"), "/hw_models/own/jia2020.toml"), &[]);
    let peak = peak(config.hardware(), 1, 1, Convention::PAIRS).unwrap();
    within("Jia 2020 TOPS", peak.alone.1 / 1e12, 0.874, 0.005);
    let of = |event| config.constants().of(event).unwrap().value[1];
    let (rows, columns) = (2304.0, 256.0);
    let joules = 2.0 * rows * columns * of(Event::CellReads) + columns * of(Event::Conversions);
    let tops_per_watt = 2.0 * rows * columns / joules / 1e12;
    within("Jia 2020 TOPS/W", tops_per_watt, 400.0, 0.005);
}
