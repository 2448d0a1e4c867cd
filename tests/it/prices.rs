//! What a number of joules, seconds or operations means: split, per image, whole or at least, by one convention.

use std::path::PathBuf;

use dalean::lab::config::{CostTable, EFFECTS, Per, Sources, load, model_names};
use dalean::lab::data::DataRoot;
use dalean::lab::price::{Convention, EnergyTotal, peak};
use dalean::lab::run::{Act, Profile, profile};
use dalean::{Backend, Machine};
use serde_json::Value;

use super::program::{SMALL, dalean, run, trained};

fn same(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-9 * a.abs().max(b.abs())
}

fn numbers(value: &Value) -> Vec<f64> {
    let list = value.as_array().unwrap_or_else(|| panic!("no list: {value}"));
    list.iter().map(|n| n.as_f64().unwrap()).collect()
}

fn lines(stdout: &str) -> Vec<Value> {
    stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

fn of_event<'a>(all: &'a [Value], event: &str) -> Vec<&'a Value> {
    all.iter().filter(|one| one["event"] == event).collect()
}

/// A small experiment on a model.
fn profiled(model: &str, settings: &[&str]) -> Profile {
    let text = std::fs::read_to_string(SMALL).unwrap();
    let settings: Vec<String> = settings.iter().map(ToString::to_string).collect();
    let sources = Sources {
        experiment: Some(("small", &text)),
        hardware: Some(model),
        settings: &settings,
        ..Sources::default()
    };
    let machine = Machine::new(Backend::Scalar, 1).unwrap();
    profile(&load(&sources).unwrap(), &DataRoot::new("no such folder"), machine).unwrap()
}

