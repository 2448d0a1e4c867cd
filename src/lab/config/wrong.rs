//! Words for what a reader of files refuses: the message of the TOML reader, and what may have been meant.

use super::ConfigError;
use super::keys;
use crate::lab::near;

/// An error of the TOML reader, with line and caret, in words of files and with a hint.
pub(super) fn text_error(place: &str, error: &toml::de::Error) -> ConfigError {
    let mut text = plain(&error.to_string());
    if let Some(hint) = hint(error.message()) {
        text = format!("{}\n{hint}", text.trim_end());
    }
    ConfigError::Text { place: place.into(), error: text }
}

/// A physical number as files have it.
const NUMBER: &str = "a physical number, which is a table with its bounds and its source, such as { low = 1.2, typical = 1.4, \
                      high = 2.0, source = \"where it is from\", kind = \"assumed\" }";

/// The same without names of Rust structures.
fn plain(text: &str) -> String {
    let mut text = text.replace("struct NumberFile", NUMBER);
    while let Some(at) = text.find("struct ") {
        let name = &text[at + "struct ".len()..];
        let end = name.find(|c: char| !c.is_ascii_alphanumeric()).unwrap_or(name.len());
        text.replace_range(at..at + "struct ".len() + end, "a table of keys");
    }
    text
}

/// What may have been meant by an unknown key.
fn hint(message: &str) -> Option<String> {
    let rest = message.strip_prefix("unknown field `")?;
    let (found, rest) = rest.split_once('`')?;
    let known: Vec<&str> = rest.split('`').skip(1).step_by(2).collect();
    let physical = rest.contains("with a unit");
    let stem =
        if physical { found.rsplit_once('_').map_or(found, |(stem, _)| stem) } else { found };
    if let Some(near) = near::nearest(stem, known.iter().copied()) {
        let unit = if physical { " with a unit at its end" } else { "" };
        return Some(format!("did you mean `{near}`{unit}?"));
    }
    // the key of another table
    let all = keys::experiment_keys();
    let last = |key: &str| key.rsplit('.').next().unwrap_or_default().to_owned();
    let same: Vec<_> = all.iter().filter(|key| last(key) == found).cloned().collect();
    match &same[..] {
        [] => {
            let names: Vec<String> = all.iter().map(|key| last(key)).collect();
            let near = near::nearest(found, names.iter().map(String::as_str))?;
            let at = names.iter().position(|name| name == near)?;
            Some(format!("did you mean `{}`? (`dalean keys {near}`)", all[at]))
        }
        some if some.len() <= 4 => Some(format!("there is `{}`", some.join("`, `"))),
        _ => Some(format!("see `dalean keys {found}`")),
    }
}
