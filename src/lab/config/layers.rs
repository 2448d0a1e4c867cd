//! Laying texts over one another: built-in defaults, hardware model, experiment file, a sweep's keys, `--set`, `--hw`.

use std::path::Path;

use super::changed::{self, UnderModel};
use super::file::{ExperimentFile, HardwareFile};
use super::wrong::text_error;
use super::{Config, ConfigError, check, data, hardware};

/// Where a configuration comes from, weakest first.
///
/// ```
/// use dalean::{Config, Sources};
///
/// // what `dalean train mine.toml --hw reram --set learning.batch=8 --seed 3` reads
/// let settings = ["learning.batch=8".to_owned()];
/// let config = Config::load(&Sources {
///     experiment: Some(("mine.toml", "learning.batch = 16")),
///     hardware: Some("reram"),
///     settings: &settings,
///     seed: Some(3),
///     ..Sources::default()
/// })?;
/// assert_eq!((config.batch().get(), config.seed()), (8, 3));
/// # Ok::<(), dalean::ConfigError>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct Sources<'a> {
    /// Name and text of the experiment file; paths in it are relative to the folder of that name.
    pub experiment: Option<(&'a str, &'a str)>,
    /// What a sweep sets, weakest first.
    pub overlays: &'a [Overlay<'a>],
    /// `--hw`: model name or path.
    pub hardware: Option<&'a str>,
    /// `--set key=value`, in order; `key=default` takes back what a file said.
    pub settings: &'a [String],
    /// `--seed`.
    pub seed: Option<u64>,
}

/// Keys that a sweep sets.
#[derive(Debug, Clone, Copy)]
pub struct Overlay<'a> {
    /// Who sets them, for messages.
    pub place: &'a str,
    /// The keys.
    pub table: &'a toml::Table,
}

/// Reads and checks a configuration.
///
/// # Errors
/// When a text cannot be read, has unknown keys, or the numbers are impossible.
pub fn load(sources: &Sources<'_>) -> Result<Config, ConfigError> {
    let mut table = toml::Table::new();
    if let Some((name, text)) = sources.experiment {
        let _: ExperimentFile = parse(name, text)?;
        let mut own = expanded(parse(name, text)?);
        anchor(&mut own, Path::new(name).parent().unwrap_or(Path::new("")));
        changed::mark(&mut own, name, false);
        overlay(&mut table, own);
    }
    for Overlay { place, table: over } in sources.overlays {
        let mut own = (*over).clone();
        changed::spread(&mut own);
        let _: ExperimentFile = table_of(place, &own)?;
        let mut own = expanded(own);
        // a file may cite; what is set on the way in is assumed
        changed::mark(&mut own, place, *place == "--set");
        overlay(&mut table, own);
    }
    for setting in sources.settings {
        match taken_back(setting)? {
            Some(keys) => remove(&mut table, &keys),
            None => {
                let mut own = expanded(setting_table(setting)?);
                changed::mark(&mut own, "--set", true);
                overlay(&mut table, own);
            }
        }
    }
    if let Some(model) = sources.hardware {
        let set = toml::Table::from_iter([("model".into(), toml::Value::String(model.into()))]);
        overlay(&mut table, toml::Table::from_iter([("hw".into(), toml::Value::Table(set))]));
    }
    if let Some(seed) = sources.seed {
        let seed = i64::try_from(seed).map_err(|_| ConfigError::Value {
            key: "seed".into(),
            found: format!("is {seed}"),
            allowed: format!("it must lie in 0..={}", i64::MAX),
        })?;
        table.insert("seed".into(), toml::Value::Integer(seed));
    }
    let own = match table.remove("hw") {
        Some(toml::Value::Table(hw)) => hw,
        _ => toml::Table::new(),
    };
    named(&own)?;
    let name = own.get("model").and_then(toml::Value::as_str).unwrap_or("ideal").to_owned();
    // a resolved configuration holds its model's numbers itself
    let mut before = None;
    let (mut hw, model) = if own.contains_key("name") {
        (own, UnderModel::default())
    } else {
        let text = hardware::model_text(&name)?;
        let file: HardwareFile = hardware::model_file(&name, &text)?;
        let mut under: toml::Table = parse(&name, &text)?;
        anchor_map(&mut under, hardware::beside(&name));
        before = Some(under.clone());
        changed::lay(under, &file, own)?
    };
    hw.remove("model");
    table.insert("hw".into(), toml::Value::Table(hw));
    let mut config = check::config(table_of("configuration", &table)?, &model)?;
    config.model = before;
    Ok(config)
}

