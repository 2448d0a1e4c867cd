//! A second pair of eyes: `tests/golden/oracle.py` was written from the specification alone, in plain Python, and
//! its results are compared with the engine's, integer for integer.
//!
//! `oracle.py > golden.json` makes the file again.

mod conv;

use dalean::chip::crossbar::kernel::Backend;
use dalean::chip::engine::Phase;
use dalean::chip::hardware::{
    Adc, AdcRange, DitherBits, DitherPattern, FloorKind, Hardware, Subtract, Window,
};
use dalean::chip::layer::{DrivenBy, Homeostasis, InitialLevels, LayerSpec, Optimiser, Pool};
use dalean::chip::ledger::{During, Event};
use dalean::chip::population::Wiring;
use dalean::learn::error::{Centre, OutputError};
use dalean::learn::network::NetworkSpec;
use dalean::learn::route::Route;
use dalean::learn::rule::{Control, Rule, UpdateMode};
use dalean::num::fixed::*;
use dalean::num::tables::{Activation, Decay, Lut, Positive, Unit};
use dalean::task::classify::{Coding, Examples, Experiment, Trainer};
use serde_json::Value;
use sha2::{Digest, Sha256};

fn golden() -> Value {
    serde_json::from_str(include_str!("../golden/golden.json")).unwrap()
}

fn int(v: &Value) -> i64 {
    v.as_i64().unwrap_or_else(|| panic!("{v} is a whole number"))
}

fn text(v: &Value) -> &str {
    v.as_str().unwrap_or_else(|| panic!("{v} is text"))
}

