//! Whatever of a run folder is changed is found: by `verify` always, by `--resume` and `eval` where they lean on it.
//!
//! Each number, word and place of the receipt, of every record, of the ledger and of the checkpoints is damaged, one at a
//! time: once as an accident would do it, and once as a forger who puts the hashes right again.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use dalean::chip::crossbar::kernel::Backend;
use dalean::lab::config::{Sources, load};
use dalean::lab::data::DataRoot;
use dalean::lab::run::{self, Machine, RunError, RunEvent, Verdict};
use dalean::lab::store::hash;
use dalean::lab::store::index::Store;
use dalean::lab::sweep::{Sampled, reindex, sample};
use safetensors::SafeTensors;
use serde_json::Value;

use super::golden_run::EVERYTHING;
use super::policies::TINY;
use super::program::{dalean, only_run, run as run_program};

fn machine() -> Machine {
    Machine::new(Backend::best(), 1).unwrap()
}

fn root() -> DataRoot {
    DataRoot::new("no such folder")
}

/// Files of a run folder, by name.
type Files = BTreeMap<String, Vec<u8>>;

fn files(folder: &Path) -> Files {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    let named =
        entries.map(|e| (e.file_name().into_string().unwrap(), fs::read(e.path()).unwrap()));
    named.filter(|(name, _)| name != "lock").collect()
}

/// A folder that holds these files and nothing else.
fn lay(folder: &Path, files: &Files) {
    let _ = fs::remove_dir_all(folder);
    fs::create_dir(folder).unwrap();
    files.iter().for_each(|(name, bytes)| fs::write(folder.join(name), bytes).unwrap());
}

/// A run, finished or stopped in its last epoch.
fn made(finished: bool) -> Files {
    made_of(EVERYTHING, finished)
}

fn made_of(experiment: &str, finished: bool) -> Files {
    let work = tempfile::tempdir().unwrap();
    let config = load(&Sources { experiment: Some(("it", experiment)), ..Sources::default() });
    let mut go_on = |event: RunEvent<'_>| !matches!(event, RunEvent::Batch(progress) if progress.epoch == 1 && !finished);
    let outcome = run::train(&config.unwrap(), &root(), work.path(), machine(), &mut go_on);
    match outcome {
        Ok(_) => assert!(finished),
        Err(error) => assert!(matches!(error, RunError::Stopped { .. }) && !finished, "{error}"),
    }
    files(&only_run(work.path()))
}

/// Places of everything that is no list or table, as JSON pointers, and of lists and tables that are empty.
fn leaves(value: &Value, place: &str, out: &mut Vec<String>) {
    match value {
        Value::Object(map) if !map.is_empty() => {
            let pointed = |name: &str| name.replace('~', "~0").replace('/', "~1");
            map.iter().for_each(|(name, value)| {
                leaves(value, &format!("{place}/{}", pointed(name)), out)
            });
        }
        Value::Array(list) if !list.is_empty() => {
            let places = list.iter().enumerate();
            places.for_each(|(at, value)| leaves(value, &format!("{place}/{at}"), out));
        }
        _ => out.push(place.into()),
    }
}

/// Another value of the same kind.
fn another(value: &Value) -> Value {
    match value {
        Value::Number(number) => match number.as_u64() {
            Some(n) => n.wrapping_add(1).into(),
            None => match number.as_i64() {
                Some(n) => (n + 1).into(),
                None => (number.as_f64().unwrap() + 1.0).into(),
            },
        },
        Value::String(text) => {
            let first = if text.starts_with('a') { 'b' } else { 'a' };
            format!("{first}{}", text.get(1..).unwrap_or_default()).into()
        }
        Value::Bool(is) => (!is).into(),
        Value::Null => 1.into(),
        Value::Array(_) => vec![Value::from(1)].into(),
        Value::Object(_) => serde_json::json!({"more": 1}),
    }
}