/// A text as what it says: `hw = "reram"` is `hw.model = "reram"`.
fn expanded(mut over: toml::Table) -> toml::Table {
    if let Some(hw @ toml::Value::String(_)) = over.get_mut("hw") {
        let name = hw.clone();
        *hw = toml::Value::Table(toml::Table::from_iter([("model".to_owned(), name)]));
    }
    over
}

/// The same of the list of stuck cells that a hardware model names.
pub(crate) fn anchor_map(hardware: &mut toml::Table, folder: &Path) {
    let faults = hardware.get_mut("device").and_then(|device| device.get_mut("faults"));
    if let Some(toml::Value::String(map)) = faults.and_then(|faults| faults.get_mut("map")) {
        *map = folder.join(&*map).display().to_string();
    }
}

/// Makes paths that a file in `folder` names relative to where the program runs: those of data and of a hardware model.
pub fn anchor(table: &mut toml::Table, folder: &Path) {
    data::anchor(table, folder);
    if let Some(toml::Value::Table(hw)) = table.get_mut("hw") {
        anchor_map(hw, folder);
    }
    let model = match table.get_mut("hw") {
        Some(toml::Value::Table(hw)) => hw.get_mut("model"),
        model => model,
    };
    if let Some(toml::Value::String(model)) = model
        && !hardware::is_builtin(model)
    {
        *model = folder.join(&*model).display().to_string();
    }
}

/// Whether `hw.name` stands where it means something: in a chip that is written out, as resolved configurations have it.
/// Elsewhere it would switch the model off, which nobody asked for.
fn named(hw: &toml::Table) -> Result<(), ConfigError> {
    let Some(name) = hw.get("name") else { return Ok(()) };
    let model = hw.get("model");
    let missing =
        ["cell", "tile", "drive", "adc", "write"].iter().find(|table| !hw.contains_key(**table));
    let allowed = match (model, missing) {
        (None, None) => return Ok(()),
        (Some(model), _) => format!(
            "it names a chip that is written out, and would switch the model {model} off: take one of the two out \
             (--set hw.name=default), or give the model file that name"
        ),
        (None, Some(table)) => format!(
            "it names a chip that is written out, but there is no [hw.{table}]: take the key out, or write a model file and \
             use it with --hw FILE"
        ),
    };
    Err(ConfigError::Value { key: "hw.name".into(), found: format!("is {name}"), allowed })
}

/// A table as what its keys mean.
fn table_of(place: &str, table: &toml::Table) -> Result<ExperimentFile, ConfigError> {
    table.clone().try_into().map_err(|error| text_error(place, &error))
}

/// One key with its value as a table: `hw.cell.level_bits` and 4 make `{ hw = { cell = { level_bits = 4 } } }`.
#[must_use]
pub fn setting(key: &str, value: toml::Value) -> toml::Table {
    let mut parts = key.rsplit('.');
    let last = parts.next().unwrap_or(key);
    let mut table = toml::Table::from_iter([(last.to_owned(), value)]);
    for part in parts {
        table = toml::Table::from_iter([(part.to_owned(), toml::Value::Table(table))]);
    }
    table
}

pub(super) fn parse<T: serde::de::DeserializeOwned>(
    place: &str,
    text: &str,
) -> Result<T, ConfigError> {
    toml::from_str(text).map_err(|error| text_error(place, &error))
}

/// `key=value` as a table: the value as TOML, or as a bare word.
///
/// # Errors
/// When it is no setting, or its key is unknown.
pub fn setting_table(setting: &str) -> Result<toml::Table, ConfigError> {
    let Some((key, value)) = setting.split_once('=') else {
        return Err(ConfigError::Value {
            key: format!("--set {setting}"),
            found: "has no `=`".into(),
            allowed: "write it as --set key=value, such as --set hw.cell.level_bits=4".into(),
        });
    };
    let bare = format!("{} = {}", key.trim(), value.trim());
    let quoted = format!("{} = {:?}", key.trim(), value.trim());
    let text = if toml::from_str::<toml::Table>(&bare).is_ok() { bare } else { quoted };
    let place = format!("--set {setting}");
    let mut table = parse(&place, &text)?;
    if changed::spread(&mut table) {
        let _: ExperimentFile = table_of(&place, &table)?;
    } else {
        let _: ExperimentFile = parse(&place, &text)?;
    }
    Ok(table)
}

