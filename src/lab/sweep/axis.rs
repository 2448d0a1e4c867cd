//! One axis of a sweep: a list of values, or a range to draw from.

use std::path::Path;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::SweepError;
use crate::lab::config::sweep::{AxisFile, CaseFile, KeyFile, ScalarFile};
use crate::lab::config::{anchor, overlay, setting};

/// Most values of one axis.
const VALUES_MAX: usize = 100_000;

/// A value on an axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Value {
    /// A whole number.
    Whole(i64),
    /// A number.
    Real(f64),
    /// True or false.
    Flag(bool),
    /// A word.
    Text(String),
}

impl Value {
    /// As a configuration has it.
    fn to_toml(&self) -> toml::Value {
        match self {
            Self::Whole(value) => toml::Value::Integer(*value),
            Self::Real(value) => toml::Value::Float(*value),
            Self::Flag(value) => toml::Value::Boolean(*value),
            Self::Text(value) => toml::Value::String(value.clone()),
        }
    }

    /// As a number, if it is one.
    #[must_use]
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Whole(value) => Some(*value as f64),
            Self::Real(value) => Some(*value),
            Self::Flag(_) | Self::Text(_) => None,
        }
    }
}

impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Whole(value) => value.fmt(f),
            Self::Real(value) => value.fmt(f),
            Self::Flag(value) => value.fmt(f),
            Self::Text(value) => f.write_str(value),
        }
    }
}

impl From<ScalarFile> for Value {
    fn from(scalar: ScalarFile) -> Self {
        match scalar {
            ScalarFile::Whole(value) => Self::Whole(value),
            ScalarFile::Real(value) => Self::Real(value),
            ScalarFile::Flag(value) => Self::Flag(value),
            ScalarFile::Text(value) => Self::Text(value),
        }
    }
}

/// A value and the keys it sets.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// The value.
    pub value: Value,
    /// Keys of an experiment; points that have the value share them.
    pub keys: Arc<toml::Table>,
}

/// Where the values come from.
#[derive(Debug, Clone, PartialEq)]
enum Source {
    /// A list.
    List(Vec<Choice>),
    /// Any number between two.
    Range { keys: Vec<String>, from: f64, to: f64, whole: bool },
}

/// An axis, checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Name of its column.
    pub name: String,
    /// Words for people.
    pub label: String,
    /// Whether steps are ratios.
    pub log: bool,
    source: Source,
}

impl Axis {
    /// Makes paths that it sets, which are relative to `folder`, relative to where the program runs.
    pub(super) fn anchor(&mut self, folder: &Path) {
        if let Source::List(choices) = &mut self.source {
            choices.iter_mut().for_each(|choice| anchor(Arc::make_mut(&mut choice.keys), folder));
        }
    }

