//! Runs on disk, as the command line has them: train, continue, verify, price, report, sweep.

use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use dalean::deployment::{ChipResult, Deployment, deploy, seconds_of, summed_up, unread};
use dalean::sweep::{
    Format, SweepError, SweepOptions, SweepProgress, Swept, Values, sweep as carry_out,
};
use dalean::{
    Config, DataRoot, EpochRecord, Keeping, RunError, RunEvent, Sources, TestOutcome, Verdict,
};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::errors::{Raised, of_chips, wrong};
use crate::waits::{Watch, machine};

/// Reads and checks a configuration.
fn load(
    text: Option<(String, String)>,
    hw: Option<String>,
    settings: Vec<String>,
    seed: Option<u64>,
) -> Result<Config, Raised> {
    let experiment = text.as_ref().map(|(name, text)| (&**name, &**text));
    let hardware = hw.as_deref();
    let sources = Sources { experiment, hardware, settings: &settings, seed, ..Sources::default() };
    Ok(Config::load(&sources)?)
}

/// The resolved configuration, with every default, as TOML.
#[pyfunction]
#[pyo3(signature = (text, hw, settings, seed))]
pub(crate) fn configuration(
    text: Option<(String, String)>,
    hw: Option<String>,
    settings: Vec<String>,
    seed: Option<u64>,
) -> PyResult<String> {
    Ok(load(text, hw, settings, seed)?.to_toml())
}

fn root(data: PathBuf, moved: Option<PathBuf>) -> DataRoot {
    let root = DataRoot::new(data);
    match moved {
        Some(place) => root.with_files(place),
        None => root,
    }
}

/// Tells what happens, and asks whether to go on.
fn heard(watch: &mut Watch, folder: &mut Option<PathBuf>, event: &RunEvent<'_>) -> bool {
    match event {
        RunEvent::Started { folder: path, data, .. } => {
            *folder = Some(path.to_path_buf());
            watch.tell("started", data)
        }
        RunEvent::Batch(at) => watch.go_on("batch", || {
            let numbers = [at.epoch, at.epochs].map(f64::from);
            let [done, total] = [at.done, at.total].map(|number| number as f64);
            vec![("epoch", numbers[0]), ("epochs", numbers[1]), ("done", done), ("total", total)]
        }),
        RunEvent::Epoch(record, _) => watch.tell("epoch", &said(record)),
        RunEvent::Warning(warning) => watch.tell("warning", warning),
        _ => true,
    }
}

/// An epoch in a few words.
fn said(record: &EpochRecord) -> String {
    match record.validation().or(record.train()) {
        Some(score) => format!("epoch {} {:.4}", record.epoch, score.fraction()),
        None => format!("epoch {}", record.epoch),
    }
}

fn ended(
    watch: Watch,
    folder: Option<PathBuf>,
    done: Result<dalean::Trained, RunError>,
) -> PyResult<(PathBuf, String)> {
    if let Some(error) = watch.error {
        return Err(error);
    }
    let trained = done.map_err(Raised::from)?;
    Ok((folder.unwrap_or_default(), trained.summary))
}

/// Trains in a new folder below `out`: the folder, and the summary.
#[pyfunction]
#[pyo3(signature = (text, hw, settings, seed, out, data, threads, kernel, record, callback))]
#[expect(clippy::too_many_arguments, reason = "the package gives all of them")]
pub(crate) fn train(
    py: Python<'_>,
    text: Option<(String, String)>,
    hw: Option<String>,
    settings: Vec<String>,
    seed: Option<u64>,
    out: PathBuf,
    data: PathBuf,
    threads: usize,
    kernel: Option<String>,
    record: bool,
    callback: Option<Py<PyAny>>,
) -> PyResult<(PathBuf, String)> {
    let machine = machine(kernel.as_deref(), threads)?;
    let config = load(text, hw, settings, seed)?;
    if record && config.policy_experiment().map_err(Raised::from)?.is_none() {
        let allowed = "examples lie in files already: leave it out";
        return Err(wrong("record", "keeps what environments show", allowed));
    }
    let keeping = if record { Keeping::STREAMS } else { Keeping::ALL };
    let (mut watch, mut folder) = (Watch::new(callback), None);
    let done = py.detach(|| {
        dalean::train_keeping(&config, &root(data, None), &out, machine, keeping, &mut |event| {
            heard(&mut watch, &mut folder, &event)
        })
    });
    ended(watch, folder, done)
}