/// Every way to change one thing of a JSON text: another value, or none, at each of its places.
fn changed(text: &str) -> Vec<(String, String)> {
    let value: Value = serde_json::from_str(text).unwrap();
    let mut places = Vec::new();
    leaves(&value, "", &mut places);
    let mut all = Vec::new();
    for place in places {
        let mut other = value.clone();
        let spot = other.pointer_mut(&place).unwrap();
        *spot = another(spot);
        all.push((format!("{place} changed"), other.to_string()));
        let (parent, name) = place.rsplit_once('/').unwrap();
        let mut without = value.clone();
        match without.pointer_mut(parent).unwrap() {
            Value::Object(map) => drop(map.remove(&name.replace("~1", "/").replace("~0", "~"))),
            Value::Array(list) => drop(list.remove(name.parse().unwrap())),
            _ => unreachable!("places lie in lists and tables"),
        }
        all.push((format!("{place} removed"), without.to_string()));
    }
    all
}

/// Whether a change took a count of 0, or a table without counts, out of a table of counts: what is absent there is 0, so a text that a forger's receipt
/// vouches for says what it said before. (The true receipt holds the hash of its bytes, and finds that too.)
fn says_the_same(text: &str, what: &str) -> bool {
    let Some(place) = what.strip_suffix(" removed") else { return false };
    let value: Value = serde_json::from_str(text).unwrap();
    let counts = ["events", "cycles", "training", "stages", "busy", "used"];
    let nothing = value.pointer(place).is_some_and(|v| *v == 0 || *v == serde_json::json!({}));
    nothing && place.split('/').any(|part| counts.contains(&part))
}

/// The files with another text under `name`.
fn with(files: &Files, name: &str, bytes: impl Into<Vec<u8>>) -> Files {
    let mut files = files.clone();
    files.insert(name.into(), bytes.into());
    files
}

/// The same, and the receipt says that all is well: what a forger does.
fn forged(files: &Files, name: &str, field: &str, bytes: impl Into<Vec<u8>>) -> Files {
    let mut files = with(files, name, bytes);
    let mut receipt: Value = serde_json::from_slice(&files["receipt.json"]).unwrap();
    *receipt.pointer_mut(field).unwrap() = hash::bytes(&files[name]).into();
    files.insert("receipt.json".into(), receipt.to_string().into_bytes());
    files
}

/// Whether `verify` finds that something is wrong.
fn is_found(work: &Path, files: &Files) -> bool {
    let folder = work.join("run");
    lay(&folder, files);
    let verdict = run::verify(&folder, &root(), machine(), None, &mut |_| true);
    !matches!(verdict, Ok(Verdict::Same { .. }))
}

fn is_read(work: &Path, files: &Files) -> bool {
    let folder = work.join("run");
    lay(&folder, files);
    run::evaluate(&folder, &root(), machine()).is_ok()
}

fn is_resumed(work: &Path, files: &Files) -> bool {
    let folder = work.join("run");
    lay(&folder, files);
    run::resume(&folder, &root(), machine(), &mut |_| true).is_ok()
}

