//! Whole trainings of networks with convolutions, pools, thresholds, gains, a softmax error and optimisers: the second
//! half of the oracle, `tests/golden/oracle_conv.py`, written from the specification alone.
//!
//! `oracle_conv.py > golden_conv.json` makes the file again.

use super::*;
use bitvec::prelude::{BitVec, Lsb0};
use dalean::chip::crossbar::kernel::ConvShape;
use dalean::chip::layer::Gain;
use dalean::chip::state::{Piece, Seen, State as _, Visitor};
use std::collections::BTreeMap;

/// Numbers of the state, by section and in the order in which they are hashed.
#[derive(Default)]
struct Numbers(BTreeMap<u32, Vec<i64>>);

impl Visitor for Numbers {
    fn halves(&mut self, _: &Piece<'_>, _: [usize; 2], _: &dyn Fn() -> Vec<u16>) -> Seen<Vec<u16>> {
        Ok(None)
    }

    fn bits(
        &mut self,
        _: &Piece<'_>,
        _: [usize; 2],
        _: &dyn Fn() -> BitVec<u8, Lsb0>,
    ) -> Seen<BitVec<u8, Lsb0>> {
        Ok(None)
    }

    fn numbers(&mut self, piece: &Piece<'_>, values: &[i64]) -> Seen<Vec<i64>> {
        if let Some(section) = piece.section {
            self.0.entry(section as u32).or_default().extend(values);
        }
        Ok(None)
    }

    fn rows(&mut self, _: &Piece<'_>, _: usize, _: &dyn Fn() -> Vec<i64>) -> Seen<Vec<i64>> {
        Ok(None)
    }
}

/// The images of the oracle, by their formula, plane by plane.
fn images(s: &Value) -> Examples {
    let of = |name: &str| int(&s[name]) as u64;
    let (height, width, channels) = (of("height"), of("width"), of("channels"));
    let (classes, steps) = (of("classes"), of("full_scale") + 1);
    let (mut values, mut labels) = (Vec::new(), Vec::new());
    for i in 0..of("examples") {
        let t = i % classes;
        labels.push(t as u8);
        for at in 0..channels * height * width {
            let (c, y, x) = (at / (height * width), at / width % height, at % width);
            let proto = 41 * (y * (2 * t + 1) + x * (t * t + 3) + c * (t + 2));
            let h = (i * 2_654_435_761 + ((y * width + x) * channels + c) * 40_503 * (i + 1)) >> 7;
            values.push((if h % 4 == 0 { h >> 5 } else { proto } % steps) as u8);
        }
    }
    let features = (height * width * channels) as usize;
    Examples::new(values, labels, features, (steps - 1) as u8, classes as usize).unwrap()
}

fn coding(s: &Value) -> Coding {
    let image = ["height", "width", "channels"].map(|name| int(&s[name]) as usize);
    match text(&s["coding"]) {
        "white" => Coding::White { image },
        "on_off" => Coding::OnOff { image },
        _ => Coding::Pixels { image },
    }
}

fn rule(s: &Value) -> Rule {
    if text(&s["rule"]) == "bp" { Rule::Bp } else { Rule::Ed }
}

fn layer(l: usize, last: bool, rule: Rule, a: &Value) -> LayerSpec {
    let size = |name: &str| int(&a[name]) as usize;
    let below = ints(&a["below"]);
    LayerSpec {
        inputs: size("fan_in"),
        units: size("units"),
        wiring: match rule {
            Rule::Bp => Wiring::Single,
            _ if last => Wiring::DualReadout,
            _ => Wiring::Dual,
        },
        driven_by: if l == 0 { DrivenBy::Shared } else { DrivenBy::Streams },
        activation: match text(&a["act"]) {
            "ramp" => Activation::Ramp,
            "accumulator" => Activation::Accumulator,
            _ => activation(&a["act"], &a["alpha"]),
        },
        weight_max_log2: int(&a["weight_max"]).ilog2() as i32,
        initial: InitialLevels::Uniform {
            gain_64ths: if last || rule == Rule::Bp { [64, 64] } else { [96, 32] },
        },
        constant_row: false,
        copies: 1,
        convolution: a["side"].is_i64().then(|| ConvShape {
            height: below[0] as usize,
            width: below[1] as usize,
            channels: below[2] as usize,
            side: size("side"),
            stride: size("stride"),
            pad: size("border"),
        }),
        pool: match a["pool"].as_str() {
            None => Pool::None,
            Some("max") => Pool::Max { side: size("pool_side") },
            Some(_) => Pool::Average { side: size("pool_side") },
        },
        homeostasis: Homeostasis {
            threshold: a["threshold"] == true,
            gain: match text(&a["gain"]) {
                "fixed" => Gain::Fixed { spread: int(&a["spread"]) as u32 },
                "tracking" => Gain::Tracking,
                _ => Gain::Table,
            },
            window_log2: int(&a["window"]) as u32,
        },
    }
}

fn optimiser(a: &Value) -> Optimiser {
    match text(&a["optimiser"]) {
        "rms" => Optimiser::Rms,
        "sign" => Optimiser::Sign { dead_zone: a["dead_zone"] == true },
        _ => Optimiser::Plain,
    }
}

