//! One start: something is damaged, the program is asked for something, under some limit, and judged.

use std::ffi::OsString;
use std::fs;
use std::os::unix::ffi::OsStringExt;
use std::os::unix::fs::symlink;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use super::chance::Chance;
use super::world::{self, World, copy, files};

/// How long a start may take before it is interrupted, and how long it may then take to end.
const PATIENCE: Duration = Duration::from_secs(10);

/// What a start came to.
pub(crate) struct Judgement {
    pub(crate) kind: String,
    pub(crate) end: String,
    pub(crate) failure: Option<String>,
}

/// What the program is asked for, and how its answer is told.
struct Ask {
    arguments: Vec<OsString>,
    answer: Answer,
}

enum Answer {
    /// Standard output ends with a JSON object that has this `event`.
    Event(&'static str),
    /// This file is there, and is no part of something.
    File(PathBuf),
    /// Standard output holds something.
    Words,
}

/// Where the program finds itself.
#[derive(Clone, Copy, PartialEq)]
enum Around {
    Plain,
    FileLimit(usize),
    MemoryLimit(usize),
    ProcessLimit,
    DescriptorLimit(usize),
    OutputFull,
    ErrorsFull,
    OutputClosed,
    ErrorsClosed,
    NobodyReads,
    FullDisk,
    Killed(u64),
    Interrupted(u64),
}

impl Around {
    fn draw(chance: &mut Chance, world: &World) -> Self {
        match chance.below(24) {
            0..=9 => Self::Plain,
            10 | 11 => Self::FileLimit([0, 1, 4, 16, 64][chance.below(5)]),
            12 => Self::MemoryLimit([60_000, 120_000, 200_000, 400_000][chance.below(4)]),
            13 => Self::ProcessLimit,
            14 => Self::DescriptorLimit([4, 6, 9, 16][chance.below(4)]),
            15 => Self::OutputFull,
            16 => Self::ErrorsFull,
            17 => Self::OutputClosed,
            18 => Self::ErrorsClosed,
            19 => Self::NobodyReads,
            20 | 21 if world.disk.is_some() => Self::FullDisk,
            22 => Self::Interrupted(chance.next() % 60),
            _ => Self::Killed(chance.next() % 60),
        }
    }

    const fn name(self) -> &'static str {
        match self {
            Self::Plain => "plain",
            Self::FileLimit(_) => "file limit",
            Self::MemoryLimit(_) => "memory limit",
            Self::ProcessLimit => "process limit",
            Self::DescriptorLimit(_) => "descriptor limit",
            Self::OutputFull => "output full",
            Self::ErrorsFull => "errors full",
            Self::OutputClosed => "output closed",
            Self::ErrorsClosed => "errors closed",
            Self::NobodyReads => "nobody reads",
            Self::FullDisk => "full disk",
            Self::Killed(_) => "killed",
            Self::Interrupted(_) => "interrupted",
        }
    }

    /// What a shell does before and behind the program.
    fn shell(self) -> (String, &'static str) {
        match self {
            Self::FileLimit(blocks) => (format!("ulimit -f {blocks};"), ""),
            Self::MemoryLimit(kib) => (format!("ulimit -v {kib};"), ""),
            // the superuser has no such limit, so nobody in particular is asked to start it
            Self::ProcessLimit => ("ulimit -u 1;".into(), ""),
            Self::DescriptorLimit(count) => (format!("ulimit -n {count};"), ""),
            Self::OutputFull => (String::new(), ">/dev/full"),
            Self::ErrorsFull => (String::new(), "2>/dev/full"),
            Self::OutputClosed => (String::new(), ">&-"),
            Self::ErrorsClosed => (String::new(), "2>&-"),
            Self::NobodyReads => (String::new(), "> >(exec true) 2> >(exec true)"),
            _ => (String::new(), ""),
        }
    }
}

pub(crate) fn start(world: &World, chance: &mut Chance, number: u64) -> Judgement {
    let around = Around::draw(chance, world);
    let place = match (&world.disk, around) {
        (Some(disk), Around::FullDisk) => disk.clone(),
        _ => world.root.join("work"),
    };
    let here = place.join(format!("start-{number}"));
    let _ = fs::remove_dir_all(&here);
    fs::create_dir(&here).unwrap();
    let (kind, ask) = asked(world, chance, &here);
    if around == Around::FullDisk {
        // as much as fits, less a little
        let room = chance.below(80) * 1024;
        let _ = Command::new("bash")
            .arg("-c")
            .arg("head -c 1M /dev/zero > filler 2>/dev/null; size=$(stat -c %s filler); truncate -s $((size > $0 ? size - $0 : 0)) filler")
            .arg(room.to_string())
            .current_dir(&here)
            .status();
    }
    let ended = carry_out(&here, &ask, around);
    let failure =
        judge(&here, &ask, around, &ended).or_else(|| world.changed_outside()).map(|failure| {
            let arguments: Vec<_> =
                ask.arguments.iter().map(|a| a.to_string_lossy().into_owned()).collect();
            let errors: String = ended.errors.chars().take(600).collect();
            format!("{failure}\n    {} dalean {}\n    {errors}", around.name(), arguments.join(" "))
        });
    if failure.is_none() || std::env::var_os("ATTACK_KEEP").is_none() {
        let _ = fs::remove_dir_all(&here);
    } else {
        let kept = std::env::temp_dir().join(format!("attack-{number}"));
        let _ = fs::remove_dir_all(&kept);
        copy(&here, &kept);
    }
    let end = match (ended.status.code(), ended.status.signal()) {
        (Some(code), _) => format!("with {code}"),
        (None, Some(signal)) => format!("by signal {signal}"),
        (None, None) => "somehow".into(),
    };
    Judgement { kind: format!("{kind}, {}", around.name()), end, failure }
}

