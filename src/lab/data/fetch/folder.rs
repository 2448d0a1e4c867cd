//! A set out of a folder: its files plain or gzip, or the authors' archive.
#![expect(clippy::disallowed_methods, reason = "data sets live in files")]

use std::{
    fs::File,
    io::{BufReader, Read},
    path::{Path, PathBuf},
};

use flate2::read::MultiGzDecoder;

use super::{FetchError, FetchEvent, archive, stage::Stage};
use crate::lab::data::{
    catalog::{CatalogFile, MirrorForm},
    error::DataError,
};

/// Puts the files of `from` in place.
pub(super) fn get(stage: &mut Stage<'_>, from: &Path) -> Result<(), DataError> {
    stage.tell(FetchEvent::Trying { place: from.display().to_string() });
    for file in stage.wanted() {
        if let Some(path) = names(file).map(|name| from.join(name)).find(|path| path.is_file()) {
            let opened = open(&path)?;
            let mut source: Box<dyn Read> = match path.extension() {
                Some(end) if end == "gz" => Box::new(MultiGzDecoder::new(opened)),
                _ => Box::new(opened),
            };
            stage.install(file, &mut source)?;
        }
    }
    let bundle = match stage.entry.mirror_form {
        MirrorForm::TarGz(name) => Some(from.join(name)).filter(|path| path.is_file()),
        MirrorForm::GzipEach => None,
    };
    if let Some(path) = bundle.filter(|_| !stage.is_complete()) {
        archive::install(stage, &path.display().to_string(), open(&path)?)?;
    }
    let Some(file) = stage.wanted().first().copied() else { return Ok(()) };
    let looked: Vec<_> = names(file).map(|name| name.display().to_string()).collect();
    let advice = format!("it was looked for as {}", looked.join(", "));
    let place = from.display().to_string();
    Err(FetchError::Absent { place, file: file.name.to_owned(), advice }.into())
}

/// Names that a file goes by.
fn names(file: &CatalogFile) -> impl Iterator<Item = PathBuf> {
    let dotted = file.name.replace("-idx", ".idx");
    let names = [file.name.to_owned(), dotted, format!("cifar-10-batches-bin/{}", file.name)];
    let used = if file.name.ends_with(".bin") { [0, 2] } else { [0, 1] };
    used.into_iter()
        .flat_map(move |at| [names[at].clone(), format!("{}.gz", names[at])])
        .map(PathBuf::from)
}

fn open(path: &Path) -> Result<BufReader<File>, DataError> {
    File::open(path).map(BufReader::new).map_err(DataError::io("open", path))
}
