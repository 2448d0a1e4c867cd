//! What users get by saying nothing trains, and what does not train says so beside its result. Tables and figures:
//! docs/results/defaults.md.

use std::fs;

use dalean::chip::crossbar::kernel::Backend;
use dalean::lab::config::{Config, Sources, load, model_names};
use dalean::lab::data::{DataRoot, load as load_data};
use dalean::lab::run::{Machine, Session, notes};
use dalean::lab::store::folder;
use dalean::lab::store::record::{Note, Score};

use super::program::{dalean, finished, run, train};

fn machine() -> Machine {
    Machine::new(Backend::best(), 1).unwrap()
}

fn config(hardware: Option<&str>, settings: &[&str], seed: u64) -> Config {
    let settings: Vec<String> = settings.iter().map(ToString::to_string).collect();
    let sources = Sources { hardware, settings: &settings, seed: Some(seed), ..Sources::default() };
    load(&sources).unwrap()
}

fn session(config: &Config) -> Session {
    let root = DataRoot::new("no such folder");
    let data = load_data(&config.source().unwrap(), &root).unwrap();
    Session::new(config, data, machine()).unwrap()
}

/// Test accuracy after so many epochs, in percent.
fn accuracy(config: &Config) -> f64 {
    let mut session = session(config);
    session.start().unwrap();
    while session.advance(&mut |_| true).unwrap().is_some() {}
    assert_eq!(session.epoch(), config.epochs());
    let test = session.test().unwrap().unwrap();
    let Score { correct, total, .. } = test.classify().unwrap().score;
    100.0 * correct as f64 / total as f64
}

/// The chip of the README, as a user would save it.
fn readme_chip() -> tempfile::NamedTempFile {
    let readme = include_str!("../../README.md");
    let chip = readme.split("```toml\n").find(|text| text.starts_with("name = \"my-array\""));
    let file = tempfile::Builder::new().suffix(".toml").tempfile().unwrap();
    fs::write(file.path(), chip.unwrap().split("```").next().unwrap()).unwrap();
    file
}

/// A chip whose converters had a headroom of 1 once ended at 9.9 %, and so did the one in the README.
#[test]
fn every_built_in_chip_trains_by_default() {
    let own = readme_chip();
    let chips = model_names().into_iter().map(ToOwned::to_owned);
    let own = own.path().to_string_lossy().into_owned();
    for chip in chips.chain([own]) {
        let reached = accuracy(&config(Some(&chip), &["learning.epochs=2"], 1));
        assert!(reached >= 88.0, "{chip}: {reached:.2} % after two epochs");
    }
}

#[test]
fn converters_of_four_to_twelve_bits_train_by_default() {
    for bits in [4, 5, 6, 8, 12] {
        for subtract in ["digital", "current"] {
            let adc = format!("hw.adc={{bits={bits}, subtract=\"{subtract}\"}}");
            let reached = accuracy(&config(None, &["learning.epochs=2", &adc], 1));
            assert!(reached >= 88.0, "{bits} bits, {subtract}: {reached:.2} % after two epochs");
        }
    }
}

/// One key of a batch or a width once was enough for 10 %.
#[test]
fn one_key_of_batch_mode_or_width_still_trains() {
    for key in
        ["learning.batch=1", "learning.batch=4", "learning.mode=online", "network.hidden=[1024]"]
    {
        let reached = accuracy(&config(None, &["learning.epochs=2", key], 1));
        assert!(reached >= 88.0, "{key}: {reached:.2} % after two epochs");
    }
}