/// A checkpoint with one thing changed in each of its tensors and entries; `honest` leaves the hash of the content as it
/// was, otherwise it is made right again.
fn changed_checkpoints(bytes: &[u8], honest: bool) -> Vec<(String, Vec<u8>)> {
    let (_, header) = SafeTensors::read_metadata(bytes).unwrap();
    let file = SafeTensors::deserialize(bytes).unwrap();
    let about = &header.metadata().as_ref().unwrap()["dalean"];
    let entries: BTreeMap<String, String> = serde_json::from_str(about).unwrap();
    let tensors: BTreeMap<String, (safetensors::Dtype, Vec<usize>, Vec<u8>)> = file
        .tensors()
        .into_iter()
        .map(|(name, t)| (name, (t.dtype(), t.shape().to_vec(), t.data().to_vec())))
        .collect();
    let put_together = |tensors: &BTreeMap<String, (safetensors::Dtype, Vec<usize>, Vec<u8>)>,
                        mut entries: BTreeMap<String, String>| {
        if !honest {
            let mut content = Vec::new();
            for (name, (dtype, shape, bytes)) in tensors {
                content.extend(format!("{name}\n{dtype:?} {shape:?}\n").into_bytes());
                content.extend(bytes);
            }
            for name in ["arithmetic", "run", "data", "state_hash"] {
                content.extend(format!("{name} {}\n", entries[name]).into_bytes());
            }
            entries.insert("content".into(), hash::bytes(&content));
        }
        let views = tensors.iter().map(|(name, (dtype, shape, bytes))| {
            let view = safetensors::tensor::TensorView::new(*dtype, shape.clone(), bytes);
            (name.clone(), view.unwrap())
        });
        let about = serde_json::to_string(&entries).unwrap();
        safetensors::serialize(views, Some([("dalean".to_owned(), about)].into())).unwrap()
    };
    assert_eq!(put_together(&tensors, entries.clone()), bytes, "a checkpoint comes back");
    let mut all = Vec::new();
    for name in tensors.keys() {
        for at in [0, 1] {
            let mut other = tensors.clone();
            let bytes = &mut other.get_mut(name).unwrap().2;
            if bytes.is_empty() {
                continue;
            }
            let place = if at == 0 { 0 } else { bytes.len() - bytes.len() / 3 - 1 };
            bytes[place] ^= 1;
            all.push((format!("{name}, byte {place}"), put_together(&other, entries.clone())));
        }
        let mut without = tensors.clone();
        without.remove(name);
        all.push((format!("{name} removed"), put_together(&without, entries.clone())));
    }
    let mut more = tensors.clone();
    more.insert("more".into(), (safetensors::Dtype::U8, vec![1], vec![1]));
    all.push(("a tensor more".into(), put_together(&more, entries.clone())));
    for name in entries.keys().filter(|name| honest || *name != "content") {
        let mut other = entries.clone();
        let value = other.get_mut(name).unwrap();
        let first = if value.starts_with('1') { "2" } else { "1" };
        value.replace_range(..1, first);
        all.push((format!("entry {name}"), put_together(&tensors, other)));
    }
    all.push(("a byte less".into(), bytes[..bytes.len() - 1].to_vec()));
    all.push(("a byte more".into(), [bytes, &[0]].concat()));
    all
}

fn best_name(files: &Files) -> String {
    files.keys().find(|name| name.starts_with("best-")).cloned().expect("a best state is kept")
}

#[test]
fn every_field_of_a_finished_run_is_verified() {
    let work = tempfile::tempdir().unwrap();
    let whole = made(true);
    assert!(!is_found(work.path(), &whole) && is_read(work.path(), &whole), "an untouched run");
    let text = |name: &str| String::from_utf8(whole[name].clone()).unwrap();
    let mut count = 0;
    let mut look = |what: &str, files: &Files| {
        count += 1;
        assert!(is_found(work.path(), files), "not found: {what}");
    };

    for (what, receipt) in changed(&text("receipt.json")) {
        look(&format!("receipt {what}"), &with(&whole, "receipt.json", receipt));
    }
    let metrics = text("metrics.jsonl");
    let lines: Vec<&str> = metrics.lines().collect();
    for (at, line) in lines.iter().enumerate() {
        for (what, other) in changed(line) {
            let same = says_the_same(line, &what);
            let mut lines = lines.clone();
            lines[at] = &other;
            let metrics = lines.join("\n") + "\n";
            let what = format!("record {at} {what}");
            look(&what, &with(&whole, "metrics.jsonl", metrics.clone()));
            if !same {
                let forged = forged(&whole, "metrics.jsonl", "/metrics", metrics);
                look(&format!("{what}, forged"), &forged);
            }
        }
    }
    for (what, ledger) in changed(&text("ledger.json")) {
        look(&format!("ledger {what}"), &with(&whole, "ledger.json", ledger.clone()));
        if !says_the_same(&text("ledger.json"), &what) {
            let forged = forged(&whole, "ledger.json", "/ledger", ledger);
            look(&format!("ledger {what}, forged"), &forged);
        }
    }
    let best = best_name(&whole);
    for (name, field) in [("checkpoint.safetensors", "/checkpoint"), (&*best, "/best/checkpoint")] {
        for (what, bytes) in changed_checkpoints(&whole[name], true) {
            look(&format!("{name} {what}"), &with(&whole, name, bytes));
        }
        for (what, bytes) in changed_checkpoints(&whole[name], false) {
            look(&format!("{name} {what}, forged"), &forged(&whole, name, field, bytes));
        }
    }
    let config = text("config.toml");
    look("config", &with(&whole, "config.toml", config.replace("seed = 1", "seed = 2")));
    look("config, a comment", &with(&whole, "config.toml", format!("{config}\n# more\n")));
    for name in [
        "config.toml",
        "receipt.json",
        "metrics.jsonl",
        "ledger.json",
        "checkpoint.safetensors",
        &best,
    ] {
        let mut without = whole.clone();
        without.remove(name);
        look(&format!("{name} missing"), &without);
    }
    // what depends on the machine is told to be so, and is no part of the proof
    assert!(!is_found(work.path(), &with(&whole, "timing.json", "{}")), "seconds prove nothing");
    println!("{count} changes, all found");
    assert!(count > 3000, "{count}");
}

