//! The folder of a run: files written whole, read with limits, held by one process at a time.
#![expect(clippy::disallowed_methods, reason = "runs live in files")]

use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use super::record::{EpochRecord, Receipt, TimingRecord};

/// Greatest size of a text file that is read back.
const TEXT_MAX: u64 = 256 << 20;
/// Greatest size of a checkpoint that is read back.
const CHECKPOINT_MAX: u64 = 8 << 30;

/// Why a run folder cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// The system refused.
    #[error("cannot {doing} {path}: {error}{}", .hint)]
    Io {
        /// What was tried.
        doing: &'static str,
        /// Where.
        path: PathBuf,
        /// What the system says.
        error: io::Error,
        /// What to try.
        hint: &'static str,
    },
    /// A file's content is not what it should be.
    #[error("{path}: {found}; the run is damaged: start it again with the same configuration")]
    Content {
        /// Which file.
        path: PathBuf,
        /// What is wrong.
        found: String,
    },
    /// Another process holds the folder.
    #[error("{path} is in use by another process; wait for it or choose another folder")]
    Held {
        /// Which folder.
        path: PathBuf,
    },
}

fn io_error(doing: &'static str, path: &Path, error: io::Error) -> FolderError {
    let hint = match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded | io::ErrorKind::FileTooLarge => {
            "; free some space and go on, with train --resume or with the same sweep: the last finished epoch is kept"
        }
        io::ErrorKind::NotFound => "; is this the folder of a run?",
        io::ErrorKind::PermissionDenied => "; choose another folder with --out",
        _ => "",
    };
    FolderError::Io { doing, path: path.into(), error, hint }
}

/// The folder of a run, held while this value lives.
#[derive(Debug)]
pub struct RunFolder {
    path: PathBuf,
    _lock: File,
}

/// The files of a run folder.
pub mod names {
    /// Resolved configuration.
    pub const CONFIG: &str = "config.toml";
    /// One record an epoch.
    pub const METRICS: &str = "metrics.jsonl";
    /// All counts.
    pub const LEDGER: &str = "ledger.json";
    /// State after the last finished epoch.
    pub const CHECKPOINT: &str = "checkpoint.safetensors";
    /// Seconds and machine; the only file that a run which is done again does not give.
    pub const TIMING: &str = "timing.json";
    /// Hashes.
    pub const RECEIPT: &str = "receipt.json";
    /// For people.
    pub const REPORT: &str = "report.html";
}

impl RunFolder {
    /// Makes a new folder `name`, `name-2`, ... below `root`.
    ///
    /// # Errors
    /// When it cannot be made.
    pub fn create(root: &Path, name: &str) -> Result<Self, FolderError> {
        fs::create_dir_all(root).map_err(|e| io_error("make folder", root, e))?;
        for n in 1u32.. {
            let path = if n == 1 { root.join(name) } else { root.join(format!("{name}-{n}")) };
            match fs::create_dir(&path) {
                Ok(()) => return Self::hold(path),
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
                Err(e) => return Err(io_error("make folder", &path, e)),
            }
        }
        unreachable!("there are fewer than 2^32 folders")
    }

    /// Opens the folder of a run to continue it.
    ///
    /// # Errors
    /// When it is not there or another process holds it.
    pub fn open(path: &Path) -> Result<Self, FolderError> {
        let config = path.join(names::CONFIG);
        fs::metadata(&config).map_err(|e| io_error("open", &config, e))?;
        Self::hold(path.into())
    }

    /// Takes a folder, made if it is not there.
    ///
    /// # Errors
    /// When it cannot be made or another process holds it.
    pub fn take(path: &Path) -> Result<Self, FolderError> {
        fs::create_dir_all(path).map_err(|e| io_error("make folder", path, e))?;
        Self::hold(path.into())
    }

    fn hold(path: PathBuf) -> Result<Self, FolderError> {
        let lock_path = path.join("lock");
        let lock = File::create(&lock_path).map_err(|e| io_error("write", &lock_path, e))?;
        match lock.try_lock() {
            Ok(()) => Ok(Self { path, _lock: lock }),
            Err(fs::TryLockError::WouldBlock) => Err(FolderError::Held { path }),
            Err(fs::TryLockError::Error(e)) => Err(io_error("lock", &lock_path, e)),
        }
    }

    /// Where the folder is.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes a file whole: beside its place, flushed, then moved into it.
    ///
    /// # Errors
    /// When the system refuses; the old file is then still there.
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<(), FolderError> {
        let place = self.path.join(name);
        write_whole(&place, |file| file.write_all(bytes)).map_err(|e| io_error("write", &place, e))
    }

    /// Writes the records of all epochs.
    ///
    /// # Errors
    /// When the system refuses.
    ///
    /// # Panics
    /// Never: records have a JSON form.
    pub fn write_metrics(&self, records: &[EpochRecord]) -> Result<(), FolderError> {
        self.write(names::METRICS, metrics_text(records).as_bytes())
    }

    /// Writes the receipt.
    ///
    /// # Errors
    /// When the system refuses.
    ///
    /// # Panics
    /// Never: receipts have a JSON form.
    pub fn write_receipt(&self, receipt: &Receipt) -> Result<(), FolderError> {
        self.write(names::RECEIPT, receipt_text(receipt).as_bytes())
    }

    /// Writes what depends on machine and time.
    ///
    /// # Errors
    /// When the system refuses.
    ///
    /// # Panics
    /// Never: such a record has a JSON form.
    pub fn write_timing(&self, timing: &TimingRecord) -> Result<(), FolderError> {
        let mut text = serde_json::to_string_pretty(timing).expect("it has a JSON form");
        text.push('\n');
        self.write(names::TIMING, text.as_bytes())
    }

