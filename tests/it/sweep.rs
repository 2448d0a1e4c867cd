//! Sweeps: nothing lost, nothing doubled, whatever is killed, shared, cut up or full.
#![expect(
    clippy::disallowed_types,
    reason = "processes are killed at moments that the clock picks"
)]

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use serde_json::Value;

use super::program::{Ran, dalean, run};

const SWEEP: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/sweep.toml");
const RUNS: usize = 12;

fn sweep(store: &Path) -> Command {
    let mut command = dalean();
    command.args(["sweep", SWEEP, "--json", "--store"]).arg(store);
    command
}

/// The table as CSV.
fn table(store: &Path) -> String {
    let ran = run(dalean().arg("export").arg(store));
    assert_eq!(ran.code, Some(0), "{ran:?}");
    ran.stdout
}

fn events(ran: &Ran, name: &str) -> Vec<Value> {
    let all = ran.stdout.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    all.filter(|event| event["event"] == name).collect()
}

/// A sweep that nothing disturbed, and its table.
fn undisturbed() -> (tempfile::TempDir, Ran, String) {
    let store = tempfile::tempdir().unwrap();
    let ran = run(&mut sweep(store.path()));
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let table = table(store.path());
    (store, ran, table)
}

fn folders(store: &Path) -> usize {
    let groups = std::fs::read_dir(store.join("runs")).unwrap();
    groups.map(|group| std::fs::read_dir(group.unwrap().path()).unwrap().count()).sum()
}

#[test]
fn a_sweep_fills_its_table_and_is_not_done_again() {
    let (store, ran, table) = undisturbed();
    let done = ran.last();
    assert_eq!((&done["event"], &done["finished"]), (&"done".into(), &RUNS.into()));
    let runs = events(&ran, "run");
    assert_eq!(runs.len(), RUNS);
    assert_eq!((table.lines().count(), folders(store.path())), (RUNS + 1, RUNS));
    let head = table.lines().next().unwrap();
    assert!(head.starts_with("point,bits,rule,seed,test_accuracy,"), "{head}");
    // the table says what `train` says of the same configuration
    let settings = [
        "data.set=optdigits",
        "network.hidden=[16]",
        "network.alpha=4",
        "network.weight_max=4",
        "learning.batch=64",
        "learning.epochs=3",
        "learning.rate_multipliers=1.0",
        "learning.select=best_validation",
        "learning.rule=bp",
        "learning.rate=10",
        "hw.cell.level_bits=4",
    ];
    let empty = store.path().join("empty.toml");
    std::fs::write(&empty, "").unwrap();
    let mut train = dalean();
    train.arg("train").arg(&empty).args(["--json", "--seed", "2", "--out"]).arg(store.path());
    for setting in settings {
        train.args(["--set", setting]);
    }
    let trained = run(&mut train).last();
    let wanted =
        |event: &&Value| event["values"] == serde_json::json!([4, "bp"]) && event["seed"] == 2;
    let same = runs.iter().find(wanted).unwrap();
    assert_eq!(same["state_hash"], trained["state_hash"]);
    assert_eq!(same["results"]["test_accuracy"], trained["test_accuracy"]);
    assert_eq!(same["results"]["cycles"], trained["cycles"]);
    // a second time there is nothing to do
    let again = run(&mut sweep(store.path()));
    assert_eq!((again.code, events(&again, "run").len()), (Some(0), 0), "{again:?}");
    let dry = run(sweep(store.path()).arg("--dry-run")).last();
    assert_eq!((&dry["finished"], &dry["todo"]), (&RUNS.into(), &0.into()));
    // one more bit: only what is new is run
    let more = std::fs::read_to_string(SWEEP).unwrap().replace("[2, 4, 8]", "[2, 4, 6, 8]");
    let file = store.path().join("more.toml");
    std::fs::write(&file, more).unwrap();
    let mut grow = dalean();
    grow.arg("sweep").arg(&file).args(["--json", "--store"]).arg(store.path());
    // it is another sweep of that name, and nothing is replaced unasked
    let ran = run(&mut grow);
    assert!(ran.code == Some(1) && ran.stderr.contains("another sweep `small`"), "{ran:?}");
    assert_eq!(self::table(store.path()), table);
    let grown = run(grow.arg("--replace"));
    assert_eq!((events(&grown, "run").len(), grown.last()["finished"].as_u64()), (4, Some(16)));
}