#[test]
fn every_result_of_a_policy_is_verified() {
    let work = tempfile::tempdir().unwrap();
    let whole = made_of(TINY, true);
    assert!(!is_found(work.path(), &whole) && is_read(work.path(), &whole), "an untouched run");
    let text = |name: &str| String::from_utf8(whole[name].clone()).unwrap();
    for (what, receipt) in changed(&text("receipt.json")) {
        if what.starts_with("/test") || what.starts_with("/data") {
            let files = with(&whole, "receipt.json", receipt);
            assert!(is_found(work.path(), &files), "not found: receipt {what}");
        }
    }
    let metrics = text("metrics.jsonl");
    let last = metrics.lines().last().unwrap();
    for (what, other) in changed(last).into_iter().filter(|(what, _)| what.starts_with("/outcome"))
    {
        let forged = forged(&whole, "metrics.jsonl", "/metrics", metrics.replace(last, &other));
        assert!(is_found(work.path(), &forged), "not found: record {what}, forged");
    }
    let name = "checkpoint.safetensors";
    let own = |what: &str| ["environment", "policy", "row_means"].iter().any(|w| what.contains(w));
    let all = changed_checkpoints(&whole[name], false);
    let own: Vec<_> = all.into_iter().filter(|(what, _)| own(what)).collect();
    assert!(!own.is_empty(), "a policy has a state of its own");
    for (what, bytes) in own {
        let forged = forged(&whole, name, "/checkpoint", bytes);
        assert!(is_found(work.path(), &forged), "not found: {what}, forged");
    }
}

#[test]
fn a_record_more_behind_the_last_one_is_found() {
    let work = tempfile::tempdir().unwrap();
    let whole = made(true);
    let metrics = String::from_utf8(whole["metrics.jsonl"].clone()).unwrap();
    let last = metrics.lines().last().unwrap();
    for more in [format!("{last}\n"), "{}".into(), "\n".into()] {
        let files = with(&whole, "metrics.jsonl", format!("{metrics}{more}"));
        assert!(is_found(work.path(), &files), "{more}");
    }
}

/// A store of two runs and the folder of the first.
fn store_of_two(place: &Path) -> PathBuf {
    let file = place.with_extension("toml");
    fs::write(&file, STORED).unwrap();
    let ran = run_program(
        dalean().arg("sweep").arg(&file).args(["--keep-states", "--json", "--store"]).arg(place),
    );
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let store = Store::existing(place).unwrap();
    let (key, ..) = store.rows().unwrap().swap_remove(0);
    store.folder(&key)
}

const STORED: &str = "base.data.set = 'xor'\nbase.network.hidden = [3]\nbase.learning.epochs = 1\n\
                      base.learning.batch = 2\nbase.learning.select = 'best_validation'\n\
                      [[axis]]\nkey = 'seed'\nname = 'draw'\nvalues = [1, 2]\n";

/// Whether doing all runs of a store again shows that something is wrong.
fn is_found_in(store: &Path) -> bool {
    let store = Store::existing(store).unwrap();
    let mut wrong = 0;
    let mut look = |_: usize, sampled: &Sampled| wrong += usize::from(!sampled.finding.holds());
    let outcome = sample(&store, 9, 1, &root(), machine(), &mut look, &mut |_| true);
    wrong > 0 || outcome.is_err()
}

/// A copy of a folder and all that is in it.
fn copy_all(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let place = to.join(entry.file_name());
        if entry.file_type().unwrap().is_dir() {
            copy_all(&entry.path(), &place);
        } else {
            fs::copy(entry.path(), place).unwrap();
        }
    }
}

