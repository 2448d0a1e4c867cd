//! Runs on chips with flaws, and finished runs on other chips and after a time.

use std::path::Path;

use serde_json::Value;

use super::program::{dalean, run, trained};

const FLAWS: [&str; 8] = [
    "--set",
    "hw.device.faults.stuck_any=0.05",
    "--set",
    "hw.device.read_noise.sigma_cells=0.5",
    "--set",
    "hw.device.programming.sigma=[0.02, 0.05]",
    "--hw",
    "reram",
];

fn eval(folder: &Path, more: &[&str]) -> Vec<Value> {
    let ran = run(dalean().arg("eval").arg(folder).arg("--json").args(more));
    assert_eq!(ran.code, Some(0), "{ran:?}");
    ran.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

fn score(line: &Value) -> f64 {
    line["test_accuracy"].as_f64().unwrap()
}

/// Fails when a draw depends on the order of calls, when counters are no state, or when a kernel passes a flaw over.
#[test]
fn a_run_on_a_chip_with_flaws_is_the_same_however_it_is_carried_out() {
    let out = tempfile::tempdir().unwrap();
    let hash = |more: &[&str]| {
        let (folder, done) = trained(out.path(), &[&FLAWS, more].concat());
        (folder, done["state_hash"].as_str().unwrap().to_owned())
    };
    let (folder, first) = hash(&[]);
    for variant in [["--threads", "1"], ["--threads", "3"], ["--kernel", "scalar"]] {
        assert_eq!(hash(&variant).1, first, "{variant:?}");
    }
    let ran = run(dalean().arg("verify").arg(&folder));
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let ran = run(dalean().arg("eval").arg(&folder));
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let config = std::fs::read_to_string(folder.join("config.toml")).unwrap();
    assert!(config.contains("stuck_any = 0.05"), "{config}");
    let receipt = std::fs::read_to_string(folder.join("receipt.json")).unwrap();
    assert!(receipt.contains("\"note\": \"stuck\"") || receipt.contains("\"note\":\"stuck\""));
    let (_, other) = trained(out.path(), &["--hw", "reram"]);
    assert_ne!(other["state_hash"], first.as_str());
}

/// Fails when what was read before a chip moves what it gives, or when the number is not the seed.
#[test]
fn a_chip_is_found_again_by_its_number() {
    let out = tempfile::tempdir().unwrap();
    let (folder, done) = trained(out.path(), &[]);
    let flaws =
        ["--set", "hw.device.faults.stuck_any=0.1", "--set", "hw.device.read_noise.sigma_cells=2"];
    let lines = eval(&folder, &[&flaws[..], &["--samples", "4"]].concat());
    assert_eq!(lines.len(), 5);
    let (chips, result) = (&lines[..4], &lines[4]["results"][0]);
    let worst = result["worst_chip"].as_u64().unwrap();
    let again = eval(&folder, &[&flaws[..], &["--chip", &worst.to_string()]].concat());
    assert_eq!(score(&again[0]), score(&chips[worst as usize - 1]));
    let least = chips.iter().map(score).fold(1.0, f64::min);
    assert_eq!(result["least"].as_f64(), Some(least));
    assert!(chips.iter().any(|chip| score(chip) != score(&chips[0])), "chips differ: {lines:?}");
    // the chip that learnt, whatever it is called
    let own = eval(&folder, &["--chip", "0"]);
    assert_eq!(own[0]["test_accuracy"], done["test_accuracy"]);
}

#[test]
fn levels_fall_with_time_and_a_factor_makes_up_for_it() {
    let out = tempfile::tempdir().unwrap();
    let (folder, done) = trained(out.path(), &[]);
    let model = concat!(env!("CARGO_MANIFEST_DIR"), "/hw_models/own/pcm_drift.toml");
    let at = |more: &[&str]| -> Vec<f64> {
        let lines = eval(&folder, &[&["--hw", model], more].concat());
        lines[..lines.len() - 1].iter().map(score).collect()
    };
    let plain = at(&["--after", "20s,1y"]);
    assert_eq!(Some(plain[0]), done["test_accuracy"].as_f64(), "nothing has moved at the start");
    let made_up = at(&["--after", "20s,1y", "--compensate"]);
    assert_eq!(made_up[0], plain[0]);
    assert!(made_up[1] >= plain[1], "{made_up:?} {plain:?}");
    let loaded = at(&["--samples", "2", "--after", "1d"]);
    assert_eq!(loaded.len(), 2);
}

#[test]
fn what_has_no_effect_is_refused() {
    let out = tempfile::tempdir().unwrap();
    let (folder, _) = trained(out.path(), &[]);
    for (more, wanted) in [
        (&["--samples", "2"][..], "chips of this kind are all alike"),
        (&["--after", "1d"], "`hw.device.drift` is missing"),
        (&["--after", "soon"], "write 25s, 10min, 1h, 1d or 1y"),
        (&["--compensate"], "say with --after when chips are read"),
        (&["--set", "hw.adc.bits=4"], "eval changes what cells and reads do"),
        (&["--hw", "reram"], "names reram, which has none"),
        (&["--hw", "epiram"], "whose [device] has response alone"),
        (&["--set", "hw.device.response.states=9"], "eval gives no pulses"),
        (&["--set", "hw.device.spread.step=0.1"], "eval gives no pulses"),
        (
            &["--set", "hw.device.faults.cells=[\"0,pp,64,0,floor\"]"],
            "names layer 0, row 64, column 0; that layer has 64 rows",
        ),
        (
            &["--set", "hw.device.faults.cells=[\"7,pp,0,0,floor\"]"],
            "numbered from 0 at the input: 0, 1",
        ),
        (
            &[
                "--after",
                "1s",
                "--set",
                "hw.device.drift.start_s=20",
                "--set",
                "hw.device.drift.change=-0.1",
            ],
            "levels are of 20 s after programming",
        ),
    ] {
        let ran = run(dalean().arg("eval").arg(&folder).args(more));
        assert_eq!(ran.code, Some(2), "{more:?}: {ran:?}");
        assert!(ran.stderr.contains(wanted), "{more:?}: {}", ran.stderr);
    }
    let settings = ["task=policy", "learning.rule=es", "hw.device.programming.sigma=[0.1]"];
    let sets = settings.iter().flat_map(|setting| ["--set", setting]);
    let ran = run(dalean().arg("train").args(sets));
    assert!(ran.stderr.contains("evolution strategies load every candidate anew"), "{ran:?}");
}

/// A list of stuck cells is read beside the file that names it and kept in the run; every chip has it.
#[test]
fn a_list_of_stuck_cells_goes_with_its_run() {
    let out = tempfile::tempdir().unwrap();
    let list = (0..64).map(|row| format!("1, pp, {}, {}, ceiling\n", row % 24, row % 10));
    let mut lines: Vec<String> = list.collect();
    lines.sort();
    lines.dedup();
    let list = format!("layer,pathway,row,column,state\n# looked at\n{}", lines.concat());
    let folder = out.path().join("files");
    std::fs::create_dir(&folder).unwrap();
    std::fs::write(folder.join("faults.csv"), &list).unwrap();
    let plain = std::fs::read_to_string(super::program::SMALL).unwrap();
    let text = format!("{plain}\n[hw.device.faults]\nmap = \"faults.csv\"\n");
    let file = folder.join("mine.toml");
    std::fs::write(&file, &text).unwrap();
    let train = || {
        let mut command = dalean();
        command.arg("train").arg(&file).args(["--json", "--out"]).arg(out.path());
        super::program::finished(&mut command)
    };
    let (path, done) = train();
    let config = std::fs::read_to_string(path.join("config.toml")).unwrap();
    assert!(config.contains("1,pp,0,0,ceiling") && !config.contains("faults.csv"), "{config}");
    // the file is not needed again
    std::fs::remove_file(folder.join("faults.csv")).unwrap();
    let ran = run(dalean().arg("verify").arg(&path));
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let chips = eval(&path, &["--samples", "2", "--set", "hw.device.faults.stuck_any=0.05"]);
    assert_eq!(chips.len(), 3);
    let own = eval(&path, &["--chip", "0"]);
    assert_eq!(own[0]["test_accuracy"], done["test_accuracy"]);
    let (_, without) = trained(out.path(), &[]);
    assert_ne!(done["state_hash"], without["state_hash"]);
    // mistakes name the line
    std::fs::write(folder.join("faults.csv"), list.replace("# looked at", "1,pp,x,0,floor"))
        .unwrap();
    let ran = run(dalean().arg("train").arg(&file));
    assert_eq!(ran.code, Some(2), "{ran:?}");
    assert!(ran.stderr.contains("faults.csv, line 2 has row \"x\""), "{}", ran.stderr);
}

/// Windows of cells are those of the chip that is read, and what eval does not look at is said.
#[test]
fn other_chips_have_windows_of_their_own() {
    let out = tempfile::tempdir().unwrap();
    let window = ["--set", "hw.cell.ceiling=200", "--set", "hw.cell.floor=20"];
    let spread = ["--set", "hw.device.spread.ceiling=0.3", "--set", "hw.device.spread.floor=0.1"];
    let (folder, done) = trained(out.path(), &[&window[..], &spread].concat());
    let lines = eval(&folder, &["--samples", "3"]);
    let scores: Vec<_> = lines[..3].iter().map(score).collect();
    assert!(scores.iter().any(|score| *score != scores[0]), "{scores:?}");
    let own = eval(&folder, &["--chip", "0"]);
    assert_eq!(own[0]["test_accuracy"], done["test_accuracy"]);
    let again = eval(&folder, &["--chip", "2"]);
    assert_eq!(score(&again[0]), scores[1]);
    let lines = eval(&folder, &["--hw", "aihwkit_reram_array_om", "--samples", "1"]);
    assert_eq!(lines[0]["event"], "note");
    assert!(lines[0]["text"].as_str().unwrap().starts_with("[device.response] of"), "{lines:?}");
}

/// Fails when currents of cells that conduct at level 0, or behind wires, hang on a back end or on threads; or when a reference column does
/// not take everything off.
#[test]
fn currents_are_the_same_however_a_run_is_carried_out() {
    let out = tempfile::tempdir().unwrap();
    let off = ["--set", "hw.device.conductance.on_off=5"];
    let column = ["--set", "hw.device.conductance.reference=column"];
    let wires =
        ["--set", "hw.device.wires.segment_ohm=5", "--set", "hw.device.wires.cell_on_ohm=1e5"];
    let hash = |more: &[&[&str]]| {
        let (folder, done) = trained(out.path(), &more.concat());
        (folder, done["state_hash"].as_str().unwrap().to_owned(), done["test_accuracy"].clone())
    };
    let (folder, both, _) = hash(&[&off, &wires]);
    for variant in [["--threads", "3"], ["--kernel", "scalar"]] {
        assert_eq!(hash(&[&off, &wires, &variant]).1, both, "{variant:?}");
    }
    let ran = run(dalean().arg("verify").arg(&folder));
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let (_, kept, _) = hash(&[&off]);
    let (_, taken, accuracy) = hash(&[&off, &column]);
    let (_, plain, same) = hash(&[]);
    assert!(kept != plain && kept != both && taken != plain, "cells of the reference are counted");
    assert_eq!(accuracy, same, "what level 0 conducts is taken off");
}
