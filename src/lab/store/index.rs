//! A store: run folders by key, and an index of them.
//!
//! ```text
//! STORE/runs/ab/abcd...   a run folder, named by its key (see `address`)
//! STORE/index.sqlite      run: key, row     sweep: name, text     point: sweep, number, seed, values, key [, row]
//! ```
//!
//! The folders are the truth. A row is what `lab::sweep` reads off a finished folder, kept so that ten thousand of
//! them need not be opened for a report; it can always be made again. Several processes may use a store: a run belongs
//! to who holds the lock of its folder, and the system lets go of that lock when a process ends, however it ends.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use rusqlite::{Connection, OptionalExtension, params};

use super::address;

/// Version of the tables below.
const LAYOUT: i64 = 2;
/// Name of the index.
pub const INDEX: &str = "index.sqlite";
/// How long to wait for another process that writes.
const PATIENCE: Duration = Duration::from_secs(120);

const TABLES: &str = "
CREATE TABLE run (key TEXT PRIMARY KEY, row TEXT NOT NULL, seconds REAL NOT NULL) WITHOUT ROWID;
CREATE TABLE sweep (name TEXT PRIMARY KEY, text TEXT NOT NULL, experiment TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE point (sweep TEXT NOT NULL, number INTEGER NOT NULL, seed INTEGER, axes TEXT NOT NULL,
    key TEXT, refused TEXT, row TEXT, PRIMARY KEY (sweep, number)) WITHOUT ROWID;
";

/// Why a store cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The index refused.
    #[error("{path}: {error}{hint}")]
    Index {
        /// The index.
        path: PathBuf,
        /// What SQLite says.
        error: rusqlite::Error,
        /// What to try.
        hint: &'static str,
    },
    /// There is no store.
    #[error(
        "{path} is no store: it has no {INDEX}; `dalean sweep FILE.toml --store {path}` makes one"
    )]
    Missing {
        /// Where it was looked for.
        path: PathBuf,
    },
    /// Made by another version.
    #[error(
        "{path} has layout {found}, this program reads {LAYOUT}; use the version of dalean that made it"
    )]
    Layout {
        /// The index.
        path: PathBuf,
        /// What it has.
        found: i64,
    },
    /// The system refused.
    #[error("cannot {doing} {path}: {error}; free some space or choose another place with --store")]
    Io {
        /// What was tried.
        doing: &'static str,
        /// Where.
        path: PathBuf,
        /// What the system says.
        error: std::io::Error,
    },
}

/// A sweep as the index keeps it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SweepRecord {
    /// Its name.
    pub name: String,
    /// Its file.
    pub text: String,
    /// The experiment file it starts from; empty when there is none.
    pub experiment: String,
}

/// A point of a sweep as the index keeps it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PointRecord {
    /// Number, from 1.
    pub number: u32,
    /// Seed, when the sweep has seeds.
    pub seed: Option<u64>,
    /// Axis values: a JSON list in the order of the axes.
    pub axes: String,
    /// Key of its run; none when it cannot be run.
    pub key: Option<String>,
    /// Why it cannot be run.
    pub refused: Option<String>,
}

/// A store.
#[derive(Debug)]
pub struct Store {
    path: PathBuf,
    index: Connection,
}

impl Store {
    /// Opens a store, made if it is not there.
    ///
    /// # Errors
    /// When it cannot be made or another version made it.
    pub fn open(path: &Path) -> Result<Self, StoreError> {
        fs::create_dir_all(path.join("runs")).map_err(|error| StoreError::Io {
            doing: "make folder",
            path: path.into(),
            error,
        })?;
        Self::connect(path)
    }

    /// Opens a store that is there.
    ///
    /// # Errors
    /// When it is not there or another version made it.
    pub fn existing(path: &Path) -> Result<Self, StoreError> {
        if path.join(INDEX).is_file() {
            Self::connect(path)
        } else {
            Err(StoreError::Missing { path: path.into() })
        }
    }

    fn connect(path: &Path) -> Result<Self, StoreError> {
        let file = path.join(INDEX);
        let fail = |error| index_error(&file, error);
        let mut index = Connection::open(&file).map_err(fail)?;
        index.busy_timeout(PATIENCE).map_err(fail)?;
        // two processes may find the store new at once: the one that comes second finds the tables made
        let making = index
            .transaction_with_behavior(rusqlite::TransactionBehavior::Immediate)
            .map_err(fail)?;
        let layout: i64 =
            making.query_row("PRAGMA user_version", [], |row| row.get(0)).map_err(fail)?;
        match layout {
            LAYOUT => {}
            0 => {
                making.execute_batch(TABLES).map_err(fail)?;
                making.pragma_update(None, "user_version", LAYOUT).map_err(fail)?;
            }
            found => return Err(StoreError::Layout { path: file, found }),
        }
        making.commit().map_err(fail)?;
        Ok(Self { path: path.into(), index })
    }

