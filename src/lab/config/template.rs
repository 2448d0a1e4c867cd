//! A hardware model to begin with, and a changed one to keep: as text.

use super::file::{AdcFile, ChipFile, HardwareFile};
use super::keys::{KeyFileKind, KeyTable, tables};
use super::{Config, hardware, quantity};

/// Text of a new model: every key with its meaning, those that have no default and those that cost energy to be filled
/// in. It is valid as it stands.
#[must_use]
pub fn template(name: &str) -> String {
    let mut text = format!(
        "# A hardware model. Replace what is not your chip, and say of each table where its numbers are from.\n\
         # dalean hw check {name}.toml            keys, ranges, sources, units\n\
         # dalean train --hw {name}.toml          train the digits on it\n\
         # dalean keys WORD                       what a key takes\n\
         name = {name:?}\n\
         summary = \"a new chip\"\n"
    );
    let tables = tables().filter(|table| table.file == KeyFileKind::Hardware);
    for table in tables.filter(|table| !["", "energy.*"].contains(&table.path)) {
        if table.path == "device" {
            continue;
        }
        let mut part = format!("[{}]\n{}", table.path, keys_of(table));
        part += "source = \"replace: where the numbers of this table are from\"\n";
        part += "kind = \"assumed\"                  # measured, fitted or assumed\n";
        // cells are ideal until somebody says what they do
        if table.path.starts_with("device.") {
            let lines = part.lines().map(|line| format!("# {}\n", line.trim_start_matches("# ")));
            part = lines.collect();
        }
        text += &format!("\n# {}\n{part}", table.about);
    }
    text += &numbers();
    text += "\n# Figures of this chip for what this program does not simulate (dalean hw show lists it): they stand beside every result.\n\
             [not_simulated]\n# drift = \"levels lose 2 % a day\"\n";
    text
}

/// The keys of a table: those with a default as they are, the others behind `#`.
fn keys_of(table: &'static KeyTable) -> String {
    let mut text = String::new();
    let keys = table.keys().filter(|key| !["source", "kind"].contains(&key.entry.name));
    for key in keys {
        let path = key.full();
        let needed = NEEDED.iter().find(|(name, _)| *name == path).map(|(_, value)| *value);
        let only = !key.entry.only.is_empty();
        let line = match (needed, key.entry.default) {
            (Some(value), _) => format!("{} = {value}", key.entry.name),
            (None, "") => format!("# {} =", key.entry.name),
            (None, value) if only => format!("# {} = {value}", key.entry.name),
            (None, value) => format!("{} = {value}", key.entry.name),
        };
        let takes = key.entry.takes();
        let only = if only { format!("; only {}", key.entry.only) } else { String::new() };
        text += &format!("{line:32}  # {takes}{only}: {}\n", first_sentence(key.meaning));
    }
    text
}

/// Keys that their table cannot be without, and a common choice.
const NEEDED: [(&str, &str); 2] = [("hw.adc.bits", "8"), ("hw.timing.clock_mhz", "1000.0")];

fn first_sentence(text: &str) -> &str {
    text.split_once(". ").map_or(text, |(first, _)| first).trim_end_matches('.')
}

/// The physical numbers of the ideal chip, to be replaced, and those it lacks.
fn numbers() -> String {
    let mut text = String::new();
    let ideal = hardware::load_model("ideal").map(|model| model.constants).unwrap_or_default();
    let mut at = None;
    for quantity in quantity::QUANTITIES {
        if at != Some(quantity.table) {
            at = Some(quantity.table);
            text += &format!(
                "\n# Physical numbers: the least that is credible, what is reckoned with, the most.\n[{}]\n",
                quantity.table.name()
            );
        }
        text += &match ideal.get(quantity.table, quantity.name) {
            Some(constant) => {
                let name = constant.key.split_once('.').map_or(&*constant.key, |(_, name)| name);
                let worth = constant.worth();
                let [low, typical, high] = constant.value.map(|n| short(n / worth));
                format!(
                    "{name} = {{ low = {low}, typical = {typical}, high = {high}, kind = \"assumed\", source = \
                     \"replace: as the chip `ideal` has it\" }}\n"
                )
            }
            None => {
                let unit = quantity.table.units()[1].0;
                format!(
                    "# {}_{unit} = {{ low = , typical = , high = , kind = , source = }}\n",
                    quantity.name
                )
            }
        };
    }
    text
}