/// Continues a run from its last finished epoch.
#[pyfunction]
#[pyo3(signature = (path, data, moved, threads, kernel, callback))]
pub(crate) fn resume(
    py: Python<'_>,
    path: PathBuf,
    data: PathBuf,
    moved: Option<PathBuf>,
    threads: usize,
    kernel: Option<String>,
    callback: Option<Py<PyAny>>,
) -> PyResult<(PathBuf, String)> {
    let machine = machine(kernel.as_deref(), threads)?;
    let (mut watch, mut folder) = (Watch::new(callback), None);
    let done = py.detach(|| {
        dalean::resume(&path, &root(data, moved), machine, &mut |event| {
            heard(&mut watch, &mut folder, &event)
        })
    });
    ended(watch, folder, done)
}

/// Does a run again and compares everything.
#[pyfunction]
#[pyo3(signature = (path, data, moved, threads, kernel, epochs, callback))]
#[expect(clippy::too_many_arguments, reason = "the package gives all of them")]
pub(crate) fn verify<'py>(
    py: Python<'py>,
    path: PathBuf,
    data: PathBuf,
    moved: Option<PathBuf>,
    threads: usize,
    kernel: Option<String>,
    epochs: Option<u32>,
    callback: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let machine = machine(kernel.as_deref(), threads)?;
    let mut watch = Watch::new(callback);
    let verdict = py.detach(|| {
        dalean::verify(&path, &root(data, moved), machine, epochs, &mut |at| {
            watch.go_on("batch", || {
                vec![
                    ("epoch", f64::from(at.epoch)),
                    ("epochs", f64::from(at.epochs)),
                    ("done", at.done as f64),
                    ("total", at.total as f64),
                ]
            })
        })
    });
    if let Some(error) = watch.error {
        return Err(error);
    }
    let told = PyDict::new(py);
    match verdict.map_err(Raised::from)? {
        Verdict::Same { epochs, state_hash, test, unchecked } => {
            told.set_item("same", true)?;
            told.set_item("epochs", epochs)?;
            told.set_item("state_hash", state_hash)?;
            told.set_item("test", test)?;
            told.set_item("unchecked", unchecked)?;
        }
        Verdict::Different { what, wanted, found } => {
            told.set_item("same", false)?;
            told.set_item("what", what)?;
            told.set_item("wanted", wanted)?;
            told.set_item("found", found)?;
        }
        other => told.set_item("what", format!("{other:?}"))?,
    }
    Ok(told)
}

/// Reads the test set with the state of a run: right answers and examples, or nothing of a policy; and the state's hash.
#[pyfunction]
#[pyo3(signature = (path, data, moved, threads, kernel))]
pub(crate) fn evaluate(
    py: Python<'_>,
    path: PathBuf,
    data: PathBuf,
    moved: Option<PathBuf>,
    threads: usize,
    kernel: Option<String>,
) -> PyResult<(Option<(u64, u64)>, String)> {
    let machine = machine(kernel.as_deref(), threads)?;
    let (test, hash) =
        py.detach(|| dalean::evaluate(&path, &root(data, moved), machine)).map_err(Raised::from)?;
    let score = match test {
        TestOutcome::Classify(test) => Some((test.score.correct, test.score.total)),
        _ => None,
    };
    Ok((score, hash))
}

