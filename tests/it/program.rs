//! Runs the program itself, in folders of its own.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

/// The program, with a data folder that does not exist and no colour.
pub(crate) fn dalean() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_dalean"));
    command.env("DALEAN_DATA", "no such folder");
    command.env_remove("DALEAN_RUNS").env_remove("RUST_BACKTRACE");
    command
}

/// What a command did.
#[derive(Debug)]
pub(crate) struct Ran {
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl From<Output> for Ran {
    fn from(output: Output) -> Self {
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("messages are UTF-8");
        Self {
            code: output.status.code(),
            stdout: text(output.stdout),
            stderr: text(output.stderr),
        }
    }
}

impl Ran {
    /// The last JSON object of standard output.
    pub(crate) fn last(&self) -> Value {
        let line = self.stdout.lines().last().unwrap_or_else(|| panic!("no output: {self:?}"));
        serde_json::from_str(line).unwrap_or_else(|e| panic!("{e} in {line}"))
    }
}

pub(crate) fn run(command: &mut Command) -> Ran {
    command.output().expect("the program starts").into()
}

/// The configuration of small runs: two epochs of the built-in digits on 24 hidden units.
pub(crate) const SMALL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/small.toml");

/// The same without what belongs to one rule or route.
const PLAIN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/plain.toml");

/// `dalean train` of the small run into `out`.
pub(crate) fn train(out: &Path) -> Command {
    let mut command = dalean();
    command.args(["train", SMALL, "--json", "--out"]).arg(out);
    command
}

/// `dalean train` of a small run into `out` that says nothing of rule and route.
pub(crate) fn train_plain(out: &Path) -> Command {
    let mut command = dalean();
    command.args(["train", PLAIN, "--json", "--out"]).arg(out);
    command
}

/// A finished small run: its folder and its last event.
pub(crate) fn trained(out: &Path, more: &[&str]) -> (PathBuf, Value) {
    finished(train(out).args(more))
}

/// A run that is carried out: its folder and its last event.
pub(crate) fn finished(command: &mut Command) -> (PathBuf, Value) {
    let ran = run(command);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let done = ran.last();
    assert_eq!(done["event"], "done");
    (PathBuf::from(done["run"].as_str().unwrap()), done)
}

/// The one folder below `out`: that of its only run, whatever its name.
pub(crate) fn only_run(out: &Path) -> PathBuf {
    let folders = std::fs::read_dir(out).unwrap().map(|entry| entry.unwrap().path());
    let folders: Vec<PathBuf> = folders.filter(|path| path.is_dir()).collect();
    let [one] = &folders[..] else { panic!("one run in {folders:?}") };
    one.clone()
}
