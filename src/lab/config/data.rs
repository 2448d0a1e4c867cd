//! `[data]` as a source of examples.

use std::path::PathBuf;

use super::check::wrong;
use super::file::DataFile;
use super::{Config, ConfigError};
use crate::lab::data::{self, Data, DataError, DataRoot, FileSet, PartFile, Source};

/// Checks that every key of `[data]` means something there, and writes defaults back.
pub(super) fn resolve(data: &mut DataFile) -> Result<DataFile, ConfigError> {
    if data.set.is_none() && data.format.is_none() {
        data.set = Some("optdigits".into());
    }
    const ANY: &[&str] = &["idx", "npz", "csv"];
    let of_files = [
        ("train", data.train.is_some(), ANY),
        ("train_labels", data.train_labels.is_some(), &["idx"]),
        ("validation", data.validation.is_some(), ANY),
        ("validation_labels", data.validation_labels.is_some(), &["idx"]),
        ("test", data.test.is_some(), ANY),
        ("test_labels", data.test_labels.is_some(), &["idx"]),
        ("full_scale", data.full_scale.is_some(), ANY),
        ("classes", data.classes.is_some(), ANY),
        ("label_column", data.label_column.is_some(), &["csv"]),
        ("examples_array", data.examples_array.is_some(), &["npz"]),
        ("labels_array", data.labels_array.is_some(), &["npz"]),
    ];
    for (key, given, formats) in of_files {
        let format = data.format.as_deref();
        // a format that nobody knows is refused for itself
        let known = format.is_none_or(|format| ANY.contains(&format));
        if given && known && !format.is_some_and(|format| formats.contains(&format)) {
            let found = match format {
                Some(format) => format!("is given beside data.format = \"{format}\""),
                None => "is given without data.format".into(),
            };
            let allowed =
                format!("it belongs to files of the format {}; take it out", formats.join(", "));
            return Err(wrong(&format!("data.{key}"), found, allowed));
        }
    }
    let parts = [
        ("validation", &data.validation, &data.validation_labels),
        ("test", &data.test, &data.test_labels),
    ];
    for (part, values, labels) in parts {
        if values.is_none() && labels.is_some() {
            let allowed = format!("give data.{part} too, or take it out");
            let found = format!("is given without data.{part}");
            return Err(wrong(&format!("data.{part}_labels"), found, allowed));
        }
    }
    Ok(data.clone())
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
    /// Where the examples come from.
    ///
    /// # Errors
    /// When the set is unknown or a key is missing.
    pub fn source(&self) -> Result<Source, ConfigError> {
        let data = &self.data;
        let wrong = |key: &str, found: String, allowed: &str| ConfigError::Value {
            key: format!("data.{key}"),
            found,
            allowed: allowed.into(),
        };
        let Some(format) = &data.format else {
            let name = data.set.as_deref().unwrap_or("optdigits");
            let set = name
                .parse()
                .map_err(|error| wrong("set", format!("is \"{name}\""), &format!("{error}")))?;
            return Ok(Source::Named(set));
        };
        if data.set.is_some() {
            return Err(wrong(
                "format",
                "is given beside data.set".into(),
                "name a set or files, not both",
            ));
        }
        let part = |name: &str, values: &Option<String>, labels: &Option<String>| {
            let Some(path) = values else { return Ok(None) };
            let path = PathBuf::from(path);
            Ok(Some(match format.as_str() {
                "idx" => {
                    let labels = labels.as_ref().ok_or_else(|| {
                        let key = format!("{name}_labels");
                        wrong(&key, "is missing".into(), "IDX keeps labels in a file of their own")
                    })?;
                    PartFile::Idx { values: path, labels: labels.into() }
                }
                "npz" => PartFile::Npz {
                    path,
                    values: data.examples_array.clone().unwrap_or_else(|| "x".into()),
                    labels: data.labels_array.clone().unwrap_or_else(|| "y".into()),
                },
                "csv" => {
                    let column = data.label_column.as_deref().unwrap_or("last");
                    let label = column.parse().map_err(|_| {
                        let allowed = "it is first, last, a number from 0, or a header";
                        wrong("label_column", format!("is \"{column}\""), allowed)
                    })?;
                    PartFile::Csv { path, label }
                }
                other => {
                    return Err(wrong(
                        "format",
                        format!("is \"{other}\""),
                        "it is idx, npz or csv",
                    ));
                }
            }))
        };
        let train = part("train", &data.train, &data.train_labels)?.ok_or_else(|| {
            wrong("train", "is missing".into(), "give the file of training examples")
        })?;
        Ok(Source::Files(Box::new(FileSet {
            train,
            validation: part("validation", &data.validation, &data.validation_labels)?,
            test: part("test", &data.test, &data.test_labels)?,
            full_scale: data.full_scale,
            classes: data.classes,
            image: None,
        })))
    }

    /// The data in one word, for folder names and titles.
    #[must_use]
    pub fn data_name(&self) -> String {
        let own = || self.data.format.clone().unwrap_or_else(|| "data".into());
        self.data.set.clone().unwrap_or_else(own)
    }
}
