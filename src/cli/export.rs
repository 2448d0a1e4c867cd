//! `export`: the table of a sweep as a file.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use super::out::print;
use super::sweep::store_path;
use super::{Done, Failure, say, usage};
use crate::lab::store::index::Store;
use crate::lab::store::place::write_out;
use crate::lab::sweep::{self, SweepError};
use crate::lab::table::Format;

#[derive(Debug, Args)]
pub(super) struct ExportArgs {
    /// Store [default: store, or DALEAN_STORE]
    store: Option<PathBuf>,
    /// Which sweep; needed when the store has several
    #[arg(long, value_name = "NAME")]
    sweep: Option<String>,
    /// csv, json or parquet [default: what the name of the file ends with, else csv]
    #[arg(long, value_name = "NAME")]
    format: Option<Format>,
    /// File to write [default: standard output]
    #[arg(long, short, value_name = "FILE")]
    out: Option<PathBuf>,
    /// One JSON object a line on standard output, each with an `event`
    #[arg(long, requires = "out")]
    json: bool,
    /// Print only the name of the file
    #[arg(long, short, requires = "out")]
    quiet: bool,
}

pub(super) fn execute(args: &ExportArgs) -> Done {
    let path = store_path(args.store.as_ref());
    let store = Store::existing(&path).map_err(SweepError::from)?;
    let record = sweep::find(&store, args.sweep.as_deref())?;
    let results = sweep::results(&store, &record)?;
    let ending =
        args.out.as_ref().and_then(|out| out.extension()).and_then(|ending| ending.to_str());
    let format = match (args.format, ending) {
        (Some(format), _) => format,
        (None, None) => Format::Csv,
        (None, Some(ending)) => ending.parse().map_err(|error: String| {
            usage(&format!("--out ends with .{ending}: {error}, or name one with --format"))
        })?,
    };
    let failure = |place: &str, error: &dyn std::fmt::Display| Failure {
        code: 1,
        message: format!("cannot write {place}: {error}"),
    };
    if results.lost > 0 {
        tell!(
            "warning: {} points were finished, but their folders are gone; `dalean sweep` does them again",
            results.lost
        );
    }
    // the whole table first, then its place: half a table is none
    let mut bytes = Vec::new();
    results.table.write(format, &mut bytes).map_err(|e| failure("the table", &e))?;
    match &args.out {
        None => {
            print(&bytes);
        }
        Some(out) => {
            let place = out.display().to_string();
            write_out(out, &bytes).map_err(|e| failure(&place, &e))?;
            let (points, finished) = (results.table.len(), results.finished);
            if args.json {
                say(&json!({"event": "done", "sweep": record.name, "file": place,
                    "points": points, "finished": finished})
                .to_string());
            } else if args.quiet {
                say(&place);
            } else {
                say(&format!("{place}: {points} points, {finished} finished"));
            }
        }
    }
    Ok(())
}