fn words(text: &str) -> Vec<OsString> {
    text.split_whitespace().map(OsString::from).collect()
}

/// Lays out what is damaged and says what the program is asked for.
fn asked(world: &World, chance: &mut Chance, here: &Path) -> (&'static str, Ask) {
    let put = |name: &str, bytes: &[u8]| drop(fs::write(here.join(name), bytes));
    let read = |name: &str| fs::read_to_string(world.made(name)).unwrap();
    match chance.below(10) {
        0 => {
            put("experiment.toml", &chance.text(&read("experiment.toml")));
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
            put("experiment.toml", world::EXPERIMENT.as_bytes());
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
            put("chip.toml", &chance.text(&text));
            put(
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
            put("table.csv", &chance.text(&table));
            let own = read("own.toml");
            let own = if chance.one_in(4) { chance.text(&own) } else { own.into_bytes() };
            put("own.toml", &own);
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
            put("sweep.toml", world::SWEEP.as_bytes());
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
            put("sweep.toml", &text);
            let line = if chance.one_in(3) { " --dry-run" } else { "" };
            let line = format!("sweep sweep.toml --store store --json --threads 2{line}");
            ("sweep", Ask { arguments: words(&line), answer: Answer::Event("done") })
        }
        _ => {
            put("experiment.toml", world::EXPERIMENT.as_bytes());
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
            2 => drop(fs::write(
                folder.join(chance.of(&[".part-abcdef", ".dalean-part-abcdef", "more", "lock"])),
                "?",
            )),
            3 => {
                let receipt = fs::read_to_string(folder.join("receipt.json")).unwrap_or_default();
                drop(fs::write(
                    folder.join("receipt.json"),
                    receipt.replace("finished", "running"),
                ));
            }
            _ => {
                let Ok(bytes) = fs::read(&place) else { continue };
                let bytes = match String::from_utf8(bytes) {
                    Ok(text) => chance.text(&text),
                    Err(error) => chance.bytes(error.as_bytes()),
                };
                drop(fs::write(&place, bytes));
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
                    let bytes = chance.bytes(&fs::read(&place).unwrap_or_default());
                    let _ = fs::write(&place, bytes);
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
                    0 => drop(fs::remove_dir_all(&run)),
                    1 => {
                        let _ = fs::remove_dir_all(&run);
                        let _ = symlink(&outside, &run);
                    }
                    _ if run.is_dir() => damage_run(world, chance, &run),
                    _ => {}
                }
            }
        }
    }
}

/// How a start ended.
struct Ended {
    status: ExitStatus,
    output: Vec<u8>,
    errors: String,
    /// Whether it took long and was interrupted, and how long it then took.
    interrupted: Option<Duration>,
}

fn carry_out(here: &Path, ask: &Ask, around: Around) -> Ended {
    let (before, behind) = around.shell();
    let program = world::program();
    let mut command = Command::new("bash");
    command
        .arg("-c")
        .arg(format!("{before} exec \"$0\" \"$@\" {behind}"))
        .arg(program.get_program());
    command.args(&ask.arguments).current_dir(here).env_clear();
    command.envs(program.get_envs().filter_map(|(name, value)| Some((name, value?))));
    // answers go to files: a pipe would have to be read meanwhile
    let answers = here.parent().unwrap_or(here).parent().unwrap_or(here).join("work");
    let name = here.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let [output, errors] = ["out", "err"].map(|end| answers.join(format!("{name}.{end}")));
    let [out, err] = [&output, &errors].map(|path| Stdio::from(fs::File::create(path).unwrap()));
    // a limit on files would be one on answers too
    let mut child = if matches!(around, Around::FileLimit(_)) {
        command.stdout(Stdio::piped()).stderr(Stdio::piped())
    } else {
        command.stdout(out).stderr(err)
    }
    .stdin(Stdio::null())
    .spawn()
    .unwrap();
    let readers = [
        child.stdout.take().map(|mut pipe| std::thread::spawn(move || read_all(&mut pipe))),
        child.stderr.take().map(|mut pipe| std::thread::spawn(move || read_all(&mut pipe))),
    ];
    let clock = Instant::now();
    let pid = child.id().to_string();
    let signal =
        |name: &str| drop(Command::new("kill").args([name, &pid]).stderr(Stdio::null()).status());
    match around {
        Around::Killed(after) => {
            std::thread::sleep(Duration::from_millis(after));
            let _ = child.kill();
        }
        Around::Interrupted(after) => {
            std::thread::sleep(Duration::from_millis(after));
            signal("-INT");
        }
        _ => {}
    }
    let mut interrupted = None;
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        match interrupted {
            None if clock.elapsed() > PATIENCE => {
                interrupted = Some(Instant::now());
                signal("-INT");
            }
            Some(since) if since.elapsed() > PATIENCE => {
                let _ = child.kill();
            }
            _ => {}
        }
        std::thread::sleep(Duration::from_millis(2));
    };
    let interrupted = interrupted.map(|since| since.elapsed());
    let [piped_out, piped_err] = readers.map(|reader| reader.map(|reader| reader.join().unwrap()));
    let read = |piped: Option<Vec<u8>>, path: &Path| {
        let bytes = piped.unwrap_or_else(|| fs::read(path).unwrap_or_default());
        let _ = fs::remove_file(path);
        bytes
    };
    let output = read(piped_out, &output);
    let errors = String::from_utf8_lossy(&read(piped_err, &errors)).into_owned();
    Ended { status, output, errors, interrupted }
}

