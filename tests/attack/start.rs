//! One start: something is damaged, the program is asked for something, under some limit, and judged.

use std::ffi::OsString;
use std::fs;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use super::ask::{Answer, Ask, asked};
use super::chance::Chance;
use super::world::{self, World, copy};

/// How long a start may take before it is interrupted, and how long it may then take to end.
const PATIENCE: Duration = Duration::from_secs(10);

/// What a start came to.
pub(crate) struct Judgement {
    pub(crate) kind: String,
    pub(crate) end: String,
    pub(crate) failure: Option<String>,
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
