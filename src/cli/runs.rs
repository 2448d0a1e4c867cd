//! `runs`, `compare`: which runs there are, and what sets some of them apart.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use super::table::columns;
use super::{Done, environment, say, usage};
use crate::lab::config::Difference;
use crate::lab::report::compare::{Comparison, html};
use crate::lab::runs::{self, ListedRun, RunStatus};
use crate::lab::store::record::Score;

#[derive(Debug, Args)]
pub(super) struct RunsArgs {
    /// Folders of runs, stores, or runs [default: runs, or DALEAN_RUNS]
    #[arg(value_hint = clap::ValueHint::DirPath)]
    places: Vec<PathBuf>,
    /// One JSON object a line on standard output, each with an `event`
    #[arg(long)]
    json: bool,
    /// Print only the folders
    #[arg(long, short)]
    quiet: bool,
}

#[derive(Debug, Args)]
pub(super) struct CompareArgs {
    /// Folders of runs; states are compared with those of the first
    #[arg(required = true, num_args = 2.., value_hint = clap::ValueHint::DirPath)]
    runs: Vec<PathBuf>,
    /// Write a page that draws them over one another
    #[arg(long, value_name = "FILE", value_hint = clap::ValueHint::FilePath)]
    out: Option<PathBuf>,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
    /// Print only the table of what differs
    #[arg(long, short)]
    quiet: bool,
}

/// The folder of runs that a command means.
pub(super) fn runs_folder(given: Option<&PathBuf>) -> PathBuf {
    let named = || environment("DALEAN_RUNS").map(PathBuf::from);
    given.cloned().or_else(named).unwrap_or_else(|| PathBuf::from("runs"))
}

fn percent(score: Option<Score>) -> String {
    score.map_or_else(|| "-".into(), |score| format!("{:.2} %", 100.0 * score.fraction()))
}

/// What a run came to: of its test, and of its validation or evaluation.
fn result(run: &ListedRun, which: usize) -> String {
    match run.returns {
        Some(returns) => returns[which].map_or_else(|| "-".into(), |mean| format!("{mean:.2}")),
        None => percent([run.test, run.validation][which]),
    }
}

pub(super) fn list(args: &RunsArgs) -> Done {
    let places = if args.places.is_empty() { vec![runs_folder(None)] } else { args.places.clone() };
    let mut found = Vec::new();
    for place in &places {
        found.extend(runs::list(place)?);
    }
    if args.json {
        found.iter().for_each(|run| say(&run_json(run).to_string()));
        say(&json!({"event": "done", "runs": found.len()}).to_string());
        return Ok(());
    }
    if args.quiet {
        found.iter().for_each(|run| say(&run.folder.display().to_string()));
        return Ok(());
    }
    let head = ["run", "test", "validation", "epochs", "state", "what differs from saying nothing"];
    let mut lines = vec![head.map(str::to_owned).to_vec()];
    for run in &found {
        let mut differs: Vec<String> = run.differences.iter().map(Difference::text).collect();
        if run.seed != 1 {
            differs.push(format!("seed {}", run.seed));
        }
        if let RunStatus::Damaged(why) = &run.status {
            differs = vec![why.clone()];
        }
        lines.push(vec![
            run.folder.display().to_string(),
            result(run, 0),
            result(run, 1),
            format!("{}/{}", run.epochs[0], run.epochs[1]),
            run.status.name().into(),
            if differs.is_empty() { "-".into() } else { differs.join(", ") },
        ]);
    }
    if found.is_empty() {
        let names: Vec<_> = places.iter().map(|place| place.display().to_string()).collect();
        say(&format!("no runs in {}; `dalean train` makes one", names.join(", ")));
    } else {
        say(&columns(&lines, &[1, 2, 3]));
    }
    Ok(())
}

