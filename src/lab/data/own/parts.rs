//! One part after another, from its files to values and labels.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::{ImageShape, TableKeys, Told};
use crate::lab::data::arrays::{self, PartName};
use crate::lab::data::csv::{self, Reading, TableLayout};
use crate::lab::data::error::DataError;
use crate::lab::data::idx;
use crate::lab::data::labels::{Label, Labels};
use crate::lab::data::load::{FILE_BYTES_MAX, read_own};
use crate::lab::data::npy;
use crate::lab::data::npz::{Archive, NpzError};
use crate::lab::data::numbers::NumberKind;
use crate::lab::data::source::{FileSet, PartFile};

/// A part as it stands in its files.
pub(super) struct OwnPart {
    /// The file of its values.
    pub(super) path: PathBuf,
    pub(super) values: Vec<u8>,
    pub(super) labels: Labels,
    pub(super) features: usize,
    pub(super) image: Option<ImageShape>,
    pub(super) kind: NumberKind,
}

/// Reads the parts of a set and remembers what it had to tell for itself.
pub(super) struct Reader<'a> {
    files: &'a FileSet,
    scale: u8,
    /// The archive read last.
    last: Option<(PathBuf, Vec<u8>)>,
    tables: Vec<(PartName, TableLayout)>,
    told: Told,
    said: Vec<String>,
}

/// A part without an array of its own, with its archives and what is stated.
type Unsettled<'a> = (&'a Path, Option<&'a Path>, Option<&'a String>, Option<&'a String>);

impl<'a> Reader<'a> {
    pub(super) const fn new(files: &'a FileSet, scale: u8) -> Self {
        let told = Told { arrays: [None, None, None], in_training_file: [false; 3], table: None };
        Self { files, scale, last: None, tables: vec![], told, said: vec![] }
    }

    fn bytes(&mut self, path: &Path) -> Result<&[u8], DataError> {
        if self.last.as_ref().is_none_or(|(known, _)| known != path) {
            self.last = None;
            self.last = Some((path.to_owned(), read_own(path)?));
        }
        Ok(self.last.as_ref().map_or(&[], |(_, bytes)| bytes))
    }

    fn names(&mut self, path: &Path) -> Result<Vec<String>, DataError> {
        let wrong = |source| DataError::Npz { path: path.to_owned(), source: Box::new(source) };
        Ok(Archive::open(self.bytes(path)?).map_err(wrong)?.names())
    }

    /// The three parts, each array by its name; a part that is neither named nor in the training archive is none.
    pub(super) fn settled(&mut self) -> Result<[Option<PartFile>; 3], DataError> {
        let files = self.files;
        let mut parts = [Some(files.train.clone()), files.validation.clone(), files.test.clone()];
        if let PartFile::Npz { path, labels_path: None, .. } = &files.train {
            for name in [PartName::Validation, PartName::Test] {
                let part = &mut parts[name as usize];
                if part.is_some() {
                    continue;
                }
                let names = self.names(path)?;
                if let Some([values, labels]) = arrays::both(name, &names, true) {
                    let (values, labels) = (Some(values), Some(labels));
                    let path = path.clone();
                    *part = Some(PartFile::Npz { path, labels_path: None, values, labels });
                    self.told.in_training_file[name as usize] = true;
                }
            }
        }
        let count = |path: &Path| {
            let there = |part: &&PartFile| same_file(part.path(), path);
            parts.iter().flatten().filter(there).count()
        };
        let shared: Vec<bool> =
            parts.iter().map(|part| part.as_ref().is_some_and(|p| count(p.path()) > 1)).collect();
        for (name, shared) in PartName::EACH.into_iter().zip(shared) {
            if let Some(PartFile::Npz { path, labels_path, values, labels }) =
                &mut parts[name as usize]
            {
                let given = (&**path, labels_path.as_deref(), values.as_ref(), labels.as_ref());
                let [one, other] = self.arrays(name, given, shared)?;
                self.told.arrays[name as usize] = Some([one.clone(), other.clone()]);
                (*values, *labels) = (Some(one), Some(other));
            }
        }
        apart(&parts)?;
        Ok(parts)
    }

