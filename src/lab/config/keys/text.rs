//! Keys for people and programs: the terminal, docs/CONFIG.md, JSON.

use serde_json::{Value, json};

use super::{KeyEntry, KeyFileKind, KeyShown, KeyTable, KeyValues, quantities, tables};

impl KeyFileKind {
    const fn name(self) -> &'static str {
        match self {
            Self::Experiment => "experiment",
            Self::Hardware => "hardware",
            Self::Sweep => "sweep",
        }
    }

    const fn about(self) -> &'static str {
        match self {
            Self::Experiment => {
                "What `dalean train FILE` reads. Every key can be given by `--set TABLE.KEY=VALUE` too, and taken back by \
                 `--set TABLE.KEY=default`."
            }
            Self::Hardware => {
                "What `dalean train --hw FILE` reads; in an experiment file the same tables stand below `[hw]`, and \
                 `--set hw.TABLE.KEY=VALUE` changes one. A default here is that of a model that is silent; in an \
                 experiment it is the model's own number (`dalean hw show MODEL`)."
            }
            Self::Sweep => "What `dalean sweep FILE` reads.",
        }
    }
}

impl KeyEntry {
    /// What it takes, in words.
    #[must_use]
    pub fn takes(&self) -> String {
        let unit = if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) };
        let mut text = match self.values {
            KeyValues::Whole(least, i64::MAX) => format!("a whole number, {least} or more{unit}"),
            KeyValues::Whole(least, most) => format!("a whole number, {least}..={most}{unit}"),
            KeyValues::Choice(list) => {
                let list: Vec<_> = list.iter().map(ToString::to_string).collect();
                format!("{}{unit}", list.join(", "))
            }
            KeyValues::PowerOfTwo(least, most) => {
                format!("a power of two, {least}..={most}{unit}")
            }
            KeyValues::Real(least, most) => format!("a number, {least}..={most}{unit}"),
            KeyValues::Lawful(least, most, law) => format!("{law}, {least}..={most}{unit}"),
            KeyValues::Words(words) => {
                let words: Vec<_> = words.iter().map(|(word, _)| format!("\"{word}\"")).collect();
                words.join(", ")
            }
            KeyValues::Flag => "true or false".into(),
            KeyValues::Other(what) => format!("{what}{unit}"),
        };
        if self.windows {
            text += "; or a list, one a convolution";
        }
        if self.layers {
            text += "; or a list, one a layer";
        }
        if !self.law.is_empty() {
            text += &format!(" ({})", self.law);
        }
        text
    }

    /// Its default, in words; empty when it has none and nothing follows.
    #[must_use]
    pub fn default_text(&self) -> String {
        match (self.default, self.otherwise) {
            (default, "") => default.into(),
            ("", otherwise) => format!("- ({otherwise})"),
            (default, otherwise) => format!("{default} ({otherwise})"),
        }
    }
}

/// One key as a JSON object.
#[must_use]
pub fn key_json(key: &KeyShown) -> Value {
    let KeyShown { table, entry, meaning } = key;
    let values = match entry.values {
        KeyValues::Whole(least, most) => json!({"type": "integer", "least": least, "most": most}),
        KeyValues::Choice(list) => json!({"type": "integer", "of": list}),
        KeyValues::PowerOfTwo(least, most) => {
            json!({"type": "integer", "least": least, "most": most, "law": "a power of two"})
        }
        KeyValues::Real(least, most) => json!({"type": "number", "least": least, "most": most}),
        KeyValues::Lawful(least, most, law) => {
            json!({"type": "number", "least": least, "most": most, "law": law})
        }
        KeyValues::Words(words) => {
            let of: Vec<_> = words.iter().map(|(word, _)| word).collect();
            let meanings: Vec<_> = words.iter().map(|(_, meaning)| meaning).collect();
            json!({"type": "string", "of": of, "meanings": meanings})
        }
        KeyValues::Flag => json!({"type": "boolean"}),
        KeyValues::Other(what) => json!({"type": "other", "words": what}),
    };
    let default: Option<Value> = toml::from_str::<toml::Table>(&format!("x = {}", entry.default))
        .ok()
        .and_then(|table| serde_json::to_value(&table["x"]).ok());
    json!({"event": "key", "key": key.full(), "file": table.file.name(), "values": values,
        "layers": entry.layers, "windows": entry.windows, "unit": entry.unit, "law": entry.law, "default": default,
        "otherwise": entry.otherwise, "only": entry.only, "meaning": meaning})
}

