//! `[data]` as a source of examples, and what was told from files as keys of `[data]`.

use std::path::{Component, Path, PathBuf};

use super::check::wrong;
use super::file::{ColumnFile, DataFile};
use super::{Config, ConfigError};
use crate::lab::data::csv::{self, Reading};
use crate::lab::data::{
    self, Data, DataError, DataRoot, FileSet, ImageShape, PartFile, Source, Told,
};

const MISSING: &str = "is missing";
const ANY: &[&str] = &["idx", "npz", "csv"];
const ARRAYS: &[&str] = &["npz"];
const WITH_LABEL_FILES: &[&str] = &["idx", "npz"];
const TABLES: &[&str] = &["csv"];

/// A part: its name, file, label file, array and label array.
type PartKeys<'a> = (&'static str, [&'a Option<String>; 4]);

fn parts(data: &DataFile) -> [PartKeys<'_>; 3] {
    let DataFile { train, train_labels, train_array, train_labels_array, .. } = data;
    let DataFile { validation, validation_labels, validation_array, .. } = data;
    let DataFile { validation_labels_array, test, test_labels, .. } = data;
    let DataFile { test_array, test_labels_array, .. } = data;
    [
        ("train", [train, train_labels, train_array, train_labels_array]),
        ("validation", [validation, validation_labels, validation_array, validation_labels_array]),
        ("test", [test, test_labels, test_array, test_labels_array]),
    ]
}

/// Every key of `[data]` beside `set` and `format`: whether it is given, and with which formats it means something.
fn keys(data: &DataFile) -> Vec<(String, bool, &'static [&'static str])> {
    let mut keys = Vec::new();
    for (part, [file, labels, array, labels_array]) in parts(data) {
        keys.push((part.to_owned(), file.is_some(), ANY));
        keys.push((format!("{part}_labels"), labels.is_some(), WITH_LABEL_FILES));
        keys.push((format!("{part}_array"), array.is_some(), ARRAYS));
        keys.push((format!("{part}_labels_array"), labels_array.is_some(), ARRAYS));
    }
    let others = [
        ("full_scale", data.full_scale.is_some(), ANY),
        ("classes", data.classes.is_some(), ANY),
        ("shape", data.shape.is_some(), ANY),
        ("label_column", data.label_column.is_some(), TABLES),
        ("ignore_columns", data.ignore_columns.is_some(), TABLES),
        ("header", data.header.is_some(), TABLES),
        ("separator", data.separator.is_some(), TABLES),
        ("examples_array", data.examples_array.is_some(), ARRAYS),
        ("labels_array", data.labels_array.is_some(), ARRAYS),
    ];
    keys.extend(others.map(|(key, given, formats)| (key.to_owned(), given, formats)));
    keys
}

/// What a file's name says of its format.
fn format_of(path: &str) -> Option<&'static str> {
    let lower = path.to_ascii_lowercase();
    let plain = lower.strip_suffix(".gz").unwrap_or(&lower);
    let ends = |ends: &[&str]| ends.iter().any(|end| plain.ends_with(end));
    if ends(&[".csv", ".tsv", ".txt"]) {
        Some("csv")
    } else if ends(&[".npz", ".npy"]) {
        Some("npz")
    } else {
        ends(&["-ubyte", ".idx", ".idx1", ".idx3"]).then_some("idx")
    }
}

/// Checks that every key of `[data]` means something there, and writes defaults back.
pub(super) fn resolve(data: &mut DataFile) -> Result<DataFile, ConfigError> {
    if data.set.is_none() && data.format.is_none() {
        data.set = Some("optdigits".into());
    }
    let format = data.format.as_deref();
    if format.is_some_and(|format| !ANY.contains(&format)) {
        let found = format!("is \"{}\"", format.unwrap_or_default());
        return Err(wrong("data.format", found, "it is idx, npz or csv"));
    }
    for (key, given, formats) in keys(data) {
        if given && !format.is_some_and(|format| formats.contains(&format)) {
            let known = data.train.as_deref().and_then(format_of).filter(|_| key == "train");
            let (found, allowed) = match (format, known) {
                (Some(format), _) => (
                    format!("is given beside data.format = \"{format}\""),
                    format!(
                        "it belongs to files of the format {}; take it out",
                        formats.join(", ")
                    ),
                ),
                (None, Some(known)) => (
                    "is given without data.format".into(),
                    format!("by its name the file wants data.format = \"{known}\""),
                ),
                (None, None) => (
                    "is given without data.format".into(),
                    format!(
                        "it belongs to files of the format {}; take it out, or say data.format",
                        formats.join(", ")
                    ),
                ),
            };
            return Err(wrong(&format!("data.{key}"), found, allowed));
        }
    }
    if data.format.is_some() {
        if data.set.is_some() {
            let allowed = "name a set or files, not both";
            return Err(wrong("data.format", "is given beside data.set", allowed));
        }
        match own(data) {
            // what is missing is told when it is needed
            Err(ConfigError::Value { found, .. }) if found == MISSING => {}
            files => drop(files?),
        }
    }
    Ok(data.clone())
}

