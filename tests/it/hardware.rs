//! Hardware models: all of them work, cost something, and light computes what current does.

use std::path::Path;

use dalean::lab::config::{Per, model_names};
use serde_json::Value;

use super::program::{SMALL, dalean, run, trained};

fn lines(stdout: &str) -> Vec<Value> {
    stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|n| n.as_f64().unwrap()).collect()
}

fn same(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-9 * a.abs().max(b.abs())
}

#[test]
fn every_model_passes_its_check_and_trains_the_digits() {
    let out = tempfile::tempdir().unwrap();
    for name in model_names() {
        let ran = run(dalean().args(["hw", "check", name]));
        assert_eq!(ran.code, Some(0), "{ran:?}");
        for command in ["show", "peak"] {
            assert_eq!(run(dalean().args(["hw", command, name])).code, Some(0), "{name}");
        }
        let (_, done) = trained(out.path(), &["--hw", name, "--set", "learning.epochs=1"]);
        assert!(done["test_accuracy"].as_f64().unwrap() > 0.2, "{name}: {done}");
        assert!(done["cycles"].as_u64().unwrap() > 0, "{name}");
        let joules = numbers(&done["joules"]);
        assert!(0.0 < joules[0] && joules[0] <= joules[1] && joules[1] <= joules[2], "{name}");
    }
}

#[test]
fn every_file_beside_the_built_in_models_passes_its_check() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("hw_models/own");
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<_> = files.collect();
    files.sort();
    assert!(files.len() >= 11, "{files:?}");
    for file in files {
        let ran = run(dalean().args(["hw", "check"]).arg(&file));
        assert_eq!(ran.code, Some(0), "{ran:?}");
    }
}

#[test]
fn the_example_of_the_documents_is_valid_and_every_quantity_is_described() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("hw_models");
    let text = std::fs::read_to_string(folder.join("README.md")).unwrap();
    let example = text.split("```toml\n").nth(1).unwrap().split("```").next().unwrap();
    let out = tempfile::tempdir().unwrap();
    let model = out.path().join("mine.toml");
    std::fs::write(&model, example).unwrap();
    let ran = run(dalean().args(["hw", "check"]).arg(&model));
    assert_eq!(ran.code, Some(0), "{ran:?}");
    for quantity in dalean::lab::config::QUANTITIES {
        assert!(text.contains(&format!("`{}`", quantity.name)), "{}", quantity.name);
        // an event's line ends in the settings that its number belongs to
        let line = text.lines().find(|line| line.starts_with(&format!("| `{}` |", quantity.name)));
        if let (Some(line), Per::Event(_)) = (line, quantity.per) {
            let settings: Vec<_> =
                quantity.belongs.iter().map(|setting| format!("`{}`", setting.name())).collect();
            let column = line.trim_end_matches('|').rsplit('|').next().unwrap().trim();
            assert_eq!(column, settings.join(", "), "{}", quantity.name);
        }
    }
    for name in model_names() {
        assert!(text.contains(&format!("| `{name}` |")), "{name}");
    }
}

#[test]
fn a_number_off_by_a_thousand_is_refused_by_check_and_warned_of_by_train() {
    let out = tempfile::tempdir().unwrap();
    let model = out.path().join("slip.toml");
    let text = "name = \"slip\"\n[energy]\ndac_slice_pj = { low = 499, typical = 499.2, high = 500, source = \"8 bits, \
                MNSIM's table\", kind = \"measured\" }\n";
    std::fs::write(&model, text).unwrap();
    let ran = run(dalean().args(["hw", "check"]).arg(&model));
    assert_eq!(ran.code, Some(1), "{ran:?}");
    assert!(ran.stderr.contains("energy.dac_slice_pj") && ran.stderr.contains("is the unit right"));
    let model = model.display().to_string();
    let ran = run(super::program::train(out.path()).args(["--hw", &model]));
    assert!(ran.stdout.contains("is the unit right"), "{ran:?}");
}

