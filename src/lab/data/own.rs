//! The user's own files, made into the three parts of a split.
//!
//! A test part that is not given is every sixth example of the training file, a validation part every
//! twelfth of what is left: evenly over the file, so that a file sorted by class still gives all classes.

use std::path::Path;

use super::{
    csv,
    error::DataError,
    idx,
    load::{Data, finish, read_own},
    npy::Floats,
    npz,
    source::{FileSet, ImageShape, PartFile},
};
use crate::task::classify::{Examples, Split};

const TEST_EVERY: usize = 6;
const VALIDATION_EVERY: usize = 12;

/// A part as it stands in its files.
struct OwnPart {
    values: Vec<u8>,
    labels: Vec<u8>,
    features: usize,
    image: Option<ImageShape>,
    scaled: bool,
}

/// Loads a set of files.
pub(crate) fn load(files: &FileSet) -> Result<Data, DataError> {
    let scale = files.full_scale.unwrap_or(255);
    if scale == 0 {
        return Err(DataError::FullScale);
    }
    if let Some(found) = files.classes.filter(|n| !(1..=256).contains(n)) {
        return Err(DataError::Classes { found });
    }
    let train = read_part(&files.train, scale)?;
    let read = |file: &Option<PartFile>| -> Result<Option<OwnPart>, DataError> {
        file.as_ref().map(|file| read_part(file, scale)).transpose()
    };
    let (validation, test) = (read(&files.validation)?, read(&files.test)?);

    let features = train.features;
    let image = files.image.or(train.image);
    if let Some(image) = image.filter(|image| image.values() != Some(features)) {
        return Err(DataError::Image { image, features });
    }
    let greatest = train.values.iter().copied().max().unwrap_or(0).max(1);
    let parts = || [Some(&train), validation.as_ref(), test.as_ref()].into_iter().flatten();
    let floats = parts().any(|part| part.scaled);
    let full_scale = files.full_scale.unwrap_or(if floats { 255 } else { greatest });
    let top = parts().flat_map(|part| &part.labels).copied().max().unwrap_or(0);
    let classes = files.classes.unwrap_or(usize::from(top) + 1);

    let make = |file: &PartFile, part: OwnPart| {
        let path = || file.path().to_owned();
        if part.features != features {
            let (found, wanted) = (part.features, features);
            return Err(DataError::Features { path: path(), found, wanted });
        }
        Examples::new(part.values, part.labels, features, full_scale, classes)
            .map_err(|source| DataError::Examples { path: path(), source })
    };
    let mut train = make(&files.train, train)?;
    let mut note = String::new();
    let path = files.train.path();
    let test = match files.test.as_ref().zip(test) {
        Some((file, part)) => make(file, part)?,
        None => {
            note += "; test is every 6th example of the file";
            cut(&mut train, TEST_EVERY, "test", path)?
        }
    };
    let validation = match files.validation.as_ref().zip(validation) {
        Some((file, part)) => make(file, part)?,
        None => {
            note += "; validation is every 12th example of the training part";
            cut(&mut train, VALIDATION_EVERY, "validation", path)?
        }
    };
    let name = path.display().to_string();
    Ok(finish(&name, Split { train, validation, test }, image, &note))
}

/// Takes every `every`-th example out of `from`.
fn cut(
    from: &mut Examples,
    every: usize,
    part: &'static str,
    path: &Path,
) -> Result<Examples, DataError> {
    let found = from.len();
    if found < every {
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
    *from = kept;
    Ok(taken)
}

fn read_part(file: &PartFile, scale: u8) -> Result<OwnPart, DataError> {
    match file {
        PartFile::Idx { values, labels } => {
            let read = |path: &Path| {
                idx::read(&read_own(path)?)
                    .map_err(|source| DataError::Idx { path: path.to_owned(), source })
            };
            let (values, labels) = (read(values)?, read(labels)?);
            arrays(file.path(), (values.dims, values.data), (labels.dims, labels.data), false)
        }
        PartFile::Npz { path, values, labels } => {
            let bytes = read_own(path)?;
            let read = |name: &str, floats| {
                npz::read(&bytes, name, floats)
                    .map_err(|source| DataError::Npz { path: path.clone(), source })
            };
            let values = read(values, Floats::Scale(scale))?;
            let labels = read(labels, Floats::Refuse)?;
            let scaled = values.scaled;
            arrays(path, (values.dims, values.data), (labels.dims, labels.data), scaled)
        }
        PartFile::Csv { path, label } => {
            let table = csv::read(&read_own(path)?, label)
                .map_err(|source| DataError::Csv { path: path.clone(), source })?;
            let csv::CsvTable { features, values, labels } = table;
            Ok(OwnPart { values, labels, features, image: None, scaled: false })
        }
    }
}

/// Joins an array of values and one of labels; neither has a dimension of 0.
fn arrays(
    path: &Path,
    (dims, values): (Vec<usize>, Vec<u8>),
    (label_dims, labels): (Vec<usize>, Vec<u8>),
    scaled: bool,
) -> Result<OwnPart, DataError> {
    let examples = dims.first().copied().unwrap_or(0);
    let flat = label_dims.first() == Some(&examples) && labels.len() == examples;
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
    Ok(OwnPart { values, labels, features, image, scaled })
}

/// Pixels whose channels stand side by side, put plane after plane.
fn planes(values: &[u8], features: usize, channels: usize) -> Vec<u8> {
    values
        .chunks_exact(features)
        .flat_map(|example| (0..channels).flat_map(|c| example.iter().skip(c).step_by(channels)))
        .copied()
        .collect()
}

#[cfg(test)]
#[path = "own_tests.rs"]
mod tests;
