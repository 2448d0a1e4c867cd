//! The folder of a run: files written whole, read with limits, held by one process at a time.
use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::place;
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
    /// Held by the process that is at the run; empty.
    pub const LOCK: &str = "lock";
}

/// Whether a file of that name is part of a run: no lock, no part, nothing of somebody else.
#[must_use]
pub fn is_of_run(name: &str) -> bool {
    use names::{CHECKPOINT, CONFIG, LEDGER, METRICS, RECEIPT, REPORT, TIMING};
    let best = name.strip_prefix("best-").and_then(|rest| rest.strip_suffix(".safetensors"));
    let is_best =
        best.is_some_and(|n| (5..=10).contains(&n.len()) && n.bytes().all(|b| b.is_ascii_digit()));
    is_best || [CONFIG, METRICS, LEDGER, CHECKPOINT, TIMING, RECEIPT, REPORT].contains(&name)
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
        for folder in path.parent().into_iter().chain([path]) {
            place::make_folder(folder).map_err(|e| io_error("make folder", folder, e))?;
        }
        Self::hold(path.into())
    }

    fn hold(path: PathBuf) -> Result<Self, FolderError> {
        let lock_path = path.join(names::LOCK);
        let mut options = OpenOptions::new();
        options.read(true).write(true).create(true).truncate(false);
        let lock = place::open(&lock_path, &mut options, false);
        let lock = lock.map_err(|e| io_error("lock", &lock_path, e))?;
        match lock.try_lock() {
            Ok(()) => {
                // whoever held it before has ended: what it left half written is nobody's
                place::clear_held(&path);
                Ok(Self { path, _lock: lock })
            }
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
        place::write_whole(&place, |file| file.write_all(bytes))
            .map_err(|e| io_error("write", &place, e))
    }

    /// Writes the records so far, whole, and gives what the next ones are put behind.
    ///
    /// # Errors
    /// When the system refuses.
    ///
    /// # Panics
    /// Never: records have a JSON form.
    pub fn begin_metrics(&self, records: &[EpochRecord]) -> Result<MetricsLog, FolderError> {
        let text = metrics_text(records);
        self.write(names::METRICS, text.as_bytes())?;
        let path = self.path.join(names::METRICS);
        let file = place::open(&path, OpenOptions::new().write(true), false);
        let file = file.map_err(|e| io_error("write", &path, e))?;
        let mut hash = blake3::Hasher::new();
        hash.update(text.as_bytes());
        Ok(MetricsLog { path, file, bytes: text.len() as u64, records: records.len(), hash })
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

    /// Copies a file of another run's folder, whole.
    ///
    /// # Errors
    /// When it is no plain file, or the system refuses.
    pub fn copy(&self, source: &Path, name: &str) -> Result<(), FolderError> {
        let [from, to] = [source, &self.path].map(|folder| folder.join(name));
        let file = place::open(&from, OpenOptions::new().read(true), false);
        let mut file = file.map_err(|e| io_error("read", &from, e))?;
        place::write_whole(&to, |to| io::copy(&mut file, to).map(drop))
            .map_err(|e| io_error("write", &to, e))
    }

    /// Name of the file of the best state, reached in `epoch`.
    #[must_use]
    pub fn best_name(epoch: u32) -> String {
        format!("best-{epoch:05}.safetensors")
    }

    /// Removes files that a finished write has replaced: best states other than that of `keep`.
    pub fn tidy(&self, keep: Option<u32>) {
        let keep = keep.map(Self::best_name);
        self.remove(|name| name.starts_with("best-") && Some(name) != keep.as_deref());
    }

    /// Removes all states.
    pub fn forget_states(&self) {
        self.remove(|name| name.starts_with("best-") || name == names::CHECKPOINT);
    }

    fn remove(&self, unwanted: impl Fn(&str) -> bool) {
        let Ok(entries) = fs::read_dir(&self.path) else { return };
        for entry in entries.flatten() {
            if entry.file_name().to_str().is_some_and(&unwanted) {
                let _ = fs::remove_file(entry.path());
            }
        }
    }
}

/// `metrics.jsonl` while a run goes on: each record is written once, behind those before it. A kill may leave half a line
/// at the end; the receipt says how many lines count, and who continues writes those alone.
#[derive(Debug)]
pub struct MetricsLog {
    path: PathBuf,
    file: File,
    bytes: u64,
    records: usize,
    hash: blake3::Hasher,
}

impl MetricsLog {
    /// Writes those of all records that are not there yet.
    ///
    /// # Errors
    /// When the system refuses; the file then holds what it held.
    ///
    /// # Panics
    /// Never: records have a JSON form.
    pub fn grow(&mut self, records: &[EpochRecord]) -> Result<(), FolderError> {
        let text = metrics_text(records.get(self.records..).unwrap_or_default());
        let file = &mut self.file;
        let written = file
            .seek(SeekFrom::Start(self.bytes))
            .and_then(|_| file.write_all(text.as_bytes()))
            .and_then(|()| file.sync_data());
        if let Err(error) = written {
            let _ = file.set_len(self.bytes);
            return Err(io_error("write", &self.path, error));
        }
        self.bytes += text.len() as u64;
        self.records = records.len();
        self.hash.update(text.as_bytes());
        Ok(())
    }

    /// BLAKE3 of what is written.
    #[must_use]
    pub fn hash(&self) -> String {
        self.hash.finalize().to_hex().to_string()
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

/// Reads a file of a run, up to a limit.
fn read_limited(path: &Path, limit: u64) -> Result<Vec<u8>, FolderError> {
    let file = place::open(path, OpenOptions::new().read(true), true);
    let file = file.map_err(|e| io_error("read", path, e))?;
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
    let mut known = false;
    for (line, text) in text.lines().enumerate() {
        let record: EpochRecord =
            serde_json::from_str(text).map_err(|e| format!("line {}: {e}", line + 1))?;
        if record.epoch as usize != line {
            return Err(format!("line {} is epoch {}, not {line}", line + 1, record.epoch));
        }
        // a program that knew of it said it of every layer, and went on to
        let told = record.layers.iter().filter(|layer| layer.mute.is_some()).count();
        if (known || told > 0) && told < record.layers.len() {
            return Err(format!("line {}: a layer lacks `mute`, which others have", line + 1));
        }
        known |= told > 0;
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