/// Keys for a terminal: whole, or a line each when `short`.
#[must_use]
pub fn terminal(keys: &[KeyShown], word: &str, short: bool) -> String {
    let mut text = String::new();
    let mut at: Option<(KeyFileKind, &str)> = None;
    for key in keys {
        let place = (key.table.file, key.table.path);
        if short && at != Some(place) {
            let file = key.table.file.name();
            text += &format!("\n{file} file, {}: {}\n", heading(key.table), key.table.about);
        }
        at = Some(place);
        text += &if short { line(key) } else { whole(key) };
    }
    for (table, name, about) in quantities(word) {
        if short && at.is_none_or(|(_, path)| path != table.name()) {
            text += &format!("\nhardware file, [{}]: physical numbers\n", table.name());
            at = Some((KeyFileKind::Hardware, table.name()));
        }
        text += &format!("hw.{}.{name}\n", table.name());
        if !short {
            text += &format!("    {about}\n    takes    {NUMBER}\n\n");
        }
    }
    text.trim().to_owned()
}

/// The form of a physical number.
const NUMBER: &str =
    "{ low = 1, typical = 2, high = 3, source = \"where it is from\", kind = \"assumed\" }";

fn line(key: &KeyShown) -> String {
    let takes = key.entry.takes();
    let default = match (key.entry.default, key.entry.otherwise) {
        ("", "") => String::new(),
        ("", otherwise) => format!("; without it: {otherwise}"),
        (default, "") => format!("; default {default}"),
        (default, otherwise) => format!("; default {default} ({otherwise})"),
    };
    format!("  {:28} {takes}{default}\n", key.full())
}

fn whole(key: &KeyShown) -> String {
    let KeyShown { entry, meaning, .. } = key;
    let place = match key.table.file {
        KeyFileKind::Sweep => "  (sweep file)",
        _ => "",
    };
    let mut text =
        format!("{}{place}\n    {meaning}\n    takes    {}\n", key.full(), entry.takes());
    if let KeyValues::Words(words) = entry.values {
        for (word, meaning) in words {
            text += &format!("             {word:16} {meaning}\n");
        }
    }
    let default = entry.default_text();
    for (what, value) in [("default", &*default), ("allowed", entry.only)] {
        if !value.is_empty() {
            text += &format!("    {what}  {value}\n");
        }
    }
    text + "\n"
}

fn heading(table: &KeyTable) -> String {
    match (table.path, table.file) {
        ("", _) => "top".into(),
        ("axis", _) => "[[axis]]".into(),
        ("axis.case", _) => "[[axis.case]]".into(),
        (path, _) => format!("[{path}]"),
    }
}

/// docs/CONFIG.md.
#[must_use]
pub fn markdown() -> String {
    let mut text = String::from(
        "# Configuration: every key\n\n\
         Made by `dalean keys --markdown` (renew it with `UPDATE_EXPECT=1 cargo test --test it keys`); `dalean keys WORD` \
         shows the same in a terminal. A key that is not here, or has no effect where it stands, is an error.\n",
    );
    for file in [KeyFileKind::Experiment, KeyFileKind::Hardware, KeyFileKind::Sweep] {
        let name = file.name();
        text += &format!("\n## The {name} file\n\n{}\n", file.about());
        for table in tables().filter(|table| table.file == file) {
            text += &format!("\n### {name}: `{}`\n\n{}\n\n", heading(table), table.about);
            text += "| key | takes | default | meaning |\n|---|---|---|---|\n";
            for key in table.keys() {
                text += &row(&key);
            }
        }
        if file == KeyFileKind::Hardware {
            text += &format!(
                "\n### {name}: `[energy]`, `[power]`, `[area]`\n\nEach a physical number, `{NUMBER}`. Braces hold the \
                 units of a key: one of them is written, such as `conversion_pj`.\n\n| table | key | meaning |\n|---|---|---|\n"
            );
            for (table, key, about) in quantities("") {
                text += &format!("| `{}` | `{}` | {about} |\n", table.name(), cell(&key));
            }
        }
    }
    text
}

fn row(key: &KeyShown) -> String {
    let KeyShown { entry, meaning, .. } = key;
    let mut meaning = String::from(*meaning);
    if let KeyValues::Words(words) = entry.values {
        for (word, what) in words {
            meaning += &format!("<br>`{word}`: {what}");
        }
    }
    if !entry.only.is_empty() {
        meaning += &format!("<br>Only {}.", entry.only);
    }
    let default = match (entry.default, entry.otherwise) {
        ("", "") => String::new(),
        (default, "") => format!("`{default}`"),
        ("", otherwise) => otherwise.into(),
        (default, otherwise) => format!("`{default}`; {otherwise}"),
    };
    format!(
        "| `{}` | {} | {} | {} |\n",
        entry.name,
        cell(&entry.takes()),
        cell(&default),
        cell(&meaning)
    )
}

/// Text inside a table of Markdown.
fn cell(text: &str) -> String {
    text.replace('|', "\\|")
}

/// The quantities with this word in their key, as JSON objects.
#[must_use]
pub fn quantities_json(word: &str) -> Vec<Value> {
    let lines = quantities(word).into_iter().map(|(table, key, about)| {
        json!({"event": "key", "key": format!("hw.{}.{key}", table.name()), "file": "hardware",
            "values": {"type": "other", "words": NUMBER}, "meaning": about})
    });
    lines.collect()
}