/// The split, reckoned once more from the integers of a ledger and the constants.
fn by_hand(profile: &Profile, act: &Act) -> [(&'static str, [f64; 3]); 4] {
    let mut sums = ["device", "converter", "digital", "static"].map(|name| (name, [0.0; 3]));
    for constant in profile.constants.iter().filter(|c| c.quantity.table != CostTable::Area) {
        let class = match constant.quantity.name {
            "cell_read" | "cell_load" | "cell_pulse" | "row_pulse" | "laser" | "heater" => 0,
            "dac_slice" | "hold" | "conversion" | "verify_read" | "receiver" => 1,
            "shift_add"
            | "look_up"
            | "multiply"
            | "bus_word"
            | "accumulate"
            | "delta"
            | "sram_bit"
            | "square"
            | "root"
            | "scaling"
            | "row_mean"
            | "sum_square"
            | "optimiser_step"
            | "pooling"
            | "threshold_subtraction"
            | "statistic_add"
            | "softmax_look_up" => 2,
            "static" | "tile_static" => 3,
            other => panic!("no class of {other}"),
        };
        let times = match constant.quantity.per {
            Per::Event(event) => act.ledger.total(event) as f64,
            part => {
                let hertz = profile.hardware.timing.unwrap().clock_khz as f64 * 1000.0;
                let seconds = act.cycles().unwrap().elapsed as f64 / hertz;
                profile.plan.parts(part, &profile.hardware) as f64 * seconds
            }
        };
        for (sum, value) in sums[class].1.iter_mut().zip(constant.value) {
            *sum += value * times;
        }
    }
    sums
}

#[test]
fn every_split_is_its_total_and_an_image_its_part_on_every_chip() {
    for model in model_names() {
        let profile = profiled(model, &[]);
        let modes = profile.modes.iter().filter_map(|mode| mode.act.as_ref().ok());
        for act in profile.acts.iter().chain(modes) {
            let bill = profile.bill(act);
            let total = bill.total();
            assert_eq!(total.whole(), Some(total.joules), "{model}: {:?}", bill.missing);
            let split = bill.split(None);
            for (name, joules) in by_hand(&profile, act) {
                let found = split.iter().find(|split| split.class.name() == name);
                let found = found.map_or([0.0; 3], |split| split.total.joules);
                for (found, wanted) in found.into_iter().zip(joules) {
                    assert!(same(found, wanted), "{model}, {name}: {found} {wanted}");
                }
            }
            for bound in 0..3 {
                let sum: f64 = split.iter().map(|split| split.total.joules[bound]).sum();
                assert!(same(sum, total.joules[bound]), "{model}: {sum} {total:?}");
            }
            let each = bill.per_piece(&act.pieces());
            assert_eq!(each.len(), 1);
            let samples = act.samples as f64;
            assert!(same(each[0].total.joules[1] * samples, total.joules[1]), "{model}");
            let seconds = bill.seconds_total().unwrap();
            assert!(same(each[0].seconds.unwrap() * samples, seconds), "{model}");
            let sum: f64 = each[0].split.iter().map(|split| split.total.joules[1]).sum();
            assert!(same(sum, each[0].total.joules[1]), "{model}");
        }
    }
}

#[test]
fn images_of_a_run_are_those_of_its_epochs() {
    let out = tempfile::tempdir().unwrap();
    let (folder, done) = trained(out.path(), &["--hw", "reram"]);
    let receipt = std::fs::read_to_string(folder.join("receipt.json")).unwrap();
    let receipt: Value = serde_json::from_str(&receipt).unwrap();
    let examples: Vec<u64> =
        numbers(&receipt["data"]["examples"]).iter().map(|&n| n as u64).collect();
    let epochs = done["epochs"].as_u64().unwrap();
    let priced = run(dalean().arg("price").arg(&folder).arg("--json")).last();
    for (phase, images) in
        [("training", epochs * examples[0]), ("evaluation", (epochs + 1) * examples[1])]
    {
        let each = priced["per_image"].as_array().unwrap();
        let one = each.iter().find(|one| one["phase"] == phase).unwrap();
        assert_eq!(one["images"], images, "{phase}");
        let all = priced["by_phase"].as_array().unwrap();
        let all = all.iter().find(|group| group["name"] == phase).unwrap();
        let (one, all) = (numbers(&one["joules"]), numbers(&all["joules"]));
        assert!(same(one[1] * images as f64, all[1]), "{phase}: {one:?} {all:?}");
    }
    let split = priced["by_class"].as_array().unwrap();
    let sum: f64 = split.iter().map(|class| numbers(&class["joules"])[1]).sum();
    assert!(same(sum, numbers(&priced["joules"])[1]));
    assert_eq!(
        (&priced["by_class"], &priced["per_image"]),
        (&done["by_class"], &done["per_image"])
    );
    // several chips stand side by side
    let two = ["--hw", "pcm14", "--hw", "reram"];
    let ran = run(dalean().arg("price").arg(&folder).args(two).arg("--json"));
    let both = lines(&ran.stdout);
    assert_eq!(both[1]["joules"], priced["joules"]);
    assert!(both[0]["joules"].is_null() && both[0]["joules_at_least"].is_array(), "{}", both[0]);
    let ran = run(dalean().arg("price").arg(&folder).args(two));
    for words in ["pcm14  ", ">= ", " parts priced", "pcm14 differs in ", "to read an image"] {
        assert!(ran.stdout.contains(words), "{words} in {}", ran.stdout);
    }
    // and the row of a sweep says the same
    let (row, _) = dalean::lab::sweep::row(&folder).unwrap();
    let cell = |name: &str| row.results[name].as_f64().unwrap();
    let parts = ["device", "converter", "digital", "static"];
    for act in ["learn", "read"] {
        let sum: f64 = parts.iter().map(|part| cell(&format!("{act}_joules_{part}"))).sum();
        assert!(same(sum, cell(&format!("{act}_joules"))), "{act}");
        assert!(cell(&format!("{act}_seconds")) > 0.0);
    }
    assert!(same(cell("parts_priced"), 1.0));
}

/// One convention: what `hw peak` counts of a read is what a profile counts of it, cell by cell.
#[test]
fn profile_and_peak_count_operations_alike() {
    let ran = run(dalean().args(["profile", SMALL, "--hw", "reram", "--json"]));
    let all = lines(&ran.stdout);
    let inference = of_event(&all, "profile")[1];
    let ran = run(dalean().args(["hw", "peak", "reram", "--tiles", "3", "--json"]));
    let peak_json = ran.last();
    assert_eq!(inference["convention"], peak_json["convention"]);
    assert_eq!(peak_json["convention"]["cells_per_weight"], 2);
    let cells = f64::from(4 * 64 * 24 + 2 * 24 * 10);
    assert!(same(inference["macs_read"].as_f64().unwrap() / cells, 0.5));
    let tile = f64::from(2 * 3 * 128 * 128);
    assert!(same(peak_json["macs"].as_f64().unwrap() / tile, 0.5));
    // rate x time = operations, in both
    let operations = |one: &Value, seconds: &Value| {
        one["operations_per_second"].as_f64().unwrap() * seconds.as_f64().unwrap()
    };
    assert!(same(operations(inference, &inference["seconds"]), cells));
    let alone = &peak_json["alone"];
    assert!(same(operations(alone, &alone["seconds"]), tile));
    // whoever counts otherwise says so, and it is printed
    let profile = profiled("isaac", &[]);
    let joined = peak(&profile.hardware, 3, 16, Convention::with_cells(8)).unwrap();
    let pairs = peak(&profile.hardware, 3, 16, Convention::PAIRS).unwrap();
    assert!(same(4.0 * joined.alone.1, pairs.alone.1));
    for command in [vec!["profile", SMALL], vec!["hw", "peak", "isaac"]] {
        let ran = run(dalean().args(command));
        assert!(ran.stdout.contains("2 operations a MAC, 2 cells a weight"), "{}", ran.stdout);
    }
}

/// `reram` without every second energy, as a file.
fn half(out: &std::path::Path) -> PathBuf {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/hw_models/reram.toml");
    let text = std::fs::read_to_string(path).unwrap();
    let mut energies = 0;
    let kept = text.lines().filter(|line| {
        let energy = ["_fj = {", "_pj = {"].iter().any(|unit| line.contains(unit));
        energies += usize::from(energy);
        !energy || energies % 2 == 0
    });
    let model = out.join("half.toml");
    std::fs::write(&model, kept.collect::<Vec<_>>().join("\n")).unwrap();
    model
}

#[test]
fn a_model_with_half_its_constants_is_at_least() {
    let out = tempfile::tempdir().unwrap();
    let model = half(out.path());
    let model = model.to_str().unwrap();
    let (folder, done) = trained(out.path(), &["--hw", model]);
    assert!(done["joules"].is_null(), "{done}");
    let (priced, parts) = (done["parts_priced"].as_u64().unwrap(), done["parts"].as_u64().unwrap());
    assert!(0 < priced && priced < parts, "{priced} of {parts}");
    let words = format!("{priced} of {parts} parts priced");
    let ran = run(dalean().arg("price").arg(&folder));
    assert!(ran.stdout.contains("energy   at least ") && ran.stdout.contains(&words), "{ran:?}");
    let page = std::fs::read_to_string(folder.join("report.html")).unwrap();
    assert!(page.contains("energy on the chip, at least") && page.contains(&words));
    // no rate follows from a bound
    let ran = run(dalean().args(["profile", SMALL, "--hw", model]));
    assert!(ran.stdout.contains("at least") && ran.stdout.contains("TOPS"), "{ran:?}");
    assert!(!ran.stdout.contains("TOPS/W"), "{}", ran.stdout);
    // what is priced is what the whole model says of it
    let whole = run(dalean().args(["price", folder.to_str().unwrap(), "--hw", "reram", "--json"]));
    let whole = numbers(&whole.last()["joules"]);
    assert!(numbers(&done["joules_at_least"])[1] < whole[1]);
    // a table of results has no such number among totals
    let (row, _) = dalean::lab::sweep::row(&folder).unwrap();
    assert!(row.results.get("joules").is_none());
    assert!(same(row.results["parts_priced"].as_f64().unwrap(), priced as f64 / parts as f64));
}

#[test]
fn nothing_priced_is_not_0_joules() {
    let out = tempfile::tempdir().unwrap();
    let model = out.path().join("bare.toml");
    let constant = "energy.verify_read_fj = { low = 1, typical = 1, high = 1, source = \"s\", kind = \"assumed\" }";
    std::fs::write(&model, format!("name = \"bare\"\n{constant}\n")).unwrap();
    let (folder, done) = trained(out.path(), &["--hw", model.to_str().unwrap()]);
    assert!(done["joules"].is_null() && done["joules_at_least"].is_null(), "{done}");
    let page = std::fs::read_to_string(folder.join("report.html")).unwrap();
    let priced = run(dalean().arg("price").arg(&folder));
    assert!(priced.stdout.contains("energy   not priced"), "{}", priced.stdout);
    assert!(!priced.stdout.contains(" 0 J") && !page.contains(">0 J"), "{}", priced.stdout);
    let none = EnergyTotal { parts: 2, ..EnergyTotal::default() };
    assert_eq!((none.whole(), &*none.words()), (None, "not priced"));
}

/// The headline of a chip is often one constant: the memory of digital sums. It is named, and what does without stands
/// beside it.
#[test]
fn the_modes_of_writing_a_batch_stand_side_by_side() {
    let ran = run(dalean().args(["profile", SMALL, "--hw", "reram", "--json"]));
    let all = lines(&ran.stdout);
    let modes = of_event(&all, "mode");
    let names: Vec<_> = modes.iter().map(|mode| mode["mode"].as_str().unwrap()).collect();
    assert_eq!(names, ["accumulate", "replay", "online"]);
    let share = |mode: &Value| mode["memory_of_sums_share"].as_f64();
    assert!(share(modes[0]).unwrap() > 0.5, "{}", modes[0]);
    assert!(share(modes[1]).is_none() && share(modes[2]).is_none());
    let digital = |mode: &Value| {
        let split = mode["by_class"].as_array().unwrap();
        numbers(&split.iter().find(|class| class["name"] == "digital").unwrap()["joules"])[1]
    };
    assert!(digital(modes[1]) < digital(modes[0]) && digital(modes[2]) < digital(modes[0]));
    // the same samples are read in each
    assert!(modes.iter().all(|mode| mode["macs_read"] == modes[0]["macs_read"]));
    assert_eq!((&modes[0]["own"], &modes[0]["also"]), (&true.into(), &Value::Null));
    assert_eq!(modes[2]["also"], "learning.centre=running");
    let first = of_event(&all, "profile")[0];
    assert_eq!((&first["joules"], &first["cycles"]), (&modes[0]["joules"], &modes[0]["cycles"]));
    // a mode that a chip cannot have says why
    let trains = ["--set", "hw.write.scheme=rank1", "--set", "learning.mode=replay"];
    let ran = run(dalean().args(["profile", SMALL, "--json"]).args(trains));
    let all = lines(&ran.stdout);
    let modes = of_event(&all, "mode");
    assert!(modes[0]["refused"].as_str().unwrap().contains("rank1"), "{}", modes[0]);
    assert_eq!(modes[1]["own"], true);
    let ran = run(dalean().args(["profile", SMALL, "--hw", "reram"]));
    for words in ["memory of the digital sums", "EVERY learning.mode", "online", "this experiment"]
    {
        assert!(ran.stdout.contains(words), "{words} in {}", ran.stdout);
    }
}

#[test]
fn what_is_not_simulated_is_said_by_the_program_whatever_a_model_says() {
    let out = tempfile::tempdir().unwrap();
    let model = out.path().join("bare.toml");
    std::fs::write(&model, "name = \"bare\"\n[not_simulated]\nageing = \"3 % a year\"\n").unwrap();
    let model = model.to_str().unwrap();
    let (folder, done) = trained(out.path(), &["--hw", model]);
    let list = done["not_simulated"].as_array().unwrap();
    let page = std::fs::read_to_string(folder.join("report.html")).unwrap();
    let shown = run(dalean().args(["hw", "show", model])).stdout;
    let mut general = 0;
    for effect in EFFECTS {
        let Some(one) = list.iter().find(|one| one["effect"] == effect.key) else { continue };
        general += 1;
        assert_eq!(one["instead"], effect.instead);
        assert!(page.contains(effect.instead), "{}", effect.key);
        assert!(shown.contains(effect.instead), "{}", effect.key);
    }
    // all but those of light, and its own
    assert_eq!(list.len(), general + 1);
    assert!(general + 3 >= EFFECTS.len());
    assert!(page.contains("3 % a year") && shown.contains("ageing: 3 % a year"));
    let ran = run(dalean().args(["train", SMALL, "--hw", model, "--out"]).arg(out.path()));
    let words = format!("{} effects of real chips are not simulated", list.len());
    assert!(ran.stdout.contains(&words), "{}", ran.stdout);
}

#[test]
fn a_floor_is_shown_as_an_on_off_ratio() {
    let show =
        |settings: &[&str]| run(dalean().args(["hw", "show", "reram"]).args(settings)).stdout;
    assert!(show(&[]).contains("9.8 to 1 with hw.cell.floor = 13"));
    let checked = run(dalean().args(["hw", "check", "reram"])).stdout;
    assert!(checked.contains("9.8 to 1 with hw.cell.floor = 13"), "{checked}");
    let floor = show(&["--set", "hw.cell.floor=13"]);
    assert!(floor.contains("9.8 to 1"), "{floor}");
    assert!(show(&[]).contains("on off: level 0 conducts nothing"));
    assert!(!floor.contains("level 0 conducts nothing"), "{floor}");
}
