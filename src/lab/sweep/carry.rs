//! Carrying out the runs of a plan: one thread a run, several runs at a time, with other processes in the same store.
//!
//! A run is taken by locking its folder. What another process holds is left until the rest is done, and then asked for
//! again: either it is finished by then, or the other process ended and the lock is free.

use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard};
use std::time::Duration;

use super::row::{row, row_as};
use super::{PlannedRun, Row, Shard, SweepError, SweepPlan};
use crate::chip::crossbar::kernel::Backend;
use crate::lab::run::{self, Keeping, Machine, Prices, RunError};
use crate::lab::store::ARITHMETIC;
use crate::lab::store::folder::{self, FolderError, RunFolder};
use crate::lab::store::index::Store;

/// Pause before asking again for what another process holds.
const PAUSE: Duration = Duration::from_millis(200);

/// How runs are carried out; none of it changes a result.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// Which loops run.
    pub backend: Backend,
    /// Runs at a time.
    pub jobs: usize,
    /// Which files they leave.
    pub keeping: Keeping,
    /// Which of the runs are this process's.
    pub shard: Option<Shard>,
    /// Whether another sweep of that name in the store is replaced.
    pub replace: bool,
}

/// What happens meanwhile.
#[derive(Debug)]
pub enum SweepEvent<'a> {
    /// It is about to start.
    Started {
        /// Runs that are finished already.
        finished: usize,
        /// Runs to do.
        todo: usize,
        /// Work of those.
        work: f64,
    },
    /// So much work was done.
    Work(f64),
    /// A run is finished.
    Finished {
        /// Which.
        task: &'a PlannedRun,
        /// Its results.
        row: &'a Row,
        /// Seconds its learning took.
        seconds: f64,
        /// Whether another process did it.
        elsewhere: bool,
        /// Runs finished, of all.
        finished: usize,
    },
    /// A run failed; the others go on.
    Failed {
        /// Which.
        task: &'a PlannedRun,
        /// Why.
        error: &'a str,
    },
    /// Only runs that other processes hold are left.
    Waiting {
        /// How many.
        runs: usize,
    },
}

/// How it ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Carried {
    /// Runs of this shard.
    pub runs: usize,
    /// Of these, finished.
    pub finished: usize,
    /// Of these, failed.
    pub failed: usize,
}

struct Crew<'a> {
    plan: &'a SweepPlan,
    options: Options,
    store: Mutex<&'a mut Store>,
    queue: Mutex<VecDeque<&'a PlannedRun>>,
    held: Mutex<VecDeque<&'a PlannedRun>>,
    finished: AtomicUsize,
    failed: AtomicUsize,
    stop: &'a AtomicBool,
    broken: Mutex<Option<SweepError>>,
    on_event: &'a (dyn Fn(SweepEvent<'_>) + Sync),
}

/// What came of a run.
enum Came {
    Done { row: Row, seconds: f64, elsewhere: bool },
    Held,
    Stopped,
}