/// A number without the last digits that a division has left.
fn short(number: f64) -> String {
    let text = format!("{number:.6}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

impl Config {
    /// Its chip as a model file that can be saved and used: every number written out, with its source. Tables that no file
    /// gave are said to be this program's, and those that `settings` change are no longer what their source says.
    ///
    /// # Panics
    /// Never: every key has a TOML form.
    #[must_use]
    pub(crate) fn hardware_toml(&self, name: &str, settings: &[String]) -> String {
        let ChipFile(mut hw) = self.resolved.hw.clone().unwrap_or_default();
        hw.name = Some(name.to_owned());
        complete(&mut hw, settings);
        toml::to_string(&hw).expect("every key has a TOML form")
    }
}

/// Gives a source to tables that have none, and takes their claim from those that are changed.
fn complete(hw: &mut HardwareFile, settings: &[String]) {
    let changed = |table: &str| {
        let prefix = format!("hw.{table}.");
        settings.iter().any(|setting| setting.trim().starts_with(&prefix))
    };
    let settle = |name: &str, source: &mut Option<String>, kind: &mut Option<String>| {
        let claim = source.get_or_insert_with(|| "this program's default".into());
        if changed(name) {
            *claim = format!("changed by hand; before: {claim}");
            *kind = Some("assumed".into());
        }
        kind.get_or_insert_with(|| "assumed".into());
    };
    macro_rules! tables {
        ($($name:ident)*) => {$(
            if let Some(table) = &mut hw.$name {
                settle(stringify!($name), &mut table.source, &mut table.kind);
            }
        )*};
    }
    tables!(cell tile drive lut error write timing);
    macro_rules! device {
        ($($name:ident)*) => {$(
            if let Some(table) = hw.device.as_mut().and_then(|device| device.$name.as_mut()) {
                let name = concat!("device.", stringify!($name));
                settle(name, &mut table.source, &mut table.kind);
            }
        )*};
    }
    device!(response spread faults conductance wires read_noise programming drift endurance leakage);
    if let Some(AdcFile::Finite(table)) = &mut hw.adc {
        settle("adc", &mut table.source, &mut table.kind);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::config::{Sources, load};

    fn used(text: &str) -> Config {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mine.toml");
        #[expect(clippy::disallowed_methods, reason = "models live in files")]
        std::fs::write(&path, text).unwrap();
        let path = path.to_string_lossy();
        let model = hardware::load_model(&path).unwrap();
        assert_eq!(model.constants.complaints(), [""; 0]);
        load(&Sources { hardware: Some(&path), ..Sources::default() }).unwrap()
    }

    #[test]
    fn a_new_model_is_valid_as_it_stands_and_says_every_key() {
        let text = template("mychip");
        let config = used(&text);
        assert_eq!(config.hardware_name, "mychip");
        assert!(config.hardware.timing.is_some() && config.constants.iter().count() > 10);
        let tables = tables().filter(|table| table.file == KeyFileKind::Hardware);
        for key in tables
            .filter(|t| !["", "energy.*", "device"].contains(&t.path))
            .flat_map(KeyTable::keys)
        {
            assert!(text.contains(&format!("{} =", key.entry.name)), "{}", key.full());
        }
    }

    #[test]
    fn a_changed_chip_can_be_saved_and_used_and_is_the_same() {
        for model in hardware::model_names() {
            let settings = ["hw.adc.bits=6".to_owned(), "hw.cell.level_bits=5".to_owned()];
            let settings = if model == "ideal" { &settings[..] } else { &[] };
            let sources = Sources { hardware: Some(model), settings, ..Sources::default() };
            let config = load(&sources).unwrap();
            let again = used(&config.hardware_toml("saved", settings));
            assert_eq!(again.hardware, config.hardware, "{model}");
            assert_eq!(again.constants, config.constants, "{model}");
            assert_eq!(again.hardware_name, "saved");
        }
    }
}
