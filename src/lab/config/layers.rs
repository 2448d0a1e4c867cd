//! Laying texts over one another: built-in defaults, hardware model, experiment file, a sweep's keys, `--set`, `--hw`.

use super::file::{ExperimentFile, HardwareFile};
use super::{Config, ConfigError, check, hardware};

/// Where a configuration comes from, weakest first.
#[derive(Debug, Clone, Default)]
pub struct Sources<'a> {
    /// Name and text of the experiment file.
    pub experiment: Option<(&'a str, &'a str)>,
    /// What a sweep sets, weakest first.
    pub overlays: &'a [Overlay<'a>],
    /// `--hw`: model name or path.
    pub hardware: Option<&'a str>,
    /// `--set key=value`, in order.
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
        overlay(&mut table, parse(name, text)?);
    }
    for Overlay { place, table: over } in sources.overlays {
        let _: ExperimentFile = table_of(place, over)?;
        overlay(&mut table, (*over).clone());
    }
    for setting in sources.settings {
        overlay(&mut table, setting_table(setting)?);
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
    let name = own.get("model").and_then(toml::Value::as_str).unwrap_or("ideal").to_owned();
    // a resolved configuration holds its model's numbers itself
    let mut hw = if own.contains_key("name") {
        toml::Table::new()
    } else {
        let text = hardware::model_text(&name)?;
        let _: HardwareFile = hardware::model_file(&name, &text)?;
        parse(&name, &text)?
    };
    overlay(&mut hw, own);
    hw.remove("model");
    table.insert("hw".into(), toml::Value::Table(hw));
    check::config(table_of("configuration", &table)?)
}

/// A table as what its keys mean.
fn table_of(place: &str, table: &toml::Table) -> Result<ExperimentFile, ConfigError> {
    let error =
        |e: toml::de::Error| ConfigError::Text { place: place.into(), error: e.to_string() };
    table.clone().try_into().map_err(error)
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
    toml::from_str(text)
        .map_err(|e| ConfigError::Text { place: place.into(), error: e.to_string() })
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
    let _: ExperimentFile = parse(&place, &text)?;
    parse(&place, &text)
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
    fn a_resolved_configuration_resolves_to_itself() {
        let config =
            with(&["hw.model=prime", "hw.write.increment_max=3", "learning.taps=3"]).unwrap();
        let text = config.to_toml();
        let again =
            load(&Sources { experiment: Some(("x", &text)), ..Sources::default() }).unwrap();
        assert_eq!(again.to_toml(), text);
        assert_eq!(again.hardware, config.hardware);
    }

    #[test]
    fn mistakes_name_the_key_and_what_is_allowed() {
        for (setting, wanted) in [
            ("learning.epoch=3", "unknown field `epoch`"),
            ("hw.cell.level_bits=13", "`hw.cell.level_bits`"),
            ("hw.cell.floor=300", "must lie in 0..=254"),
            ("learning.rule=adam", "ed, ed_seed, kaneko, dfa, bp"),
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
