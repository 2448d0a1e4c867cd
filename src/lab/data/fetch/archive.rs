//! Files of a set out of a gzip tar archive, wherever in the archive they lie.

use std::{ffi::OsStr, io::Read};

use flate2::read::MultiGzDecoder;

use super::{FetchError, stage::Stage};
use crate::lab::data::{catalog::CatalogFile, error::DataError};

/// Puts every wanted file of the archive in place.
pub(super) fn install(
    stage: &mut Stage<'_>,
    place: &str,
    source: impl Read,
) -> Result<(), DataError> {
    let mut archive = tar::Archive::new(MultiGzDecoder::new(source));
    let broken = |e: std::io::Error, file: &CatalogFile| FetchError::Content {
        file: place.to_owned(),
        found: format!("breaks off: {e}"),
        bytes: file.bytes,
        md5: file.md5,
    };
    let Some(first) = stage.wanted().first().copied() else { return Ok(()) };
    for entry in archive.entries().map_err(|e| broken(e, first))? {
        let mut entry = entry.map_err(|e| broken(e, first))?;
        let name = entry.path().ok().and_then(|p| p.file_name().map(OsStr::to_owned));
        let wanted =
            stage.wanted().into_iter().find(|file| name.as_deref() == Some(file.name.as_ref()));
        if let Some(file) = wanted.filter(|_| entry.header().entry_type().is_file()) {
            stage.install(file, &mut entry)?;
        }
        if stage.is_complete() {
            return Ok(());
        }
    }
    complete(stage, place)
}

/// Whether everything was there.
pub(super) fn complete(stage: &Stage<'_>, place: &str) -> Result<(), DataError> {
    let Some(file) = stage.wanted().first().copied() else { return Ok(()) };
    let advice = "check that it is the archive of this set, or try another origin".to_owned();
    Err(FetchError::Absent { place: place.to_owned(), file: file.name.to_owned(), advice }.into())
}
