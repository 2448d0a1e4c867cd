//! What a configuration says that saying nothing would not, and the name that a run gets of it.
//!
//! A configuration is compared with the one of the same data or environment, rule and chip that says nothing else. A name is
//!
//! ```text
//! DATA-RULE[-CHIP][-DIFFERENCES]-seedN        optdigits-ed-reram-level-bits4-hidden64-seed2
//! ```
//!
//! lower-case letters, digits, `-` and `.`, at most 96 of them: what does not fit is counted and hashed, so that other
//! differences make another name.

use super::changed::UnderModel;
use super::defaults::FOLLOWING;
use super::file::ExperimentFile;
use super::hardware::{is_builtin, model_file, model_text};
use super::{Config, check, keys, layers};

/// Longest part of a name that says differences.
const DIFFERENCES_MAX: usize = 56;
/// Most differences in a heading.
const SHOWN_MAX: usize = 6;
/// Longest name of data or of a chip in a name.
const WORD_MAX: usize = 20;

/// Keys that say what numbers are of and not what a chip does.
const PROSE: [&str; 8] =
    ["source", "kind", "summary", "not_simulated", "node_nm", "constants_for", "at", "modes"];

/// Keys that stand in every name and heading, or say nothing.
const SAID: [&str; 4] = ["seed", "hw.name", "task", "environment.id"];

/// A key whose value is another than by saying nothing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Difference {
    /// The key in full.
    pub key: String,
    /// Its value, as TOML.
    pub value: String,
    /// What it is by saying nothing, as TOML; nothing when it is then absent.
    pub default: Option<String>,
}

/// Keys and values of a table, as TOML, without prose.
fn flatten(prefix: &str, table: &toml::Table, into: &mut Vec<(String, String)>) {
    for (key, value) in table {
        let full = if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") };
        match value {
            _ if PROSE.contains(&&**key) => {}
            toml::Value::Table(table) => flatten(&full, table, into),
            value => into.push((full, value.to_string())),
        }
    }
}

/// Keys and values of a resolved configuration, as TOML, without prose.
///
/// # Panics
/// Never: every key has a TOML form.
#[must_use]
pub fn flat(config: &Config) -> Vec<(String, String)> {
    lines_of(&config.resolved)
}

fn lines_of(file: &ExperimentFile) -> Vec<(String, String)> {
    let mut lines = vec![];
    let table = toml::Table::try_from(file).expect("every key has a TOML form");
    flatten("", &table, &mut lines);
    lines
}

/// The default that a key has where its table is there.
fn own_default(key: &str) -> Option<&'static str> {
    let shown = keys::matching(key).into_iter().find(|shown| shown.full() == key)?;
    Some(shown.entry.default).filter(|default| !default.is_empty())
}

impl Config {
    /// What a user gets by saying nothing but data or environment, rule and chip.
    fn silent(&self) -> Option<ExperimentFile> {
        let resolved = toml::Table::try_from(&self.resolved).ok()?;
        let mut table = toml::Table::new();
        for said in ["data", "task"] {
            table.extend(resolved.get(said).map(|value| (said.to_owned(), value.clone())));
        }
        if let Some(policy) = &self.policy {
            let id = toml::Value::String(policy.environment.id.to_string());
            layers::overlay(&mut table, layers::setting("environment.id", id));
        }
        let rule = toml::Value::String(self.rule_name().to_owned());
        layers::overlay(&mut table, layers::setting("learning.rule", rule));
        let hw = match &self.model {
            Some(model) => model.clone(),
            None if is_builtin(self.model_name()) => {
                let text = model_text(self.model_name()).ok()?;
                model_file(self.model_name(), &text).ok()?;
                toml::from_str(&text).ok()?
            }
            // a model of somebody's own, long after: nobody knows what was laid over it
            None => resolved.get("hw")?.as_table()?.clone(),
        };
        table.insert("hw".into(), toml::Value::Table(hw));
        check::config(table.try_into().ok()?, &UnderModel::default())
            .ok()
            .map(|config| config.resolved)
    }

    /// What a key is by saying everything else: its default follows from that.
    fn following(&self, key: &str) -> Option<String> {
        let mut table = toml::Table::try_from(&self.resolved).ok()?;
        let (head, name) = key.split_once('.')?;
        table.get_mut(head)?.as_table_mut()?.remove(name)?;
        let config = check::config(table.try_into().ok()?, &UnderModel::default()).ok()?;
        let mut lines = lines_of(&config.resolved).into_iter();
        lines.find(|(found, _)| found == key).map(|(_, value)| value)
    }