/// Reads a run on other chips and after a time: `(chip, seconds after programming, score)` each, and what a model has that
/// was not looked at.
#[pyfunction]
#[pyo3(signature = (path, data, moved, threads, kernel, chips, after, compensate, hw, settings, callback))]
#[expect(clippy::too_many_arguments, reason = "the package gives all of them")]
pub(crate) fn chips(
    py: Python<'_>,
    path: PathBuf,
    data: PathBuf,
    moved: Option<PathBuf>,
    threads: usize,
    kernel: Option<String>,
    chips: Vec<u64>,
    after: Vec<f64>,
    compensate: bool,
    hw: Option<String>,
    settings: Vec<String>,
    callback: Option<Py<PyAny>>,
) -> PyResult<(Vec<ChipRow>, Option<String>)> {
    let machine = machine(kernel.as_deref(), threads)?;
    let asked = Deployment { after, chips, compensated: compensate, device: hw, settings };
    let all = (asked.chips.len() * asked.after.len().max(1)) as f64;
    let (mut watch, mut done) = (Watch::new(callback), 0.0);
    let read = py.detach(|| -> Result<_, RunError> {
        let unread = unread(&asked)?;
        let read = deploy(&path, &root(data, moved), machine, &asked, &mut |_| {
            done += 1.0;
            watch.go_on("chips", || vec![("done", done), ("total", all)])
        })?;
        Ok((read.iter().map(row).collect(), unread))
    });
    match watch.error {
        Some(error) => Err(error),
        None => Ok(read.map_err(of_chips)?),
    }
}

/// Chip, seconds after programming, score.
type ChipRow = (u64, Option<f64>, f64);

fn row(result: &ChipResult) -> ChipRow {
    (result.chip, result.after_s, result.score)
}

/// What chips came to, moment by moment: seconds after programming, chips, mean, standard deviation, quantiles, least, greatest, the worst
/// chip.
#[pyfunction]
#[expect(clippy::type_complexity, reason = "a row, named in the package")]
pub(crate) fn chip_summaries(
    rows: Vec<ChipRow>,
) -> Vec<(Option<f64>, usize, f64, Option<f64>, [f64; 5], f64, f64, u64)> {
    let result = |(chip, after_s, score)| ChipResult { chip, after_s, score };
    let results: Vec<ChipResult> = rows.into_iter().map(result).collect();
    let of = summed_up(&results).into_iter();
    of.map(|s| (s.after_s, s.chips, s.mean, s.sd, s.quantiles, s.least, s.greatest, s.worst_chip))
        .collect()
}

/// Seconds of a span such as `1d`.
#[pyfunction]
pub(crate) fn seconds(span: &str) -> Option<f64> {
    seconds_of(span)
}

/// What a finished run cost, as JSON.
#[pyfunction]
#[pyo3(signature = (path, hw))]
pub(crate) fn price(py: Python<'_>, path: PathBuf, hw: Option<String>) -> PyResult<String> {
    Ok(py.detach(|| dalean::priced(&path, hw.as_deref())).map_err(Raised::from)?)
}

/// Draws the page of a run again: where it is, and the summary.
#[pyfunction]
#[pyo3(signature = (path, data, moved))]
pub(crate) fn report(
    py: Python<'_>,
    path: PathBuf,
    data: PathBuf,
    moved: Option<PathBuf>,
) -> PyResult<(PathBuf, String)> {
    let made =
        py.detach(|| dalean::report(&path, Some(&root(data, moved)))).map_err(Raised::from)?;
    Ok((made.path, made.summary))
}

/// Carries a sweep out: its name, columns as `(name, label, unit, cells)`, page, `[runs, finished, failed]`, and its table as
/// Parquet.
#[pyfunction]
#[pyo3(signature = (file, settings, store, data, jobs, kernel, keep_states, replace, callback))]
#[expect(clippy::too_many_arguments, reason = "the package gives all of them")]
pub(crate) fn sweep<'py>(
    py: Python<'py>,
    file: PathBuf,
    settings: Vec<String>,
    store: PathBuf,
    data: PathBuf,
    jobs: usize,
    kernel: Option<String>,
    keep_states: bool,
    replace: bool,
    callback: Option<Py<PyAny>>,
) -> PyResult<(String, Bound<'py, PyList>, PathBuf, [usize; 3], Vec<u8>)> {
    let options = options(jobs, kernel.as_deref(), keep_states, replace)?;
    let swept = watched(py, callback, |stop, note| {
        carry_out(&file, &settings, &root(data, None), &store, options, stop, note)
    })?;
    let Swept { name, carried, table, page, .. } = swept;
    let columns = PyList::empty(py);
    for column in &table.columns {
        let cells = match &column.values {
            Values::Whole(cells) => PyList::new(py, cells)?,
            Values::Real(cells) => PyList::new(py, cells)?,
            Values::Text(cells) => PyList::new(py, cells)?,
        };
        columns.append((&column.name, &column.label, column.unit.sign(), cells))?;
    }
    let mut parquet = Vec::new();
    table.write(Format::Parquet, &mut parquet).map_err(Raised::from)?;
    Ok((name, columns, page, [carried.runs, carried.finished, carried.failed], parquet))
}