#[test]
fn killed_ten_times_with_two_processes_the_table_is_that_of_an_undisturbed_sweep() {
    // long enough to be killed in the midst of runs, with and without checkpoints
    let start = |store: &Path, number: u32| {
        let seconds = if number.is_multiple_of(2) { "0" } else { "10" };
        let mut command = sweep(store);
        command.args(["--set", "learning.epochs=24", "--checkpoint-seconds", seconds]);
        command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("the program starts")
    };
    let whole = tempfile::tempdir().unwrap();
    let clock = Instant::now();
    assert!(start(whole.path(), 1).wait_with_output().unwrap().status.success());
    let (time, wanted) = (clock.elapsed(), table(whole.path()));
    let store = tempfile::tempdir().unwrap();
    let mut killed = 0;
    for number in 0..10 {
        let mut children = [start(store.path(), number), start(store.path(), number + 1)];
        let nanos = SystemTime::now().duration_since(UNIX_EPOCH).unwrap().subsec_nanos();
        let moment = time.mul_f64(f64::from(nanos % 1_000_003) / 1_000_003.0 / 5.0);
        std::thread::sleep(moment.max(Duration::from_millis(5)));
        for child in &mut children {
            killed += usize::from(child.try_wait().unwrap().is_none());
            child.kill().unwrap();
            child.wait().unwrap();
        }
    }
    assert!(killed >= 5, "only {killed} processes were still at work when they were killed");
    let pair = [start(store.path(), 0), start(store.path(), 1)];
    let pair = pair.map(|child| Ran::from(child.wait_with_output().unwrap()));
    for ran in &pair {
        let finished = ran.last()["finished"].as_u64();
        assert_eq!((ran.code, finished), (Some(0), Some(RUNS as u64)), "{ran:?}");
    }
    assert_eq!(table(store.path()), wanted);
    assert_eq!(folders(store.path()), RUNS);
}

