//! Words that completions offer for an argument that takes others too: a chip is a name or a file.

use std::ffi::OsStr;

use clap::builder::{PossibleValue, StringValueParser, TypedValueParser};

use crate::chip::crossbar::kernel::Backend;
use crate::lab::config::keys::{self, KeyValues};
use crate::lab::config::model_names;
use crate::lab::data::CATALOG;

/// Takes any text, and offers some.
#[derive(Debug, Clone)]
pub(super) struct Known(fn() -> Vec<&'static str>);

impl TypedValueParser for Known {
    type Value = String;

    fn parse_ref(
        &self,
        command: &clap::Command,
        argument: Option<&clap::Arg>,
        value: &OsStr,
    ) -> Result<String, clap::Error> {
        StringValueParser::new().parse_ref(command, argument, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new((self.0)().into_iter().map(PossibleValue::new)))
    }
}

/// Built-in hardware models.
pub(super) fn models() -> Known {
    Known(model_names)
}

/// Kernels of all machines.
pub(super) fn kernels() -> Known {
    Known(|| Backend::NAMES.to_vec())
}

/// Sets that are fetched.
pub(super) fn sets() -> Known {
    Known(|| {
        let fetched = |word: &str| CATALOG.iter().any(|entry| entry.set.to_string() == word);
        let key = keys::matching("data.set").into_iter().find(|key| key.entry.name == "set");
        match key.map(|key| key.entry.values) {
            Some(KeyValues::Words(words)) => {
                words.iter().map(|(word, _)| *word).filter(|word| fetched(word)).collect()
            }
            _ => vec![],
        }
    })
}

/// Origins of sets; a folder too.
pub(super) fn origins() -> Known {
    Known(|| vec!["any", "mirror", "npm", "debian"])
}

/// Names of keys; other words too.
pub(super) fn key_names() -> Known {
    Known(|| {
        let mut names: Vec<_> = keys::matching("").iter().map(|key| key.entry.name).collect();
        names.sort_unstable();
        names.dedup();
        names
    })
}