#[test]
fn every_forgery_is_found_in_a_store_after_its_index_is_made_again_and_after_it_has_moved() {
    let work = tempfile::tempdir().unwrap();
    let place = work.path().join("store");
    let folder = store_of_two(&place);
    let inside = folder.strip_prefix(&place).unwrap().to_owned();
    let whole = files(&folder);
    assert!(!is_found_in(&place), "an untouched store");
    let moved = work.path().join("elsewhere").join("store");
    copy_all(&place, &moved);
    assert!(!is_found_in(&moved), "an untouched store that has moved");
    let index = fs::read(place.join("index.sqlite")).unwrap();

    let text = |name: &str| String::from_utf8(whole[name].clone()).unwrap();
    let mut forgeries: Vec<(String, Files)> = Vec::new();
    for (what, receipt) in changed(&text("receipt.json")) {
        forgeries.push((format!("receipt {what}"), with(&whole, "receipt.json", receipt)));
    }
    let metrics = text("metrics.jsonl");
    let last = metrics.lines().last().unwrap();
    for (what, other) in changed(last) {
        let metrics = metrics.replace(last, &other);
        if says_the_same(last, &what) {
            continue;
        }
        forgeries.push((format!("record {what}"), with(&whole, "metrics.jsonl", metrics.clone())));
        let forged = forged(&whole, "metrics.jsonl", "/metrics", metrics);
        forgeries.push((format!("record {what}, forged"), forged));
    }
    for (what, ledger) in changed(&text("ledger.json")) {
        if !says_the_same(&text("ledger.json"), &what) {
            let forged = forged(&whole, "ledger.json", "/ledger", ledger);
            forgeries.push((format!("ledger {what}, forged"), forged));
        }
    }
    for (what, bytes) in changed_checkpoints(&whole["checkpoint.safetensors"], false) {
        let forged = forged(&whole, "checkpoint.safetensors", "/checkpoint", bytes);
        forgeries.push((format!("checkpoint {what}, forged"), forged));
    }
    let mut flipped = whole["checkpoint.safetensors"].clone();
    let middle = flipped.len() / 2;
    flipped[middle] ^= 1;
    forgeries.push(("a flipped byte".into(), with(&whole, "checkpoint.safetensors", flipped)));
    let config = text("config.toml").replace("batch = 2", "batch = 1");
    assert_ne!(config, text("config.toml"));
    forgeries.push(("config".into(), with(&whole, "config.toml", config)));
    for name in
        ["config.toml", "receipt.json", "metrics.jsonl", "ledger.json", "checkpoint.safetensors"]
    {
        let mut without = whole.clone();
        without.remove(name);
        forgeries.push((format!("{name} missing"), without));
    }

    let mut count = 0;
    for (number, (what, files)) in forgeries.iter().enumerate() {
        // every one in the store, and every few on the longer ways
        lay(&folder, files);
        assert!(is_found_in(&place), "not found in the store: {what}");
        count += 1;
        if number % 7 != 0 && !what.ends_with("missing") && !what.starts_with("config") {
            continue;
        }
        let made = reindex(&mut Store::with_runs(&place).unwrap(), &mut |_, _| {}).unwrap();
        let told = !made.damaged.is_empty() || made.unfinished + made.forgotten > 0;
        assert!(told || is_found_in(&place), "not found after `store index`: {what}");
        // who asks the store again finds it still, unless there is no receipt that could claim anything
        let gone = what.starts_with("receipt.json missing");
        assert!(gone || is_found_in(&place), "hidden by `store index`: {what}");
        fs::write(place.join("index.sqlite"), &index).unwrap();
        lay(&moved.join(&inside), files);
        assert!(is_found_in(&moved), "not found after the store has moved: {what}");
        let alone = work.path().join("alone");
        lay(&alone, files);
        let verdict = run::verify(&alone, &root(), machine(), None, &mut |_| true);
        assert!(
            !matches!(verdict, Ok(Verdict::Same { .. })),
            "not found in a moved folder: {what}"
        );
        count += 3;
    }
    println!("{} forgeries, found {count} times", forgeries.len());
    assert!(count > 500, "{count}");
}