/// How many runs a sweep has.
#[pyfunction]
pub(crate) fn sweep_runs(
    py: Python<'_>,
    file: PathBuf,
    settings: Vec<String>,
    data: PathBuf,
) -> PyResult<usize> {
    let runs = py.detach(|| dalean::sweep::sweep_runs(&file, &settings, &root(data, None)));
    Ok(runs.map_err(Raised::from)?)
}

/// The runs of a shard, `I/N`: how many it has, how many are finished, how many failed. Each keeps a checkpoint after every epoch.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "the package gives all of them by name")]
pub(crate) fn sweep_part(
    py: Python<'_>,
    file: PathBuf,
    settings: Vec<String>,
    store: PathBuf,
    data: PathBuf,
    kernel: Option<String>,
    keep_states: bool,
    replace: bool,
    shard: &str,
) -> PyResult<[usize; 3]> {
    let mut options = options(1, kernel.as_deref(), keep_states, replace)?;
    options.keeping.every = Duration::ZERO;
    let part = shard.parse();
    let wrong = |allowed: String| wrong("shard", &format!("is {shard:?}"), &allowed);
    options.shard = Some(part.map_err(wrong)?);
    let carried = watched(py, None, |stop, note| {
        dalean::sweep::sweep_part(&file, &settings, &root(data, None), &store, options, stop, note)
    })?;
    Ok([carried.runs, carried.finished, carried.failed])
}

fn options(
    jobs: usize,
    kernel: Option<&str>,
    keep_states: bool,
    replace: bool,
) -> PyResult<SweepOptions> {
    let machine = machine(kernel, jobs)?;
    let mut keeping = Keeping::ALL;
    (keeping.states, keeping.every) = (keep_states, Duration::from_secs(10));
    let (backend, jobs) = (machine.backend(), machine.threads());
    Ok(SweepOptions { backend, jobs, keeping, shard: None, replace })
}

/// Hears how far a sweep is.
type Note<'a> = &'a (dyn Fn(SweepProgress) + Sync);

/// Does the long work of a sweep in another thread, while this one hears the user.
fn watched<T: Send>(
    py: Python<'_>,
    callback: Option<Py<PyAny>>,
    work: impl FnOnce(&AtomicBool, Note<'_>) -> Result<T, SweepError> + Send,
) -> PyResult<T> {
    let (stop, at) = (AtomicBool::new(false), Mutex::new(SweepProgress::default()));
    let mut watch = Watch::new(callback);
    let done = py.detach(|| {
        std::thread::scope(|scope| {
            let work = scope.spawn(|| {
                let note = |progress| {
                    *at.lock().unwrap_or_else(std::sync::PoisonError::into_inner) = progress;
                };
                work(&stop, &note)
            });
            while !work.is_finished() {
                std::thread::sleep(Duration::from_millis(5));
                let go_on = watch.go_on("sweep", || {
                    let at = *at.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
                    let numbers = [at.finished, at.failed, at.runs].map(|number| number as f64);
                    vec![
                        ("finished", numbers[0]),
                        ("failed", numbers[1]),
                        ("runs", numbers[2]),
                        ("share", at.share),
                    ]
                });
                if !go_on {
                    stop.store(true, Ordering::SeqCst);
                }
            }
            work.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        })
    });
    match watch.error {
        Some(error) => Err(error),
        None => Ok(done.map_err(Raised::from)?),
    }
}