    fn fail(&self) -> impl Fn(rusqlite::Error) -> StoreError + use<> {
        let file = self.path.join(INDEX);
        move |error| index_error(&file, error)
    }

    /// Where the store is.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The folder of a run, below the store: `runs/ab/abcd...`.
    #[must_use]
    pub fn place(key: &str) -> String {
        format!("runs/{}/{key}", &key[..2])
    }

    /// The folder of a run.
    #[must_use]
    pub fn folder(&self, key: &str) -> PathBuf {
        self.path.join(Self::place(key))
    }

    /// The row of a finished run.
    ///
    /// # Errors
    /// When the index refuses.
    pub fn row(&self, key: &str) -> Result<Option<String>, StoreError> {
        let mut query =
            self.index.prepare_cached("SELECT row FROM run WHERE key = ?1").map_err(self.fail())?;
        query.query_row([key], |row| row.get(0)).optional().map_err(self.fail())
    }

    /// Keeps the rows of finished runs, with the seconds each took. What is there is replaced.
    ///
    /// # Errors
    /// When the index refuses; then none is kept.
    pub fn keep(&mut self, rows: &[(String, String, f64)]) -> Result<(), StoreError> {
        let fail = self.fail();
        let change = self.index.transaction().map_err(&fail)?;
        {
            let text = "INSERT OR REPLACE INTO run (key, row, seconds) VALUES (?1, ?2, ?3)";
            let mut insert = change.prepare_cached(text).map_err(&fail)?;
            for (key, row, seconds) in rows {
                insert.execute(params![key, row, seconds]).map_err(&fail)?;
            }
        }
        change.commit().map_err(fail)
    }

    /// Keys, rows and seconds of all finished runs, by key.
    ///
    /// # Errors
    /// When the index refuses.
    pub fn rows(&self) -> Result<Vec<(String, String, f64)>, StoreError> {
        let text = "SELECT key, row, seconds FROM run ORDER BY key";
        let mut query = self.index.prepare(text).map_err(self.fail())?;
        let rows = query.query_map([], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)));
        rows.map_err(self.fail())?.collect::<Result<_, _>>().map_err(self.fail())
    }

    /// Keeps a sweep and its points; an older sweep of that name is replaced, its runs stay.
    ///
    /// # Errors
    /// When the index refuses; then nothing has changed.
    pub fn plan(&mut self, sweep: &SweepRecord, points: &[PointRecord]) -> Result<(), StoreError> {
        let fail = self.fail();
        let change = self
            .index
            .transaction_with_behavior(rusqlite::TransactionBehavior::Immediate)
            .map_err(&fail)?;
        let text = "INSERT OR REPLACE INTO sweep (name, text, experiment) VALUES (?1, ?2, ?3)";
        change.execute(text, params![sweep.name, sweep.text, sweep.experiment]).map_err(&fail)?;
        change.execute("DELETE FROM point WHERE sweep = ?1", [&sweep.name]).map_err(&fail)?;
        {
            let text = "INSERT INTO point (sweep, number, seed, axes, key, refused) VALUES (?1, ?2, ?3, ?4, ?5, ?6)";
            let mut insert = change.prepare_cached(text).map_err(&fail)?;
            for point in points {
                // a seed above i64 keeps its bits
                let seed = point.seed.map(|seed| seed.cast_signed());
                let PointRecord { number, axes, key, refused, .. } = point;
                insert
                    .execute(params![sweep.name, number, seed, axes, key, refused])
                    .map_err(&fail)?;
            }
        }
        change.commit().map_err(fail)
    }

    /// Keeps rows of points whose run was priced with other constants than theirs.
    ///
    /// # Errors
    /// When the index refuses; then none is kept.
    pub fn price(&mut self, sweep: &str, rows: &[(u32, String)]) -> Result<(), StoreError> {
        let fail = self.fail();
        let change = self.index.transaction().map_err(&fail)?;
        {
            let text = "UPDATE point SET row = ?3 WHERE sweep = ?1 AND number = ?2";
            let mut update = change.prepare_cached(text).map_err(&fail)?;
            for (number, row) in rows {
                update.execute(params![sweep, number, row]).map_err(&fail)?;
            }
        }
        change.commit().map_err(fail)
    }

    /// Notes why a run cannot be finished, at every point that needs it.
    ///
    /// # Errors
    /// When the index refuses.
    pub fn refuse(&mut self, key: &str, why: &str) -> Result<(), StoreError> {
        let text = "UPDATE point SET refused = ?2 WHERE key = ?1";
        self.index.execute(text, params![key, why]).map_err(self.fail())?;
        Ok(())
    }

    /// All sweeps, by name.
    ///
    /// # Errors
    /// When the index refuses.
    pub fn sweeps(&self) -> Result<Vec<SweepRecord>, StoreError> {
        let text = "SELECT name, text, experiment FROM sweep ORDER BY name";
        let mut query = self.index.prepare(text).map_err(self.fail())?;
        let rows = query.query_map([], |row| {
            Ok(SweepRecord { name: row.get(0)?, text: row.get(1)?, experiment: row.get(2)? })
        });
        rows.map_err(self.fail())?.collect::<Result<_, _>>().map_err(self.fail())
    }

    /// Points of a sweep by number, each with the row of its run if that is finished.
    ///
    /// # Errors
    /// When the index refuses.
    pub fn points(&self, sweep: &str) -> Result<Vec<(PointRecord, Option<String>)>, StoreError> {
        let text = "SELECT number, seed, axes, point.key, refused, COALESCE(point.row, run.row) FROM point \
                    LEFT JOIN run ON run.key = point.key \
                    WHERE sweep = ?1 ORDER BY number";
        let mut query = self.index.prepare(text).map_err(self.fail())?;
        let rows = query.query_map([sweep], |row| {
            let seed: Option<i64> = row.get(1)?;
            let point = PointRecord {
                number: row.get(0)?,
                seed: seed.map(i64::cast_unsigned),
                axes: row.get(2)?,
                key: row.get(3)?,
                refused: row.get(4)?,
            };
            Ok((point, row.get(5)?))
        });
        rows.map_err(self.fail())?.collect::<Result<_, _>>().map_err(self.fail())
    }

    /// Keys of all run folders, by key, whether or not the index knows them.
    ///
    /// # Errors
    /// When folders cannot be listed.
    pub fn folders(&self) -> Result<Vec<String>, StoreError> {
        let list = |path: &Path| -> Result<Vec<PathBuf>, StoreError> {
            let fail = |error| StoreError::Io { doing: "list", path: path.into(), error };
            let entries = fs::read_dir(path).map_err(fail)?;
            entries
                .map(|entry| entry.map(|entry| entry.path()))
                .collect::<Result<_, _>>()
                .map_err(fail)
        };
        let mut keys = Vec::new();
        for group in list(&self.path.join("runs"))? {
            for folder in list(&group)? {
                let name = folder.file_name().map(|name| name.to_string_lossy().into_owned());
                keys.extend(name.filter(|name| address::is_key(name)));
            }
        }
        keys.sort();
        Ok(keys)
    }
}

