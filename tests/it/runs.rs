//! Runs told apart: names, lists, comparisons.

use serde_json::Value;

use super::program::{dalean, run, trained};

fn lines(stdout: &str) -> Vec<Value> {
    stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

#[test]
fn runs_are_named_listed_and_compared_by_what_differs() {
    let out = tempfile::tempdir().unwrap();
    let (first, _) = trained(out.path(), &[]);
    let (other, done) = trained(out.path(), &["--set", "learning.decay=constant", "--seed", "2"]);
    let (twin, _) = trained(out.path(), &["--threads", "1"]);
    let name = |path: &std::path::Path| path.file_name().unwrap().to_string_lossy().into_owned();
    assert_eq!(name(&twin), format!("{}-2", name(&first)), "the same run has the same name");
    assert!(
        name(&other).contains("decay-constant") && name(&other).ends_with("seed2"),
        "{other:?}"
    );
    let page = std::fs::read_to_string(other.join("report.html")).unwrap();
    let title = page.split("<title>").nth(1).unwrap().split("</title>").next().unwrap();
    assert!(title.contains("decay constant") && title.contains("seed 2"), "{title}");

    // one is stopped, one is forged, one folder is none
    let text = std::fs::read_to_string(twin.join("receipt.json")).unwrap();
    std::fs::write(twin.join("receipt.json"), text.replace("\"finished\"", "\"running\"")).unwrap();
    std::fs::create_dir(out.path().join("notes")).unwrap();
    let ran = run(dalean().args(["runs", "--json"]).arg(out.path()));
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let listed = lines(&ran.stdout);
    assert_eq!(listed.len(), 4, "three runs and the end: {listed:?}");
    assert_eq!(listed[0]["state"], "unfinished", "the one that was written last stands first");
    let of = |path: &std::path::Path| {
        let path = path.display().to_string();
        listed.iter().find(|line| line["run"] == path.as_str()).unwrap()
    };
    assert_eq!(of(&other)["test_accuracy"], done["test_accuracy"]);
    assert_eq!(of(&other)["differs"]["learning.decay"]["value"], "\"constant\"");
    assert_eq!((&of(&other)["epochs"], &of(&other)["epochs_total"]), (&2.into(), &2.into()));
    let metrics = other.join("metrics.jsonl");
    let text = std::fs::read_to_string(&metrics).unwrap();
    std::fs::write(&metrics, text.replacen("\"correct\":", "\"correct\":1", 1)).unwrap();
    let ran = run(dalean().arg("runs").arg(out.path()));
    let line = ran.stdout.lines().find(|line| line.contains("seed2")).unwrap();
    assert!(line.contains("damaged") && line.contains("metrics.jsonl"), "{line}");
    std::fs::write(&metrics, text).unwrap();

    let ran = run(dalean().arg("compare").arg(&first).arg(&other).arg(&twin));
    assert_eq!(ran.code, Some(0), "{ran:?}");
    for words in [
        "learning.decay",
        "\"cosine\"  \"constant\"",
        "test_accuracy",
        "(2) and (1) differ from the state before the first update on",
        "(3) and (1) have the same states up to epoch 2",
        "unfinished: 2 of 2 epochs",
    ] {
        assert!(ran.stdout.contains(words), "{words} in {}", ran.stdout);
    }
    assert!(!ran.stdout.contains("learning.rule"), "what is alike is left out: {}", ran.stdout);
    let ran = run(dalean().arg("compare").arg(&first).arg(&other).arg("--json"));
    let found = ran.last();
    assert_eq!(found["runs"][1]["differs_from_first_in_epoch"], 0);
    assert_eq!(found["results"]["test_accuracy"][1], done["test_accuracy"]);
    let ran = run(dalean().arg("compare").arg(&first));
    assert_eq!(ran.code, Some(2), "{ran:?}");
    let slip = first.with_file_name(name(&first).replace("optdigits", "optdgits"));
    for command in ["verify", "price", "report", "eval"] {
        let ran = run(dalean().arg(command).arg(&slip));
        assert_eq!(ran.code, Some(1), "{ran:?}");
        let wanted = format!("Did you mean {}?", first.display());
        assert!(ran.stderr.contains(&wanted), "{command}: {ran:?}");
    }
}

#[test]
fn a_later_epoch_is_named_where_states_part() {
    let out = tempfile::tempdir().unwrap();
    // a schedule of the same first epoch, and another length
    let settings = ["--set", "learning.decay=constant"];
    let (long, _) = trained(out.path(), &settings);
    let (short, _) =
        trained(out.path(), &[&settings[..], &["--set", "learning.epochs=1"]].concat());
    let ran = run(dalean().arg("compare").arg(&long).arg(&short));
    assert!(ran.stdout.contains("(2) and (1) have the same states up to epoch 1"), "{ran:?}");
}

#[test]
fn a_folder_without_runs_says_so() {
    let out = tempfile::tempdir().unwrap();
    let ran = run(dalean().arg("runs").arg(out.path()));
    assert_eq!(ran.code, Some(0));
    assert!(ran.stdout.contains("no runs in"), "{ran:?}");
    let ran = run(dalean().arg("runs").arg(out.path().join("nothing")));
    assert_eq!(ran.code, Some(1));
    assert!(ran.stderr.contains("name a folder of runs"), "{ran:?}");
}