/// Plans the sweep in the store and carries out what is not finished. Ends early when `stop` is set.
///
/// # Errors
/// When disk or index refuse; what is finished by then is kept.
pub fn carry_out(
    plan: &SweepPlan,
    store: &mut Store,
    options: Options,
    stop: &AtomicBool,
    on_event: &(dyn Fn(SweepEvent<'_>) + Sync),
) -> Result<Carried, SweepError> {
    let (sweep, points) = plan.records();
    store.plan(&sweep, &points, options.replace)?;
    let mine = |at: &usize| options.shard.is_none_or(|shard| shard.has(*at));
    let tasks: Vec<&PlannedRun> =
        (0..plan.tasks.len()).filter(mine).map(|at| &plan.tasks[at]).collect();
    let mut todo = VecDeque::new();
    for &task in &tasks {
        if !store.is_finished(&task.key)? {
            todo.push_back(task);
        }
    }
    let finished = tasks.len() - todo.len();
    let work = todo.iter().map(|task| task.work).sum();
    on_event(SweepEvent::Started { finished, todo: todo.len(), work });
    let jobs = options.jobs.min(todo.len());
    let crew = Crew {
        plan,
        options,
        store: Mutex::new(store),
        queue: Mutex::new(todo),
        held: Mutex::default(),
        finished: AtomicUsize::new(finished),
        failed: AtomicUsize::new(0),
        stop,
        broken: Mutex::new(None),
        on_event,
    };
    std::thread::scope(|scope| {
        for job in 0..jobs {
            let named = std::thread::Builder::new().name(format!("run {job}"));
            if named.spawn_scoped(scope, || crew.work()).is_err() {
                // the system gives no more threads: those it gave do the work, or this one
                if job == 0 {
                    crew.work();
                }
                break;
            }
        }
    });
    if let Some(error) = lock(&crew.broken).take() {
        return Err(error);
    }
    price_points(plan, &mut lock(&crew.store))?;
    let of = |count: &AtomicUsize| count.load(Ordering::SeqCst);
    let (finished, failed) = (of(&crew.finished), of(&crew.failed));
    Ok(Carried { runs: tasks.len(), finished, failed })
}

/// Gives points whose run was priced with other constants than theirs rows of their own.
fn price_points(plan: &SweepPlan, store: &mut Store) -> Result<(), SweepError> {
    let mut own = Vec::new();
    for planned in &plan.points {
        let (Ok(key), Some(prices)) = (&planned.key, &planned.prices) else { continue };
        let Some(kept) = store.row(key)?.filter(|_| store.has_folder(key)) else { continue };
        let kept: Option<Row> = serde_json::from_str(&kept).ok();
        if kept.is_none_or(|kept| kept.priced_with != prices.fingerprint()) {
            let (row, _) = row_as(&store.folder(key), Some(Prices::clone(prices)))?;
            own.push((planned.point.number, row.to_json()));
        }
    }
    Ok(store.price(&plan.sweep.name, &own)?)
}

/// A run that panicked left nothing half done behind these locks.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

impl<'a> Crew<'a> {
    fn stopped(&self) -> bool {
        self.stop.load(Ordering::SeqCst) || lock(&self.broken).is_some()
    }

    fn work(&self) {
        let mut announced = false;
        while !self.stopped() {
            let fresh = lock(&self.queue).pop_front();
            let task = match fresh {
                Some(task) => task,
                None => {
                    let (next, left) = {
                        let mut held = lock(&self.held);
                        let left = held.len();
                        (held.pop_front(), left)
                    };
                    let Some(task) = next else { return };
                    if !announced {
                        announced = true;
                        (self.on_event)(SweepEvent::Waiting { runs: left });
                    }
                    std::thread::sleep(PAUSE);
                    task
                }
            };
            // a fault of ours in one run must not lose the others
            let came = catch_unwind(AssertUnwindSafe(|| self.run(task))).unwrap_or_else(|cause| {
                let text = cause.downcast_ref::<String>().map(String::as_str);
                let text = text.or_else(|| cause.downcast_ref::<&str>().copied()).unwrap_or("?");
                Err(Trouble::Run(format!("this is a fault of the program: {text}")))
            });
            match came {
                Ok(Came::Done { row, seconds, elsewhere }) => {
                    let finished = self.finished.fetch_add(1, Ordering::SeqCst) + 1;
                    let row = &row;
                    (self.on_event)(SweepEvent::Finished {
                        task,
                        row,
                        seconds,
                        elsewhere,
                        finished,
                    });
                }
                Ok(Came::Held) => lock(&self.held).push_back(task),
                Ok(Came::Stopped) => return,
                Err(Trouble::Run(error)) => {
                    self.failed.fetch_add(1, Ordering::SeqCst);
                    let noted = lock(&self.store).refuse(&task.key, &error);
                    (self.on_event)(SweepEvent::Failed { task, error: &error });
                    if let Err(error) = noted {
                        lock(&self.broken).get_or_insert(error.into());
                    }
                }
                Err(Trouble::Place(error)) => {
                    lock(&self.broken).get_or_insert(*error);
                }
            }
        }
    }

    fn run(&self, task: &PlannedRun) -> Result<Came, Trouble> {
        let path = lock(&self.store).folder(&task.key);
        let folder = match RunFolder::take(&path) {
            Ok(folder) => folder,
            Err(FolderError::Held { .. }) => return Ok(Came::Held),
            Err(error) => return Err(Trouble::place(RunError::from(error))),
        };
        let data = &self.plan.data[task.data];
        // a finished run that cannot be read, as a power cut may leave it, is done again
        if is_finished(&path, task)
            && let Ok((row, seconds)) = row(&path)
        {
            self.index(task, &row, seconds)?;
            (self.on_event)(SweepEvent::Work(task.work));
            return Ok(Came::Done { row, seconds, elsewhere: true });
        }
        let machine = Machine::new(self.options.backend, 1).expect("one thread");
        let config = self.plan.config(task).map_err(|error| Trouble::Run(error.to_string()))?;
        let samples = f64::from(task.epochs) * data.split.train.len().max(1) as f64;
        let mut before = None;
        let outcome =
            run::carry_on(&config, data, folder, machine, self.options.keeping, &mut |event| {
                if let run::RunEvent::Batch(progress) = event {
                    let seen =
                        f64::from(progress.epoch) * progress.total as f64 + progress.done as f64;
                    let done = seen - before.replace(seen).unwrap_or(0.0);
                    (self.on_event)(SweepEvent::Work(task.work * done / samples));
                }
                !self.stopped()
            });
        match outcome {
            Ok(_) => {
                let (row, seconds) = row(&path).map_err(Trouble::place)?;
                self.index(task, &row, seconds)?;
                Ok(Came::Done { row, seconds, elsewhere: false })
            }
            Err(RunError::Stopped { .. }) => Ok(Came::Stopped),
            Err(error @ RunError::Folder(_)) => Err(Trouble::place(error)),
            Err(error) => Err(Trouble::Run(error.to_string())),
        }
    }

    /// Puts a finished run into the index.
    fn index(&self, task: &PlannedRun, row: &Row, seconds: f64) -> Result<(), Trouble> {
        let kept = lock(&self.store).keep(&[(task.key.clone(), row.to_json(), seconds)]);
        kept.map_err(Trouble::place)
    }
}

/// What went wrong: with this run alone, or with the place all runs are kept in.
enum Trouble {
    Run(String),
    Place(Box<SweepError>),
}

impl Trouble {
    fn place(error: impl Into<SweepError>) -> Self {
        Self::Place(Box::new(error.into()))
    }
}

/// Whether a folder holds the finished run of this task.
fn is_finished(path: &Path, task: &PlannedRun) -> bool {
    folder::read_receipt(path).is_ok_and(|receipt| {
        receipt.status == "finished" && receipt.arithmetic == ARITHMETIC && receipt.run == task.key
    })
}