fn index_error(path: &Path, error: rusqlite::Error) -> StoreError {
    use rusqlite::ErrorCode;
    let hint = match error.sqlite_error_code() {
        Some(ErrorCode::DiskFull | ErrorCode::SystemIoFailure) => {
            "; free some space and give the same command again: finished runs are kept"
        }
        Some(ErrorCode::NotADatabase | ErrorCode::DatabaseCorrupt) => {
            "; remove it and give the sweep's command again: the index is made again from the run folders"
        }
        Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked) => {
            "; another process has been writing for two minutes: does the file system support locks?"
        }
        Some(ErrorCode::ReadOnly | ErrorCode::PermissionDenied | ErrorCode::CannotOpen) => {
            "; choose a place you may write with --store"
        }
        _ => "",
    };
    StoreError::Index { path: path.into(), error, hint }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    fn point(number: u32, key: Option<&str>) -> PointRecord {
        let refused = key.is_none().then(|| "too wide".to_owned());
        let key = key.map(|key| key.repeat(32));
        PointRecord { number, seed: Some(u64::MAX), axes: format!("[{number}]"), key, refused }
    }

    #[test]
    fn what_is_kept_comes_back_and_a_new_plan_leaves_runs_alone() {
        let folder = tempfile::tempdir().unwrap();
        assert!(matches!(Store::existing(folder.path()), Err(StoreError::Missing { .. })));
        let mut store = Store::open(folder.path()).unwrap();
        let key = "a".repeat(32);
        store.keep(&[(key.clone(), "{}".into(), 1.5)]).unwrap();
        let sweep = SweepRecord { name: "s".into(), text: "t".into(), experiment: String::new() };
        let points = [point(1, Some("a")), point(2, Some("b")), point(3, None)];
        store.plan(&sweep, &points).unwrap();
        let other = Store::existing(folder.path()).unwrap();
        assert_eq!(other.sweeps().unwrap(), std::slice::from_ref(&sweep));
        let found = other.points("s").unwrap();
        assert_eq!(found.iter().map(|(p, _)| p.clone()).collect::<Vec<_>>(), points);
        assert_eq!(
            found.iter().map(|(_, row)| row.is_some()).collect::<Vec<_>>(),
            [true, false, false]
        );
        store.plan(&sweep, &points[..1]).unwrap();
        assert_eq!((other.points("s").unwrap().len(), other.rows().unwrap().len()), (1, 1));
        assert_eq!(other.row(&key).unwrap().as_deref(), Some("{}"));
    }

    #[test]
    fn a_file_that_is_no_index_is_said_to_be_none() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join(INDEX);
        let text = "not a data base, not at all, not even a little bit".repeat(40);
        crate::lab::store::folder::write_whole(&file, |file| file.write_all(text.as_bytes()))
            .unwrap();
        let error = Store::open(folder.path()).unwrap_err().to_string();
        assert!(error.contains("remove it") && error.contains(INDEX), "{error}");
    }
}
