//! Folders that come from elsewhere, places that are no files, and systems that give little: no file outside its folder,
//! no panic, no end without an answer.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use dalean::chip::crossbar::kernel::Backend;
use dalean::lab::config::{Sources, load};
use dalean::lab::data::DataRoot;
use dalean::lab::run::{self, Machine, RunError, RunEvent, Verdict};

use super::program::{Ran, SMALL, dalean, run as carried, trained};

fn refused(ran: &Ran, words: &[&str]) {
    assert!(matches!(ran.code, Some(1 | 2)), "{ran:?}");
    assert!(!ran.stderr.contains("panicked"), "{ran:?}");
    for word in words {
        assert!(ran.stderr.contains(word), "no `{word}` in {ran:?}");
    }
}

/// A store of two small runs.
fn store(place: &Path) {
    fs::create_dir_all(place).unwrap();
    let file = place.join("two.toml");
    let text = "base.data.set = 'xor'\nbase.network.hidden = [3]\nbase.learning.epochs = 1\n\
                [[axis]]\nkey = 'seed'\nname = 'draw'\nvalues = [1, 2]\n";
    fs::write(&file, text).unwrap();
    let ran = carried(dalean().arg("sweep").arg(&file).args(["--json", "--store"]).arg(place));
    assert_eq!(ran.code, Some(0), "{ran:?}");
}

fn shell(line: &str, arguments: &[&Path]) -> Ran {
    let mut command = Command::new("bash");
    command.arg("-c").arg(line).arg(env!("CARGO_BIN_EXE_dalean")).args(arguments);
    carried(command.env("DALEAN_DATA", "no such folder"))
}

#[cfg(unix)]
#[test]
fn an_export_to_a_device_a_pipe_or_a_link_is_written_into_it() {
    use std::os::unix::fs::{FileTypeExt, symlink};

    let place = tempfile::tempdir().unwrap();
    store(place.path());
    let export = |out: &Path| {
        let mut command = dalean();
        command.arg("export").arg(place.path()).args(["--format", "json", "--out"]).arg(out);
        carried(&mut command)
    };
    assert_eq!(export(Path::new("/dev/null")).code, Some(0));
    let null = fs::symlink_metadata("/dev/null").unwrap();
    assert!(null.file_type().is_char_device(), "/dev/null was removed");
    refused(&export(Path::new("/dev/full")), &["cannot write /dev/full"]);
    let [far, link] = ["far.json", "link.json"].map(|name| place.path().join(name));
    fs::write(&far, "what was there before and is longer than nothing").unwrap();
    symlink(&far, &link).unwrap();
    assert_eq!(export(&link).code, Some(0));
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    let rows: serde_json::Value = serde_json::from_slice(&fs::read(&far).unwrap()).unwrap();
    assert_eq!(rows.as_array().unwrap().len(), 2);
    let line = "mkfifo $1/p; cat $1/p & \"$0\" export $1 --format json --out $1/p >/dev/null; wait";
    let ran = shell(line, &[place.path()]);
    assert!(ran.stdout.contains("\"state_hash\""), "{ran:?}");
    assert!(fs::symlink_metadata(place.path().join("p")).unwrap().file_type().is_fifo());
    // half a table is no answer
    for format in ["csv", "json", "parquet"] {
        let line = format!("\"$0\" export $1 --format {format} > /dev/full");
        refused(&shell(&line, &[place.path()]), &["cannot write to standard output"]);
    }
    // nor is half a trace, and the one before stays
    let wave = place.path().join("wave.vcd");
    fs::write(&wave, "an older one").unwrap();
    let line = format!("ulimit -f 1; \"$0\" trace {SMALL} --set learning.batch=4 --vcd $1");
    refused(&shell(&line, &[&wave]), &["cannot write", "wave.vcd"]);
    assert_eq!(fs::read(&wave).unwrap(), b"an older one");
}