    /// Names of the arrays of a part.
    fn arrays(
        &mut self,
        part: PartName,
        (path, labels_path, values, labels): Unsettled<'_>,
        shared: bool,
    ) -> Result<[String; 2], DataError> {
        if let (Some(values), Some(labels)) = (values, labels) {
            if self.told.in_training_file[part as usize] {
                self.said.push(say_arrays(part, values, labels));
            }
            return Ok([values.clone(), labels.clone()]);
        }
        let wrong =
            |path: &Path, what, there| DataError::Arrays { path: path.into(), part, what, there };
        let names = self.names(path)?;
        let found = match labels_path {
            Some(labels_path) => {
                let others = self.names(labels_path)?;
                let one = values.cloned().or_else(|| arrays::one(part, &names, 0));
                let one = one.ok_or_else(|| wrong(path, "examples", names))?;
                let other = labels.cloned().or_else(|| arrays::one(part, &others, 1));
                [one, other.ok_or_else(|| wrong(labels_path, "labels", others))?]
            }
            None => match (arrays::both(part, &names, shared), values, labels) {
                (Some([one, other]), values, labels) => {
                    [values.cloned().unwrap_or(one), labels.cloned().unwrap_or(other)]
                }
                (None, Some(_), _) => return Err(wrong(path, "labels", names)),
                (None, _, Some(_)) => return Err(wrong(path, "examples", names)),
                (None, ..) => return Err(wrong(path, "examples and labels", names)),
            },
        };
        self.said.push(say_arrays(part, &found[0], &found[1]));
        Ok(found)
    }

    /// Reads a settled part.
    pub(super) fn read(&mut self, name: PartName, file: &PartFile) -> Result<OwnPart, DataError> {
        match file {
            PartFile::Idx { values, labels } => {
                let read = |path: &Path| {
                    idx::read(&read_own(path)?).map_err(|source| DataError::Idx {
                        path: path.to_owned(),
                        source: Box::new(source),
                    })
                };
                let (values, labels) = (read(values)?, read(labels)?);
                let of = labels.data.iter().map(|&label| Label::Number(label.into())).collect();
                let kind = NumberKind::Whole;
                join(file.path(), (values.dims, values.data, kind), (labels.dims, of))
            }
            PartFile::Npz { path, labels_path, values, labels } => {
                let named = |name: &Option<String>| name.clone().unwrap_or_default();
                let (values, labels) = (named(values), named(labels));
                let scale = self.scale;
                let bytes = self.array(path, &values)?;
                let wrong = |path: &Path, name: &str, source| DataError::Npz {
                    path: path.to_owned(),
                    source: Box::new(NpzError::Array { name: name.to_owned(), source }),
                };
                let array = npy::values(&bytes, scale).map_err(|e| wrong(path, &values, e))?;
                drop(bytes);
                if array.range.whole_floats() {
                    let top = array.range.greatest();
                    let word = name.word();
                    let line = format!(
                        "the {word} values are floats without fractions, read as whole numbers 0 to {top}"
                    );
                    self.said.push(line);
                }
                let labels_path = labels_path.as_ref().unwrap_or(path);
                let bytes = self.array(labels_path, &labels)?;
                let (dims, of) = npy::labels(&bytes).map_err(|e| wrong(labels_path, &labels, e))?;
                join(path, (array.dims, array.data, array.kind), (dims, of))
            }
            PartFile::Csv { path, reading } => self.table(name, path, reading),
        }
    }

    fn array(&mut self, path: &Path, name: &str) -> Result<Vec<u8>, DataError> {
        let wrong = |source| DataError::Npz { path: path.to_owned(), source: Box::new(source) };
        let mut archive = Archive::open(self.bytes(path)?).map_err(wrong)?;
        archive.read(name).map_err(wrong)
    }

    fn table(
        &mut self,
        name: PartName,
        path: &Path,
        reading: &Reading,
    ) -> Result<OwnPart, DataError> {
        let bytes = read_own(path)?;
        let like = self.tables.first().map(|(_, layout)| layout);
        let table = csv::read(&bytes, reading, like, self.scale, FILE_BYTES_MAX)
            .map_err(|source| DataError::Csv { path: path.to_owned(), source: Box::new(source) })?;
        let csv::CsvTable { features, values, labels, range, kind, layout, said } = table;
        let of = |line: String| {
            if name == PartName::Train { line } else { format!("{}: {line}", name.word()) }
        };
        self.said.extend(said.into_iter().map(of));
        if range.whole_floats() {
            let top = range.greatest();
            let word = name.word();
            self.said.push(format!(
                "the {word} values are floats without fractions, read as whole numbers 0 to {top}"
            ));
        }
        self.tables.push((name, layout));
        let path = path.to_owned();
        Ok(OwnPart { path, values, labels, features, image: None, kind })
    }

