//! `report`.

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;

use super::{Done, data_root, say};
use crate::lab::run;

#[derive(Debug, Args)]
pub(super) struct ReportArgs {
    /// Folder of a run
    run: PathBuf,
    /// Folder of data sets, for pictures of wrong answers [default: data, or DALEAN_DATA]
    #[arg(long, value_name = "DIR")]
    data_dir: Option<PathBuf>,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
    /// Print only where the page is
    #[arg(long, short)]
    quiet: bool,
}

pub(super) fn execute(args: &ReportArgs) -> Done {
    run(&args.run, args)
}

/// Draws the page of one run again.
fn run(path: &Path, args: &ReportArgs) -> Done {
    let made = run::report(path, Some(&data_root(args.data_dir.clone())))?;
    let page = made.path.display().to_string();
    if args.json {
        let run = path.display().to_string();
        say(&json!({"event": "report", "run": run, "page": page, "notes": made.notes}).to_string());
        return Ok(());
    }
    if !args.quiet {
        say(&made.summary);
        made.notes.iter().for_each(|note| say(&format!("left out {note}")));
    }
    say(&format!("report   {page}"));
    Ok(())
}