    /// Name of the file of the best state, reached in `epoch`.
    #[must_use]
    pub fn best_name(epoch: u32) -> String {
        format!("best-{epoch:05}.safetensors")
    }

    /// Removes files that a finished write has replaced: best states other than that of `keep`, and parts.
    pub fn tidy(&self, keep: Option<u32>) {
        let keep = keep.map(Self::best_name);
        self.remove(|name| name.starts_with("best-") && Some(name) != keep.as_deref());
    }

    /// Removes all states.
    pub fn forget_states(&self) {
        self.remove(|name| name.starts_with("best-") || name == names::CHECKPOINT);
    }

    /// Removes parts of files that were never finished, and what else is not wanted.
    fn remove(&self, unwanted: impl Fn(&str) -> bool) {
        let Ok(entries) = fs::read_dir(&self.path) else { return };
        for entry in entries.flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            if unwanted(&name) || name.starts_with(".part-") {
                let _ = fs::remove_file(entry.path());
            }
        }
    }
}

/// The text of `metrics.jsonl`: a line an epoch.
///
/// # Panics
/// Never: records have a JSON form.
#[must_use]
pub fn metrics_text(records: &[EpochRecord]) -> String {
    let mut text = String::new();
    for record in records {
        text.push_str(&serde_json::to_string(record).expect("records have a JSON form"));
        text.push('\n');
    }
    text
}

/// The text of `receipt.json`.
///
/// # Panics
/// Never: receipts have a JSON form.
#[must_use]
pub fn receipt_text(receipt: &Receipt) -> String {
    let mut text = serde_json::to_string_pretty(receipt).expect("receipts have a JSON form");
    text.push('\n');
    text
}

/// Writes a file whole: beside its place, flushed, then moved into it.
///
/// # Errors
/// When the system or `write` refuses; the old file is then still there.
pub fn write_whole(
    place: &Path,
    write: impl FnOnce(&mut File) -> io::Result<()>,
) -> io::Result<()> {
    let folder = place.parent().filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or_else(|| Path::new("."));
    let mut builder = tempfile::Builder::new();
    builder.prefix(".part-");
    #[cfg(unix)]
    let builder = {
        // readable by whom the user's mask allows, as any other file
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666))
    };
    let mut part = builder.tempfile_in(folder)?;
    write(part.as_file_mut())?;
    part.as_file().sync_all()?;
    part.persist(place).map_err(|error| error.error)?;
    // the move itself has to reach the disk; not every file system lets a folder be flushed
    if let Ok(folder) = File::open(folder) {
        let _ = folder.sync_all();
    }
    Ok(())
}

/// Reads a file of a run, up to a limit.
fn read_limited(path: &Path, limit: u64) -> Result<Vec<u8>, FolderError> {
    let file = File::open(path).map_err(|e| io_error("read", path, e))?;
    let mut bytes = Vec::new();
    file.take(limit + 1).read_to_end(&mut bytes).map_err(|e| io_error("read", path, e))?;
    if bytes.len() as u64 > limit {
        let found = format!("has more than {limit} bytes");
        return Err(FolderError::Content { path: path.into(), found });
    }
    Ok(bytes)
}

/// Reads a text file of a run.
///
/// # Errors
/// When it is missing, too large or not UTF-8.
pub fn read_text(folder: &Path, name: &str) -> Result<String, FolderError> {
    let path = folder.join(name);
    String::from_utf8(read_limited(&path, TEXT_MAX)?)
        .map_err(|e| FolderError::Content { path, found: e.to_string() })
}

/// Reads a checkpoint's bytes.
///
/// # Errors
/// When it is missing or too large.
pub fn read_checkpoint(folder: &Path, name: &str) -> Result<Vec<u8>, FolderError> {
    read_limited(&folder.join(name), CHECKPOINT_MAX)
}

/// Parses a receipt.
///
/// # Errors
/// What is wrong with it.
pub fn parse_receipt(text: &str) -> Result<Receipt, String> {
    serde_json::from_str(text).map_err(|e| e.to_string())
}

/// Parses the records of epochs, which count up from 0.
///
/// # Errors
/// What is wrong with them.
pub fn parse_metrics(text: &str) -> Result<Vec<EpochRecord>, String> {
    let mut records: Vec<EpochRecord> = Vec::new();
    for (line, text) in text.lines().enumerate() {
        let record: EpochRecord =
            serde_json::from_str(text).map_err(|e| format!("line {}: {e}", line + 1))?;
        if record.epoch as usize != line {
            return Err(format!("line {} is epoch {}, not {line}", line + 1, record.epoch));
        }
        records.push(record);
    }
    Ok(records)
}

/// Reads the receipt of a run.
///
/// # Errors
/// When it is missing or damaged.
pub fn read_receipt(folder: &Path) -> Result<Receipt, FolderError> {
    let text = read_text(folder, names::RECEIPT)?;
    parse_receipt(&text)
        .map_err(|found| FolderError::Content { path: folder.join(names::RECEIPT), found })
}

/// Reads what depends on machine and time; nothing of it when the file is missing or damaged, as no result needs it.
#[must_use]
pub fn read_timing(folder: &Path) -> TimingRecord {
    let text = read_text(folder, names::TIMING).ok();
    text.and_then(|text| serde_json::from_str(&text).ok()).unwrap_or_default()
}

/// Reads the records of a run.
///
/// # Errors
/// When they are missing or damaged.
pub fn read_metrics(folder: &Path) -> Result<Vec<EpochRecord>, FolderError> {
    let text = read_text(folder, names::METRICS)?;
    parse_metrics(&text)
        .map_err(|found| FolderError::Content { path: folder.join(names::METRICS), found })
}
