//! A run has one hash: threads, kernels, tiles, stops and builds do not move it.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::Stdio;

use super::program::{dalean, only_run, run, train, trained};

fn hash(done: &serde_json::Value) -> String {
    done["state_hash"].as_str().expect("a run ends with its state hash").to_owned()
}

/// Hash of the small run of `program::train`. It moves only when an equation does: say which in the commit.
const GOLDEN: &str = include_str!("../golden/digits.hash");

/// Large enough that loads, reads, gates, turning and writes are all shared among threads.
#[test]
fn threads_that_share_every_operation_do_not_move_a_bit() {
    let out = tempfile::tempdir().unwrap();
    let hashes = ["1", "2", "3"].map(|threads| {
        let large = ["--set", "learning.batch=2048", "--set", "network.hidden=[300]"];
        hash(&trained(out.path(), &[&large[..], &["--threads", threads]].concat()).1)
    });
    assert!(hashes.iter().all(|hash| *hash == hashes[0]), "{hashes:?}");
}

#[test]
fn threads_kernels_and_tiles_do_not_move_a_bit() {
    let out = tempfile::tempdir().unwrap();
    let variants: [&[&str]; 8] = [
        &[],
        &["--threads", "1"],
        &["--threads", "2"],
        &["--threads", "3"],
        &["--kernel", "scalar"],
        &["--set", "hw.tile.rows=64", "--set", "hw.tile.columns=64"],
        &["--set", "hw.tile.rows=17", "--set", "hw.tile.columns=5"],
        &["--set", "hw.drive.dac_bits=3"],
    ];
    let mut first = None;
    for (number, variant) in variants.into_iter().enumerate() {
        let (folder, done) = trained(out.path(), variant);
        // reads are counted by slice, and counts are part of the state hash: compare levels there
        if number < 7 {
            assert_eq!(hash(&done), GOLDEN.trim(), "{variant:?}");
        }
        let levels = levels(&folder);
        assert_eq!(levels, *first.get_or_insert_with(|| levels.clone()), "{variant:?}");
    }
}

#[test]
fn every_kernel_of_this_machine_gives_the_golden_hash() {
    let out = tempfile::tempdir().unwrap();
    for backend in dalean::chip::crossbar::kernel::Backend::available() {
        let (_, done) = trained(out.path(), &["--kernel", backend.name()]);
        assert_eq!(hash(&done), GOLDEN.trim(), "{}", backend.name());
    }
}

/// All tensors of levels of a run.
fn levels(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let bytes = std::fs::read(folder.join("checkpoint.safetensors")).unwrap();
    let file = safetensors::SafeTensors::deserialize(&bytes).unwrap();
    let mut all: Vec<_> = file
        .tensors()
        .into_iter()
        .filter(|(name, _)| name.ends_with(".levels"))
        .map(|(name, tensor)| (name, tensor.data().to_vec()))
        .collect();
    all.sort();
    assert!(!all.is_empty());
    all
}

#[test]
fn a_run_killed_at_any_moment_resumes_to_the_same_bits() {
    let out = tempfile::tempdir().unwrap();
    let settings = ["--set", "learning.epochs=12"];
    let mut resumed = 0;
    let (_, whole) = trained(out.path(), &settings);
    for stop_after in [0u64, 1, 3, 8] {
        let root = tempfile::tempdir().unwrap();
        let mut child = train(root.path()).args(settings).stdout(Stdio::piped()).spawn().unwrap();
        let lines = BufReader::new(child.stdout.take().unwrap()).lines();
        for line in lines {
            let event: serde_json::Value = serde_json::from_str(&line.unwrap()).unwrap();
            let epoch = event["record"]["epoch"].as_u64();
            if epoch == Some(stop_after) || (stop_after == 0 && event["event"] == "started") {
                break;
            }
        }
        child.kill().unwrap();
        child.wait().unwrap();
        let folder = only_run(root.path());
        let ran = run(dalean().args(["train", "--json", "--resume"]).arg(&folder));
        if ran.code == Some(1) && ran.stderr.contains("is finished") {
            continue; // the run outran the kill
        }
        assert_eq!(ran.code, Some(0), "killed after epoch {stop_after}: {ran:?}");
        assert_eq!(hash(&ran.last()), hash(&whole), "killed after epoch {stop_after}");
        let accuracy = &ran.last()["test_accuracy"];
        assert_eq!(accuracy, &whole["test_accuracy"], "killed after epoch {stop_after}");
        for cost in ["cycles", "joules"] {
            assert_eq!(ran.last()[cost], whole[cost], "{cost}, killed after epoch {stop_after}");
        }
        resumed += 1;
    }
    assert!(resumed > 0, "every run outran its kill: nothing was tested");
}

#[test]
fn verify_accepts_a_run_and_finds_a_changed_one() {
    let out = tempfile::tempdir().unwrap();
    let (folder, done) = trained(out.path(), &[]);
    let ran = run(dalean().arg("verify").arg(&folder).args(["--json", "--kernel", "scalar"]));
    assert_eq!((ran.code, hash(&ran.last())), (Some(0), hash(&done)), "{ran:?}");
    assert_eq!(ran.last()["test"], true);
    let ran = run(dalean().arg("verify").arg(&folder).args(["--epochs", "1"]));
    assert_eq!(ran.code, Some(0), "{ran:?}");
    assert!(ran.stdout.contains("verified: 2 records"), "{ran:?}");

    let path = folder.join("receipt.json");
    let receipt = std::fs::read_to_string(&path).unwrap();
    let forged = receipt.replace(&hash(&done), &"0".repeat(64));
    std::fs::write(&path, &forged).unwrap();
    let ran = run(dalean().arg("verify").arg(&folder));
    assert_eq!(ran.code, Some(1), "{ran:?}");
    assert!(ran.stderr.contains("another state hash for epoch 2"), "{ran:?}");

    let forged = receipt.replace("\"arithmetic\": 2", "\"arithmetic\": 1");
    std::fs::write(&path, forged).unwrap();
    let ran = run(dalean().arg("verify").arg(&folder));
    assert!(ran.code == Some(1) && ran.stderr.contains("arithmetic 1"), "{ran:?}");
}

#[test]
fn eval_reads_the_chosen_state_again() {
    let out = tempfile::tempdir().unwrap();
    let (folder, done) = trained(out.path(), &[]);
    let ran = run(dalean().arg("eval").arg(&folder).arg("--json"));
    assert_eq!(ran.code, Some(0), "{ran:?}");
    assert_eq!(ran.last()["test_accuracy"], done["test_accuracy"]);
    assert_eq!(ran.last()["epochs"], done["test_epoch"]);
}
