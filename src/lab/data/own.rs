//! The user's own files, made into the three parts of a split.
//!
//! A test part that is not given is every sixth example of the training file, a validation part every twelfth of what is
//! left: evenly over the file, so that a file sorted by class still gives all classes. An archive that holds arrays of a
//! test or validation part beside those of training gives these parts too.
//!
//! All parts have one scale, one set of classes ([`super::labels`]) and the same values an example; no two parts are the
//! same. What was told from the files and not stated is said, and goes into the resolved configuration as [`Told`].

use std::collections::BTreeSet;
use std::path::Path;

mod parts;

use self::parts::{OwnPart, Reader, planes};
use super::arrays::PartName;
use super::error::DataError;
use super::labels::{self, Classes, Labels};
use super::load::{Data, finish};
use super::numbers::NumberKind;
use super::source::{FileSet, ImageShape};
use crate::task::classify::{Examples, Split};

/// Cuts' worth of examples of a class, of which a cut that meets none is no chance.
const CUTS: usize = 8;
const TEST_EVERY: usize = 6;
const VALIDATION_EVERY: usize = 12;
/// A part this many times darker than the training part is one of another scale.
const DARKER: u8 = 16;
/// Classes named in a sentence.
const NAMED: usize = 8;

/// What was told from files, as keys of a configuration.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Told {
    /// Names of the arrays of each part: examples, labels.
    pub arrays: [Option<[String; 2]>; 3],
    /// Whether a part that nobody named lies in the training archive.
    pub in_training_file: [bool; 3],
    /// How tables are read.
    pub table: Option<TableKeys>,
}

/// How a table is read, as keys say it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TableKeys {
    /// The label column.
    pub label_column: String,
    /// Columns left out.
    pub ignore_columns: Vec<String>,
    /// Whether the first line is a header; nothing when parts differ.
    pub header: Option<bool>,
    /// What separates fields; nothing when parts differ.
    pub separator: Option<&'static str>,
}

