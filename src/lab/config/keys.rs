//! Every key of every file: what it takes, its unit, its default, where it is allowed. Written once, for `dalean keys`,
//! docs/CONFIG.md, hints about typing errors and names of runs.
//!
//! What a key *means* stands above its field ([`super::file`], [`super::sweep`]); what it takes stands here, a table of a
//! file each, and tests hold both against what the reader of files accepts.

mod experiment;
mod hardware;
mod sweep;
#[cfg(test)]
mod tests;
mod text;

pub use text::{key_json, markdown, quantities_json, terminal};

use super::quantity::{CostTable, QUANTITIES};

/// Which file a table belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KeyFileKind {
    /// An experiment file; with `--set` too.
    Experiment,
    /// A hardware model file, and below `hw.` an experiment file.
    Hardware,
    /// A sweep file.
    Sweep,
}

/// What a key takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum KeyValues {
    /// A whole number, ends included.
    Whole(i64, i64),
    /// One of some whole numbers.
    Choice(&'static [i64]),
    /// A whole number, a power of two, ends included.
    PowerOfTwo(i64, i64),
    /// A number, ends included.
    Real(f64, f64),
    /// A number with a law of its own, ends included.
    Lawful(f64, f64, &'static str),
    /// One of some words, each with its meaning.
    Words(&'static [(&'static str, &'static str)]),
    /// True or false.
    Flag,
    /// Something else, in words.
    Other(&'static str),
}

/// A key.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KeyEntry {
    /// Its name in its table.
    pub name: &'static str,
    /// What it takes.
    pub values: KeyValues,
    /// Whether it takes one value a layer in place of one.
    pub layers: bool,
    /// Whether it takes one value a convolution in place of one.
    pub windows: bool,
    /// Unit; empty when it has none.
    pub unit: &'static str,
    /// Default as TOML; empty when a file that is silent has no value.
    pub default: &'static str,
    /// What happens without it, or what the default depends on; may be empty.
    pub otherwise: &'static str,
    /// What its range depends on; may be empty.
    pub law: &'static str,
    /// Where alone it is allowed, in words; empty when it is everywhere.
    pub only: &'static str,
    /// Settings that it may stand beside, as `--set` takes them.
    pub beside: &'static [&'static str],
}

/// A table of a file.
#[derive(Debug, Clone, Copy)]
pub struct KeyTable {
    /// Its name in the file, with dots; empty for the file itself.
    pub path: &'static str,
    /// Which file.
    pub file: KeyFileKind,
    /// What it is about.
    pub about: &'static str,
    /// Keys and meanings, as the reader of files has them.
    pub meanings: &'static [(&'static str, &'static str)],
    /// What the keys take, in the order of the file.
    pub entries: &'static [KeyEntry],
}

/// A key with its place, as it is shown.
#[derive(Debug, Clone, Copy)]
pub struct KeyShown {
    /// Its table.
    pub table: &'static KeyTable,
    /// What it takes.
    pub entry: &'static KeyEntry,
    /// What it means.
    pub meaning: &'static str,
}

const fn key(name: &'static str, values: KeyValues) -> KeyEntry {
    KeyEntry {
        name,
        values,
        layers: false,
        windows: false,
        unit: "",
        default: "",
        otherwise: "",
        law: "",
        only: "",
        beside: &[],
    }
}

const fn whole(name: &'static str, least: i64, most: i64) -> KeyEntry {
    key(name, KeyValues::Whole(least, most))
}

const fn real(name: &'static str, least: f64, most: f64) -> KeyEntry {
    key(name, KeyValues::Real(least, most))
}

const fn words(name: &'static str, words: &'static [(&'static str, &'static str)]) -> KeyEntry {
    key(name, KeyValues::Words(words))
}

const fn flag(name: &'static str) -> KeyEntry {
    key(name, KeyValues::Flag)
}

const fn other(name: &'static str, what: &'static str) -> KeyEntry {
    key(name, KeyValues::Other(what))
}

impl KeyEntry {
    const fn layers(mut self) -> Self {
        self.layers = true;
        self
    }

    const fn windows(mut self) -> Self {
        self.windows = true;
        self
    }

    const fn unit(mut self, unit: &'static str) -> Self {
        self.unit = unit;
        self
    }

    const fn default(mut self, default: &'static str) -> Self {
        self.default = default;
        self
    }

    const fn otherwise(mut self, otherwise: &'static str) -> Self {
        self.otherwise = otherwise;
        self
    }

    const fn law(mut self, law: &'static str) -> Self {
        self.law = law;
        self
    }

    /// Where alone it is allowed, and an example of that.
    const fn only(mut self, only: &'static str, beside: &'static [&'static str]) -> Self {
        self.only = only;
        self.beside = beside;
        self
    }
}

/// Every table of every file.
pub fn tables() -> impl Iterator<Item = &'static KeyTable> {
    experiment::TABLES.iter().chain(hardware::TABLES).chain(sweep::TABLES)
}

impl KeyTable {
    /// A key's name with its tables, as `--set` and messages have it.
    #[must_use]
    pub fn full(&self, name: &str) -> String {
        let prefix = if self.file == KeyFileKind::Hardware { "hw" } else { "" };
        let parts = [prefix, self.path, name].into_iter().filter(|part| !part.is_empty());
        parts.collect::<Vec<_>>().join(".")
    }

    /// Its keys, in the order of the file.
    pub fn keys(&'static self) -> impl Iterator<Item = KeyShown> {
        self.entries.iter().map(move |entry| {
            let meaning = self.meanings.iter().find(|(name, _)| *name == entry.name);
            KeyShown { table: self, entry, meaning: meaning.map_or("", |(_, text)| text.trim()) }
        })
    }
}

impl KeyShown {
    /// Its name with its tables.
    #[must_use]
    pub fn full(&self) -> String {
        self.table.full(self.entry.name)
    }
}

/// Keys whose name, meaning or words hold a word; all when it is empty. Capitals do not matter.
#[must_use]
pub fn matching(word: &str) -> Vec<KeyShown> {
    let word = word.to_lowercase();
    let holds = |text: &str| text.to_lowercase().contains(&word);
    let names: Vec<KeyShown> = tables().flat_map(KeyTable::keys).collect();
    let found: Vec<_> = names.iter().filter(|key| holds(&key.full())).copied().collect();
    if !found.is_empty() {
        return found;
    }
    let said = |key: &&KeyShown| {
        let words = match key.entry.values {
            KeyValues::Words(words) => words,
            _ => &[],
        };
        holds(key.meaning)
            || holds(key.entry.otherwise)
            || words.iter().any(|(word, meaning)| holds(word) || holds(meaning))
    };
    names.iter().filter(said).copied().collect()
}

/// Keys of `[energy]`, `[power]` and `[area]` with this word in them: name with units, what it is counted by, why its
/// interval.
#[must_use]
pub fn quantities(word: &str) -> Vec<(CostTable, String, String)> {
    let word = word.to_lowercase();
    let lines = QUANTITIES.iter().map(|quantity| {
        let table = quantity.table;
        let units: Vec<_> = table.units().iter().map(|(unit, _)| *unit).collect();
        let key = format!("{}_{{{}}}", quantity.name, units.join("|"));
        (table, key, quantity.about())
    });
    lines.filter(|(table, key, _)| format!("hw.{}.{key}", table.name()).contains(&word)).collect()
}

/// Full names of all keys that an experiment takes.
#[must_use]
pub fn experiment_keys() -> Vec<String> {
    let tables = tables().filter(|table| table.file != KeyFileKind::Sweep);
    tables.flat_map(|table| table.entries.iter().map(|entry| table.full(entry.name))).collect()
}