#[test]
fn a_killed_run_of_a_sweep_goes_on_from_its_checkpoint() {
    let file = tempfile::tempdir().unwrap();
    let one = file.path().join("one.toml");
    let text = "base.data.set = 'optdigits'\nbase.learning.epochs = 60\n[[axis]]\nkey = 'seed'\nname = 'draw'\nvalues = [5]\n";
    std::fs::write(&one, text).unwrap();
    let start = |store: &Path| {
        let mut command = dalean();
        command.arg("sweep").arg(&one).args(["--json", "--checkpoint-seconds", "0", "--store"]);
        command.arg(store);
        command
    };
    let log = |store: &Path| {
        let group = std::fs::read_dir(store.join("runs")).unwrap().next().unwrap().unwrap().path();
        let path = std::fs::read_dir(group).unwrap().next().unwrap().unwrap().path();
        std::fs::read_to_string(path.join("metrics.jsonl")).unwrap()
    };
    let [whole, store] = [0, 1].map(|_| tempfile::tempdir().unwrap());
    assert_eq!(run(&mut start(whole.path())).code, Some(0));
    let mut child =
        start(store.path()).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let records = || {
        let group = std::fs::read_dir(store.path().join("runs")).ok()?.next()?.ok()?.path();
        let path = std::fs::read_dir(group).ok()?.next()?.ok()?.path();
        // the receipt is the last file of an epoch
        path.join("receipt.json").exists().then_some(())?;
        Some(std::fs::read_to_string(path.join("metrics.jsonl")).ok()?.lines().count())
    };
    let clock = Instant::now();
    while records().unwrap_or(0) < 6 {
        assert!(clock.elapsed() < Duration::from_secs(120), "no epoch was written down");
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let kept = log(store.path());
    let before: Vec<&str> = kept.lines().take(4).collect();
    assert!(kept.lines().count() < 61, "the run outran the kill");
    let ran = run(&mut start(store.path()));
    assert_eq!(ran.code, Some(0), "{ran:?}");
    assert_eq!(table(store.path()), table(whole.path()));
    // records hold the seconds that an epoch took: those from before the kill are still the first process's
    let after = log(store.path());
    assert_eq!(after.lines().take(4).collect::<Vec<_>>(), before);
    assert_eq!(after.lines().count(), 61);
}

#[test]
fn two_processes_share_a_store_without_doing_a_run_twice() {
    let (_, _, wanted) = undisturbed();
    let store = tempfile::tempdir().unwrap();
    let start =
        || sweep(store.path()).args(["--threads", "1"]).stdout(Stdio::piped()).spawn().unwrap();
    let pair = [start(), start()].map(|child| Ran::from(child.wait_with_output().unwrap()));
    let mut done = BTreeMap::new();
    for ran in &pair {
        assert_eq!(ran.code, Some(0), "{ran:?}");
        for event in events(ran, "run") {
            if event["elsewhere"] == false {
                *done.entry(event["key"].to_string()).or_insert(0) += 1;
            }
        }
    }
    assert_eq!(done.len(), RUNS);
    assert!(done.values().all(|times| *times == 1), "{done:?}");
    assert_eq!(table(store.path()), wanted);
}

#[test]
fn shards_in_stores_of_their_own_merge_into_the_whole() {
    let (_, _, wanted) = undisturbed();
    let root = tempfile::tempdir().unwrap();
    let parts = ["1/3", "2/3", "3/3"].map(|shard| {
        let store = root.path().join(shard.replace('/', "of"));
        let ran = run(sweep(&store).args(["--shard", shard]));
        assert_eq!((ran.code, ran.last()["runs"].as_u64()), (Some(0), Some(4)), "{ran:?}");
        store
    });
    let whole = root.path().join("whole");
    let merge =
        |from: &[&Path]| run(dalean().args(["store", "merge", "--json"]).arg(&whole).args(from));
    let ran = merge(&parts.each_ref().map(AsRef::as_ref));
    assert_eq!(ran.code, Some(0), "{ran:?}");
    assert_eq!(table(&whole), wanted);
    assert_eq!(merge(&[&parts[0]]).last()["shared"], 4);
    // the index is made again from the folders
    std::fs::remove_file(whole.join("index.sqlite")).unwrap();
    let ran = run(dalean().args(["store", "index", "--json"]).arg(&whole));
    assert_eq!(ran.last()["finished"], RUNS, "{ran:?}");
    let ran = run(&mut sweep(&whole));
    assert_eq!((ran.code, events(&ran, "run").len()), (Some(0), 0), "{ran:?}");
    assert_eq!(table(&whole), wanted);
    // a run that says something else is not merged in silence
    let key = wanted.lines().nth(1).unwrap().rsplit(',').nth(1).unwrap();
    let folder = parts[0].join("runs").join(&key[..2]).join(key);
    let [metrics, receipt] = ["metrics.jsonl", "receipt.json"].map(|name| folder.join(name));
    let text = std::fs::read_to_string(&metrics).unwrap();
    let at = text.rfind("\"state_hash\":\"").unwrap() + 14;
    let zeros = "0".repeat(64);
    let forged = format!("{}{zeros}{}", &text[..at], &text[at + 64..]);
    std::fs::write(&metrics, &forged).unwrap();
    let ran = merge(&[&parts[0]]);
    assert!(ran.code == Some(1) && ran.stderr.contains("does not hold the"), "{ran:?}");
    // nor one whose receipt goes along with it
    let honest = std::fs::read_to_string(&receipt).unwrap();
    let hash = dalean::lab::store::hash::bytes;
    let lying = honest.replace(&text[at..at + 64], &zeros).replace(&hash(&text), &hash(&forged));
    std::fs::write(&receipt, lying).unwrap();
    let ran = merge(&[&parts[0]]);
    assert_eq!(ran.code, Some(1), "{ran:?}");
    assert!(ran.stderr.contains("one of the two machines is wrong"), "{ran:?}");
}

#[test]
fn a_sample_of_a_store_is_done_again_and_lies_are_found() {
    let (store, _, honest) = undisturbed();
    let verify = |count: &str| {
        let path = store.path();
        run(dalean().arg("verify").arg(path).args([
            "--json",
            "--sample",
            count,
            "--sample-seed",
            "1",
        ]))
    };
    let ran = verify("3");
    assert_eq!((ran.code, ran.last()["runs"].as_u64()), (Some(0), Some(3)), "{ran:?}");
    // an index that flatters
    let index = rusqlite::Connection::open(store.path().join("index.sqlite")).unwrap();
    let text = "UPDATE run SET row = replace(row, '\"test_accuracy\":0.', '\"test_accuracy\":1.')";
    assert_eq!(index.execute(text, []).unwrap(), RUNS);
    drop(index);
    let ran = verify("1");
    assert_eq!(ran.code, Some(4), "{ran:?}");
    // it is the index that lies, and not this machine
    let told = "`test_accuracy` differs: the index says 1.";
    assert!(ran.stderr.contains(told) && ran.stderr.contains("its folder gives 0."), "{ran:?}");
    // what it claims does not come over: rows are read off the folders
    let other = store.path().join("other");
    let ran = run(dalean().args(["store", "merge", "--json"]).args([&other, store.path()]));
    assert_eq!(ran.last()["runs"], RUNS, "{ran:?}");
    assert_eq!(table(&other), honest);
}

/// The folder of the first run of a table.
fn first_run(store: &Path, table: &str) -> (String, std::path::PathBuf) {
    let key = table.lines().nth(1).unwrap().rsplit(',').nth(1).unwrap();
    (key.to_owned(), store.join("runs").join(&key[..2]).join(key))
}

#[test]
fn a_store_does_not_believe_in_runs_whose_folders_are_gone() {
    let (store, _, wanted) = undisturbed();
    let (key, folder) = first_run(store.path(), &wanted);
    std::fs::remove_dir_all(&folder).unwrap();
    let list = run(dalean().args(["store", "list", "--json"]).arg(store.path()));
    assert_eq!(list.last()["finished"], RUNS - 1, "{list:?}");
    assert!(list.stderr.contains("their folders are gone"), "{list:?}");
    let ran = run(dalean().arg("export").arg(store.path()));
    assert!(ran.stderr.contains("1 points were finished, but their folders are gone"), "{ran:?}");
    assert_eq!(ran.stdout.lines().nth(1).unwrap().matches(",lost,").count(), 1, "{ran:?}");
    let dry = run(sweep(store.path()).arg("--dry-run")).last();
    assert_eq!(dry["todo"], 1, "{dry}");
    let verify = run(dalean().arg("verify").arg(store.path()).args(["--sample", "99"]));
    assert!(verify.code == Some(1) && verify.stderr.contains(&key), "{verify:?}");
    let ran = run(&mut sweep(store.path()));
    let done: Vec<_> = events(&ran, "run");
    assert_eq!((ran.code, done.len(), &done[0]["key"]), (Some(0), 1, &key.into()), "{ran:?}");
    assert_eq!(table(store.path()), wanted);
    // and an index that is made again forgets them
    std::fs::remove_dir_all(&folder).unwrap();
    let ran = run(dalean().args(["store", "index", "--json"]).arg(store.path()));
    assert_eq!(
        (&ran.last()["finished"], &ran.last()["forgotten"]),
        (&(RUNS - 1).into(), &1.into())
    );
    // what is no store is not made one by asking for its index
    let typo = store.path().join("typo");
    let ran = run(dalean().args(["store", "index"]).arg(&typo));
    assert!(ran.code == Some(1) && ran.stderr.contains("is no store"), "{ran:?}");
    assert!(!typo.exists());
}

#[test]
fn a_merge_leaves_what_is_broken_behind_and_takes_the_rest() {
    let (store, _, wanted) = undisturbed();
    let rows: Vec<&str> = wanted.lines().skip(1).collect();
    let folder = |at: usize| {
        let key = rows[at].rsplit(',').nth(1).unwrap();
        store.path().join("runs").join(&key[..2]).join(key)
    };
    std::fs::write(folder(0).join("metrics.jsonl"), "").unwrap();
    std::fs::remove_file(folder(1).join("config.toml")).unwrap();
    std::fs::write(folder(2).join("somebody's.txt"), "not of the run").unwrap();
    let mut broken = 2;
    #[cfg(unix)]
    {
        let far = store.path().join("far.toml");
        std::fs::copy(folder(3).join("config.toml"), &far).unwrap();
        std::fs::remove_file(folder(3).join("config.toml")).unwrap();
        std::os::unix::fs::symlink(&far, folder(3).join("config.toml")).unwrap();
        std::fs::remove_file(folder(4).join("report.html")).unwrap();
        let made = Command::new("mkfifo").arg(folder(4).join("report.html")).status();
        assert!(made.unwrap().success());
        broken += 2;
    }
    let into = tempfile::tempdir().unwrap();
    let ran = run(dalean().args(["store", "merge", "--json"]).args([into.path(), store.path()]));
    assert_eq!(ran.code, Some(1), "{ran:?}");
    let done: Value = serde_json::from_str(ran.stdout.lines().next().unwrap()).unwrap();
    assert_eq!(done["runs"], RUNS - broken, "{ran:?}");
    assert_eq!(done["skipped"].as_array().unwrap().len(), broken);
    assert!(ran.stderr.contains("no plain file"), "{ran:?}");
    let key = rows[2].rsplit(',').nth(1).unwrap();
    let copied = into.path().join("runs").join(&key[..2]).join(key);
    assert!(copied.join("receipt.json").exists() && !copied.join("somebody's.txt").exists());
}

#[test]
fn a_finished_run_that_cannot_be_read_is_done_again() {
    let (store, _, wanted) = undisturbed();
    let key = wanted.lines().nth(1).unwrap().rsplit(',').nth(1).unwrap();
    let folder = store.path().join("runs").join(&key[..2]).join(key);
    std::fs::write(folder.join("metrics.jsonl"), "").unwrap();
    std::fs::remove_file(store.path().join("index.sqlite")).unwrap();
    let ran = run(&mut sweep(store.path()));
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let done: Vec<_> =
        events(&ran, "run").into_iter().filter(|e| e["elsewhere"] == false).collect();
    assert_eq!((done.len(), &done[0]["key"]), (1, &key.into()));
    assert_eq!(table(store.path()), wanted);
}

/// A limit on the size of files stands for a full disk.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_stops_a_sweep_that_goes_on_later() {
    let (_, _, wanted) = undisturbed();
    let store = tempfile::tempdir().unwrap();
    for room in [1, 9, 25] {
        let line = format!("ulimit -f {room}; exec \"$0\" sweep \"$2\" --json --store \"$1\"");
        let mut command = Command::new("bash");
        command.arg("-c").arg(line).arg(env!("CARGO_BIN_EXE_dalean")).arg(store.path()).arg(SWEEP);
        let ran = run(&mut command);
        assert_eq!(ran.code, Some(1), "{room}: {ran:?}");
        assert!(ran.stderr.contains("free some space"), "{room}: {ran:?}");
    }
    let ran = run(&mut sweep(store.path()));
    assert_eq!(ran.code, Some(0), "{ran:?}");
    assert_eq!(table(store.path()), wanted);
}