#[cfg(unix)]
#[test]
fn no_link_of_a_strangers_folder_is_followed_to_write() {
    use std::os::unix::fs::symlink;

    let root = tempfile::tempdir().unwrap();
    let far = root.path().join("far");
    let (folder, _) = trained(root.path(), &[]);
    for name in ["lock", "report.html", "metrics.jsonl", "receipt.json", "timing.json"] {
        let place = folder.join(name);
        let before = fs::read(&place).unwrap();
        fs::remove_file(&place).unwrap();
        let keep = b"what somebody wrote";
        let own = matches!(name, "lock" | "report.html");
        let wanted: &[u8] = if own { keep } else { &before };
        fs::write(&far, wanted).unwrap();
        symlink(&far, &place).unwrap();
        for command in [&["report"][..], &["train", "--resume"], &["verify"], &["price"], &["eval"]]
        {
            let ran = carried(dalean().args(command).arg(&folder));
            assert!(!ran.stderr.contains("panicked"), "{ran:?}");
            assert_eq!(fs::read(&far).unwrap(), wanted, "{command:?} wrote through {name}");
        }
        fs::remove_file(&place).unwrap();
        fs::write(&place, &before).unwrap();
    }
    // folders of a store
    let [place, elsewhere] = ["store", "elsewhere"].map(|name| root.path().join(name));
    store(&place);
    fs::create_dir(&elsewhere).unwrap();
    for name in ["figures", "runs"] {
        let _ = fs::remove_dir_all(place.join(name));
        symlink(&elsewhere, place.join(name)).unwrap();
        let sweep = place.join("two.toml");
        refused(&carried(dalean().arg("sweep").arg(&sweep).arg("--store").arg(&place)), &["link"]);
        assert_eq!(fs::read_dir(&elsewhere).unwrap().count(), 0, "{name}");
        fs::remove_file(place.join(name)).unwrap();
    }
}

#[test]
fn a_name_in_a_strangers_index_is_no_path() {
    let root = tempfile::tempdir().unwrap();
    let place = root.path().join("store");
    store(&place);
    let index = rusqlite::Connection::open(place.join("index.sqlite")).unwrap();
    let put = |text: &str| index.execute_batch(text).unwrap();
    put("UPDATE sweep SET name = '../x'; UPDATE point SET sweep = '../x'");
    let report = |command: &[&str]| {
        let (name, more) = command.split_first().unwrap();
        let mut program = dalean();
        program.arg(name);
        if *name == "store" {
            program.args(more).arg(&place)
        } else {
            program.arg(&place).args(more)
        };
        carried(&mut program)
    };
    for command in [&["report"][..], &["export"], &["store", "list"], &["verify", "--sample", "1"]]
    {
        refused(&report(command), &["holds as the name of a sweep `../x`"]);
    }
    assert!(!root.path().join("x.html").exists());
    put("UPDATE sweep SET name = 'x'; UPDATE point SET sweep = 'x'");
    for key in ["", "a", "\u{e9}", "../../../../etc", &"A".repeat(32), &"a".repeat(33)] {
        index.execute("UPDATE point SET key = ?1", [key]).unwrap();
        for command in [&["report"][..], &["export"], &["store", "list"]] {
            refused(&report(command), &["holds as the key of a run"]);
        }
    }
}

#[cfg(unix)]
#[test]
fn a_pipe_in_a_folder_is_not_waited_at() {
    let root = tempfile::tempdir().unwrap();
    let (folder, _) = trained(root.path(), &[]);
    for name in
        ["config.toml", "receipt.json", "metrics.jsonl", "ledger.json", "checkpoint.safetensors"]
    {
        let place = folder.join(name);
        let before = fs::read(&place).unwrap();
        fs::remove_file(&place).unwrap();
        assert!(Command::new("mkfifo").arg(&place).status().unwrap().success());
        refused(&shell("timeout 60 \"$0\" verify $1", &[&folder]), &[name]);
        fs::remove_file(&place).unwrap();
        fs::write(&place, &before).unwrap();
    }
}

