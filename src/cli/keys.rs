//! `keys`: every key of every file.

use clap::Args;

use super::{Done, Failure, known, say};
use crate::lab::config::keys;
use crate::lab::near;

#[derive(Debug, Args)]
pub(super) struct KeysArgs {
    /// Part of a key's name, or of its meaning [default: all keys, a line each]
    #[arg(value_parser = known::key_names(), hide_possible_values = true)]
    word: Option<String>,
    /// All keys as the page docs/CONFIG.md
    #[arg(long, conflicts_with_all = ["word", "json", "quiet"])]
    markdown: bool,
    /// One JSON object a line on standard output, each with an `event`
    #[arg(long)]
    json: bool,
    /// Print only names
    #[arg(long, short)]
    quiet: bool,
}

pub(super) fn execute(args: &KeysArgs) -> Done {
    if args.markdown {
        say(keys::markdown().trim_end());
        return Ok(());
    }
    let word = args.word.as_deref().unwrap_or("");
    let (found, numbers) = (keys::matching(word), keys::quantities(word));
    if found.is_empty() && numbers.is_empty() {
        let all = keys::matching("");
        let names: Vec<&str> = all.iter().map(|key| key.entry.name).collect();
        let hint = near::hint(word, names);
        let message = format!("no key has to do with `{word}`{hint}; `dalean keys` lists them all");
        return Err(Failure { code: 1, message });
    }
    if args.json {
        found.iter().for_each(|key| say(&keys::key_json(key).to_string()));
        keys::quantities_json(word).iter().for_each(|number| say(&number.to_string()));
        let count = found.len() + numbers.len();
        say(&serde_json::json!({"event": "done", "keys": count}).to_string());
    } else if args.quiet {
        found.iter().for_each(|key| say(&key.full()));
        numbers.iter().for_each(|(table, key, _)| say(&format!("hw.{}.{key}", table.name())));
    } else {
        say(&keys::terminal(&found, word, args.word.is_none()));
    }
    Ok(())
}
