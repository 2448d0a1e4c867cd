//! Runs on own data: what was told from the files is written down, paths are those of the file that names them, and a run
//! is verified wherever it and its data are.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use super::program::{Ran, dalean, finished, run};

/// A table of three classes that a small net tells apart.
fn table(rows: usize) -> String {
    let line = |row: usize| {
        let class = ((row * 7919) >> 4) % 3;
        let value = |column: usize| if column == class { 200 + row % 50 } else { row * 7 % 40 };
        format!("{},{},{},{}\n", value(0), value(1), value(2), ["ash", "beech", "oak"][class])
    };
    let rows: String = (0..rows).map(line).collect();
    format!("red,green,blue,tree\n{rows}")
}

const SETTINGS: &str = "[network]\nhidden = [8]\n[learning]\nepochs = 2\nbatch = 8\n";

/// A folder with an experiment and its data below it.
struct Project(tempfile::TempDir);

impl Project {
    fn new() -> Self {
        let project = Self(tempfile::tempdir().unwrap());
        fs::create_dir_all(project.path("a/data")).unwrap();
        fs::write(project.path("a/data/trees.csv"), table(96)).unwrap();
        let text = format!("[data]\nformat = \"csv\"\ntrain = \"data/trees.csv\"\n{SETTINGS}");
        fs::write(project.path("a/trees.toml"), text).unwrap();
        project
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// The program, started in this folder.
    fn dalean(&self, arguments: &[&str]) -> Command {
        let mut command = dalean();
        command.args(arguments).current_dir(self.0.path());
        command
    }

    fn run(&self, arguments: &[&str]) -> Ran {
        run(&mut self.dalean(arguments))
    }

    /// Trains and gives the name of the folder of the run.
    fn trained(&self, more: &[&str]) -> String {
        let all = [&["train", "a/trees.toml", "--json", "--out", "a/runs"][..], more].concat();
        let (folder, _) = finished(&mut self.dalean(&all));
        folder.file_name().unwrap().to_string_lossy().into_owned()
    }
}

fn refused(ran: &Ran, words: &[&str]) {
    assert!(matches!(ran.code, Some(1 | 2)), "{ran:?}");
    assert!(ran.stderr.contains("error: ") && !ran.stderr.contains("panicked"), "{ran:?}");
    for word in words {
        assert!(ran.stderr.contains(word), "no `{word}` in {ran:?}");
    }
}

#[test]
fn what_was_told_from_a_table_is_printed_written_down_and_shown() {
    let project = Project::new();
    let ran = project.run(&["train", "a/trees.toml", "--out", "a/runs"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    for said in [
        "data: label column `tree`, the last of 4 (the only one of text)",
        "data: classes 0 to 2 are the labels ash, beech, oak",
        "trees.csv: ",
    ] {
        assert!(ran.stderr.contains(said), "{ran:?}");
    }
    let folder = fs::read_dir(project.path("a/runs")).unwrap().next().unwrap().unwrap().path();
    let config = fs::read_to_string(folder.join("config.toml")).unwrap();
    for line in [
        "train = \"../../data/trees.csv\"",
        "label_column = \"tree\"",
        "header = true",
        "separator = \",\"",
    ] {
        assert!(config.contains(line), "{config}");
    }
    let receipt = fs::read_to_string(folder.join("receipt.json")).unwrap();
    assert!(receipt.contains("\"ash\"") && receipt.contains("\"oak\""), "{receipt}");
    let page = fs::read_to_string(folder.join("report.html")).unwrap();
    assert!(page.contains("beech"), "the page names the classes");
}

#[test]
fn a_run_on_own_data_is_verified_wherever_it_and_its_data_are() {
    let project = Project::new();
    let name = project.trained(&[]);
    let verify = |run: &str, more: &[&str]| project.run(&[&["verify", run], more].concat());
    let good = |ran: &Ran| assert_eq!(ran.code, Some(0), "{ran:?}");
    good(&verify(&format!("a/runs/{name}"), &[]));
    // all of it moves
    fs::rename(project.path("a"), project.path("b")).unwrap();
    good(&verify(&format!("b/runs/{name}"), &[]));
    // the run moves alone
    fs::create_dir_all(project.path("c/d/e")).unwrap();
    fs::rename(project.path(&format!("b/runs/{name}")), project.path("c/d/e/run")).unwrap();
    let run = "c/d/e/run";
    refused(&verify(run, &[]), &["cannot open", "trees.csv", "--data"]);
    good(&verify(run, &["--data", "b/data/trees.csv"]));
    good(&verify(run, &["--data", "b/data"]));
    good(&project.run(&["eval", run, "--data", "b/data/trees.csv"]));
    refused(&project.run(&["eval", run]), &["--data"]);
    refused(&project.run(&["train", "--resume", run]), &["--data"]);
    let resumed = project.run(&["train", "--resume", run, "--data", "b/data"]);
    refused(&resumed, &["is finished"]);
    let report = project.run(&["report", run, "--data", "b/data"]);
    good(&report);
    // other data are not taken for them
    fs::write(project.path("other.csv"), table(95)).unwrap();
    let other = verify(run, &["--data", "other.csv"]);
    refused(&other, &["the data has the hash", "but the run was made with", "--data"]);
    refused(&verify(run, &["--data", "nowhere"]), &["cannot open nowhere"]);
    refused(&verify(run, &["--data", "c"]), &["cannot open", "c/trees.csv"]);
}

#[test]
fn data_of_a_known_set_or_a_new_run_are_not_named_with_data() {
    let project = Project::new();
    let text = format!("[data]\nset = \"xor\"\n{SETTINGS}select = \"last\"\n");
    fs::write(project.path("a/trees.toml"), text).unwrap();
    let name = project.trained(&[]);
    let ran = project.run(&["verify", &format!("a/runs/{name}"), "--data", "a/data"]);
    refused(&ran, &["the data are the set `xor`", "--data-dir"]);
    let ran = project.run(&["train", "a/trees.toml", "--data", "a/data", "--out", "a/runs"]);
    refused(&ran, &["--resume", "data.train"]);
}

#[test]
fn several_files_are_found_in_a_folder_and_not_in_a_file() {
    let project = Project::new();
    fs::write(project.path("a/data/test.csv"), table(30).replace("red,green", "green,red"))
        .unwrap();
    let test = format!("data.test={}", project.path("a/data/test.csv").display());
    let name = project.trained(&["--set", &test, "--set", "data.full_scale=255"]);
    fs::rename(project.path("a/data"), project.path("data")).unwrap();
    let run = format!("a/runs/{name}");
    let ran = project.run(&["verify", &run, "--data", "data/trees.csv"]);
    refused(
        &ran,
        &["is one file, but the data are several (test.csv, trees.csv)", "give the folder"],
    );
    assert_eq!(project.run(&["verify", &run, "--data", "data"]).code, Some(0));
}

#[test]
fn paths_of_a_sweep_are_relative_to_its_file() {
    let project = Project::new();
    let text = "name = \"trees\"\nexperiment = \"../a/trees.toml\"\n[[axis]]\nname = \"which\"\n\
                [[axis.case]]\nname = \"first\"\nset = { data = { train = \"one.csv\" } }\n\
                [[axis.case]]\nname = \"second\"\nset = { data = { label_column = \"tree\" } }\n";
    fs::create_dir(project.path("s")).unwrap();
    fs::write(project.path("s/trees.toml"), text).unwrap();
    fs::write(project.path("s/one.csv"), table(60)).unwrap();
    let ran = project.run(&["sweep", "s/trees.toml", "--store", "store"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let again = project.run(&["sweep", "s/trees.toml", "--store", "store", "--json"]);
    assert_eq!((again.code, again.last()["finished"].as_u64()), (Some(0), Some(2)), "{again:?}");
    // a store moves with the folder that holds the data beside it
    fs::create_dir(project.path("moved")).unwrap();
    for part in ["a", "s", "store"] {
        fs::rename(project.path(part), project.path("moved").join(part)).unwrap();
    }
    let ran = project.run(&["verify", "moved/store", "--sample", "2"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
}

/// Lines `1,2,3,0` brought the confusion matrix down.
#[test]
fn data_of_one_class_is_refused_and_does_not_panic() {
    let project = Project::new();
    let train = |rows: &str, more: &[&str]| {
        fs::write(project.path("a/data/trees.csv"), rows.repeat(40)).unwrap();
        project.run(&[&["train", "a/trees.toml", "--out", "a/runs"][..], more].concat())
    };
    refused(&train("1,2,3,0\n", &["--set", "data.header=false"]), &["data.label_column"]);
    for label in ["first", "last", "1", "2"] {
        let column = format!("data.label_column={label}");
        let ran = train("1,2,3,0\n", &["--set", "data.header=false", "--set", &column]);
        refused(&ran, &["with one class there is nothing to tell apart"]);
        for classes in ["1", "2", "4", "256"] {
            let stated = format!("data.classes={classes}");
            let more = ["--set", "data.header=false", "--set", &column, "--set", &stated];
            refused(&train("1,2,3,0\n", &more), &["; "]);
        }
    }
    // one class alone, and said to be meant: learnt, with an empty row in the confusion matrix
    let more = [
        "--set",
        "data.label_column=last",
        "--set",
        "data.classes=2",
        "--set",
        "data.header=false",
    ];
    let ran = train("1,2,5,0\n4,2,3,0\n", &more);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    assert!(ran.stderr.contains("the training part has no example of class 1"), "{ran:?}");
    assert!(project.path("a/runs").exists());
}