#[cfg(target_os = "linux")]
#[test]
fn nobody_who_hears_is_no_reason_to_panic() {
    use std::os::unix::ffi::OsStrExt;

    let root = tempfile::tempdir().unwrap();
    for end in ["2>/dev/full", "2>&-", "2> >(exec true)", "2>&- >&-"] {
        let line = format!("\"$0\" train {SMALL} --quiet --out $1 {end}");
        let ran = shell(&line, &[root.path()]);
        assert_ne!(ran.code, Some(101), "{end}: {ran:?}");
        let line = format!("\"$0\" train {SMALL} --set learning.epoch=1 --out $1 {end}");
        let ran = shell(&line, &[root.path()]);
        assert_eq!(ran.code, Some(2), "{end}: {ran:?}");
    }
    let wild = std::ffi::OsStr::from_bytes(b"\xff\xfe");
    for command in
        [&["train"][..], &["verify"], &["report"], &["export"], &["price"], &["train", "--set"]]
    {
        refused(&carried(dalean().args(command).arg(wild)), &["error"]);
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_run_is_weighed_before_its_memory_is_taken() {
    let root = tempfile::tempdir().unwrap();
    let large = "--set network.hidden=[65535,65535,65535,65535]";
    let line = format!("\"$0\" train {large} --out $1");
    refused(&shell(&line, &[root.path()]), &["GiB of memory", "are left", "network.hidden"]);
    // also where it is a limit that is in the way
    let line =
        "ulimit -v 400000; \"$0\" train --threads 1 --set network.hidden=[8000,8000] --out $1";
    refused(&shell(line, &[root.path()]), &["of memory", "MiB are left"]);
    assert_eq!(fs::read_dir(root.path()).unwrap().count(), 0, "nothing was begun");
    let line = format!("\"$0\" train {SMALL} --set network.hidden=[1000000,1000000] --out $1");
    refused(&shell(&line, &[root.path()]), &["1000000", "65535"]);
}

fn machine() -> Machine {
    Machine::new(Backend::best(), 1).unwrap()
}

const LONG: &str =
    "data.set = 'xor'\nnetwork.hidden = [3]\nlearning.epochs = 40\nlearning.batch = 2\n";

/// Trains until `on_epoch` says to stop; the folder.
fn begun(root: &Path, on_epoch: &mut (dyn FnMut(&Path, u32) -> bool + Send)) -> PathBuf {
    let config = load(&Sources { experiment: Some(("it", LONG)), ..Sources::default() }).unwrap();
    let mut folder = PathBuf::new();
    let mut go_on = true;
    let outcome = run::train(&config, &DataRoot::new("none"), root, machine(), &mut |event| {
        match event {
            RunEvent::Started { folder: path, .. } => folder = path.to_owned(),
            RunEvent::Epoch(record, _) => go_on = on_epoch(&folder, record.epoch),
            _ => {}
        }
        go_on
    });
    assert!(outcome.is_ok() || matches!(outcome, Err(RunError::Stopped { .. })), "{outcome:?}");
    folder
}

#[cfg(unix)]
#[test]
fn records_are_put_behind_those_before_and_never_written_again() {
    use std::os::unix::fs::MetadataExt;

    let root = tempfile::tempdir().unwrap();
    let mut seen = Vec::new();
    begun(root.path(), &mut |folder, _| {
        let log = fs::metadata(folder.join("metrics.jsonl")).unwrap();
        seen.push((log.ino(), log.len()));
        true
    });
    assert!(seen.len() > 30, "{seen:?}");
    assert!(seen.iter().all(|(inode, _)| *inode == seen[0].0), "the file was replaced: {seen:?}");
    assert!(seen.is_sorted_by(|a, b| a.1 < b.1), "it grows: {seen:?}");
}

#[test]
fn half_a_line_that_a_kill_left_is_mended_by_who_goes_on() {
    let root = tempfile::tempdir().unwrap();
    let whole = begun(root.path(), &mut |_, _| true);
    let folder = begun(root.path(), &mut |_, epoch| epoch < 7);
    let log = folder.join("metrics.jsonl");
    let mut text = fs::read_to_string(&log).unwrap();
    let half = text.lines().last().unwrap().get(..50).unwrap().to_owned();
    text.push_str(&half);
    fs::write(&log, text).unwrap();
    for part in [".dalean-part-abcdef", ".part-abcdef"] {
        fs::write(folder.join(part), "half a file").unwrap();
    }
    let verdict = run::verify(&folder, &DataRoot::new("none"), machine(), None, &mut |_| true);
    assert!(matches!(verdict, Ok(Verdict::Same { .. })), "{verdict:?}");
    run::resume(&folder, &DataRoot::new("none"), machine(), &mut |_| true).unwrap();
    for name in ["metrics.jsonl", "receipt.json", "ledger.json", "checkpoint.safetensors"] {
        let [mended, wanted] = [&folder, &whole].map(|f| fs::read(f.join(name)).unwrap());
        assert_eq!(mended, wanted, "{name}");
    }
    let left = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().file_name());
    assert!(!left.map(|name| name.into_string().unwrap()).any(|name| name.contains("part-")));
}

#[test]
fn a_finished_run_is_never_begun_anew() {
    let root = tempfile::tempdir().unwrap();
    let folder = begun(root.path(), &mut |_, _| true);
    let before = fs::read(folder.join("metrics.jsonl")).unwrap();
    let go_on = || run::resume(&folder, &DataRoot::new("none"), machine(), &mut |_| true);
    assert!(matches!(go_on(), Err(RunError::Finished { .. })));
    for name in ["checkpoint.safetensors", "receipt.json"] {
        fs::remove_file(folder.join(name)).unwrap();
        assert!(go_on().is_err(), "{name} is gone");
        assert_eq!(fs::read(folder.join("metrics.jsonl")).unwrap(), before);
    }
    // nor one that lost the state it would go on from
    let folder = begun(root.path(), &mut |_, epoch| epoch < 7);
    fs::remove_file(folder.join("checkpoint.safetensors")).unwrap();
    let outcome = run::resume(&folder, &DataRoot::new("none"), machine(), &mut |_| true);
    assert!(outcome.unwrap_err().to_string().contains("checkpoint.safetensors"));
}

#[test]
fn a_name_of_a_chip_does_not_switch_its_model_off() {
    let ran = |settings: &[&str]| {
        let mut command = dalean();
        command.arg("profile");
        for setting in settings {
            command.args(["--set", setting]);
        }
        carried(&mut command)
    };
    let both = ran(&["hw.model=prime", "hw.name=mine"]);
    refused(&both, &["`hw.name`", "switch the model", "hw.name=default"]);
    refused(&ran(&["hw.name=mine"]), &["`hw.name`", "there is no [hw.cell]"]);
    assert_eq!(ran(&["hw.model=prime"]).code, Some(0));
}

/// Progress of `verify` once said `epoch 2/0`.
#[test]
fn verify_counts_the_epochs_it_does_again() {
    let root = tempfile::tempdir().unwrap();
    let folder = begun(root.path(), &mut |_, epoch| epoch < 5);
    let seen = std::sync::Mutex::new(Vec::new());
    for epochs in [None, Some(2)] {
        let none = DataRoot::new("none");
        let verdict = run::verify(&folder, &none, machine(), epochs, &mut |progress| {
            seen.lock().unwrap().push(progress.epochs);
            true
        });
        assert!(matches!(verdict, Ok(Verdict::Same { .. })), "{verdict:?}");
    }
    let mut seen = seen.into_inner().unwrap();
    seen.dedup();
    assert_eq!(seen.len(), 2, "{seen:?}");
    assert!(seen[0] >= 4 && seen[1] == 2, "{seen:?}");
}
