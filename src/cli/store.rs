//! `store`: what a store holds, putting stores together, making the index again.

use std::path::PathBuf;

use clap::Subcommand;
use indicatif::ProgressBar;
use serde_json::json;

use super::{Done, Failure, say};
use crate::lab::store::index::{PointRecord, Store};
use crate::lab::sweep::{self, Reindexed, Skipped, SweepError};

#[derive(Debug, Subcommand)]
pub(super) enum StoreCommand {
    /// List the sweeps of a store and how far they are
    List {
        /// The store
        store: PathBuf,
        /// One JSON object a line
        #[arg(long)]
        json: bool,
        /// Print only the result
        #[arg(long, short)]
        quiet: bool,
    },
    /// Bring the finished runs and the sweeps of other stores into one
    Merge {
        /// The store that gets them; made if it is not there
        into: PathBuf,
        /// The others
        #[arg(required = true)]
        from: Vec<PathBuf>,
        /// One JSON object a line
        #[arg(long)]
        json: bool,
        /// Print only the result
        #[arg(long, short)]
        quiet: bool,
    },
    /// Make the rows of the index again from the run folders
    Index {
        /// The store
        store: PathBuf,
        /// One JSON object a line
        #[arg(long)]
        json: bool,
        /// Print only the result
        #[arg(long, short)]
        quiet: bool,
    },
}

impl From<crate::lab::store::index::StoreError> for Failure {
    fn from(error: crate::lab::store::index::StoreError) -> Self {
        SweepError::from(error).into()
    }
}

pub(super) fn execute(command: &StoreCommand) -> Done {
    match command {
        StoreCommand::List { store, json, quiet } => list(&Store::existing(store)?, *json, *quiet),
        StoreCommand::Merge { into, from, json, quiet } => {
            let mut into = Store::open(into)?;
            let mut done = Ok(());
            for from in from {
                // what is broken in one store keeps nothing of the others back
                done = merge(&mut into, &Store::existing(from)?, *json, *quiet).and(done);
            }
            done
        }
        StoreCommand::Index { store, json, quiet } => {
            let bar = bar(*quiet);
            let found =
                sweep::reindex(&mut Store::with_runs(store)?, &mut |run, of| show(&bar, run, of));
            bar.finish_and_clear();
            indexed(&found?, *json)
        }
    }
}

/// A bar, unless it is to be quiet.
fn bar(quiet: bool) -> ProgressBar {
    if quiet { ProgressBar::hidden() } else { ProgressBar::new(0) }
}

/// How far it is; a bar that is not on a terminal stays hidden.
fn show(bar: &ProgressBar, run: usize, of: usize) {
    bar.set_length(of as u64);
    bar.set_position(run as u64);
}

fn indexed(made: &Reindexed, json: bool) -> Done {
    let Reindexed { finished, unfinished, damaged, forgotten } = made;
    let each = damaged.iter().map(|one| json!({"key": one.key, "message": one.why}));
    if json {
        say(&json!({"event": "done", "finished": finished, "unfinished": unfinished,
            "damaged": each.collect::<Vec<_>>(), "forgotten": forgotten})
        .to_string());
    } else {
        say(&format!("{finished} finished runs, {unfinished} folders that are not finished"));
    }
    if *forgotten > 0 {
        tell!(
            "{forgotten} runs that the index knew have no such folder; `dalean sweep` does them again"
        );
    }
    left_behind(damaged, "the sweep that they belong to does them again")
}

/// Says which runs were left as they are, and fails if there are any.
fn left_behind(runs: &[Skipped], cure: &str) -> Done {
    for Skipped { key, why } in runs {
        tell!("run {key}: {why}");
    }
    if runs.is_empty() {
        return Ok(());
    }
    let message =
        format!("{} runs are broken and were left out, as said above; {cure}", runs.len());
    Err(Failure { code: 1, message })
}

fn list(store: &Store, json: bool, quiet: bool) -> Done {
    let rows = store.rows()?;
    let runs = rows.iter().filter(|(key, ..)| store.has_folder(key)).count();
    if runs < rows.len() {
        let lost = rows.len() - runs;
        tell!(
            "{lost} more were finished, but their folders are gone; `dalean sweep` does them again"
        );
    }
    if !json && !quiet {
        say(&format!("{}: {runs} finished runs", store.path().display()));
    }
    for record in store.sweeps()? {
        let points = store.points(&record.name)?;
        let is_there =
            |point: &PointRecord| point.key.as_ref().is_some_and(|key| store.has_folder(key));
        let finished =
            points.iter().filter(|(point, row)| row.is_some() && is_there(point)).count();
        if json {
            say(&json!({"event": "sweep", "name": record.name, "points": points.len(),
                "finished": finished})
            .to_string());
        } else {
            say(&format!("{:<24} {finished} of {} points finished", record.name, points.len()));
        }
    }
    Ok(())
}

fn merge(into: &mut Store, from: &Store, json: bool, quiet: bool) -> Done {
    let bar = bar(quiet);
    let merged = sweep::merge(into, from, &mut |run, of| show(&bar, run, of));
    bar.finish_and_clear();
    let merged = merged?;
    let place = from.path().display().to_string();
    if json {
        let skipped: Vec<_> = merged.skipped.iter().map(|one| &one.key).collect();
        say(&json!({"event": "done", "from": place, "runs": merged.runs, "shared": merged.shared,
            "held": merged.held, "skipped": skipped, "sweeps": merged.sweeps,
            "different": merged.different})
        .to_string());
        return left_behind(
            &merged.skipped,
            "`dalean verify` on both folders tells which is wrong",
        );
    }
    say(&format!(
        "{place}: {} new runs, {} known with the same result, {} new sweeps",
        merged.runs, merged.shared, merged.sweeps
    ));
    if merged.held > 0 {
        tell!(
            "warning: {} runs are at work in another process and were left; merge again",
            merged.held
        );
    }
    for name in merged.different {
        tell!(
            "warning: sweep {name} differs from the one of that name here; its runs came over. Give the command of the \
             sweep you mean again: it finds them"
        );
    }
    left_behind(&merged.skipped, "`dalean verify` on a folder tells what is wrong")
}