#[test]
fn exports_agree() {
    let (store, _, csv) = undisturbed();
    let out = store.path().join("table.json");
    let ran = run(dalean().arg("export").arg(store.path()).arg("--out").arg(&out));
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let json: Value = serde_json::from_str(&std::fs::read_to_string(&out).unwrap()).unwrap();
    let mut reader = csv::Reader::from_reader(csv.as_bytes());
    let names = reader.headers().unwrap().clone();
    for (record, object) in reader.records().zip(json.as_array().unwrap()) {
        for (name, cell) in names.iter().zip(&record.unwrap()) {
            let wanted = match &object[name] {
                Value::Null => String::new(),
                Value::String(text) => text.clone(),
                number => number.as_f64().unwrap().to_string(),
            };
            assert_eq!(cell, wanted, "{name}");
        }
    }
    let out = store.path().join("table.parquet");
    let ran = run(dalean().arg("export").arg(store.path()).arg("--out").arg(&out));
    assert!(std::fs::read(&out).unwrap().starts_with(b"PAR1"), "{ran:?}");
    let ran = run(dalean().arg("export").arg(store.path()).args(["--sweep", "other"]));
    assert!(ran.code == Some(1) && ran.stderr.contains("it has small"), "{ran:?}");
    let ran = run(dalean().arg("verify").arg(store.path()));
    assert!(ran.code == Some(2) && ran.stderr.contains("--sample"), "{ran:?}");
    let ran = run(dalean().arg("export").arg(store.path().join("nowhere")));
    assert!(ran.code == Some(1) && ran.stderr.contains("is no store"), "{ran:?}");
}

