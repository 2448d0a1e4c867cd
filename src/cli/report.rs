//! `report`.

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;

use super::{Done, Moved, data_root, say};
use crate::lab::store::index::{INDEX, Store};
use crate::lab::sweep;
use crate::lab::{report, run};

#[derive(Debug, Args)]
pub(super) struct ReportArgs {
    /// Folder of a run, or a store
    #[arg(value_hint = clap::ValueHint::DirPath)]
    run: PathBuf,
    /// A store: which sweep; needed when it has several
    #[arg(long, value_name = "NAME")]
    sweep: Option<String>,
    /// Folder of data sets, for pictures of wrong answers [default: data, or DALEAN_DATA]
    #[arg(long, value_name = "DIR")]
    data_dir: Option<PathBuf>,
    #[command(flatten)]
    moved: Moved,
    /// Say what the columns of the table mean
    #[arg(long)]
    explain: bool,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
    /// Print only where the page is
    #[arg(long, short)]
    quiet: bool,
}

pub(super) fn execute(args: &ReportArgs) -> Done {
    if args.run.join(INDEX).is_file() { sweep(&args.run, args) } else { run(&args.run, args) }
}

/// Draws the page and the figures of a sweep.
fn sweep(path: &Path, args: &ReportArgs) -> Done {
    let store = Store::existing(path)?;
    let record = sweep::find(&store, args.sweep.as_deref())?;
    let made = sweep::report(&store, &record, true)?;
    let page = made.page.display().to_string();
    if args.json {
        let figures: Vec<_> = made.figures.iter().map(|path| path.display().to_string()).collect();
        say(&json!({"event": "report", "sweep": record.name, "page": page, "figures": figures,
            "points": made.points, "finished": made.finished})
        .to_string());
        return Ok(());
    }
    if !args.quiet {
        say(&format!("{}: {} of {} points finished", record.name, made.finished, made.points));
        made.text.iter().for_each(|text| say(text));
        made.figures.iter().for_each(|path| say(&format!("figure   {}", path.display())));
    }
    say(&format!("report   {page}"));
    Ok(())
}

/// Draws the page of one run again.
fn run(path: &Path, args: &ReportArgs) -> Done {
    let made = run::report(path, Some(&args.moved.root(data_root(args.data_dir.clone()))))?;
    let page = made.path.display().to_string();
    if args.json {
        let run = path.display().to_string();
        say(&json!({"event": "report", "run": run, "page": page, "notes": made.notes}).to_string());
        return Ok(());
    }
    if !args.quiet {
        say(&made.summary);
        if args.explain {
            say(&report::text::words());
        }
        made.notes.iter().for_each(|note| say(&format!("left out {note}")));
    }
    say(&format!("report   {page}"));
    Ok(())
}
