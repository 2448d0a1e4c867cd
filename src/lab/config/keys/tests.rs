use std::collections::BTreeSet;

use super::*;
use crate::lab::config::sweep::SweepFile;
use crate::lab::config::{Config, ConfigError, Sources, load};
use crate::lab::data::NamedSet;

/// The keys that a reader lists when it is shown one that no table has.
fn listed(error: &str) -> BTreeSet<String> {
    let rest = error.split_once("expected").unwrap_or_else(|| panic!("{error}")).1;
    let line = rest.lines().next().unwrap_or_default();
    line.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

/// What the reader of files says to an unknown key of a table.
fn refused(table: &KeyTable) -> String {
    let text = match (table.file, table.path) {
        (KeyFileKind::Sweep, "axis") => "[[axis]]\nunheard = 1".into(),
        (KeyFileKind::Sweep, "axis.case") => "[[axis]]\n[[axis.case]]\nunheard = 1".into(),
        (KeyFileKind::Sweep, "report.published") => "[[report.published]]\nunheard = 1".into(),
        (_, "energy.*") => "[hw.energy]\nhold_fj = { unheard = 1 }".into(),
        (KeyFileKind::Hardware, "") => "[hw]\nunheard = 1".into(),
        (KeyFileKind::Hardware, path) => format!("[hw.{path}]\nunheard = 1"),
        (_, "") => "unheard = 1".into(),
        (_, path) => format!("[{path}]\nunheard = 1"),
    };
    let error = if table.file == KeyFileKind::Sweep {
        SweepFile::parse("x", &text).map(drop)
    } else {
        load(&Sources { experiment: Some(("x", &text)), ..Sources::default() }).map(drop)
    };
    error.unwrap_err().to_string()
}

#[test]
fn the_tables_hold_the_keys_that_the_reader_of_files_knows_and_no_others() {
    for table in tables() {
        let names: BTreeSet<String> =
            table.entries.iter().map(|entry| entry.name.to_owned()).collect();
        assert_eq!(names.len(), table.entries.len(), "[{}] has a key twice", table.path);
        assert_eq!(names, listed(&refused(table)), "[{}] ({:?})", table.path, table.file);
        for key in table.keys() {
            assert!(!key.meaning.is_empty(), "{} means something", key.full());
        }
    }
}

fn with(settings: &[String]) -> Result<Config, ConfigError> {
    // a model that is silent, so that defaults are the program's and not a model's
    let text =
        "hw = { name = \"silent\", cell = {}, tile = {}, drive = {}, adc = \"ideal\", write = {} }";
    let experiment = Some(("x", text));
    load(&Sources { experiment, settings, ..Sources::default() })
}

/// Reads a configuration with a key set, beside what it needs, down to the network for 8 x 8 images of 10 classes.
fn set(key: &KeyShown, value: &str) -> Result<Config, String> {
    let mut settings: Vec<String> = key.entry.beside.iter().map(ToString::to_string).collect();
    if key.full() == "learning.centre" && value == "\"batch\"" {
        settings.push("learning.batch=2".into());
    }
    if key.full() == "learning.centred" {
        settings.push("network.threshold=true".into());
    }
    if key.full() == "learning.batch" && value == "1" {
        settings.push("learning.centre=running".into());
    }
    settings.push(format!("{}={value}", key.full()));
    let config = with(&settings).map_err(|e| e.to_string())?;
    let network = key.table.path == "learning" || key.table.path == "network";
    if network && !matches!(key.entry.values, KeyValues::Words(_)) {
        config.networks(64, 10, Some([8, 8, 1])).map_err(|e| e.to_string())?;
    }
    Ok(config)
}

fn experiment_keys_shown() -> impl Iterator<Item = KeyShown> {
    tables()
        .filter(|table| table.file != KeyFileKind::Sweep && table.path != "energy.*")
        .flat_map(KeyTable::keys)
}

#[test]
fn each_default_is_what_saying_nothing_gives() {
    let mut seen = 0;
    let mut problems = vec![];
    for key in experiment_keys_shown() {
        let beside: Vec<String> = key.entry.beside.iter().map(ToString::to_string).collect();
        // what stands beside it is there for its own sake
        let beside: Vec<String> = beside
            .into_iter()
            .filter(|text| !text.starts_with(&format!("{}=", key.full())))
            .collect();
        // defaults of own files are those of files
        if !beside.is_empty() && key.table.path == "data" {
            continue;
        }
        let config = if key.full() == "data.set" {
            load(&Sources::default()).unwrap()
        } else {
            match with(&beside) {
                Ok(config) => config,
                // what a table needs has no default
                Err(error)
                    if key.entry.default.is_empty() && error.to_string().contains("is missing") =>
                {
                    continue;
                }
                Err(error) => panic!("{}: {error}", key.full()),
            }
        };
        let mut at = Some(toml::Value::try_from(&config.resolved).unwrap());
        for part in key.full().split('.') {
            at = at.as_ref().and_then(|value| value.get(part)).cloned();
        }
        let is_name = ["hw.name", "hw.model"].contains(&key.full().as_str());
        let is_table = matches!(at, Some(toml::Value::Table(_)));
        if is_name || is_table {
            continue;
        }
        let wanted = (!key.entry.default.is_empty()).then(|| {
            let text = format!("x = {}", key.entry.default);
            toml::from_str::<toml::Table>(&text).unwrap()["x"].clone()
        });
        if at != wanted {
            problems.push(format!("{}: resolved to {at:?}, listed as {wanted:?}", key.full()));
        }
        seen += 1;
    }
    assert_eq!(problems, [""; 0]);
    assert!(seen > 50, "defaults were compared ({seen})");
}

#[test]
fn the_ends_of_each_range_are_taken_and_one_beyond_is_refused() {
    let mut seen = 0;
    let mut problems = vec![];
    for key in experiment_keys_shown() {
        let (inside, outside): (Vec<String>, Vec<String>) = match key.entry.values {
            KeyValues::Whole(least, most) => {
                let beyond = [least.checked_sub(1), most.checked_add(1)];
                let inside = [least, most].map(|n| n.to_string()).to_vec();
                (inside, beyond.into_iter().flatten().map(|n| n.to_string()).collect())
            }
            KeyValues::PowerOfTwo(least, most) => (
                [least, most].map(|n| n.to_string()).to_vec(),
                [least - 1, most * 2, most + 1].map(|n| n.to_string()).to_vec(),
            ),
            KeyValues::Choice(list) => (
                list.iter().map(ToString::to_string).collect(),
                list.iter().map(|n| (n + 1).to_string()).collect(),
            ),
            KeyValues::Real(least, most) => (
                [least, most].map(|n| format!("{n:?}")).to_vec(),
                [least * 0.999, most * 1.001, 0.0].map(|n| format!("{n:?}")).to_vec(),
            ),
            KeyValues::Lawful(least, most, _) => (
                [least, most].map(|n| format!("{n:?}")).to_vec(),
                [least / 2.0, most * 2.0, most * 0.99].map(|n| format!("{n:?}")).to_vec(),
            ),
            KeyValues::Flag => (vec!["true".into(), "false".into()], vec!["\"maybe\"".into()]),
            KeyValues::Words(_) | KeyValues::Other(_) => continue,
        };
        for value in inside {
            if free(&key, &value) {
                continue;
            }
            if let Err(error) = set(&key, &value) {
                problems.push(format!("{} = {value} is inside, but: {error}", key.full()));
            }
        }
        for value in outside {
            // what data hold is checked when they are read
            if key.table.path != "data" && set(&key, &value).is_ok() {
                problems.push(format!("{} = {value} is beyond, but taken", key.full()));
            }
        }
        seen += 1;
    }
    assert_eq!(problems, [""; 0]);
    assert!(seen > 30, "ranges were tried ({seen})");
}

/// Ends that another key forbids beside its default: tried by the tests of that rule.
fn free(key: &KeyShown, value: &str) -> bool {
    match &*key.full() {
        // a rate too great or small for the shift of these layers; a width that its table cannot step by
        "learning.rate" | "learning.rate_multipliers" | "network.alpha" | "network.weight_max" => {
            true
        }
        // ten classes have ten outputs
        "network.outputs" => true,
        // a window holds a batch
        "network.homeostasis_window" => true,
        // a training this long is weighed elsewhere
        "learning.epochs" => value != "0",
        _ => false,
    }
}

#[test]
fn words_are_taken_and_others_are_refused_with_the_whole_list() {
    let mut seen = 0;
    let mut problems = vec![];
    for key in experiment_keys_shown() {
        let KeyValues::Words(words) = key.entry.values else { continue };
        if key.entry.name == "kind" && key.entry.beside.is_empty() {
            // where a number comes from: read and kept, checked in model files
            continue;
        }
        for (word, meaning) in words {
            assert!(!meaning.is_empty());
            let beside: &[&str] = match (&*key.full(), *word) {
                ("data.format", "idx") => &["data.train=a", "data.train_labels=b"],
                ("data.format", _) => &["data.train=a"],
                ("learning.rule", "es") | ("network.readout", "p-n") => &["task=policy"],
                ("learning.select", "best_validation") | ("learning.rule", _) => &[],
                ("learning.mode", "online") => &["learning.centre=none"],
                ("network.input", "split" | "offset" | "signed") => &["task=policy"],
                _ => &[],
            };
            let mut settings: Vec<String> =
                key.entry.beside.iter().chain(beside).map(ToString::to_string).collect();
            settings.push(format!("{}={word}", key.full()));
            if let Err(error) = with(&settings) {
                problems.push(format!("{} = {word}: {error}", key.full()));
            }
        }
        let error = set(&key, "\"unheard\"").map(|config| config.source().map(drop));
        let error = match error {
            Err(error) => error,
            Ok(Err(error)) => error.to_string(),
            Ok(Ok(())) => {
                problems.push(format!("{} = unheard was taken", key.full()));
                continue;
            }
        };
        let missing = words.iter().filter(|(word, _)| !word.starts_with("parity"));
        let missing: Vec<_> = missing.filter(|(word, _)| !error.contains(word)).collect();
        if !missing.is_empty() {
            problems.push(format!("{}: {error} does not name {missing:?}", key.full()));
        }
        seen += 1;
    }
    assert_eq!(problems, [""; 0]);
    assert!(seen > 15, "words were tried ({seen})");
}

#[test]
fn the_sets_are_those_of_the_catalogue() {
    let key = matching("data.set").into_iter().find(|key| key.full() == "data.set").unwrap();
    let KeyValues::Words(words) = key.entry.values else { panic!("words") };
    let named: Vec<String> = NamedSet::all().map(|set| set.to_string()).collect();
    assert_eq!(words.iter().map(|(word, _)| *word).collect::<Vec<_>>(), named);
}

#[test]
fn a_word_finds_names_first_and_meanings_else() {
    let names = |word: &str| matching(word).iter().map(KeyShown::full).collect::<Vec<_>>();
    assert_eq!(names("headroom"), ["hw.adc.headroom"]);
    assert_eq!(names("LEVEL_BITS"), ["hw.cell.level_bits"]);
    assert!(names("coincidences").contains(&"hw.write.scheme".to_owned()));
    assert!(names("xyzzy").is_empty());
    assert_eq!(quantities("conversion").len(), 1);
}

#[test]
fn a_slip_in_a_key_is_answered_with_what_was_meant() {
    for (setting, wanted) in [
        ("hw.cell.level_bit=4", "did you mean `level_bits`?"),
        ("learning.epoch=3", "did you mean `epochs`?"),
        ("learning.hidden=[3]", "there is `network.hidden`"),
        ("hw.cell.rows=3", "there is `hw.tile.rows`"),
        ("hw.energy.hodl_fj.low=1", "did you mean `hold` with a unit at its end?"),
        ("leraning.rate=3", "did you mean `learning`?"),
        ("learning.rule=kanekko", "did you mean \"kaneko\"?"),
        ("network.activation=Sigmiod", "did you mean \"sigmoid\"?"),
        ("learning.route=random-sparse", "did you mean \"random_sparse\"?"),
        ("hw.model=rerma", "did you mean \"reram\"?"),
    ] {
        let settings = [setting.to_owned()];
        let error = load(&Sources { settings: &settings, ..Sources::default() }).unwrap_err();
        assert!(error.to_string().contains(wanted), "{setting}: {error}");
    }
}

#[test]
fn a_bare_number_of_physics_is_answered_with_the_form_it_has() {
    let text = "[hw.energy]\nconversion_pj = 1.4";
    let error = load(&Sources { experiment: Some(("x", text)), ..Sources::default() }).unwrap_err();
    let error = error.to_string();
    for word in
        ["line 2", "`1.4`", "a physical number", "low = ", "source = ", "kind = \"assumed\""]
    {
        assert!(error.contains(word), "{word} in {error}");
    }
    let text = "learning = 3";
    let error = load(&Sources { experiment: Some(("x", text)), ..Sources::default() }).unwrap_err();
    assert!(error.to_string().contains("expected a table of keys"), "{error}");
}