/// A small part of `tests/golden/many.toml`, whose ten thousand points are measured by hand (docs/results/sweeps.md).
#[test]
fn a_sample_of_many_axes_fills_store_page_and_figures() {
    let store = tempfile::tempdir().unwrap();
    let many = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/many.toml");
    let text = std::fs::read_to_string(many).unwrap().replace("points = 10000", "points = 60");
    let file = store.path().join("many.toml");
    std::fs::write(&file, text).unwrap();
    let ran = run(dalean().arg("sweep").arg(&file).args(["--json", "--store"]).arg(store.path()));
    assert_eq!((ran.code, ran.last()["finished"].as_u64()), (Some(0), Some(60)), "{ran:?}");
    let page = std::fs::read_to_string(store.path().join("many.html")).unwrap();
    let ran = run(dalean().arg("report").arg(store.path()).arg("--json"));
    assert_eq!(ran.last()["finished"], 60, "{ran:?}");
    let figures = ran.last()["figures"].as_array().unwrap().clone();
    assert!(figures.len() >= 4, "{figures:?}");
    for figure in figures {
        let path = figure.as_str().unwrap();
        let bytes = std::fs::read(path).unwrap();
        assert!(bytes.starts_with(b"<svg") || bytes.starts_with(b"\x89PNG"), "{path}");
    }
    assert_eq!(std::fs::read_to_string(store.path().join("many.html")).unwrap(), page);
    // every link leads to the page of its run
    let links: Vec<_> = page.match_indices("runs/").map(|(at, _)| &page[at..]).collect();
    assert!(links.len() >= 60, "{}", links.len());
    for link in links {
        let end = link.find(".html").unwrap() + 5;
        assert!(store.path().join(&link[..end]).is_file(), "{}", &link[..end]);
    }
}
