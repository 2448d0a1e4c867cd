//! A sweep from its file to its table, in one call.

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::AtomicBool;

use super::{
    Carried, Options, Sweep, SweepError, SweepEvent, SweepPlan, carry_out, find, plan, report,
    results,
};
use crate::lab::data::DataRoot;
use crate::lab::store::index::Store;
use crate::lab::table::Table;

/// How far a sweep is.
///
/// See [`sweep`](crate::sweep::sweep()).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct SweepProgress {
    /// Runs that are finished, those of earlier times among them.
    pub finished: usize,
    /// Runs that failed.
    pub failed: usize,
    /// Runs.
    pub runs: usize,
    /// How much of what was to do is done, from 0 to 1.
    pub share: f64,
}

/// A sweep that was carried out, or as much of it as there was time for.
///
/// See [`sweep`](crate::sweep::sweep()).
#[derive(Debug)]
#[non_exhaustive]
pub struct Swept {
    /// Its name in the store.
    pub name: String,
    /// How it ended.
    pub carried: Carried,
    /// One row a point.
    pub table: Table,
    /// Its page.
    pub page: PathBuf,
}

/// Carries out the sweep of a file in a store, as `dalean sweep` does, and gives its table. Ends early when `stop` is set, which
/// may be done by another thread; what is finished by then is kept, and the same call goes on from there.
///
/// ```
/// use std::sync::atomic::AtomicBool;
///
/// use dalean::sweep::{SweepOptions, sweep};
/// use dalean::{Backend, DataRoot, Keeping};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let folder = std::env::temp_dir().join(format!("dalean-sweep-{}", std::process::id()));
/// std::fs::create_dir_all(&folder)?;
/// let file = folder.join("bits.toml");
/// let text = "[base]\ndata.set = \"xor\"\nnetwork.hidden = [4]\nlearning.epochs = 1\n\
///             [[axis]]\nname = \"bits\"\nkey = \"hw.cell.level_bits\"\nvalues = [4, 8]\n";
/// std::fs::write(&file, text)?;
/// let options = SweepOptions {
///     backend: Backend::best(),
///     jobs: 1,
///     keeping: Keeping::ALL,
///     shard: None,
///     replace: false,
/// };
/// let (root, stop) = (DataRoot::new("data"), AtomicBool::new(false));
/// let swept = sweep(&file, &[], &root, &folder.join("store"), options, &stop, &|_progress| {})?;
/// assert_eq!((swept.carried.finished, swept.table.len()), (2, 2));
/// # std::fs::remove_dir_all(&folder)?;
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// When the file makes no sweep, or disk or index refuse. A run that fails is no error: its row says so.
pub fn sweep(
    file: &Path,
    settings: &[String],
    data_root: &DataRoot,
    store: &Path,
    options: Options,
    stop: &AtomicBool,
    on_progress: &(dyn Fn(SweepProgress) + Sync),
) -> Result<Swept, SweepError> {
    let (plan, carried, store) =
        carried_out(file, settings, data_root, store, options, stop, on_progress)?;
    let name = plan.sweep.name.clone();
    let record = find(&store, Some(&name))?;
    let page = report(&store, &record, true)?.page;
    let table = results(&store, &record)?.table;
    Ok(Swept { name, carried, table, page })
}

/// Carries out a part of a sweep, the runs of a [`Shard`](super::Shard), beside other processes in the same store; no table and no page are
/// made. Ends early when `stop` is set.
///
/// # Errors
/// As [`sweep`].
pub fn sweep_part(
    file: &Path,
    settings: &[String],
    data_root: &DataRoot,
    store: &Path,
    options: Options,
    stop: &AtomicBool,
    on_progress: &(dyn Fn(SweepProgress) + Sync),
) -> Result<Carried, SweepError> {
    Ok(carried_out(file, settings, data_root, store, options, stop, on_progress)?.1)
}

/// How many runs the sweep of a file has: as many as it can be shared among.
///
/// # Errors
/// When the file makes no sweep.
pub fn sweep_runs(
    file: &Path,
    settings: &[String],
    data_root: &DataRoot,
) -> Result<usize, SweepError> {
    Ok(plan(Sweep::read(file)?, settings, data_root)?.tasks.len())
}

fn carried_out(
    file: &Path,
    settings: &[String],
    data_root: &DataRoot,
    store: &Path,
    options: Options,
    stop: &AtomicBool,
    on_progress: &(dyn Fn(SweepProgress) + Sync),
) -> Result<(SweepPlan, Carried, Store), SweepError> {
    let plan = plan(Sweep::read(file)?, settings, data_root)?;
    let mut store = Store::open(store)?;
    // what is done, of how much
    let seen = Mutex::new((SweepProgress::default(), 0.0, 0.0));
    let carried = carry_out(&plan, &mut store, options, stop, &|event| {
        let mut seen = seen.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let (progress, done, work) = &mut *seen;
        match event {
            SweepEvent::Started { finished, todo, work: all } => {
                (progress.finished, progress.runs, *work) = (finished, finished + todo, all);
            }
            SweepEvent::Work(some) => *done += some,
            SweepEvent::Finished { finished, .. } => progress.finished = finished,
            SweepEvent::Failed { .. } => progress.failed += 1,
            SweepEvent::Waiting { .. } => {}
        }
        progress.share = if *work > 0.0 { (*done / *work).min(1.0) } else { 1.0 };
        on_progress(*progress);
    })?;
    Ok((plan, carried, store))
}
