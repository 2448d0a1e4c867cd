//! The page of a run can be drawn again, as far as what is left in its folder goes.

use std::fs;
use std::path::Path;

use dalean::lab::data::DataRoot;
use dalean::lab::run::{self, RunError};
use dalean::lab::store::folder::{FolderError, RunFolder};
use serde_json::Value;

use super::program::{SMALL, dalean, run, trained};

fn page(folder: &Path) -> String {
    fs::read_to_string(folder.join("report.html")).unwrap()
}

/// Anchors of the figures of a page.
fn figures(page: &str) -> Vec<&str> {
    let ids = page.split("<section ").skip(1).filter_map(|rest| rest.split("id=\"").nth(1));
    ids.filter_map(|rest| rest.split('"').next()).collect()
}

const ALL: [&str; 13] = [
    "accuracy",
    "confusion",
    "mistakes",
    "timelines",
    "levels",
    "fields",
    "maps",
    "writes",
    "saturation",
    "pathways",
    "absent",
    "configuration",
    "words",
];

#[test]
fn a_report_made_again_is_the_same_to_the_byte() {
    let out = tempfile::tempdir().unwrap();
    // the state of the last epoch, that of the best one, and a chip that says nothing of time and energy
    let bare = out.path().join("bare.toml");
    fs::write(&bare, "name = \"bare\"\n").unwrap();
    let chips = [
        (["--set", "learning.select=last"], 15),
        (["--hw", "pcm14"], 15),
        (["--hw", bare.to_str().unwrap()], 13),
    ];
    for (more, wanted) in &chips {
        let (folder, _) = trained(out.path(), more);
        let first = page(&folder);
        fs::remove_file(folder.join("report.html")).unwrap();
        let made = run::report(&folder, Some(&DataRoot::new("no such folder"))).unwrap();
        assert_eq!(made.path, folder.join("report.html"));
        assert_eq!(made.notes, Vec::<String>::new());
        assert!(made.summary.contains("test "), "{}", made.summary);
        assert!(page(&folder) == first, "{more:?}: the page differs");
        assert_eq!(figures(&first).len(), *wanted, "{:?}", figures(&first));
    }
}

#[test]
fn a_report_shows_what_is_left_of_a_run() {
    let out = tempfile::tempdir().unwrap();
    let (folder, _) = trained(out.path(), &["--hw", "pcm14"]);
    fs::remove_file(folder.join("checkpoint.safetensors")).unwrap();
    fs::remove_file(folder.join("ledger.json")).unwrap();
    let made = run::report(&folder, None).unwrap();
    assert_eq!(made.notes.len(), 2, "{:?}", made.notes);
    let left = page(&folder);
    let wanted = ALL.into_iter().filter(|id| !["mistakes", "fields", "maps"].contains(id));
    assert_eq!(figures(&left), wanted.collect::<Vec<_>>());

    // a state that is not this run's is said to be so, and not drawn
    fs::write(folder.join("checkpoint.safetensors"), b"no such thing").unwrap();
    let made = run::report(&folder, None).unwrap();
    assert!(made.notes.iter().any(|note| note.contains("not a checkpoint")), "{:?}", made.notes);
    assert_eq!(page(&folder), left);
}

#[test]
fn a_report_of_an_unfinished_run_ends_with_its_last_finished_epoch() {
    let out = tempfile::tempdir().unwrap();
    let (folder, _) = trained(out.path(), &[]);
    let receipt = fs::read_to_string(folder.join("receipt.json")).unwrap();
    let mut receipt: Value = serde_json::from_str(&receipt).unwrap();
    receipt["status"] = "running".into();
    receipt["test"] = Value::Null;
    let hashes = receipt["epoch_hashes"].as_array_mut().unwrap();
    // stopped after the record of epoch 2 was written and before its receipt was
    hashes.truncate(2);
    fs::write(folder.join("receipt.json"), receipt.to_string()).unwrap();
    fs::remove_file(folder.join("ledger.json")).unwrap();
    let made = run::report(&folder, Some(&DataRoot::new("no such folder"))).unwrap();
    let page = page(&folder);
    assert!(page.contains("The run is <b>running</b>") && page.contains("after epoch 1"));
    assert!(!page.contains("after epoch 2"));
    // the state on disk is that of epoch 2
    assert!(made.notes.iter().any(|note| note.contains("state_hash")), "{:?}", made.notes);
    assert!(!figures(&page).contains(&"maps"));
}

#[test]
fn a_run_that_is_being_carried_out_keeps_its_page() {
    let out = tempfile::tempdir().unwrap();
    let (folder, _) = trained(out.path(), &[]);
    let before = page(&folder);
    fs::remove_file(folder.join("checkpoint.safetensors")).unwrap();
    let held = RunFolder::open(&folder).unwrap();
    let refused = run::report(&folder, None).unwrap_err();
    assert!(matches!(refused, RunError::Folder(FolderError::Held { .. })), "{refused}");
    assert_eq!(page(&folder), before);
    drop(held);
    run::report(&folder, None).unwrap();
    assert_ne!(page(&folder), before);
}

#[test]
fn the_command_says_where_the_page_is() {
    let out = tempfile::tempdir().unwrap();
    let (folder, _) = trained(out.path(), &[]);
    let place = folder.join("report.html");
    let said = run(dalean().arg("report").arg(&folder).arg("--quiet"));
    assert_eq!((said.code, said.stdout), (Some(0), format!("report   {}\n", place.display())));
    let said = run(dalean().arg("report").arg(&folder).arg("--json"));
    assert_eq!(said.last()["page"].as_str(), place.to_str());
    assert_eq!(said.last()["event"], "report");
    let said = run(dalean().arg("report").arg(Path::new(SMALL).parent().unwrap()));
    assert_eq!(said.code, Some(1));
    assert!(said.stderr.contains("is this the folder of a run?"), "{said:?}");
}