    /// Checks an axis. `sampled`: points are drawn, so a range needs no steps.
    pub(super) fn new(file: AxisFile, sampled: bool) -> Result<Self, SweepError> {
        let AxisFile { name, label, key, values, from, to, scale, steps, case } = file;
        let keys = key.map(|key| match key {
            KeyFile::One(key) => vec![key],
            KeyFile::All(keys) => keys,
        });
        let first = keys.as_ref().and_then(|keys| keys.first());
        let last = first.and_then(|key| key.rsplit('.').next()).map(str::to_owned);
        let name = name.or(last).unwrap_or_default();
        let wrong = |what: &str, allowed: &str| SweepError::axis(&name, what, allowed);
        let starts = name.starts_with(|c: char| c.is_ascii_lowercase());
        if !starts
            || !name.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'_')
        {
            return Err(wrong(
                "has a name that cannot be used",
                "give it a `name` of lower-case letters, digits and `_`",
            ));
        }
        let log = match scale.as_deref() {
            None | Some("linear") => false,
            Some("log") => true,
            Some(_) => return Err(wrong("has an unknown `scale`", "use linear or log")),
        };
        let source = match (keys, values, from.zip(to), case) {
            (Some(keys), Some(values), None, None) => {
                Source::List(values.into_iter().map(|value| choice(&keys, value.into())).collect())
            }
            (Some(keys), None, Some((from, to)), None) => {
                range(keys, &from.into(), &to.into(), log, steps, sampled)
                    .map_err(|(what, allowed)| wrong(what, allowed))?
            }
            (None, None, None, Some(cases)) => Source::List(
                cases.into_iter().map(|case| case_choice(&name, case)).collect::<Result<_, _>>()?,
            ),
            _ => {
                return Err(wrong(
                    "does not say what it varies",
                    "give it `key` and `values`, or `key`, `from` and `to`, or, without `key`, one or more [[axis.case]] that set keys",
                ));
            }
        };
        if let Source::List(list) = &source {
            if list.is_empty() || list.len() > VALUES_MAX {
                return Err(wrong("has no values, or too many", "give it 1 to 100000"));
            }
            // sorted, as a list may be long
            let mut words: Vec<_> = list.iter().map(|one| format!("{:?}", one.value)).collect();
            words.sort_unstable();
            if let Some(twice) = words.windows(2).find(|pair| pair[0] == pair[1]) {
                let one = list.iter().find(|one| format!("{:?}", one.value) == twice[0]);
                let value = one.map_or_else(String::new, |one| one.value.to_string());
                return Err(wrong(&format!("has the value {value} twice"), "give it once"));
            }
        }
        Ok(Self { label: label.unwrap_or_else(|| name.replace('_', " ")), name, log, source })
    }

    /// Values in order; empty for a range to draw from.
    #[must_use]
    pub fn list(&self) -> &[Choice] {
        match &self.source {
            Source::List(list) => list,
            Source::Range { .. } => &[],
        }
    }

    /// The keys it sets, with dots, each once.
    #[must_use]
    pub fn keys(&self) -> Vec<String> {
        let mut keys = match &self.source {
            Source::Range { keys, .. } => keys.clone(),
            Source::List(list) => {
                let mut keys = Vec::new();
                list.iter().for_each(|choice| leaves(&choice.keys, "", &mut keys));
                keys
            }
        };
        keys.sort();
        keys.dedup();
        keys
    }

    /// Whether all values are numbers.
    #[must_use]
    pub fn is_number(&self) -> bool {
        self.list().iter().all(|choice| choice.value.number().is_some())
    }

    /// The value at a part of the way, 0 to below 1, along the axis.
    #[must_use]
    pub fn at(&self, part: f64) -> Choice {
        match &self.source {
            Source::List(list) => {
                let at = ((part * list.len() as f64) as usize).min(list.len() - 1);
                list[at].clone()
            }
            Source::Range { keys, from, to, whole: true } => {
                // each whole number has an equal share of the way, bent when steps are ratios
                let value = bend(*from, *to + 1.0, self.log, part).floor().clamp(*from, *to);
                choice(keys, Value::Whole(value as i64))
            }
            Source::Range { keys, from, to, whole: false } => {
                choice(keys, Value::Real(round(bend(*from, *to, self.log, part))))
            }
        }
    }
}

/// Names of everything in a table that is no table, with dots.
fn leaves(table: &toml::Table, place: &str, into: &mut Vec<String>) {
    for (name, value) in table {
        let name = if place.is_empty() { name.clone() } else { format!("{place}.{name}") };
        match value {
            toml::Value::Table(inside) => leaves(inside, &name, into),
            _ => into.push(name),
        }
    }
}

fn choice(names: &[String], value: Value) -> Choice {
    let mut keys = toml::Table::new();
    names.iter().for_each(|name| overlay(&mut keys, setting(name, value.to_toml())));
    Choice { value, keys: Arc::new(keys) }
}

fn case_choice(axis: &str, case: CaseFile) -> Result<Choice, SweepError> {
    let Some(name) = case.name else {
        return Err(SweepError::axis(
            axis,
            "has a case without `name`",
            "give each [[axis.case]] a name",
        ));
    };
    let keys = super::table(&case.set.unwrap_or_default());
    Ok(Choice { value: name.into(), keys: Arc::new(keys) })
}

/// Between two numbers; `libm`, so that every machine draws the same.
fn bend(from: f64, to: f64, log: bool, part: f64) -> f64 {
    if log { from * libm::pow(to / from, part) } else { from + (to - from) * part }
}

