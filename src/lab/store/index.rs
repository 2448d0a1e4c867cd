//! A store: run folders by key, and an index of them.
//!
//! ```text
//! STORE/runs/ab/abcd...   a run folder, named by its key (see `address`)
//! STORE/index.sqlite      run: key, row     sweep: name, text     point: sweep, number, seed, values, key [, row]
//! ```
//!
//! The folders are the truth. A row is what `lab::sweep` reads off a finished folder, kept so that ten thousand of
//! them need not be opened for a report; it can always be made again, and a row whose folder is gone counts for nothing.
//! A store may come from anywhere: keys and names are checked before they become paths, and no link is followed out of
//! it. Several processes may use a store: a run belongs
//! to who holds the lock of its folder, and the system lets go of that lock when a process ends, however it ends.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use rusqlite::{Connection, OptionalExtension, params};

use super::folder::names;
use super::{address, place};

/// Version of the tables below.
const LAYOUT: i64 = 2;
/// Name of the index.
pub const INDEX: &str = "index.sqlite";
/// Name of the folder of all runs.
const RUNS: &str = "runs";
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
    /// Something in the index that no program of ours wrote there.
    #[error(
        "{path} holds {found}; nothing was read. It was damaged or made by someone else: remove it, and `dalean store index` \
         makes the rows again from the run folders"
    )]
    Foreign {
        /// The index.
        path: PathBuf,
        /// What was found.
        found: String,
    },
    /// Another sweep of that name.
    #[error(
        "{path} has another sweep `{name}`; give this one another `name`, or replace the plan of that one with --replace: \
         its runs stay"
    )]
    OtherSweep {
        /// The store.
        path: PathBuf,
        /// The name.
        name: String,
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
        let runs = path.join(RUNS);
        place::make_folder(&runs).map_err(|error| StoreError::Io {
            doing: "make folder",
            path: runs,
            error,
        })?;
        Self::connect(path)
    }

    /// Opens a store that is there.
    ///
    /// # Errors
    /// When it is not there or another version made it.
    pub fn existing(path: &Path) -> Result<Self, StoreError> {
        if place::is_plain(&path.join(INDEX)) {
            Self::connect(path)
        } else {
            Err(StoreError::Missing { path: path.into() })
        }
    }

    /// Opens a store that is there, though its index may not be.
    ///
    /// # Errors
    /// When it has no runs either, or another version made it.
    pub fn with_runs(path: &Path) -> Result<Self, StoreError> {
        if path.join(RUNS).is_dir() { Self::open(path) } else { Self::existing(path) }
    }

    fn connect(path: &Path) -> Result<Self, StoreError> {
        let file = path.join(INDEX);
        let fail = |error| index_error(&file, error);
        if fs::symlink_metadata(&file).is_ok_and(|found| !found.is_file()) {
            let found = "no plain file".into();
            return Err(StoreError::Foreign { path: file, found });
        }
        place::clear_parts(path);
        let mut index = Connection::open(&file).map_err(fail)?;
        index.busy_timeout(PATIENCE).map_err(fail)?;
        // what a stranger put into the index is never carried out
        index.pragma_update(None, "trusted_schema", false).map_err(fail)?;
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
    ///
    /// # Panics
    /// When it is no key: those of an index are checked when they are read.
    #[must_use]
    pub fn place(key: &str) -> String {
        assert!(address::is_key(key), "a key becomes a path only when it is one");
        format!("{RUNS}/{}/{key}", &key[..2])
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

    /// Whether a finished run is known and its folder still there.
    ///
    /// # Errors
    /// When the index refuses.
    pub fn is_finished(&self, key: &str) -> Result<bool, StoreError> {
        Ok(self.row(key)?.is_some() && self.has_folder(key))
    }

    /// Whether the folder of a run holds a receipt.
    #[must_use]
    pub fn has_folder(&self, key: &str) -> bool {
        self.folder(key).join(names::RECEIPT).exists()
    }

    /// Forgets the rows of all runs but these; gives how many that were.
    ///
    /// # Errors
    /// When the index refuses; then none is forgotten.
    pub fn forget_others(&mut self, keys: &[String]) -> Result<usize, StoreError> {
        let known = self.rows()?;
        let keys: std::collections::BTreeSet<_> = keys.iter().collect();
        let fail = self.fail();
        let change = self.index.transaction().map_err(&fail)?;
        let mut forgotten = 0;
        for (key, ..) in known.iter().filter(|(key, ..)| !keys.contains(key)) {
            forgotten += change.execute("DELETE FROM run WHERE key = ?1", [key]).map_err(&fail)?;
        }
        change.commit().map_err(fail)?;
        Ok(forgotten)
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
        let rows = rows.map_err(self.fail())?;
        let rows: Vec<(String, String, f64)> =
            rows.collect::<Result<_, _>>().map_err(self.fail())?;
        rows.iter().try_for_each(|(key, ..)| self.check_key(key))?;
        Ok(rows)
    }

    fn foreign(&self, what: &str, word: &str) -> StoreError {
        // a word may be long, and may hold anything
        let word: String = word.chars().take(40).flat_map(char::escape_debug).collect();
        StoreError::Foreign { path: self.path.join(INDEX), found: format!("{what} `{word}`") }
    }

    fn check_key(&self, key: &str) -> Result<(), StoreError> {
        if address::is_key(key) { Ok(()) } else { Err(self.foreign("as the key of a run", key)) }
    }

    /// Keeps a sweep and its points. Another sweep of that name is refused or, with `replace`, replaced; its runs stay.
    ///
    /// # Errors
    /// When there is another one, or the index refuses; then nothing has changed.
    pub fn plan(
        &mut self,
        sweep: &SweepRecord,
        points: &[PointRecord],
        replace: bool,
    ) -> Result<(), StoreError> {
        let fail = self.fail();
        let change = self
            .index
            .transaction_with_behavior(rusqlite::TransactionBehavior::Immediate)
            .map_err(&fail)?;
        let text = "SELECT text, experiment FROM sweep WHERE name = ?1";
        let known = change.query_row(text, [&sweep.name], |row| Ok((row.get(0)?, row.get(1)?)));
        let known: Option<(String, String)> = known.optional().map_err(&fail)?;
        let same = |(text, experiment): &(String, String)| {
            (text, experiment) == (&sweep.text, &sweep.experiment)
        };
        if !replace && known.as_ref().is_some_and(|known| !same(known)) {
            return Err(StoreError::OtherSweep {
                path: self.path.clone(),
                name: sweep.name.clone(),
            });
        }
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
        let rows = rows.map_err(self.fail())?;
        let sweeps: Vec<SweepRecord> = rows.collect::<Result<_, _>>().map_err(self.fail())?;
        // a name becomes the name of a file
        match sweeps.iter().find(|sweep| !address::is_name(&sweep.name)) {
            None => Ok(sweeps),
            Some(sweep) => Err(self.foreign("as the name of a sweep", &sweep.name)),
        }
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
        let rows = rows.map_err(self.fail())?;
        let points: Vec<(PointRecord, _)> = rows.collect::<Result<_, _>>().map_err(self.fail())?;
        let mut keys = points.iter().filter_map(|(point, _)| point.key.as_ref());
        keys.try_for_each(|key| self.check_key(key))?;
        Ok(points)
    }

    /// Keys of all run folders, by key, whether or not the index knows them.
    ///
    /// # Errors
    /// When folders cannot be listed.
    pub fn folders(&self) -> Result<Vec<String>, StoreError> {
        let list = |path: &Path| -> Result<Vec<PathBuf>, StoreError> {
            let fail = |error| StoreError::Io { doing: "list", path: path.into(), error };
            let entries = fs::read_dir(path).map_err(fail)?;
            let entries: Vec<_> = entries.collect::<Result<_, _>>().map_err(fail)?;
            // folders: no files, and no links to elsewhere
            let folder = |entry: &fs::DirEntry| entry.file_type().is_ok_and(|kind| kind.is_dir());
            Ok(entries.iter().filter(|entry| folder(entry)).map(fs::DirEntry::path).collect())
        };
        let mut keys = Vec::new();
        for group in list(&self.path.join(RUNS))? {
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
        store.plan(&sweep, &points, false).unwrap();
        let other = Store::existing(folder.path()).unwrap();
        assert_eq!(other.sweeps().unwrap(), std::slice::from_ref(&sweep));
        let found = other.points("s").unwrap();
        assert_eq!(found.iter().map(|(p, _)| p.clone()).collect::<Vec<_>>(), points);
        assert_eq!(
            found.iter().map(|(_, row)| row.is_some()).collect::<Vec<_>>(),
            [true, false, false]
        );
        store.plan(&sweep, &points[..1], false).unwrap();
        assert_eq!((other.points("s").unwrap().len(), other.rows().unwrap().len()), (1, 1));
        assert_eq!(other.row(&key).unwrap().as_deref(), Some("{}"));
    }

    #[test]
    fn another_sweep_of_that_name_is_refused_unless_it_is_to_be_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let mut store = Store::open(folder.path()).unwrap();
        let sweep = |text: &str| SweepRecord {
            name: "s".into(),
            text: text.into(),
            experiment: String::new(),
        };
        store.plan(&sweep("a"), &[point(1, None)], false).unwrap();
        store.plan(&sweep("a"), &[point(1, None)], false).unwrap();
        let error = store.plan(&sweep("b"), &[], false).unwrap_err().to_string();
        assert!(error.contains("another sweep `s`") && error.contains("--replace"), "{error}");
        assert_eq!(store.sweeps().unwrap(), [sweep("a")]);
        store.plan(&sweep("b"), &[], true).unwrap();
        assert_eq!(store.sweeps().unwrap(), [sweep("b")]);
    }

    #[test]
    fn words_of_a_strangers_index_never_become_paths() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path()).unwrap();
        let put = |text: &str| store.index.execute_batch(text).unwrap();
        put("INSERT INTO sweep VALUES ('../x', '', '')");
        let error = store.sweeps().unwrap_err().to_string();
        assert!(error.contains("name of a sweep `../x`"), "{error}");
        put("DELETE FROM sweep; INSERT INTO run VALUES ('a', '{}', 1.0)");
        let error = store.rows().unwrap_err().to_string();
        assert!(error.contains("key of a run `a`"), "{error}");
        put("INSERT INTO point VALUES ('s', 1, 1, '[]', '../../../../../../etc', NULL, NULL)");
        let error = store.points("s").unwrap_err().to_string();
        assert!(error.contains("key of a run `../../"), "{error}");
    }

    #[cfg(unix)]
    #[test]
    fn an_index_that_is_a_link_is_not_followed() {
        let [folder, far] = [0, 1].map(|_| tempfile::tempdir().unwrap());
        let target = far.path().join("someone's.sqlite");
        std::os::unix::fs::symlink(&target, folder.path().join(INDEX)).unwrap();
        assert!(matches!(Store::open(folder.path()), Err(StoreError::Foreign { .. })));
        assert!(matches!(Store::existing(folder.path()), Err(StoreError::Missing { .. })));
        assert!(!target.exists());
    }

    #[test]
    fn a_place_without_runs_is_no_store_whose_index_could_be_made() {
        let folder = tempfile::tempdir().unwrap();
        let typo = folder.path().join("typo");
        assert!(matches!(Store::with_runs(&typo), Err(StoreError::Missing { .. })));
        assert!(!typo.exists());
    }

    #[test]
    fn a_file_that_is_no_index_is_said_to_be_none() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join(INDEX);
        let text = "not a data base, not at all, not even a little bit".repeat(40);
        place::write_whole(&file, |file| file.write_all(text.as_bytes())).unwrap();
        let error = Store::open(folder.path()).unwrap_err().to_string();
        assert!(error.contains("remove it") && error.contains(INDEX), "{error}");
    }
}