/// The table of docs/results/defaults.md: ten epochs, three seeds.
#[test]
#[ignore = "takes minutes: tests/deep.sh defaults"]
fn every_chip_and_width_reaches_ninety_percent_in_ten_epochs() {
    let own = readme_chip();
    let own = own.path().to_string_lossy().into_owned();
    let mut rows: Vec<(String, Option<String>, Vec<String>)> = Vec::new();
    for chip in model_names().into_iter().map(ToOwned::to_owned).chain([own]) {
        rows.push((chip.clone(), Some(chip), vec![]));
    }
    for subtract in ["digital", "current"] {
        for bits in 4..=12 {
            let adc = format!("hw.adc={{bits={bits}, subtract=\"{subtract}\"}}");
            rows.push((format!("{bits} bits, {subtract}"), None, vec![adc]));
        }
    }
    for key in [
        "learning.batch=1",
        "learning.batch=2",
        "learning.batch=4",
        "learning.batch=256",
        "learning.mode=online",
        "learning.mode=replay",
        "learning.rate_mantissa=auto",
        "network.hidden=[]",
        "network.hidden=[32]",
        "network.hidden=[1024]",
        "network.hidden=[1024, 512]",
        "learning.rule=bp",
        "learning.rule=dfa",
    ] {
        rows.push((key.into(), None, vec![key.into()]));
    }
    for (name, chip, settings) in rows {
        let settings: Vec<&str> =
            settings.iter().map(|one| &**one).chain(["learning.epochs=10"]).collect();
        let reached = [1, 2, 3].map(|seed| accuracy(&config(chip.as_deref(), &settings, seed)));
        println!("{name}: {:.2} {:.2} {:.2}", reached[0], reached[1], reached[2]);
        assert!(reached.iter().all(|one| *one >= 90.0), "{name}: {reached:?}");
    }
}

/// Everything that a short run of exclusive or says beside its result.
fn noted(settings: &[&str]) -> Vec<Note> {
    let xor = ["data.set=xor", "network.hidden=[4]", "learning.epochs=3", "learning.batch=4"];
    let settings: Vec<&str> = xor.iter().chain(settings).copied().collect();
    let out = tempfile::tempdir().unwrap();
    let config = config(None, &settings, 1);
    let root = DataRoot::new("no such folder");
    let trained =
        dalean::lab::run::train(&config, &root, out.path(), machine(), &mut |_| true).unwrap();
    let path = fs::read_dir(out.path()).unwrap().next().unwrap().unwrap().path();
    let receipt = folder::read_receipt(&path).unwrap();
    let records = folder::read_metrics(&path).unwrap();
    // what was seen on the way is what is seen in the folder
    assert_eq!(notes(&receipt, &records), trained.notes);
    for note in &trained.notes {
        let words: Vec<String> = note.to_string().split(' ').map(ToOwned::to_owned).collect();
        let summary = trained.summary.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(summary.contains(&words.join(" ")), "{summary}");
    }
    trained.notes
}

#[test]
fn what_went_wrong_is_said_beside_the_result() {
    let still = noted(&["hw.write.dither_bits=0", "learning.rate=0.01"]);
    assert!(still.contains(&Note::Still { layer: 1, epoch: 1, epochs: 3 }), "{still:?}");
    let rails = noted(&["hw.adc={bits=2, range=0}", "learning.rate=60"]);
    let clipped = |notes: &[Note], what: &str| {
        let of = |note: &Note| matches!(note, Note::Clipped { of, epochs, .. } if of == what && *epochs > 0);
        notes.iter().any(of)
    };
    assert!(clipped(&rails, "conversions"), "{rails:?}");
    assert!(rails.iter().any(|note| matches!(note, Note::Mute { .. })), "{rails:?}");
    assert!(rails.iter().any(|note| matches!(note, Note::Chance { .. })), "{rails:?}");
    let bounded = noted(&["hw.write.increment_max=1", "learning.rate=1000"]);
    assert!(clipped(&bounded, "requests"), "{bounded:?}");
    let narrow = noted(&["network.alpha=0.01", "learning.rate=1"]);
    assert!(clipped(&narrow, "tables"), "{narrow:?}");
}

/// A run that goes well says nothing.
#[test]
fn a_run_that_trains_has_no_notes() {
    let out = tempfile::tempdir().unwrap();
    let (_, done) = finished(&mut train(out.path()));
    assert_eq!(done["notes"], serde_json::json!([]));
}