/// Loads a set of files.
pub(crate) fn load(files: &FileSet) -> Result<Data, DataError> {
    let scale = files.full_scale.unwrap_or(255);
    if scale == 0 {
        return Err(DataError::FullScale);
    }
    if let Some(found) = files.classes.filter(|n| !(2..=256).contains(n)) {
        return Err(DataError::Classes { found });
    }
    let mut reader = Reader::new(files, scale);
    let [train, validation, test] = reader.settled()?;
    let train = train.expect("the training part is always there");
    let mut parts = vec![(PartName::Train, reader.read(PartName::Train, &train)?)];
    for (name, file) in [(PartName::Validation, validation), (PartName::Test, test)] {
        if let Some(file) = file {
            let part = reader.read(name, &file)?;
            parts.push((name, part));
        }
    }
    let (told, mut said) = reader.told()?;

    different(&parts)?;
    let full_scale = scales(&parts, files.full_scale)?;
    let of: Vec<(&'static str, &Labels)> =
        parts.iter().map(|(name, part)| (name.word(), &part.labels)).collect();
    let path = train.path();
    let classes = labels::classes(&of, files.classes).map_err(|source| DataError::Classless {
        path: path.to_owned(),
        source: Box::new(source),
    })?;
    said.extend(named(&classes));
    let features = parts[0].1.features;
    let image = pictures(files.image, &mut parts)?;
    if let Some(image) = image.filter(|image| image.values() != Some(features)) {
        return Err(DataError::Image { image, features });
    }
    let Classes { count, names, labels } = classes;
    let mut made: [Option<Examples>; 3] = [None, None, None];
    for ((name, part), labels) in parts.into_iter().zip(labels) {
        let OwnPart { path, values, features: found, .. } = part;
        if found != features {
            return Err(DataError::Features { path, found, wanted: features });
        }
        let examples = Examples::new(values, labels, features, full_scale, count)
            .map_err(|source| DataError::Examples { path, source: Box::new(source) })?;
        made[name as usize] = Some(examples);
    }
    let class = |class: usize| names.get(class).cloned().unwrap_or_else(|| class.to_string());
    let [train, validation, test] = made;
    let mut train = train.expect("the training part is always there");
    let mut note = String::new();
    let cut_test = test.is_none();
    let test = match test {
        Some(test) => test,
        None => {
            note += "; test is every 6th example of the file";
            cut(&mut train, TEST_EVERY, PartName::Test, path, &class)?
        }
    };
    let validation = match validation {
        Some(validation) => validation,
        None => {
            note += "; validation is every 12th example of the training part";
            cut(&mut train, VALIDATION_EVERY, PartName::Validation, path, &class)?
        }
    };
    if (1..train.len()).all(|e| train.values(e) == train.values(0)) {
        return Err(DataError::Constant { path: path.to_owned(), examples: train.len() });
    }
    let split = Split { train, validation, test };
    said.extend(known(&split, cut_test));
    said.extend(missing(&split, count, &class));
    if files.classes.is_none()
        && let Some(at) = (0..count).find(|&at| !has(&split.train, at))
    {
        let part =
            if cut_test && has(&split.test, at) { PartName::Test } else { PartName::Validation };
        let (path, class, part) = (path.to_owned(), class(at), part.key());
        return Err(DataError::Thin { path, class, part, classes: count });
    }
    let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
    Ok(Data { names, said, told, ..finish(&name, split, image, &note) })
}

/// What the examples are as pictures. Flat examples of a stated shape hold the channels of a pixel side by side, and are put
/// plane after plane.
fn pictures(
    stated: Option<ImageShape>,
    parts: &mut [(PartName, OwnPart)],
) -> Result<Option<ImageShape>, DataError> {
    let Some(image) = stated else { return Ok(parts[0].1.image) };
    for (_, part) in parts {
        if image.values() != Some(part.features) {
            return Err(DataError::Image { image, features: part.features });
        }
        match part.image {
            Some(found) if found == image => {}
            Some(found) => {
                return Err(DataError::Shape { path: part.path.clone(), stated: image, found });
            }
            None if image.channels > 1 => {
                part.values = planes(&part.values, part.features, image.channels);
            }
            None => {}
        }
    }
    Ok(stated)
}

/// The one full scale of all parts.
fn scales(parts: &[(PartName, OwnPart)], stated: Option<u8>) -> Result<u8, DataError> {
    let top = |part: &OwnPart| part.values.iter().copied().max().unwrap_or(0);
    let (train, others) = (&parts[0].1, &parts[1..]);
    let what = |part: &OwnPart| match part.kind {
        NumberKind::Whole => format!("whole numbers 0 to {}", top(part)),
        NumberKind::Fraction => "fractions 0 to 1".to_owned(),
    };
    let full_scale = match (stated, train.kind) {
        (Some(stated), _) => stated,
        (None, NumberKind::Fraction) => 255,
        (None, NumberKind::Whole) => top(train).max(1),
    };
    for (name, part) in others.iter().filter(|_| stated.is_none()) {
        let dark = top(part) <= 1 && top(train) >= DARKER;
        if part.kind != train.kind || dark {
            let whole = if part.kind == NumberKind::Whole { top(part) } else { top(train) };
            return Err(DataError::Scales {
                path: part.path.clone(),
                part: name.word(),
                train: what(train),
                other: what(part),
                full_scale: if part.kind == train.kind { full_scale } else { whole.max(1) },
            });
        }
    }
    for (name, part) in parts {
        let found = top(part);
        if found > full_scale {
            let (path, part, stated) = (part.path.clone(), name.word(), stated.is_some());
            return Err(DataError::Bright { path, part, found, full_scale, stated });
        }
    }
    Ok(full_scale)
}

/// What the labels were made of, if not their own numbers.
fn named(classes: &Classes) -> Option<String> {
    let names = &classes.names;
    let some: Vec<&str> = names.iter().take(NAMED).map(String::as_str).collect();
    let more = if names.len() > NAMED { ", ..." } else { "" };
    let last = names.len().saturating_sub(1);
    let range = format!("classes 0 to {last} are the labels {}{more}", some.join(", "));
    (!names.is_empty()).then_some(range)
}

fn has(part: &Examples, class: usize) -> bool {
    part.labels().iter().any(|&label| usize::from(label) == class)
}

/// Which part has no example of which class.
fn missing(split: &Split, classes: usize, name: &dyn Fn(usize) -> String) -> Vec<String> {
    let parts =
        [("training", &split.train), ("validation", &split.validation), ("test", &split.test)];
    let said = parts.into_iter().filter_map(|(part, examples)| {
        let missing: Vec<usize> = (0..classes).filter(|&class| !has(examples, class)).collect();
        let some: Vec<_> = missing.iter().take(NAMED).map(|&class| name(class)).collect();
        let more = if missing.len() > NAMED { ", ..." } else { "" };
        let word = if missing.len() == 1 { "class" } else { "classes" };
        (!missing.is_empty())
            .then(|| format!("the {part} part has no example of {word} {}{more}", some.join(", ")))
    });
    said.collect()
}

/// Refuses parts that hold the same examples.
fn different(parts: &[(PartName, OwnPart)]) -> Result<(), DataError> {
    for (at, (one, first)) in parts.iter().enumerate() {
        for (other, second) in &parts[at + 1..] {
            let same = first.values == second.values && first.labels == second.labels;
            if same && first.labels.of.len() > 1 {
                return Err(DataError::SamePart {
                    one: one.word(),
                    other: other.word(),
                    other_key: other.key(),
                    what: "examples".into(),
                });
            }
        }
    }
    Ok(())
}

/// Whether every test example is one that is learnt from, where that part has a file of its own.
fn known(split: &Split, cut_test: bool) -> Option<String> {
    let Split { train, test, .. } = split;
    if cut_test || test.is_empty() {
        return None;
    }
    let learnt: BTreeSet<&[u8]> = (0..train.len()).map(|e| train.values(e)).collect();
    let all = (0..test.len()).all(|e| learnt.contains(test.values(e)));
    all.then(|| format!("every one of the {} test examples is a training example too", test.len()))
}

/// Takes every `every`-th example out of `from`.
fn cut(
    from: &mut Examples,
    every: usize,
    part: PartName,
    path: &Path,
    name: &dyn Fn(usize) -> String,
) -> Result<Examples, DataError> {
    let found = from.len();
    if found < every {
        let part = part.key();
        return Err(DataError::TooFew { path: path.to_owned(), part, found, wanted: every });
    }
    let pick = |taken: bool| {
        let chosen = || (0..found).filter(move |e| (e % every == every - 1) == taken);
        let values = chosen().flat_map(|e| from.values(e)).copied().collect();
        let labels = chosen().map(|e| from.labels()[e]).collect();
        Examples::new(values, labels, from.features(), from.full_scale(), from.classes())
            .expect("examples of a checked set are checked")
    };
    let (kept, taken) = (pick(false), pick(true));
    let count = |part: &Examples, class: usize| {
        part.labels().iter().filter(|&&label| usize::from(label) == class).count()
    };
    let lost = (0..from.classes())
        .map(|class| (class, count(from, class)))
        .find(|&(class, there)| there >= CUTS * every && count(&taken, class) == 0);
    if let Some((class, there)) = lost {
        let (part, path) = (part.key(), path.to_owned());
        return Err(DataError::Step { path, part, every, class: name(class), there });
    }
    *from = kept;
    Ok(taken)
}

#[cfg(test)]
#[path = "own_tests.rs"]
mod tests;
