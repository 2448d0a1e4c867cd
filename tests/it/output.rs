//! Standard output of every command: whole or an error, JSON when asked for, the result alone when quiet.

use std::process::{Command, Stdio};

use serde_json::Value;

use super::program::{Ran, SMALL, dalean, run, trained};

/// Commands that need no run, each with an answer on standard output.
const PLAIN: &[&[&str]] = &[
    &["--help"],
    &["--version"],
    &["keys"],
    &["keys", "--markdown"],
    &["hw", "list"],
    &["hw", "show", "reram"],
    &["hw", "show", "reram", "--toml"],
    &["hw", "peak", "reram"],
    &["hw", "check", "reram"],
    &["data", "list"],
    &["completions", "bash"],
    &["profile", SMALL],
];

/// The program with its output going to a full device.
#[cfg(target_os = "linux")]
fn full(command: &mut Command) -> Ran {
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let mut child =
        command.stdout(full).stderr(Stdio::piped()).spawn().expect("the program starts");
    let mut stderr = String::new();
    std::io::Read::read_to_string(&mut child.stderr.take().unwrap(), &mut stderr).unwrap();
    Ran { code: child.wait().unwrap().code(), stdout: String::new(), stderr }
}

#[cfg(target_os = "linux")]
#[test]
fn output_that_cannot_be_written_is_an_error_of_every_command() {
    let out = tempfile::tempdir().unwrap();
    let (folder, _) = trained(out.path(), &[]);
    let folder = folder.display().to_string();
    let of_run: &[&[&str]] = &[
        &["eval", &folder],
        &["verify", &folder, "--quiet"],
        &["price", &folder],
        &["report", &folder],
        &["runs", &folder],
        &["compare", &folder, &folder],
    ];
    for arguments in PLAIN.iter().chain(of_run) {
        let ran = full(dalean().args(*arguments));
        assert_eq!(ran.code, Some(1), "{arguments:?}: {ran:?}");
        assert!(ran.stderr.contains("cannot write to standard output"), "{arguments:?}: {ran:?}");
        assert!(!ran.stderr.contains("panicked"), "{arguments:?}: {ran:?}");
    }
}

#[test]
fn a_reader_that_has_gone_away_ends_a_command_quietly() {
    let mut child = dalean()
        .arg("keys")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    drop(child.stdout.take());
    let mut stderr = String::new();
    std::io::Read::read_to_string(&mut child.stderr.take().unwrap(), &mut stderr).unwrap();
    assert_eq!((child.wait().unwrap().code(), stderr.as_str()), (Some(0), ""));
}

#[test]
fn every_command_speaks_json() {
    let out = tempfile::tempdir().unwrap();
    let (folder, _) = trained(out.path(), &[]);
    let folder = folder.display().to_string();
    let chip = out.path().join("mychip").display().to_string();
    let pulses = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/devices/pulses.csv");
    let device = out.path().join("device.toml").display().to_string();
    for arguments in [
        &["keys"][..],
        &["hw", "list"],
        &["hw", "new", &chip],
        &["hw", "import", pulses, "--out", &device],
        &["hw", "show", "reram"],
        &["hw", "peak", "reram"],
        &["hw", "check", "reram"],
        &["data", "list"],
        &["completions", "bash"],
        &["profile", SMALL],
        &["eval", &folder],
        &["verify", &folder],
        &["price", &folder],
        &["report", &folder],
        &["runs", &folder],
        &["compare", &folder, &folder],
    ] {
        let ran = run(dalean().args(arguments).arg("--json"));
        assert_eq!(ran.code, Some(0), "{arguments:?}: {ran:?}");
        for line in ran.stdout.lines() {
            let object: Value =
                serde_json::from_str(line).unwrap_or_else(|e| panic!("{arguments:?}: {e}: {line}"));
            assert!(object["event"].is_string(), "{arguments:?}: {line}");
        }
    }
}

#[test]
fn a_new_chip_is_checked_trained_changed_and_saved() {
    let out = tempfile::tempdir().unwrap();
    let file = out.path().join("mychip.toml");
    let ran = run(dalean().args(["hw", "new"]).arg(out.path().join("mychip")));
    assert_eq!(ran.code, Some(0), "{ran:?}");
    assert_eq!(run(dalean().args(["hw", "check"]).arg(&file)).code, Some(0));
    let again = run(dalean().args(["hw", "new"]).arg(out.path().join("mychip")));
    assert_eq!(again.code, Some(1), "a file that is there stays: {again:?}");
    let refused = run(dalean().args(["hw", "new", "reram"]));
    assert_eq!(refused.code, Some(2), "{refused:?}");
    let path = file.display().to_string();
    let (_, done) = trained(out.path(), &["--hw", &path]);
    assert!(done["test_accuracy"].as_f64().unwrap() > 0.3, "{done}");
    let shown =
        run(dalean().args(["hw", "show", &path, "--toml", "--set", "hw.cell.level_bits=5"]));
    let saved = out.path().join("saved.toml");
    std::fs::write(&saved, &shown.stdout).unwrap();
    let ran = run(dalean().args(["hw", "check"]).arg(&saved));
    assert!(ran.code == Some(0) && ran.stdout.contains("mychip-changed"), "{ran:?}");
    for name in dalean::lab::config::model_names() {
        let shown = run(dalean().args(["hw", "show", name, "--toml"]));
        std::fs::write(&saved, &shown.stdout).unwrap();
        assert_eq!(run(dalean().args(["hw", "check"]).arg(&saved)).code, Some(0), "{name}");
    }
}

#[test]
fn completions_offer_kernels_chips_and_sets() {
    for shell in ["bash", "zsh", "fish"] {
        let ran = run(dalean().args(["completions", shell]));
        for word in ["avx512", "photonic_pcm", "cifar10", "compare", "level_bits"] {
            // for fish, words that stand without an option are not written by the library
            let written = shell != "fish" || word != "cifar10";
            assert!(!written || ran.stdout.contains(word), "{shell}: {word}");
        }
    }
    let ran = run(dalean().args(["train", "--kernel", "avx5120"]));
    assert!(ran.stderr.contains("did you mean \"avx512\"?"), "{ran:?}");
    let ran = run(dalean().args(["data", "fetch", "mnits"]));
    assert!(ran.stderr.contains("did you mean \"mnist\"?"), "{ran:?}");
    let ran = run(dalean().args(["trian"]));
    assert!(ran.stderr.contains("train"), "{ran:?}");
}