#[test]
fn a_finished_run_is_priced_again_with_its_own_and_with_another_chip() {
    let out = tempfile::tempdir().unwrap();
    let (folder, done) = trained(out.path(), &["--hw", "pcm14"]);
    let price = |more: &[&str]| {
        let ran = run(dalean().arg("price").arg(&folder).arg("--json").args(more));
        assert_eq!(ran.code, Some(0), "{ran:?}");
        ran.last()
    };
    let own = price(&[]);
    assert_eq!(own["cycles"], done["cycles"]);
    assert!(same(own["seconds"].as_f64().unwrap(), done["simulated_seconds"].as_f64().unwrap()));
    let total = numbers(&own["joules"]);
    assert_eq!(total, numbers(&done["joules"]));
    for groups in ["by_component", "by_layer", "by_pathway", "by_operation", "by_phase"] {
        let sums = own[groups].as_array().unwrap().iter().map(|group| numbers(&group["joules"])[1]);
        assert!(same(sums.sum(), total[1]), "{groups}");
    }
    assert_eq!(own["changes"], Value::Array(vec![]));

    // the same chip with another clock: nothing happens otherwise, and it takes half the time
    let text =
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("hw_models/pcm14.toml"));
    let fast = out.path().join("fast.toml");
    let text = text.unwrap().replace("clock_mhz = 1000.0", "clock_mhz = 2000.0");
    std::fs::write(&fast, text).unwrap();
    let again = price(&["--hw", &fast.display().to_string()]);
    assert_eq!(again["changes"], Value::Array(vec![]));
    assert!(same(2.0 * again["seconds"].as_f64().unwrap(), own["seconds"].as_f64().unwrap()));

    // another chip reads in slices: what it would have done otherwise is named and left out
    let other = price(&["--hw", "reram"]);
    let missing = other["not_priced"].as_array().unwrap();
    let why = |what: &str| {
        let found = missing.iter().find(|one| one["what"] == what);
        found.unwrap_or_else(|| panic!("{what} in {missing:?}"))["why"].as_str().unwrap()
    };
    assert!(why("conversions").contains("drive.dac_bits") && why("time").contains("tile.rows"));
    assert!(why("pulses_attempted").contains("cell.level_bits"));
    assert!(other["seconds"].is_null() && other["joules"].is_null());
    assert!(numbers(&other["joules_at_least"])[1] > 0.0);
    assert!(other["by_component"].as_array().unwrap().iter().any(|one| one["name"] == "multiply"));
}

#[test]
fn a_profile_adds_up() {
    let ran = run(dalean().args(["profile", SMALL, "--hw", "isaac", "--json"]));
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let acts: Vec<_> =
        lines(&ran.stdout).into_iter().filter(|one| one["event"] == "profile").collect();
    let names: Vec<_> = acts.iter().map(|act| act["act"].as_str().unwrap()).collect();
    assert_eq!(names, ["training step", "inference"]);
    for act in &acts {
        let stages = act["stages"].as_array().unwrap();
        let sum: u64 = stages.iter().map(|stage| stage["cycles"].as_u64().unwrap()).sum();
        assert_eq!(act["cycles"]["elapsed"], sum);
        for stage in stages {
            let used = stage["critical"]["used"].as_u64().unwrap_or(0);
            assert!(used <= stage["cycles"].as_u64().unwrap(), "{stage}");
        }
        assert!(act["operations_per_second"].as_f64().unwrap() > 0.0);
    }
    // 64 x 24 cells in four arrays, 24 x 10 in two, a pair of cells a weight; a training step reads and accumulates a
    // batch of 16
    let macs = f64::from((4 * 64 * 24 + 2 * 24 * 10) / 2);
    assert_eq!(acts[1]["macs_read"], macs);
    assert_eq!(acts[1]["macs_accumulated"], 0.0);
    assert_eq!(acts[0]["macs_read"], 16.0 * macs);
    assert_eq!(acts[0]["macs_accumulated"], 16.0 * macs);
    // and for people
    let ran = run(dalean().args(["profile", SMALL, "--set", "hw.timing.lanes=1"]));
    assert_eq!(ran.code, Some(0), "{ran:?}");
    for word in ["TRAINING STEP", "TOPS/W", "leans on assumed constants", "lanes"] {
        assert!(ran.stdout.contains(word), "{word} in {}", ran.stdout);
    }
}