fn read_all(pipe: &mut impl std::io::Read) -> Vec<u8> {
    let mut bytes = Vec::new();
    let _ = pipe.read_to_end(&mut bytes);
    bytes
}

/// What is wrong with how it ended.
fn judge(here: &Path, ask: &Ask, around: Around, ended: &Ended) -> Option<String> {
    let Ended { status, output, errors, interrupted } = ended;
    if errors.contains("panicked") || status.code() == Some(101) {
        return Some("it panicked".into());
    }
    if interrupted.is_some_and(|took| took > PATIENCE) {
        return Some("it did not answer a signal".into());
    }
    match (status.code(), status.signal()) {
        (Some(0), _) => {}
        (Some(1..=100), _) => {
            let heard = !matches!(
                around,
                Around::ErrorsFull | Around::ErrorsClosed | Around::NobodyReads | Around::FullDisk
            );
            let silent = heard && errors.trim().is_empty() && output.is_empty();
            return silent.then(|| "it failed without a word".into());
        }
        // a signal that was sent, before or behind the place where it is caught
        (None, Some(2)) if interrupted.is_some() || matches!(around, Around::Interrupted(_)) => {
            return None;
        }
        (None, Some(9)) if matches!(around, Around::Killed(_)) => return None,
        // nothing is left to say anything with
        (None, Some(6))
            if matches!(around, Around::MemoryLimit(_))
                && errors.contains("memory allocation of") =>
        {
            return None;
        }
        // the shell or the loader did not get far enough to start it
        (Some(126 | 127), _)
            if matches!(
                around,
                Around::MemoryLimit(_) | Around::DescriptorLimit(_) | Around::ProcessLimit
            ) =>
        {
            return None;
        }
        (Some(code), _) => return Some(format!("it ended with {code}")),
        (None, signal) => return Some(format!("it ended by signal {signal:?}")),
    }
    // it says that it is done
    let heard = !matches!(around, Around::OutputFull | Around::OutputClosed | Around::NobodyReads);
    let last = output.trim_ascii_end().rsplit(|&b| b == b'\n').next().unwrap_or_default();
    match &ask.answer {
        _ if around == Around::OutputFull && !quiet(ask) => {
            Some("it says 0 and could not say its answer".into())
        }
        Answer::Event(event) if heard => {
            let found: Option<serde_json::Value> = serde_json::from_slice(last).ok();
            let is = found.as_ref().is_some_and(|found| found["event"] == *event);
            let lost = found.and_then(|found| {
                let place = found["run"].as_str().or_else(|| found["page"].as_str())?.to_owned();
                (!here.join(&place).exists()).then_some(place)
            });
            match lost {
                _ if !is => Some("it says 0 and has no answer".into()),
                Some(place) => Some(format!("it says 0, and {place} is not there")),
                None => None,
            }
        }
        Answer::Words if heard && output.is_empty() && !quiet(ask) => {
            Some("it says 0 and nothing else".into())
        }
        Answer::File(path) => {
            let bytes = fs::read(path).unwrap_or_default();
            let whole = match path.extension().and_then(|ending| ending.to_str()) {
                Some("json") => serde_json::from_slice::<serde_json::Value>(&bytes).is_ok(),
                _ => bytes.starts_with(b"PAR1") && bytes.ends_with(b"PAR1"),
            };
            (!whole).then(|| "it says 0 and left a part of a file".into())
        }
        _ => None,
    }
}

/// Whether it may have been asked to say nothing.
fn quiet(ask: &Ask) -> bool {
    let quiet = |a: &OsString| a == "--quiet" || a == "--out" || a == "--vcd" || a == "-o";
    ask.arguments.iter().any(quiet) && matches!(ask.answer, Answer::Words)
}
