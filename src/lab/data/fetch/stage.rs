//! Putting files in place: checked, flushed, renamed; never half-written.
#![expect(clippy::disallowed_methods, reason = "data sets live in files")]

use std::{
    fs::File,
    io::{self, Read, Write},
    path::{Path, PathBuf},
};

use super::{FetchError, FetchEvent};
use crate::lab::data::{
    catalog::{CatalogEntry, CatalogFile},
    error::DataError,
    md5::Md5,
};

/// The folder of a set while it is being filled.
pub(super) struct Stage<'a> {
    pub(super) entry: &'static CatalogEntry,
    pub(super) folder: PathBuf,
    /// Files that are not in place yet.
    wanted: Vec<&'static CatalogFile>,
    progress: &'a mut dyn FnMut(FetchEvent),
}

impl<'a> Stage<'a> {
    /// Looks at what is in place already.
    pub(super) fn new(
        entry: &'static CatalogEntry,
        folder: PathBuf,
        progress: &'a mut dyn FnMut(FetchEvent),
    ) -> Result<Self, DataError> {
        let mut wanted = Vec::new();
        for file in entry.files {
            if is_right(&folder.join(file.name), file)? {
                progress(FetchEvent::Present { file: file.name.to_owned() });
            } else {
                wanted.push(file);
            }
        }
        Ok(Self { entry, folder, wanted, progress })
    }

    /// Whether every file is in place.
    pub(super) fn is_complete(&self) -> bool {
        self.wanted.is_empty()
    }

    /// Files that are not in place yet.
    pub(super) fn wanted(&self) -> Vec<&'static CatalogFile> {
        self.wanted.clone()
    }

    /// Tells the caller.
    pub(super) fn tell(&mut self, event: FetchEvent) {
        (self.progress)(event);
    }

    /// A file kept beside the set, such as a download under way.
    pub(super) fn beside(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// Puts the content of `source` in the place of `file` if it is the right one.
    pub(super) fn install(
        &mut self,
        file: &'static CatalogFile,
        source: &mut dyn Read,
    ) -> Result<(), DataError> {
        let path = self.folder.join(file.name);
        let write_error = || DataError::io("write", &path);
        let content = |found| FetchError::Content {
            file: file.name.to_owned(),
            found,
            bytes: file.bytes,
            md5: file.md5,
        };
        let mut beside = temporary(&self.folder).map_err(write_error())?;
        let (mut hash, mut bytes) = (Md5::default(), 0u64);
        let mut buffer = vec![0; 1 << 16];
        loop {
            let count = match source.read(&mut buffer) {
                Ok(0) => break,
                Ok(count) => count,
                Err(e) if e.kind() == io::ErrorKind::Interrupted => continue,
                Err(e) => return Err(content(format!("breaks off: {e}")).into()),
            };
            bytes += u64::try_from(count).expect("a buffer is small");
            if bytes > file.bytes {
                return Err(content("is too long".to_owned()).into());
            }
            hash.update(&buffer[..count]);
            beside.write_all(&buffer[..count]).map_err(write_error())?;
        }
        let md5 = hash.hex();
        if bytes != file.bytes || md5 != file.md5 {
            return Err(content(format!("has {bytes} bytes with the MD5 {md5}")).into());
        }
        beside.as_file().sync_all().map_err(write_error())?;
        beside.persist(&path).map_err(|e| write_error()(e.error))?;
        sync_folder(&self.folder);
        self.wanted.retain(|other| other.name != file.name);
        self.tell(FetchEvent::Installed { file: file.name.to_owned() });
        Ok(())
    }
}

fn temporary(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".fetch-");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder)
}

/// Makes a renaming last. Not every system lets a folder be opened, so this is best effort.
fn sync_folder(folder: &Path) {
    if let Ok(folder) = File::open(folder) {
        let _ = folder.sync_all();
    }
}

fn is_right(path: &Path, wanted: &CatalogFile) -> Result<bool, DataError> {
    let mut file = match File::open(path) {
        Ok(file) => file,
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(false),
        Err(e) => return Err(DataError::io("open", path)(e)),
    };
    if file.metadata().map_err(DataError::io("look at", path))?.len() != wanted.bytes {
        return Ok(false);
    }
    let mut hash = Md5::default();
    let mut buffer = vec![0; 1 << 16];
    loop {
        match file.read(&mut buffer).map_err(DataError::io("read", path))? {
            0 => return Ok(hash.hex() == wanted.md5),
            count => hash.update(&buffer[..count]),
        }
    }
}