/// With the same widths and ideal converters nothing is left of the substrate but its time and its price.
#[test]
fn an_electronic_and_a_photonic_chip_learn_the_same_integers() {
    let out = tempfile::tempdir().unwrap();
    let alike = [
        "hw.cell.level_bits=8",
        "hw.cell.ceiling=255",
        "hw.adc=ideal",
        "hw.write.increment_max=7",
        "hw.drive.dac_bits=8",
    ];
    let mut hashes = Vec::new();
    let mut times = Vec::new();
    for model in ["reram", "mrr", "photonic_pcm"] {
        let mut all = vec!["--hw", model];
        for setting in alike {
            all.extend(["--set", setting]);
        }
        let (folder, done) = trained(out.path(), &all);
        let text = std::fs::read_to_string(folder.join("receipt.json")).unwrap();
        let receipt: Value = serde_json::from_str(&text).unwrap();
        hashes.push((done["state_hash"].clone(), receipt["test"].clone()));
        times.push(done["simulated_seconds"].clone());
    }
    assert!(hashes.windows(2).all(|two| two[0] == two[1]), "{hashes:?}");
    assert!(times[0] != times[1]);
}

/// 4, 6, 8 and 12 bits cost the same once: now a conversion takes the steps of its kind, and its energy and area follow the
/// law that the model states, or have no price and the total says so.
#[test]
fn bits_of_a_converter_cost_cycles_energy_and_area() {
    let act = |settings: &[&str]| {
        let mut command = dalean();
        command.args(["profile", SMALL, "--json"]);
        settings.iter().for_each(|setting| _ = command.args(["--set", setting]));
        let ran = run(&mut command);
        assert_eq!(ran.code, Some(0), "{ran:?}");
        lines(&ran.stdout).into_iter().find(|act| act["act"] == "inference").unwrap()
    };
    let conversion = |act: &Value| {
        let groups = act["by_component"].as_array().unwrap().clone();
        let found = groups.into_iter().find(|group| group["name"] == "conversion");
        found.map(|group| numbers(&group["joules"])[1])
    };
    let cycles = |act: &Value| act["cycles"]["elapsed"].as_u64().unwrap();
    let of = |bits: u32| act(&["hw.model=reram", &format!("hw.adc.bits={bits}")]);
    let acts: Vec<_> = [4, 6, 8, 12].map(of).to_vec();
    for (two, times) in acts.windows(2).zip([4.0, 4.0, 16.0]) {
        let [a, b] = [&two[0], &two[1]].map(|act| conversion(act).unwrap());
        assert!(same(b, times * a), "{a} {b}");
        assert!(cycles(&two[0]) < cycles(&two[1]));
        assert!(!two[1]["joules"].is_null(), "every part has a price");
    }
    // a flash converter takes a step whatever its bits, and a SAR's energy says nothing of it
    let flash = act(&["hw.model=reram", "hw.adc.converter=flash"]);
    assert!(cycles(&flash) < cycles(&acts[1]));
    assert!(flash["joules"].is_null() && conversion(&flash).is_none());
    assert_eq!(flash["parts_priced"].as_u64().unwrap() + 1, flash["parts"].as_u64().unwrap());
    assert!(flash["operations_per_joule"].is_null(), "no efficiency of a partial sum");
    let why = flash["not_priced"][0]["why"].as_str().unwrap();
    assert!(why.contains("converter sar") && why.contains("flash"), "{why}");
}

/// One command prints what the model predicts for every pair of input and output bits.
#[test]
fn the_modes_of_a_chip_are_printed_by_one_command() {
    let command = ["hw", "peak", "neurram", "--modes", "--adc-bits", "3..10"];
    let ran = run(dalean().args(command));
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let line = |name: &str| -> Vec<f64> {
        let line = ran.stdout.lines().find(|line| line.trim().starts_with(name)).unwrap();
        line.split_whitespace().skip(2).map(|number| number.parse().unwrap()).collect()
    };
    for (inputs, outputs, tops) in [(1, 3, 2.1113), (4, 6, 0.7845), (8, 10, 0.2769)] {
        let found = line(&format!("{inputs}-bit"))[outputs - 3];
        assert!((found - tops).abs() < 1e-3, "({inputs}, {outputs}): {found}");
    }
    let ran = run(dalean().args(command).arg("--json"));
    assert_eq!(lines(&ran.stdout).len(), 64);
    let ran = run(dalean().args(["hw", "peak", "reram", "--modes"]));
    assert_eq!((ran.code, ran.stderr.contains("lists no [modes]")), (Some(2), true), "{ran:?}");
}