/// Rates 14 to 22 once were one run, and nobody said so.
#[test]
fn the_rate_in_effect_is_printed_and_recorded() {
    let out = tempfile::tempdir().unwrap();
    let (path, _) = finished(train(out.path()).args(["--set", "learning.epochs=1"]));
    let ran = run(train(out.path()).args([
        "--set",
        "learning.rate_mantissa=auto",
        "--set",
        "learning.epochs=1",
    ]));
    let started: serde_json::Value =
        serde_json::from_str(ran.stdout.lines().next().unwrap()).unwrap();
    let rates = started["rates"].as_array().unwrap();
    assert_eq!((rates.len(), &rates[0]["asked"]), (2, &serde_json::json!(10.0)));
    let auto = std::path::PathBuf::from(started["run"].as_str().unwrap());
    let [plain, auto] = [path, auto].map(|path| folder::read_receipt(&path).unwrap());
    assert_eq!(serde_json::to_value(&auto.rates).unwrap(), started["rates"]);
    let off = |rate: f64| (rate / 10.0 - 1.0).abs();
    for (plain, auto) in plain.rates.iter().zip(&auto.rates) {
        assert_eq!((plain.mantissa, plain.asked, auto.asked), (1, 10.0, 10.0));
        assert!(off(auto.effective) <= 0.07 && off(auto.effective) < off(plain.effective));
    }
    assert_ne!(plain.run, auto.run, "another rate is another run");
    // the mantissa that was found is in the folder, and gives the same run when it is said
    let said = format!("learning.rate_mantissa={}", auto.rates[0].mantissa);
    let (path, _) =
        finished(train(out.path()).args(["--set", &said, "--set", "learning.epochs=1"]));
    assert_eq!(folder::read_receipt(&path).unwrap().run, auto.run);
    let mut words = dalean();
    words
        .args(["train", super::program::SMALL, "--set", "learning.epochs=1", "--out"])
        .arg(out.path());
    let words = run(&mut words);
    assert!(words.stderr.contains("rate of layer 0: 10 asked for, "), "{words:?}");
}

#[test]
fn layers_may_have_mantissas_of_their_own() {
    let of = |setting: &str| {
        let config = config(None, &[setting, "network.hidden=[8]", "learning.epochs=1"], 1);
        let mut session = session(&config);
        session.start().unwrap();
        session.advance(&mut |_| true).unwrap().unwrap();
        (session.run().to_owned(), session.state_hash(), config.to_toml())
    };
    let [all, list, unlike] =
        ["3", "[3, 3]", "[3, 5]"].map(|m| of(&format!("learning.rate_mantissa={m}")));
    assert_eq!((&all.0, &all.1), (&list.0, &list.1));
    assert!(list.2.contains("rate_mantissa = 3\n"), "{}", list.2);
    assert!(unlike.0 != all.0 && unlike.1 != all.1 && unlike.2.contains("rate_mantissa = [3, 5]"));
    // every update is compared with the tick, cycle by cycle
    let mut trace = dalean();
    let out = tempfile::tempdir().unwrap();
    trace.args(["trace", "--set", "learning.rate_mantissa=[3, 5]", "--set", "network.hidden=[8]"]);
    trace.args(["--set", "learning.batch=3", "--perfetto"]).arg(out.path().join("tiles.json"));
    assert_eq!(run(&mut trace).code, Some(0));
}

/// Four thousand million epochs once were looked through, one update after the other, before the first one began.
#[test]
fn a_run_of_four_thousand_million_epochs_begins_at_once() {
    let config = config(None, &["data.set=xor", "learning.epochs=4000000000"], 1);
    let mut session = session(&config);
    session.start().unwrap();
    assert!(session.advance(&mut |_| true).unwrap().is_some());
    assert_eq!(session.epoch(), 1);
}

/// An epoch past the last one once gave a checkpoint that no session would take.
#[test]
fn there_is_no_epoch_after_the_last_one() {
    let config = config(None, &["data.set=xor", "learning.epochs=2"], 1);
    let mut session = session(&config);
    session.start().unwrap();
    let advanced: Vec<bool> =
        (0..4).map(|_| session.advance(&mut |_| true).unwrap().is_some()).collect();
    assert_eq!((advanced, session.epoch()), (vec![true, true, false, false], 2));
    let checkpoint = session.checkpoint();
    session.restore(&checkpoint).unwrap();
}