/// The keys that `key=default` takes back, as a table; `None` for any other setting.
fn taken_back(setting: &str) -> Result<Option<toml::Table>, ConfigError> {
    let Some((key, "default")) = setting.split_once('=').map(|(key, value)| (key, value.trim()))
    else {
        return Ok(None);
    };
    // a key that a value of some kind suits is a key; of one that none suits, the first message says why
    let kinds = ["1", "0.5", "true", "\"\"", "[1]", "[0.5, 0.5]", "{}"];
    let mut why = None;
    for kind in kinds {
        match setting_table(&format!("{key}={kind}")) {
            Ok(table) => return Ok(Some(table)),
            Err(error) => why = why.or(Some(error)),
        }
    }
    why.map_or(Ok(None), Err)
}

/// Takes keys out, as if no text had said them.
fn remove(table: &mut toml::Table, keys: &toml::Table) {
    for (key, below) in keys {
        match (table.get_mut(key), below) {
            (Some(toml::Value::Table(table)), toml::Value::Table(keys)) if !keys.is_empty() => {
                remove(table, keys);
            }
            _ => drop(table.remove(key)),
        }
    }
}

/// Lays `over` on top of `under`: tables merge, everything else is replaced.
pub fn overlay(under: &mut toml::Table, over: toml::Table) {
    for (key, value) in over {
        match (under.get_mut(&key), value) {
            (Some(toml::Value::Table(under)), toml::Value::Table(over)) => overlay(under, over),
            (_, value) => {
                under.insert(key, value);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(settings: &[&str]) -> Result<Config, ConfigError> {
        let settings: Vec<String> = settings.iter().map(ToString::to_string).collect();
        load(&Sources { settings: &settings, ..Sources::default() })
    }

    #[test]
    fn settings_win_over_the_file_and_words_need_no_quotes() {
        let text = "seed = 3\n[learning]\nepochs = 7\nrule = \"ed\"\n";
        let settings = ["learning.rule=dfa".to_string(), "hw.cell.level_bits=4".to_string()];
        let sources = Sources {
            experiment: Some(("x.toml", text)),
            settings: &settings,
            ..Sources::default()
        };
        let config = load(&sources).unwrap();
        assert_eq!((config.seed, config.epochs), (3, 7));
        assert_eq!(config.rule, crate::learn::rule::Rule::Dfa);
        assert_eq!(config.hardware.cell.window.ceiling(), 15);
    }

    #[test]
    fn a_chip_is_named_in_a_word_or_in_a_table() {
        let load = |text: &str, settings: &[&str]| {
            let settings: Vec<String> = settings.iter().map(ToString::to_string).collect();
            let experiment = Some(("x.toml", text));
            load(&Sources { experiment, settings: &settings, ..Sources::default() })
        };
        let table = load("[hw]\nmodel = \"reram\"\nadc.bits = 4", &[]).unwrap();
        for (text, settings) in [
            ("hw = \"reram\"", &["hw.adc.bits=4"][..]),
            ("", &["hw=reram", "hw.adc.bits=4"]),
            ("hw = \"ideal\"", &["hw = reram", "hw.adc.bits=4"]),
        ] {
            let word = load(text, settings).unwrap();
            assert_eq!(word.to_toml(), table.to_toml(), "{text} {settings:?}");
        }
        let error = load("hw = 3", &[]).unwrap_err().to_string();
        assert!(error.contains("the name of a hardware model, or a table"), "{error}");
        let error = load("hw = \"reramm\"", &[]).unwrap_err().to_string();
        assert!(error.contains("did you mean \"reram\"?"), "{error}");
        let error = load("[hw]\nadcs = 3", &[]).unwrap_err().to_string();
        assert!(error.contains("line 2") && error.contains("did you mean `adc`?"), "{error}");
    }

    #[test]
    fn a_key_is_taken_back_as_if_no_file_had_said_it() {
        let text =
            "[learning]\ntaps = 3\nrate = 5\n[network]\nhidden = [7]\n[hw.cell]\nlevel_bits = 4\n";
        let load = |settings: &[&str]| {
            let settings: Vec<String> = settings.iter().map(ToString::to_string).collect();
            let experiment = Some(("x.toml", text));
            load(&Sources { experiment, settings: &settings, ..Sources::default() })
        };
        let refused = load(&["learning.rule=bp"]).unwrap_err().to_string();
        assert!(refused.contains("--set learning.taps=default"), "{refused}");
        let config = load(&["learning.rule=bp", "learning.taps=default"]).unwrap();
        assert_eq!((config.route, config.rates[0].get()), (None, 5.0));
        let config = load(&["network.hidden=default", "hw.cell = default"]).unwrap();
        assert_eq!((config.hidden, config.hardware.cell.level_bits.get()), (vec![256], 8));
        // what nobody said can be taken back, what nobody knows cannot
        assert!(load(&["hw.adc=default", "learning.rate_multipliers=default"]).is_ok());
        let error = load(&["learning.tap=default"]).unwrap_err().to_string();
        assert!(error.contains("unknown field `tap`"), "{error}");
    }

    #[test]
    fn every_key_that_means_nothing_where_it_stands_is_refused() {
        for (settings, key) in [
            (&["learning.rule=bp", "learning.taps=1"][..], "learning.taps"),
            (&["learning.rule=dfa", "learning.tap_shift=1"], "learning.tap_shift"),
            (&["learning.route=scalar_broadcast", "learning.taps=1"], "learning.taps"),
            (&["hw.write.dither_bits=0", "hw.write.dither=per_cell"], "hw.write.dither"),
            (&["data.label_column=last"], "data.label_column"),
            (&["data.format=csv", "data.train=a", "data.train_labels=b"], "data.train_labels"),
            (
                &["data.format=idx", "data.train=a", "data.train_labels=b", "data.test_labels=b"],
                "data.test_labels",
            ),
            (&["data.format=idx", "data.labels_array=b"], "data.labels_array"),
        ] {
            let error = with(settings).unwrap_err().to_string();
            assert!(error.starts_with(&format!("`{key}` is")), "{settings:?}: {error}");
        }
        assert!(with(&["hw.write.dither_bits=0"]).is_ok());
        assert!(with(&["data.format=idx", "data.train=a", "data.train_labels=b"]).is_ok());
    }

    #[test]
    #[expect(clippy::disallowed_methods, reason = "a test reads the examples")]
    fn every_example_is_a_network_that_fits_together() {
        let root = concat!(env!("CARGO_MANIFEST_DIR"), "/examples");
        let mut folders = vec![std::path::PathBuf::from(root)];
        let mut seen = 0;
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(&folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() && !path.ends_with("sweeps") {
                    folders.push(path);
                } else if path.extension().is_some_and(|end| end == "toml") {
                    let text = std::fs::read_to_string(&path).unwrap();
                    if text.contains("\n[[axis]]") {
                        continue; // a sweep
                    }
                    let name = path.to_string_lossy();
                    let experiment = Some((&*name, &*text));
                    let config = load(&Sources { experiment, ..Sources::default() }).unwrap();
                    let classes = if name.contains("kaneko") { 2 } else { 10 };
                    let image = match config.data.set.as_deref() {
                        Some("cifar10") => [32, 32, 3],
                        _ => [28, 28, 1],
                    };
                    let features = image.iter().product();
                    let made = config.networks(features, classes, Some(image));
                    assert!(made.is_ok(), "{name}: {made:?}");
                    assert_eq!(load_again(&config).to_toml(), config.to_toml());
                    seen += 1;
                }
            }
        }
        assert!(seen >= 20, "examples were found ({seen})");
    }

    fn load_again(config: &Config) -> Config {
        let text = config.to_toml();
        load(&Sources { experiment: Some(("resolved", &text)), ..Sources::default() }).unwrap()
    }

    #[test]
    fn a_resolved_configuration_resolves_to_itself() {
        let config =
            with(&["hw.model=prime", "hw.write.increment_max=3", "learning.taps=3"]).unwrap();
        let again = load_again(&config);
        assert_eq!(again.to_toml(), config.to_toml());
        assert_eq!(again.hardware, config.hardware);
    }

    #[test]
    fn mistakes_name_the_key_and_what_is_allowed() {
        for (setting, wanted) in [
            ("learning.epoch=3", "unknown field `epoch`"),
            ("hw.cell.level_bits=13", "`hw.cell.level_bits`"),
            ("hw.cell.floor=300", "must lie in 0..=254"),
            ("learning.rule=adam", "ed, ed_seed, ed_non_dalean, kaneko, dfa, bp, es"),
            ("network.weight_max=3", "power of two"),
            ("learning.rate=-1", "above 0"),
            ("hw.adc=perfect", "ideal"),
            ("hw.model=nothing.toml", "built-in models are ideal"),
            ("seed", "has no `=`"),
        ] {
            let error = with(&[setting]).unwrap_err().to_string();
            assert!(error.contains(wanted), "{setting}: {error}");
        }
    }
}
