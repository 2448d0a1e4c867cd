//! What a start is made of: what is damaged, and what the program is then asked for.

use std::ffi::OsString;
use std::fs;
use std::os::unix::ffi::OsStringExt;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::chance::Chance;
use super::world::{self, World, copy, files};

/// What the program is asked for, and how its answer is told.
pub(crate) struct Ask {
    pub(crate) arguments: Vec<OsString>,
    pub(crate) answer: Answer,
}

pub(crate) enum Answer {
    /// Standard output ends with a JSON object that has this `event`.
    Event(&'static str),
    /// This file is there, and is no part of something.
    File(PathBuf),
    /// Standard output holds something.
    Words,
}

fn words(text: &str) -> Vec<OsString> {
    text.split_whitespace().map(OsString::from).collect()
}

/// Lays out what is damaged and says what the program is asked for.
pub(crate) fn asked(world: &World, chance: &mut Chance, here: &Path) -> (&'static str, Ask) {
    let write = |name: &str, bytes: &[u8]| put(&here.join(name), bytes);
    let read = |name: &str| fs::read_to_string(world.made(name)).unwrap();
    match chance.below(10) {
        0 => {
            write("experiment.toml", &chance.text(&read("experiment.toml")));
            let (line, event) = [
                ("train experiment.toml --json --out runs", "done"),
                ("train experiment.toml --json --out runs --hw reram", "done"),
                ("train experiment.toml --json --out runs --threads 2", "done"),
                ("trace experiment.toml --json --vcd wave.vcd --perfetto wave.json", "trace"),
            ][chance.below(4)];
            ("configuration", Ask { arguments: words(line), answer: Answer::Event(event) })
        }
        1 => {
            let keys = [
                "network.hidden",
                "network.alpha",
                "network.weight_max",
                "learning.epochs",
                "learning.batch",
                "learning.rate",
                "learning.taps",
                "learning.tap_shift",
                "learning.rate_mantissa",
                "hw.cell.level_bits",
                "hw.cell.floor",
                "hw.tile.rows",
                "hw.tile.columns",
                "hw.tile.count",
                "hw.drive.bits",
                "hw.adc.bits",
                "hw.lut.bits",
                "hw.error.bits",
                "hw.write.increment_max",
                "hw.timing.clock_mhz",
                "hw.timing.lanes",
                "data.set",
                "seed",
                "hw.name",
                "hw.model",
                "hw.energy.hold_fj.low",
                "learning.rule",
                "learning.route",
                "more.than.there.is",
            ];
            write("experiment.toml", world::EXPERIMENT.as_bytes());
            let mut arguments = words("train experiment.toml --json --out runs");
            for _ in 0..=chance.below(2) {
                let value = match chance.below(4) {
                    0 => format!("[{}, {}]", chance.number(), chance.number()),
                    1 => format!("\"{}\"", chance.number()),
                    _ => chance.number(),
                };
                arguments.push("--set".into());
                arguments.push(format!("{}={value}", chance.of(&keys)).into());
            }
            ("settings", Ask { arguments, answer: Answer::Event("done") })
        }
        2 => {
            let models = concat!(env!("CARGO_MANIFEST_DIR"), "/hw_models");
            let name = chance.of(&["ideal", "reram", "neurram", "hermes", "mrr", "sram"]);
            let text = fs::read_to_string(format!("{models}/{name}.toml")).unwrap();
            write("chip.toml", &chance.text(&text));
            write(
                "experiment.toml",
                world::EXPERIMENT.split("[hw.").next().unwrap_or_default().as_bytes(),
            );
            let (line, answer) = match chance.below(4) {
                0 => ("hw check chip.toml", Answer::Words),
                1 => ("hw show chip.toml", Answer::Words),
                2 => ("profile experiment.toml --hw chip.toml", Answer::Words),
                _ => (
                    "train experiment.toml --hw chip.toml --json --out runs",
                    Answer::Event("done"),
                ),
            };
            ("chip", Ask { arguments: words(line), answer })
        }
        3 => {
            let table = read("table.csv");
            write("table.csv", &chance.text(&table));
            let own = read("own.toml");
            let own = if chance.one_in(4) { chance.text(&own) } else { own.into_bytes() };
            write("own.toml", &own);
            if chance.one_in(6) {
                let _ = fs::remove_file(here.join("table.csv"));
                link_or_pipe(chance, &here.join("table.csv"), &world.made("table.csv"));
            }
            let arguments = words("train own.toml --json --out runs");
            ("own data", Ask { arguments, answer: Answer::Event("done") })
        }
        4 | 5 => {
            copy(&world.made("run"), &here.join("run"));
            damage_run(world, chance, &here.join("run"));
            let (line, answer) = match chance.below(9) {
                7 => ("runs . --json", Answer::Event("done")),
                8 => ("compare run run --json", Answer::Words),
                0 | 1 => ("verify run --json", Answer::Event("done")),
                2 => ("report run --json", Answer::Event("report")),
                3 => ("price run", Answer::Words),
                4 => ("eval run --json", Answer::Event("done")),
                5 => ("price run --hw isaac", Answer::Words),
                _ => ("train --resume run --json", Answer::Event("done")),
            };
            ("run folder", Ask { arguments: words(line), answer })
        }
        6 | 7 => {
            copy(&world.made("store"), &here.join("store"));
            write("sweep.toml", world::SWEEP.as_bytes());
            damage_store(world, chance, &here.join("store"));
            let (line, answer) = match chance.below(9) {
                0 => ("report store --json", Answer::Event("report")),
                1 => {
                    ("export store --out table.json --json", Answer::File(here.join("table.json")))
                }
                2 => ("export store", Answer::Words),
                3 => ("store list store", Answer::Words),
                4 => ("store index store --json", Answer::Event("done")),
                5 => ("store merge into store --json", Answer::Event("done")),
                6 => ("verify store --sample 2 --sample-seed 1 --json", Answer::Event("done")),
                7 => (
                    "export store --format parquet --out table.parquet",
                    Answer::File(here.join("table.parquet")),
                ),
                _ => ("sweep sweep.toml --store store --json", Answer::Event("done")),
            };
            ("store", Ask { arguments: words(line), answer })
        }
        8 => {
            let text = read("sweep.toml");
            let text = if chance.one_in(3) {
                chance.text(&text)
            } else {
                filtered(chance, &text).into_bytes()
            };
            write("sweep.toml", &text);
            let line = if chance.one_in(3) { " --dry-run" } else { "" };
            let line = format!("sweep sweep.toml --store store --json --threads 2{line}");
            ("sweep", Ask { arguments: words(&line), answer: Answer::Event("done") })
        }
        _ => {
            write("experiment.toml", world::EXPERIMENT.as_bytes());
            let commands = [
                "train",
                "eval",
                "verify",
                "sweep",
                "export",
                "store",
                "profile",
                "price",
                "report",
                "data",
                "hw",
                "trace",
                "bench",
                "completions",
                "help",
                "--version",
                "--help",
                "",
            ];
            let more = [
                "--json",
                "--quiet",
                "--out",
                "runs",
                "--set",
                "seed=2",
                "--threads",
                "--kernel",
                "scalar",
                "--seed",
                "--hw",
                "experiment.toml",
                "list",
                "show",
                "check",
                "index",
                "merge",
                "fetch",
                "--sample",
                "--vcd",
                "w.vcd",
                "--tile",
                "--update",
                "--epochs",
                "bash",
                "--dry-run",
                "--shard",
                "1/2",
                "--format",
                "csv",
                "../outside",
                "/dev/null",
                "--",
                "-",
                "runs",
                "nothing",
            ];
            let mut arguments = vec![OsString::from(chance.of(&commands))];
            for _ in 0..chance.below(6) {
                arguments.push(match chance.below(9) {
                    0 => chance.number().into(),
                    1 => OsString::from_vec(vec![0xFF, 0xFE, b'x']),
                    2 => "x".repeat(chance.below(5000)).into(),
                    _ => chance.of(&more).into(),
                });
            }
            ("arguments", Ask { arguments, answer: Answer::Words })
        }
    }
}

/// A sweep with conditions and sizes that somebody may try.
fn filtered(chance: &mut Chance, text: &str) -> String {
    let filters = [
        "\"a\".pad(1000000000, \"b\") == rule",
        "sleep(10)",
        "eval(\"1\") == 1",
        "loop { }",
        "bits ** 999999999 > 1",
        "((((((((((bits))))))))))>3",
        "bits in [1,2,3,8]",
        "rule in \"edbp\"",
        "bits / 0 == 1",
        "!(bits > 3)",
        "-bits < 0",
        "9223372036854775807 + bits > 0",
        "bits %  3 == 2",
        "1e308 * 1e308 > bits",
        "é",
        "true",
        "",
        "rule + 1 > 2",
    ];
    let text =
        text.replace("bits >= 2 ||", &format!("{} ||", chance.of(&filters).replace('"', "\\\"")));
    match chance.below(4) {
        0 => text.replace("seeds = [1]", &format!("seeds = {}", chance.number())),
        1 => text.replace(
            "values = [3, 8]",
            &format!("from = {}\nto = {}", chance.number(), chance.number()),
        ),
        2 => text.replace("key = \"hw.cell.level_bits\"", "key = \"learning.rule\""),
        _ => text,
    }
}

/// Writes a file of the folder, in place of what lies there: damage never leaves it through a link.
fn put(place: &Path, bytes: impl AsRef<[u8]>) {
    if fs::symlink_metadata(place).is_ok_and(|found| !found.is_file()) {
        let _ = fs::remove_file(place).or_else(|_| fs::remove_dir_all(place));
    }
    let _ = fs::write(place, bytes);
}

/// Whether a folder lies there, and no link to one.
fn is_folder(place: &Path) -> bool {
    fs::symlink_metadata(place).is_ok_and(|found| found.is_dir())
}

/// What lies in a plain file there.
fn plain(place: &Path) -> Option<Vec<u8>> {
    fs::symlink_metadata(place).is_ok_and(|found| found.is_file()).then(|| fs::read(place).ok())?
}

/// A link out of the folder, or a pipe.
fn link_or_pipe(chance: &mut Chance, place: &Path, far: &Path) {
    match chance.below(3) {
        0 => drop(Command::new("mkfifo").arg(place).status()),
        1 => drop(fs::create_dir(place)),
        _ => drop(symlink(far, place)),
    }
}

fn damage_run(world: &World, chance: &mut Chance, folder: &Path) {
    let mut names: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    for _ in 0..=chance.below(2) {
        let name = &names[chance.below(names.len())];
        let place = folder.join(name);
        match chance.below(6) {
            0 => drop(fs::remove_file(&place)),
            1 => {
                let _ = fs::remove_file(&place);
                let far = world.root.join("outside").join(chance.of(&[
                    "precious",
                    "config.toml",
                    "nothing",
                ]));
                link_or_pipe(chance, &place, &far);
            }
            2 => {
                let names = [".part-abcdef", ".dalean-part-abcdef", "more", "lock"];
                put(&folder.join(chance.of(&names)), "?");
            }
            3 => {
                let receipt = plain(&folder.join("receipt.json")).unwrap_or_default();
                let receipt = String::from_utf8_lossy(&receipt).replace("finished", "running");
                put(&folder.join("receipt.json"), receipt);
            }
            _ => {
                let Some(bytes) = plain(&place) else { continue };
                let bytes = match String::from_utf8(bytes) {
                    Ok(text) => chance.text(&text),
                    Err(error) => chance.bytes(error.as_bytes()),
                };
                put(&place, bytes);
            }
        }
    }
}

fn damage_store(world: &World, chance: &mut Chance, store: &Path) {
    let runs: Vec<PathBuf> = files(&store.join("runs")).into_keys().collect();
    let outside = world.root.join("outside");
    for _ in 0..=chance.below(2) {
        match chance.below(7) {
            0 | 1 => {
                if plain(&store.join("index.sqlite")).is_none() {
                    continue;
                }
                let Ok(index) = rusqlite::Connection::open(store.join("index.sqlite")) else {
                    continue;
                };
                let text = [
                    "UPDATE sweep SET name = '../outside/x'",
                    "UPDATE point SET sweep = '../outside/x'",
                    "UPDATE sweep SET name = '/tmp/x'",
                    "UPDATE point SET key = 'a'",
                    "UPDATE point SET key = ''",
                    "UPDATE run SET key = 'é'",
                    "UPDATE run SET row = '{}'",
                    "UPDATE run SET row = x'ff'",
                    "UPDATE point SET axes = '[]'",
                    "UPDATE point SET axes = '[1, 2, 3]'",
                    "UPDATE point SET number = -1",
                    "UPDATE point SET number = 5000000000",
                    "UPDATE point SET seed = -1",
                    "DELETE FROM run",
                    "DELETE FROM point",
                    "DELETE FROM sweep",
                    "UPDATE sweep SET text = ''",
                    "UPDATE sweep SET text = replace(text, 'small', '../x')",
                    "UPDATE sweep SET experiment = '['",
                    "DROP TABLE point",
                    "PRAGMA user_version = 7",
                    "UPDATE point SET key = NULL",
                    "INSERT INTO sweep VALUES ('..', '', '')",
                    "UPDATE run SET row = replace(row, '0.', '1.')",
                    "CREATE TRIGGER t AFTER INSERT ON run BEGIN DELETE FROM sweep; END",
                ];
                let _ = index.execute_batch(chance.of(&text));
            }
            2 => {
                let place = store.join("index.sqlite");
                if chance.one_in(2) {
                    let bytes = chance.bytes(&plain(&place).unwrap_or_default());
                    put(&place, bytes);
                } else {
                    let _ = fs::remove_file(&place);
                    if chance.one_in(2) {
                        link_or_pipe(chance, &place, &outside.join("index.sqlite"));
                    }
                }
            }
            3 => {
                let name = chance.of(&["figures", "runs", "small.html"]);
                let place = store.join(name);
                if fs::symlink_metadata(&place).is_ok_and(|found| found.is_symlink()) {
                    let _ = fs::remove_file(&place);
                }
                let _ = fs::remove_dir_all(&place).or_else(|_| fs::remove_file(&place));
                let far = outside.join(chance.of(&["figures", "precious"]));
                link_or_pipe(chance, &place, &far);
            }
            _ => {
                let Some(run) = runs[chance.below(runs.len())].parent().map(Path::to_path_buf)
                else {
                    continue;
                };
                match chance.below(4) {
                    0 if is_folder(&run) => drop(fs::remove_dir_all(&run)),
                    1 => {
                        if is_folder(&run) {
                            let _ = fs::remove_dir_all(&run);
                        }
                        let _ = symlink(&outside, &run);
                    }
                    _ if is_folder(&run) => damage_run(world, chance, &run),
                    _ => {}
                }
            }
        }
    }
}