#[test]
fn what_eval_leans_on_is_checked_by_it() {
    let work = tempfile::tempdir().unwrap();
    let whole = made(true);
    let text = |name: &str| String::from_utf8(whole[name].clone()).unwrap();
    // of the receipt, what says how it ended and what else is kept is not what eval reads
    let apart = ["/status", "/ledger", "/states", "/notes", "/checkpoint"];
    let mut count = 0;
    for (what, receipt) in changed(&text("receipt.json")) {
        if apart.iter().any(|field| what.starts_with(field)) {
            continue;
        }
        count += 1;
        assert!(!is_read(work.path(), &with(&whole, "receipt.json", receipt)), "receipt {what}");
    }
    let best = best_name(&whole);
    for (what, bytes) in changed_checkpoints(&whole[&best], true) {
        count += 1;
        assert!(!is_read(work.path(), &with(&whole, &best, bytes)), "{best} {what}");
    }
    // whoever makes content and receipt right again still has another state than the file names
    for (what, bytes) in changed_checkpoints(&whole[&best], false) {
        if what.contains("levels, byte") {
            count += 1;
            let forged = forged(&whole, &best, "/best/checkpoint", bytes);
            assert!(!is_read(work.path(), &forged), "{best} {what}, forged");
        }
    }
    for line in changed(text("metrics.jsonl").lines().next().unwrap()) {
        let metrics = text("metrics.jsonl");
        let (_, rest) = metrics.split_once('\n').unwrap();
        let metrics = format!("{}\n{rest}", line.1);
        count += 1;
        assert!(!is_read(work.path(), &with(&whole, "metrics.jsonl", metrics)), "{}", line.0);
    }
    assert!(count > 300, "{count}");
}

#[test]
fn what_a_run_goes_on_from_is_checked_before() {
    let work = tempfile::tempdir().unwrap();
    let stopped = made(false);
    assert!(is_resumed(work.path(), &stopped), "an untouched run goes on");
    assert_eq!(files(&work.path().join("run"))["receipt.json"], made(true)["receipt.json"]);
    let text = |name: &str| String::from_utf8(stopped[name].clone()).unwrap();
    let mut count = 0;
    for (what, receipt) in changed(&text("receipt.json")) {
        // whether states stay is said anew
        if what.starts_with("/states changed") {
            continue;
        }
        count += 1;
        assert!(
            !is_resumed(work.path(), &with(&stopped, "receipt.json", receipt)),
            "receipt {what}"
        );
    }
    for name in ["checkpoint.safetensors".to_owned(), best_name(&stopped)] {
        for (what, bytes) in changed_checkpoints(&stopped[&name], true) {
            count += 1;
            assert!(!is_resumed(work.path(), &with(&stopped, &name, bytes)), "{name} {what}");
        }
    }
    let last = "checkpoint.safetensors";
    for (what, bytes) in changed_checkpoints(&stopped[last], false) {
        if what.contains("levels, byte") {
            count += 1;
            let forged = forged(&stopped, last, "/checkpoint", bytes);
            assert!(!is_resumed(work.path(), &forged), "{last} {what}, forged");
        }
    }
    let metrics = text("metrics.jsonl");
    let lines: Vec<&str> = metrics.lines().collect();
    for (what, other) in changed(lines[0]) {
        count += 1;
        let metrics = [&[&*other], &lines[1..]].concat().join("\n") + "\n";
        assert!(!is_resumed(work.path(), &with(&stopped, "metrics.jsonl", metrics)), "{what}");
    }
    assert!(count > 300, "{count}");
}

#[test]
fn a_state_that_is_not_the_one_its_file_names_is_not_restored() {
    let config = load(&Sources { experiment: Some(("it", EVERYTHING)), ..Sources::default() });
    let config = config.unwrap();
    let data = dalean::lab::data::load(&config.source().unwrap(), &root()).unwrap();
    let mut session = run::Session::new(&config, data, machine()).unwrap();
    let whole = session.checkpoint();
    session.restore(&whole).unwrap();
    let mut count = 0;
    for (what, bytes) in changed_checkpoints(&whole, false) {
        if what.contains("levels, byte") {
            count += 1;
            let error = session.restore(&bytes).expect_err(&what).to_string();
            assert!(error.contains("state_hash") || error.contains("holds"), "{what}: {error}");
        }
    }
    assert!(count > 4, "{count}");
}