    /// What was told, once every part is read.
    pub(super) fn told(self) -> Result<(Told, Vec<String>), DataError> {
        let Self { tables, mut told, said, .. } = self;
        if let Some((_, first)) = tables.first() {
            let everywhere = |name: &&String| tables.iter().all(|(_, t)| t.absent.contains(name));
            if let Some(name) = first.absent.iter().find(everywhere) {
                return Err(DataError::NoColumn { name: name.clone() });
            }
            let alike = |of: fn(&TableLayout) -> u8| {
                Some(of(first)).filter(|_| tables.iter().all(|(_, t)| of(t) == of(first)))
            };
            told.table = Some(TableKeys {
                label_column: first.key(first.label),
                ignore_columns: first
                    .ignored
                    .iter()
                    .map(|&at| first.key(at))
                    .chain(first.absent.iter().cloned())
                    .collect(),
                header: alike(|t| u8::from(!t.names.is_empty())).map(|header| header == 1),
                separator: alike(|t| t.separator).map(csv::separator_key),
            });
        }
        Ok((told, said))
    }
}

fn say_arrays(part: PartName, values: &str, labels: &str) -> String {
    let [values, labels] = [values, labels].map(arrays::shown);
    format!("{} examples are array {values}, their labels {labels}", part.word())
}

/// Whether two paths are one file.
fn same_file(one: &Path, other: &Path) -> bool {
    let whole = |path: &Path| std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    one == other || whole(one) == whole(other)
}

/// Refuses parts that read the same.
fn apart(parts: &[Option<PartFile>; 3]) -> Result<(), DataError> {
    // the places of examples and of labels: file and array
    let places = |part: &PartFile| -> BTreeMap<&'static str, (PathBuf, String)> {
        let at = |path: &Path, name: &Option<String>| {
            (path.to_owned(), name.clone().unwrap_or_default())
        };
        match part {
            PartFile::Idx { values, labels } => {
                BTreeMap::from([("examples", at(values, &None)), ("labels", at(labels, &None))])
            }
            PartFile::Npz { path, labels_path, values, labels } => BTreeMap::from([
                ("examples", at(path, values)),
                ("labels", at(labels_path.as_ref().unwrap_or(path), labels)),
            ]),
            PartFile::Csv { path, .. } => BTreeMap::from([("examples", at(path, &None))]),
        }
    };
    let known: Vec<_> = PartName::EACH
        .into_iter()
        .zip(parts)
        .filter_map(|(name, part)| Some((name, places(part.as_ref()?))))
        .collect();
    for (at, (one, first)) in known.iter().enumerate() {
        for (other, second) in &known[at + 1..] {
            for (what, (path, array)) in first {
                let same = second.get(what).is_some_and(|(path_two, array_two)| {
                    array == array_two && same_file(path, path_two)
                });
                if same {
                    let array =
                        if array.is_empty() { String::new() } else { format!(", array `{array}`") };
                    return Err(DataError::SamePart {
                        one: one.word(),
                        other: other.word(),
                        other_key: other.key(),
                        what: format!("{what} ({}{array})", path.display()),
                    });
                }
            }
        }
    }
    Ok(())
}

/// Joins an array of values and one of labels; neither has a dimension of 0.
fn join(
    path: &Path,
    (dims, values, kind): (Vec<usize>, Vec<u8>, NumberKind),
    (label_dims, labels): (Vec<usize>, Labels),
) -> Result<OwnPart, DataError> {
    let examples = dims.first().copied().unwrap_or(0);
    let flat = label_dims.first() == Some(&examples) && labels.of.len() == examples;
    if !flat {
        return Err(DataError::Labels { path: path.to_owned(), dims: label_dims, examples });
    }
    let features = values.len() / examples.max(1);
    let (image, values) = match dims[1..] {
        [height, width] => (Some(ImageShape { height, width, channels: 1 }), values),
        [channels @ (1 | 3), height, width] => {
            (Some(ImageShape { height, width, channels }), values)
        }
        [height, width, channels @ (1 | 3)] => {
            let image = ImageShape { height, width, channels };
            (Some(image), planes(&values, features, channels))
        }
        _ => (None, values),
    };
    Ok(OwnPart { path: path.to_owned(), values, labels, features, image, kind })
}

/// Pixels whose channels stand side by side, put plane after plane.
pub(super) fn planes(values: &[u8], features: usize, channels: usize) -> Vec<u8> {
    values
        .chunks_exact(features)
        .flat_map(|example| (0..channels).flat_map(|c| example.iter().skip(c).step_by(channels)))
        .copied()
        .collect()
}