/// Six digits: what a person would write.
fn round(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

fn range(
    keys: Vec<String>,
    from: &Value,
    to: &Value,
    log: bool,
    steps: Option<u32>,
    sampled: bool,
) -> Result<Source, (&'static str, &'static str)> {
    let whole = matches!((from, to), (Value::Whole(_), Value::Whole(_)));
    let (Some(from), Some(to)) = (from.number(), to.number()) else {
        return Err(("has a `from` or `to` that is no number", "use `values` for words"));
    };
    if !(from < to && from.is_finite() && to.is_finite() && to - from < 1e15) {
        return Err(("has an empty range", "`from` must lie below `to`"));
    }
    if log && from <= 0.0 {
        return Err((
            "has steps that are ratios from 0 or below",
            "start above 0, or use scale = \"linear\"",
        ));
    }
    let Some(steps) = steps else {
        return if sampled {
            Ok(Source::Range { keys, from, to, whole })
        } else if whole && !log {
            let values = (from as i64..=to as i64).take(VALUES_MAX + 1);
            Ok(Source::List(values.map(|value| choice(&keys, Value::Whole(value))).collect()))
        } else {
            Err(("has no `steps`", "say how many values a grid takes from `from` to `to`"))
        };
    };
    if steps < 2 || steps as usize > VALUES_MAX {
        return Err(("has a number of `steps` that cannot be used", "it must lie in 2..=100000"));
    }
    let mut list: Vec<Choice> = Vec::new();
    for step in 0..steps {
        let value = bend(from, to, log, f64::from(step) / f64::from(steps - 1));
        let value =
            if whole { Value::Whole(value.round() as i64) } else { Value::Real(round(value)) };
        if list.last().is_none_or(|last| last.value != value) {
            list.push(choice(&keys, value));
        }
    }
    Ok(Source::List(list))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(text: &str, sampled: bool) -> Result<Axis, String> {
        Axis::new(toml::from_str(text).unwrap(), sampled).map_err(|e| e.to_string())
    }

    fn values(axis: &Axis) -> String {
        axis.list().iter().map(|c| c.value.to_string()).collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn ranges_become_lists_in_a_grid() {
        for (text, wanted) in [
            ("key = 'a.b'\nvalues = [1, 2.5, 'x', true]", "1 2.5 x true"),
            ("key = 'a'\nfrom = 1\nto = 4", "1 2 3 4"),
            ("key = 'a'\nfrom = 1.0\nto = 100.0\nsteps = 3\nscale = 'log'", "1 10 100"),
            ("key = 'a'\nfrom = 1\nto = 9\nsteps = 4\nscale = 'log'", "1 2 4 9"),
            ("key = 'a'\nfrom = 0\nto = 1\nsteps = 2", "0 1"),
        ] {
            assert_eq!(values(&axis(text, false).unwrap()), wanted, "{text}");
        }
        let one = axis("key = 'hw.cell.level_bits'\nvalues = [3]", false).unwrap();
        assert_eq!((one.name.as_str(), one.label.as_str()), ("level_bits", "level bits"));
        assert_eq!(toml::to_string(&*one.list()[0].keys).unwrap(), "[hw.cell]\nlevel_bits = 3\n");
        let two = axis("key = ['a.b', 'a.c']\nvalues = [3]", false).unwrap();
        assert_eq!(toml::to_string(&*two.list()[0].keys).unwrap(), "[a]\nb = 3\nc = 3\n");
    }

    #[test]
    fn drawing_reaches_both_ends_and_never_leaves() {
        let whole = axis("key = 'a'\nfrom = 1\nto = 4", true).unwrap();
        let draw = |part| whole.at(part).value;
        assert_eq!([0.0, 0.249, 0.25, 0.999_999].map(draw), [1, 1, 2, 4].map(Value::Whole));
        let real = axis("key = 'a'\nfrom = 0.5\nto = 32\nscale = 'log'", true).unwrap();
        assert_eq!(
            [0.0, 0.5, 1.0].map(|part| real.at(part).value),
            [0.5, 4.0, 32.0].map(Value::Real)
        );
        assert!(real.is_number());
    }

    #[test]
    fn cases_set_several_keys() {
        let text = "name = 'rule'\n[[case]]\nname = 'ed'\nset = { learning.rule = 'ed', learning.rate = 4.0 }\n\
                    [[case]]\nname = 'bp'";
        let rule = axis(text, false).unwrap();
        assert_eq!((values(&rule).as_str(), rule.is_number()), ("ed bp", false));
        assert_eq!(
            toml::to_string(&*rule.list()[0].keys).unwrap(),
            "[learning]\nrate = 4.0\nrule = \"ed\"\n"
        );
    }

    #[test]
    fn mistakes_name_the_axis_and_what_to_do() {
        for (text, wanted) in [
            ("key = 'a'", "`key` and `values`"),
            ("values = [1]", "lower-case"),
            ("name = 'x'\nvalues = [1]", "axis `x` does not say what it varies"),
            ("key = 'a'\nvalues = []", "1 to 100000"),
            ("key = 'a'\nvalues = [1, 1]", "twice"),
            ("key = 'a'\nfrom = 1.0\nto = 2.0", "steps"),
            ("key = 'a'\nfrom = 3\nto = 2", "below `to`"),
            ("key = 'a'\nfrom = 0\nto = 2\nscale = 'log'", "above 0"),
            ("key = 'a'\nfrom = 'x'\nto = 2", "words"),
            ("key = 'a-b'\nvalues = [1]", "give it a `name`"),
            ("key = []\nvalues = [1]", "give it a `name`"),
        ] {
            let error = axis(text, false).unwrap_err();
            assert!(error.contains(wanted), "{text}: {error}");
        }
    }
}
