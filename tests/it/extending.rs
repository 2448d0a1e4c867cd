//! docs/EXTENDING.md: its differences fit the sources; slow by nature, and so asked for by name: they compile and train.
//!
//! A difference is a block of three backquotes and `diff`. Of each file, hunks between `@@` are lines that stay (a blank
//! before them), go (`-`) or come (`+`); where they fit is found by their text, which must stand in the file once.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::program::{Ran, run};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Lines before and after.
type Hunk = [Vec<String>; 2];

/// Differences of the document, each a list of files with their hunks.
fn differences(document: &str) -> Vec<Vec<(String, Vec<Hunk>)>> {
    let blocks = document.split("```diff\n").skip(1);
    let blocks = blocks.map(|rest| rest.split("\n```").next().expect("a block ends"));
    blocks.map(files_of).collect()
}

fn files_of(block: &str) -> Vec<(String, Vec<Hunk>)> {
    let mut files: Vec<(String, Vec<Hunk>)> = vec![];
    for line in block.lines() {
        if let Some(path) = line.strip_prefix("+++ b/") {
            files.push((path.into(), vec![]));
            continue;
        }
        if line.starts_with("--- ") {
            continue;
        }
        let (path, hunks) = files.last_mut().expect("a file is named before its lines");
        if line == "@@" {
            hunks.push([vec![], vec![]]);
            continue;
        }
        let hunk = hunks.last_mut().unwrap_or_else(|| panic!("{path}: a line before @@: {line}"));
        let (mark, text) = line.split_at(line.len().min(1));
        match mark {
            "" | " " => hunk.iter_mut().for_each(|side| side.push(text.into())),
            "-" => hunk[0].push(text.into()),
            "+" => hunk[1].push(text.into()),
            _ => panic!("{path}: neither stays, goes nor comes: {line}"),
        }
    }
    files
}

/// The text after a hunk; what keeps it from fitting.
fn apply(text: &str, [before, after]: &Hunk) -> Result<String, String> {
    let join = |lines: &[String]| lines.iter().map(|line| format!("{line}\n")).collect::<String>();
    let (before, after) = (join(before), join(after));
    if before.is_empty() {
        return if text.is_empty() { Ok(after) } else { Err("a new file is there already".into()) };
    }
    match text.matches(&before).count() {
        1 => Ok(text.replacen(&before, &after, 1)),
        count => Err(format!("these lines stand there {count} times:\n{before}")),
    }
}

/// All files that differences touch, changed; every difference has to fit by itself and after the others.
fn applied() -> BTreeMap<String, String> {
    let document = std::fs::read_to_string(root().join("docs/EXTENDING.md")).unwrap();
    let differences = differences(&document);
    assert!(differences.len() >= 5, "a rule, a route, an activation, a figure, an environment");
    let mut files: BTreeMap<String, String> = BTreeMap::new();
    for (path, hunks) in differences.into_iter().flatten() {
        let on_disk = || std::fs::read_to_string(root().join(&path)).unwrap_or_default();
        let text = files.entry(path.clone()).or_insert_with(on_disk);
        for hunk in hunks {
            *text = apply(text, &hunk).unwrap_or_else(|why| panic!("{path}: {why}"));
        }
    }
    files
}

#[test]
fn every_difference_fits_the_sources() {
    let files = applied();
    for path in ["src/learn/rule.rs", "src/task/environment.rs"] {
        assert!(files.contains_key(path), "{path}: {:?}", files.keys());
    }
    for (path, text) in files {
        let now = std::fs::read_to_string(root().join(&path)).unwrap_or_default();
        assert_ne!(text, now, "{path}");
    }
}

#[test]
fn a_difference_that_does_not_fit_is_seen() {
    let hunk = |before: &str, after: &str| [vec![before.to_owned()], vec![after.to_owned()]];
    assert_eq!(apply("a\nb\n", &hunk("a", "c")).as_deref(), Ok("c\nb\n"));
    assert!(apply("a\na\n", &hunk("a", "c")).unwrap_err().contains("2 times"));
    assert!(apply("b\n", &hunk("a", "c")).unwrap_err().contains("0 times"));
}

fn copy(from: &Path, to: &Path) {
    let skipped = ["target", ".git", "runs", "store", "data"];
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap();
        let top = from == root();
        if path.is_symlink() || top && skipped.iter().any(|skip| name == *skip) {
            continue;
        }
        if path.is_dir() {
            copy(&path, &to.join(name));
        } else {
            std::fs::copy(&path, to.join(name)).unwrap();
        }
    }
}

/// By hand, or by tests/deep.sh: it compiles the program once more.
#[test]
#[ignore = "compiles the whole program; tests/deep.sh extending asks for it"]
fn the_changed_program_compiles_and_trains_with_every_new_word() {
    let place = tempfile::tempdir().unwrap();
    copy(root(), place.path());
    for (path, text) in applied() {
        std::fs::write(place.path().join(path), text).unwrap();
    }
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or(root().join("target"), PathBuf::from);
    let cargo = |arguments: &[&str]| -> Ran {
        let mut command = Command::new(env!("CARGO"));
        run(command.args(arguments).current_dir(place.path()).env("CARGO_TARGET_DIR", &target))
    };
    let out = place.path().join("out").display().to_string();
    for setting in [
        "learning.rule=readout",
        "learning.route=mirror",
        "network.activation=square",
        "learning.epochs=1",
    ] {
        let ran = cargo(&[
            "run",
            "--quiet",
            "--bin",
            "dalean",
            "--",
            "train",
            "tests/golden/plain.toml",
            "--json",
            "--out",
            &out,
            "--set",
            setting,
        ]);
        assert_eq!(ran.code, Some(0), "{setting}: {}", ran.stderr);
        let done = ran.last();
        assert!(done["test_accuracy"].as_f64().unwrap() > 0.2, "{setting}: {done}");
        let run = PathBuf::from(done["run"].as_str().unwrap());
        let page = std::fs::read_to_string(run.join("report.html")).unwrap();
        assert!(page.contains("Shift of the rate over epochs"), "{setting}: no new figure");
        let verified = cargo(&[
            "run",
            "--quiet",
            "--bin",
            "dalean",
            "--",
            "verify",
            &run.display().to_string(),
        ]);
        assert_eq!(verified.code, Some(0), "{setting}: {}", verified.stderr);
    }
    // an environment is acted on, and its run verified
    let program = ["run", "--quiet", "--bin", "dalean", "--"];
    let policy = ["train", "examples/policies/cartpole.toml", "--json", "--out", &out];
    let settings = ["--set", "environment.id=Corridor-v0", "--set", "environment.steps=20000"];
    let ran = cargo(&[&program[..], &policy, &settings].concat());
    assert_eq!(ran.code, Some(0), "Corridor-v0: {}", ran.stderr);
    let run = ran.last()["run"].as_str().unwrap().to_owned();
    let verified = cargo(&[&program[..], &["verify", &run]].concat());
    assert_eq!(verified.code, Some(0), "Corridor-v0: {}", verified.stderr);
    let ran = cargo(&["run", "--quiet", "--bin", "dalean", "--", "keys", "rule"]);
    assert!(ran.stdout.contains("readout"), "{}", ran.stdout);
}