fn experiment(s: &Value) -> Experiment {
    let layers = s["layers"].as_array().unwrap();
    let taps = int(&s["taps"]) as usize;
    let shift = (taps > 1).then(|| int(&s["tap_shift"]) as u32);
    let last = layers.len() - 1;
    let rule = rule(s);
    let back = rule == Rule::Bp;
    let network = NetworkSpec {
        layers: layers.iter().enumerate().map(|(l, a)| layer(l, l == last, rule, a)).collect(),
        rule,
        mode: mode(s),
        error: match text(&s["error"]) {
            "softmax" => OutputError::Softmax { temperature: positive(&s["temperature"]) },
            _ => OutputError::OneVsAll,
        },
        centre: centre(s),
        route: (!back).then_some(Route::Modulo { taps, shift }),
        batch: Batch::new(int(&s["batch"])).unwrap(),
        mantissas: layers.iter().map(|a| RateMantissa::new(int(&a["mantissa"])).unwrap()).collect(),
        rates: layers.iter().map(|a| positive(&a["rate"])).collect(),
        decay: match text(&s["decay"]) {
            "cosine" => Decay::Cosine,
            "linear" => Decay::Linear,
            _ => Decay::Constant,
        },
        optimisers: layers.iter().map(optimiser).collect(),
        centred: layers.iter().map(|a| a["centred"] == true).collect(),
        control: Control::None,
        refresh: None,
    };
    Experiment {
        seed: text(&s["seed_decimal"]).parse().unwrap(),
        hardware: hardware(s).with(|h| h.tile.transposed_read = back).unwrap(),
        network,
        epochs: int(&s["epochs"]) as u32,
        coding: coding(s),
        augment: None,
    }
}

/// In all that the oracle wrote, state of homeostasis and optimisers and what was counted among it.
fn all_differences(trainer: &mut Trainer, want: &Value) -> Vec<String> {
    let mut failures = differences(trainer, want);
    if want["ash"].is_array() {
        failures.extend(differences_of_shifts(trainer, &want["ash"]));
    }
    let mut numbers = Numbers::default();
    trainer.visit(&mut numbers).unwrap();
    for (tag, what) in
        [(2, "scales"), (5, "thresholds"), (6, "shifts and variances"), (7, "row means")]
    {
        let want = &want["sections"][tag.to_string()];
        if want[0].is_null() && tag == 7 {
            continue; // none before the first batch
        }
        let want: Vec<i64> = want.as_array().unwrap().iter().flat_map(ints).collect();
        let got = numbers.0.remove(&tag).unwrap_or_default();
        if got != want {
            let at = got.iter().zip(&want).position(|(got, want)| got != want);
            failures.push(format!("{what} differ, first at {at:?}: {got:?} != {want:?}"));
        }
    }
    let ledger = trainer.driver().engine().ledger(Phase::Training);
    let mut counts = BTreeMap::<&str, u64>::new();
    for (_, _, _, event, count) in ledger.entries() {
        *counts.entry(event.name()).or_default() += count;
    }
    for (event, want) in want["events_training"].as_object().unwrap() {
        let got = counts.get(event.as_str()).copied().unwrap_or_default();
        if Some(got) != want.as_u64() {
            failures.push(format!("{event}: {got} != {want}"));
        }
    }
    failures
}

/// What differs first: at the start, behind the calibration, or behind an epoch.
fn run(case: &Value, backend: Backend) -> Vec<String> {
    let s = &case["settings"];
    let data = images(s);
    let experiment = experiment(s);
    let seeded = match experiment.build(backend, &data) {
        Ok(seeded) => seeded,
        Err(refused) => return vec![refused.to_string()],
    };
    let mut trainer = Trainer::new(experiment, seeded);
    let mut failures = Vec::new();
    for (l, layer) in trainer.driver().engine().layers().iter().enumerate() {
        let (shift, spec) = (i64::from(trainer.driver().shift(l)), &s["layers"][l]);
        let k = int(&s["k"][l]);
        // of `rms` the word in the place of k is 2^14 - c
        let want = if text(&spec["optimiser"]) == "rms" { (1 << 14) - k } else { k };
        if shift != want {
            failures.push(format!("k of layer {l}: {shift} != {want}"));
        }
        // a ramp has no step before it has read, an accumulator has none
        let stepped = !matches!(layer.spec.activation, Activation::Ramp | Activation::Accumulator);
        if stepped && i64::from(layer.lut.shift) != int(&s["lsh"][l]) {
            failures.push(format!("lsh of layer {l}: {} != {}", layer.lut.shift, s["lsh"][l]));
        }
    }
    trainer.calibrate(&data);
    failures.extend(all_differences(&mut trainer, &case["after_calibration"]));
    for (epoch, want) in case["after_epoch"].as_array().unwrap().iter().enumerate() {
        if !failures.is_empty() {
            failures.insert(0, format!("before epoch {epoch}"));
            return failures;
        }
        trainer.learn(&data, &mut |_| true).unwrap();
        failures = all_differences(&mut trainer, want);
        let answers = trainer.evaluate(&data).predictions;
        if !answers.iter().map(|&p| i64::from(p)).eq(ints(&want["predictions"])) {
            failures.push(format!("predictions {answers:?} != {}", want["predictions"]));
        }
    }
    failures
}

#[test]
fn convolutions_equal_the_oracle_on_every_back_end() {
    let golden: Value =
        serde_json::from_str(include_str!("../../golden/golden_conv.json")).unwrap();
    let cases = golden["cases"].as_array().unwrap();
    assert!(cases.len() >= 23);
    let mut failures = Vec::new();
    for backend in Backend::available() {
        for case in cases {
            let found = run(case, backend);
            if !found.is_empty() {
                failures.push(format!("{}, {backend:?}: {}", case["name"], found.join("\n  ")));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