/// The files of `[data]`, whose format is a known one.
fn own(data: &DataFile) -> Result<FileSet, ConfigError> {
    let format = data.format.as_deref().unwrap_or_default();
    let missing = |key: &str, why: &str| Err(wrong(&format!("data.{key}"), MISSING, why));
    if data.full_scale == Some(0) {
        let allowed = "allowed are 1 to 255; leave it out to take the greatest value";
        return Err(wrong("data.full_scale", "is 0", allowed));
    }
    if let Some(found) = data.classes.filter(|n| !(2..=256).contains(n)) {
        let allowed = "allowed are 2 to 256; leave it out to count the labels";
        return Err(wrong("data.classes", format!("is {found}"), allowed));
    }
    let Some(train) = &data.train else {
        return missing("train", "give the file of training examples");
    };
    let mut found = [None, None, None];
    for (place, (part, [file, labels, array, labels_array])) in parts(data).into_iter().enumerate()
    {
        // the arrays of a part lie in the training file, unless another is named
        let file = match (file, array) {
            (None, Some(_)) => Some(train),
            (file, _) => file.as_ref(),
        };
        let Some(path) = file else {
            for (key, given) in [("labels", labels), ("labels_array", labels_array)] {
                if given.is_some() {
                    let key = format!("data.{part}_{key}");
                    let beside = if format == "npz" {
                        format!(" or data.{part}_array")
                    } else {
                        String::new()
                    };
                    let allowed = format!("give data.{part}{beside} too, or take it out");
                    return Err(wrong(&key, format!("is given without data.{part}"), allowed));
                }
            }
            continue;
        };
        let path = PathBuf::from(path);
        found[place] = Some(match format {
            "idx" => {
                let Some(labels) = labels else {
                    let why = "IDX keeps labels in a file of their own";
                    return missing(&format!("{part}_labels"), why);
                };
                PartFile::Idx { values: path, labels: labels.into() }
            }
            "npz" => PartFile::Npz {
                path,
                labels_path: labels.as_ref().map(PathBuf::from),
                values: array.clone().or_else(|| data.examples_array.clone()),
                labels: labels_array.clone().or_else(|| data.labels_array.clone()),
            },
            _ => PartFile::Csv { path, reading: reading(data)? },
        });
    }
    for (key, shared, own) in [
        ("examples_array", &data.examples_array, parts(data).map(|(_, keys)| keys[2])),
        ("labels_array", &data.labels_array, parts(data).map(|(_, keys)| keys[3])),
    ] {
        let taken = found.iter().zip(own).all(|(part, own)| part.is_none() || own.is_some());
        if shared.is_some() && taken {
            let allowed = "every part has an array of its own; take it out";
            return Err(wrong(&format!("data.{key}"), "has no effect", allowed));
        }
    }
    let [train, validation, test] = found;
    let train = train.expect("its file is given");
    let (full_scale, classes) = (data.full_scale, data.classes);
    let image = data.shape.map(|[height, width, channels]| ImageShape { height, width, channels });
    Ok(FileSet { train, validation, test, full_scale, classes, image })
}

/// What is stated of tables.
fn reading(data: &DataFile) -> Result<Reading, ConfigError> {
    let separator = match &data.separator {
        None => None,
        Some(key) => Some(csv::separator_of(key).ok_or_else(|| {
            let allowed = "it is \",\", \";\", \"tab\" or \"|\"";
            wrong("data.separator", format!("is {key:?}"), allowed)
        })?),
    };
    let key = |ColumnFile(text): &ColumnFile| match text.parse() {
        Ok(key) => key,
        Err(never) => match never {},
    };
    let ignore = data.ignore_columns.as_ref().map(|keys| keys.iter().map(key).collect());
    let label = data.label_column.as_ref().map(key);
    Ok(Reading { label, ignore, header: data.header, separator })
}

/// Every key of `[data]` that names a file.
const FILES: [&str; 6] =
    ["train", "train_labels", "validation", "validation_labels", "test", "test_labels"];

/// Writes down what was told from files and nobody had said.
fn tell(data: &mut DataFile, told: &Told) {
    let [_, validation, test] = told.in_training_file;
    if validation {
        data.validation.clone_from(&data.train);
    }
    if test {
        data.test.clone_from(&data.train);
    }
    if told.arrays.iter().any(Option::is_some) {
        // they stand for every part, and every part has its own now
        (data.examples_array, data.labels_array) = (None, None);
    }
    let DataFile { train_array, train_labels_array, validation_array, .. } = data;
    let DataFile { validation_labels_array, test_array, test_labels_array, .. } = data;
    let keys = [
        [train_array, train_labels_array],
        [validation_array, validation_labels_array],
        [test_array, test_labels_array],
    ];
    for (keys, found) in keys.into_iter().zip(&told.arrays) {
        for (key, found) in keys.into_iter().zip(found.iter().flatten()) {
            *key = Some(found.clone());
        }
    }
    if let Some(table) = &told.table {
        data.label_column.get_or_insert_with(|| ColumnFile(table.label_column.clone()));
        if !table.ignore_columns.is_empty() {
            let columns = || table.ignore_columns.iter().cloned().map(ColumnFile).collect();
            data.ignore_columns.get_or_insert_with(columns);
        }
        data.header = data.header.or(table.header);
        if let Some(separator) = table.separator {
            data.separator.get_or_insert_with(|| separator.to_owned());
        }
    }
}

