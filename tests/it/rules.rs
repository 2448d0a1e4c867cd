//! The rules learn what they should, on data that is built in.

use super::program::{finished, run, train, train_plain, trained};

#[test]
fn every_rule_mode_and_chip_learns_the_built_in_digits() {
    let out = tempfile::tempdir().unwrap();
    for (settings, least) in [
        (&["learning.rule=ed"][..], 0.85),
        (&["learning.rule=dfa"], 0.85),
        (&["learning.rule=bp"], 0.85),
        (&["learning.mode=replay", "learning.rate=2"], 0.7),
        (&["learning.mode=online", "learning.centre=running", "learning.rate=2"], 0.7),
        (&["learning.route=random_sparse"], 0.7),
        (&["learning.route=random_dense"], 0.7),
        (&["hw.write.dither_bits=16"], 0.85),
        (&["hw.write.dither=separable"], 0.8),
        (&["hw.write.residual_bits=8", "hw.cell.level_bits=4"], 0.8),
        (&["hw.cell.floor_kind=absorbing"], 0.8),
        (&["hw.cell.level_bits=12"], 0.85),
        (&["hw.adc.bits=8", "hw.tile.rows=32"], 0.85),
        (&["hw.adc.bits=4"], 0.85),
        (&["hw.adc.bits=8", "hw.adc.subtract=current"], 0.85),
        (&["hw.adc.bits=6", "hw.adc.range=calibrated"], 0.85),
        (&["hw.adc.bits=8", "hw.adc.range=calibrated", "hw.adc.recalibrate=epoch"], 0.85),
        (&["network.bias=rows"], 0.85),
    ] {
        let mut command = train_plain(out.path());
        command.args(["--set", "learning.epochs=4"]);
        for setting in settings {
            command.args(["--set", setting]);
        }
        let (_, done) = finished(&mut command);
        let accuracy = done["test_accuracy"].as_f64().unwrap();
        assert!(accuracy >= least, "{settings:?}: {accuracy}");
    }
}

#[test]
fn kaneko_learns_xor_and_parity_by_potentiation_alone() {
    let out = tempfile::tempdir().unwrap();
    for set in ["xor", "parity3", "parity4"] {
        let file = format!("{}/examples/kaneko_{set}.toml", env!("CARGO_MANIFEST_DIR"));
        let mut command = super::program::dalean();
        command.arg("train").arg(&file).arg("--json").arg("--out").arg(out.path());
        let ran = run(&mut command);
        assert_eq!(ran.code, Some(0), "{ran:?}");
        assert_eq!(ran.last()["test_accuracy"], 1.0, "{set}");
        let run_folder = ran.last()["run"].as_str().unwrap().to_owned();
        let text = std::fs::read_to_string(format!("{run_folder}/metrics.jsonl")).unwrap();
        let last: serde_json::Value = serde_json::from_str(text.lines().last().unwrap()).unwrap();
        for pathway in last["pathways"].as_array().unwrap() {
            assert_eq!(pathway["deaths"], 0, "potentiation alone reaches no floor: {pathway}");
        }
    }
}

#[test]
fn seeds_differ_and_repeat() {
    let out = tempfile::tempdir().unwrap();
    let hash = |seed: &str| trained(out.path(), &["--seed", seed]).1["state_hash"].clone();
    assert_eq!(hash("7"), hash("7"));
    assert_ne!(hash("7"), hash("8"));
    let ran = run(train(out.path()).args(["--seed", "9223372036854775808"]));
    assert_eq!(ran.code, Some(2), "{ran:?}");
}