    /// Keys whose value is another than by saying nothing but data, rule and chip; the seed aside.
    #[must_use]
    pub(crate) fn differences(&self) -> Vec<Difference> {
        let mut silent = self.silent().map(|file| lines_of(&file)).unwrap_or_default();
        for key in FOLLOWING {
            if let Some(value) = self.following(key) {
                silent.retain(|(name, _)| name != key);
                silent.push((key.to_owned(), value));
            }
        }
        let all = lines_of(&self.resolved).into_iter();
        let others = all.filter(|(key, _)| !SAID.contains(&&**key) && !key.starts_with("data."));
        let differ = others.filter_map(|(key, value)| {
            let default = silent.iter().find(|(name, _)| *name == key).map(|(_, text)| text);
            // a table that saying nothing does not have brings its own defaults
            let same = match default {
                Some(default) => same(&value, default),
                None => own_default(&key).is_some_and(|default| same(&value, default)),
            };
            (!same).then(|| Difference { key, value, default: default.cloned() })
        });
        differ.collect()
    }

    /// Name of the folder of its runs: says data, rule, what differs from saying nothing, and the seed.
    #[must_use]
    pub(crate) fn run_name(&self) -> String {
        let mut parts = vec![clean(&self.data_name(), WORD_MAX), clean(self.rule_name(), WORD_MAX)];
        if self.model_name() != "ideal" {
            parts.push(clean(self.model_name(), WORD_MAX));
        }
        let words: Vec<String> = self.differences().iter().map(Difference::word).collect();
        let mut length = 0;
        let fits = |word: &&String| {
            length += word.len() + 1;
            length <= DIFFERENCES_MAX
        };
        let shown = words.iter().take_while(fits).count();
        parts.extend(words.iter().take(shown).cloned());
        if shown < words.len() {
            let hash = blake3::hash(words.join(" ").as_bytes()).to_hex();
            parts.push(format!("{}more-{}", words.len() - shown, &hash[..6]));
        }
        parts.push(format!("seed{}", self.seed));
        parts.retain(|part| !part.is_empty());
        parts.join("-")
    }

    /// What differs from saying nothing, for headings: `level_bits 4, rate 5, seed 2`; empty when nothing does.
    #[must_use]
    pub(crate) fn differences_text(&self) -> String {
        let differences = self.differences();
        let mut words: Vec<String> = differences.iter().map(Difference::text).collect();
        let more = words.len().saturating_sub(SHOWN_MAX);
        words.truncate(SHOWN_MAX);
        if more > 0 {
            words.push(format!("{more} more"));
        }
        if self.seed != 1 {
            words.push(format!("seed {}", self.seed));
        }
        words.join(", ")
    }
}

/// Whether two values say the same: a list with one number a layer may hold the default everywhere.
fn same(value: &str, default: &str) -> bool {
    let each = value.strip_prefix('[').and_then(|list| list.strip_suffix(']'));
    value == default
        || each.is_some_and(|list| !list.is_empty() && list.split(',').all(|n| n.trim() == default))
}

impl Difference {
    /// The key without what everybody knows: its last part, and the part before where that is needed.
    fn key_short(&self) -> String {
        let mut parts = self.key.rsplit('.');
        let last = parts.next().unwrap_or_default();
        let ends = |key: &String| key.rsplit('.').next() == Some(last);
        match (keys::experiment_keys().iter().filter(|key| ends(key)).count(), parts.next()) {
            (1, _) | (_, None) => last.to_owned(),
            (_, Some(before)) => format!("{before}.{last}"),
        }
    }

    /// `level-bits4`, `hidden64x32`, `overlap`, `no-overlap`.
    fn word(&self) -> String {
        let key = clean(&self.key_short().replace('.', "-"), usize::MAX);
        match &*self.value {
            "true" => key,
            "false" => format!("no-{key}"),
            value => {
                let value = clean(&value.replace(", ", "x"), WORD_MAX);
                let letter = value.starts_with(|c: char| c.is_ascii_alphabetic());
                format!("{key}{}{value}", if letter { "-" } else { "" })
            }
        }
    }

    /// `level_bits 4`.
    #[must_use]
    pub fn text(&self) -> String {
        format!("{} {}", self.key_short(), self.value.replace('"', ""))
    }
}