fn ints(v: &Value) -> Vec<i64> {
    v.as_array().unwrap().iter().map(int).collect()
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

/// The data set of the oracle, by its formula.
fn examples(features: u64, classes: u64) -> Examples {
    let (mut values, mut labels) = (Vec::new(), Vec::new());
    for i in 0..48u64 {
        let label = i % classes;
        labels.push(label as u8);
        for j in 0..features {
            let proto = ((label * 7919 + j * 104_729 + label * j * 977) >> 3) % 17;
            let h = (i * 2_654_435_761 + j * 40_503 * (i + 1)) >> 7;
            let x = match j {
                0 | 69 => 0,
                _ if h % 4 != 0 => proto,
                _ => (h >> 5) % 17,
            };
            values.push(x as u8);
        }
    }
    Examples::new(values, labels, features as usize, 16, classes as usize).unwrap()
}

fn hardware(s: &Value) -> Hardware {
    let level_bits = LevelBits::new(int(&s["level_bits"])).unwrap();
    let adc = match text(&s["adc"]) {
        "ideal" => Adc::Ideal,
        _ => Adc::Finite {
            bits: AdcBits::new(int(&s["adc_bits"])).unwrap(),
            subtract: match text(&s["subtract"]) {
                "digital" => Subtract::Digital,
                _ => Subtract::Current,
            },
            range: match &s["adc_range"] {
                Value::String(range) if range == "full" => AdcRange::Full,
                Value::String(range) if range == "tracking" => AdcRange::Tracking,
                Value::String(_) => AdcRange::Calibrated {
                    headroom: int(&s["headroom"]) as u32,
                    every_epoch: false,
                },
                shift => AdcRange::Shift(int(shift) as u32),
            },
        },
    };
    Hardware::reference()
        .with(|h| {
            h.cell.level_bits = level_bits;
            h.cell.window = Window::new(int(&s["floor"]), int(&s["ceiling"]), level_bits).unwrap();
            h.cell.floor_kind = match text(&s["floor_kind"]) {
                "recoverable" => FloorKind::Recoverable,
                _ => FloorKind::Absorbing,
            };
            h.tile.rows = int(&s["tile_rows"]) as usize;
            h.tile.columns = 128;
            h.tile.transposed_read = false;
            h.drive.bits = DriveBits::new(int(&s["drive_bits"])).unwrap();
            // what the oracle leaves at 8 bits of a narrower code is one slice
            h.drive.dac_bits = (int(&s["dac_bits"]) as u32).min(h.drive.bits.get());
            h.adc = adc;
            h.digital.lut_bits = LutBits::new(int(&s["lut_bits"])).unwrap();
            h.digital.error_bits = ErrorBits::new(int(&s["error_bits"])).unwrap();
            h.write.increment_max = IncrementMax::new(int(&s["d_max"])).unwrap();
            h.write.dither_bits = match int(&s["dither_bits"]) {
                0 => DitherBits::Zero,
                8 => DitherBits::Eight,
                _ => DitherBits::Sixteen,
            };
            h.write.dither_pattern = match text(&s["dither"]) {
                "per_cell" => DitherPattern::PerCell,
                _ => DitherPattern::Separable,
            };
            h.write.residual_bits = ResidualBits::new(int(&s["residual_bits"])).unwrap();
        })
        .unwrap()
}

fn experiment(s: &Value) -> Experiment {
    let widths = ints(&s["widths"]);
    let layers = widths
        .windows(2)
        .enumerate()
        .map(|(l, pair)| {
            let last = l + 2 == widths.len();
            LayerSpec {
                inputs: pair[0] as usize,
                units: pair[1] as usize,
                wiring: if last { Wiring::DualReadout } else { Wiring::Dual },
                driven_by: if l == 0 { DrivenBy::Shared } else { DrivenBy::Streams },
                activation: activation(&s["act"][l], &s["alpha"][l]),
                weight_max_log2: int(&s["weight_max"][l]).ilog2() as i32,
                initial: InitialLevels::Uniform {
                    gain_64ths: if last { [64, 64] } else { [96, 32] },
                },
                constant_row: false,
                convolution: None,
                copies: 1,
                pool: Pool::None,
                homeostasis: Homeostasis::OFF,
            }
        })
        .collect();
    let taps = int(&s["taps"]) as usize;
    // one tap has no sum to shift
    let shift = (taps > 1).then(|| int(&s["tap_shift"]) as u32);
    let network = NetworkSpec {
        layers,
        rule: Rule::Ed,
        mode: mode(s),
        error: OutputError::OneVsAll,
        centre: centre(s),
        route: Some(Route::Modulo { taps, shift }),
        batch: Batch::new(int(&s["batch"])).unwrap(),
        mantissas: vec![RateMantissa::new(int(&s["mantissa"])).unwrap(); widths.len() - 1],
        rates: s["rate"].as_array().unwrap().iter().map(positive).collect(),
        decay: Decay::Constant,
        optimisers: vec![Optimiser::Plain; widths.len() - 1],
        centred: vec![false; widths.len() - 1],
        control: Control::None,
        refresh: None,
    };
    Experiment {
        seed: text(&s["seed_decimal"]).parse().unwrap(),
        hardware: hardware(s),
        network,
        epochs: int(&s["epochs"]) as u32,
        coding: Coding::Values,
        augment: None,
    }
}

fn mode(s: &Value) -> UpdateMode {
    match text(&s["mode"]) {
        "accumulate" => UpdateMode::Accumulate,
        "replay" => UpdateMode::Replay,
        _ => UpdateMode::Online,
    }
}

fn centre(s: &Value) -> Centre {
    match text(&s["centre"]) {
        "none" => Centre::None,
        "batch" => Centre::Batch,
        _ => Centre::Running,
    }
}

fn activation(name: &Value, alpha: &Value) -> Activation {
    match text(name) {
        "relu" => Activation::Relu,
        "identity" => Activation::Identity,
        _ => Activation::Sigmoid(positive(alpha)),
    }
}

fn positive(v: &Value) -> Positive {
    Positive::new(v.as_f64().unwrap()).unwrap()
}

fn compare(name: &str, trainer: &Trainer, want: &Value) {
    let failures = differences(trainer, want);
    assert!(failures.is_empty(), "{name}:\n{}", failures.join("\n"));
}

/// In the head of the state hash, and the counts, from what the oracle wrote.
fn differences(trainer: &Trainer, want: &Value) -> Vec<String> {
    let engine = trainer.driver().engine();
    let ledger = engine.ledger(Phase::Training);
    let mut state = Sha256::new();
    state.update(1u32.to_le_bytes());
    let mut failures = Vec::new();
    for (l, layer) in engine.layers().iter().enumerate() {
        for (a, pathway) in layer.spec.wiring.pathways().iter().enumerate() {
            let array = &layer.arrays[a];
            let levels: Vec<u8> = array.levels().flat_map(u16::to_le_bytes).collect();
            state.update((array.layout().rows as u32).to_le_bytes());
            state.update((array.layout().columns as u32).to_le_bytes());
            state.update(&levels);
            if let Some(bits) = array.pruned() {
                let mut bits = bits;
                bits.set_uninitialized(false);
                state.update(bits.as_raw_slice());
            }
            if let Some(residuals) = array.residuals() {
                let bytes: Vec<u8> = residuals.into_iter().flat_map(u16::to_le_bytes).collect();
                state.update(&bytes);
            }
            let want = &want["pathways"][format!("layer{l}.{}", pathway.name)];
            let count =
                |event| int(&Value::from(ledger.get(l, pathway.code, During::Update, event)));
            for (what, got, want) in [
                ("writes", layer.writes[a] as i64, &want["writes"]),
                ("requested", count(Event::Requested), &want["requested"]),
                ("bounded", count(Event::Bounded), &want["bounded"]),
                ("attempted", count(Event::PulsesAttempted), &want["attempted"]),
                ("effective", count(Event::PulsesEffective), &want["effective"]),
                ("level sum", array.levels().map(i64::from).sum(), &want["level_sum"]),
            ] {
                if got != int(want) {
                    failures.push(format!("layer {l} {} {what}: {got} != {want}", pathway.name));
                }
            }
            let digest = hex(&Sha256::digest(&levels));
            if digest != text(&want["levels_sha256"]) {
                failures.push(format!("layer {l} {} levels differ", pathway.name));
            }
        }
    }
    if hex(&state.finalize()) != text(&want["state_level_part_sha256"]) {
        failures.push("the head of the state hash differs".into());
    }
    for (what, event) in [
        ("conversion", Event::SaturatedConversions),
        ("table", Event::SaturatedLookUps),
        ("error_word", Event::SaturatedErrors),
        ("gate", Event::SaturatedGates),
    ] {
        let got = ledger.total(event);
        let want = &want["saturations_training"][what];
        if got as i64 != int(want) {
            failures.push(format!("saturated {what}: {got} != {want}"));
        }
    }
    if let Value::Array(_) = &want["mu"] {
        let got = trainer.driver().unit().means();
        if got != ints(&want["mu"]) {
            failures.push(format!("running centres {got:?} != {}", want["mu"]));
        }
    }
    failures
}

fn compare_shifts(name: &str, trainer: &Trainer, want: &Value) {
    let failures = differences_of_shifts(trainer, want);
    assert!(failures.is_empty(), "{name}:\n{}", failures.join("\n"));
}

fn differences_of_shifts(trainer: &Trainer, want: &Value) -> Vec<String> {
    let mut failures = Vec::new();
    for (l, layer) in trainer.driver().engine().layers().iter().enumerate() {
        for (target, shifts) in ["p", "n"].into_iter().zip(&layer.adc_shifts) {
            let got: Vec<i64> = shifts.iter().map(|&shift| i64::from(shift)).collect();
            if got != ints(&want[l][target]) {
                let want = &want[l][target];
                failures
                    .push(format!("converter shifts of layer {l}, {target}: {got:?} != {want}"));
            }
        }
    }
    failures
}

fn run(case: &Value, backend: Backend) {
    let (name, s) = (text(&case["name"]), &case["settings"]);
    let data = examples(int(&s["features"]) as u64, int(&s["classes"]) as u64);
    let experiment = experiment(s);
    let seeded = experiment.build(backend, &data).unwrap();
    let mut trainer = Trainer::new(experiment, seeded);
    for (l, layer) in trainer.driver().engine().layers().iter().enumerate() {
        assert_eq!(i64::from(layer.lut.shift), int(&s["lsh"][l]), "{name}: lsh of layer {l}");
        assert_eq!(i64::from(trainer.driver().shift(l)), int(&s["k"][l]), "{name}: k of layer {l}");
    }
    compare(&format!("{name}, at the start"), &trainer, &case["after_init"]);
    if trainer.calibrate(&data).is_some() {
        compare_shifts(name, &trainer, &s["ash"]);
    }
    for (epoch, want) in case["after_epoch"].as_array().unwrap().iter().enumerate() {
        trainer.learn(&data, &mut |_| true).unwrap();
        compare(&format!("{name}, epoch {epoch}"), &trainer, want);
        if let shifts @ Value::Array(_) = &want["ash"] {
            compare_shifts(&format!("{name}, epoch {epoch}"), &trainer, shifts);
        }
    }
    let predictions: Vec<i64> =
        trainer.evaluate(&data).predictions.iter().map(|&p| i64::from(p)).collect();
    assert_eq!(predictions, ints(&case["prediction"]["classes"]), "{name}: predictions");
}

#[test]
fn tables_equal_the_oracle() {
    let golden = golden();
    let tables = golden["micro"]["luts"].as_array().unwrap();
    assert!(tables.len() >= 18);
    for want in tables {
        let unit = Unit {
            weight_max_log2: int(&want["weight_max_log2"]) as i32,
            level_bits: LevelBits::new(int(&want["level_bits"])).unwrap(),
            drive_bits: DriveBits::new(int(&want["drive_bits"])).unwrap(),
            full_drive: dalean::num::tables::FullDrive::One,
        };
        let bits = LutBits::new(int(&want["lut_bits"])).unwrap();
        let lut = Lut::new(activation(&want["activation"], &want["alpha"]), bits, unit);
        assert_eq!(i64::from(lut.shift), int(&want["lsh"]), "{want}");
        for (table, name) in [(&lut.activity, "lut_a_sha256"), (&lut.derivative, "lut_d_sha256")] {
            assert_eq!(hex(&Sha256::digest(table)), text(&want[name]), "{name} of {want}");
        }
    }
}

#[test]
fn the_engine_equals_the_oracle_on_every_back_end() {
    let golden = golden();
    let cases = golden["cases"].as_array().unwrap();
    assert!(cases.len() >= 30);
    for backend in Backend::available() {
        for case in cases {
            run(case, backend);
        }
    }
}