/// Makes paths that a file in `folder` names relative to where the program runs.
pub(super) fn anchor(table: &mut toml::Table, folder: &Path) {
    let Some(toml::Value::Table(data)) = table.get_mut("data") else { return };
    for key in FILES {
        if let Some(toml::Value::String(path)) = data.get_mut(key) {
            *path = folder.join(&*path).display().to_string();
        }
    }
}

/// A path as a file in `folder` names it: relative if both lie below a common folder, else whole.
fn seen_from(path: &str, folder: &Path) -> String {
    let whole = |path: &Path| std::path::absolute(path).map(|path| plain(&path)).ok();
    let (Some(path_whole), Some(folder)) = (whole(Path::new(path)), whole(folder)) else {
        return path.to_owned();
    };
    let common =
        path_whole.components().zip(folder.components()).take_while(|(a, b)| a == b).count();
    let root = path_whole.components().take_while(|c| !matches!(c, Component::Normal(_))).count();
    if common <= root {
        return path_whole.display().to_string();
    }
    let up = folder.components().skip(common).map(|_| Component::ParentDir);
    let relative: PathBuf = up.chain(path_whole.components().skip(common)).collect();
    relative.display().to_string()
}

/// A path without `.` and `..`.
fn plain(path: &Path) -> PathBuf {
    let mut found = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir => {
                found.pop();
            }
            part => found.push(part),
        }
    }
    found
}

impl Data {
    /// Loads the data that a configuration names; known sets are looked for in `root` unless they are built in.
    ///
    /// ```
    /// use dalean::{Config, Data, DataRoot, Sources};
    ///
    /// let config = Config::load(&Sources::default())?;
    /// let digits = Data::load(&config, &DataRoot::new("data"))?;
    /// assert_eq!(digits.split().train.len(), 3505);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// When a key is missing, a set is missing or damaged, or a file does not make examples.
    pub fn load(config: &Config, root: &DataRoot) -> Result<Self, DataError> {
        let source = config.source().map_err(|error| DataError::Keys(error.to_string()))?;
        data::load(&source, root)
    }
}

impl Config {
    /// Where the examples come from, or what a policy acts on.
    ///
    /// # Errors
    /// When the set is unknown or a key is missing.
    pub fn source(&self) -> Result<Source, ConfigError> {
        if let Some(policy) = &self.policy {
            return Ok(Source::Environment(policy.environment.id.to_string()));
        }
        let data = &self.data;
        let whole = if data.format.is_some() {
            Source::Files(Box::new(own(data)?))
        } else {
            let name = data.set.as_deref().unwrap_or("optdigits");
            let unknown = |error| wrong("data.set", format!("is \"{name}\""), error);
            Source::Named(name.parse().map_err(unknown)?)
        };
        Ok(match data.middle {
            Some(sides) => Source::Middle(Box::new(whole), sides),
            None => whole,
        })
    }

    /// The configuration as the file of a run in `folder`: with what was told from its files, and paths as that folder
    /// sees them.
    pub(crate) fn settled(&self, told: &Told, folder: &Path) -> String {
        let mut resolved = self.resolved.clone();
        if let Some(data) = resolved.data.as_mut().filter(|data| data.format.is_some()) {
            tell(data, told);
            let DataFile { train, train_labels, validation, validation_labels, .. } = data;
            let DataFile { test, test_labels, .. } = data;
            let files = [train, train_labels, validation, validation_labels, test, test_labels];
            for path in files.into_iter().flatten() {
                *path = seen_from(path, folder);
            }
        }
        toml::to_string(&resolved).expect("every key has a TOML form")
    }

    /// The data, or what a policy acts on, in one word, for folder names and titles.
    #[must_use]
    pub fn data_name(&self) -> String {
        if let Some(policy) = &self.policy {
            return policy.environment.id.to_string();
        }
        let own = || {
            let file = Path::new(self.data.train.as_deref()?).file_name()?.to_string_lossy();
            let stem = file.split('.').find(|part| !part.is_empty())?.to_owned();
            Some(stem)
        };
        let format = || self.data.format.clone().unwrap_or_else(|| "data".into());
        self.data.set.clone().or_else(own).unwrap_or_else(format)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_seen_from_a_folder_and_found_again() {
        for (path, folder, wanted) in [
            ("/users/me/data/x.csv", "/users/me/runs/one", "../../data/x.csv"),
            ("/users/me/runs/one/x.csv", "/users/me/runs/one", "x.csv"),
            ("/users/me/./a/../x.csv", "/users/me/runs", "../x.csv"),
            ("/data/x.csv", "/users/me/runs", "/data/x.csv"),
        ] {
            assert_eq!(seen_from(path, Path::new(folder)), wanted);
        }
        let here = seen_from("x.csv", Path::new("runs/one"));
        assert_eq!(here, "../../x.csv");
    }
}