/// A word of a file's name: lower-case letters, digits, `-` and `.`, not at its ends.
fn clean(word: &str, most: usize) -> String {
    let good = |c: char| match c.to_ascii_lowercase() {
        c if c.is_ascii_alphanumeric() || c == '.' => c,
        _ => '-',
    };
    let mut text = String::new();
    for c in word.chars().map(good).take(most) {
        if !(c == '-' && text.ends_with('-')) {
            text.push(c);
        }
    }
    text.trim_matches(['-', '.']).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::config::{Sources, load};

    fn config(settings: &[&str]) -> Config {
        let settings: Vec<String> = settings.iter().map(ToString::to_string).collect();
        load(&Sources { settings: &settings, ..Sources::default() }).unwrap()
    }

    #[test]
    fn a_name_says_what_differs_from_saying_nothing() {
        for (settings, name) in [
            (&[][..], "optdigits-ed-seed1"),
            (&["seed=7"], "optdigits-ed-seed7"),
            (&["hw.cell.level_bits=4"], "optdigits-ed-level-bits4-seed1"),
            (&["hw.model=reram"], "optdigits-ed-reram-seed1"),
            (&["hw.model=reram", "hw.cell.level_bits=7"], "optdigits-ed-reram-seed1"),
            (&["hw.model=reram", "hw.adc.bits=4"], "optdigits-ed-reram-adc-bits4-seed1"),
            (&["hw.adc.bits=4"], "optdigits-ed-adc-bits4-seed1"),
            (&["network.hidden=[64, 32]"], "optdigits-ed-hidden64x32-seed1"),
            (&["network.hidden=[1024]"], "optdigits-ed-hidden1024-seed1"),
            (&["learning.batch=1"], "optdigits-ed-batch1-seed1"),
            (&["learning.mode=online"], "optdigits-ed-learning-mode-online-seed1"),
            (&["learning.batch=8", "learning.rate=18"], "optdigits-ed-batch8-rate18.0-seed1"),
            (&["network.alpha=[4, 4]"], "optdigits-ed-seed1"),
            (&["learning.rule=dfa"], "optdigits-dfa-seed1"),
            (&["learning.rule=kaneko", "data.set=xor"], "xor-kaneko-seed1"),
            (&["learning.rate=0.5"], "optdigits-ed-rate0.5-seed1"),
            (&["learning.decay=constant"], "optdigits-ed-decay-constant-seed1"),
            (&["hw.tile.transposed_read=false"], "optdigits-ed-no-transposed-read-seed1"),
            (&["task=policy"], "cartpole-v1-ed-seed1"),
            (&["task=policy", "environment.id=Acrobot-v1"], "acrobot-v1-ed-seed1"),
            (&["task=policy", "environment.steps=100000"], "cartpole-v1-ed-steps100000-seed1"),
            (&["task=policy", "network.hidden=[32]"], "cartpole-v1-ed-hidden32-seed1"),
            (&["task=policy", "learning.rule=es"], "cartpole-v1-es-seed1"),
        ] {
            assert_eq!(config(settings).run_name(), name, "{settings:?}");
        }
    }

    #[test]
    fn a_long_name_is_bounded_and_still_its_own() {
        let many = |rate: &str| {
            let rate = format!("learning.rate={rate}");
            config(&[
                "network.hidden=[1000,1000,1000]",
                "hw.cell.level_bits=4",
                "hw.cell.floor=1",
                "hw.write.increment_max=5",
                "hw.write.residual_bits=4",
                "network.weight_max=8",
                "learning.epochs=3",
                &rate,
            ])
            .run_name()
        };
        let (one, two) = (many("1.5"), many("2.5"));
        assert!(one.len() <= 96 && one.contains("more-"), "{one}");
        assert_ne!(one, two);
        let good = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || "-.".contains(c);
        assert!(one.chars().all(good), "{one}");
    }

    #[test]
    fn the_name_of_a_resolved_configuration_is_that_of_the_one_it_came_from() {
        let first = config(&["hw.model=reram", "hw.adc.bits=4", "learning.rate=9", "seed=3"]);
        let text = first.to_toml();
        let again =
            load(&Sources { experiment: Some(("resolved", &text)), ..Sources::default() }).unwrap();
        assert_eq!(again.run_name(), first.run_name());
        assert_eq!(first.differences_text(), "adc.bits 4, rate 9.0, seed 3");
    }
}