fn run_json(run: &ListedRun) -> serde_json::Value {
    let [data, rule, chip] = &run.what;
    let differs: serde_json::Map<_, _> = run
        .differences
        .iter()
        .map(|one| (one.key.clone(), json!({"value": one.value, "default": one.default})))
        .collect();
    let why = match &run.status {
        RunStatus::Damaged(why) => Some(why),
        _ => None,
    };
    let fraction = |score: Option<Score>| score.map(Score::fraction);
    let mut all = json!({"event": "run", "run": run.folder.display().to_string(), "state": run.status.name(),
        "why": why, "data": data, "rule": rule, "hardware": chip, "seed": run.seed,
        "differs": differs, "epochs": run.epochs[0], "epochs_total": run.epochs[1],
        "test_accuracy": fraction(run.test), "validation_accuracy": fraction(run.validation)});
    if let Some([test, evaluated]) = run.returns {
        all["return_mean"] = json!(test);
        all["return_evaluated"] = json!(evaluated);
    }
    all
}

pub(super) fn compare(args: &CompareArgs) -> Done {
    if args.runs.len() < 2 {
        return Err(usage("give two runs or more"));
    }
    let comparison = runs::compare(&args.runs)?;
    if let Some(path) = &args.out {
        let page = html(&comparison, env!("CARGO_PKG_VERSION"));
        super::out::write(path, page.as_bytes())?;
    }
    let page = args.out.as_ref().map(|path| path.display().to_string());
    if args.json {
        let mut all = compare_json(&comparison);
        if let Some(page) = page {
            all["page"] = json!(page);
        }
        say(&all.to_string());
        return Ok(());
    }
    let Comparison { runs, keys, results } = &comparison;
    let name = |at: usize| format!("({})", at + 1);
    if !args.quiet {
        for (at, run) in runs.iter().enumerate() {
            let epochs = run.records.last().map_or(0, |record| record.epoch);
            let unfinished = if run.status == "finished" {
                String::new()
            } else {
                format!("  unfinished: {epochs} of {} epochs", run.epochs)
            };
            say(&format!("{:>4} {}  {}{unfinished}", name(at), run.folder, run.title));
        }
        say("");
    }
    let mut lines = vec![vec![String::new()]];
    lines[0].extend((0..runs.len()).map(name));
    let absent = || "-".to_owned();
    for key in keys {
        let mut line = vec![key.key.clone()];
        line.extend(key.values.iter().map(|value| value.clone().unwrap_or_else(absent)));
        lines.push(line);
    }
    for result in results {
        let mut line = vec![result.name.to_owned()];
        line.extend(result.values.iter().map(|value| value.map_or_else(absent, number)));
        lines.push(line);
    }
    let right: Vec<usize> = (1..=runs.len()).collect();
    say(&columns(&lines, &right));
    if !args.quiet {
        say("");
    }
    if !comparison.same_data() {
        say("the runs learnt from different data");
    }
    for (at, run) in runs.iter().enumerate().skip(1) {
        say(&match run.differs_from {
            Some(0) => {
                format!("{} and (1) differ from the state before the first update on", name(at))
            }
            Some(epoch) => {
                format!("{} and (1) have the same states before epoch {epoch}", name(at))
            }
            None => {
                let both = run.records.len().min(runs[0].records.len()).saturating_sub(1);
                format!("{} and (1) have the same states up to epoch {both}", name(at))
            }
        });
    }
    if let Some(page) = page {
        say(&format!("page     {page}"));
    }
    Ok(())
}

/// A result in as many digits as a table needs.
fn number(value: f64) -> String {
    if value == 0.0 || (value.fract() == 0.0 && value.abs() < 1e15) {
        format!("{value}")
    } else if (0.001..1e6).contains(&value.abs()) {
        format!("{value:.4}")
    } else {
        format!("{value:.3e}")
    }
}

fn compare_json(comparison: &Comparison) -> serde_json::Value {
    let runs: Vec<_> = comparison
        .runs
        .iter()
        .map(|run| {
            json!({"run": run.folder, "title": run.title, "state": run.status, "data_hash": run.data,
                "epochs": run.records.last().map(|record| record.epoch),
                "state_hash": run.records.last().map(|record| &record.state_hash),
                "differs_from_first_in_epoch": run.differs_from, "notes": run.notes})
        })
        .collect();
    let keys: serde_json::Map<_, _> =
        comparison.keys.iter().map(|key| (key.key.clone(), json!(key.values))).collect();
    let results: serde_json::Map<_, _> =
        comparison.results.iter().map(|one| (one.name.to_owned(), json!(one.values))).collect();
    json!({"event": "compare", "runs": runs, "keys": keys, "results": results,
        "same_data": comparison.same_data()})
}
